"""The figures of the whole method on a few synthetic clips: a tuned number that changes shows."""

import numpy as np
import pytest
from repeating import circling, noise, wave

from mocapdb.corpus import synthetic
from mocapdb.cycles import (
    Settings,
    average_cycles,
    cycle_of_loop,
    excitation_regions,
    extract_cycle,
    make_loop,
    periodic_ranges,
    typical_trajectory,
)
from mocapdb.cycles.extract import extract_cycles
from mocapdb.cycles.period.autocorrelation import guess_period, refined_period
from mocapdb.cycles.period.periodic_ranges import repeating_ranges
from mocapdb.cycles.phase.circular_coordinates import find_coordinates
from mocapdb.cycles.phase.excitation import find_loops
from mocapdb.cycles.phase.laps import gaussian_mixture, whole_laps
from mocapdb.cycles.phase.stop_and_go import find_rests, time_stop_and_go
from mocapdb.cycles.phase.timing import time_phases
from mocapdb.cycles.synthesis.loop import jerk, root_relative_positions

NOISE = {"sensor_noise_deg": 0.15}


def _of(ranges):
    """Four numbers of each range."""
    return [
        number
        for part in ranges
        for number in (part.start, part.end, part.period_frames, part.path_length)
    ]


def periods():
    """The period of plain curves: short, noisy, with laps that differ in pairs."""
    for laps, size in ((1.3, 0.02), (2.6, 0.2), (9.0, 0.1)):
        cloud = wave(np.arange(round(laps * 50)) / 50)
        cloud += np.random.default_rng(1).normal(0, size, cloud.shape)
        yield from guess_period(cloud)
        yield from refined_period(cloud, 45.0)


def ranges():
    """Where plain curves repeat: rest, two periods, a tempo and a posture that drift."""
    tempo = np.interp(np.arange(400), [0, 400], [1 / 54, 1 / 66])
    drifting = wave(np.cumsum(tempo))
    drifting += np.linspace(0, 1.2, 400)[:, None] * np.array([0.0, 0.0, 1.0])
    drifting = np.hstack([drifting, np.zeros((400, 1))])
    rest = np.zeros((120, 4))
    clip = np.vstack(
        [rest, circling(150, 60.0), rest, drifting, 0.3 * rest, circling(130, 31, 0.2)]
    )
    clip += noise(len(clip))
    yield from _of(periodic_ranges(clip, 30.0))
    yield from _of(repeating_ranges(clip, 30.0))
    yield from _of(repeating_ranges(circling(150, 60.0) + noise(150), 60.0))


def sequence():
    """Several motions in one clip, as ranges and as cycles."""
    clip = synthetic.make_clip("sequence", seed=1, duration_s=14, **NOISE)
    for found in extract_cycles(clip):
        yield from (*found.frames, found.period_frames, found.guess.clarity, found.confidence)


def coordinates():
    """Circular coordinates with two delays, one and none, and of more points than are taken."""
    for laps in (1.1, 1.2, 1.4, 12.0):
        cloud = wave(np.arange(round(laps * 40)) / 40) + 0.02 * noise(round(laps * 40))[:, :3]
        found = find_coordinates(cloud, 40.0, 30.0)
        yield from (len(found.coordinates), found.period_frames, found.bars[0, 0])
        yield np.cos(2 * np.pi * (found.coordinates - found.coordinates[0])).sum()
    cloud = wave(np.arange(500) / 61.3)
    found = find_coordinates(cloud, 61.0, 30.0)
    yield from (found.period_frames, found.bars[0, 1])


def clocks():
    """Time from coordinates that linger."""
    time = 4.3 * np.arange(300) / 300
    laps = time + 0.12 * np.sin(2 * np.pi * time)
    yield float(whole_laps(laps) @ np.arange(300))
    yield from gaussian_mixture(laps % 1.0)[[20, 100, 250]]
    lap = typical_trajectory(laps % 1.0, wave(laps), 60)
    yield from (lap**2).sum(axis=0)
    two = np.vstack([circling(300, 50.0), circling(300, 60.0, 0.8, (9.0, 0.0, 0.0, 0.0))])
    for region in excitation_regions(two, 30.0, n_classes=2):
        yield from (region.start, region.end, region.laps)


