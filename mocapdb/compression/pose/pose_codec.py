"""The pose codec: splines in the metric of the skin (docs/format.md, codec 2).

1. The channels become a smooth state (`state`), or its coordinates in a `basis`, and the frames are
   cut into blocks (`blocks`).
2. The metric of the error points says for every frame what a miss of each channel costs
   (`sensitivity`).
3. Channel by channel, last joint first, each is fitted by a cubic B-spline with knots as far apart
   as pays, or by another of the `modes`, and brought to integers that make up for what the channels
   before it missed (`fitting`, `lattice`).
4. The integers are predicted and entropy-coded (`track`, `rangecoder`).

One number, the *step*, sets the error of everything, and is searched for until the target is just
held (`holding`). The decoder needs none of the metric: it is told the size of every channel's step.
"""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

from mocapdb.compression.pose.blocks import CodedClip
from mocapdb.compression.pose.class_basis import Basis, fit_basis
from mocapdb.compression.pose.modes import TRANSFORM_MODES, PoseTransform
from mocapdb.compression.pose.pose_layout import pack
from mocapdb.compression.pose.smooth_channels import State
from mocapdb.compression.pose.target_search import Holding
from mocapdb.compression.targets import Target
from mocapdb.errors import CodecError
from mocapdb.motion.clip import Clip

__all__ = ["BLOCK_VALUES", "DECORRELATIONS", "Decorrelation", "compress", "encode_at"]

Decorrelation: TypeAlias = Literal["auto", "lattice", "none", "pca", "class"]
DECORRELATIONS: tuple[Decorrelation, ...] = get_args(Decorrelation)

BLOCK_VALUES = 6_000
"""About how many integers a block has: a millisecond or two to decode."""

_LONG_FRAMES = 6_000  # of a clip that a basis of its own can pay for


def compress(
    clip: Clip,
    target: Target,
    *,
    transform: PoseTransform = "auto",
    decorrelation: Decorrelation = "lattice",
    basis: Basis | None = None,
    block_values: int = BLOCK_VALUES,
) -> CodedClip | None:
    """Return the shortest integers found that hold a target, or None where none do.

    Parameters
    ----------
    clip : Clip
    target : Target
        Held on every frame, but for what rounding does to the last digits.
    transform : {"auto", "spline", "dct32", "dct64", "dct", "dwt"}
        Over time; ``"auto"`` takes what costs least, channel by channel and block by block.
    decorrelation : {"auto", "lattice", "none", "pca", "class"}
        How channels take each other into account: by the metric alone (``"lattice"``), not at all,
        or besides in the directions of the clip's own PCA or of a class's `basis`. ``"auto"`` takes
        what needs the fewest bytes of the lattice, the class's basis if there is one, and PCA for
        clips so long that it can pay.
    basis : Basis, optional
        That of the clip's class, which a reader will have too.
    block_values : int
        About how many integers a block has: decoding one frame decodes its block.

    Raises
    ------
    CodecError
        If there is no such transform or decorrelation, or no basis that fits for ``"class"``.
    """
    modes = _modes(transform, target)
    if decorrelation not in DECORRELATIONS:
        raise CodecError(
            f"Expected a decorrelation out of {', '.join(DECORRELATIONS)}, but got "
            f"{decorrelation!r}."
        )
    if basis is not None and not basis.fits(clip.skeleton):
        basis = None
    if decorrelation == "class" and basis is None:
        raise CodecError(
            "Expected a basis of the clip's class, but there is none for its skeleton. "
            "Build a library with it, or choose another decorrelation."
        )
    names = [decorrelation]
    if decorrelation == "auto":
        names = ["lattice"]
        if basis is not None:
            names.append("class")
        if len(clip) >= _LONG_FRAMES:
            names.append("pca")
    best, best_bytes = None, 0
    for name in names:
        chosen = basis if name == "class" else _own_basis(clip) if name == "pca" else None
        holding = Holding(clip, target, modes, block_values, basis=chosen, feedback=name != "none")
        coded = holding.hold(basis_is_shared=name == "class")
        if coded is not None:
            size = len(pack(coded, clip.skeleton, b""))
            if best is None or size < best_bytes:
                best, best_bytes = coded, size
    return best


def encode_at(
    clip: Clip, target: Target, gain: int, *, transform: PoseTransform = "auto"
) -> CodedClip:
    """Return the integers for a step of ``2 ** (gain / 64)`` skeleton units, whatever is lost."""
    return Holding(clip, target, _modes(transform, target), BLOCK_VALUES).encode_at(gain)


def _own_basis(clip: Clip) -> Basis | None:
    """Return the basis of a clip's own motion; None, and so no basis, where there is none."""
    return fit_basis([State(clip)])


def _modes(transform: PoseTransform, target: Target) -> tuple[int, ...]:
    if transform not in TRANSFORM_MODES:
        raise CodecError(
            f"Expected a transform out of {', '.join(TRANSFORM_MODES)}, but got {transform!r}."
        )
    if transform == "auto" and target.is_maximum:  # a transform cannot be finer at some frames
        return TRANSFORM_MODES["spline"]
    return TRANSFORM_MODES[transform]
