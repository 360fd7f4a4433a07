"""Files and folders are on the disk when a command says so."""

from __future__ import annotations

import re
from pathlib import Path

import mocapdb
from mocapdb.base import files
from mocapdb.base.files import make_folder

NOT_TO_KEEP = {"base/files.py", "base/workers.py", "library/remote.py", "viewer/pictures.py"}
"""Where folders are made of which a loss of power may leave nothing: copies, and marks."""


def test_names_of_new_folders_are_on_the_disk(tmp_path, monkeypatch):
    synced = []
    monkeypatch.setattr(files, "sync", synced.append)
    make_folder(tmp_path / "a" / "b" / "c")
    assert synced == [tmp_path, tmp_path / "a", tmp_path / "a" / "b"]
    synced.clear()
    make_folder(tmp_path / "a" / "d")
    make_folder(tmp_path / "a")
    assert synced == [tmp_path / "a"]
    assert (tmp_path / "a/b/c").is_dir()


def test_all_that_writes_makes_new_folders_so():
    root = Path(mocapdb.__file__).parent
    others = {
        path.relative_to(root).as_posix()
        for path in root.rglob("*.py")
        if re.search(r"\.mkdir\([^)]*parents=True", path.read_text(encoding="utf-8"))
    }
    assert others == NOT_TO_KEEP
