"""A small corpus, libraries of it, and the command line run on them.

The corpus: two subjects, AMC with ASF and BVH, two files of one stem, labels, a stated rate::

    01/01.asf  01/01_01.amc  01/01_02.amc  01/both.amc
    02/02.asf  02/02_01.amc
    bvh/02_02.bvh  bvh/both.bvh
    LABELS.csv
"""

from __future__ import annotations

import hashlib
import json
import math
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import h5py
import pytest
from click.testing import CliRunner, Result

import mocapdb.library.building.commit_clips as committing
from mocapdb.cli import cli
from mocapdb.compression import Budgets, Target
from mocapdb.corpus import synthetic
from mocapdb.io import write_clip
from mocapdb.library import (
    BuildReport,
    BuildSettings,
    Library,
    build_library,
    verify_library,
)
from mocapdb.library.database import SINCE_2
from mocapdb.library.row_checksums import fill_checksums

CLIPS = (  # file, subject's height in metres, class
    ("01/01_01.amc", 1.60, "walk"),
    ("01/01_02.amc", 1.60, "run"),
    ("01/both.amc", 1.60, "box"),
    ("02/02_01.amc", 1.85, "walk"),
    ("bvh/02_02.bvh", 1.85, "wave"),
    ("bvh/both.bvh", 1.85, "squat"),
)
NAMES = ("01/both", "01_01", "01_02", "02_01", "02_02", "bvh/both")
LABELS = """\
path,label,fps,description
01/01_01.amc,walk,,walks straight ahead
01/01_02.amc,run,60,"runs, fast and far"
01/both.amc,box,,
02/02_01.amc,walk,,walks up a ladder
bvh/02_02.bvh,wave,,
bvh/both.bvh,squat,,
"""
QUICK = BuildSettings(
    Target("mean_mm", 2.0, joint_share=0),
    {
        "codec": "okane",
        "transform": "dct",
        "decorrelation": "none",
        "representation": "channels",
        "shares": Budgets(0.4, 0.0, 0.6),
    },
)
SINCE_5 = ("source_files", "search_index", "search_pieces", "unsearched", "unlearned")
SINCE_6 = ("plans", "planned_folders", "unplanned", "saved_queries")
INDEXES_SINCE_6 = ("clips_source", "clips_sha256", "clips_assumed", "clips_noted")
# the same on the command line
OPTIONS = (
    "--mean-mm", 2, "--joint-share", 0, "--representation", "channels", "--transform", "dct",
    "--jobs", 1, "--decorrelation", "none", "--budgets", "0.4,0,0.6",
)  # fmt: skip


def write_clips(root: Path, files: dict[str, tuple[str, int]], height_m: float = 1.7) -> None:
    """Write clips of (class, seed), 60 frames each, by their paths in the corpus."""
    skeleton = synthetic.make_skeleton(height_m)
    for path, (kind, seed) in files.items():
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        clip = synthetic.make_clip(kind, seed=seed, skeleton=skeleton, duration_s=0.5)
        write_clip(clip, root / path)


def build(corpus: Path, library: Path, settings: BuildSettings = QUICK, **options) -> BuildReport:
    """Build in this process and without an index, which takes the longest here, unless told so."""
    return build_library(corpus, library, settings, **({"jobs": 1, "index": False} | options))


@contextmanager
def one_commit() -> Iterator[None]:
    """Let builds commit but once, however slow they are."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(committing, "COMMIT_SECONDS", math.inf)
        yield


def sound(library: Path) -> bool:
    with Library(library) as opened:
        report = verify_library(opened)
    return not (report["bad"] or report["shards"] or report["stray"])


def leftovers(library: Path) -> list[str]:
    """Files that are there only while someone works on a library, or was killed at it."""
    passing = ("*.partial*", "*-wal", "*-shm", "*-journal", "writer.json")
    return [str(path) for pattern in passing for path in library.rglob(pattern)]


def made_older(library: Path, version: int) -> None:
    """Make of a library what an earlier version would have made: its catalogue, and its shards."""
    columns = [f"clips.{name}" for name in SINCE_2] if version < 2 else []
    tables = ["checksums", "derived_files", "facets", *["revisions"] * (version < 3)]
    with closing(sqlite3.connect(library / "catalogue.db")) as database:
        for index in INDEXES_SINCE_6:
            database.execute(f"DROP INDEX {index}")
        for table in [*SINCE_6, *SINCE_5 * (version < 5)]:
            database.execute(f"DROP TABLE {table}")
        if version >= 4:
            database.execute(f"PRAGMA user_version = {version}")
            fill_checksums(database)
            database.commit()
            return
        for path in sorted((library / "shards").iterdir()):
            with h5py.File(path, "r+") as shard:
                del shard["entries"], shard["entry_offsets"]
            content = path.read_bytes()
            database.execute(
                "UPDATE shards SET size = ?, sha256 = ? WHERE file = ?",
                [len(content), hashlib.sha256(content).hexdigest(), path.name],
            )
        for column in [*columns, "shards.complete"]:
            database.execute("ALTER TABLE {} DROP COLUMN {}".format(*column.split(".")))
        for table in tables:
            database.execute(f"DROP TABLE {table}")
        database.execute(f"PRAGMA user_version = {version}")
        database.commit()


def rows(library: Path) -> dict[str, tuple[int, ...]]:
    """Where the clips of a library are, by name: unchanged as long as none is encoded again."""
    with Library(library) as opened:
        return {r.name: (r.id, r.shard_id, r.shard_row) for r in opened.records()}


def decoded(library: Path) -> dict[str, bytes]:
    with Library(library) as opened:
        return {clip.name: clip.channels.tobytes() for clip in opened}


def run(*args: object) -> Result:
    """Run the command line; what must never be seen is looked for here, for every test."""
    result = CliRunner().invoke(cli, [str(arg) for arg in args])
    assert "Traceback" not in result.output
    assert "fault of mocapdb's own" not in result.output
    assert result.exit_code in {0, 1, 2}
    return result


def run_json(*args: object, exit_code: int = 0) -> Any:
    """Run a command with --json: one object on stdout and nothing else."""
    result = run(*args, "--json")
    assert result.exit_code == exit_code, result.output
    return json.loads(result.stdout)


@pytest.fixture(scope="session")
def small_corpus_template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("template") / "corpus"
    for number, (file, height_m, kind) in enumerate(CLIPS):
        path = root / file
        path.parent.mkdir(parents=True, exist_ok=True)
        skeleton = synthetic.make_skeleton(height_m)
        clip = synthetic.make_clip(kind, seed=number, skeleton=skeleton, duration_s=1.0)
        write_clip(clip, path)
        if path.suffix == ".amc":  # one skeleton for all clips of a subject
            path.with_suffix(".asf").replace(path.parent / f"{path.parent.name}.asf")
    (root / "LABELS.csv").write_text(LABELS)
    return root


@pytest.fixture(scope="session")
def small_library_template(small_corpus_template: Path) -> Path:
    library = small_corpus_template.parent / "small.mocapdb"
    with one_commit():
        report = build(small_corpus_template, library)
    assert report.built == len(CLIPS)
    assert not report.failed
    return library


@pytest.fixture
def small_corpus(small_corpus_template: Path, tmp_path: Path) -> Path:
    """A copy of the corpus, to be changed."""
    return Path(shutil.copytree(small_corpus_template, tmp_path / "corpus"))


@pytest.fixture
def small_library(small_library_template: Path, tmp_path: Path) -> Path:
    """A copy of its library, to be changed; its corpus is `small_corpus_template`."""
    return Path(shutil.copytree(small_library_template, tmp_path / "small.mocapdb"))
