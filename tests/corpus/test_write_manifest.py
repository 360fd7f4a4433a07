from __future__ import annotations

import hashlib
import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

from mocapdb.corpus.manifest import read_manifest

SCRIPT = Path(__file__).parents[2] / "scripts" / "write_manifest.py"


@pytest.fixture
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("write_manifest", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run(script: ModuleType, monkeypatch: pytest.MonkeyPatch, *args: Path | str) -> int:
    monkeypatch.setattr("sys.argv", ["write_manifest.py", *map(str, args)])
    return int(script.main())


def test_index_and_labels_become_a_manifest(
    script: ModuleType,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    index = tmp_path / "index.csv"
    index.write_text('clip,description,fps\n02_01,walk,120\n60_01,"salsa\xa0 dance",60\n')
    (tmp_path / "02.asf").write_text("a skeleton")
    (tmp_path / "HDM_bd.asf").write_text("another skeleton")
    labels = tmp_path / "LABELS.csv"
    labels.write_text(
        "clip,label,format,path,skeleton,sha256\n"
        f"02_01,walk,amc,02_01.amc,02.asf,{'a' * 64}\n"
        f"02_01,walk,bvh,02_01.bvh,,{'b' * 64}\n"
        f"HDM_bd_01,jog,amc,HDM_bd_01.amc,HDM_bd.asf,{'c' * 64}\n"
    )
    output = tmp_path / "manifest.csv"
    assert run(script, monkeypatch, index, "--labels", labels, "-o", output) == 0
    walk, salsa = read_manifest(output)
    assert (walk.label, walk.sha256) == ("walk", "a" * 64)
    assert walk.skeleton_sha256 == hashlib.sha256(b"a skeleton").hexdigest()
    assert walk.motion_url == "http://mocap.cs.cmu.edu/subjects/02/02_01.amc"
    assert (salsa.label, salsa.description, salsa.fps) == ("salsa", "salsa dance", 60.0)
    assert (salsa.subject, salsa.trial, salsa.sha256) == ("60", "01", None)
    assert "| salsa | 1 |" in capsys.readouterr().out


def test_bad_index_leaves_the_manifest_alone(
    script: ModuleType,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    index = tmp_path / "index.csv"
    index.write_text("clip,description,fps\n02_01,walk,fast\n")
    output = tmp_path / "manifest.csv"
    output.write_text("as it was")
    assert run(script, monkeypatch, index, "-o", output) == 1
    assert f"{index}:2: Expected fps" in capsys.readouterr().err
    assert output.read_text() == "as it was"
