"""From a cycle to a clip that loops: whole laps, root motion, feet that stay where they rest."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.cycles.cycle import Cycle, RootMotion, translation_channels
from mocapdb.cycles.synthesis.lowpass import lowpass
from mocapdb.cycles.tuning import (
    CALM_TIMES,
    DAMPED_HARMONICS,
    HOLDS,
    JERK_LEAST_FRAMES,
    JERK_LOWPASS_HZ,
    LEAST_LAP_FRAMES,
    MOST_LOOP_FRAMES,
    POP_TIMES,
    SEVERE_TIMES,
)
from mocapdb.errors import CycleError
from mocapdb.motion.clip import Clip
from mocapdb.motion.foot_contacts import find_contacts, find_legs, foot_slide_mm
from mocapdb.motion.ik import planted
from mocapdb.motion.kinematics import Pose, channels_from_pose, forward_kinematics
from mocapdb.motion.rotations import elementary
from mocapdb.motion.skeleton import Skeleton

__all__ = [
    "Held",
    "Loop",
    "calmed",
    "calmest_phase",
    "damp_harmonics",
    "hold",
    "jerk",
    "jerk_by_frame",
    "loop_steps",
    "make_loop",
    "root_relative_positions",
    "seam_steps",
    "turn_of_lap",
]


class Loop(NamedTuple):
    """A clip that loops, and how well its feet stay.

    Attributes
    ----------
    clip : Clip
    lap_frames : int
        Frames of a lap.
    tempo_error : float
        How much slower than the cycle a lap of so many whole frames plays; negative is faster.
    path : (F, 3), skeleton units
        The steady advance of the root, without its sway, in each frame: where a bone that carries
        an in-place loop has to be.
    heading_rad : (F,) radians
        The steady turn.
    held_share : float
        Of the way to where they rest that feet are pulled: less than one where a knee or an ankle
        would pop, zero where they are not held for that.
    slide_before_mm, slide_after_mm : float
        How far resting feet wander, level, before and after they were held in place.
    pops : dict of str to float
        Joints whose peak acceleration is well over that without holding feet, and how many times.
    """

    clip: Clip
    slide_before_mm: float
    slide_after_mm: float
    pops: dict[str, float]
    lap_frames: int
    tempo_error: float
    path: FloatArray
    heading_rad: FloatArray
    held_share: float = 1.0


def make_loop(
    cycle: Cycle,
    fps: float = 120.0,
    *,
    n_laps: int = 1,
    root: RootMotion = "advance",
    hold_feet: bool = True,
    most_jerk: float | None = None,
    lap_frames: int | None = None,
    closed: bool = False,
) -> Loop:
    """Return whole laps of a cycle as a clip: the frame after the last is the first, further on.

    Parameters
    ----------
    cycle : Cycle
    fps : float, frames per second
        The period is met by the nearest whole number of frames.
    n_laps : int
    root : {"advance", "in-place"}
        Whether the root travels.
    hold_feet : bool
        Whether feet are kept where they rest (see `motion.ik.planted`).
    most_jerk : float, optional
        Fine harmonics are damped until the loop's `jerk` is no more than this.
    lap_frames : int, optional
        So many frames a lap, whatever tempo that makes at `fps`.
    closed : bool
        Whether a frame is added that closes the loop: the first again, further on.

    Raises
    ------
    CycleError
        If the rate is not positive, there is no lap, a lap has fewer than two frames, or fewer
        than ten where that was asked for, or all laps have over a million.
    """
    if not (math.isfinite(fps) and fps > 0) or n_laps < 1:
        raise CycleError(
            f"Expected a positive frame rate and a lap at least, but got {fps} and {n_laps}."
        )
    if root not in ("advance", "in-place"):
        raise CycleError(f"Expected root motion 'advance' or 'in-place', but got {root!r}.")
    if lap_frames is not None and lap_frames < LEAST_LAP_FRAMES:
        raise CycleError(
            f"Expected a length of {LEAST_LAP_FRAMES} frames or more, but got {lap_frames}: fewer "
            "do not show a motion. Use a higher frame rate to play a loop faster."
        )
    n_frames = round(cycle.period_s * fps) if lap_frames is None else lap_frames
    if n_frames < 2:
        raise CycleError(
            f"Expected two frames a lap at least, but {cycle.period_s:.3f} s at {fps:g} Hz gives "
            f"{n_frames}. Use a higher frame rate."
        )
    if n_laps * n_frames > MOST_LOOP_FRAMES:
        raise CycleError(
            f"Expected {MOST_LOOP_FRAMES:,} frames at most, but {n_laps:,} laps of {n_frames} "
            f"frames are {n_laps * n_frames:,}."
        )
    plan = _Plan(fps, n_frames, root, hold_feet)
    # feet rest and bodies jerk at the tempo of the motion, whatever a lap is stretched to
    rate = fps if lap_frames is None else n_frames / cycle.period_s
    played, lap = cycle, _lap(cycle, plan, rate)
    turn = turn_of_lap(cycle, root)
    for cutoff in DAMPED_HARMONICS:
        if (
            most_jerk is None
            or jerk(root_relative_positions(lap.clip), rate, closed=True, turn=turn) <= most_jerk
        ):
            break
        played = damp_harmonics(cycle, cutoff)
        lap = _lap(played, plan, rate)
    return _repeated(played, lap, n_laps, root, closed)


class _Plan(NamedTuple):
    """What is made of a cycle."""

    fps: float
    n_frames: int
    root: RootMotion
    hold_feet: bool


def _lap(cycle: Cycle, plan: _Plan, rate: float) -> Loop:
    """Return one lap as a loop."""
    skeleton, n_frames = cycle.skeleton, plan.n_frames
    # a lap before and one after, so that rests that cross the seam are whole
    phase = np.arange(-n_frames, 2 * n_frames) / n_frames
    first, stop = n_frames, 2 * n_frames
    wanted, beyond = slice(first, stop), slice(first - 1, stop + 1)
    pose = cycle.pose(phase)
    # every lap has the contacts of the middle one: a body that climbs may rest lower in the first
    contacts = np.tile(find_contacts(skeleton, pose.positions, rate)[wanted], (3, 1))
    before = foot_slide_mm(skeleton, pose.positions[wanted], contacts[wanted])
    held = Held(pose, before, {}, 1.0)
    if plan.hold_feet and contacts.any():
        held = hold(cycle, pose, contacts, rate, wanted, beyond)
    pose = held.pose
    if plan.root == "in-place":
        pose = _in_place(cycle, pose, phase)
    channels = _channels(cycle, Pose(pose.positions[wanted], pose.rotations[wanted]))
    clip = Clip(
        skeleton,
        channels,
        plan.fps,
        name=cycle.name,
        label=cycle.label,
        provenance=cycle.provenance,
    )
    path, heading = cycle.steady_path(phase[wanted])
    tempo_error = n_frames / (cycle.period_s * plan.fps) - 1.0
    return Loop(
        clip,
        before,
        held.slide_mm,
        held.pops,
        n_frames,
        tempo_error,
        path,
        heading,
        held.share,
    )


class Held(NamedTuple):
    """A motion whose feet stay where they rest.

    Attributes
    ----------
    pose : Pose
    slide_mm : float
        How far resting feet still wander.
    pops : dict of str to float
        See `Loop`.
    share : float
        Of the way that feet are pulled; see `Loop`.
    """

    pose: Pose
    slide_mm: float
    pops: dict[str, float]
    share: float


def hold(
    cycle: Cycle,
    loose: Pose,
    contacts: BoolArray,
    rate: float,
    wanted: slice,
    beyond: slice,
) -> Held:
    """Return a motion with its feet held as far as no knee or ankle pops (see `HOLDS`).

    Parameters
    ----------
    cycle : Cycle
        Whose body it is.
    loose : Pose
    contacts : (F, L)
        When each foot rests.
    rate : float, frames per second
    wanted, beyond : slice
        Frames in which feet are seen to slide, and joints to pop.
    """
    skeleton = cycle.skeleton
    before = foot_slide_mm(skeleton, loose.positions[wanted], contacts[wanted])
    best, calmest = Held(loose, before, {}, 1.0), math.inf
    for n_passes, soft_reach, share in HOLDS:
        if share < 1.0 and calmest <= POP_TIMES:
            break  # what is left is not seen: no foot needs to slide for it
        reached = loose
        for _ in range(n_passes):  # what is smoothed away or out of reach is pulled anew
            reached = _reached(
                cycle,
                planted(skeleton, reached, contacts, rate, soft_reach=soft_reach, share=share),
            )
        slide = foot_slide_mm(skeleton, reached.positions[wanted], contacts[wanted])
        found = _pops(skeleton, loose.positions[beyond], reached.positions[beyond], CALM_TIMES)
        worst = max(found.values(), default=0.0)
        if slide < before and worst < calmest:
            best, calmest = Held(reached, slide, found, share), worst
        if worst == 0.0:
            break
    if SEVERE_TIMES < calmest < math.inf:
        return Held(loose, before, {}, 0.0)
    pops = {joint: times for joint, times in best.pops.items() if times > POP_TIMES}
    return best._replace(pops=pops)


def _repeated(cycle: Cycle, lap: Loop, n_laps: int, root: RootMotion, closed: bool) -> Loop:
    """Return so many laps, each carried on by the root's way; `closed` adds the first frame again.

    All laps are the same but for that, so that none but the first is worked out.
    """
    skeleton, n_frames = cycle.skeleton, lap.lap_frames
    frames = np.arange(n_laps * n_frames + closed)
    laps, within = np.divmod(frames, n_frames)
    channels = lap.clip.channels[within]
    if root == "advance" and len(frames) > n_frames:
        way, turn = cycle.steady_path(laps.astype(np.float64))
        if cycle.turn_rad == 0.0:
            names = skeleton.channel_names[: int(skeleton.channel_starts[:2][-1])]
            for column, name in enumerate(names):
                if name[-2:] in ("tx", "ty", "tz"):
                    channels[:, column] += way[:, "xyz".index(name[-1])]
        else:
            pose = forward_kinematics(skeleton, lap.clip.channels)
            turned = elementary(skeleton.up_axis, turn)
            positions = np.einsum("fij,fkj->fki", turned, pose.positions[within]) + way[:, None]
            channels = _channels(cycle, Pose(positions, turned[:, None] @ pose.rotations[within]))
    path, heading = cycle.steady_path(frames / n_frames)
    provenance = (*cycle.provenance, f"{n_laps} lap(s), {root}")
    clip = Clip(
        skeleton,
        channels,
        lap.clip.fps,
        name=cycle.name,
        label=cycle.label,
        provenance=provenance,
    )
    return lap._replace(clip=clip, path=path, heading_rad=heading)


def calmed(cycle: Cycle, fps: float, most_jerk: float) -> Cycle:
    """Return a cycle damped as its loops are: until it jerks no more than `most_jerk`.

    See `make_loop`; feet are not held.
    """
    turn = turn_of_lap(cycle, "advance")
    calm = cycle
    for cutoff in DAMPED_HARMONICS:
        lap = make_loop(calm, fps, hold_feet=False).clip
        if jerk(root_relative_positions(lap), fps, closed=True, turn=turn) <= most_jerk:
            break
        calm = damp_harmonics(cycle, cutoff)
    return calm


def damp_harmonics(cycle: Cycle, cutoff: float) -> Cycle:
    """Return the cycle with its harmonics damped by ``exp(-(k / cutoff)^2 / 2)``."""

    def damped(samples: FloatArray) -> FloatArray:
        spectrum = np.fft.rfft(samples, axis=0)
        damping = np.exp(-0.5 * (np.arange(len(spectrum)) / cutoff) ** 2)
        spectrum *= damping.reshape(-1, *[1] * (samples.ndim - 1))
        return np.fft.irfft(spectrum, len(samples), axis=0)

    return replace(cycle, columns=damped(cycle.columns), sway=damped(cycle.sway))


def root_relative_positions(clip: Clip) -> FloatArray:
    """Return joint positions (F, J, 3) relative to the root's, in skeleton units."""
    positions = forward_kinematics(clip.skeleton, clip.channels).positions
    return positions - positions[:, :1]


