"""Faults of a capture, put into a clip at known places.

Works on any skeleton whose joints have rotation channels: a fault turns a joint's local rotation,
and is written back into that joint's own channels. All other numbers stay as they are, bit for bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, TypeAlias, get_args

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray, IntArray
from mocapdb.corpus.tuning import FAULT_DEG, FAULT_S, FREEZE_LEAST_DEG, PLACE_TRIES
from mocapdb.errors import ClipError, SkeletonError
from mocapdb.motion.clip import Clip
from mocapdb.motion.rotations import elementary, extract_angles
from mocapdb.motion.skeleton import Skeleton

__all__ = ["Fault", "FaultKind", "inject_faults", "joint_rotations"]

FaultKind: TypeAlias = Literal["offset", "flip", "noise", "freeze", "drift"]
FLIP_DEG = 180.0


class Fault(NamedTuple):
    """A fault of one joint.

    Attributes
    ----------
    joint : int
    start, end : int
        Frames ``start:end``.
    kind : str
    size_deg : float, degrees
        Largest angle between the joint's right and wrong local rotation.
    """

    joint: int
    start: int
    end: int
    kind: str
    size_deg: float


class Injection(NamedTuple):
    """What `inject_faults` returns.

    Attributes
    ----------
    clip : Clip
        With the faults.
    mask : (F, J)
        True where a joint's rotation is wrong.
    faults : tuple of Fault
        By start frame.
    """

    clip: Clip
    mask: BoolArray
    faults: tuple[Fault, ...]


def inject_faults(
    clip: Clip,
    *,
    seed: int,
    kinds: Sequence[FaultKind] = get_args(FaultKind),
    size_deg: float | tuple[float, float] = FAULT_DEG,
    length_s: float | tuple[float, float] = FAULT_S,
    n: int = 5,
    joints: Sequence[int] | None = None,
    ease_s: float | tuple[float, float] = 0.0,
    tremble_deg: float | tuple[float, float] = 0.0,
) -> Injection:
    """Return a clip with faults at random places, and where they are.

    Parameters
    ----------
    clip : Clip
        Of any skeleton that has rotation channels.
    seed : int
    kinds : sequence of str
        In turn: ``"offset"`` turns the joint by `size_deg`, ``"flip"`` by 180 degrees, ``"noise"``
        by up to `size_deg` about another axis in each frame, ``"drift"`` more and more, up to
        `size_deg` in the last frame; ``"freeze"`` holds the frame before the span, somewhere
        where the joint moves.
    size_deg : float or (float, float), degrees
        Size, or the range that it is drawn from, up to 180.
    length_s : float or (float, float), seconds
        Length, or the range that it is drawn from; two frames at least.
    n : int
        How many faults. Those of one joint do not touch each other.
    joints : sequence of int, optional
        Joints to choose from; by default all that rotate, except the root.
    ease_s : float or (float, float), seconds
        For how long a fault other than a freeze eases in and, again, out; at most half of its
        length each. 0 for sharp edges.
    tremble_deg : float or (float, float), degrees
        Standard deviation of noise on the angles of a joint that is frozen. 0 for none.

    Returns
    -------
    Injection
        The faulty clip, the (F, J) mask, and the faults by start.

    Raises
    ------
    ClipError
        If a kind is unknown, a size or length makes no sense, or the faults have no room.
    SkeletonError
        If there is no joint to choose from, or one without rotation channels is asked for.

    Notes
    -----
    A joint with three rotation channels turns about a random axis. One with fewer stays within
    them: its outermost angle changes, by which its rotation changes just as much.
    """
    sizes, lengths_s = _range(size_deg, "size_deg", 180.0), _range(length_s, "length_s", np.inf)
    unknown = [kind for kind in kinds if kind not in get_args(FaultKind)]
    if unknown or not kinds:
        raise ClipError(
            f"Expected kinds of faults out of {', '.join(get_args(FaultKind))}, "
            f"but got {unknown[0] if unknown else 'none'!r}."
        )
    eases_s = _range(ease_s, "ease_s", np.inf) if np.any(ease_s) else (0.0, 0.0)
    trembles = _range(tremble_deg, "tremble_deg", 180.0) if np.any(tremble_deg) else None
    candidates = _rotating_joints(clip.skeleton, joints)
    rng = np.random.default_rng(seed)
    channels = clip.channels.copy()
    mask = np.zeros((len(clip), clip.skeleton.n_joints), dtype=np.bool_)
    faults = []
    for i in range(n):
        kind = kinds[i % len(kinds)]
        length = max(2, round(rng.uniform(*lengths_s) * clip.fps))
        joint, start = _place(rng, clip, mask, candidates, kind, length)
        size = FLIP_DEG if kind == "flip" else float(rng.uniform(*sizes))
        columns = clip.skeleton.rotation_columns(joint)
        span = slice(start, start + length)
        right = clip.channels[:, columns]
        order = clip.skeleton.rotation_orders[joint]
        if kind == "freeze":
            wrong = np.repeat(right[start - 1 : start], length, axis=0)
            if trembles:
                wrong += rng.normal(0.0, rng.uniform(*trembles), wrong.shape)
            size = float(_angles_between(order, right[span], wrong).max())
        else:
            turns = _turns_deg(rng, kind, size, length)
            if eases_s[1] > 0:
                turns *= _easing(length, rng.uniform(*eases_s) * clip.fps)
                size = float(np.abs(turns).max())
            wrong = _turned(rng, order, right[span], turns, kind)
        channels[span, columns] = wrong
        mask[span, joint] = True
        faults.append(Fault(joint, start, start + length, kind, size))
    faults.sort(key=lambda fault: (fault.start, fault.joint))
    faulty = clip.replace(channels=channels, step=f"{n} injected faults, seed {seed}")
    return Injection(faulty, mask, tuple(faults))


def joint_rotations(clip: Clip, joint: int) -> FloatArray:
    """Return (F, 3, 3) the product of a joint's elementary rotations: M in `Skeleton`'s notes."""
    columns = clip.skeleton.rotation_columns(joint)
    return _product(clip.skeleton.rotation_orders[joint], clip.channels[:, columns])


def _place(
    rng: np.random.Generator,
    clip: Clip,
    mask: BoolArray,
    joints: IntArray,
    kind: FaultKind,
    length: int,
) -> tuple[int, int]:
    """Return a joint and a first frame where a fault has room.

    A freeze goes where the joint moves, or else where it moves most of the places tried.
    """
    place, most = (-1, -1), -1.0
    for _ in range(PLACE_TRIES if length < len(clip) else 0):
        joint = int(rng.choice(joints))
        start = int(rng.integers(1, len(clip) - length + 1))
        if mask[start - 1 : start + length + 1, joint].any():
            continue
        angles = clip.channels[start - 1 : start + length, clip.skeleton.rotation_columns(joint)]
        moved = float(np.abs(angles - angles[0]).max())
        if kind != "freeze" or moved >= FREEZE_LEAST_DEG:
            return joint, start
        if moved > most:
            place, most = (joint, start), moved
    if most < 0:
        raise ClipError(
            f"Expected room for a fault of {length} frames, but found none in the {len(clip)} "
            f"frames of {clip.name!r}. Ask for fewer or shorter ones."
        )
    return place


def _turns_deg(rng: np.random.Generator, kind: FaultKind, size: float, length: int) -> FloatArray:
    """Return (length,) by how much a fault turns the joint in each of its frames."""
    if kind == "drift":
        return size * np.arange(1, length + 1) / length
    if kind == "noise":
        angles = rng.uniform(0.2, 1.0, length) * rng.choice([-1.0, 1.0], length)
        return np.asarray(size * angles / np.abs(angles).max())
    return np.full(length, size * rng.choice([-1.0, 1.0]))


def _easing(length: int, ease: float) -> FloatArray:
    """Return (length,) weights that rise smoothly from 0 to 1 and fall again."""
    to_edge = np.minimum(np.arange(1, length + 1), np.arange(length, 0, -1))
    s = np.clip(to_edge / max(1.0, min(ease, length / 2)), 0.0, 1.0)
    return np.asarray(s * s * (3.0 - 2.0 * s))


def _turned(
    rng: np.random.Generator, order: str, angles: FloatArray, turns_deg: FloatArray, kind: FaultKind
) -> FloatArray:
    """Return the angles of the joint when it is turned further, near the angles it had."""
    from scipy.spatial.transform import Rotation

    if len(order) < 3:
        wrong = angles.copy()
        wrong[:, 0] += turns_deg
        return wrong
    axes = rng.standard_normal((len(angles) if kind == "noise" else 1, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    turn = Rotation.from_rotvec(axes * turns_deg[:, None], degrees=True).as_matrix()
    wrong = np.rad2deg(extract_angles(order, _product(order, angles) @ turn))
    other = np.stack([wrong[:, 0] + 180.0, 180.0 - wrong[:, 1], wrong[:, 2] + 180.0], axis=1)
    forms = np.stack([wrong, other])
    apart = (forms - angles + 180.0) % 360.0 - 180.0
    nearest = np.abs(apart).sum(axis=2).argmin(axis=0)
    return np.asarray(angles + apart[nearest, np.arange(len(angles))])


def _product(order: str, angles_deg: FloatArray) -> FloatArray:
    total = np.tile(np.eye(3), (len(angles_deg), 1, 1))
    for axis, angle in zip(order, np.deg2rad(angles_deg).T, strict=True):
        total = total @ elementary(axis, angle)
    return total


def _angles_between(order: str, a_deg: FloatArray, b_deg: FloatArray) -> FloatArray:
    from scipy.spatial.transform import Rotation

    between = np.swapaxes(_product(order, a_deg), 1, 2) @ _product(order, b_deg)
    return np.asarray(np.rad2deg(Rotation.from_matrix(between).magnitude()))


def _rotating_joints(skeleton: Skeleton, joints: Sequence[int] | None) -> IntArray:
    if joints is None:
        joints = [j for j in range(1, skeleton.n_joints) if skeleton.rotation_orders[j]]
    stiff = [j for j in joints if not skeleton.rotation_orders[j]]
    if stiff or len(joints) == 0:
        got = f"{skeleton.names[stiff[0]]!r}, which has none" if stiff else "none"
        raise SkeletonError(f"Expected joints with rotation channels, but got {got}.")
    return np.asarray(joints, dtype=np.int64)


def _range(value: float | tuple[float, float], what: str, largest: float) -> tuple[float, float]:
    low, high = value if isinstance(value, tuple) else (value, value)
    if not 0.0 < low <= high <= largest or not np.isfinite(high):
        raise ClipError(
            f"Expected {what} to be positive{f' and at most {largest:g}' if largest < 1e9 else ''}"
            f", or a range of such, but got {value}."
        )
    return low, high
