"""What the worker can do, a function a task: arguments and results are plain, motions are files."""

from __future__ import annotations

import csv
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mocapdb.base.progress import Progress

from .clips import clip_of, motion_of
from .motions import Motion, read_motion_file, write_motion_file

__all__ = ["TASKS"]

TURNS_DEG = 2.0  # a lap that turns by less can be repeated without turning
PICTURE_DPI = 120


def get_ready(progress: Progress) -> dict[str, bool]:
    """Load what most tasks need; tell which of the heavier packages are there."""
    from importlib.util import find_spec

    from mocapdb.base.kernels import are_compiled

    if find_spec("scipy") is not None:
        import mocapdb.cycles.extract
        import mocapdb.library.library  # noqa: F401
    still = np.zeros((4, 1, 3))  # the first use of a kernel loads it
    turns = np.tile(np.eye(3), (4, 1, 1, 1))
    motion = Motion(("bone",), np.array([-1]), still[0], still[0] + 1.0, still, turns, 30.0)
    motion_of(clip_of(motion))
    return {"compiled": are_compiled()}


# -- loops -----------------------------------------------------------------------------------------


def extract(
    motion: str,
    folder: str,
    settings: dict[str, Any],
    loop: dict[str, Any],
    ranks: Sequence[int] | None,
    subsample: int,
    animate: Sequence[str] | None,
    pictures: str | None,
    progress: Progress,
) -> dict[str, Any]:
    """Make the loop of a motion, or one for each of some ranks.

    Returns
    -------
    dict
        ``loops``, each with its ``file`` and what is told of it; ``without`` has for each rank that
        is no cycle the reason.
    """
    from mocapdb.cycles import extract_cycle
    from mocapdb.errors import NoPeriodError

    clip = clip_of(read_motion_file(motion))
    looked_at = clip
    if subsample > 1:
        looked_at = clip.replace(channels=clip.channels[::subsample], fps=clip.fps / subsample)
    asked = _settings(settings, animate)
    found, without = [], {}
    for done, rank in enumerate(ranks if ranks is not None else [None]):
        progress(done, len(ranks or [None]), clip.name)
        own = asked if rank is None else replace(asked, rank=rank, follow=True)
        try:
            found.append((rank, extract_cycle(looked_at, own)))
        except NoPeriodError as problem:
            if ranks is None or len(ranks) == 1:
                raise
            without[str(rank)] = str(problem)
    if not found:
        raise NoPeriodError(next(iter(without.values())))
    loops = []
    for number, (rank, extraction) in enumerate(found):
        told = _write_loop(extraction, clip.fps, loop, animate, Path(folder) / f"loop{number}.npz")
        told["rank"] = rank
        told["frames"] = [subsample * frame for frame in extraction.frames]
        if pictures:
            name = clip.name if rank is None else f"{clip.name} loop {rank}"
            told["pictures"] = _pictures(extraction, Path(pictures), name)
        loops.append(told)
    return {"loops": loops, "without": without}


def find_loops(
    motion: str,
    picture: str,
    settings: dict[str, Any],
    subsample: int,
    animate: Sequence[str] | None,
    progress: Progress,
) -> dict[str, Any]:
    """Return the loops that cohomology sees in a motion, and draw their persistence diagram."""
    from matplotlib.figure import Figure

    from mocapdb import plots
    from mocapdb.cycles import extract_cycle
    from mocapdb.errors import NoPeriodError

    clip = clip_of(read_motion_file(motion))
    if subsample > 1:
        clip = clip.replace(channels=clip.channels[::subsample], fps=clip.fps / subsample)
    topology = extract_cycle(clip, _settings(settings, animate)).topology
    if topology is None:
        raise NoPeriodError(f"Expected a loop in {clip.name!r}, but cohomology finds none.")
    figure = Figure(figsize=(4, 4), layout="constrained")
    plots.persistence_diagram(topology.bars, chosen=0, ax=figure.subplots())
    figure.savefig(picture, dpi=PICTURE_DPI, format="png")
    return {"bars": topology.bars.tolist(), "picture": picture}


