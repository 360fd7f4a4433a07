"""From a clip to its cycle, with no parameter set by hand, and how sure that is."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from mocapdb._typing import FloatArray
from mocapdb.cycles.cohomology import CircularCoordinates, expect_odd_prime
from mocapdb.cycles.cycle import N_SAMPLES, Cycle, shift_values, to_columns
from mocapdb.cycles.embedding import (
    aligned_positions,
    delay_embedding,
    principal_axes,
)
from mocapdb.cycles.flips import without_flips
from mocapdb.cycles.guard import PeriodGuess, guess_period
from mocapdb.cycles.harmonics import HarmonicRegression, Model, finite_differences
from mocapdb.cycles.phase import fit_laps, forwards, unwrapped
from mocapdb.cycles.regions import periodic_ranges
from mocapdb.cycles.straight import Straightened, straightened
from mocapdb.cycles.template import match_template
from mocapdb.cycles.timing import Timing, TimingName, expect_timing, time_phases
from mocapdb.cycles.values import PoseValues, choose_values
from mocapdb.errors import NoPeriodError
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.rotations import elementary

__all__ = [
    "Extraction",
    "Settings",
    "Topology",
    "extract_cycle",
    "extract_cycles",
    "find_coordinates",
]

N_AXES = 8
COORDINATE_HZ = 30.0
MOST_POINTS = 320
DELAYS = 2
LAG_OF_PERIOD = 1 / 8
AGREEMENT = 0.08
DISAGREEMENT = 0.25
EDGE = 4  # frames at each end without derivatives (eqs. 3.23 and 3.24)
LEAST_LAPS = 1.2
FEW_LAPS = 1.5
DOUBTFUL = 0.5
GUARD_IS_CLEAR = 0.75
CLEARLY_REPEATED = 2.2  # laps: fewer may be one long way and back, made of many short laps
MUCH_SHORTER = 0.6
LEVEL_ADVANCE = 0.03  # of the height: less than this a lap is no climbing
STANDING_ADVANCE = 0.02


@dataclass(frozen=True)
class Settings:
    """What an extraction can be told.

    Attributes
    ----------
    model : {"m1", "m2", "m3"}
        Of the harmonic regression.
    n_harmonics : int
        At most; fewer where a lap has few frames.
    ridge : float
    timing : str, optional
        One of `timing.TIMINGS`; chosen from the clip by default.
    prime : int
        Of the cohomology's coefficients.
    topology : bool
        Whether the loop is found by cohomology too, and not by autocorrelation alone.

    Raises
    ------
    CycleError
        If one of them is out of range.
    """

    model: Model = "m1"
    n_harmonics: int = 30
    ridge: float = 0.0
    timing: TimingName | None = None
    prime: int = 47
    topology: bool = True

    def __post_init__(self) -> None:
        HarmonicRegression(self.n_harmonics, model=self.model, ridge=self.ridge)
        expect_odd_prime(self.prime)
        if self.timing is not None:
            expect_timing(self.timing)


@dataclass(frozen=True)
class Topology:
    """What cohomology found.

    Attributes
    ----------
    coordinates : (F,)
        In laps, in [0, 1), for every frame but the last few of the embedding.
    period_frames : float
    persistence_ratio : float
        Of the longest bar to the next.
    backtracking : float
        Share of the steps that go backwards.
    bars : (B, 2)
        Births and deaths, longest first.
    """

    coordinates: FloatArray
    period_frames: float
    persistence_ratio: float
    backtracking: float
    bars: FloatArray


@dataclass(frozen=True)
class Extraction:
    """A cycle, where it comes from, and how sure it is.

    Attributes
    ----------
    cycle : Cycle
    clip : Clip
        What was looked at: the range that repeats, flips bridged, its heading straightened.
    frames : (int, int)
        That range in the original clip, end-exclusive.
    timing : Timing
        Phase of every frame of `clip`.
    curve : HarmonicRegression
        Of the joints' rotations by phase, written as `values`.
    values : PoseValues
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
    """

    cycle: Cycle
    clip: Clip
    frames: tuple[int, int]
    timing: Timing
    curve: HarmonicRegression
    values: PoseValues
    guess: PeriodGuess
    topology: Topology | None
    template_error_rad: float
    rmse_rad: float
    evidence: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def period_frames(self) -> float:
        """Mean frames of a lap."""
        return self.timing.period_frames

    @property
    def laps(self) -> float:
        """How many laps the range has."""
        return len(self.clip) / self.timing.period_frames

    @property
    def confidence(self) -> float:
        """From 0 to 1: as much as the weakest evidence."""
        return min(self.evidence.values())

    @property
    def method(self) -> str:
        """How the period was found and time was told."""
        source = "autocorrelation" if self.topology is None else "cohomology"
        return f"{source}, {self.timing.name} time"


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
    bridged, n_flips = without_flips(clip)
    warnings = [f"bridged {n_flips} flips of single joints"] if n_flips else []
    first, last = _live_range(bridged)
    if last - first < len(clip):
        warnings.append(f"frames {first}:{last} are live, those around them are one frame held")
    part, (start, stop), guess = _repeating_part(bridged[first:last])
    start, stop = first + start, first + stop
    if stop - start < last - first:
        warnings.append(f"frames {start}:{stop} repeat, the others were left out")
    straight = straightened(part, guess.frames)
    positions = aligned_positions(straight.clip).reshape(len(part), -1)
    topology = _topology(positions, guess, clip.fps, settings) if settings.topology else None
    numbers = choose_values(straight.clip)
    values = numbers.encode(straight.clip)
    timing = _timing(values, guess, topology, settings)
    laps = len(part) / timing.period_frames
    if laps < LEAST_LAPS:
        raise NoPeriodError(
            f"Expected {LEAST_LAPS} laps at least, but {clip.name or 'the clip'!r} has {laps:.2f} "
            f"of {timing.period_frames:.0f} frames. Take a longer range."
        )
    curve = _curve(values, timing, settings)
    fitted = slice(EDGE, len(values) - EDGE)
    missing = values[fitted] - curve.predict(timing.phase[fitted])
    n_frames = max(2, round(timing.period_frames))
    lap = curve.predict(np.arange(n_frames) / n_frames)
    evidence = _evidence(guess, topology, timing, laps)
    warnings += _warnings(guess, topology, laps, evidence)
    return Extraction(
        cycle=_closed(clip, straight, numbers, curve, timing, settings),
        clip=straight.clip,
        frames=(start, stop),
        timing=timing,
        curve=curve,
        values=numbers,
        guess=guess,
        topology=topology,
        template_error_rad=match_template(values[fitted], lap).error,
        rmse_rad=float(np.sqrt((missing**2).sum(axis=1).mean())),
        evidence=evidence,
        warnings=tuple(warnings),
    )


def extract_cycles(clip: Clip, settings: Settings | None = None) -> list[Extraction]:
    """Return the cycle of every range of a clip in which something repeats, in order.

    Parameters
    ----------
    clip : Clip
        Of several motions, say; see `regions.periodic_ranges`.
    settings : Settings, optional

    Raises
    ------
    NoPeriodError
        If nothing repeats anywhere.
    """
    bridged, _ = without_flips(clip)
    positions = principal_axes(aligned_positions(bridged).reshape(len(clip), -1), N_AXES)
    found = []
    for start, stop, *_ in periodic_ranges(positions, clip.fps):
        try:
            part = extract_cycle(clip[start:stop], settings)
        except NoPeriodError:
            continue  # too short or too unclear to stand alone: the others still do
        first, last = part.frames
        found.append(replace(part, frames=(start + first, start + last)))
    if not found:
        raise NoPeriodError(
            f"Expected a motion that repeats, but found none in {clip.name or 'the clip'!r}. "
            "Take a longer clip."
        )
    return found


def find_coordinates(
    positions: FloatArray, period_frames: float, fps: float, prime: int = 47
) -> Topology:
    """Return circular coordinates of a motion whose period is roughly known.

    Parameters
    ----------
    positions : (F, D)
        Joint positions seen from the root.
    period_frames : float
        The delays of the embedding are an eighth of it.
    fps : float, frames per second
        The loop is looked for at 30 Hz or less, with 320 points at most.
    prime : int

    Raises
    ------
    NoPeriodError
        If there is no loop.
    """
    lag = max(1, round(period_frames * LAG_OF_PERIOD))
    cloud = delay_embedding(principal_axes(positions, 2 * N_AXES), DELAYS, lag)
    stride = max(1, round(fps / COORDINATE_HZ))
    found = CircularCoordinates(prime=prime, stride=stride)
    if len(cloud) / stride > MOST_POINTS:
        rng = np.random.default_rng(0)  # an even stride could meet the same few phases
        chosen = np.sort(rng.choice(len(cloud), MOST_POINTS, replace=False))
        found = CircularCoordinates(prime=prime).fit(cloud[chosen])
        coordinates = found.transform(cloud)
    else:
        coordinates = found.fit_transform(cloud)
    coordinates = forwards(coordinates)
    laps = unwrapped(coordinates)
    slope, _ = fit_laps(laps)
    lengths = found.persistence_[:, 1] - found.persistence_[:, 0]
    ratio = lengths[0] / lengths[1] if len(lengths) > 1 else np.inf
    coarse = np.diff(laps[::stride])
    return Topology(
        coordinates=coordinates,
        period_frames=1.0 / max(slope, 1e-9),
        persistence_ratio=float(ratio),
        backtracking=float((coarse < 0).mean()) if len(coarse) else 1.0,
        bars=found.persistence_,
    )


def _live_range(clip: Clip) -> tuple[int, int]:
    """Return the frames without the first and last ones that a capture held, if it held any."""
    changes = np.flatnonzero(np.any(np.diff(clip.channels, axis=0) != 0, axis=1))
    if len(changes) == 0:
        return 0, len(clip)
    return int(changes[0]), int(changes[-1]) + 2


def _repeating_part(clip: Clip) -> tuple[Clip, tuple[int, int], PeriodGuess]:
    """Return the clip, or the longest range of it in which the motion repeats."""
    positions = principal_axes(aligned_positions(clip).reshape(len(clip), -1), N_AXES)
    try:
        guess = guess_period(positions)
    except NoPeriodError as problem:
        guess, failure = None, problem
    laps = 0.0 if guess is None else len(clip) / guess.frames
    if guess is not None and guess.clarity > GUARD_IS_CLEAR and laps > CLEARLY_REPEATED:
        return clip, (0, len(clip)), guess
    ranges = periodic_ranges(positions, clip.fps)
    longest = max(ranges, key=lambda found: found.stop - found.start, default=None)
    if longest is None or (
        guess is not None
        and guess.clarity > GUARD_IS_CLEAR
        and longest.period_frames > MUCH_SHORTER * guess.frames
    ):
        if guess is None:
            raise NoPeriodError(f"{clip.name or 'the clip'}: {failure}") from None
        return clip, (0, len(clip)), guess
    start, stop = longest.start, longest.stop
    own = guess_period(positions[start:stop])
    return (clip if stop - start == len(clip) else clip[start:stop]), (start, stop), own


def _topology(
    positions: FloatArray, guess: PeriodGuess, fps: float, settings: Settings
) -> Topology | None:
    try:
        return find_coordinates(positions, guess.frames, fps, settings.prime)
    except NoPeriodError:
        return None  # the guard's period stands alone, and the evidence says so


def _timing(
    values: FloatArray, guess: PeriodGuess, topology: Topology | None, settings: Settings
) -> Timing:
    coordinates = None
    if topology is not None and abs(topology.period_frames / guess.frames - 1.0) < AGREEMENT:
        coordinates = _for_every_frame(topology.coordinates, len(values))
    return time_phases(principal_axes(values, N_AXES), guess.frames, coordinates, settings.timing)


def _for_every_frame(coordinates: FloatArray, n_frames: int) -> FloatArray:
    """Go on at the mean speed for the frames that the delay embedding lost."""
    laps = unwrapped(coordinates)
    slope, _ = fit_laps(laps)
    more = laps[-1] + slope * np.arange(1, n_frames - len(laps) + 1)
    return np.concatenate([laps, more]) % 1.0


def _curve(
    values: FloatArray, timing: Timing, settings: Settings, linear: bool = False
) -> HarmonicRegression:
    """Fit the harmonics to the frames that have derivatives."""
    velocities, accelerations = finite_differences(values, 1.0 / timing.period_frames)
    if timing.name == "drift":  # the derivatives are by phase, and a lap's tempo is its own
        pace = (np.gradient(timing.phase) * timing.period_frames)[:, None]
        velocities, accelerations = velocities / pace, accelerations / pace**2
    fitted = slice(EDGE, len(values) - EDGE)
    n_fitted = len(values) - 2 * EDGE
    most = max(1, min(int(timing.period_frames) // 2 - 1, (n_fitted - 2) // 2))
    regression = HarmonicRegression(
        min(settings.n_harmonics, most),
        model=settings.model,
        linear=linear,
        ridge=settings.ridge,
    )
    return regression.fit(
        timing.phase[fitted], values[fitted], velocities[fitted], accelerations[fitted]
    )


def _closed(
    original: Clip,
    straight: Straightened,
    numbers: PoseValues,
    curve: HarmonicRegression,
    timing: Timing,
    settings: Settings,
) -> Cycle:
    """Return the curve as a cycle: rotations from angles, the root's way from its translation."""
    clip, skeleton = straight.clip, straight.clip.skeleton
    phase = np.arange(N_SAMPLES) / N_SAMPLES
    rotations = numbers.decode(curve.predict(phase))
    back = elementary(skeleton.up_axis, np.array(-straight.heading_rad))
    rotations[:, 0] = back @ rotations[:, 0]
    sway, advance = _root_way(clip, back, timing, settings)
    return Cycle(
        skeleton=skeleton,
        columns=to_columns(rotations),
        sway=sway,
        advance=advance,
        turn_rad=straight.turn_rad,
        shifts=shift_values(clip),
        period_s=timing.period_frames / clip.fps,
        name=original.name,
        label=original.label,
        provenance=(*clip.provenance, f"cycle of {timing.period_frames:.2f} frames"),
    )


