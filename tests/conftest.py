"""Fixtures that every test may use."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from looking import browser, seen_library, seen_report  # noqa: F401 - fixtures

settings.register_profile(
    "mocapdb", deadline=None, max_examples=40, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("mocapdb")


def corpus_folder() -> Path | None:
    """Return the folder of real clips, if this machine has one."""
    named = os.environ.get("MOCAPDB_CORPUS")
    folder = Path(named) if named else Path(__file__).parents[2] / "shared" / "corpus"
    return folder if folder.is_dir() else None


@pytest.fixture(scope="session")
def corpus() -> Path:
    folder = corpus_folder()
    if folder is None:
        pytest.skip("no real clips here: set MOCAPDB_CORPUS to a folder of them")
    return folder


@pytest.fixture(scope="session")
def synthetic_walk():
    from mocapdb.corpus import synthetic

    return synthetic.make_clip("walk", seed=1)


@pytest.fixture(scope="session")
def synthetic_tall_walk():
    from mocapdb.corpus import synthetic

    tall = synthetic.make_skeleton(1.95, arm=1.1)
    return synthetic.make_clip("walk", seed=2, skeleton=tall)


@pytest.fixture(scope="session")
def zoo() -> Path:
    """The folder of other exporters' files."""
    named = os.environ.get("MOCAPDB_ZOO")
    folder = Path(named) if named else Path(__file__).parents[2] / "shared" / "zoo"
    if not folder.is_dir():
        pytest.skip("no files of other exporters here: set MOCAPDB_ZOO to a folder of them")
    return folder
