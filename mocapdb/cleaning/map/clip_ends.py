"""Frames at the ends of a clip that were cut on to its motion, such as a T-pose in front of it.

Where most of the body's joints jump at one boundary, the take was cut there: that is no fault of
any one joint, and no repair can tell what the frames beyond it should be. So they are neither
searched nor changed. Nor are those in which a conversion *glides* from such a pose into the motion:
most joints move, from the clip's end on, several times as fast as they do right after.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.cleaning.evidence.discontinuities import find_jumps
from mocapdb.cleaning.evidence.hypotheses import jump_scales
from mocapdb.cleaning.joint_roles import BODY_ROLES
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.tuning import (
    CUT_REACH_S,
    CUT_SHARE,
    EDGE_RATIO,
    FEW_JOINTS,
    GLIDE_RATIO,
    LEAST_EDGE_DEG,
    LEAST_FRAMES_LEFT,
)
from mocapdb.io.tpose import count_tpose_frames
from mocapdb.motion.clip import Clip
from mocapdb.motion.frame_range import FrameRange
from mocapdb.motion.quaternions import angles_deg

__all__ = ["frames_between_cuts"]


def frames_between_cuts(clip: Clip, native: Texture) -> FrameRange:
    """Return the frames of a clip without those that a cut parts from it near either end.

    Parameters
    ----------
    clip : Clip
    native : Texture
        Its rotations at its own rate.

    Returns
    -------
    FrameRange
        All frames where there is no such cut, or where too little would be left.
    """
    n_frames = len(clip)
    everything = FrameRange(0, n_frames)
    if n_frames < LEAST_FRAMES_LEFT:
        return everything
    start, end = count_tpose_frames(clip), n_frames
    reach = max(1, round(CUT_REACH_S * clip.fps))
    body = np.array([role in BODY_ROLES for role in native.row_roles])
    for boundary in _cuts(native, body, reach):
        if boundary < reach:
            start = max(start, boundary + 1)
        elif boundary >= n_frames - 1 - reach:
            end = min(end, boundary + 1)
    start = max(start, _glide(native.quat_xyzw, body, reach))
    end = min(end, n_frames - _glide(native.quat_xyzw[::-1], body, reach))
    return FrameRange(start, end) if end - start >= LEAST_FRAMES_LEFT else everything


def _glide(quats: FloatArray, body: BoolArray, reach: int) -> int:
    """Return how many frames a clip takes to glide from the pose of its first into its motion.

    It ends where half of the joints are no faster than right after; without such an end it is none.
    """
    if len(quats) <= 2 * reach:
        return 0
    steps = angles_deg(quats[: 2 * reach], quats[1 : 2 * reach + 1])[:, body]
    calm = steps[reach:].max(axis=0)
    moves = calm > 0.0
    first = int((steps[0, moves] > GLIDE_RATIO * calm[moves]).sum())
    if first <= max(FEW_JOINTS, CUT_SHARE * int(moves.sum())):
        return 0
    ended = np.median(steps[:reach, moves] / calm[moves], axis=1) <= 1.0
    return int(ended.argmax()) if ended.any() else 0


def _cuts(native: Texture, body: BoolArray, reach: int) -> list[int]:
    """Return the boundaries where most of the body's joints that move jump.

    Where too few jump within `reach` of either end, the whole clip need not be looked at.
    """
    near = reach + 3
    ends = native.quat_xyzw[:near], native.quat_xyzw[-near:]
    seen = [find_jumps(replace(native, quat_xyzw=end)).sizes_deg[:, body] for end in ends]
    if all((end > LEAST_EDGE_DEG).sum(axis=1).max(initial=0) <= FEW_JOINTS for end in seen):
        return []
    jumps = find_jumps(native)
    scales = jump_scales(jumps, native.fps, ~body)
    moves = body & (np.median(np.linalg.norm(jumps.steps_deg, axis=-1), axis=0) > 0.0)
    is_edge = (jumps.sizes_deg > EDGE_RATIO * scales) & (jumps.sizes_deg > LEAST_EDGE_DEG)
    most = max(FEW_JOINTS, CUT_SHARE * int(moves.sum()))
    return [int(t) for t in np.flatnonzero(is_edge[:, moves].sum(axis=1) > most)]
