"""Clips with known truth: a motion, a body, a tempo and the noise of a sensor.

Everything random comes from the seed: the same arguments give the same bytes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypedDict, Unpack

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.corpus.synthetic.body import make_skeleton, measure
from mocapdb.corpus.synthetic.gait import TURN
from mocapdb.corpus.synthetic.motions import MOTIONS
from mocapdb.corpus.synthetic.posing import solve
from mocapdb.corpus.synthetic.sequence import perform_sequence
from mocapdb.corpus.synthetic.style import draw_style
from mocapdb.corpus.synthetic.tempo import Tempo
from mocapdb.corpus.tuning import DEFAULT_DURATION_S, N_SEGMENTS, SEGMENT_S
from mocapdb.errors import ClipError
from mocapdb.motion.clip import Clip
from mocapdb.motion.frame_range import Segment
from mocapdb.motion.rotations import continuous_angles, elementary, extract_angles
from mocapdb.motion.skeleton import Skeleton

__all__ = ["CLASSES", "SEQUENCE", "Truth", "make", "make_clip"]

CLASSES = ("walk", "run", "hop", "box", "wave", "squat")
SEQUENCE = "sequence"


@dataclass(frozen=True)
class Truth:
    """What is known of a synthetic clip.

    Attributes
    ----------
    label : str
        The class, or ``"sequence"``.
    phase : (F,) radians
        Unwrapped. Of a walk or run, a multiple of 2 pi where the left foot lands. In a sequence
        it starts anew with each segment.
    period_s : float, seconds
        Mean duration of a cycle; NaN for a sequence.
    segments : tuple of Segment
        One for a single class. Of a sequence, boundaries are in the middle of the transitions.
    contacts : (F, 2)
        Whether the left and the right foot are on the ground, from the landing of the heel to the
        parting of the toes. A foot rolls, so its ball is at rest while it is down, not before.
    clean : Clip
        The clip without sensor noise.
    """

    label: str
    phase: FloatArray
    period_s: float
    segments: tuple[Segment, ...]
    contacts: BoolArray
    clean: Clip

    @property
    def period_frames(self) -> float:
        """Mean duration of a cycle in frames."""
        return self.period_s * self.clean.fps


class ClipOptions(TypedDict, total=False):
    """The options of `make`, which describes them."""

    skeleton: Skeleton | None
    n_cycles: float | None
    duration_s: float | None
    speed: float
    fps: float
    tempo_drift: float
    phase_noise: float
    period_jitter: float
    sensor_noise_deg: float
    heading_deg: float
    name: str | None


def make_clip(kind: str, *, seed: int, **options: Unpack[ClipOptions]) -> Clip:
    """Return a clip of one class, or a sequence of several; see `make`.

    Examples
    --------
    >>> clip = make_clip("walk", seed=1)
    >>> clip.name, clip.label, len(clip), clip.fps
    ('walk_1', 'walk', 600, 120.0)
    """
    return make(kind, seed=seed, **options)[0]


def make(
    kind: str,
    *,
    seed: int,
    skeleton: Skeleton | None = None,
    n_cycles: float | None = None,
    duration_s: float | None = None,
    speed: float = 1.0,
    fps: float = 120.0,
    tempo_drift: float = 0.0,
    phase_noise: float = 0.0,
    period_jitter: float = 0.0,
    sensor_noise_deg: float = 0.0,
    heading_deg: float = 0.0,
    name: str | None = None,
) -> tuple[Clip, Truth]:
    """Return a clip and the truth about it.

    Parameters
    ----------
    kind : str
        One of `CLASSES`, or ``"sequence"`` for three different ones after each other.
    seed : int
        Chooses the style, the first phase and every noise; the body only if asked to (`subject`).
    skeleton : Skeleton, optional
        A body from `make_skeleton` or `subject`. By default 1.75 m of average proportions.
    n_cycles, duration_s : float, optional
        Length of the clip in cycles or in seconds. By default 5 s, and 2.5 s to 3.5 s
        for each class of a sequence.
    speed : float
        Relative to the usual, 2 is twice as fast. A walk or run changes stride and cadence in
        equal parts.
    fps : float, frames per second
    tempo_drift : float
        Change of tempo from the first frame to the last, relative to the mean.
    phase_noise : float, radians
        Standard deviation of a slow wandering of the phase.
    period_jitter : float
        Standard deviation of the durations of the cycles, relative to their mean.
    sensor_noise_deg : float, degrees
        Standard deviation of white noise on every angle channel.
    heading_deg : float, degrees
        Turn of the whole motion to the left about the vertical. Zero goes along +z.
    name : str, optional
        Name of the clip; kind and seed by default.

    Returns
    -------
    clip : Clip
    truth : Truth

    Raises
    ------
    ClipError
        If the kind is unknown, the length is not positive, or phase would run backwards.
    SkeletonError
        If the skeleton lacks joints of the CMU topology.
    """
    kinds = (*CLASSES, SEQUENCE)
    if kind not in kinds:
        raise ClipError(f"Expected a kind of motion out of {', '.join(kinds)}, but got {kind!r}.")
    for what, value in {"speed": speed, "fps": fps}.items():
        if not (math.isfinite(value) and value > 0):
            raise ClipError(f"Expected a positive {what}, but got {value}.")
    rng = np.random.default_rng([seed, kinds.index(kind)])
    skeleton = make_skeleton() if skeleton is None else skeleton
    dimensions, style = measure(skeleton), draw_style(rng)
    tempo = Tempo(tempo_drift, phase_noise, period_jitter)
    if kind == SEQUENCE:
        parts = _draw_parts(rng, n_cycles, duration_s, fps)
        targets, phase = perform_sequence(rng, dimensions, style, tempo, speed, fps, parts)
        bounds = [0, *np.cumsum([n_frames for _, n_frames in parts]).tolist()]
        segments = tuple(
            Segment(start, end, part)
            for (part, _), start, end in zip(parts, bounds[:-1], bounds[1:], strict=True)
        )
        period_s = math.nan
    else:
        motion = MOTIONS[kind]
        who = motion.performance(dimensions, style, speed)
        n_frames = _n_frames(n_cycles, duration_s, who.period_s, fps)
        cycle = tempo.cycles(rng, n_frames, who.period_s, fps)
        targets, phase = motion.perform(cycle, who), TURN * cycle
        segments = (Segment(0, n_frames, kind),)
        period_s = who.period_s
        if n_frames > 1 and not tempo.steady:
            period_s = (n_frames - 1) / fps / float(cycle[-1] - cycle[0])
    start_m = targets.pelvis_m[0] * [1.0, 0.0, 1.0]
    channels = solve(skeleton, targets.moved(-start_m))
    _turn_about_vertical(channels, heading_deg)
    clean = Clip(
        skeleton,
        channels,
        fps,
        name=f"{kind}_{seed}" if name is None else name,
        label=kind,
        provenance=(f"synthetic {kind}, seed {seed}",),
    )
    truth = Truth(kind, phase, period_s, segments, targets.contacts, clean)
    return _with_sensor_noise(rng, clean, sensor_noise_deg), truth


def _n_frames(n_cycles: float | None, duration_s: float | None, period_s: float, fps: float) -> int:
    if n_cycles is not None and duration_s is not None:
        raise ClipError("Expected n_cycles or duration_s, but got both. Leave one out.")
    if n_cycles is not None:
        duration_s = n_cycles * period_s
    elif duration_s is None:
        duration_s = DEFAULT_DURATION_S
    if not (math.isfinite(duration_s) and duration_s > 0):
        raise ClipError(f"Expected a positive length of the clip, but got {duration_s} s.")
    return max(1, round(duration_s * fps))


def _draw_parts(
    rng: np.random.Generator, n_cycles: float | None, duration_s: float | None, fps: float
) -> list[tuple[str, int]]:
    """Return class and number of frames of the segments of a sequence."""
    if n_cycles is not None:
        raise ClipError("Expected duration_s for a sequence, but got n_cycles.")
    kinds = rng.permutation(CLASSES)[:N_SEGMENTS].tolist()
    lengths_s = rng.uniform(*SEGMENT_S, N_SEGMENTS)
    if duration_s is None:
        duration_s = float(lengths_s.sum())
    n_frames = max(N_SEGMENTS, _n_frames(None, duration_s, math.nan, fps))
    bounds = np.rint(np.cumsum(lengths_s) / lengths_s.sum() * (n_frames - N_SEGMENTS))
    lengths = np.diff(bounds.astype(int), prepend=0) + 1
    return list(zip(kinds, lengths.tolist(), strict=True))


def _turn_about_vertical(channels: FloatArray, heading_deg: float) -> None:
    """Turn root position and rotation, the first six channels, in place."""
    if heading_deg == 0.0:
        return
    turn = elementary("Y", np.deg2rad(np.array(heading_deg)))
    channels[:, :3] = channels[:, :3] @ turn.T
    x, y, z = np.deg2rad(channels[:, 3:6]).T
    rotation = turn @ elementary("Z", z) @ elementary("Y", y) @ elementary("X", x)
    angles = np.rad2deg(continuous_angles("ZYX", extract_angles("ZYX", rotation)))
    channels[:, 3:6] = angles[:, ::-1]


def _with_sensor_noise(rng: np.random.Generator, clip: Clip, noise_deg: float) -> Clip:
    if noise_deg == 0.0:
        return clip
    channels = clip.channels.copy()
    angles = clip.skeleton.rotation_channels
    channels[:, angles] += rng.normal(0.0, noise_deg, (len(channels), len(angles)))
    return clip.replace(channels=channels, step=f"sensor noise of {noise_deg:g} degrees")
