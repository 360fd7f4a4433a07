"""CSV: a row a frame, for those who read nothing else."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from small_library import run

from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError
from mocapdb.io import write_clip, write_csv


@pytest.fixture(scope="module")
def walk():
    return synthetic.make_clip("walk", seed=1, duration_s=0.5)


def read(path):
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def test_a_table_holds_positions_rotations_and_contacts(walk, tmp_path):
    write_clip(walk, tmp_path / "walk.csv")
    table = read(tmp_path / "walk.csv")
    assert list(table)[:5] == ["frame", "time_s", "root.x", "root.y", "root.z"]
    assert np.allclose(table["time_s"], np.arange(60) / 120)
    head = walk.skeleton.joint("head")
    for i, axis in enumerate("xyz"):
        assert np.allclose(table[f"head.{axis}"], walk.positions()[:, head, i], atol=1e-8)
    assert np.allclose(table["head.qw"], walk.rotations()[:, head, 3], atol=1e-8)
    assert np.array_equal(table["left.contact"], walk.contacts()[:, 0])


def test_columns_can_be_chosen(walk, tmp_path):
    write_csv(walk, tmp_path / "walk.csv", ["channels"])
    table = read(tmp_path / "walk.csv")
    assert np.allclose(np.stack(list(table.values())[2:], axis=1), walk.channels, atol=1e-6)
    with pytest.raises(ClipError, match="got 'angles'"):
        write_csv(walk, tmp_path / "walk.csv", ["angles"])


def test_from_the_command_line(walk, tmp_path):
    write_clip(walk, tmp_path / "walk.bvh")
    out = tmp_path / "walk.csv"
    assert run("convert", tmp_path / "walk.bvh", out, "--columns", "velocities").exit_code == 0
    assert "root.vx" in read(out)
    wrong = run("convert", tmp_path / "walk.bvh", tmp_path / "a.npz", "--columns", "velocities")
    assert wrong.exit_code == 2
    assert "--columns says what is in a .csv" in wrong.stderr
