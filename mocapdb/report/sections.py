"""The parts of the page, each from what was found."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from shlex import quote
from typing import TYPE_CHECKING, Any

from mocapdb import plots
from mocapdb.report.library_findings import Confusion, Curve, Cycles, Faults, seconds_by_class
from mocapdb.report.page import escape, figures, grid, new_figure, picture, section, table

if TYPE_CHECKING:
    from mocapdb.library.clip_record import ClipRecord
    from mocapdb.library.facets import Facets

__all__ = ["clips", "costs", "cycles", "faults", "overview", "recognition"]

MOST_ROWS, MOST_SPANS = 1000, 40  # clips and flagged spans that are listed
LONGEST_MAP_S = 60.0  # of a digression map; beyond, pixels are too few
PLAYED_FPS, PLAYED_LAPS = 60.0, 2  # of a cycle that plays
SPAN_COLUMNS = ("clip", "joint", "kind", "from (s)", "to (s)", "sure (%)")


def overview(info: dict[str, Any], records: Sequence[ClipRecord]) -> str:
    """Return the key figures, and how much motion each class has."""
    error = info["error_mm"]
    skeletons = len({record.skeleton_id for record in records})
    key = figures(
        [
            (f"{info['clips']:,}", "clips"),
            (_duration(info["seconds"]), f"{info['frames']:,} frames"),
            (f"{len(info['classes']):,}", "classes"),
            (f"{skeletons:,}", "skeletons"),
            (_megabytes(info["payload_bytes"]), f"{info['bytes_per_frame']:.1f} bytes a frame"),
            (f"{info['ratio_float32']:.1f}\u00d7", "smaller than float32 channels"),
            (f"{info['ratio_source']:.1f}\u00d7", "smaller than the source files"),
            (f"{error['mean']:.2f} mm", f"mean error; {error['max']:.1f} mm at most"),
        ]
    )
    seconds, clips = seconds_by_class(records)
    figure = new_figure(5.6, 0.9 + 0.26 * len(seconds))
    plots.class_durations(seconds, clips, most=len(seconds), ax=figure.subplots())
    return section(
        "What is in it", "contents", key, picture(figure, "How much motion each class has.")
    )


def costs(info: dict[str, Any], records: Sequence[ClipRecord], curves: Sequence[Curve]) -> str:
    """Return what clips cost, what an error would cost, and where joints lost most."""
    each = new_figure(5.2, 3.4)
    plots.clip_costs(
        [record.bytes_per_frame for record in records],
        [record.error_max_mm for record in records],
        error_label="error of the worst vertex (mm)",
        ax=each.subplots(),
    )
    parts = [picture(each, "Each clip as it is stored; the lines are the medians.")]
    if curves:
        figure = new_figure(5.2, 3.4)
        plots.rate_distortion({curve.name: curve.points for curve in curves}, ax=figure.subplots())
        parts.append(
            picture(
                figure, "What an error costs: stretches of some clips, encoded at other targets."
            )
        )
    return section("Size and error", "size", grid(parts), _joint_losses(info))


def _joint_losses(info: dict[str, Any]) -> str:
    """Return the joints and the clips that lost most of their own motion."""
    left = ""
    if info["unmeasured"]:
        left = f'<p class="soft">Not measured of {info["unmeasured"]:,} clips: rebuild them.</p>'
    rows = [
        (
            row["joint"], row["clip"], f"{row['swing']:.1f} {row['unit']}",
            100.0 * row["kept"] / row["swing"], row["mean"], row["worst"], row["worst_s"],
        )
        for row in (*info["joints"], *info["worst_clips"])
    ]  # fmt: skip
    if not rows:
        return left
    unique = list(dict.fromkeys(rows))
    columns = ("joint", "clip", "moves by", "kept (%)", "mean error", "worst error", "at (s)")
    said = "<p>Joints, and clips, that lost most of how far a joint moves by itself:</p>"
    return said + table(columns, unique, left=3) + left


def recognition(confusion: Confusion | None, path: str) -> str:
    """Return which classes are taken for which."""
    if confusion is None:
        return section(
            "Classes",
            "classes",
            "<p>Classes were not compared: it takes a class that two subjects perform, and "
            f"features (<code>mocapdb index {escape(quote(path))}</code>).</p>",
        )
    rows, columns = len(set(confusion.truth)), len(set(confusion.truth) | set(confusion.answers))
    figure = new_figure(2.6 + 0.42 * columns, 1.6 + 0.36 * rows)
    plots.confusion_matrix(confusion.truth, confusion.answers, ax=figure.subplots())
    right = f"{confusion.right:.0%} of {len(confusion.truth)} clips"
    return section(
        "Classes",
        "classes",
        f"<p>{right} are recognised by classes that were learned from other people only.</p>",
        picture(figure, "What clips of each class are taken for, in percent."),
    )


def faults(found: Faults) -> str:
    """Return which joints are flagged, and the map of the clip with the most."""
    looked = f"{found.clips} clips, {_duration(found.seconds)}, were looked at as captured"
    if found.cleaned:
        looked += f" ({found.cleaned} of the library's were cleaned since)"
    problems = table(["clip", "could not be looked at"], sorted(found.problems.items()), left=2)
    unread = problems if found.problems else ""
    if not found.worst:
        return section("Flagged joints", "faults", f"<p>{looked}; nothing is flagged.</p>", unread)
    figure = new_figure(5.6, 1.2 + 0.26 * min(len(found.by_joint), 15))
    plots.flagged_joints(found.by_joint, ax=figure.subplots())
    record, worst = found.worst[0]
    end = round(LONGEST_MAP_S * worst.fps)
    shown = tuple(span for span in worst.spans if span.start < end)
    turning = sum(bool(order) for order in worst.skeleton.rotation_orders)
    map_figure = new_figure(10, 0.9 + 0.17 * turning)
    plots.digression_map(
        replace(worst, scores=worst.scores[:end], spans=shown), ax=map_figure.subplots()
    )
    rows = [
        (
            flagged.name, detected.skeleton.names[span.joint], span.kind,
            span.start / detected.fps, span.end / detected.fps, 100 * span.confidence,
        )
        for flagged, detected in found.worst
        for span in detected.spans
    ]  # fmt: skip
    rows.sort(key=lambda row: -row[-1])
    return section(
        "Flagged joints",
        "faults",
        f"<p>{looked}; {found.spans} stretches of a joint look wrong.</p>",
        picture(figure, "How often each joint is flagged, and as what."),
        picture(map_figure, f"{record.name}: where each joint is likely wrong."),
        table(SPAN_COLUMNS, rows[:MOST_SPANS], left=3),
        f'<p class="soft">The surest {MOST_SPANS} of {len(rows)}.</p>'
        if len(rows) > MOST_SPANS
        else "",
        unread,
    )


def cycles(every: Cycles) -> str:
    """Return the canonical cycle of each class as a scene that plays."""
    import numpy as np

    from mocapdb.cycles import make_loop
    from mocapdb.scenes.player import stage_element
    from mocapdb.scenes.stage import Actor, Stage

    left = table(["class", "why it has no cycle"], sorted(every.without.items()), left=2)
    without = left if every.without else ""
    if not every.found:
        said = "<p>No class was found in which a motion repeats.</p>"
        return section("Cycles", "cycles", said, without)
    cards = []
    for number, each in enumerate(every.found):
        cycle = each.cycle
        clip = make_loop(cycle, PLAYED_FPS, n_laps=PLAYED_LAPS, root="in-place").clip
        stage = Stage.together([Actor.of(clip, name=cycle.name)], title=cycle.name)
        speed = float(np.linalg.norm(cycle.advance)) * cycle.skeleton.metres_per_unit
        spread = float(np.rad2deg(np.sqrt((each.spread_rad**2).mean())))
        text = (
            f"{cycle.period_s:.2f} s a lap, {speed / cycle.period_s:.2f} m/s; mean of "
            f"{len(each.members)}, {spread:.1f}\u00b0 apart"
        )
        cards.append(
            f'<div class="card"><h3>{escape(cycle.name)}</h3><p class="soft">{text}</p>'
            f"{stage_element(stage, f'cycle-{number}')}</div>"
        )
    return section(
        "Cycles",
        "cycles",
        "<p>The cycle of each class, the mean over its clips, in place. Left limbs are paler than "
        "right ones. Drag to turn, double-click to turn back.</p>",
        f'<div class="grid scenes">{"".join(cards)}</div>',
        without,
    )


def clips(records: Sequence[ClipRecord], facets: Mapping[int, Facets]) -> str:
    """Return the list of the clips."""
    rows = []
    for record in records[:MOST_ROWS]:
        measured = facets.get(record.id)
        rows.append(
            (
                record.name, record.label or "-", record.description, record.duration_s,
                math.nan if measured is None else measured.root_speed_ms,
                math.nan if measured is None else measured.turn_deg,
                record.fps, record.payload_bytes / 1e3, record.error_mean_mm,
            )
        )  # fmt: skip
    columns = (
        "clip", "class", "description", "length (s)", "speed (m/s)", "turn (°)",
        "frame rate (fps)", "size (kB)", "mean error (mm)",
    )  # fmt: skip
    more = len(records) - len(rows)
    left = f'<p class="soft">{more:,} more are not listed.</p>' if more else ""
    return section("Clips", "clips", table(columns, rows, left=3), left)


def _duration(seconds: float) -> str:
    if seconds < 180:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 3 * 3600 else f"{seconds / 3600:.1f} h"


def _megabytes(size: float) -> str:
    return f"{size / 1e6:.1f} MB" if size >= 1e6 else f"{size / 1e3:.0f} kB"
