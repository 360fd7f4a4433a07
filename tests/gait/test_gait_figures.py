"""The figures of gait analysis on a few synthetic clips: a tuned number that changes shows."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from mocapdb.corpus import synthetic
from mocapdb.gait import analyse_gait
from mocapdb.gait.feet import understand_walker
from mocapdb.gait.foot_events import air_shares, resting_speed


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
    noise = np.random.default_rng(0).normal(0.0, 0.15, channels.shape)
    yield np.linalg.norm(understand_walker(clip.replace(channels=channels + noise)).belt_m_s)


def smoothed():
    """Captures that were smoothed, whose feet rest for too short."""
    for kind, speed, smoothing_s in (
        ("walk", 1.1, 0.055), ("run", 0.9, 0.016), ("run", 0.9, 0.046), ("run", 1.3, 0.031),
        ("run", 0.65, 0.046), ("run", 0.75, 0.046), ("run", 0.9, 0.03),
    ):  # fmt: skip
        clip = synthetic.make_clip(kind, seed=4, fps=60.0, duration_s=3, speed=speed)
        smooth = gaussian_filter1d(clip.channels, smoothing_s * 60.0, axis=0)
        gait = analyse_gait(clip.replace(channels=smooth))
        yield resting_speed(gait.walker)
        yield from air_shares(gait.walker, gait.contacts)
        for told in ("stance may be too short", "feet slide as they land"):
            yield sum(told in note for note in gait.notes)


EXPECTED = {
    "walk": [
        1.098667,
        0.5495833,
        109.224,
        1.314891,
        0.6571669,
        0.09600002,
        1.196813,
        61.08347,
        38.91653,
        22.24537,
        0,
        0.0008292305,
        0.04628339,
        146.12,
        226.7471,
        79.6,
        160.0706,
        6.859193,
        -14.96491,
        1.379548e-13,
        1.298671e-13,
    ],
    "slow": [
        1.552342,
        0.7765607,
        77.30295,
        0.9301345,
        0.4650657,
        0.09605763,
        0.5991845,
        61.73996,
        38.26004,
        23.49848,
        0,
        0.0008521199,
        -0.0007970026,
        51.57888,
        80.3,
        28.30372,
        56.99,
        4.922035,
        -12.04492,
        8.263929e-14,
        6.706757e-14,
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
        0.5125,
        0.2562333,
        234.1465,
        2.378297,
        1.189149,
        0.07721873,
        4.640583,
        36.15605,
        63.84395,
        0,
        27.67483,
        -2.608959e-17,
        -0.007432057,
        19.06,
        30.12,
        34.44,
        45.62,
        18.48077,
        -1.020528,
        8.745761e-14,
        5.869596e-14,
    ],
    "belt": [
        1.098,
        0.549,
        109.2896,
        1.315251,
        0.6576298,
        0.09605763,
        1.197861,
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
        1.202636,
    ],
    "smoothed": [
        0.5,
        0.007042254,
        0,
        0,
        0,
        0.5,
        0.2792208,
        0.2727273,
        0,
        0,
        2.25,
        0.1686747,
        0.1746988,
        0,
        1,
        3.178884,
        0.2261905,
        0.2202381,
        0,
        1,
        0.7121479,
        0.4723926,
        0.2147239,
        1,
        1,
        1.675289,
        0.1878788,
        0.1818182,
        0,
        1,
        1.915441,
        0.2222222,
        0.254902,
        0,
        1,
    ],
}


@pytest.mark.parametrize("name", EXPECTED)
def test_figures(name):
    """A figure that changes on purpose is written here anew, and the change is told."""
    found = np.array([*globals()[name]()], dtype=float)
    np.testing.assert_allclose(found, EXPECTED[name], rtol=2e-4, atol=1e-4)