def _settings(given: dict[str, Any], animate: Sequence[str] | None) -> Any:
    from mocapdb.cycles import Settings
    from mocapdb.cycles.closing import RootFit
    from mocapdb.cycles.phase.pose_cloud import Embedding

    embedding = Embedding(
        joints=None if animate is None else tuple(animate),
        delays=given["delays"],
        lag=given["lag"],
    )
    return Settings(
        model=given["model"],
        n_harmonics=given["harmonics"],
        embedding=embedding,
        prime=given["prime"],
        max_epsilon=given["epsilon"],
        use_velocities=given["use_velocities"],
        use_accelerations=given["use_accelerations"],
        root=RootFit(given["root_harmonics"], given["root_axes"], given["root_linear"]),
    )


def _write_loop(
    extraction: Any,
    fps: float,
    asked: dict[str, Any],
    animate: Sequence[str] | None,
    path: Path,
) -> dict[str, Any]:
    """Write the loop of an extraction as a motion; return what is told of it."""
    turn_deg = float(np.rad2deg(extraction.cycle.turn_rad))
    advances = bool(asked["advance"])
    warnings = list(extraction.warnings)
    if asked["by_modifier"] and advances and abs(turn_deg) > TURNS_DEG:
        advances = False
        warnings.append(
            f"each lap turns by {turn_deg:.0f} degrees, which a cycles modifier cannot repeat: the "
            "loop stays in place. Exact frames keep its path"
        )
    made = extraction.loop(
        fps,
        n_laps=1 if asked["by_modifier"] else asked["laps"],
        root="advance" if advances else "in-place",
        closed=asked["by_modifier"],
        animate=None if animate is None else tuple(animate),
    )
    warnings += [
        f"{joint} pops where its foot is held: {times:.1f} times" for joint, times in
        made.pops.items()
    ]  # fmt: skip
    write_motion_file(motion_of(made.clip), path)
    return {
        "file": str(path),
        "period_s": float(extraction.cycle.period_s),
        "laps": float(extraction.laps),
        "lap_frames": int(made.lap_frames),
        "confidence": float(extraction.confidence),
        "method": extraction.method,
        "advances": advances,
        "turn_deg": turn_deg,
        "warnings": warnings,
    }


def _pictures(extraction: Any, folder: Path, name: str) -> list[str]:
    """Draw the clip and its loop on the principal axes of poses, and how phase goes round there."""
    from matplotlib.figure import Figure

    from mocapdb import plots
    from mocapdb.base.files import replacing
    from mocapdb.cycles.phase.pose_cloud import aligned_positions
    from mocapdb.motion.body import part_from_scene

    lap = part_from_scene(extraction.loop().clip)[0]
    cloud = aligned_positions(extraction.clip).reshape(len(extraction.clip), -1)
    own = aligned_positions(lap).reshape(len(lap), -1)
    centre = cloud.mean(axis=0)
    _, axes = np.linalg.eigh((cloud - centre).T @ (cloud - centre))
    plane = axes[:, [-1, -2]]
    figures = {"pca": Figure(figsize=(5, 3.6), layout="constrained")}
    plots.phase_path(
        (cloud - centre) @ plane,
        extraction.timing.phase,
        cycle=(own - centre) @ plane,
        ax=figures["pca"].subplots(),
    )
    if extraction.topology is not None:
        figures["persistence"] = Figure(figsize=(4, 3.6), layout="constrained")
        plots.persistence_diagram(
            extraction.topology.bars,
            chosen=extraction.topology.rank,
            ax=figures["persistence"].subplots(),
        )
    folder.mkdir(parents=True, exist_ok=True)
    plain = "".join(letter if letter.isalnum() or letter in " -_." else "-" for letter in name)
    files = []
    for kind, figure in figures.items():
        file = folder / f"{plain} {kind}.png"
        with replacing(file) as (temporary,):
            figure.savefig(temporary, dpi=PICTURE_DPI, format="png")
        files.append(str(file))
    return files


# -- libraries -------------------------------------------------------------------------------------


