"""Other ways to repair, beside ours in the table of the kit of faults.

===================  =============================================================================
`slerp`              a spherical line between the true edges of a fault
`spline`             a cubic spline of rotations through the frames beside the true edges, the
                     interpolation of section 2
`low rank`           completion of the low-rank matrix of all joints over time, where it is wrong;
                     it stands for the matrix factorisation of Burke and Lasenby (2016), which
                     completes the markers' and smooths them, in the paper's table 2
`Savitzky-Golay`     a cubic filter over everything
`Butterworth`        a low-pass over everything, forwards and backwards
`Hampel`             what is far from the running median, in running deviations, is replaced by it
===================  =============================================================================

The first three are told which frames are wrong; the others find for themselves or change
everything. All take rotations as unit quaternions without jumps of sign, and the place of the joint
that carries the body.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.cleaning.kit_scores import FOOT_FAULTS, ROOT_JUMP, JointMotion, line_between_edges
from mocapdb.corpus.synthetic.faults import Fault
from mocapdb.motion.quaternions import continuous

__all__ = ["RIVALS", "TOLD", "repaired_by_rivals"]

SPLINE_FRAMES = 4  # on either side of a gap, a knot each
SAVITZKY_GOLAY_S, SAVITZKY_GOLAY_ORDER = 0.25, 3
BUTTERWORTH_HZ, BUTTERWORTH_ORDER = 6.0, 4  # usual for human motion (Winter 2009)
HAMPEL_S, HAMPEL_DEVIATIONS = 0.25, 3.0
MAD_TO_DEVIATION = 1.4826  # of normal noise
VARIANCE_KEPT = 0.999
LEAST_VARIANCE = 1e-8

Repair: TypeAlias = Callable[[JointMotion, Sequence[Fault], float], JointMotion]


def repaired_by_rivals(
    wrong: JointMotion, faults: Sequence[Fault], fps: float
) -> dict[str, JointMotion]:
    """Return a motion as each of the rivals repairs it.

    Parameters
    ----------
    wrong : JointMotion
        With faults.
    faults : sequence of Fault
        Where it is wrong, which only those of `TOLD` look at.
    fps : float, frames per second
    """
    return {name: repair(wrong, faults, fps) for name, repair in RIVALS.items()}


def _slerp(wrong: JointMotion, faults: Sequence[Fault], fps: float) -> JointMotion:
    return line_between_edges(wrong, faults)


def _spline(wrong: JointMotion, faults: Sequence[Fault], fps: float) -> JointMotion:
    from scipy.interpolate import CubicSpline
    from scipy.spatial.transform import Rotation, RotationSpline

    lines = line_between_edges(wrong, faults)  # where an end of the clip leaves no spline
    quats, places = lines.quat_xyzw, lines.places_mm
    wrong_rows, wrong_root = _wrong_frames(wrong, faults)
    for fault in faults:
        if fault.kind in FOOT_FAULTS:
            continue
        inside = np.arange(fault.start, fault.end)
        is_jump = fault.kind == ROOT_JUMP
        row = 0 if is_jump else wrong.joints.index(fault.joint)
        bad = wrong_root if is_jump else wrong_rows[:, row]
        near = np.arange(fault.start - SPLINE_FRAMES, fault.end + SPLINE_FRAMES)
        near = near[(near >= 0) & (near < len(bad))]
        near = near[~bad[near]]
        if not (near < fault.start).any() or not (near >= fault.end).any():
            continue
        if is_jump:
            places[inside] = CubicSpline(near, wrong.places_mm[near])(inside)
        else:
            knots = Rotation.from_quat(wrong.quat_xyzw[near, row])
            quats[inside, row] = RotationSpline(near, knots)(inside).as_quat()
    return lines


def _low_rank(wrong: JointMotion, faults: Sequence[Fault], fps: float) -> JointMotion:
    """Complete the matrix of all joints over time by its strongest directions.

    They and their variances are those of the frames without faults; what is missing in a frame is
    the mean of what a normal distribution of that rank expects, given the rest of the frame
    (probabilistic principal components, Tipping and Bishop 1999).
    """
    lines = line_between_edges(wrong, faults)
    wrong_rows, _ = _wrong_frames(wrong, faults)
    n_frames, n_joints = wrong_rows.shape
    complete = ~wrong_rows.any(axis=1)
    if complete.sum() < 2 or complete.all():
        return lines
    values = continuous(lines.quat_xyzw).reshape(n_frames, -1)
    mean = values[complete].mean(axis=0)
    centred = values - mean
    variances, axes = np.linalg.eigh(centred[complete].T @ centred[complete] / complete.sum())
    variances, axes = np.maximum(variances[::-1], 0.0), axes[:, ::-1]
    rank = 1 + int((np.cumsum(variances) < VARIANCE_KEPT * variances.sum()).sum())
    noise = max(float(variances[rank:].mean()) if rank < len(variances) else 0.0, LEAST_VARIANCE)
    axes = axes[:, :rank] * np.sqrt(variances[:rank])
    patterns, of_frame = np.unique(wrong_rows, axis=0, return_inverse=True)
    for number, rows in enumerate(patterns):
        frames, missing = np.flatnonzero(of_frame.ravel() == number), np.repeat(rows, 4)
        if not rows.any():
            continue
        known = axes[~missing]
        weights = np.linalg.solve(
            known.T @ known + noise * np.eye(rank), known.T @ centred[frames][:, ~missing].T
        )
        values[np.ix_(frames, missing)] = mean[missing] + (axes[missing] @ weights).T
    quats = _unit(values.reshape(n_frames, n_joints, 4))
    return lines._replace(quat_xyzw=np.where(wrong_rows[..., None], quats, wrong.quat_xyzw))


def _savitzky_golay(wrong: JointMotion, faults: Sequence[Fault], fps: float) -> JointMotion:
    from scipy.signal import savgol_filter

    width = max(2 * round(SAVITZKY_GOLAY_S * fps / 2) + 1, SAVITZKY_GOLAY_ORDER + 2)
    width = min(width, (len(wrong.quat_xyzw) - 1) // 2 * 2 + 1)
    if width <= SAVITZKY_GOLAY_ORDER:
        return wrong
    return _filtered(wrong, lambda v: savgol_filter(v, width, SAVITZKY_GOLAY_ORDER, axis=0))


def _butterworth(wrong: JointMotion, faults: Sequence[Fault], fps: float) -> JointMotion:
    from scipy.signal import butter, sosfiltfilt

    low_pass = butter(BUTTERWORTH_ORDER, BUTTERWORTH_HZ, fs=fps, output="sos")
    padding = min(len(wrong.quat_xyzw) - 1, round(fps))
    return _filtered(wrong, lambda v: sosfiltfilt(low_pass, v, axis=0, padlen=padding))


def _hampel(wrong: JointMotion, faults: Sequence[Fault], fps: float) -> JointMotion:
    from scipy.ndimage import median_filter

    width = (2 * max(1, round(HAMPEL_S * fps / 2)) + 1, 1)

    def replaced(values: FloatArray) -> FloatArray:
        middle = median_filter(values, size=width, mode="nearest")
        spread = median_filter(np.abs(values - middle), size=width, mode="nearest")
        far = np.abs(values - middle) > HAMPEL_DEVIATIONS * MAD_TO_DEVIATION * spread
        return np.where(far, middle, values)

    return _filtered(wrong, replaced)


def _filtered(wrong: JointMotion, smooth: Callable[[FloatArray], FloatArray]) -> JointMotion:
    """Return a motion whose numbers went through a filter, column by column."""
    n_frames = len(wrong.quat_xyzw)
    quats = smooth(wrong.quat_xyzw.reshape(n_frames, -1)).reshape(wrong.quat_xyzw.shape)
    places = smooth(wrong.places_mm) if wrong.places_mm.shape[1] else wrong.places_mm
    feet = {joint: smooth(path) for joint, path in wrong.feet_mm.items()}
    return wrong._replace(quat_xyzw=_unit(quats), places_mm=places, feet_mm=feet)


def _unit(quats: FloatArray) -> FloatArray:
    return np.asarray(quats / np.maximum(np.linalg.norm(quats, axis=-1, keepdims=True), 1e-12))


def _wrong_frames(wrong: JointMotion, faults: Sequence[Fault]) -> tuple[BoolArray, BoolArray]:
    """Return (F, K) where rotations are wrong, and (F,) where the body's place is."""
    rows = np.zeros(wrong.quat_xyzw.shape[:2], dtype=np.bool_)
    root = np.zeros(len(rows), dtype=np.bool_)
    for fault in faults:
        if fault.kind in FOOT_FAULTS:
            continue
        if fault.kind == ROOT_JUMP:
            root[fault.start : fault.end] = True
        else:
            rows[fault.start : fault.end, wrong.joints.index(fault.joint)] = True
    return rows, root


RIVALS: dict[str, Repair] = {
    "slerp": _slerp,
    "spline": _spline,
    "low rank": _low_rank,
    "Savitzky-Golay": _savitzky_golay,
    "Butterworth": _butterworth,
    "Hampel": _hampel,
}
TOLD = ("slerp", "spline", "low rank")
"""Those that are told which frames are wrong."""
