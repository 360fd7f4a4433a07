"""Why a stretch was found: which joints and which moments are like the query.

Frames of both that were matched with each other are compared joint by joint. How far a joint is
apart is told in metres, and as a share of what it is apart in two frames taken at random: 0 is the
same, 1 is any motion, as of the distance of a hit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.indexing.canonical.canonical_body import JOINTS
from mocapdb.indexing.canonical.canonical_motion import CanonicalMotion
from mocapdb.indexing.search.body_parts import PARTS, joint_above
from mocapdb.indexing.search.features import N_POSE, FeatureSpace
from mocapdb.indexing.search.warping import warp_whole

__all__ = ["Agreement", "agreement_of", "whole_path"]

SHOWN_PARTS = ("head", "trunk", "left-arm", "right-arm", "left-leg", "right-leg")


@dataclass(frozen=True, eq=False)
class Agreement:
    """How far a stretch is from the query, joint by joint and moment by moment.

    Attributes
    ----------
    joints : tuple of str
        The J joints that counted, without the hips, which everything is seen from.
    query_s, clip_s : (n,) seconds
        The moments that were matched: from the query's first frame, and from the clip's.
    apart_m : (n, J) metres
        How far each joint is apart, on the canonical body.
    usual_m : (J,) metres
        How far it is apart in two frames taken at random from the library.
    """

    joints: tuple[str, ...]
    query_s: FloatArray
    clip_s: FloatArray
    apart_m: FloatArray
    usual_m: FloatArray

    def of_joints(self) -> dict[str, tuple[float, float]]:
        """Return (share of usual, metres) of each joint, means over the moments."""
        metres = self.apart_m.mean(axis=0)
        shares = metres / self.usual_m
        return {
            joint: (float(share), float(apart))
            for joint, share, apart in zip(self.joints, shares, metres, strict=True)
        }

    def of_parts(self) -> dict[str, tuple[float, float]]:
        """Return (share of usual, metres) of the parts of the body that counted, the best first."""
        shares, metres = self.part_moments(), self._by_part(self.apart_m)
        each = {part: (float(shares[part].mean()), float(metres[part].mean())) for part in shares}
        return dict(sorted(each.items(), key=lambda item: item[1]))

    def part_moments(self) -> dict[str, FloatArray]:
        """Return (n,) shares of usual at each moment, by part of the body."""
        return self._by_part(self.apart_m / self.usual_m)

    def of_moments(self) -> FloatArray:
        """Return (n,) shares of usual, means over the joints."""
        return np.asarray((self.apart_m / self.usual_m).mean(axis=1))

    def _by_part(self, values: FloatArray) -> dict[str, FloatArray]:
        found = {}
        for part in SHOWN_PARTS:
            own = [self.joints.index(j) for j in PARTS.get(part, (part,)) if j in self.joints]
            if own:
                found[part] = np.asarray(values[:, own].mean(axis=1))
        return found


def agreement_of(
    query: CanonicalMotion,
    clip: CanonicalMotion,
    path: IntArray,
    space: FeatureSpace,
    *,
    speed: float = 1.0,
    joints: Sequence[str] = (),
) -> Agreement:
    """Return how far a stretch is from a query.

    Parameters
    ----------
    query, clip : CanonicalMotion
    path : (n,)
        The frame of the clip that each frame of the query is matched with.
    space : FeatureSpace
        Of the whole body; it knows what is usual.
    speed : float
        How many seconds of the example a second of the query is.
    joints : sequence of str
        Those that counted; all by default.
    """
    counted = [joint for joint in JOINTS[1:] if not joints or joint in joints] or list(
        JOINTS[1:]
    )  # the hips alone: how the body as a whole goes
    rows = [JOINTS.index(joint) for joint in counted]
    above = [joint_above(joint, joints) for joint in counted]
    ours, theirs = query.pose[: len(path)], clip.pose[np.minimum(path, len(clip) - 1)]
    seen = [pose[:, rows] - pose[:, above] for pose in (ours, theirs)]
    return Agreement(
        tuple(counted),
        np.arange(len(path)) / query.fps * speed,
        path / clip.fps,
        np.linalg.norm(seen[0] - seen[1], axis=2),
        _usual(space, rows, above),
    )


def _usual(space: FeatureSpace, rows: Sequence[int], above: Sequence[int]) -> FloatArray:
    """Return the root mean square of how far joints are apart in two frames taken at random."""
    pose = np.zeros((len(JOINTS), 3, space.n_dims))
    pose[1:] = space.axes[:N_POSE].reshape(-1, 3, space.n_dims)
    spread = (pose[list(rows)] - pose[list(above)]) * space.deviations
    return np.asarray(np.maximum(np.sqrt(2 * (spread**2).sum(axis=(1, 2))), 1e-3))


def whole_path(query: CanonicalMotion, clip: CanonicalMotion) -> IntArray:
    """Return the (n,) frame of a clip for each frame of a query, warped from end to end.

    Steps are (1, 1), (1, 2) and (2, 1), over even samples of both, as whole clips are compared.
    """
    n = min(len(query), len(clip), 48)
    times = [np.linspace(0, len(motion) - 1, n) for motion in (query, clip)]
    ours, theirs = (
        motion.pose[np.rint(at).astype(int)].reshape(n, -1)
        for motion, at in zip((query, clip), times, strict=True)
    )
    apart = np.linalg.norm(ours[:, None] - theirs[None], axis=2)
    at, _ = warp_whole(apart.astype(np.float32))
    frames = np.interp(np.arange(len(query)), times[0][at[:, 0]], times[1][at[:, 1]])
    return np.asarray(np.rint(frames), dtype=np.int64)
