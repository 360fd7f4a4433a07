"""Damaged files are read or refused; in full size ``python tests/fuzz.py --inputs 10000``."""

from __future__ import annotations

import os

import fuzz
import pytest


@pytest.fixture(scope="module")
def readers(tmp_path_factory):
    return fuzz.make_readers(tmp_path_factory.mktemp("fuzz"))


def test_what_is_sound_is_read(readers):
    for reader in readers.values():
        for path, _ in reader.seeds:
            reader.read(path)


@pytest.mark.skipif(os.name != "posix", reason="the clock of a process is POSIX's")
@pytest.mark.parametrize(
    ("kind", "count"),
    [
        ("asf", 60),
        ("amc", 60),
        ("bvh", 60),
        ("npz", 60),
        ("gltf", 60),
        ("amass", 40),
        ("model", 40),
        ("labels", 40),
        ("manifest", 40),
        ("joints", 40),
        ("settings", 40),
        ("query", 40),
        ("library", 40),
    ],
)
def test_no_input_does_harm(readers, kind, count):
    assert [problem for problem, _ in fuzz.faults(readers[kind], count, seed=7)] == []