def stops():
    """Laps with rests of many lengths in them; loops of several motions."""
    rng = np.random.default_rng(0)
    rows = wave(np.arange(300) / 60)
    times = np.ones(300, dtype=int)
    times[[70, 130, 205, 245]] += [7, 12, 60, 35]
    clip = np.repeat(rows, times, axis=0) + rng.normal(0, 0.02, (times.sum(), 3))
    yield float(find_rests(clip, 60.0).sum())
    timing, topology = time_stop_and_go(clip, 60.0)
    yield from (timing.period_frames, *timing.phase[[100, 200, 300]], topology.backtracking)
    two = np.vstack([circling(200, 50.0), circling(250, 60.0, 0.8, (2.0, 0.0, 0.0, 0.0))])
    loops = find_loops(two + rng.normal(0, 0.05, two.shape), 30.0)
    yield from (loops.n_loops, *loops.chances[:3])
    for region in loops.regions:
        yield from (region.start, region.end, region.laps)


def times():
    """Steady, slowly drifting and long: the period and the phase in the middle."""
    frames = np.arange(420)
    for drift in (0.0, 0.05, 0.4):
        laps = frames / 80 * (1 + drift * (frames / 420 - 0.5))
        values = wave(laps) + np.random.default_rng(0).normal(0, 0.3, (420, 3))
        timing = time_phases(values, 81.0, laps % 1.0)
        yield from (timing.period_frames, timing.phase[100], timing.phase[300])
    values = wave(np.arange(500) / 60) + np.random.default_rng(0).normal(0, 0.3, (500, 3))
    yield from time_phases(values, 61.0).phase[[0, 250, 499]]


def cycles():
    """Whole extractions: evidence, errors, the curve, the root and the loop."""
    for kind, seed, options in (
        ("walk", 5, {"n_cycles": 2.3, **NOISE}),
        ("run", 2, {"n_cycles": 1.3, "fps": 60.0, **NOISE}),
        ("squat", 0, {"n_cycles": 2.2, "phase_noise": 0.1, "fps": 60.0}),
    ):
        clip = synthetic.make_clip(kind, seed=seed, **options)
        found = extract_cycle(clip)
        yield from (found.period_frames, found.guess.clarity, found.rmse_rad)
        yield from (found.template_error_rad, *found.evidence.values())
        yield from (*found.cycle.advance, *found.cycle.sway.std(axis=0))
        yield from (found.cycle.columns[7].sum(), found.source_jerk, len(found.warnings))
        loop = found.loop(fps=60.0)
        yield from (loop.slide_after_mm, np.abs(loop.clip.channels[3]).sum())
        if kind == "walk":
            again = cycle_of_loop(make_loop(found.cycle, 60.0, hold_feet=False).clip)
            yield from (*again.advance, *again.sway.std(axis=0), again.columns[9].sum())
            calm = make_loop(found.cycle, 60.0, most_jerk=0.5 * found.source_jerk).clip
            yield jerk(root_relative_positions(calm), 60.0, closed=True)


def tempo():
    """Models with velocities and a drifting tempo, and a loop without cohomology."""
    clip = synthetic.make_clip("walk", seed=1, n_cycles=5, tempo_drift=0.6, fps=60.0, **NOISE)
    found = extract_cycle(clip, Settings(model="m1", n_harmonics=8))
    yield from (found.period_frames, found.rmse_rad, found.cycle.columns[3].sum())
    found = extract_cycle(clip, Settings(topology=False, n_harmonics=8))
    yield from (found.confidence, len(found.warnings))


def classes():
    """The mean of walks, one of them mirrored in time and one far off."""
    members = [
        extract_cycle(synthetic.make_clip(kind, seed=seed, n_cycles=2.3, fps=60.0, name=f"{seed}"))
        for kind, seed in (("walk", 0), ("walk", 1), ("walk", 2), ("hop", 3), ("squat", 4))
    ]
    found = average_cycles([one.cycle for one in members], "walk")
    yield from (len(found.members), len(found.mirrored), found.spread_rad.mean())
    yield from (found.cycle.columns[5].sum(), *found.cycle.advance)


