"""Real files: every one of them reads, and conversions of one motion agree."""

from __future__ import annotations

import numpy as np
import pytest

from mocapdb.io import _bvh_motion, amc, read_clip, write_clip
from mocapdb.io.tpose import count_tpose_frames
from mocapdb.motion.kinematics import forward_kinematics


def places_m(clip):
    """(F, J, 3) in metres."""
    positions = forward_kinematics(clip.skeleton, clip.channels).positions
    return positions * clip.skeleton.metres_per_unit


def refuse(*_):
    raise AssertionError("a plain file was left to the careful reader")


def test_every_file_reads(corpus, monkeypatch):
    """All of them in the fast way; a T-pose is in front of every BVH and of no AMC."""
    monkeypatch.setattr(amc, "_read_carefully", refuse)
    monkeypatch.setattr(_bvh_motion, "_read_words", refuse)
    count = 0
    for path in sorted(corpus.rglob("*")):
        if path.suffix not in (".amc", ".bvh"):
            continue
        clip = read_clip(path)
        assert clip.fps == 120
        assert clip.skeleton.up == "y"
        assert clip.skeleton.metres_per_unit == (0.01 if "daz" in str(path) else 0.0254 / 0.45)
        assert count_tpose_frames(clip) == (path.suffix == ".bvh"), path
        count += 1
    assert count >= 1


@pytest.mark.parametrize("name", ["cmu/bvh/02_01.bvh", "cmu/bvh_daz/13_18.bvh"])
def test_every_number_of_a_bvh(corpus, name):
    clip = read_clip(corpus / name)
    rows = (corpus / name).read_text().partition("Frame Time:")[2].split()[1:]
    assert clip.channels.ravel().tolist() == [float(word) for word in rows]


@pytest.mark.parametrize(
    "name", ["cmu/asfamc/02/02_01.amc", "hdm05/cut/HDM_bd_depositFloorR_001_120.amc"]
)
def test_every_number_of_an_amc(corpus, name):
    clip = read_clip(corpus / name)
    lines = (corpus / name).read_text("latin-1").partition(":DEGREES")[2].splitlines()
    columns = {}
    for words in map(str.split, lines):
        if len(words) > 1:
            columns.setdefault(words[0], []).append([float(word) for word in words[1:]])
    expected = [columns[name] for name in clip.skeleton.names if name in columns]
    assert np.array_equal(clip.channels, np.concatenate(expected, axis=1))


def test_amc_and_its_bvh_agree(corpus):
    original = read_clip(corpus / "cmu/asfamc/02/02_01.amc")
    converted = read_clip(corpus / "cmu/bvh/02_01.bvh", drop_tpose=True)
    assert len(original) == len(converted)
    assert np.abs(original.channels[:, :3] - converted.channels[:, :3]).max() < 5.1e-5
    knee = places_m(original)[:, original.skeleton.joint("lfemur")]
    same = places_m(converted)[:, converted.skeleton.joint("LeftLeg")]
    assert np.abs(knee - same).max() < 0.01


@pytest.mark.parametrize(
    "name", ["cmu/asfamc/02/02_01.amc", "hdm05/cut/HDM_bd_depositFloorR_001_120.amc"]
)
def test_amc_to_bvh_to_amc(corpus, tmp_path, name):
    clip = read_clip(corpus / name)
    write_clip(clip, tmp_path / "a.bvh")
    write_clip(read_clip(tmp_path / "a.bvh"), tmp_path / "b.amc")
    again = read_clip(tmp_path / "b.amc")
    assert again.skeleton.names == clip.skeleton.names
    assert np.abs(places_m(again) - places_m(clip)).max() < 1e-8


@pytest.mark.parametrize("name", ["cmu/bvh/02_01.bvh", "cmu/bvh_daz/13_18.bvh"])
def test_bvh_to_amc(corpus, tmp_path, name):
    clip = read_clip(corpus / name)[:200]
    write_clip(clip, tmp_path / "a.amc")
    ends = places_m(read_clip(tmp_path / "a.amc"))
    for joint in places_m(clip).swapaxes(0, 1):
        assert np.abs(ends - joint[:, None]).max(axis=(0, 2)).min() < 1e-12


@pytest.mark.parametrize(
    "name", ["cmu/asfamc/02/02_01.amc", "cmu/bvh/02_01.bvh", "cmu/bvh_daz/13_18.bvh"]
)
def test_same_format_gives_the_same_doubles(corpus, tmp_path, name):
    clip = read_clip(corpus / name)
    path = tmp_path / (corpus / name).name
    write_clip(clip, path)
    again = read_clip(path)
    assert again.skeleton == clip.skeleton
    assert again.channels.tobytes() == clip.channels.tobytes()
    assert (again.fps, again.frame_time_text) == (clip.fps, clip.frame_time_text)
