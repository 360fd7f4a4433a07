"""NPZ: the same clip comes back, and nothing else is taken for one."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import fields

import numpy as np
import pytest
import smpl_arrays

from mocapdb.corpus import synthetic
from mocapdb.errors import FormatError
from mocapdb.io import read_clip, write_clip
from mocapdb.io.npz import read_npz, write_npz
from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import Skeleton


@pytest.fixture
def clip():
    skeleton = Skeleton(
        ["root", "lég"],
        [-1, 0],
        [[0, 0, 0], [0.1, 1 / 3, -7e-300]],
        [["tx", "rz", "ry", "rx"], ["rx"]],
        ["ZYX", "X"],
        axis_deg=[[0, 0, 0], [1 / 7, 0, 0]],
        convention="acclaim",
        metres_per_unit=0.0254 / 0.45,
        up="z",
        name="body",
    )
    channels = np.random.default_rng(0).normal(size=(7, 5)) * 1e3
    channels[0] = -0.0, 5e-324, 1.7976931348623157e308, 1 / 3, 0
    return Clip(
        skeleton,
        channels,
        1 / 0.0083333,
        name="ä clip",
        label="walk",
        source="/some/where.bvh",
        fps_source="file",
        unit_source="inferred",
        up_source="default",
        frame_time_text=".0083333",
        provenance=("read", "cut"),
    )


def test_everything_comes_back(clip, tmp_path):
    write_npz(clip, tmp_path / "clip.npz")
    again = read_npz(tmp_path / "clip.npz")
    assert again == clip
    assert again.channels.tobytes() == clip.channels.tobytes()
    for field in fields(clip):
        if field.name != "channels":
            assert getattr(again, field.name) == getattr(clip, field.name)
    assert again.skeleton.name == clip.skeleton.name


def test_the_first_archives_say_nothing_of_unit_and_up(clip, tmp_path):
    path = tmp_path / "clip.npz"
    write_npz(clip, path)
    with np.load(path) as archive:
        header = json.loads(archive["header"].item())
    header["version"] = 1
    del header["unit_source"], header["up_source"]
    np.savez(path, channels=clip.channels, header=np.frombuffer(json.dumps(header).encode(), "u1"))
    again = read_npz(path)
    assert (again.unit_source, again.up_source) == ("file", "file")


def test_others_read_it_at_sight(tmp_path):
    clip = synthetic.make_clip("walk", seed=1, duration_s=0.5)
    write_npz(clip, tmp_path / "clip.npz")
    with np.load(tmp_path / "clip.npz", allow_pickle=False) as archive:
        assert np.allclose(archive["positions"], clip.positions(), atol=1e-6)
        assert np.allclose(archive["quaternions"], clip.rotations(), atol=1e-6)
        assert tuple(archive["names"]) == clip.skeleton.names
        assert np.array_equal(archive["parents"], clip.skeleton.parents)
        assert tuple(archive["channel_names"]) == clip.skeleton.channel_names
        assert np.linalg.norm(archive["offsets"][2]) == pytest.approx(
            np.linalg.norm(clip.skeleton.offsets[2]) * clip.skeleton.metres_per_unit
        )
        assert archive["fps"] == 120
        assert str(archive["units"]) == "metres, y up, quaternions xyzw local"


def test_no_label_comes_back(clip, tmp_path):
    write_npz(Clip(clip.skeleton, clip.channels, 30), tmp_path / "clip.npz")
    assert read_npz(tmp_path / "clip.npz").label is None


def test_suffix_is_kept(clip, tmp_path):
    write_npz(clip, tmp_path / "clip.NPZ")
    assert [path.name for path in tmp_path.iterdir()] == ["clip.NPZ"]


def header_of(path):
    with np.load(path) as archive:
        return json.loads(archive["header"].item())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"version": 3}, "version 2, but got 3"),
        ({"fps": 0}, "positive frame rate"),
        ({"fps": None}, "fields of a clip"),
        ({"skeleton": {}}, "names"),
        ({"skeleton": 3}, "skeleton"),
        ({"provenance": None}, "fields of a clip"),
    ],
)
def test_broken_headers(clip, tmp_path, change, message):
    path = tmp_path / "clip.npz"
    write_npz(clip, path)
    header = json.dumps(header_of(path) | change).encode()
    np.savez(path, channels=clip.channels, header=np.frombuffer(header, dtype=np.uint8))
    with pytest.raises(FormatError, match=message) as error:
        read_npz(path)
    assert str(error.value).startswith(str(path))


def test_broken_archives(clip, tmp_path):
    path = tmp_path / "clip.npz"
    write_npz(clip, path)
    header = np.frombuffer(json.dumps(header_of(path)).encode(), dtype=np.uint8)
    whole = path.read_bytes()
    channels = clip.channels

    npy = io.BytesIO()
    np.save(npy, channels)

    def save(**arrays):
        np.savez(path, **arrays)

    for break_it in [
        lambda: path.write_bytes(b""),
        lambda: path.write_bytes(b"no archive"),
        lambda: path.write_bytes(whole[: len(whole) // 2]),
        lambda: path.write_bytes(whole[:200] + bytes(100) + whole[300:]),
        lambda: save(channels=channels),
        lambda: save(header=header),
        lambda: save(header=header, channels=np.zeros((7, 5), np.float32)),
        lambda: save(header=header, channels=channels[:, :3]),
        lambda: save(header=header, channels=channels[:0]),
        lambda: save(header=header, channels=channels * np.nan),
        lambda: save(header=header[:-5], channels=channels),
        lambda: save(header=np.frombuffer(b"[]", dtype=np.uint8), channels=channels),
        lambda: save(header=np.frombuffer(b"\xff\xff", dtype=np.uint8), channels=channels),
        lambda: save(header=header, channels=np.array([{"a": 1}], dtype=object)),
        lambda: path.write_bytes(b"\x93NUMPY\x01\x00garbage"),
        lambda: path.write_bytes(npy.getvalue()),
        path.unlink,
        path.mkdir,
    ]:
        break_it()
        with pytest.raises(FormatError, match=r"clip\.npz"):
            read_npz(path)


@pytest.mark.parametrize("as_model", [False, True])
def test_an_archive_that_unpacks_without_end_is_refused(tmp_path, monkeypatch, as_model):
    bomb, motion = tmp_path / "bomb.npz", tmp_path / "motion.npz"
    np.savez_compressed(bomb, header="{}", channels=np.zeros(2_000_000), v_template=np.zeros(3))
    np.savez(motion, **smpl_arrays.arrays("smplh"))
    monkeypatch.setattr("mocapdb.io.npz.MOST_UNASKED", 1_000_000)
    with pytest.raises(FormatError, match=r"bomb\.npz.*16 MB unpacked"):
        read_clip(motion, skeleton=bomb) if as_model else read_clip(bomb)


@pytest.mark.parametrize("name", ["channels", "poses", "v_template"])
def test_an_array_that_is_larger_than_any_memory(tmp_path, name):
    path, motion = tmp_path / "huge.npz", tmp_path / "motion.npz"
    np.savez(motion, **smpl_arrays.arrays("smplh"))
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        header, {"descr": "<f8", "fortran_order": False, "shape": (10**14, 3)}
    )
    with zipfile.ZipFile(path, "w") as archive:
        for own in ("header", "J_regressor", "trans", name):
            archive.writestr(f"{own}.npy", header.getvalue())
    with pytest.raises(FormatError, match=r"huge\.npz"):
        read_clip(motion, skeleton=path) if name == "v_template" else read_clip(path)


def test_an_archive_of_another_version_of_zip(tmp_path, synthetic_walk):
    path = write_clip(synthetic_walk[:2], tmp_path / "a.npz") and tmp_path / "a.npz"
    data = path.read_bytes()
    at = data.index(b"PK\x01\x02")  # of the first file, in the list at the end
    path.write_bytes(data[: at + 6] + b"\x7f" + data[at + 7 :])
    with pytest.raises(FormatError):
        read_clip(path)
