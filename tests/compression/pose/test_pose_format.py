"""Pose payloads are read without mocapdb, by what docs/format.md says of them and nothing else."""

from __future__ import annotations

import numpy as np
import pytest
from pose_reader import Pose, read_pose

from mocapdb.compression import Payload, Target, decode, encode, fit_basis
from mocapdb.compression.pose.smooth_channels import SmoothChannels
from mocapdb.corpus import synthetic
from mocapdb.motion.clip import Clip
from mocapdb.motion.rotations import elementary, extract_angles


def walk(seconds: float = 0.6) -> Clip:
    return synthetic.make_clip("walk", seed=1, duration_s=seconds)


def glitching() -> Clip:
    """A run whose sensors jitter, with angles that leap for a frame and one that turns over."""
    clip = synthetic.make_clip("run", seed=3, duration_s=0.8, sensor_noise_deg=0.3)
    channels = clip.channels.copy()
    channels[30, 20] += 40.0
    channels[31, 10] -= 70.0
    channels[50:52, 33] += 180.0
    return clip.replace(channels=channels)


def turning() -> Clip:
    """A walk that turns once about the vertical, and bows and leans the while."""
    clip = walk()
    along = np.linspace(0.0, 2 * np.pi, len(clip))
    turns = elementary("Y", along) @ elementary("X", np.sin(along)) @ elementary("Z", along / 4)
    order = clip.skeleton.rotation_orders[0]
    names = clip.skeleton.dofs[0]
    channels = clip.channels.copy()
    columns = [names.index(f"r{axis.lower()}") for axis in order]
    channels[:, columns] = np.rad2deg(extract_angles(order, turns))
    return clip.replace(channels=channels)


def noisy(seconds: float) -> Clip:
    return synthetic.make_clip("run", seed=3, duration_s=seconds, sensor_noise_deg=0.5)


MEAN, FINE, MAXIMUM = Target("mean_mm", 1.0), Target("mean_mm", 0.02), Target("max_mm", 3.0)
CASES = {
    "default": lambda: (walk(), encode(walk(), MEAN)),
    "dwt": lambda: (walk(), encode(walk(), FINE, transform="dwt")),
    "dct32": lambda: (walk(), encode(walk(), FINE, transform="dct32")),
    "dct64": lambda: (walk(), encode(walk(), FINE, transform="dct64")),
    "dct": lambda: (noisy(1.2), encode(noisy(1.2), FINE, transform="dct")),
    "spline": lambda: (noisy(1.2), encode(noisy(1.2), Target("mean_mm", 0.3), transform="spline")),
    "pca": lambda: (walk(), encode(walk(), MEAN, decorrelation="pca")),
    "glitches": lambda: (glitching(), encode(glitching(), MAXIMUM)),
    "turn": lambda: (turning(), encode(turning(), MEAN)),
    "blocks": lambda: (noisy(4.0), encode(noisy(4.0), FINE)),
}


@pytest.fixture(scope="module")
def coded() -> dict[str, tuple[Clip, Payload]]:
    return {name: make() for name, make in CASES.items()}


@pytest.fixture(scope="module")
def read(coded) -> dict[str, Pose]:
    return {
        name: read_pose(payload.data, clip.skeleton.to_dict())
        for name, (clip, payload) in coded.items()
    }


@pytest.mark.parametrize("name", CASES)
def test_the_same_channels(coded, read, name):
    clip, payload = coded[name]
    expected = decode(payload.data, clip.skeleton)
    assert read[name].channels.shape == clip.channels.shape
    assert np.abs(read[name].channels - expected).max() < 1e-9
    assert np.abs(expected - clip.channels).max() > 1e-6, "expected a clip that loses something"


def test_the_cases_need_all_of_the_format(read):
    modes = set().union(*(pose.modes.ravel().tolist() for pose in read.values()))
    assert modes == set(range(15))
    assert read["glitches"].n_spikes > 0
    assert read["turn"].n_reordered > 0
    assert len(read["blocks"].modes) > 2


def test_a_basis_that_is_kept_elsewhere():
    clip = walk()
    basis = fit_basis([SmoothChannels(clip)])
    payload = encode(clip, MEAN, decorrelation="class", basis=basis)
    bases = {basis.digest: basis.to_bytes()}
    expected = decode(payload.data, clip.skeleton, bases=bases)
    found = read_pose(payload.data, clip.skeleton.to_dict(), bases).channels
    assert np.abs(found - expected).max() < 1e-9


@pytest.mark.parametrize("at", [40, -30, -1])
def test_a_reader_can_tell_damage(coded, at):
    clip, payload = coded["default"]
    damaged = bytearray(payload.data)
    damaged[at] ^= 1
    with pytest.raises(AssertionError, match="checksum"):
        read_pose(bytes(damaged), clip.skeleton.to_dict())
