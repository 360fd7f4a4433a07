"""What each joint of a clip lost of its own motion, as the catalogue keeps it.

A record a joint that moves, 15 bytes: see docs/format.md, "Catalogue".
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.errors import LibraryError
from mocapdb.library.tuning import HELD_STILL, LOSSES_SHOWN, MOVES
from mocapdb.motion.joint_errors import JointErrors

__all__ = ["ClipLosses", "JointLoss", "lost_most", "pack_losses", "unpack_losses"]

_KINDS = ("deg", "mm")
_RECORD = np.dtype(
    [
        ("joint", "<u2"),
        ("kind", "u1"),
        ("swing", "<f2"),
        ("kept", "<f2"),
        ("mean", "<f2"),
        ("worst", "<f2"),
        ("worst_frame", "<u4"),
    ]
)


@dataclass(frozen=True)
class JointLoss:
    """What one joint lost of its rotation or its translation.

    Attributes
    ----------
    joint : str
    unit : str
        ``"deg"`` of its rotation, ``"mm"`` of its translation.
    swing, kept : float
        How far it moves, and what is left of that between the same two frames.
    mean, worst : float
        Its own error over all frames.
    worst_frame : int
        Where that is largest.
    """

    joint: str
    unit: str
    swing: float
    kept: float
    mean: float
    worst: float
    worst_frame: int

    @property
    def share(self) -> float:
        """The part of the swing that is lost."""
        return 1.0 - self.kept / self.swing

    @property
    def moves(self) -> bool:
        """Whether it moves by so much that the part has a meaning."""
        return self.swing >= MOVES[_KINDS.index(self.unit)]

    @property
    def is_held_still(self) -> bool:
        """Whether it moves, and hardly does so any more."""
        return self.moves and self.share > HELD_STILL

    def __str__(self) -> str:
        return f"{self.joint} ({self.swing:.3g} {self.unit})"


def pack_losses(errors: JointErrors) -> bytes:
    """Return the records of the joints that move at all."""
    swing = errors.motion.swing
    kinds, joints = np.nonzero(swing)
    records = np.zeros(len(joints), _RECORD)
    records["joint"], records["kind"] = joints, kinds
    for name in ("kept", "mean", "worst"):
        records[name] = _half(getattr(errors, name)[kinds, joints])
    records["swing"] = _half(swing[kinds, joints])
    records["worst_frame"] = errors.worst_frame[kinds, joints]
    return records[records["swing"] > 0].tobytes()


def unpack_losses(data: bytes, names: Sequence[str]) -> list[JointLoss]:
    """Return the losses of a clip's joints, by their names, those that lost most of a swing first.

    Raises
    ------
    LibraryError
        If the bytes do not fit the joints.
    """
    records = _records([data], [len(names)])
    losses = [_loss(record, names) for record in records]
    return sorted(losses, key=lambda loss: (not loss.moves, -loss.share))


def _records(data: Sequence[bytes], n_joints: Sequence[int]) -> NDArray[Any]:
    """Return the records of clips one after another, once they fit their joints."""
    for own in data:
        if len(own) % _RECORD.itemsize:
            raise LibraryError(f"Expected records of {_RECORD.itemsize} bytes, but got {len(own)}.")
    records = np.frombuffer(b"".join(data), _RECORD)
    counts = [len(own) // _RECORD.itemsize for own in data]
    joints = np.repeat(np.array(n_joints, dtype=np.int64), counts)
    fits = (records["joint"] < joints) & (records["kind"] < len(_KINDS)) & (records["swing"] > 0)
    for name in ("swing", "kept", "mean", "worst"):
        fits &= np.isfinite(records[name])
    if not fits.all():
        n_own = int(joints[~fits][0])
        raise LibraryError(f"Expected errors of {n_own} joints, but got some of no joint.")
    return records


def _loss(record: Any, names: Sequence[str]) -> JointLoss:
    return JointLoss(
        joint=names[record["joint"]],
        unit=_KINDS[record["kind"]],
        swing=float(record["swing"]),
        kept=float(record["kept"]),
        mean=float(record["mean"]),
        worst=float(record["worst"]),
        worst_frame=int(record["worst_frame"]),
    )


class ClipLosses(NamedTuple):
    """What the joints of a clip lost, as the catalogue keeps it."""

    clip: str
    fps: float
    skeleton_id: int
    data: bytes


def lost_most(
    clips: Sequence[ClipLosses], joints_of: Callable[[int], Sequence[str]]
) -> dict[str, list[dict[str, Any]]]:
    """Return which joints, and which clips, lost most: the part of a swing, of joints that move.

    Parameters
    ----------
    clips : sequence of ClipLosses
    joints_of : callable
        Returns the names of a skeleton's joints, by its row.

    Raises
    ------
    LibraryError
        If the bytes of a clip do not fit its joints.
    """
    names = {skeleton: joints_of(skeleton) for skeleton in {each.skeleton_id for each in clips}}
    every = sorted({name for own in names.values() for name in own})
    numbers = {name: number for number, name in enumerate(every)}
    starts, offset = {}, 0
    for skeleton, own in names.items():
        starts[skeleton] = offset
        offset += len(own)
    number_of = np.array([numbers[name] for own in names.values() for name in own], np.int64)
    records = _records([c.data for c in clips], [len(names[c.skeleton_id]) for c in clips])
    counts = [len(each.data) // _RECORD.itemsize for each in clips]
    of_clip = np.repeat(np.arange(len(clips)), counts)
    first = np.repeat(np.array([starts[each.skeleton_id] for each in clips], np.int64), counts)
    swing = records["swing"].astype(np.float64)
    moving = np.flatnonzero(swing >= np.array(MOVES)[records["kind"]])
    shares = 1.0 - records["kept"][moving].astype(np.float64) / swing[moving]
    told: dict[str, list[dict[str, Any]]] = {}
    for what, groups, n_groups in (
        ("joints", number_of[first + records["joint"]][moving], len(every)),
        ("worst_clips", of_clip[moving], len(clips)),
    ):
        told[what] = []
        for i in moving[_worst(groups, shares, n_groups)]:
            clip = clips[of_clip[i]]
            loss = _loss(records[i], names[clip.skeleton_id])
            worst_s = loss.worst_frame / clip.fps
            told[what].append({"clip": clip.clip, **asdict(loss), "worst_s": worst_s})
    return told


def _worst(groups: IntArray, shares: FloatArray, n_groups: int) -> IntArray:
    """Return where the largest share of each group is, for the groups with the largest of these."""
    largest = np.full(n_groups, -np.inf)
    np.maximum.at(largest, groups, shares)
    places = np.flatnonzero(shares == largest[groups])
    _, first = np.unique(groups[places], return_index=True)
    places = np.sort(places[first])
    return places[np.argsort(-shares[places], kind="stable")[:LOSSES_SHOWN]]


def _half(values: FloatArray) -> FloatArray:
    """Return numbers that fit in two bytes each."""
    return np.clip(values, -60_000.0, 60_000.0)