def decode(
    library: str,
    clip: str,
    frames: Sequence[int] | None,
    original: bool,
    fps: float | None,
    target: str | None,
    output: str,
    progress: Progress,
) -> dict[str, Any]:
    """Decode a clip of a library, or some of its frames, as a motion; on a target if given."""
    from mocapdb.library import Library

    with Library(library, original=original) as opened:
        record = opened.record(clip)
        decoded = opened.decode(record)
    if frames is not None:
        decoded = decoded[frames[0] : frames[1]]
    motion = motion_of(decoded, fps)
    return _write_for(motion, target, output) | {"label": record.label, "clip": record.name}


def class_cycle(
    library: str,
    label: str,
    by_modifier: bool,
    fps: float | None,
    target: str | None,
    output: str,
    progress: Progress,
) -> dict[str, Any]:
    """Make the cycle of a class, a lap of it, as a motion."""
    from mocapdb.cycles import make_loop
    from mocapdb.cycles.synthesis.loop_start import start_phase
    from mocapdb.library import Library
    from mocapdb.library.searching.class_cycles import make_cycle

    with Library(library) as opened:
        made = make_cycle(opened, label, progress=progress)
    begin = start_phase(made.mean.cycle, "auto").phase
    turn_deg = float(np.rad2deg(made.mean.cycle.turn_rad))
    advances = not by_modifier or abs(turn_deg) <= TURNS_DEG
    loop = make_loop(
        made.mean.cycle.rephased(begin),
        fps or made.fps,
        root="advance" if advances else "in-place",
        most_jerk=made.most_jerk,
        closed=by_modifier,
    )
    clip = loop.clip if made.scene is None else made.scene.put_back(loop.clip)
    told = _write_for(replace(motion_of(clip), name=label), target, output)
    return told | {
        "period_s": float(made.mean.cycle.period_s),
        "lap_frames": int(loop.lap_frames),
        "advances": advances,
        "members": len(made.mean.members),
        "left_out": dict(made.mean.left_out or {}),
    }


def query(
    library: str,
    motion: str,
    k: int,
    joints: Sequence[str] | None,
    only: dict[str, Any],
    progress: Progress,
) -> dict[str, Any]:
    """Return the stretches of a library that are like a motion, by all joints or some."""
    from mocapdb.library import Filter, Library

    clip = clip_of(read_motion_file(motion))
    parts = [] if joints is None else _parts_of(clip, joints)
    with Library(library) as opened:
        hits = opened.query(clip, k=k, only=Filter(**only), joints=parts)
        notes = [str(note) for note in opened.retrieval.notes]
    return {
        "hits": [
            {
                "clip": hit.record.name,
                "label": hit.record.label or "",
                "start": hit.start,
                "end": hit.end,
                "start_s": hit.start_s,
                "end_s": hit.end_s,
                "distance": float(hit.distance),
                "probability": float(hit.probability),
            }
            for hit in hits
        ],
        "notes": notes,
    }


def add(
    library: str, motion: str, name: str, label: str, mean_mm: float, progress: Progress
) -> dict[str, Any]:
    """Add a motion to a library under a name and a class; a library is made where there is none."""
    from mocapdb.compression import Target
    from mocapdb.corpus.labels import LABELS_NAME
    from mocapdb.errors import LibraryError, UnknownClipError
    from mocapdb.io import write_clip
    from mocapdb.library import BuildSettings, Library, build_library
    from mocapdb.library.layout import is_library

    plain = "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in name)
    if is_library(library):
        with Library(library) as opened:
            try:
                taken = opened.record(plain).name == plain
            except UnknownClipError as problem:
                taken = bool(problem.candidates) and plain in problem.candidates
        if taken:
            raise LibraryError(
                f"{library}: expected a new name, but a clip {plain!r} is there. Rename the action."
            )
    clip = clip_of(replace(read_motion_file(motion), name=plain)).replace(label=label or None)
    with tempfile.TemporaryDirectory() as folder:
        clips, table = Path(folder) / "clips", Path(folder) / LABELS_NAME
        clips.mkdir()
        write_clip(clip, clips / f"{plain}.npz")
        with table.open("w", encoding="utf-8", newline="") as file:  # a class is no folder's name
            rows = csv.writer(file)
            rows.writerow(["clip", "label"])
            if label:
                rows.writerow([plain, label])
        report = build_library(
            clips,
            library,
            BuildSettings(Target("mean_mm", mean_mm)),
            labels=table,
            jobs=1,
            progress=progress,
        )
    if report.failed:
        raise LibraryError(f"{library}: {report.failed[0].reason}")
    return {"clip": plain, "built": report.built, "bytes": report.payload_bytes}