def _root_way(
    clip: Clip, back: FloatArray, timing: Timing, settings: Settings
) -> tuple[FloatArray, FloatArray]:
    """Return the root's sway (S, 3) and its advance a lap (3,), seen from its mean heading.

    A translation model with a linear term (Raunio 2014, eq. 3.27).
    """
    skeleton = clip.skeleton
    path = forward_kinematics(skeleton, clip.channels).positions[:, 0] @ back.T
    curve = _curve(path, timing, settings, linear=True)
    advance = curve.coefficients_[-1].copy()
    phase = np.arange(N_SAMPLES) / N_SAMPLES
    sway = curve.predict(phase) - phase[:, None] * advance
    level = [axis for axis in range(3) if axis != skeleton.up_index]
    sway[:, level] -= sway[:, level].mean(axis=0)
    if np.linalg.norm(advance[level]) < STANDING_ADVANCE * skeleton.height:
        advance[level] = 0.0
    up = skeleton.up_index
    sway[:, up] += path[:, up].mean() - sway[:, up].mean()
    if abs(advance[up]) < LEVEL_ADVANCE * skeleton.height:
        advance[up] = 0.0
    return sway, advance


def _evidence(
    guess: PeriodGuess, topology: Topology | None, timing: Timing, laps: float
) -> dict[str, float]:
    """Return what speaks for the cycle, each from 0 to 1."""
    evidence = {
        "repetition": float(guess.clarity),
        "laps": min(1.0, laps - 1.0),
    }
    if topology is None:
        evidence["topology"] = 0.3
        return evidence
    apart = abs(topology.period_frames / timing.period_frames - 1.0)
    agreement = 1.0 - (apart - AGREEMENT) / (DISAGREEMENT - AGREEMENT)
    evidence["agreement"] = min(1.0, max(0.0, agreement))
    # half at worst: where left and right alternate a second loop is often as persistent
    evidence["persistence"] = 1.0 - 0.5 / topology.persistence_ratio
    evidence["forwards"] = max(0.0, 1.0 - 2.0 * topology.backtracking)
    return evidence


def _warnings(
    guess: PeriodGuess, topology: Topology | None, laps: float, evidence: dict[str, float]
) -> list[str]:
    warnings = []
    if topology is None:
        warnings.append("cohomology found no loop: the period is the autocorrelation's alone")
    elif abs(topology.period_frames / guess.frames - 1.0) >= AGREEMENT:
        warnings.append(
            f"the periods disagree: {guess.frames:.1f} frames by autocorrelation, "
            f"{topology.period_frames:.1f} by cohomology; the first was taken"
        )
    if min(evidence.values()) < DOUBTFUL:
        weakest = min(evidence, key=lambda name: evidence[name])
        warnings.append(f"doubtful: the evidence of {weakest} is {evidence[weakest]:.2f}")
    if laps < FEW_LAPS:
        warnings.append(f"only {laps:.2f} laps: the cycle is hardly an average")
    return warnings
