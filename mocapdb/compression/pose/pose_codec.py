"""The pose codec: splines in the metric of the skin (docs/format.md, codec 2).

1. The channels are made smooth (`smooth_channels`), or become coordinates in a basis
   (`class_basis`), and the frames are cut into blocks (`blocks`).
2. The metric of the error points says for every frame what an error of each channel costs
   (`skin_metric`).
3. Channel by channel, last joint first, each is fitted by a cubic B-spline with knots as far apart
   as pays, or by another of the `modes`, and quantised to integers that make up for the errors of
   the channels before it (`block_encoder`, `quantise`).
4. The integers are predicted and entropy-coded (`entropy`, `range_coder`).

One number, the *step* of quantisation, sets the error of everything. It is searched for until the
target is just held (`target_search`). The decoder needs none of the metric: the payload has the
step of every channel.
"""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

from mocapdb.compression.pose.blocks import CodedClip
from mocapdb.compression.pose.class_basis import Basis, fit_basis
from mocapdb.compression.pose.modes import TRANSFORM_MODES, PoseTransform
from mocapdb.compression.pose.pose_layout import pack
from mocapdb.compression.pose.smooth_channels import SmoothChannels
from mocapdb.compression.pose.target_search import TargetSearch
from mocapdb.compression.targets import Target
from mocapdb.compression.tuning import OWN_BASIS_FRAMES
from mocapdb.errors import CodecError
from mocapdb.motion.clip import Clip
from mocapdb.motion.joint_errors import JointMotion

__all__ = ["DECORRELATIONS", "Decorrelation", "compress", "encode_at"]

Decorrelation: TypeAlias = Literal["auto", "lattice", "none", "pca", "class"]
DECORRELATIONS: tuple[Decorrelation, ...] = get_args(Decorrelation)


def compress(
    clip: Clip,
    target: Target,
    header: bytes,
    *,
    transform: PoseTransform = "auto",
    decorrelation: Decorrelation = "lattice",
    basis: Basis | None = None,
    motion: JointMotion | None = None,
) -> tuple[bytes, str] | None:
    """Return the shortest payload found that holds a target, and a description of what was chosen.

    None where no payload holds it.

    Parameters
    ----------
    clip : Clip
    target : Target
        Held on every frame, but for what rounding does to the last digits.
    header : bytes
        What the payload begins with (see `payload.pack_header`).
    transform : {"auto", "spline", "dct32", "dct64", "dct", "dwt"}
        Over time; ``"auto"`` takes what costs least, channel by channel and block by block.
    decorrelation : {"auto", "lattice", "none", "pca", "class"}
        How channels take each other into account: by the metric alone (``"lattice"``), not at all,
        or besides in the directions of the clip's own PCA or of a class's `basis`. ``"auto"`` takes
        what needs the fewest bytes of the lattice, the class's basis if there is one, and PCA for
        clips so long that it can pay.
    basis : Basis, optional
        That of the clip's class, which a reader will have too.
    motion : JointMotion, optional
        The joints' own motion, where it is known.

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
        if len(clip) >= OWN_BASIS_FRAMES:
            names.append("pca")
    found = []
    for name in names:
        chosen = basis if name == "class" else None
        if name == "pca":
            chosen = fit_basis([SmoothChannels(clip)])
        search = TargetSearch(
            clip, target, modes, basis=chosen, feedback=name != "none", motion=motion
        )
        coded = search.run(basis_is_shared=name == "class")
        if coded is not None:
            found.append((pack(coded, clip.skeleton, header), coded.describe()))
    return min(found, key=lambda each: len(each[0]), default=None)


def encode_at(
    clip: Clip, target: Target, qp: int, *, transform: PoseTransform = "auto"
) -> CodedClip:
    """Return the integers for a step of ``2 ** (qp / 64)`` skeleton units, whatever the error."""
    return TargetSearch(clip, target, _modes(transform, target)).encode_at(qp)


def _modes(transform: PoseTransform, target: Target) -> tuple[int, ...]:
    if transform not in TRANSFORM_MODES:
        raise CodecError(
            f"Expected a transform out of {', '.join(TRANSFORM_MODES)}, but got {transform!r}."
        )
    if transform == "auto" and target.is_maximum:  # a transform cannot be finer at some frames
        return TRANSFORM_MODES["spline"]
    return TRANSFORM_MODES[transform]
