"""``mocapdb demo``."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import click

from mocapdb.cli._console import counted, emit_json, megabytes, progress_bar
from mocapdb.cli._kernels import compile_kernels
from mocapdb.cli._options import PATH, json_option

if TYPE_CHECKING:
    from mocapdb.library import Library
    from mocapdb.motion.clip import Clip

MEAN_MM = 1.0
EXPORTED = "01_01"
FAULT_SEED = 3


@click.command()
@click.option(
    "--out", "folder", default="demo", show_default=True, type=PATH,
    help="Folder to write to.",
)  # fmt: skip
@json_option
def demo(folder: Path, as_json: bool) -> None:
    """Make a small synthetic corpus and do on it what mocapdb does: no data, no network needed.

    The corpus becomes a library, measured, verified, and a clip of it exported; a stretch of one
    body's walk finds the others'; a clip with injected faults is cleaned, kept as captured and as
    cleaned in a library of takes, and its cycle found.

    \b
    Example:
      mocapdb demo --out demo
    """

    def say(step: str, text: str) -> None:
        if not as_json:
            click.echo(f"{step:<10}{text}")

    from mocapdb.library import Library

    started = time.perf_counter()
    with progress_bar("Compiling") as progress:
        compile_kernels(progress)
    say("kernels", f"compiled once and kept, {time.perf_counter() - started:.1f} s")
    figures = _build(folder, say)
    with Library(folder / "demo.mocapdb") as library:
        figures |= _measure(library, folder, say)
        figures["query"] = _query(library, say)
        figures |= _clean_and_cycle(library, folder, say)
        figures["gait"] = _gait(library, say)
        figures["report"] = _report(library, folder, say)
    say("\nyours:", "mocapdb build FOLDER -o NAME.mocapdb")
    say("or see:", f"mocapdb ls {quote(str(library.path))}")
    if as_json:
        emit_json(figures)
    if figures["build"]["failed"] or figures["verify"]["bad"]:
        raise click.exceptions.Exit(1)


def _build(folder: Path, say: Callable[[str, str], None]) -> dict[str, Any]:
    from mocapdb.compression import Target
    from mocapdb.corpus import synthetic
    from mocapdb.library import BuildSettings, build_library

    corpus, path = folder / "corpus", folder / "demo.mocapdb"
    files = synthetic.write_corpus(corpus)
    size = sum(file.stat().st_size for file in corpus.rglob("*") if file.is_file())
    say(
        "corpus",
        f"{corpus}: {counted(len(files), 'synthetic clip')} in AMC and BVH, {megabytes(size)}",
    )
    with progress_bar("Building") as progress:
        report = build_library(
            corpus,
            path,
            BuildSettings(Target("mean_mm", MEAN_MM)),
            progress=progress,
        )
    say("library", f"{path}: {counted(report.built, 'clip')} in {report.seconds:.1f} s")
    return {"corpus": str(corpus), "build": report.to_dict()}


def _measure(library: Library, folder: Path, say: Callable[[str, str], None]) -> dict[str, Any]:
    from mocapdb.io import read_with_settings
    from mocapdb.library import verify_library
    from mocapdb.motion.skin import motion_error

    info = library.info()
    error = info["error_mm"]
    say(
        "measured",
        f"{info['bytes_per_frame']:.1f} bytes a frame, {info['ratio_float32']:.1f} times smaller "
        f"than float32 channels and {info['ratio_source']:.1f} times smaller than the files; "
        f"vertices are off by {error['mean']:.2f} mm in the mean, {error['max']:.1f} mm at most",
    )
    with progress_bar("Verifying") as progress:
        checked = verify_library(library, progress)
    say(
        "verified",
        f"{checked['clips'] - len(checked['bad'])} of {counted(checked['clips'], 'clip')} sound",
    )
    exported = folder / f"{EXPORTED}.bvh"
    record = library.export(EXPORTED, exported)
    original = read_with_settings(folder / "corpus" / record.source)
    loss = motion_error(original, library.clip(EXPORTED)).vertices
    say(
        "exported",
        f"{exported}: {record.label}, {record.duration_s:.1f} s, {loss.mean:.2f} mm off",
    )
    return {"info": info, "verify": checked, "exported": str(exported)}


def _report(library: Library, folder: Path, say: Callable[[str, str], None]) -> str:
    from mocapdb.report import Effort, write_report

    page = folder / "report.html"
    few = Effort(curves=2, fault_seconds=30.0, cycle_clips=6)
    with progress_bar("Reporting") as progress:
        write_report(library, page, effort=few, progress=progress)
    say("report", f"{page}: all of this on one page, to open in a browser")
    return str(page)


def _query(library: Library, say: Callable[[str, str], None]) -> list[dict[str, Any]]:
    from mocapdb.library import Filter, Retrieval

    example = library.clip(EXPORTED)[60:300]
    hits = Retrieval(library).query([example], k=3, only=Filter(not_clips=[EXPORTED]))
    found = [
        {
            "clip": hit.record.name,
            "class": hit.record.label,
            "start": hit.start_s,
            "end": hit.end_s,
            "distance": hit.distance,
        }
        for hit in hits
    ]
    shown = ", ".join(f"{hit['clip']} ({hit['class']}) at {hit['start']:.1f} s" for hit in found)
    say("query", f"2 s of {EXPORTED}'s walk are most like {shown}")
    return found


def _clean_and_cycle(
    library: Library, folder: Path, say: Callable[[str, str], None]
) -> dict[str, Any]:
    from mocapdb.cleaning import clean_clip, remove_foot_skate
    from mocapdb.corpus import synthetic
    from mocapdb.cycles.extract import extract_cycle
    from mocapdb.io import write_clip

    faulty = synthetic.inject_faults(
        library.clip(EXPORTED),
        seed=FAULT_SEED,
        kinds=("offset", "noise"),
        size_deg=40,
        length_s=0.3,
        n=2,
    )
    cleaned = clean_clip(faulty.clip)
    skate = remove_foot_skate(cleaned.clip)
    names = cleaned.clip.skeleton.names
    spans = [
        {
            "joint": names[repair.span.joint],
            "start": repair.span.start / faulty.clip.fps,
            "end": repair.span.end / faulty.clip.fps,
            "kind": repair.span.kind,
            "repaired": repair.repaired,
        }
        for repair in cleaned.repairs
    ]
    flagged = ", ".join(f"{s['joint']} at {s['start']:.2f} s" for s in spans) or "nothing"
    injected = ", ".join(
        f"{names[fault.joint]} at {fault.start / faulty.clip.fps:.2f} s" for fault in faulty.faults
    )
    say("cleaned", f"faults put into {injected}; flagged and repaired: {flagged}")
    taken = _keep_takes(faulty.clip, folder, say)
    say("feet", f"slid {skate.slide_before_mm:.1f} mm at rest, now {skate.slide_after_mm:.1f} mm")

    found = extract_cycle(skate.clip)
    loop = folder / "walk-loop.bvh"
    write_clip(found.loop().clip, loop)
    say(
        "cycle",
        f"{loop}: {found.laps:.1f} laps of {found.cycle.period_s:.2f} s, "
        f"confidence {found.confidence:.2f}",
    )
    return {
        "spans": spans,
        "takes": taken,
        "foot_slide_mm": {"before": skate.slide_before_mm, "after": skate.slide_after_mm},
        "cycle": {
            "period_s": found.cycle.period_s,
            "laps": found.laps,
            "confidence": found.confidence,
            "output": str(loop),
        },
    }


def _gait(library: Library, say: Callable[[str, str], None]) -> dict[str, Any]:
    from mocapdb.gait import analyse_gait

    walk = analyse_gait(library.clip(EXPORTED))
    told = walk.spreads()
    cadence, stance = told["cadence_steps_min"].mean, told["stance_pct"].mean
    say("gait", f"{EXPORTED}: {cadence:.0f} steps a minute, {stance:.0f} % of a stride in stance")
    return {"cadence_steps_min": cadence, "stance_pct": stance}


def _keep_takes(take: Clip, folder: Path, say: Callable[[str, str], None]) -> dict[str, Any]:
    """Build a library of one take with faults, cleaned beside what was captured."""
    from mocapdb.compression import Target
    from mocapdb.io import write_clip
    from mocapdb.library import BuildSettings, Library, build_library

    takes, path = folder / "takes", folder / "takes.mocapdb"
    takes.mkdir(exist_ok=True)
    write_clip(take, takes / "take.bvh")
    settings = BuildSettings(Target("mean_mm", MEAN_MM))
    report = build_library(takes, path, settings, jobs=1, index=False, clean=True)
    with Library(path) as library:
        revised = library.info()["revisions"]
    say(
        "kept",
        f"{path}: the take as captured, and as cleaned in {megabytes(revised['payload_bytes'])} "
        f"more ({revised['spans'] - revised['left']} of {counted(revised['spans'], 'span')} "
        "repaired)",
    )
    return {"library": str(path), "built": report.built, "skipped": report.skipped, **revised}
