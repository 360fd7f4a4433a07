"""Poses along a strip of time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from mocapdb.base.arrays import FloatArray, is_number
from mocapdb.errors import ClipError
from mocapdb.motion.body import joint_sides
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics, to_metres
from mocapdb.motion.skeleton import Skeleton
from mocapdb.plots._axes import COLOURS, axes_or_new, label_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["skeleton_strip"]

SPACING_M = 0.85  # from one pose to the next
PALER, DARKER = 0.45, 0.65  # left limbs: share of white; right limbs: brightness
IN_PLACE_M = 0.2  # hips that spread no further are seen from the side, facing right


def skeleton_strip(
    clips: Clip | Mapping[str, Clip],
    *,
    n_poses: int = 10,
    times_s: FloatArray | None = None,
    spacing_m: float = SPACING_M,
    ax: Axes | None = None,
) -> Axes:
    """Draw poses of a clip, evenly spaced in time, as the body goes from left to right.

    Parameters
    ----------
    clips : Clip, or mapping of str to Clip
        Several, by the names for the legend, are drawn over each other to compare.
    n_poses : int
        How many poses.
    times_s : (F,), seconds, optional
        When each frame is, for the axis of time; from 0 at the clip's rate by default.
    spacing_m : float, metres
        From one pose to the next.
    ax : Axes, optional

    Raises
    ------
    ClipError
        If there is no clip, the clips have different lengths, or the number of poses is no whole
        number above 0.

    Notes
    -----
    Every pose is seen from the side that the body, over the whole clip, travels across: the view
    is along the horizontal axis in which the hips' path is shortest. Left limbs are paler than
    right ones. Joints of the scene above the body (`Skeleton.body_root`) are left out.
    """
    named = {"": clips} if isinstance(clips, Clip) else dict(clips)
    lengths = {len(clip) for clip in named.values()}
    if len(lengths) != 1:
        raise ClipError(f"Expected clips of one length, but got lengths {sorted(lengths)}.")
    if not (is_number(n_poses) and n_poses >= 1 and n_poses == int(n_poses)):
        raise ClipError(f"Expected one pose or more, but got {n_poses!r}.")
    ax = axes_or_new(ax, 10, 2.6)
    first = next(iter(named.values()))
    frames = np.unique(np.linspace(0, len(first) - 1, int(n_poses)).round().astype(int))
    places = spacing_m * np.arange(len(frames))
    times = np.arange(len(first)) / first.fps if times_s is None else np.asarray(times_s)
    across = None
    # the first stands behind the others, wide and pale, so that what hides it agrees with it
    styles = [
        ("0.72", 4.0) if len(named) > 1 else (COLOURS[0], 1.6),
        *((colour, 1.3) for colour in COLOURS[1:]),
    ]
    for (name, clip), (colour, width) in zip(named.items(), styles, strict=False):
        pose = forward_kinematics(clip.skeleton, clip.channels[frames])
        positions = to_metres(clip.skeleton, pose.positions)
        root = clip.skeleton.body_root
        if across is None:
            across = _direction_of_travel(positions[:, root])
        side = (positions - positions[:, [root]]) @ across + places[:, None]
        limbs = joint_sides(clip.skeleton, pose.positions)
        for joint in sorted(_below(clip.skeleton, root), key=lambda joint: limbs[joint]):
            ends = [clip.skeleton.parents[joint], joint]
            ax.plot(
                side[:, ends].T, positions[:, ends, 1].T, lw=width, solid_capstyle="round",
                color=_shade(colour, int(limbs[joint])),
            )  # fmt: skip
        if name:
            ax.plot([], [], color=colour, lw=width, label=name)
    ax.set_aspect("equal")
    ax.set_xticks(places, [f"{time:.2f}" for time in times[frames]])
    label_axes(ax, "time (s)", "height (m)")
    if any(named):
        ax.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=len(named), frameon=False)
    return ax


def _below(skeleton: Skeleton, root: int) -> list[int]:
    """Return the joints that hang on another."""
    return [joint for joint in range(root + 1, skeleton.n_joints)
            if root in skeleton.chain_to_root(joint)[1:]]  # fmt: skip


def _shade(colour: str, side: int) -> tuple[float, ...]:
    """Return a colour, paler for what is left and darker for what is right."""
    from matplotlib.colors import to_rgb

    red_green_blue = np.array(to_rgb(colour))
    if side > 0:
        red_green_blue += PALER * (1 - red_green_blue)
    return tuple(red_green_blue * (DARKER if side < 0 else 1.0))


def _direction_of_travel(hips: FloatArray) -> FloatArray:
    """Return the horizontal unit vector along which the hips spread most."""
    ground = hips[:, [0, 2]] - hips[:, [0, 2]].mean(axis=0)
    if np.ptp(ground, axis=0).max() < IN_PLACE_M:
        return np.array([0.0, 0.0, 1.0])
    _, _, axes = np.linalg.svd(ground)
    along = axes[0] if (ground[-1] - ground[0]) @ axes[0] >= 0 else -axes[0]
    return np.array([along[0], 0.0, along[1]])
