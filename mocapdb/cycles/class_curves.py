"""The curves of a class's cycle as a table: each angle by phase, and its spread over members."""

from __future__ import annotations

import csv

import numpy as np

from mocapdb.base.arrays import StrPath
from mocapdb.base.files import replacing
from mocapdb.cycles.class_cycle import ClassCycle
from mocapdb.cycles.curve.closed_curves import interpolate_closed
from mocapdb.cycles.synthesis.loop import make_loop

__all__ = ["CURVE_COLUMNS", "write_curves"]

CURVE_COLUMNS = ("class", "phase_percent", "joint", "channel", "mean_deg", "spread_deg")
PERCENT = 100


def write_curves(found: ClassCycle, path: StrPath, start: float = 0.0) -> None:
    """Write a row for each rotation channel and each percent of the cycle, as CSV.

    Parameters
    ----------
    found : ClassCycle
    path : path-like
    start : float
        Phase of 0 %, in laps.

    Notes
    -----
    ``mean_deg`` is the channel's value in the mean cycle, ``spread_deg`` the standard deviation of
    the joint's rotation over the members, whichever axis it is about.
    """
    cycle = found.cycle.rephased(start)
    skeleton = cycle.skeleton
    lap = make_loop(
        cycle, PERCENT / cycle.period_s, root="in-place", hold_feet=False, lap_frames=PERCENT,
        closed=True,
    ).clip  # fmt: skip
    phase = start + np.arange(PERCENT + 1) / PERCENT
    spread_deg = np.rad2deg(np.maximum(interpolate_closed(found.spread_rad, phase), 0.0))
    with replacing(path) as (temporary,), temporary.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(CURVE_COLUMNS)
        for percent in range(PERCENT + 1):
            for joint, name in enumerate(skeleton.names):
                for column in sorted(skeleton.rotation_columns(joint)):
                    channel = skeleton.channel_names[column].rpartition(".")[2]
                    mean, spread = lap.channels[percent, column], spread_deg[percent, joint]
                    row = (found.cycle.name, percent, name, channel, f"{mean:.4f}", f"{spread:.4f}")
                    table.writerow(row)
