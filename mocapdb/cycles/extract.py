"""From a clip to its cycle, with no parameter set by hand, and how sure that is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cycles.closing import PeriodicCurve, RootFit, close_curve, fit_curve
from mocapdb.cycles.curve.flips import bridge_flips
from mocapdb.cycles.curve.harmonics import MODELS, STENCIL_REACH, HarmonicRegression, Model
from mocapdb.cycles.curve.rotation_values import RotationValues, choose_rotation_values
from mocapdb.cycles.curve.typical_curve import TypicalCurve
from mocapdb.cycles.curve.unroll_path import unroll_path
from mocapdb.cycles.cycle import Cycle, RootMotion
from mocapdb.cycles.cycle_confidence import gather_evidence, list_doubts
from mocapdb.cycles.period.autocorrelation import PeriodGuess, refined_period
from mocapdb.cycles.period.periodic_ranges import PeriodicRange, periodic_ranges, repeating_ranges
from mocapdb.cycles.phase.circular_coordinates import Topology, find_coordinates
from mocapdb.cycles.phase.cohomology import CircularCoordinates
from mocapdb.cycles.phase.excitation import LoopsOfClip, find_loops
from mocapdb.cycles.phase.pose_cloud import Embedding, principal_axes
from mocapdb.cycles.phase.stop_and_go import StopAndGo, find_rests, time_stop_and_go
from mocapdb.cycles.phase.timing import (
    BY_COORDINATES,
    Timing,
    TimingName,
    expect_timing,
    left_over_share,
    tempo_change,
    time_phases,
)
from mocapdb.cycles.synthesis.loop import (
    Loop,
    jerk,
    make_loop,
    root_relative_positions,
)
from mocapdb.cycles.synthesis.loop_start import Start, start_phase
from mocapdb.cycles.template_error import match_template
from mocapdb.cycles.tuning import (
    AGREEMENT,
    CLEAR_PERIOD,
    CONTRADICTED,
    DOUBTFUL,
    LEAST_LAPS,
    N_HARMONICS,
    PERIOD_AXES,
    PRIME,
    STOP_AND_GO_RATIO,
)
from mocapdb.errors import CycleError, NoPeriodError
from mocapdb.motion.body import Scene, part_from_scene
from mocapdb.motion.clip import Clip
from mocapdb.motion.frame_range import FrameRange, live_frames

Decider: TypeAlias = Literal["autocorrelation", "cohomology"]

CycleModel: TypeAlias = Literal["harmonic", "typical"] | Model
CYCLE_MODELS: tuple[CycleModel, ...] = ("harmonic", "typical", *MODELS)
REGRESSIONS: dict[CycleModel, Model] = {
    "harmonic": "m2",
    "typical": "m2",
    "m1": "m1",
    "m2": "m2",
    "m3": "m3",
}

__all__ = [
    "CYCLE_MODELS",
    "CycleModel",
    "Extraction",
    "Settings",
    "extract_cycle",
    "extract_cycles",
    "find_clip_loops",
]


@dataclass(frozen=True)
class Settings:
    """What an extraction can be told.

    Attributes
    ----------
    model : {"harmonic", "typical", "m1", "m2", "m3"}
        What the curve is: a harmonic regression, smoothed as much as laps differ; the typical
        trajectory (see `TypicalCurve`); or one of Raunio's regressions as they are.
    n_harmonics : int
        At most; fewer where a lap has few frames.
    ridge : float
    timing : str, optional
        One of `timing.TIMINGS`; chosen from the clip by default.
    topology : bool
        Whether the loop is found by cohomology too, and not by autocorrelation alone.
    embedding : Embedding
        What of the clip is looked at.
    prime : int
        Of the cohomology's coefficients.
    rank : int
        Which class: 0 for the most persistent.
    max_epsilon : float, optional
        See `CircularCoordinates`. A loop chosen by `rank` or this is followed even where
        autocorrelation has another period.
    follow : bool
        Whether the most persistent loop is followed so, too.
    use_velocities, use_accelerations : bool
        See `HarmonicRegression`.
    root : RootFit
        How the root's translation is fitted.

    Raises
    ------
    CycleError
        If one of them is out of range.
    """

    model: CycleModel = "harmonic"
    n_harmonics: int = N_HARMONICS
    ridge: float = 0.0
    timing: TimingName | None = None
    topology: bool = True
    embedding: Embedding = field(default_factory=Embedding)
    prime: int = PRIME
    rank: int = 0
    max_epsilon: float | None = None
    follow: bool = False
    use_velocities: bool = True
    use_accelerations: bool = True
    root: RootFit = field(default_factory=RootFit)

    def __post_init__(self) -> None:
        if self.model not in CYCLE_MODELS:
            raise CycleError(
                f"Expected a model out of {', '.join(CYCLE_MODELS)}, but got {self.model!r}."
            )
        HarmonicRegression(self.n_harmonics, ridge=self.ridge)
        CircularCoordinates(max_epsilon=self.max_epsilon, prime=self.prime, rank=self.rank)
        if self.timing is not None:
            expect_timing(self.timing)

    @property
    def by_hand(self) -> bool:
        """Whether the loop is chosen by hand: it is then followed, or an error."""
        return self.follow or self.rank > 0 or self.max_epsilon is not None

    @property
    def regression(self) -> HarmonicRegression:
        """The regression, not fitted; with the typical trajectory it is the root's alone."""
        return HarmonicRegression(
            self.n_harmonics,
            model=REGRESSIONS[self.model],
            ridge=self.ridge,
            use_velocities=self.use_velocities,
            use_accelerations=self.use_accelerations,
        )


