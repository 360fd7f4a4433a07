"""Fixtures that every test may use."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from looking import browser, seen_library, seen_report  # noqa: F401 - fixtures

NAMED_BLENDER = os.environ.get("MOCAPDB_BLENDER")

settings.register_profile(
    "mocapdb", deadline=None, max_examples=40, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("mocapdb")


if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # as a shell has it for what runs in the background; tests send Ctrl-C to commands
    signal.signal(signal.SIGINT, signal.default_int_handler)


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


@pytest.fixture(scope="session")
def dask_cluster() -> Iterator[str]:
    """The address of a Dask scheduler with two workers, each a process of this machine."""
    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address=":0",
        env={
            "PYTHONPATH": os.pathsep.join(sys.path)
        },  # also of workers that take a killed one's place
    )
    with cluster:
        yield cluster.scheduler_address


@pytest.fixture(scope="session", autouse=True)
def no_blender_by_chance() -> Iterator[None]:
    """Have tests see the same with and without a Blender; `blender_program` is for the others."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MOCAPDB_BLENDER", "/no/blender/for/tests")
        yield


@pytest.fixture
def blender_program(monkeypatch: pytest.MonkeyPatch) -> tuple[str, ...]:
    """How Blender is started: what the environment names, else one that is found."""
    from mocapdb.errors import FormatError
    from mocapdb.io.blender.program import find_blender

    if NAMED_BLENDER is None:
        monkeypatch.delenv("MOCAPDB_BLENDER")
    else:
        monkeypatch.setenv("MOCAPDB_BLENDER", NAMED_BLENDER)
    try:
        return find_blender("any.fbx").command
    except FormatError:
        pytest.skip("no Blender here: make test-blender installs bpy")
