"""Acclaim skeletons as text."""

from __future__ import annotations

import re

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import SkeletonError
from mocapdb.io._file_order import depth_first, file_dofs
from mocapdb.motion.skeleton import Skeleton

__all__ = ["AXES", "METRES_PER_INCH", "ROOT", "acclaim_names", "asf_text"]

ROOT = "root"
METRES_PER_INCH = 0.0254
AXES = "XYZ"
NAME = re.compile(r"[^\s#:(][^\s#]*")
EXACT_TRIES = 64


def asf_text(skeleton: Skeleton) -> str:
    """Return a skeleton as the text of an ASF file; see `mocapdb.io.asf.write_asf`."""
    names = acclaim_names(skeleton)
    dofs = file_dofs(skeleton, 0)
    axis = "".join(dict.fromkeys(skeleton.rotation_orders[0][::-1] + AXES))
    lines = [
        ":version 1.10",
        f":name {skeleton.name or 'skeleton'}",
        ":units",
        "  mass 1.0",
        f"  length {_unit_length(skeleton.metres_per_unit)!r}",
        "  angle deg",
        ":root",
        f"  order {' '.join(dofs).upper()}",
        f"  axis {axis}",
        f"  position {_words(skeleton.offsets[0])}",
        f"  orientation {_words(skeleton.axis_deg[0])}",
        ":bonedata",
    ]
    for joint in range(1, skeleton.n_joints):
        direction, length = _direction_and_length(skeleton.offsets[joint])
        lines += [
            "  begin",
            f"    id {joint}",
            f"    name {names[joint]}",
            f"    direction {_words(direction)}",
            f"    length {length!r}",
            f"    axis {_words(skeleton.axis_deg[joint])} {AXES}",
        ]
        if skeleton.dofs[joint]:
            lines.append(f"    dof {' '.join(file_dofs(skeleton, joint))}")
        lines.append("  end")
    lines += [":hierarchy", "  begin"]
    for joint, _ in depth_first(skeleton):
        if skeleton.children[joint]:
            family = (joint, *skeleton.children[joint])
            lines.append("    " + " ".join(names[member] for member in family))
    lines += ["  end", ""]
    return "\n".join(lines)


def acclaim_names(skeleton: Skeleton) -> list[str]:
    """Return the joints' names in Acclaim files, where the root is always called ``root``.

    Raises
    ------
    SkeletonError
        If the skeleton cannot be written as an ASF.
    """
    if skeleton.convention != "acclaim" or skeleton.up != "y":
        raise SkeletonError(
            f"Expected a skeleton in Acclaim's convention, y up, but {skeleton.name!r} is in "
            f"{skeleton.convention}'s, {skeleton.up} up. Use to_acclaim_convention."
        )
    for name, dofs in zip(skeleton.names[1:], skeleton.dofs[1:], strict=True):
        if any(dof[0] == "t" for dof in dofs):
            raise SkeletonError(f"Expected translations of the root only, but {name!r} has some.")
        if name == ROOT or not NAME.fullmatch(name):
            raise SkeletonError(f"Expected a name that an ASF can spell, but got {name!r}.")
    return [ROOT, *skeleton.names[1:]]


def _direction_and_length(offset: FloatArray) -> tuple[FloatArray, float]:
    """Return a direction and a length whose product, rounded, is exactly the offset."""
    length = float(np.linalg.norm(offset))
    if length == 0.0:
        return np.array([0.0, 1.0, 0.0]), 0.0
    for _ in range(EXACT_TRIES):
        direction = np.array([_quotient(part, length) for part in offset.tolist()])
        if np.array_equal(direction * length, offset):
            return direction, length
        length = float(np.nextafter(length, np.inf))
    return direction, length  # off by one unit in the last place


def _quotient(product: float, factor: float) -> float:
    """Return the quotient, or a neighbour of it whose product with the factor is exact."""
    quotient = product / factor
    return next((q for q in _around(quotient) if q * factor == product), quotient)


def _unit_length(metres_per_unit: float) -> float:
    """Return the ``length`` that stands for a unit, exactly where a double can."""
    length = METRES_PER_INCH / metres_per_unit
    exact = (near for near in _around(length) if METRES_PER_INCH / near == metres_per_unit)
    return next(exact, length)


def _around(number: float) -> tuple[float, float, float]:
    """Return a double and its two neighbours."""
    return number, float(np.nextafter(number, -np.inf)), float(np.nextafter(number, np.inf))


def _words(numbers: FloatArray) -> str:
    return " ".join(map(repr, numbers.tolist()))
