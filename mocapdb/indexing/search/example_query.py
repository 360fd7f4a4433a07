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

from mocapdb.base.arrays import Float32Array, FloatArray
from mocapdb.errors import ClipError
from mocapdb.indexing.canonical.canonical_motion import FPS, CanonicalMotion
from mocapdb.indexing.search.features import FeatureSpace
from mocapdb.indexing.search.frame_store import outline_of, sketch_of
from mocapdb.indexing.search.turning import net_turn
from mocapdb.indexing.search.warping import frame_distances
from mocapdb.indexing.tuning import MIN_QUERY_S, SPEEDS

__all__ = ["Query", "Template", "liveliest_range", "mean_speed", "stillest_range"]


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
            # a range in seconds comes to whole frames: half a frame less is as long
            if len(example) + 0.5 < MIN_QUERY_S * example.fps:
                raise ClipError(
                    f"Expected a query of {MIN_QUERY_S} s or more, but got "
                    f"{len(example) / example.fps:.2f} s. Choose a longer range."
                )

    def templates(self, space: FeatureSpace, *, all_features: bool = False) -> list[Template]:
        """Return the sequences of frames that stand for the query.

        Parameters
        ----------
        space : FeatureSpace
        all_features : bool
            Whether what of them lies beside the axes counts too, so that distances in spaces with
            other axes are comparable.
        """
        found = []
        for motion in self.performances():
            for speed in SPEEDS:
                own, left_out = motion.resampled(FPS, speed), None
                if all_features:
                    frames, left_out = space.all_features(own)
                else:
                    frames = space.frames(own)
                found.append(
                    Template(frames, len(motion), turn=net_turn(motion), left_out=left_out)
                )
        return found

    def performances(self) -> list[CanonicalMotion]:
        """Return the examples, each followed by its mirror image where that counts as well."""
        return [
            motion
            for example in self.examples
            for motion in ((example, example.mirrored()) if self.mirror else (example,))
        ]

    def of_template(self, number: int) -> tuple[CanonicalMotion, float]:
        """Return the motion that one of `templates` stands for, and how fast it goes."""
        motion, speed = self.performances()[number // len(SPEEDS)], SPEEDS[number % len(SPEEDS)]
        return motion.resampled(FPS, speed), speed


def joint_speeds(motion: CanonicalMotion) -> FloatArray:
    """Return (F - 1,) metres a second: how fast joints go between frames, in and with the body."""
    steps = np.linalg.norm(np.diff(motion.pose, axis=0), axis=2).mean(axis=1)
    return np.asarray((steps + np.linalg.norm(np.diff(motion.root, axis=0), axis=1)) * motion.fps)


def mean_speed(motion: CanonicalMotion) -> float:
    """Return how fast the joints of a motion go on average, in metres a second."""
    return float(joint_speeds(motion).mean()) if len(motion) > 1 else 0.0


def liveliest_range(motion: CanonicalMotion, n: int) -> slice:
    """Return the n frames of a motion in which its joints go furthest."""
    gone = np.concatenate([[0.0], np.cumsum(joint_speeds(motion))])
    first = int(np.argmax(gone[n - 1 :] - gone[: len(gone) - n + 1]))
    return slice(first, first + n)


def stillest_range(motion: CanonicalMotion, n: int) -> slice:
    """Return the n frames of a motion in which its joints go least."""
    gone = np.concatenate([[0.0], np.cumsum(joint_speeds(motion))])
    first = int(np.argmin(gone[n - 1 :] - gone[: len(gone) - n + 1]))
    return slice(first, first + n)


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
    turn : float, radians, optional
        By how much the example turns in all.
    left_out : (n,) float32, square metres, optional
        What is added to the squares of distances: see `FeatureSpace.all_features`.
    """

    frames: Float32Array
    example_frames: int
    reference: float = 1.0
    turn: float | None = None
    left_out: Float32Array | None = None

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
        if self.left_out is not None:
            norms = norms + self.left_out
        return np.column_stack([-2.0 * self.frames, norms])

    def distances(self, frames: Float32Array) -> Float32Array:
        """Return the (n, F) distances of its frames from frames (F, D) of an index, in metres."""
        if self.left_out is None:
            return frame_distances(self.frames, frames)
        own = np.column_stack([self.frames, np.sqrt(self.left_out)])
        return frame_distances(own, np.column_stack([frames, np.zeros(len(frames), np.float32)]))

    def sketched(self) -> Template:
        """Return what stands for the template in the sketch of an index."""
        return replace(self, frames=sketch_of(self.frames), left_out=None)

    def outlined(self) -> Template:
        """Return what stands for the template in the outline of an index."""
        return replace(self, frames=outline_of(sketch_of(self.frames)), left_out=None)
