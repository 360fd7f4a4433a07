"""What was understood of a body, with the evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Generic, Literal, TypeAlias, TypeVar

from mocapdb.motion.tuning import STATURES_M

__all__ = ["Body", "Finding", "Given", "NoBodyError", "Source"]

T = TypeVar("T")
Source: TypeAlias = Literal["given", "found", "assumed"]
"""Who says so: the user, the evidence of names and motion, or nobody."""


class NoBodyError(Exception):
    """Says why a skeleton is no whole human body; caught within this package."""


@dataclass(frozen=True)
class Finding(Generic[T]):
    """One thing that was found out.

    Attributes
    ----------
    value
        What it is.
    evidence : str
        Why, in a few words.
    confidence : float
        From 0 (a guess) to 1 (stated).
    source : {"given", "found", "assumed"}
        ``"given"`` by the user, ``"found"`` by evidence, or ``"assumed"`` for lack of any.
    """

    value: T
    evidence: str
    confidence: float
    source: Source = "found"


@dataclass(frozen=True)
class Given:
    """What the user says, which wins over everything that is found.

    Attributes
    ----------
    unit_m : float, metres, optional
        Length of the file's unit.
    up : {"y", "z"}, optional
        The vertical axis.
    joints : mapping of str to str
        Joints of the skeleton by the names of canonical joints, some of them or all.
    """

    unit_m: float | None = None
    up: Literal["y", "z"] | None = None
    joints: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Body:
    """A skeleton, understood.

    Attributes
    ----------
    root : Finding of int
        The joint that carries the whole body: what is above it carries only the scene.
    up : Finding of {"y", "z"}
        The vertical axis.
    unit_m : Finding of float, metres
        Length of the skeleton's unit.
    adds_positions : Finding of bool
        Whether position channels below the root are added to OFFSETs rather than replace them.
    joints : Finding of mapping of str to int
        For each canonical joint (see `canonical_joints.JOINTS`) the joint that is in its place;
        without a foot's end also without that toe. Empty where it is no whole human body: then
        the evidence tells the reason.
    parts : mapping of str to int
        What was found of it: the same for a whole human body, less for a part of one, and nothing
        for a body that is not human.
    by : {"names", "shape"}
        How joints were found.
    neck : int or None
        The joint at the base of the neck.
    collars : mapping of str to int
        For each shoulder the joint that its collarbone starts in.
    turns : mapping of str to int
        For each canonical joint the joint whose rotation turns what begins there.
    height_m : float, metres
        Stature, from the lengths of limbs; the vertical extent where there are none.
    is_mirrored : bool
        Whether the sides are other ones than the joints' names say, for feet and knees clearly
        point so.
    """

    root: Finding[int]
    up: Finding[Literal["y", "z"]]
    unit_m: Finding[float]
    adds_positions: Finding[bool]
    joints: Finding[Mapping[str, int]]
    parts: Mapping[str, int]
    by: Literal["names", "shape"]
    neck: int | None
    collars: Mapping[str, int]
    turns: Mapping[str, int]
    height_m: float
    is_mirrored: bool = False

    @property
    def odd_stature(self) -> str:
        """What is told of a body that is no size for a person; empty where it is, or nobody's."""
        least, most = STATURES_M
        if self.unit_m.source == "assumed" or least <= self.height_m <= most:
            return ""
        return (
            f"the body is {self.height_m:.3g} m tall with units of {self.unit_m.value:g} m; "
            f"people are {least:g} to {most:g} m"
        )

    @property
    def is_human(self) -> bool:
        """Whether the skeleton is a whole human body that canonical joints were found in."""
        return bool(self.joints.value)

    @property
    def refusal(self) -> str:
        """Why it is no whole human body; empty where it is one."""
        return "" if self.is_human else self.joints.evidence
