"""``mocapdb build``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import click

from mocapdb.cli._assumed import assumption_lines, shortened
from mocapdb.cli._console import counted, emit_json, megabytes, progress_bar, shown
from mocapdb.cli._options import PATH, json_option, scheduler_option
from mocapdb.cli._reader import Reader, reading_options

if TYPE_CHECKING:
    from mocapdb.compression import Budgets
    from mocapdb.compression.targets import ByteBudget, Target

DEFAULT_MEAN_MM = 1.0


def _budgets(_: click.Context, __: click.Parameter, text: str | None) -> Budgets | None:
    """Return what ``--budgets R,P,T`` says."""
    from mocapdb.compression import Budgets
    from mocapdb.errors import CodecError

    if text is None:
        return None
    try:
        root, pca, temporal = map(float, text.split(","))
    except ValueError:
        raise click.BadParameter(
            f"expected three numbers such as 0.2,0.7,0.1, but got {text!r}"
        ) from None
    try:
        shares = Budgets(root, pca, temporal)
        shares.check_shares()
    except CodecError as problem:
        raise click.BadParameter(str(problem)) from None
    return shares


def _wavelet(_: click.Context, __: click.Parameter, name: str | None) -> str | None:
    """Return the name of a wavelet that PyWavelets has."""
    from mocapdb.compression.transforms import check_wavelet
    from mocapdb.errors import CodecError

    if name is not None:
        try:
            check_wavelet(name)
        except CodecError as problem:
            raise click.BadParameter(str(problem)) from None
    return name


@click.command()
@click.argument("corpus", type=PATH)
@click.option(
    "-o", "--output", "library", required=True, type=PATH,
    help="The library's folder, such as cmu.mocapdb.",
)  # fmt: skip
@click.option("--error", type=float, help="Mean skinned error to keep, in skeleton units.")
@click.option("--mean-mm", type=float, help="Mean vertex distance to keep, in mm (default 1).")
@click.option(
    "--max-mm", type=float,
    help="Largest vertex distance to keep, in mm; alone, or beside a mean (default 20 times "
    "--mean-mm, none where --joint-share is 0).",
)  # fmt: skip
@click.option(
    "--joint-share", type=float, metavar="S",
    help="How much of its own turning a joint may lose: 0.1 is a tenth of its swing. Less than 0.6 "
    "degrees may always be lost. The root's translation is not meant. Default 0.1; but 0, no "
    "promise, with okane and with --bytes-per-frame. See docs/compression.md.",
)  # fmt: skip
@click.option(
    "--bytes-per-frame", type=float, metavar="N",
    help="Instead of an error, the bytes a frame that a clip may take, at the least mean distance.",
)  # fmt: skip
@click.option(
    "--codec",
    type=click.Choice(["pose", "okane", "raw"]),
    help="pose: the smallest (default); okane: O'Kane's PCA over poses, then DCT or DWT over time, "
    "of aligned positions; raw: no loss.",
)
@click.option(
    "--transform",
    type=click.Choice(["auto", "spline", "dct", "dct32", "dct64", "dwt"]),
    default="auto",
    show_default=True,
    help="The transform over time. auto: of pose, channel by channel what is cheapest of splines "
    "and dct (dct32, dct64 and dwt are not tried); of okane, the smaller of dct and dwt.",
)
@click.option(
    "--decorrelation",
    type=click.Choice(["auto", "lattice", "none", "pca", "class"]),
    help="How channels are related. pose: in the skin's metric (lattice, the default), also by PCA "
    "of each clip or of each class, or the smallest of these (auto, twice as slow). okane: PCA of "
    "each class, or of all clips of a skeleton that have none (class, the default where there are "
    "three), of each clip, none, or the smallest of these.",
)
@click.option(
    "--representation",
    type=click.Choice(["auto", "channels", "positions", "aligned", "scaled", "normalised"]),
    help="What okane transforms, and so takes okane: aligned by default; auto: the smaller of "
    "channels and aligned.",
)
@click.option(
    "--budgets", "shares", metavar="R,P,T", callback=_budgets,
    help="How okane's root, PCA and time divide the target, and so takes okane: 1 together; 0 for "
    "P: no PCA. By default the shares that take the fewest bytes are searched for.",
)  # fmt: skip
@click.option(
    "--wavelet",
    metavar="NAME",
    callback=_wavelet,
    help="The wavelet of okane's dwt, and so takes okane: by PyWavelets' names, such as db4 or "
    "haar (default bior4.4).",
)
@click.option("--labels", type=PATH, help="CSV with clip or path, and label.")
@click.option("--manifest", type=PATH, help="Manifest to label clips from.")
@click.option("--drop-tpose", is_flag=True, help="Leave out a T-pose in front of the motion.")
@click.option("--jobs", type=click.IntRange(min=1), help="Worker processes (default: processors).")
@scheduler_option
@click.option(
    "--index/--no-index",
    default=None,
    help="Make it ready for query and classify (default: unless it was built without before).",
)
@click.option(
    "--names", metavar="PATTERN",
    help="What files' names say, such as {label}_{style}_{take}.",
)  # fmt: skip
@click.option(
    "--rehash",
    is_flag=True,
    help="Read also files that look as they did (size, times), to see whether they have changed.",
)
@click.option(
    "--clean", is_flag=True,
    help="Search all clips for faults, and keep what is repaired beside each as it was captured.",
)  # fmt: skip
@reading_options
@json_option
def build(
    corpus: Path,
    library: Path,
    error: float | None,
    mean_mm: float | None,
    max_mm: float | None,
    joint_share: float | None,
    bytes_per_frame: float | None,
    codec: str | None,
    transform: str,
    decorrelation: str | None,
    representation: str | None,
    shares: Budgets | None,
    wavelet: str | None,
    drop_tpose: bool,
    as_json: bool,
    reader: Reader,
    **options: Any,
) -> None:
    """Build a library from a folder of AMC/ASF, BVH, NPZ and glTF files, or bring it up to date.

    Every clip is decoded again and measured: none exceeds the error, or the bytes, that you name.
    With an error and the pose codec, the default, each joint keeps its own motion too, also where
    a mean over the body would not notice.
    Clips that are there already are skipped, so an interrupted build goes on when it is run again.
    A bad file is reported and skipped, and the exit code is 1; with --strict nothing is mended, and
    the first bad file ends the build. What was taken for granted of the clips, and what cannot be
    searched, is told at the end.

    FBX, Collada and USD files are read by way of Blender, where there is one (--blender).

    What is said of files may stand in a mocapdb.toml in their folder, once for all.

    \b
    Example:
      mocapdb build cmu/ -o cmu.mocapdb --max-mm 5
    """
    from mocapdb.library import BuildSettings, build_library

    if reader.said.take is not None:
        raise click.UsageError("Expected no --take: every take of a file becomes a clip.")
    own = {"representation": representation, "shares": shares, "wavelet": wavelet}
    coding = _codec_options(codec, transform, decorrelation, own)
    asked = (error, mean_mm, max_mm, joint_share, bytes_per_frame)
    if codec == "raw" and asked != (None,) * 5:
        raise click.UsageError(
            "Expected no target and no --joint-share with --codec raw: it loses nothing."
        )
    target = _target(*asked)
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
        click.echo(shown(f"skipped {where}: {failure.reason}"), err=True)
    if as_json:
        emit_json(report.to_dict())
    elif report.built == 0 and not report.failed:
        click.echo(f"{library}: up to date, nothing to do ({counted(report.skipped, 'clip')}).")
    else:
        per_frame = report.payload_bytes / report.frames if report.frames else 0.0
        click.echo(
            f"{library}: built {counted(report.built, 'clip')} ({counted(report.frames, 'frame')}, "
            f"{megabytes(report.payload_bytes)}, {per_frame:.1f} bytes a frame) "
            f"in {report.seconds:.1f} s; {report.skipped} were there already, "
            f"{len(report.failed)} failed."
        )
    if report.dropped_revisions:
        names = ", ".join(shortened(report.dropped_revisions))
        click.echo(
            f"note: the cleaned revisions of {names} are dropped: their files or settings have "
            "changed."
            + (
                ""
                if report.cleaned
                else f" Clean again with: mocapdb clean {quote(str(library))} --apply"
            ),
            err=True,
        )
    if report.cleaned is not None:
        from mocapdb.cli._cleaned_library import say_cleaning

        say_cleaning(report.cleaned, to_stdout=not as_json)
    if report.unheld and bytes_per_frame is None:
        names = ", ".join(shortened(report.unheld))
        click.echo(
            f"warning: no step of the codec keeps {names} to {settings.target} in fewer bytes than "
            "the channels take: they are stored as they are.",
            err=True,
        )
    if report.joined:
        click.echo(f"joined {counted(report.joined, 'small file')} of {library}", err=True)
    if report.not_joined:
        click.echo(f"warning: small files stay as they are: {report.not_joined}", err=True)
    if report.not_learned:
        click.echo(
            f"{counted(report.not_learned, 'new clip')} will be learned into the classes with more "
            f"of them, or by: mocapdb index {quote(str(report.library))}",
            err=True,
        )
    if report.held_still:
        names = ", ".join(shortened(report.held_still))
        remedy = "--joint-share 0.1"
        if bytes_per_frame is not None:
            remedy = "--joint-share 0.1, with an error in place of --bytes-per-frame,"
        click.echo(
            f"warning: joints that move are held still by {settings.target}: {names}. "
            f"{remedy} keeps nine tenths of each joint's motion.",
            err=True,
        )
    if report.assumed is not None:
        if not as_json:
            idle = not (report.built or report.failed)
            for line in assumption_lines(report.assumed, shortly=idle):
                click.echo(line)
        for warning in shortened(report.assumed.warnings):
            click.echo(f"warning: {warning}", err=True)
    if report.failed:
        raise click.exceptions.Exit(1)


def _target(
    error: float | None,
    mean_mm: float | None,
    max_mm: float | None,
    joint_share: float | None,
    bytes_per_frame: float | None,
) -> Target | ByteBudget:
    """Return what was asked for, or refuse what does not fit together."""
    from mocapdb.compression.targets import ByteBudget, Target
    from mocapdb.errors import CodecError

    mean_too = mean_mm is not None and (error, bytes_per_frame) == (None, None)
    named = (error, mean_mm, None if mean_too else max_mm, bytes_per_frame)
    if sum(value is not None for value in named) > 1:
        raise click.UsageError(
            "Expected one of --error, --mean-mm, --max-mm and --bytes-per-frame, but got more. "
            "Only --max-mm may stand beside --mean-mm."
        )
    if bytes_per_frame is not None:
        if joint_share is not None:
            raise click.UsageError(
                "Expected no --joint-share beside --bytes-per-frame: a number of bytes cannot "
                "promise what joints keep. Name an error in its place."
            )
        return ByteBudget(bytes_per_frame)
    target = Target("mean_mm", DEFAULT_MEAN_MM if mean_mm is None else mean_mm)
    if error is not None:
        target = Target("skinned", error)
    elif mean_mm is None and max_mm is not None:
        target = Target("max_mm", max_mm)
    try:
        if joint_share is not None:
            target = replace(target, joint_share=joint_share)
        return replace(target, max_mm=max_mm) if mean_too else target
    except CodecError as problem:
        raise click.UsageError(str(problem)) from None


def _codec_options(
    codec: str | None, transform: str, decorrelation: str | None, own: dict[str, Any]
) -> dict[str, Any]:
    """Return the options of `mocapdb.compression.encode`, or refuse those that do not fit.

    `own` are those that only okane has, None where they are not given.
    """
    given = {name: value for name, value in own.items() if value is not None}
    spelt = [f"--{'budgets' if name == 'shares' else name}" for name in given]
    if given and codec is None:
        click.echo(
            f"note: {', '.join(spelt)}: okane's codec is taken. It takes several times the "
            "bytes of pose, and promises nothing of joints unless --joint-share is given.",
            err=True,
        )
    codec = codec or ("okane" if given else "pose")
    if given and codec != "okane":
        raise click.UsageError(f"Expected {spelt[0]} with --codec okane only.")
    if codec == "pose":
        return {
            "codec": codec, "transform": transform, "decorrelation": decorrelation or "lattice",
        }  # fmt: skip
    if codec == "okane" and transform not in {"auto", "dct", "dwt"}:
        raise click.UsageError(f"Expected --transform auto, dct or dwt with --codec {codec}.")
    if codec == "raw":
        if decorrelation is not None or transform != "auto":
            option = "--transform" if decorrelation is None else "--decorrelation"
            raise click.UsageError(f"Expected {option} with --codec pose or okane only.")
        return {"codec": codec}
    if decorrelation == "lattice":
        raise click.UsageError("Expected --decorrelation auto, class, pca or none with okane.")
    if transform == "dct" and "wavelet" in given:
        raise click.UsageError("Expected no --wavelet with --transform dct.")
    if transform == "auto" and "wavelet" in given:
        click.echo(
            f"note: --wavelet {given['wavelet']} is for clips that dwt stores in fewer bytes than "
            "dct; --transform dwt takes it for all.",
            err=True,
        )
    shares, is_without = given.get("shares"), decorrelation == "none"
    if (
        shares is not None
        and decorrelation not in {None, "auto"}
        and (shares.pca == 0) != is_without
    ):
        raise click.UsageError(
            f"Expected a P {'of 0' if is_without else 'over 0'} in --budgets with --decorrelation "
            f"{decorrelation}, but got {shares.pca:g}."
        )
    return {"codec": codec, "transform": transform, "decorrelation": decorrelation, **given}