def _parts_of(clip: Any, joints: Sequence[str]) -> list[str]:
    """Return the canonical joints that some joints of a clip are, or are nearest above to."""
    from mocapdb.errors import SkeletonError
    from mocapdb.motion.body import understand

    skeleton = clip.skeleton
    wanted = {skeleton.joint(name) for name in joints}
    found = understand(skeleton, clip.channels).joints.value
    # a joint also stands for the end of a bone that it turns: a chosen forearm moves the wrist
    parts = [
        part
        for part, joint in found.items()
        if joint in wanted or int(skeleton.parents[joint]) in wanted
    ]
    if not parts:
        raise SkeletonError(
            "Expected bones of a human body to be selected, but none of them is one of its joints: "
            f"{', '.join(joints)}."
        )
    return parts


def _write_for(motion: Motion, target: str | None, output: str) -> dict[str, Any]:
    from mocapdb.base.kernels import are_compiled

    from .retargeting import on_armature

    if target is not None:
        motion = on_armature(motion, read_motion_file(target))
    write_motion_file(motion, output)
    return {"file": output, "fps": motion.fps, "compiled": are_compiled()}


# -- faults ----------------------------------------------------------------------------------------


def clean(
    motion: str,
    threshold: float | None,
    accepted: Sequence[int] | None,
    context: str | None,
    output: str,
    progress: Progress,
) -> dict[str, Any]:
    """Find the faults of a motion, repair those accepted (by default all), write what came of it.

    Returns
    -------
    dict
        ``spans``, every one that was found; ``changed``, for each joint the frames that have new
        values.
    """
    from mocapdb.cleaning import detect_faults, repair_spans
    from mocapdb.library.building.revise_clips import span_rows

    source = read_motion_file(motion)
    clip = clip_of(source)
    found = detect_faults(clip, _context(context, clip), threshold=threshold)
    chosen = [span for i, span in enumerate(found.spans) if accepted is None or i in set(accepted)]
    repaired, repairs = repair_spans(clip, found, chosen)
    rows = iter(span_rows(clip, repaired, repairs))
    spans = []
    for i, span in enumerate(found.spans):
        if accepted is None or i in set(accepted):
            spans.append(next(rows))
        else:
            spans.append(
                {
                    "joint": clip.skeleton.names[span.joint],
                    "frames": [span.start, span.end],
                    "confidence": round(span.confidence, 4),
                    "kind": span.kind,
                    "repaired": False,
                    "method": "refused",
                }
            )
    write_motion_file(motion_of(repaired), output)
    return {"spans": spans, "changed": _changed(clip, repaired), "file": output}


def _context(library: str | None, clip: Any) -> Any:
    """Return the clips of a library that have the joints of a clip, to find similar motion in."""
    if not library:
        return ()
    from mocapdb.library import Library

    with Library(library) as opened:
        same = [
            record
            for record in opened.records()
            if set(clip.skeleton.names) <= set(opened.skeleton(record).names)
        ]
        return [opened.decode(record) for record in same]


def _changed(before: Any, after: Any) -> dict[str, list[int]]:
    """Return for each joint with new values the frames that have them."""
    skeleton = before.skeleton
    differs = before.channels != after.channels
    changed = {}
    for joint, name in enumerate(skeleton.names):
        own = slice(*skeleton.channel_starts[joint : joint + 2])
        frames = np.flatnonzero(differs[:, own].any(axis=1)).tolist()
        if frames:
            changed[name] = frames
    return changed


TASKS: dict[str, Callable[..., dict[str, Any]]] = {
    task.__name__: task
    for task in (get_ready, extract, find_loops, decode, class_cycle, query, add, clean)
}
