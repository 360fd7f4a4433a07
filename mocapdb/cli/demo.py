"""``mocapdb demo``."""

from __future__ import annotations

from pathlib import Path

import click

from mocapdb.cli._console import emit_json, json_option, megabytes, progress_bar

MEAN_MM = 1.0
EXPORTED = "01_01"


@click.command()
@click.option(
    "--out", "folder", default="demo", show_default=True, type=click.Path(path_type=Path),
    help="Folder to write to.",
)  # fmt: skip
@json_option
def demo(folder: Path, as_json: bool) -> None:
    """Make a small synthetic corpus and do on it what mocapdb does: no data, no network needed.

    The corpus becomes a library; the library is measured, verified, and a clip of it exported.

    \b
    Example:
      mocapdb demo --out demo
    """
    from mocapdb.compression import Target
    from mocapdb.corpus import synthetic
    from mocapdb.io import read_clip
    from mocapdb.library import BuildSettings, Library, build_library
    from mocapdb.motion.skin import motion_error

    corpus, path = folder / "corpus", folder / "demo.mocapdb"
    exported = folder / f"{EXPORTED}.bvh"

    def say(text: str) -> None:
        if not as_json:
            click.echo(text)

    files = synthetic.write_corpus(corpus)
    size = sum(file.stat().st_size for file in corpus.rglob("*") if file.is_file())
    say(f"corpus    {corpus}: {len(files)} synthetic clips in AMC and BVH, {megabytes(size)}")

    with progress_bar("Building") as progress:
        report = build_library(
            corpus, path, BuildSettings(Target("mean_mm", MEAN_MM)), progress=progress
        )
    say(f"library   {path}: {report.built} clips in {report.seconds:.1f} s")

    with Library(path) as library:
        figures = library.info()
        error = figures["error_mm"]
        say(
            f"measured  {figures['bytes_per_frame']:.1f} bytes a frame, "
            f"{figures['ratio_float32']:.1f} times smaller than float32 channels and "
            f"{figures['ratio_source']:.1f} times smaller than the files; vertices are off by "
            f"{error['mean']:.2f} mm in the mean, {error['max']:.1f} mm at most"
        )
        with progress_bar("Verifying") as progress:
            checked = library.verify(progress)
        say(f"verified  {checked['clips'] - len(checked['bad'])} of {checked['clips']} clips sound")

        record = library.export(EXPORTED, exported)
        original = read_clip(corpus / record.source)
        loss = motion_error(original, library.clip(EXPORTED)).vertices
    say(f"exported  {exported}: {record.label}, {record.duration_s:.1f} s, {loss.mean:.2f} mm off")
    say(
        f"\nNow yours:  mocapdb build FOLDER -o NAME.mocapdb\n"
        f"or look at: mocapdb ls {path}   mocapdb info {path} {EXPORTED}"
    )
    if as_json:
        emit_json(
            {
                "corpus": str(corpus),
                "build": report.to_dict(),
                "info": figures,
                "verify": checked,
                "exported": str(exported),
            }
        )
    if report.failed or checked["bad"]:
        raise click.exceptions.Exit(1)