def calmest_phase(cycle: Cycle) -> float:
    """Return the phase at which the body moves least: the best place for a seam."""
    samples = len(cycle.sway)
    positions = cycle.pose(np.arange(samples + 1) / samples, "in-place").positions
    return float(np.argmin(_steps(positions))) / samples


def seam_steps(clip: Clip) -> float:
    """Return the step from a loop's last frame to its first, in median steps.

    Of all joints seen from the root, so that its advance does not count: 1 is a step like others.
    """
    steps = loop_steps(clip)
    return float(steps[-1] / max(float(np.median(steps)), 1e-300))


def loop_steps(clip: Clip) -> FloatArray:
    """Return (F,) how far the joints move from each frame to the next, and from the last on."""
    pose = forward_kinematics(clip.skeleton, clip.channels)
    around = pose.positions - pose.positions[:, :1]
    local = np.einsum("fji,fkj->fki", pose.rotations[:, 0], around)
    return _steps(np.concatenate([local, local[:1]]))


def jerk(positions: FloatArray, fps: float, closed: bool, turn: FloatArray | None = None) -> float:
    """Return the root mean square jerk of joints, after a low-pass at 12 Hz.

    Parameters
    ----------
    positions : (F, J, 3)
    fps : float, frames per second
    closed : bool
        Whether the first frame follows the last.
    turn : (3, 3), optional
        Of a closed motion, how the next lap is turned against this one (see `turn_of_lap`).

    Returns
    -------
    float
        In units of the positions a second cubed.
    """
    if len(positions) < JERK_LEAST_FRAMES:
        return 0.0
    third, edge = _third_derivatives(positions, fps, closed, turn)
    inner = third[edge:-edge]
    inner = inner if len(inner) else third
    return float(np.sqrt((inner**2).sum(axis=-1).mean()))


