"""A library is read without mocapdb, by what docs/format.md says and nothing else."""

from __future__ import annotations

import hashlib
import json
import sqlite3
import struct
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.fft
from pose_reader import read_pose
from small_library import NAMES, build, write_clips

from mocapdb.compression import Target
from mocapdb.library import BuildSettings, Library

# -- the reader: nothing of mocapdb from here ... ------------------------------------------------


def read_channels(folder: Path, name: str) -> np.ndarray:
    """Return the channels (F, C) of a clip: raw, pose, or O'Kane's channels with a DCT."""
    database = sqlite3.connect(folder / "catalogue.db")
    assert database.execute("PRAGMA application_id").fetchone() == (0x6D6F6361,)
    assert database.execute("PRAGMA user_version").fetchone() == (6,)
    file, row, skeleton, digest = database.execute(
        "SELECT shards.file, shard_row, skeletons.json, skeletons.digest FROM clips "
        "JOIN shards ON shards.id = shard_id JOIN skeletons ON skeletons.id = skeleton_id "
        "WHERE clips.name = ? AND deleted IS NULL",
        [name],
    ).fetchone()
    bases = {
        bytes.fromhex(key): basis
        for key, basis in database.execute("SELECT digest, data FROM bases")
    }
    database.close()
    with h5py.File(folder / "shards" / file) as shard:
        assert shard.attrs["format"] == 1
        payload = shard["payload"][shard["offsets"][row] : shard["offsets"][row + 1]].tobytes()
        assert zlib.crc32(payload) == shard["crc32"][row]
    if payload[:6] == b"MCDP\x02\x02":
        return read_pose(payload, json.loads(skeleton), bases).channels
    assert zlib.crc32(payload[:-4]) == int.from_bytes(payload[-4:], "little")
    assert payload[:5] == b"MCDP\x01"
    codec, n_channels, n_frames, reference = struct.unpack_from("<BHI8s", payload, 5)
    skeleton = json.loads(skeleton)
    fields = {key: value for key, value in skeleton.items() if key != "name"}
    assert hashlib.sha256(json.dumps(fields, sort_keys=True).encode()).hexdigest() == digest
    assert bytes.fromhex(digest)[:8] == reference
    if codec == 0:
        return np.frombuffer(payload, "<f8", n_frames * n_channels, 20).reshape(n_frames, -1)
    return decode_okane(payload, n_frames, n_channels, skeleton)


def decode_okane(payload: bytes, n_frames: int, n_channels: int, skeleton: dict) -> np.ndarray:
    at = 20

    def take(kind: str, count: int) -> np.ndarray:
        nonlocal at
        values = np.frombuffer(payload, kind, count, at)
        at += values.nbytes
        return values

    def sparse(n_columns: int) -> np.ndarray:
        index = "<u2" if n_frames <= 65535 else "<u4"
        counts = take(index, n_columns)
        rows = take(index, counts.sum())
        matrix = np.zeros((n_frames, n_columns))
        matrix[rows, np.repeat(np.arange(n_columns), counts)] = take("<f4", counts.sum())
        return scipy.fft.idct(matrix, axis=0, norm="ortho")

    assert payload[at : at + 2] == bytes(2), "expected channels with a DCT"
    root_form, _, n_components = struct.unpack_from("<BBI", payload, at + 2)
    at += 8
    root_dofs = skeleton["dofs"][0].split()
    n_root, n_body = len(root_dofs), n_channels - len(root_dofs)
    has_pca = n_components != 0xFFFFFFFF
    if has_pca:
        mean, axes = take("<f4", n_body), take("<f4", n_components * n_body).reshape(-1, n_body)
    root = take("<f8", n_frames * n_root).reshape(-1, n_root) if root_form else sparse(n_root)
    body = sparse(n_components if has_pca else n_body)
    if has_pca:
        body = body @ axes.astype(float) + mean.astype(float)
    places = np.zeros((len(skeleton["parents"]), 3))
    for joint, parent in enumerate(skeleton["parents"][1:], start=1):
        places[joint] = places[parent] + skeleton["offsets"][joint]
    lever = np.sqrt((places**2).sum(axis=1).mean()) or 1.0
    root = root / [1.0 if dof[0] == "t" else np.deg2rad(lever) for dof in root_dofs]
    assert at == len(payload) - 4
    return np.hstack([root, body])


# -- ... to here ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_the_same_channels(small_library_template, name):
    with Library(small_library_template) as library:
        expected = library.clip(name).channels
    found = read_channels(small_library_template, name)
    assert np.abs(found - expected).max() < 1e-9


def test_the_same_raw_channels(small_corpus_template, tmp_path):
    raw = BuildSettings(Target("max_mm", 1), {"codec": "raw"})
    build(small_corpus_template, tmp_path / "raw", raw)
    with Library(tmp_path / "raw") as library:
        expected = library.clip("01_01").channels
    assert np.array_equal(read_channels(tmp_path / "raw", "01_01"), expected)


@pytest.mark.parametrize("decorrelation", ["lattice", "class"])
def test_the_same_channels_of_poses(tmp_path, decorrelation):
    files = {f"walk/{seed}.bvh": ("walk", seed) for seed in range(3)}  # enough to learn a basis of
    write_clips(tmp_path / "corpus", files)
    settings = BuildSettings(Target("mean_mm", 2.0), {"decorrelation": decorrelation})
    build(tmp_path / "corpus", tmp_path / "pose", settings)
    database = sqlite3.connect(tmp_path / "pose" / "catalogue.db")
    codecs = [codec for (codec,) in database.execute("SELECT codec FROM clips")]
    n_bases = database.execute("SELECT count(*) FROM bases").fetchone()[0]
    database.close()
    assert all(codec.startswith("pose") for codec in codecs), codecs
    assert (n_bases > 0) == (decorrelation == "class")
    with Library(tmp_path / "pose") as library:
        expected = {name: library.clip(name).channels for name in ("0", "1", "2")}
    for name, channels in expected.items():
        assert np.abs(read_channels(tmp_path / "pose", name) - channels).max() < 1e-9


def test_the_page_names_every_table_column_and_dataset(small_library_template):
    page = (Path(__file__).parents[2] / "docs" / "format.md").read_text(encoding="utf-8")
    database = sqlite3.connect(small_library_template / "catalogue.db")
    for table in (
        "clips",
        "skeletons",
        "shards",
        "builds",
        "bases",
        "joint_errors",
        "classes",
        "checksums",
        "derived_files",
    ):
        assert f"`{table}`" in page
        columns = [column[1] for column in database.execute(f"PRAGMA table_info({table})")]
        assert columns
        for column in columns:
            assert f"`{column}`" in page, f"{table}.{column}"
    database.close()
    with h5py.File(small_library_template / "shards/000001.h5") as shard:
        assert len(shard) == 6
        for name, dataset in shard.items():
            dims, units = dataset.attrs["dims"], dataset.attrs["units"]
            assert f"| `{name}` | {dataset.dtype.name} | {dims} | {units} |" in page
