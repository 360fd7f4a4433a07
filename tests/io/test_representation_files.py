"""Clips written in O'Kane's representations: everything that is needed stands inside."""

import csv
import json

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.errors import FormatError, SkeletonError
from mocapdb.io import read_clip, write_representation
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.representations import REPRESENTATIONS, represent


@pytest.fixture(scope="module")
def clip():
    return synthetic.make_clip("walk", seed=3, duration_s=0.5)


@pytest.mark.parametrize("name", REPRESENTATIONS)
def test_an_archive_is_a_clip_again(clip, name, tmp_path):
    path = tmp_path / "x.npz"
    write_representation(clip, name, path)
    again = read_clip(path)
    assert again.skeleton == clip.skeleton
    assert (again.fps, again.name, again.label) == (clip.fps, clip.name, clip.label)
    places = [forward_kinematics(c.skeleton, c.channels).positions for c in (clip, again)]
    np.testing.assert_allclose(places[1], places[0], atol=1e-9)


@pytest.mark.parametrize("name", REPRESENTATIONS)
def test_an_archive_names_columns_and_units(clip, name, tmp_path):
    write_representation(clip, name, tmp_path / "x.npz")
    with np.load(tmp_path / "x.npz", allow_pickle=False) as archive:
        held = {key: archive[key] for key in archive.files}
    shown = represent(clip, name)
    np.testing.assert_array_equal(held["values"], shown.values)
    np.testing.assert_array_equal(held["root"], shown.root)
    assert held["columns"].shape == held["units"].shape == (shown.values.shape[1],)
    assert len(set(held["columns"])) == len(held["columns"])
    assert len(held["root_columns"]) == len(held["root_units"]) == shown.root.shape[1]
    np.testing.assert_allclose(held["time_s"], np.arange(len(clip)) / clip.fps)
    header = json.loads(held["header"].tobytes())
    assert header["representation"] == name
    assert header["skeleton"]["up"] == "y"


def test_columns_hold_what_their_names_say(clip):
    positions, _ = forward_kinematics(clip.skeleton, clip.channels)
    shown = represent(clip, "positions")
    knee = clip.skeleton.names.index("ltibia")
    column = shown.columns.index("ltibia.y")
    np.testing.assert_array_equal(shown.values[:, column], positions[:, knee, 1])
    assert shown.units[column] == "0.0564444 m"
    start = shown.columns.index("ltibia.y_axis.x")
    axis = shown.values[:, start : start + 3]
    np.testing.assert_allclose(np.linalg.norm(axis, axis=1), 1.0)
    assert shown.units[start] == "1"
    assert represent(clip, "scaled").units[column] == "body heights"
    aligned = represent(clip, "aligned")
    np.testing.assert_allclose(aligned.root[:, 1], positions[:, 0, 1])
    assert aligned.root_columns == ("tx", "ty", "tz", "yaw")
    assert aligned.root_units == (*["0.0564444 m"] * 3, "rad")
    channels = clip.represent("channels")
    assert channels.columns == clip.skeleton.channel_names
    assert set(channels.units) == {"0.0564444 m", "deg"}


def test_a_table_has_names_and_units_first(clip, tmp_path):
    write_representation(clip, "aligned", tmp_path / "x.csv")
    with (tmp_path / "x.csv").open(newline="") as file:
        first, *rows = list(csv.reader(file))
    assert first[:6] == [
        "time (s)", *(f"root.t{axis} (0.0564444 m)" for axis in "xyz"), "root.yaw (rad)",
        "root.x (0.0564444 m)",
    ]  # fmt: skip
    table = np.array(rows, dtype=float)
    shown = represent(clip, "aligned")
    np.testing.assert_allclose(table[:, 1:5], shown.root, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(table[:, 5:], shown.values, rtol=1e-8, atol=1e-9)


def test_other_files_and_names_are_refused(clip, tmp_path):
    with pytest.raises(FormatError, match=r"\.npz or \.csv, but got '\.bvh'"):
        write_representation(clip, "aligned", tmp_path / "x.bvh")
    with pytest.raises(SkeletonError, match="a representation out of channels"):
        write_representation(clip, "euler", tmp_path / "x.npz")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"values": np.zeros((60, 5))}, "values .60, 5. and root track .60, 4. of aligned"),
        ({"root": np.zeros((60, 3))}, "root track .60, 3. of aligned"),
        ({"values": np.zeros((60, 183), dtype=np.int64)}, "float64 channels"),
        ({"root": None}, "archive of a clip"),
    ],
)
def test_an_archive_that_does_not_fit_is_refused(clip, tmp_path, change, said):
    path = tmp_path / "x.npz"
    write_representation(clip, "aligned", path)
    with np.load(path, allow_pickle=False) as archive:
        held = {key: archive[key] for key in archive.files} | change
    np.savez(path, **{key: value for key, value in held.items() if value is not None})
    with pytest.raises(FormatError, match=said):
        read_clip(path)
