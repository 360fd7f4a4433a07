"""What each joint of a clip lost of its own motion, as the catalogue keeps it.

A record a joint that moves, 15 bytes: see docs/format.md, "Catalogue".
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import LibraryError
from mocapdb.library.tuning import HELD_STILL, LOSSES_SHOWN, MOVES
from mocapdb.motion.joint_errors import JointErrors

__all__ = ["JointLoss", "lost_most", "pack_losses", "unpack_losses"]

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
    if len(data) % _RECORD.itemsize:
        raise LibraryError(f"Expected records of {_RECORD.itemsize} bytes, but got {len(data)}.")
    records = np.frombuffer(data, _RECORD)
    numbers = np.stack([records[name] for name in ("swing", "kept", "mean", "worst")])
    fits = (records["joint"] < len(names)) & (records["kind"] < len(_KINDS)) & (numbers[0] > 0)
    if not (fits.all() and np.isfinite(numbers).all()):
        raise LibraryError(f"Expected errors of {len(names)} joints, but got some of no joint.")
    losses = [
        JointLoss(
            joint=names[record["joint"]],
            unit=_KINDS[record["kind"]],
            swing=float(record["swing"]),
            kept=float(record["kept"]),
            mean=float(record["mean"]),
            worst=float(record["worst"]),
            worst_frame=int(record["worst_frame"]),
        )
        for record in records
    ]
    return sorted(losses, key=lambda loss: (not loss.moves, -loss.share))


def lost_most(losses: Iterable[tuple[str, float, JointLoss]]) -> dict[str, list[dict[str, Any]]]:
    """Return which joints, and which clips, lost most: the part of a swing, of joints that move.

    Parameters
    ----------
    losses : iterable of (str, float, JointLoss)
        With the clip's name and its frames a second.
    """
    by_joint: defaultdict[str, list[tuple[str, float, JointLoss]]] = defaultdict(list)
    by_clip: defaultdict[str, list[tuple[str, float, JointLoss]]] = defaultdict(list)
    for each in losses:
        if each[2].moves:
            by_joint[each[2].joint].append(each)
            by_clip[each[0]].append(each)
    return {"joints": _most(by_joint), "worst_clips": _most(by_clip)}


def _most(
    groups: Mapping[str, list[tuple[str, float, JointLoss]]],
) -> list[dict[str, Any]]:
    worst = [max(group, key=lambda each: each[2].share) for group in groups.values()]
    worst.sort(key=lambda each: each[2].share, reverse=True)
    return [
        {"clip": clip, **asdict(loss), "worst_s": loss.worst_frame / fps}
        for clip, fps, loss in worst[:LOSSES_SHOWN]
    ]


def _half(values: FloatArray) -> FloatArray:
    """Return numbers that fit in two bytes each."""
    return np.clip(values, -60_000.0, 60_000.0)
