"""What is looked for: a motion, or several examples of one.

A query is searched twice, as it is and at double speed, because its velocities count and the
velocities of a slow performance fit anything. Costs of the two, as of queries of any kind, become
comparable when each is divided by its median over the index: a distance of 1 is that of a stretch
taken at random, and one threshold serves every query.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from mocapdb.base.arrays import Float32Array
from mocapdb.errors import ClipError
from mocapdb.indexing.canonical.canonical_motion import FPS, CanonicalMotion
from mocapdb.indexing.search.features import FeatureSpace
from mocapdb.indexing.search.frame_store import outline_of, sketch_of
from mocapdb.indexing.tuning import MIN_QUERY_S, SPEEDS

__all__ = ["Query", "Template"]


@dataclass(frozen=True)
class Query:
    """What to look for: one motion, or several examples of it.

    Parameters
    ----------
    examples : sequence of CanonicalMotion
        At the rate of the index, `FPS`.
    mirror : bool
        Whether left and right may have changed places.

    Raises
    ------
    ClipError
        If there is no example, or one is shorter than 0.3 s.
    """

    examples: tuple[CanonicalMotion, ...]
    mirror: bool = False

    def __init__(self, examples: Iterable[CanonicalMotion], *, mirror: bool = False) -> None:
        object.__setattr__(self, "examples", tuple(examples))
        object.__setattr__(self, "mirror", mirror)
        if not self.examples:
            raise ClipError("Expected at least one example to look for, but got none.")
        for example in self.examples:
            if len(example) / example.fps < MIN_QUERY_S - 1e-9:
                raise ClipError(
                    f"Expected a query of {MIN_QUERY_S} s or more, but got "
                    f"{len(example) / example.fps:.2f} s. Choose a longer range."
                )

    def templates(self, space: FeatureSpace) -> list[Template]:
        """Return the sequences of frames that stand for the query."""
        return [
            Template(space.frames(motion.resampled(FPS, speed)), len(example))
            for example in self.examples
            for motion in ((example, example.mirrored()) if self.mirror else (example,))
            for speed in SPEEDS
        ]


@dataclass(frozen=True, eq=False)
class Template:
    """Frames to look for.

    Parameters
    ----------
    frames : (n, D) float32, metres
    example_frames : int
        Length of the example that they stand for.
    reference : float, metres
        Cost of a stretch taken at random.
    """

    frames: Float32Array
    example_frames: int
    reference: float = 1.0

    def __len__(self) -> int:
        return len(self.frames)

    @property
    def scale(self) -> np.float32:
        """What a sum of distances is multiplied by, so that a random stretch is 1 away."""
        return np.float32(1.0 / (len(self) * self.reference))

    @property
    def factors(self) -> Float32Array:
        """(n, D + 1) the frames as `mocapdb.indexing.search.warping.two_rows` takes them."""
        norms = np.einsum("ij,ij->i", self.frames, self.frames)
        return np.column_stack([-2.0 * self.frames, norms])

    def sketched(self) -> Template:
        """Return what stands for the template in the sketch of an index."""
        return replace(self, frames=sketch_of(self.frames))

    def outlined(self) -> Template:
        """Return what stands for the template in the outline of an index."""
        return replace(self, frames=outline_of(sketch_of(self.frames)))
