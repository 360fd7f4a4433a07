"""The add-on in a real Blender, which is the module bpy; without it these tests are skipped."""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path

import pytest
from in_blender import import_bvh

ADDON = Path(__file__).parents[2] / "blender"
NAME = "mocapdb_blender"


def pytest_collection_modifyitems(items):
    here = Path(__file__).parent
    for item in items:
        if here in Path(item.path).parents:
            item.add_marker(pytest.mark.blender)
            if "addon" in item.fixturenames and importlib.util.find_spec("bpy") is None:
                item.add_marker(pytest.mark.skip("no bpy here: make test-blender installs it"))
            for theirs in ("pytest.PytestUnraisableExceptionWarning", "DeprecationWarning"):
                item.add_marker(pytest.mark.filterwarnings(f"ignore::{theirs}"))  # Blender's own


STATUS = [0]


def pytest_sessionfinish(session, exitstatus):
    STATUS[0] = int(exitstatus)


def pytest_unconfigure(config):
    if "bpy" in sys.modules:  # which may wait for ever for its own threads when Python ends
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(STATUS[0])


@pytest.fixture(scope="session")
def addon():
    """The add-on, registered."""
    spec = importlib.util.spec_from_file_location(
        NAME, ADDON / "__init__.py", submodule_search_locations=[str(ADDON)]
    )
    module = importlib.util.module_from_spec(spec)
    sys.modules[NAME] = module
    spec.loader.exec_module(module)
    module.register()
    yield module
    module.WORKER.close()


@pytest.fixture
def bpy(addon):
    """Blender with an empty file."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy


@pytest.fixture
def scene(bpy):
    return bpy.context.scene


@pytest.fixture(scope="session")
def files(tmp_path_factory):
    """A walk and a wave, as BVH files of 30 frames a second; a walk with a fault in it."""
    from mocapdb.corpus import synthetic
    from mocapdb.io import write_clip

    folder = tmp_path_factory.mktemp("files")
    walk = synthetic.make_clip("walk", seed=1, duration_s=5.0).resample(30)
    write_clip(walk, folder / "walk.bvh")
    write_clip(synthetic.inject_faults(walk, seed=3, n=2).clip, folder / "faulty.bvh")
    return folder


@pytest.fixture(scope="session")
def library(tmp_path_factory):
    """A library of some walks, runs and waves, that can be searched."""
    from mocapdb import BuildSettings, Target, build_library
    from mocapdb.corpus import synthetic
    from mocapdb.io import write_clip

    folder = tmp_path_factory.mktemp("clips")
    for label in ("walk", "run", "wave"):
        (folder / label).mkdir()
        for seed in (1, 2):
            clip = synthetic.make_clip(label, seed=seed, duration_s=3.0).resample(30)
            write_clip(clip, folder / label / f"{label}_{seed}.bvh")
    path = tmp_path_factory.mktemp("library") / "moves.mocapdb"
    build_library(folder, path, BuildSettings(Target("mean_mm", 0.5)), jobs=1)
    return path


@pytest.fixture
def walking(bpy, files):
    """The walk, brought in by Blender's own importer; its armature is selected and active."""
    return import_bvh(bpy, files / "walk.bvh")