@dataclass(frozen=True)
class Extraction:
    """A cycle, where it comes from, and how sure it is.

    Attributes
    ----------
    cycle : Cycle
    clip : Clip
        What was looked at: the range that repeats, flips bridged, its path unrolled.
    frames : (int, int)
        That range in the original clip, end-exclusive.
    timing : Timing
        Phase of every frame of `clip`.
    curve : PeriodicCurve
        Of the joints' rotations by phase, written as `rotation_values`.
    rotation_values : RotationValues
    guess : PeriodGuess
        By autocorrelation.
    topology : Topology or None
        None where cohomology found no loop.
    template_error_rad : float
        Raunio (2014), eq. 4.5, over the frames that have derivatives.
    rmse_rad : float
        Raunio (2014), eq. 4.1.
    evidence : dict of str to float
        What speaks for the cycle, each from 0 to 1.
    warnings : tuple of str
    scene : Scene, optional
        The joints above the body, which the cycle is without and its loops have again.
    decided_by : {"autocorrelation", "cohomology"}
        What the period is from: cohomology where it stops and goes on, or where the loop was chosen
        by hand, or its coordinates were asked to tell time.
    """

    cycle: Cycle
    clip: Clip
    frames: tuple[int, int]
    timing: Timing
    curve: PeriodicCurve
    rotation_values: RotationValues
    guess: PeriodGuess
    topology: Topology | None
    template_error_rad: float
    rmse_rad: float
    evidence: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    scene: Scene | None = None
    decided_by: Decider = "autocorrelation"

    @property
    def period_frames(self) -> float:
        """Mean frames of a lap."""
        return self.timing.period_frames

    @property
    def laps(self) -> float:
        """How many laps the range has."""
        return _laps(self.timing)

    @property
    def confidence(self) -> float:
        """From 0 to 1: as much as the weakest evidence."""
        return min(self.evidence.values())

    @property
    def method(self) -> str:
        """What decided the period, and how time was told.

        Where autocorrelation decided, cohomology only says how sure that is.
        """
        return f"{self.decided_by}, {self.timing.name} time"

    def loop(
        self,
        fps: float | None = None,
        *,
        n_laps: int = 1,
        root: RootMotion = "advance",
        hold_feet: bool = True,
        start: Start = "auto",
        lap_frames: int | None = None,
        closed: bool = False,
        animate: Sequence[str] | None = None,
    ) -> Loop:
        """Return the cycle as a clip that loops, from `start` on (see `start_phase`).

        It jerks no more than the clip does. See `make_loop`; `fps` is the clip's by default. With
        `animate` only these joints move (see `Cycle.animating`).
        """
        cycle = self.cycle.rephased(start_phase(self.cycle, start).phase)
        if animate is not None:
            cycle = cycle.animating(animate)
            hold_feet = hold_feet and cycle.skeleton.names[0] in animate
        loop = make_loop(
            cycle,
            self.clip.fps if fps is None else fps,
            n_laps=n_laps,
            root=root,
            hold_feet=hold_feet,
            most_jerk=self.source_jerk,
            lap_frames=lap_frames,
            closed=closed,
        )
        if self.scene is None:
            return loop
        return loop._replace(clip=self.scene.put_back(loop.clip))

    @property
    def source_jerk(self) -> float:
        """How much the clip jerks (see `loop.jerk`), prepared from its root."""
        return jerk(root_relative_positions(self.clip), self.clip.fps, closed=False)