EXPECTED = {
    "periods": [
        50.04707,
        0.9979154,
        50.04707,
        0.9979154,
        50.26415,
        0.9169397,
        50.26415,
        0.9169397,
        49.97338,
        0.9745183,
        49.97338,
        0.9745183,
    ],
    "ranges": [
        120,
        272,
        59.97941,
        11.37611,
        390,
        715,
        58.21405,
        35.0725,
        910,
        1040,
        31.06605,
        6.692849,
        390,
        715,
        58.21405,
        35.0725,
        120,
        272,
        59.97941,
        11.37611,
        910,
        1040,
        31.06605,
        6.692849,
        118,
        791,
        59.1745,
        72.72685,
        0,
        150,
        59.99212,
        9.569265,
    ],
    "sequence": [
        0,
        508,
        80.45374,
        0.9977423,
        0.9953259,
        540,
        1024,
        66.7284,
        0.9961765,
        0.8103448,
        1056,
        1680,
        149.5564,
        0.9973853,
        0.6976176,
    ],
    "coordinates": [
        44,
        38.11329,
        0.2012528,
        8.050266,
        43,
        38.21838,
        0.255601,
        6.851974,
        46,
        37.71292,
        0.3248059,
        12.17562,
        470,
        40.00802,
        0.3231121,
        -16.18452,
        61.27881,
        3.120039,
    ],
    "clocks": [
        128355.6,
        0.3341114,
        0.4733617,
        0.61114,
        24.12492,
        35.59476,
        4.953584,
        0,
        295,
        5.754572,
        274,
        599,
        5.384632,
    ],
    "stops": [
        85,
        60.14885,
        2.350067,
        3.811808,
        4.482074,
        0.03658537,
        2,
        1.96063e-18,
        8.568012e-18,
        0.04689588,
        0,
        217,
        3.979178,
        170,
        449,
        4.620172,
    ],
    "times": [
        80.14991,
        1.247662,
        3.742986,
        78.03235,
        1.28152,
        3.844559,
        66.87324,
        1.121756,
        4.076011,
        0,
        4.170961,
        8.334418,
    ],
    "cycles": [
        128.2993,
        0.9994949,
        0.01883731,
        0.02888265,
        0.999999,
        1,
        0.9992225,
        1,
        1,
        1,
        1,
        0.1128826,
        0,
        23.30203,
        0.2505498,
        0.1378051,
        0.3006509,
        57.88724,
        5816.192,
        0,
        1.417634,
        585.3897,
        -0.03485448,
        3.20218e-05,
        23.24679,
        0.3578738,
        0.1378086,
        0.2974417,
        57.6792,
        2897.917,
        43.59101,
        0.9954507,
        0.01444184,
        0.05772019,
        0.9999172,
        0.6152184,
        0.999627,
        1,
        1,
        1,
        1,
        -0.579624,
        0,
        33.29099,
        0.1251846,
        0.3394662,
        0.002181234,
        55.31067,
        10385.4,
        1,
        2.050123,
        835.5467,
        145.024,
        0.9976561,
        0.05719872,
        0.0571099,
        0.999978,
        1,
        0.9966772,
        1,
        1,
        0.9984278,
        1,
        0,
        0,
        0,
        0,
        2.231978,
        1.062846,
        51.50357,
        99.60063,
        0,
        0.004968788,
        459.2561,
    ],
    "tempo": [59.66356, 0.03532943, 58.219, 0.3, 3],
    "classes": [3, 0, 0.01404413, 58.12196, -0.009192278, 0, 23.30466],
}


@pytest.mark.parametrize("name", EXPECTED)
def test_figures(name):
    """A figure that changes on purpose is written here anew, and the change is told."""
    found = np.array([*globals()[name]()], dtype=float)
    np.testing.assert_allclose(found, EXPECTED[name], rtol=1e-4, atol=1e-5)