def jerk_by_frame(
    positions: FloatArray, fps: float, closed: bool, turn: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return when joints jerk and by how much: what `jerk` is the root mean square of.

    Parameters
    ----------
    positions : (F, J, 3)
    fps : float, frames per second
    closed : bool
        Whether the first frame follows the last.
    turn : (3, 3), optional
        Of a closed motion, how the next lap is turned against this one (see `turn_of_lap`).

    Returns
    -------
    frames : (N,)
        In the middle of the four frames that a third difference is of.
    values : (N,)
        Root mean square over the joints, in units of the positions a second cubed. None of a
        motion too short for the low-pass.
    """
    if len(positions) < JERK_LEAST_FRAMES:
        return np.empty(0), np.empty(0)
    third, edge = _third_derivatives(positions, fps, closed, turn)
    values = np.sqrt((third**2).sum(axis=-1).mean(axis=-1))
    frames = np.arange(len(values)) + 1.5 - (edge if closed else 0)
    inner = (frames >= 0) & (frames < len(positions)) if closed else slice(edge, -edge)
    return np.asarray(frames[inner], dtype=np.float64), np.asarray(values[inner])


def turn_of_lap(cycle: Cycle, root: RootMotion) -> FloatArray | None:
    """Return the rotation (3, 3) from a lap of a loop to the next; None of one in place."""
    if root == "in-place":
        return None
    return np.asarray(elementary(cycle.skeleton.up_axis, np.array([cycle.turn_rad]))[0])


def _third_derivatives(
    positions: FloatArray, fps: float, closed: bool, turn: FloatArray | None
) -> tuple[FloatArray, int]:
    """Return third derivatives after the low-pass, and how many at either end are its edge's."""
    if closed:
        edge = min(len(positions) - 1, round(fps))
        turn = np.eye(3) if turn is None else turn
        before, after = positions[-edge:] @ turn, positions[:edge] @ turn.T
        positions = np.concatenate([before, positions, after])
    padding = min(15, len(positions) - 1)  # thrice the filter's taps
    smooth = lowpass(positions, min(JERK_LOWPASS_HZ / (fps / 2), 0.9), padding)
    return np.diff(smooth, n=3, axis=0) * fps**3, edge if closed else padding


def _steps(positions: FloatArray) -> FloatArray:
    """Return (F - 1,) how far all joints together move from frame to frame."""
    return np.asarray(np.linalg.norm(np.diff(positions, axis=0), axis=(1, 2)))


def _channels(cycle: Cycle, pose: Pose) -> FloatArray:
    channels = channels_from_pose(cycle.skeleton, pose)
    channels[:, translation_channels(cycle.skeleton)] = cycle.translations
    return channels


def _reached(cycle: Cycle, pose: Pose) -> Pose:
    """Return the pose that the skeleton's degrees of freedom can reach."""
    return forward_kinematics(cycle.skeleton, _channels(cycle, pose))


def _pops(
    skeleton: Skeleton, loose: FloatArray, held: FloatArray, least: float = POP_TIMES
) -> dict[str, float]:
    """Return the knees and ankles that pop when feet are held, and how many times worse it is."""
    joints = [joint for leg in find_legs(skeleton, loose) for joint in (leg.knee, leg.ankle)]
    peaks = [
        np.linalg.norm(np.diff(positions[:, joints], n=2, axis=0), axis=2).max(axis=0, initial=0.0)
        for positions in (loose, held)
    ]
    times = peaks[1] / np.maximum(peaks[0], 1e-300)
    return {
        skeleton.names[joint]: float(more)
        for joint, more in zip(joints, times, strict=True)
        if more > least
    }


def _in_place(cycle: Cycle, pose: Pose, phase: FloatArray) -> Pose:
    """Return the pose with the steady advance and turn taken out, and the sway left."""
    still = cycle.pose(phase, "in-place").positions[:, 0]
    path, heading = cycle.root_path(phase)
    back = elementary(cycle.skeleton.up_axis, -heading)
    around = np.einsum("fij,fkj->fki", back, pose.positions - path[:, None])
    return Pose(around + still[:, None], back[:, None] @ pose.rotations)
