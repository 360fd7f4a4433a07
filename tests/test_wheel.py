"""The wheel works away from the checkout, with its data files."""

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A folder with what the wheel holds, and nothing of the checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*build, "--wheel-dir", str(folder), str(CHECKOUT)], check=True)
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def run(installed, *arguments):
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    return subprocess.run(
        [sys.executable, "-m", "mocapdb", *arguments],
        cwd=installed.parent, env=environment, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip


def test_it_holds_the_manifest(installed):
    plan = json.loads(run(installed, "fetch", "02_03", "--dry-run", "--json"))
    assert len(plan["missing"]) == 2
    where = "import mocapdb.corpus.manifest as m; print(m.manifest_path())"
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    path = subprocess.check_output(
        [sys.executable, "-c", where], cwd=installed.parent, env=environment, text=True
    )
    assert Path(path.strip()).is_relative_to(installed)


def test_it_holds_the_papers_tables_and_nothing_else(installed):
    (wheel,) = installed.parent.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert "mocapdb/reproduce/data/okane2008_tables.csv" in names
    for file in (
        "py.typed",
        "motion/body/joint_words.toml",
        "scenes/player.js",
        "report/report.css",
        "viewer/bridge.js",
    ):
        assert f"mocapdb/{file}" in names
    assert not [n for n in names if n.startswith(("tests", "benchmarks", "notebooks"))]
    assert not [n for n in names if n.endswith((".amc", ".asf", ".bvh", ".pyc"))]
