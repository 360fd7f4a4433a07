"""Axes that clips of a set share: one PCA of all their poses, paid for once (O'Kane 2008, 4.1).

He compresses clips of a kind together, so that what the axes take is spread over them. Here a
library keeps the axes, and a clip refers to them by their digest.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.compression.okane.body_and_root import (
    BodyAndRoot,
    ErrorMeasures,
    body_columns,
    parts_of,
)
from mocapdb.compression.okane.pca import FLOAT32_LIMIT, Components, principal_components
from mocapdb.compression.okane.root_finding import fewest
from mocapdb.compression.payload import pack_array
from mocapdb.compression.targets import Target
from mocapdb.compression.tuning import SET_MEASURED_FRAMES, SET_VARIANCE
from mocapdb.errors import CodecError
from mocapdb.motion.clip import Clip
from mocapdb.motion.representations import REPRESENTATIONS, RepresentationName
from mocapdb.motion.skeleton import Skeleton

__all__ = ["SET_DIGEST_BYTES", "SetBasis", "fit_set_basis"]

SET_DIGEST_BYTES = 8
_HEAD = struct.Struct("<BI")


@dataclass(frozen=True)
class SetBasis:
    """The mean pose and the principal axes of a set of clips.

    Attributes
    ----------
    representation : str
        What the poses are in.
    components : Components
        As many as the set was found to need.
    """

    representation: RepresentationName
    components: Components

    def to_bytes(self) -> bytes:
        """Return the basis as bytes (docs/format.md)."""
        components = self.components
        head = _HEAD.pack(REPRESENTATIONS.index(self.representation), len(components))
        mean = pack_array(components.mean, np.float32)
        return head + mean + pack_array(components.axes, np.float32)

    @classmethod
    def from_bytes(cls, data: bytes) -> SetBasis:
        """Return the basis that `to_bytes` wrote.

        Raises
        ------
        CodecError
            If the bytes are no basis.
        """
        try:
            representation_id, count = _HEAD.unpack_from(data)
            numbers = np.frombuffer(data, "<f4", offset=_HEAD.size).astype(np.float64)
            rows = numbers.reshape(count + 1, -1)
            representation = REPRESENTATIONS[representation_id]
        except (struct.error, ValueError, IndexError) as problem:
            raise CodecError(f"Expected axes of a set of clips, but got {problem}.") from None
        if not np.isfinite(rows).all():
            raise CodecError("Expected axes of a set of clips, but some are not finite.")
        return cls(representation, Components(rows[0], rows[1:]))

    @cached_property
    def digest(self) -> bytes:
        """The first bytes of the SHA-256 of its bytes, by which clips refer to it."""
        return hashlib.sha256(self.to_bytes()).digest()[:SET_DIGEST_BYTES]

    def fits(self, skeleton: Skeleton) -> bool:
        """Say whether poses of a skeleton have the columns that this is a basis of."""
        return len(self.components.mean) == body_columns(skeleton, self.representation)


def fit_set_basis(
    clips: Sequence[Clip], representation: RepresentationName, target: Target | None, share: float
) -> SetBasis | None:
    """Return as few axes of some clips' poses as leave the clips a share of their target.

    Parameters
    ----------
    clips : sequence of Clip
        Of skeletons with the same joints.
    representation : {"channels", "positions", "aligned", "scaled", "normalised"}
    target : Target, optional
        What the clips will be held to; without it the axes keep `SET_VARIANCE` of the variance.
    share : float
        How much of the target the axes may use up, on the mean over the clips.

    Returns
    -------
    SetBasis, or None where the poses have nothing in common to find: no columns, columns of
    different number, or numbers out of this world.
    """
    parts = [parts_of(clip, representation) for clip in clips]
    widths = {part.body.shape[1] for part in parts}
    bodies = np.vstack([part.body for part in parts]) if len(widths) == 1 else np.zeros((0, 0))
    if not bodies.size or np.abs(bodies).max() > FLOAT32_LIMIT:
        return None
    components = principal_components(bodies)
    if target is None:
        return SetBasis(representation, components.first(_most_variance(components, bodies)))
    every = [max(1, len(clip) // SET_MEASURED_FRAMES) for clip in clips]
    some = [part.every(stride) for part, stride in zip(parts, every, strict=True)]
    measures = [
        ErrorMeasures(clip, representation).every(target, stride)
        for clip, stride in zip(clips, every, strict=True)
    ]

    def error(count: int) -> float:
        chosen = components.first(count)
        left = [
            error_of(BodyAndRoot(chosen.restore(chosen.project(part.body)), part.root))
            for part, error_of in zip(some, measures, strict=True)
        ]
        return float(np.mean(left))

    count = fewest(error, share * target.value, len(components))
    return SetBasis(representation, components if count is None else components.first(count))


def _most_variance(components: Components, bodies: FloatArray) -> int:
    """Return how many components it takes for all but a little of the poses' variance."""
    explained = np.cumsum(components.project(bodies).var(axis=0))
    total = bodies.var(axis=0).sum()
    return int(np.searchsorted(explained, SET_VARIANCE * total)) + 1
