"""Motion of any human body carried over to SMPL's joints, for those who train on AMASS.

Each of SMPL's joints turns as the joint of the clip does that stands for it, but for one constant
turn. That is chosen so that the bone points where the clip's does, exactly, and that a knee or an
elbow bends about the axis about which the clip's bends. Where the clip has no joint for one of
SMPL's, it is approximated, and said to be: spine and neck share the turn between what they join,
collars go with the chest; fingers, toes and the face are at rest.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import SkeletonError
from mocapdb.io.smpl_bodies import SmplBody
from mocapdb.motion.body import Body, understand
from mocapdb.motion.clip import Clip

__all__ = ["CarriedMotion", "carried_to_smpl"]

BENT = 0.17
"""Sine of the least mean bend of a knee or an elbow that tells its axis: 10 degrees."""

LIMBS = (
    ("hip", "knee", "ankle"),
    ("shoulder", "elbow", "wrist"),
)
APPROXIMATED = "spine and neck are shared between their ends, collars go with the chest"


class CarriedMotion(NamedTuple):
    """A motion on SMPL's joints.

    Attributes
    ----------
    world : (F, J, 3, 3)
        Rotations of the joints from SMPL's rest pose, Y up.
    pelvis_m : (F, 3) metres
        Where the pelvis is.
    steps : tuple of str
        What was approximated.
    """

    world: FloatArray
    pelvis_m: FloatArray
    steps: tuple[str, ...]


def carried_to_smpl(clip: Clip, target: SmplBody) -> CarriedMotion:
    """Return a clip's motion on a SMPL body.

    Parameters
    ----------
    clip : Clip
        Of a whole human body.
    target : SmplBody
        Its joints at rest.

    Raises
    ------
    SkeletonError
        If the clip's body is no whole human body.
    """
    body = understand(clip.skeleton, clip.channels)
    if not body.is_human:
        raise SkeletonError(
            f"Expected a whole human body to carry over to SMPL's, but of {clip.name!r} "
            f"{body.joints.evidence}. Name its joints with a joint map, or write a BVH or an NPZ."
        )
    source = _Source(clip, body)
    rest = dict(zip(target.names, target.rest_m, strict=True))
    own: dict[str, FloatArray] = {}
    left = np.array([1.0, 0.0, 0.0])
    upwards = np.array([0.0, 1.0, 0.0])
    own["pelvis"] = source.turned("hips", source.across("hip"), source.spine(), left, upwards)
    own["spine3"] = source.turned("chest", source.across("shoulder"), source.spine(), left, upwards)
    own["head"] = source.neutral("head", own["spine3"])
    for side in ("left", "right"):
        for first, middle, last in LIMBS:
            names = [f"{side}_{joint}" for joint in (first, middle, last)]
            above = own["pelvis"] if first == "hip" else own["spine3"]
            own |= _limb(source, names, rest, above)
        own[f"{side}_foot"] = own[f"{side}_ankle"]
        own[f"{side}_collar"] = own["spine3"]
    for name, share in (("spine1", 1 / 3), ("spine2", 2 / 3)):
        own[name] = _between(own["pelvis"], own["spine3"], share)
    own["neck"] = _between(own["spine3"], own["head"], 0.5)
    world = np.empty((len(clip), len(target.names), 3, 3))
    for joint, (name, parent) in enumerate(zip(target.names, target.parents, strict=True)):
        world[:, joint] = own[name] if name in own else world[:, parent]
    scale, steps = _leg_scale(source, rest)
    hips = (source.place("left_hip") + source.place("right_hip")) / 2
    middle_m = (rest["left_hip"] + rest["right_hip"]) / 2 - rest["pelvis"]
    pelvis_m = hips * scale - own["pelvis"] @ middle_m
    return CarriedMotion(world, pelvis_m, (APPROXIMATED, *steps))


class _Source:
    """Where the clip's joints are, and how they are turned."""

    def __init__(self, clip: Clip, body: Body) -> None:
        self._positions = clip.positions()
        self._rotations = clip.rotations("global", "matrix")
        self._body = body
        self._joints = body.joints.value

    def place(self, joint: str) -> FloatArray:
        return np.asarray(self._positions[:, self._joints[joint]])

    def turn(self, joint: str) -> FloatArray:
        """Return (F, 3, 3) the rotation of what begins at a canonical joint."""
        number = self._body.turns.get(joint, self._joints[joint])
        return np.asarray(self._rotations[:, number])

    def has(self, joint: str) -> bool:
        return joint in self._joints

    def way(self, first: str, second: str) -> FloatArray:
        return self.place(second) - self.place(first)

    def across(self, joint: str) -> FloatArray:
        return self.way(f"right_{joint}", f"left_{joint}")

    def spine(self) -> FloatArray:
        """Return the way up the trunk: from the middle of the hips to that of the shoulders."""
        hips, shoulders = (
            (self.place(f"left_{joint}") + self.place(f"right_{joint}")) / 2
            for joint in ("hip", "shoulder")
        )
        return np.asarray(shoulders - hips)

    def turned(
        self,
        joint: str,
        first: FloatArray,
        second: FloatArray,
        rest_first: FloatArray,
        rest_second: FloatArray,
    ) -> FloatArray:
        """Return (F, 3, 3) rotations from a rest pose, whose directions are the mean ones here."""
        turn = self.turn(joint)
        own = _frame(_mean_within(turn, first), _mean_within(turn, second))
        return np.asarray(turn @ own @ _frame(rest_first, rest_second).T)

    def neutral(self, joint: str, above: FloatArray) -> FloatArray:
        """Return rotations that are on average those of the joint above."""
        turn = self.turn(joint)
        u, _, v = np.linalg.svd(np.mean(np.swapaxes(turn, 1, 2) @ above, axis=0))
        u[:, 2] *= np.linalg.det(u @ v)
        return np.asarray(turn @ (u @ v))


