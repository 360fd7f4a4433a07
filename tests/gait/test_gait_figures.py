"""The figures of gait analysis on a few synthetic clips: a tuned number that changes shows."""

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.gait import analyse_gait
from mocapdb.gait.feet import understand_walker
from mocapdb.gait.foot_events import find_foot_contacts, resting_speed


def made(kind, **options):
    return synthetic.make_clip(kind, seed=3, **({"duration_s": 3} | options))


def figures_of(gait):
    """Measures of the strides, a few events and angles."""
    yield from (spread.mean for spread in gait.spreads().values())
    for contacts in gait.contacts:
        yield from (contacts[1].strike, contacts[1].toe_off)
    for key in (("left", "ankle", "flexion"), ("left", "knee", "abduction")):
        yield from gait.mean_curves()[key][0][[10, 60]]


def walk():
    yield from figures_of(analyse_gait(made("walk", sensor_noise_deg=0.15)))


def slow():
    yield from figures_of(analyse_gait(made("walk", speed=0.5, fps=30.0, duration_s=5)))


def run():
    yield from figures_of(analyse_gait(made("run", sensor_noise_deg=0.15)))


def sprint():
    yield from figures_of(analyse_gait(made("run", speed=1.6, fps=60.0)))


def belt():
    """A walk in place, on a belt."""
    clip = made("walk")
    channels = clip.channels.copy()
    channels[:, 2] -= np.linspace(0, channels[-1, 2] - channels[0, 2], len(clip))
    yield from figures_of(analyse_gait(clip.replace(channels=channels)))


def sliding():
    """Walks whose whole body slides a little faster and slower with each step."""
    for amount in (0.03, 0.08, 0.16):
        clip, truth = synthetic.make("walk", seed=3, duration_s=4)
        channels = clip.channels.copy()
        scale = amount / clip.skeleton.metres_per_unit
        channels[:, 2] += scale * np.sin(2 * truth.phase + 0.6)
        walker = understand_walker(clip.replace(channels=channels))
        yield resting_speed(walker)
        for contacts in find_foot_contacts(walker):
            yield from (contacts[1].strike, contacts[1].toe_off)


EXPECTED = {
    "walk": [
        1.098667,
        0.5495833,
        109.224,
        1.314891,
        0.6571669,
        0.09600002,
        1.196813,
        61.08952,
        38.91048,
        22.26182,
        0,
        0.0008292305,
        0.04628339,
        146.12,
        226.76,
        79.6,
        160.08,
        6.859193,
        -14.96491,
        1.379548e-13,
        1.298671e-13,
    ],
    "slow": [
        1.5546,
        0.7768,
        77.19049,
        0.9301238,
        0.4650549,
        0.09605763,
        0.5983059,
        61.50795,
        38.49205,
        23.0156,
        0,
        0.0007290835,
        -0.0004496702,
        51.63,
        80.28,
        28.29,
        57.01,
        5.062284,
        -12.59617,
        8.292207e-14,
        6.689624e-14,
    ],
    "run": [
        0.6484444,
        0.3242778,
        185.0589,
        1.880206,
        0.9402973,
        0.07589409,
        2.899575,
        37.47431,
        62.52569,
        0,
        24.92252,
        -1.281827e-05,
        0.007437254,
        125.88,
        154.96,
        87.12,
        115.76,
        20.26962,
        6.103484,
        1.206457e-13,
        7.393565e-14,
    ],
    "sprint": [
        0.5123333,
        0.2560667,
        234.224,
        2.378297,
        1.189149,
        0.07721873,
        4.642119,
        35.86873,
        64.13127,
        0,
        28.18419,
        -9.693635e-18,
        -0.003602084,
        19.12,
        30.1,
        34.52,
        45.62,
        18.55963,
        -1.005078,
        8.730177e-14,
        5.86283e-14,
    ],
    "belt": [
        1.098,
        0.549,
        109.2896,
        1.315379,
        0.6576897,
        0.09605763,
        1.197977,
        61.12629,
        38.87371,
        22.2374,
        0,
        0.0003407826,
        -0.0001534219,
        145.92,
        226.44,
        80.04,
        160.56,
        4.766881,
        -16.3146,
        1.279807e-13,
        1.210532e-13,
    ],
    "sliding": [
        0.5,
        147.4,
        227.4,
        81.8,
        161.52,
        1.2,
        151.96,
        229,
        86.08,
        163.12,
        0.5,
        222.4,
        227,
        156.64,
        161.52,
    ],
}


@pytest.mark.parametrize("name", EXPECTED)
def test_figures(name):
    """A figure that changes on purpose is written here anew, and the change is told."""
    found = np.array([*globals()[name]()], dtype=float)
    np.testing.assert_allclose(found, EXPECTED[name], rtol=2e-4, atol=1e-4)
