"""Root jumps: the whole body is elsewhere for a while, as where a solver loses the hips.

Two edges of the root's translation whose jumps cancel. A single jump, from which the body does not
come back, is a cut in the take. The evidence, in logarithms but for the misfit:

============  ====================================================================================
`jump`        how far the body jumps at the lesser edge, in millimetres
`strength`    the same against its usual jumps
`misfit`      how badly the jumps cancel, 0 to 1
`length`      in seconds
============  ====================================================================================
"""

from __future__ import annotations

import math

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cleaning.evidence.hypotheses import Hypothesis
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.tuning import (
    BACKGROUND_QUANTILE,
    LEAST_LENGTH_S,
    LEAST_ROOT_JUMP_M,
    LEAST_ROOT_SCALE_M,
    LONGEST_SOFT_S,
    OFFSET_MISFIT,
    ROOT_EDGE_RATIO,
)
from mocapdb.motion.body import understand
from mocapdb.motion.clip import Clip

__all__ = ["ROOT_EVIDENCE", "find_root_jumps", "root_columns"]

ROOT_EVIDENCE = ("jump", "strength", "misfit", "length")


def root_columns(clip: Clip, joint: int) -> list[int]:
    """Return the columns of a joint's translation."""
    start = int(clip.skeleton.channel_starts[joint])
    dofs = clip.skeleton.dofs[joint]
    return [start + i for i, dof in enumerate(dofs) if dof.startswith("t")]


def find_root_jumps(clip: Clip, native: Texture) -> list[Hypothesis]:
    """Return the stretches in which the root's translation has jumped away."""
    body = understand(clip.skeleton, clip.channels)
    root = body.root.value
    columns, rows = root_columns(clip, root), np.flatnonzero(native.joints == root)
    if not columns or not len(rows) or len(clip) < 5:
        return []
    places = clip.channels[:, columns] * body.unit_m.value
    steps = np.diff(places, axis=0)
    sizes = _jumps(steps)
    scale = max(float(np.quantile(sizes, BACKGROUND_QUANTILE)), LEAST_ROOT_SCALE_M)
    edges = np.flatnonzero((sizes > ROOT_EDGE_RATIO * scale) & (sizes > LEAST_ROOT_JUMP_M)).tolist()
    options = []
    for i, first in enumerate(edges):
        for last in edges[i + 1 :]:
            if last - first > LONGEST_SOFT_S * clip.fps:
                break
            before = steps[first - 1] if first else np.zeros_like(steps[0])
            after = steps[last + 1] if last + 1 < len(steps) else np.zeros_like(steps[0])
            away, back = steps[first] - before, steps[last] - after
            larger = max(float(np.linalg.norm(away)), float(np.linalg.norm(back)))
            misfit = float(np.linalg.norm(away + back)) / larger
            if misfit < OFFSET_MISFIT:
                options.append((misfit + 0.02 * (last - first) / clip.fps, first, last, misfit))
    found, used = [], set[int]()
    for _, first, last, misfit in sorted(options):
        if not used.isdisjoint((first, last)):
            continue
        used |= {first, last}
        jump = float(min(sizes[first], sizes[last]))
        evidence = (
            math.log(jump * 1000.0),
            math.log(jump / scale),
            misfit,
            math.log(max((last - first) / clip.fps, LEAST_LENGTH_S)),
        )
        found.append(Hypothesis(first + 1, last + 1, int(rows[0]), "pop", evidence, "root"))
    return found


def _jumps(steps: FloatArray) -> FloatArray:
    """Return how far each step differs from the nearer of the steps beside it."""
    change = np.linalg.norm(np.diff(steps, axis=0), axis=1)
    sizes = np.concatenate([change[:1], np.minimum(change[:-1], change[1:]), change[-1:]])
    return np.asarray(sizes)
