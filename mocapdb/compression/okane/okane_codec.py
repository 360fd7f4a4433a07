"""O'Kane's codec: PCA over the poses, a transform over time, and only the largest coefficients.

The stages (O'Kane 2008, section 3.2.3), each with a budget for the error that it may bring in:

1. **R**, the root: what alignment took out, or the root's own channels, is transformed over time
   and the largest coefficients are kept.
2. **P**, the poses: as few principal components as the budget allows; none of it if there is no
   budget.
3. **T**, time: the scores (or the poses) are transformed over time and the largest coefficients
   are kept; one threshold serves the whole matrix. This stage may use up whatever the others left.

Nothing is quantised beyond float32, and there is no entropy coding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.compression.okane.body_and_root import BodyAndRoot, join_root, split_root
from mocapdb.compression.okane.okane_layout import (
    BYTES_PER_COEFFICIENT,
    BYTES_PER_NUMBER,
    OkaneClip,
    read_okane,
)
from mocapdb.compression.okane.pca import Components, principal_components
from mocapdb.compression.okane.root_finding import Ranking, fewest
from mocapdb.compression.payload import Reader, check_size
from mocapdb.compression.targets import Target
from mocapdb.compression.transforms import TransformName, forward_transform, inverse_transform
from mocapdb.compression.tuning import (
    OKANE_RETRY,
    OKANE_ROOT_SLACK,
    OKANE_SHORT_FRAMES,
    OKANE_SLACK,
    OKANE_STRIDE,
)
from mocapdb.errors import CodecError
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.representations import RepresentationName, represent, restore_channels
from mocapdb.motion.rotations import continuous_angles
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.skin import pose_error

__all__ = ["Budgets", "compress", "expand"]

FLOAT32_LIMIT = 1e30  # values beyond it do not fit float32 once they are summed over time


@dataclass(frozen=True)
class Budgets:
    """How much error each stage may bring in.

    Parameters
    ----------
    root : float
        R. With 0 the root is kept exactly.
    pca : float
        P. With 0 there is no PCA.
    temporal : float
        T.

    Raises
    ------
    CodecError
        If one is negative or not finite, or all are zero.
    """

    root: float
    pca: float
    temporal: float

    def __post_init__(self) -> None:
        parts = (self.root, self.pca, self.temporal)
        if not all(np.isfinite(part) and part >= 0 for part in parts) or not any(parts):
            raise CodecError(
                "Expected budgets for root, PCA and time that are not negative and not all zero, "
                f"but got {parts}."
            )

    @property
    def total(self) -> float:
        """R + P + T."""
        return self.root + self.pca + self.temporal

    def scaled(self, factor: float) -> Budgets:
        """Return the budgets times a factor: shares of a target become errors."""
        return Budgets(self.root * factor, self.pca * factor, self.temporal * factor)


def compress(
    clip: Clip,
    target: Target,
    *,
    representation: RepresentationName,
    transform: TransformName,
    shares: Budgets,
    below_bytes: int | None = None,
) -> OkaneClip | None:
    """Return the fewest numbers found that hold a target, or None where there are none.

    There are none where float32 is too coarse for the target, and where `below_bytes` is too few.

    Parameters
    ----------
    clip : Clip
    target : Target
        Bounds the error of the channels that `expand` gives, on every frame.
    representation : {"channels", "positions", "aligned", "scaled", "normalised"}
    transform : {"dct", "dwt"}
    shares : Budgets
        Of the target; at most 1 together.
    below_bytes : int, optional
        What takes more is of no use: give up early.
    """
    if shares.total > 1 + 1e-9:
        raise CodecError(
            f"Expected shares of at most 1 together, but got {shares.total:g}. "
            "They divide the target between the stages."
        )
    parts = split_root(clip.skeleton, represent(_unwrapped(clip), representation))
    check_size(len(clip), parts.body.shape[1])
    if max(np.abs(part).max(initial=0) for part in (parts.body, parts.root)) > FLOAT32_LIMIT:
        return None
    stride = 1 if target.is_maximum or len(clip) < OKANE_SHORT_FRAMES else OKANE_STRIDE
    error_of = _measure(clip, target, representation, 1)
    rough_error_of = _measure(clip, target, representation, stride)
    budgets = shares.scaled(target.value)

    components = None
    scores = parts.body
    if budgets.pca:
        components = _keep_components(parts, budgets.pca, rough_error_of, stride, below_bytes)
        if components is None:
            return None
        scores = components.project(parts.body)
    root, root_is_exact = _keep_root(parts, transform, budgets.root, rough_error_of, stride)
    ranking = Ranking(forward_transform(transform, scores))

    def coded(count: int) -> OkaneClip:
        kept = ranking.largest(count)
        return OkaneClip(representation, transform, components, kept, root, root_is_exact)

    most = len(ranking)
    if below_bytes is not None:
        spare_bytes = below_bytes - coded(0).counted_bytes
        most = min(most, spare_bytes // BYTES_PER_COEFFICIENT)
    allowed, least = budgets.total, 0
    while least <= most:
        count = fewest(
            lambda count: rough_error_of(coded(count).expand(len(clip), stride)),
            allowed,
            most,
            least=least,
            slack=OKANE_SLACK,
        )
        found = coded(most if count is None else count)
        error = error_of(found.expand(len(clip)))
        if error <= budgets.total:
            return found
        if count is None:
            break
        # the frames left out have a larger error: aim lower
        allowed *= OKANE_RETRY * budgets.total / error
        least = count + 1
    return None


def expand(reader: Reader, skeleton: Skeleton, n_frames: int) -> FloatArray:
    """Return the channels (F, C) of a payload's body.

    Raises
    ------
    CodecError
        If the bytes do not fit together.
    """
    coded = read_okane(reader, skeleton, n_frames)
    with np.errstate(over="ignore", invalid="ignore"):
        representation = join_root(skeleton, coded.representation, coded.expand(n_frames))
        channels = restore_channels(skeleton, representation)
    if not np.isfinite(channels).all():
        raise CodecError("Expected coefficients of a motion, but got some that are out of range.")
    return channels


def _keep_root(
    parts: BodyAndRoot,
    transform: TransformName,
    budget: float,
    error_of: Callable[[BodyAndRoot], float],
    stride: int,
) -> tuple[FloatArray, bool]:
    """Return the coefficients of the root track within its budget, or the track itself.

    The flag says whether it is the track, exactly: without a budget, or where all coefficients
    do not keep to it.
    """
    n_frames = len(parts.root)
    if budget == 0 or parts.root.size == 0:
        return parts.root, True
    ranking = Ranking(forward_transform(transform, parts.root))
    body = parts.body[::stride]

    def error(count: int) -> float:
        track = inverse_transform(transform, ranking.largest(count), n_frames)
        return error_of(BodyAndRoot(body, track[::stride]))

    count = fewest(error, budget, len(ranking), slack=OKANE_ROOT_SLACK)
    return (parts.root, True) if count is None else (ranking.largest(count), False)


def _keep_components(
    parts: BodyAndRoot,
    budget: float,
    error_of: Callable[[BodyAndRoot], float],
    stride: int,
    below_bytes: int | None,
) -> Components | None:
    """Return as few principal components of the poses as the budget allows.

    None where they alone would take more than `below_bytes`.
    """
    components = principal_components(parts.body)
    most = len(components)
    if below_bytes is not None:
        n_vectors = below_bytes // (BYTES_PER_NUMBER * max(parts.body.shape[1], 1))
        most = min(most, n_vectors - 1)  # the mean is one
    if most < 0:
        return None
    some = parts.every(stride)

    def error(count: int) -> float:
        chosen = components.first(count)
        return error_of(BodyAndRoot(chosen.restore(chosen.project(some.body)), some.root))

    count = fewest(error, budget, most)
    if count is None and most < len(components):
        return None
    return components.first(most if count is None else count)


def _unwrapped(clip: Clip) -> Clip:
    """Return the same motion with Euler angles that do not jump to another form of themselves."""
    skeleton = clip.skeleton
    channels = clip.channels.copy()
    for joint, order in enumerate(skeleton.rotation_orders):
        if order:
            columns = skeleton.rotation_columns(joint)
            angles_rad = np.deg2rad(channels[:, columns])
            channels[:, columns] = np.rad2deg(continuous_angles(order, angles_rad))
    return clip.replace(channels=channels)


def _measure(
    clip: Clip, target: Target, name: RepresentationName, stride: int
) -> Callable[[BodyAndRoot], float]:
    """Return a function that measures parts, already of every so many frames, against a clip."""
    skeleton = clip.skeleton
    original = forward_kinematics(skeleton, clip.channels[::stride])

    def error_of(parts: BodyAndRoot) -> float:
        channels = restore_channels(skeleton, join_root(skeleton, name, parts))
        pose = forward_kinematics(skeleton, channels)
        return target.measure(pose_error(skeleton, original, pose, points=target.points))

    return error_of
