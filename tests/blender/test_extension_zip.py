"""The zip that make blender builds: what is in it, and that Blender takes it."""

import importlib.util
import os
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

INSTALL = """
import os, sys
import bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.extensions.package_install_files(
    filepath=sys.argv[1], repo="user_default", enable_on_install=True
)
assert "bl_ext.user_default.mocapdb" in bpy.context.preferences.addons
from bl_ext.user_default.mocapdb import WORKER
print("ready", WORKER.do("get_ready"), hasattr(bpy.types.Scene, "mocapdb_loops"))
sys.stdout.flush()
WORKER.close()
os._exit(0)
"""


@pytest.fixture(scope="module")
def building():
    spec = importlib.util.spec_from_file_location(
        "build_blender", ROOT / "scripts/build_blender.py"
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_wheels_are_packed_and_named_in_the_manifest(building, tmp_path):
    wheel = tmp_path / "thing-1.0-py3-none-any.whl"
    wheel.write_bytes(b"wheel")
    path = building.write_zip(tmp_path / "dist", "linux-x64", [wheel])
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
        assert archive.read("wheels/thing-1.0-py3-none-any.whl") == b"wheel"
    assert manifest["wheels"] == ["./wheels/thing-1.0-py3-none-any.whl"]
    assert manifest["platforms"] == ["linux-x64"]
    assert list(manifest["permissions"]) == ["files"]
    assert {"__init__.py", "LICENSE", "README.md", "worker.py"} <= set(names)
    assert not any("test" in name or "cache" in name for name in names)
    again = building.write_zip(tmp_path / "again", "linux-x64", [wheel])
    assert again.read_bytes() == path.read_bytes()


def test_blender_installs_and_enables_it(addon, building, tmp_path):
    path = building.main(["--no-wheels", "-o", str(tmp_path)])
    environment = dict(
        os.environ,
        BLENDER_USER_RESOURCES=str(tmp_path / "user"),
        PYTHONPATH=str(ROOT),
    )
    (tmp_path / "user").mkdir()
    done = subprocess.run(
        [sys.executable, "-c", INSTALL, str(path)],
        env=environment, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert "ready {'compiled': True} True" in done.stdout, done.stdout + done.stderr