def _limb(
    source: _Source, names: list[str], rest: dict[str, FloatArray], above: FloatArray
) -> dict[str, FloatArray]:
    """Return the rotations of the three joints of a limb, by name."""
    first, middle, last = names
    upper, lower = source.way(first, middle), source.way(middle, last)
    is_leg = first.endswith("hip")
    # about which it bends at rest: a leg backwards, an arm with its palm down ahead
    if is_leg:
        axis_at_rest = np.array([1.0, 0.0, 0.0])
    else:
        axis_at_rest = np.array([0.0, -1.0 if first.startswith("left") else 1.0, 0.0])
    axis = np.cross(_unit(upper), _unit(lower))
    if np.linalg.norm(axis, axis=1).mean() < BENT:  # straight throughout: as what it hangs on
        axis = above @ axis_at_rest
    found = {
        first: source.turned(first, upper, axis, rest[middle] - rest[first], axis_at_rest),
        middle: source.turned(middle, lower, axis, rest[last] - rest[middle], axis_at_rest),
    }
    toe = last.replace("ankle", "toe")
    if is_leg and source.has(toe):
        way = rest[last.replace("ankle", "foot")] - rest[last]
        found[last] = source.turned(last, source.way(last, toe), axis, way, axis_at_rest)
    else:
        found[last] = source.neutral(last, found[middle])
    return found


def _leg_scale(source: _Source, rest: dict[str, FloatArray]) -> tuple[float, tuple[str, ...]]:
    """Return how many times longer SMPL's legs are, by which the way over the ground is scaled."""

    def of_rest(first: str, second: str) -> float:
        return float(np.linalg.norm(rest[second] - rest[first]))

    def of_clip(first: str, second: str) -> float:
        return float(np.median(np.linalg.norm(source.way(first, second), axis=1)))

    pairs = [
        (f"{side}_{first}", f"{side}_{second}")
        for side in ("left", "right")
        for first, second in (("hip", "knee"), ("knee", "ankle"))
    ]
    theirs, ours = (sum(length(*pair) for pair in pairs) / 2 for length in (of_rest, of_clip))
    if ours < 1e-6:
        raise SkeletonError("Expected legs of some length, but the clip's have none.")
    told = (
        f"the pelvis' path is scaled by {theirs / ours:.3f}: legs of {theirs:.2f} m, not {ours:.2f}"
    )
    return theirs / ours, (told,)


def _mean_within(turn: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return the mean of (F, 3) vectors, seen from a joint that is turned by (F, 3, 3)."""
    return np.asarray(np.einsum("fji,fj->i", turn, vectors) / len(vectors))


def _unit(vectors: FloatArray) -> FloatArray:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(lengths, 1e-12))


def _frame(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the matrix whose columns are a direction, what is square to it of another, a third."""
    x = _unit(first)
    y = second - x * (x @ second)
    if np.linalg.norm(y) < 1e-9:  # they are one line: any square one will do
        y = np.cross(x, np.eye(3)[int(np.abs(x).argmin())])
    y = _unit(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _between(first: FloatArray, second: FloatArray, share: float) -> FloatArray:
    """Return rotations part of the way from one to another, (F, 3, 3)."""
    from scipy.spatial.transform import Rotation

    way = Rotation.from_matrix(np.swapaxes(first, 1, 2) @ second).as_rotvec()
    return np.asarray(first @ Rotation.from_rotvec(share * way).as_matrix())