def extract_cycle(clip: Clip, settings: Settings | None = None) -> Extraction:
    """Return the cycle of a clip in which a motion repeats.

    Parameters
    ----------
    clip : Clip
        Repeats once and a bit at least; what comes before and after may be something else.
    settings : Settings, optional

    Raises
    ------
    NoPeriodError
        If nothing repeats, or not for long enough.
    """
    settings = Settings() if settings is None else settings
    prepared = _PreparedClip.of(clip, settings)
    try:
        ranges = repeating_ranges(prepared.cloud[:, :PERIOD_AXES], clip.fps)
    except NoPeriodError as problem:
        raise NoPeriodError(f"{clip.name or 'the clip'}: {problem}") from None
    stopping = _stop_and_go(prepared, ranges[0], settings)
    if stopping is not None:
        return stopping
    for found in ranges[:-1]:
        try:
            likely = _extract_range(prepared, found, settings)
        except NoPeriodError:
            continue
        if likely.confidence > CONTRADICTED:
            return likely
    last = _extract_range(prepared, ranges[-1], settings)
    if last.confidence <= CONTRADICTED and last.guess.clarity <= CLEAR_PERIOD:
        raise NoPeriodError(
            f"Expected a motion that repeats, but {clip.name or 'the clip'!r} does not clearly: "
            f"{last.warnings[-1]}. Choose a range with two laps or more."
        )
    return last


def extract_cycles(clip: Clip, settings: Settings | None = None) -> list[Extraction]:
    """Return the cycle of every range of a clip in which something repeats, in order.

    Parameters
    ----------
    clip : Clip
        Of several motions, say; see `periodic_ranges`.
    settings : Settings, optional

    Raises
    ------
    NoPeriodError
        If nothing repeats anywhere.
    """
    settings = Settings() if settings is None else settings
    prepared = _PreparedClip.of(clip, settings)
    found = []
    for part in periodic_ranges(prepared.cloud[:, :PERIOD_AXES], clip.fps):
        try:
            found.append(_extract_range(prepared, part, settings))
        except NoPeriodError:
            continue  # too short or too unclear by itself: the other ranges may do
    found += _extract_loops(prepared, found, settings)
    return sorted(found, key=lambda each: each.frames) or [extract_cycle(clip, settings)]


def _extract_loops(
    prepared: _PreparedClip, known: list[Extraction], settings: Settings
) -> list[Extraction]:
    """Return the cycles of loops that cohomology finds where no known range is.

    Their tempo may change by more from lap to lap than ranges allow for.
    """
    if not settings.topology or settings.by_hand:
        return []
    try:
        regions = find_loops(prepared.cloud, prepared.clip.fps).regions
    except NoPeriodError:
        return []
    taken = [FrameRange(each.frames[0] - prepared.first, each.frames[1] - prepared.first)
             for each in known]  # fmt: skip
    found = []
    for region in regions:
        if not region.repeats or any(region.overlap(other) > len(region) / 2 for other in taken):
            continue
        part = prepared.cloud[region.frames, :PERIOD_AXES]
        guess = refined_period(part, region.period_frames)
        whole = PeriodicRange(region.start, region.end, guess.frames, guess.clarity, 0.0)
        try:
            likely = _extract_range(prepared, whole, settings)
        except NoPeriodError:
            continue
        if likely.confidence >= DOUBTFUL:
            found.append(replace(likely, decided_by="cohomology"))
    return found


