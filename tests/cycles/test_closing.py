from dataclasses import replace

import made_bodies as made
import numpy as np
import pytest
from repeating import wave

from mocapdb.corpus import synthetic
from mocapdb.cycles import HarmonicRegression, Settings, cycle_of_loop, extract_cycle, make_loop
from mocapdb.cycles.closing import RootFit, fit_curve
from mocapdb.cycles.cycle import joint_positions
from mocapdb.cycles.phase.timing import Timing
from mocapdb.cycles.synthesis.loop import loop_steps
from mocapdb.errors import CycleError, NoPeriodError
from mocapdb.io import read_clip, write_clip
from mocapdb.motion.clip import Clip


def test_a_loop_read_back_is_a_cycle_again(walk, tmp_path):
    loop = make_loop(walk, hold_feet=False).clip
    for name in ("loop.bvh", "loop.amc", "loop.npz"):
        write_clip(loop, tmp_path / name)
        again = cycle_of_loop(read_clip(tmp_path / name, fps=120.0))
        assert again.period_s == pytest.approx(walk.period_s, abs=0.01)
        size = np.linalg.norm(walk.advance)
        assert np.linalg.norm(again.advance) == pytest.approx(size, rel=0.02)
        if name == "loop.amc":
            np.testing.assert_allclose(joint_positions(again), joint_positions(walk), atol=0.6)


def test_a_loop_below_a_scene_read_back_is_the_cycle_of_its_body(tmp_path):
    plain = made.make_walk(150)
    whole = made.under_scene(plain)
    found = extract_cycle(Clip(whole.skeleton, whole.channels, 30.0, name="made"))
    write_clip(found.loop().clip, tmp_path / "loop.bvh")
    again = cycle_of_loop(read_clip(tmp_path / "loop.bvh"))
    assert set(again.skeleton.names) == set(plain.skeleton.names)
    size = np.linalg.norm(found.cycle.advance)
    assert np.linalg.norm(again.advance) == pytest.approx(size, rel=0.02)


def test_open_ends_are_no_loop(synthetic_walk):
    with pytest.raises(NoPeriodError, match="steps apart"):
        cycle_of_loop(synthetic_walk[:70])
    with pytest.raises(NoPeriodError, match="steps apart"):
        cycle_of_loop(synthetic_walk[:2])
    still = synthetic_walk.replace(channels=np.repeat(synthetic_walk.channels[:1], 300, axis=0))
    with pytest.raises(NoPeriodError, match="one pose in all of its 300 frames"):
        cycle_of_loop(still)


@pytest.mark.parametrize(("away", "closes"), [(0.042, True), (0.06, False)])
def test_a_last_frame_that_is_the_first_again_closes_a_loop(walk, away, closes):
    channels = make_loop(walk, 60.0, root="in-place", closed=True).clip.channels.copy()
    loop = make_loop(walk, 60.0, root="in-place").clip
    steps = loop_steps(loop)
    share = away * np.median(steps) / steps[0]  # of the step from the first frame to the second
    channels[-1] = channels[0] - share * (channels[1] - channels[0])
    found = cycle_of_loop(loop.replace(channels=channels))
    assert round(found.period_s * 60) == len(loop) + (not closes)


@pytest.mark.parametrize(("turn_rad", "turns"), [(0.06, False), (0.09, True)])
def test_a_loop_that_hardly_turns_goes_straight(walk, turn_rad, turns):
    loop = make_loop(replace(walk, turn_rad=turn_rad), hold_feet=False).clip
    assert (cycle_of_loop(loop).turn_rad != 0.0) == turns


def drifting_squat(travel, climb):
    """Squats whose root goes on by a share of the height each lap, forwards and upwards."""
    clip, truth = synthetic.make("squat", seed=0, n_cycles=2.5, fps=60.0)
    channels = clip.channels.copy()
    laps = np.arange(len(clip)) / truth.period_frames
    for name, share in (("root.tz", travel), ("root.ty", climb)):
        channel = clip.skeleton.channel_names.index(name)
        channels[:, channel] += share * clip.skeleton.height * laps
    return clip.replace(channels=channels)


@pytest.mark.parametrize(
    ("travel", "climb", "moves"),
    [
        (0.017, 0.0, False),
        (0.025, 0.0, True),
        (0.0, 0.025, False),
        (0.0, 0.035, True),
    ],
)
def test_small_drifts_of_the_root_are_no_advance(travel, climb, moves):
    assert bool(extract_cycle(drifting_squat(travel, climb)).cycle.advance.any()) == moves


def test_where_time_stands_still_derivatives_are_bounded():
    phase = np.cumsum(np.where(np.arange(300) % 60 < 12, 0.05, 1.2375)) / 60
    timing = Timing("drift", phase, 60.0)
    values = wave(phase) + np.random.default_rng(0).normal(0, 0.05, (300, 3))
    curve = fit_curve(values, timing, HarmonicRegression(4, model="m1"))
    # ten times as slow at most: the velocities there would count for nothing otherwise
    assert curve.weights_[0].sum() == pytest.approx(4.64179e-05, rel=1e-3)


def test_the_root_moves_along_the_axes_that_it_is_told():
    clip = synthetic.make_clip("walk", seed=1, n_cycles=2.5, fps=60.0)
    usual = extract_cycle(clip).cycle
    level = extract_cycle(clip, Settings(root=RootFit(n_harmonics=2, axes="xz", linear="x"))).cycle
    assert np.ptp(level.sway[:, 1]) == 0
    assert level.sway[:, 1].mean() == pytest.approx(usual.sway[:, 1].mean(), rel=1e-3)
    assert level.advance[2] == 0.0 != usual.advance[2]
    spectrum = np.abs(np.fft.rfft(level.sway[:, 2]))
    assert spectrum[3:].max() < 1e-6 < spectrum[1]
    for wrong in ({"axes": "xw"}, {"linear": "q"}, {"n_harmonics": 0}):
        with pytest.raises(CycleError):
            RootFit(**wrong)


def test_the_root_does_not_jump_from_one_lap_to_the_mean_of_two():
    clip = synthetic.make_clip("run", seed=2, n_cycles=1.87)
    height = clip.skeleton.height
    channels = clip.channels.copy()
    channels[:, 0] += 0.05 * height * np.linspace(0, 1, len(clip)) ** 2  # drifts off its line
    bends = {}
    for model in ("harmonic", "m2"):
        sway = extract_cycle(clip.replace(channels=channels), Settings(model=model)).cycle.sway
        bends[model] = np.linalg.norm(np.diff(sway, 2, axis=0), axis=1).max() / height
    assert bends["harmonic"] < 0.0005  # half a millimetre beside what a run bends
    assert bends["m2"] > 0.002  # the regression as it is in Raunio (2014)
