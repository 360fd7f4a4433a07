"""Several classes after each other, each faded into the next."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.corpus.synthetic.body import Dimensions
from mocapdb.corpus.synthetic.motions import MOTIONS
from mocapdb.corpus.synthetic.posing import PoseTargets, blend, concatenate
from mocapdb.corpus.synthetic.style import Style
from mocapdb.corpus.synthetic.tempo import Tempo
from mocapdb.corpus.tuning import AT_REST_M, STEP_LIFT_M, TRANSITION_S

__all__ = ["perform_sequence"]


def perform_sequence(
    rng: np.random.Generator,
    dimensions: Dimensions,
    style: Style,
    tempo: Tempo,
    speed: float,
    fps: float,
    parts: Sequence[tuple[str, int]],
) -> tuple[PoseTargets, FloatArray]:
    """Return poses and phases of several classes.

    Parameters
    ----------
    rng : Generator
    dimensions : Dimensions
    style : Style
    tempo : Tempo
    speed : float
    fps : float, frames per second
    parts : sequence of (str, int)
        Class and number of frames of each segment.

    Returns
    -------
    targets : PoseTargets
    phase : (F,) radians
        Of each segment its own.
    """
    shortest = min(n_frames for _, n_frames in parts)
    half = min(round(TRANSITION_S * fps / 2), shortest // 2)
    poses, steps, phases = [], [], []
    for i, (kind, n_frames) in enumerate(parts):
        before, after = half * (i > 0), half * (i < len(parts) - 1)
        motion = MOTIONS[kind]
        who = motion.performance(dimensions, style, speed)
        cycle = tempo.cycles(rng, before + n_frames + after, who.period_s, fps)
        still, step = _on_the_spot(motion.perform(cycle, who))
        poses.append(still)
        steps.append(step)
        phases.append(2 * math.pi * cycle[before : before + n_frames])
    targets, step = poses[0], steps[0]
    for next_targets, next_step in zip(poses[1:], steps[1:], strict=True):
        targets, step = _faded(targets, step, next_targets, next_step, 2 * half)
    return targets.moved(np.cumsum(step, axis=0)), np.concatenate(phases)


def _on_the_spot(targets: PoseTargets) -> tuple[PoseTargets, FloatArray]:
    """Return the motion with the pelvis above the origin, and (F, 3) its steps on the ground."""
    track = targets.pelvis_m * [1.0, 0.0, 1.0]
    step = np.diff(track, axis=0, prepend=track[:1])
    if len(step) > 1:
        step[0] = step[1]
    return targets.moved(-track), step


def _faded(
    a: PoseTargets, a_step: FloatArray, b: PoseTargets, b_step: FloatArray, overlap: int
) -> tuple[PoseTargets, FloatArray]:
    """Return `a` and then `b`, faded over the last frames of one and the first of the other."""
    if overlap == 0:
        return concatenate([a, b]), np.concatenate([a_step, b_step])
    x = (np.arange(overlap) + 0.5) / overlap
    weight = x * x * x * (x * (6 * x - 15) + 10)
    ending, beginning = a[-overlap:], b[:overlap]
    middle = blend(ending, beginning, weight)
    # feet that have to go elsewhere are lifted, the others stay on the ground
    way = np.linalg.norm((beginning.balls_m - ending.balls_m)[:, :, [0, 2]], axis=2)
    lift = np.minimum(STEP_LIFT_M, way / 2) * 4 * (weight * (1 - weight))[:, None]
    middle.balls_m[:, :, 1] += lift
    middle.contacts[:] &= lift < AT_REST_M
    step_weight = weight[:, None]
    step = (1 - step_weight) * a_step[-overlap:] + step_weight * b_step[:overlap]
    return (
        concatenate([a[:-overlap], middle, b[overlap:]]),
        np.concatenate([a_step[:-overlap], step, b_step[overlap:]]),
    )