def find_clip_loops(clip: Clip, settings: Settings | None = None) -> tuple[LoopsOfClip, int]:
    """Return the loops of a whole clip, whatever of it becomes a cycle, and where they begin.

    Parameters
    ----------
    clip : Clip
    settings : Settings, optional
        Of it, what of the clip is looked at.

    Returns
    -------
    loops : LoopsOfClip
    first : int
        Frame of the clip that is their first: what the capture held before is left out.

    Raises
    ------
    NoPeriodError
        If there is no loop at all.
    """
    prepared = _PreparedClip.of(clip, settings or Settings())
    return find_loops(prepared.cloud, prepared.clip.fps), prepared.first


@dataclass(frozen=True)
class _PreparedClip:
    """A clip as an extraction sees it.

    Attributes
    ----------
    clip : Clip
        Parted from its scene, without flips, and without the frames that the capture held at
        either end.
    first : int
        Its first frame in the original.
    cloud : (F, D)
        Its poses.
    warnings : list of str
    scene : Scene, optional
        What the body was parted from.
    """

    clip: Clip
    first: int
    cloud: FloatArray
    warnings: list[str]
    scene: Scene | None = None

    @classmethod
    def of(cls, original: Clip, settings: Settings) -> _PreparedClip:
        body, scene = part_from_scene(original)
        clip, n_flips = bridge_flips(body)
        warnings = [f"bridged {n_flips} flips of single joints"] if n_flips else []
        frames = live_frames(clip.channels)
        if len(frames) < len(clip):
            warnings.append(
                f"frames {frames.start}:{frames.end} are live, those around them are one frame held"
            )
        live = clip[frames.frames]
        return cls(live, frames.start, settings.embedding.cloud(live), warnings, scene)


def _stop_and_go(
    prepared: _PreparedClip, likeliest: PeriodicRange, settings: Settings
) -> Extraction | None:
    """Return the cycle of a clip that stops and goes on, if it does, and repeats over its rests.

    Autocorrelation finds a stretch of it, or takes a rest for a part of the lap. What has a rest in
    each lap, always at the same place, it finds as well.
    """
    if not settings.topology or settings.by_hand or settings.timing is not None:
        return None
    found = time_stop_and_go(prepared.cloud, prepared.clip.fps)
    if found is None:
        return None
    period = found.timing.period_frames
    whole = PeriodicRange(0, len(prepared.clip), period, 1.0, likeliest.path_length)
    likeliest_laps = len(likeliest) / likeliest.period_frames
    longer = likeliest.period_frames > STOP_AND_GO_RATIO * period
    if not longer and _laps(found.timing) < STOP_AND_GO_RATIO * likeliest_laps:
        return None
    return _extract_range(prepared, whole, settings, found)


