"""``mocapdb build``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from mocapdb.cli._assumed import assumption_lines, shortened
from mocapdb.cli._console import emit_json, megabytes, progress_bar
from mocapdb.cli._options import PATH, json_option
from mocapdb.cli._reader import Reader, reading_options

DEFAULT_MEAN_MM = 1.0


@click.command()
@click.argument("corpus", type=PATH)
@click.option(
    "-o", "--output", "library", required=True, type=PATH,
    help="The library's folder, such as cmu.mocapdb.",
)  # fmt: skip
@click.option("--error", type=float, help="Mean skinned error to keep, in skeleton units.")
@click.option("--mean-mm", type=float, help="Mean vertex distance to keep, in mm (default 1).")
@click.option("--max-mm", type=float, help="Largest vertex distance to keep, in mm.")
@click.option(
    "--codec",
    type=click.Choice(["pose", "okane", "raw"]),
    help="pose: the smallest (default); okane: the thesis's PCA and transform; raw: no loss.",
)
@click.option(
    "--transform",
    type=click.Choice(["auto", "spline", "dct", "dct32", "dct64", "dwt"]),
    default="auto",
    show_default=True,
    help="The transform over time; auto takes the smallest. okane has dct and dwt.",
)
@click.option(
    "--decorrelation",
    type=click.Choice(["auto", "lattice", "none", "pca", "class"]),
    help="How pose relates channels: in the skin's metric (lattice, the default), also by PCA of "
    "each clip or of each class, or the smallest of these (auto, twice as slow).",
)
@click.option(
    "--representation",
    type=click.Choice(["auto", "channels", "positions", "aligned", "scaled", "normalised"]),
    help="What okane transforms, and so takes okane; auto: the smaller of channels and aligned.",
)
@click.option("--labels", type=PATH, help="CSV with clip or path, and label.")
@click.option("--manifest", type=PATH, help="Manifest to label clips from.")
@click.option("--drop-tpose", is_flag=True, help="Leave out a T-pose in front of the motion.")
@click.option("--jobs", type=click.IntRange(min=1), help="Worker processes (default: processors).")
@click.option("--scheduler", metavar="ADDRESS", help="Dask scheduler to work on instead.")
@click.option(
    "--index/--no-index",
    default=None,
    help="Make it ready for query and classify (default: unless it was built without before).",
)
@click.option(
    "--names", metavar="PATTERN",
    help="What files' names say, such as {label}_{style}_{take}.",
)  # fmt: skip
@reading_options
@json_option
def build(
    corpus: Path,
    library: Path,
    error: float | None,
    mean_mm: float | None,
    max_mm: float | None,
    codec: str | None,
    transform: str,
    decorrelation: str | None,
    representation: str | None,
    drop_tpose: bool,
    as_json: bool,
    reader: Reader,
    **options: Any,
) -> None:
    """Build a library from a folder of AMC/ASF, BVH and NPZ files, or bring it up to date.

    Every clip is decoded again and measured: none exceeds the error that you name. Clips that
    are there already are skipped, so an interrupted build goes on when it is run again. A bad
    file is reported and skipped, and the exit code is 1; with --strict nothing is mended, and the
    first bad file ends the build. What was taken for granted of the clips, and what cannot be
    searched, is told at the end.

    What is said of files may stand in a mocapdb.toml in their folder, once for all.

    \b
    Example:
      mocapdb build cmu/ -o cmu.mocapdb --max-mm 5
    """
    from mocapdb.compression.targets import Target, TargetKind
    from mocapdb.library import BuildSettings, build_library

    targets: dict[TargetKind, float | None] = {
        "skinned": error,
        "mean_mm": mean_mm,
        "max_mm": max_mm,
    }
    named = [Target(kind, value) for kind, value in targets.items() if value is not None]
    if len(named) > 1:
        raise click.UsageError("Expected one of --error, --mean-mm and --max-mm, but got more.")
    target = named[0] if named else Target("mean_mm", DEFAULT_MEAN_MM)
    coding = _codec_options(codec, transform, decorrelation, representation)
    settings = BuildSettings(target, coding, drop_tpose)
    with progress_bar("Building") as progress:  # the other options are the function's own
        report = build_library(
            corpus,
            library,
            settings,
            reading=reader.said,
            strict=reader.said.strict,
            **options,
            progress=progress,
        )
    for failure in report.failed:
        where = failure.path if failure.line is None else f"{failure.path}:{failure.line}"
        click.echo(f"skipped {where}: {failure.reason}", err=True)
    if as_json:
        emit_json(report.to_dict())
    elif report.built == 0 and not report.failed:
        click.echo(f"{library}: up to date, nothing to do ({report.skipped} clips).")
    else:
        per_frame = report.payload_bytes / report.frames if report.frames else 0.0
        click.echo(
            f"{library}: built {report.built} clips ({report.frames} frames, "
            f"{megabytes(report.payload_bytes)}, {per_frame:.1f} bytes a frame) "
            f"in {report.seconds:.1f} s; {report.skipped} were there already, "
            f"{len(report.failed)} failed."
        )
    if report.assumed is not None:
        if not as_json and (report.built or report.failed):
            for line in assumption_lines(report.assumed):
                click.echo(line)
        for warning in shortened(report.assumed.warnings):
            click.echo(f"warning: {warning}", err=True)
    if report.failed:
        raise click.exceptions.Exit(1)


def _codec_options(
    codec: str | None, transform: str, decorrelation: str | None, representation: str | None
) -> dict[str, str]:
    """Return the options of `mocapdb.compression.encode`, or refuse those that do not fit."""
    codec = codec or ("pose" if representation is None else "okane")
    if codec == "pose":
        if representation is not None:
            raise click.UsageError("Expected --representation with --codec okane only.")
        return {
            "codec": codec, "transform": transform, "decorrelation": decorrelation or "lattice",
        }  # fmt: skip
    if decorrelation is not None:
        raise click.UsageError("Expected --decorrelation with --codec pose only.")
    if transform not in {"auto", "dct", "dwt"}:
        raise click.UsageError(f"Expected --transform auto, dct or dwt with --codec {codec}.")
    return {"codec": codec, "transform": transform, "representation": representation or "channels"}