def _extract_range(
    prepared: _PreparedClip,
    found: PeriodicRange,
    settings: Settings,
    stopping: StopAndGo | None = None,
) -> Extraction:
    """Return the cycle of a range; `stopping` tells time in one that has rests."""
    warnings = list(prepared.warnings)
    start, end = prepared.first + found.start, prepared.first + found.end
    whole = len(found) == len(prepared.clip)
    if not whole:
        warnings.append(f"frames {start}:{end} repeat, the others were left out")
    part = prepared.clip if whole else prepared.clip[found.frames]
    guess = PeriodGuess(found.period_frames, found.clarity)
    topology = None
    if settings.topology and stopping is None:
        cloud = prepared.cloud[found.frames]
        topology = _find_topology(cloud, guess, prepared.clip.fps, settings)
    unrolled = unroll_path(part, guess.frames)
    rotation_values = choose_rotation_values(unrolled.clip)
    values = rotation_values.encode(unrolled.clip)
    if stopping is None:
        timing = _tell_time(values, guess, topology, settings)
    else:
        timing, topology = stopping
    by_coordinates = settings.by_hand or timing.name in BY_COORDINATES
    laps = _laps(timing)
    if laps < LEAST_LAPS:
        raise NoPeriodError(
            f"Expected {LEAST_LAPS} laps at least, but {part.name or 'the clip'!r} has {laps:.2f} "
            f"of {timing.period_frames:.0f} frames. "
            + ("Take a longer clip, or another loop." if whole else "Take a longer range.")
        )
    fitted = slice(STENCIL_REACH, len(values) - STENCIL_REACH)
    curve = _curve(values, timing, settings)
    missing = values[fitted] - curve.predict(timing.phase[fitted])
    n_frames = max(2, round(timing.period_frames))
    lap = curve.predict(np.arange(n_frames) / n_frames)
    share = len(part) / len(prepared.clip)
    evidence = gather_evidence(
        guess,
        topology,
        timing.period_frames,
        laps,
        share,
        left_over=left_over_share(prepared.cloud[found.frames], timing),
        tempo_change=tempo_change(timing),
        rests=bool(find_rests(prepared.cloud[found.frames], prepared.clip.fps).any()),
    )
    warnings += list_doubts(guess, topology, laps, evidence, settings.by_hand)
    return Extraction(
        cycle=close_curve(
            unrolled,
            rotation_values.decode,
            curve,
            timing,
            settings.regression,
            settings.root,
            smooth=settings.model in ("harmonic", "typical"),
        ),
        clip=unrolled.clip,
        frames=(start, end),
        timing=timing,
        curve=curve,
        rotation_values=rotation_values,
        guess=guess,
        topology=topology,
        template_error_rad=match_template(values[fitted], lap).error,
        rmse_rad=float(np.sqrt((missing**2).sum(axis=1).mean())),
        evidence=evidence,
        warnings=tuple(warnings),
        scene=prepared.scene,
        decided_by="cohomology" if by_coordinates else "autocorrelation",
    )


def _curve(values: FloatArray, timing: Timing, settings: Settings) -> PeriodicCurve:
    """Return the curve through poses (F, D), of the model that is wanted."""
    if settings.model == "typical":
        return TypicalCurve(timing.phase, values, timing.period_frames)
    return fit_curve(values, timing, settings.regression, smooth=settings.model == "harmonic")


def _laps(timing: Timing) -> float:
    """Return how many laps there are, rests left out."""
    return float(timing.phase[-1] - timing.phase[0]) * len(timing.phase) / (len(timing.phase) - 1)


def _find_topology(
    cloud: FloatArray, guess: PeriodGuess, fps: float, settings: Settings
) -> Topology | None:
    try:
        return find_coordinates(
            cloud,
            guess.frames,
            fps,
            delays=settings.embedding.delays,
            lag=settings.embedding.lag,
            prime=settings.prime,
            rank=settings.rank,
            max_epsilon=settings.max_epsilon,
            join_neighbours=settings.embedding.join_neighbours,
        )
    except NoPeriodError:
        if settings.by_hand:
            raise
        return None  # the period by autocorrelation stands alone, and the evidence says so


def _tell_time(
    values: FloatArray, guess: PeriodGuess, topology: Topology | None, settings: Settings
) -> Timing:
    """Return the phase of every frame, by coordinates that agree with the autocorrelation."""
    period, coordinates = guess.frames, None
    if topology is not None:
        if settings.by_hand:
            period = topology.period_frames
        if abs(topology.period_frames / period - 1.0) < AGREEMENT:
            coordinates = topology.phase(len(values))
    return time_phases(principal_axes(values, PERIOD_AXES), period, coordinates, settings.timing)
