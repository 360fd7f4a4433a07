"""The catalogue as its only writer has it: made, written and shrunk. Its commit is *the* commit."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from mocapdb.base.files import replacing
from mocapdb.errors import LibraryError
from mocapdb.library.catalogue import SHARD_TABLES, Catalogue
from mocapdb.library.database import APPLICATION_ID, CATALOGUE_FORMAT, SINCE_2, sqlite_errors
from mocapdb.library.layout import CATALOGUE_FILE
from mocapdb.library.writing.shard_writer import write_shard
from mocapdb.motion.skeleton import Skeleton

__all__ = ["CatalogueWriter", "create_catalogue"]

#: Libraries of before lack it: whoever keeps a basis in one adds it.
BASES_TABLE = """
CREATE TABLE IF NOT EXISTS bases (
    digest TEXT PRIMARY KEY,
    label TEXT NOT NULL,
    layout TEXT NOT NULL,
    data BLOB NOT NULL
)
"""
#: Libraries of before lack it too: the next build adds it.
JOINT_ERRORS_TABLE = """
CREATE TABLE IF NOT EXISTS joint_errors (
    clip_id INTEGER PRIMARY KEY REFERENCES clips(id),
    data BLOB NOT NULL
)
"""
REVISIONS_TABLE = """
CREATE TABLE revisions (
    id INTEGER PRIMARY KEY,
    clip_id INTEGER NOT NULL REFERENCES clips(id),
    kind TEXT NOT NULL,
    created TEXT NOT NULL,
    version TEXT NOT NULL,
    settings TEXT NOT NULL,
    spans TEXT NOT NULL,
    sha256 TEXT NOT NULL,
    codec TEXT NOT NULL,
    payload_bytes INTEGER NOT NULL,
    skinned_error REAL NOT NULL,
    error_mean_mm REAL NOT NULL,
    error_p95_mm REAL NOT NULL,
    error_max_mm REAL NOT NULL,
    shard_id INTEGER REFERENCES shards(id),
    shard_row INTEGER,
    deleted TEXT
)
"""
REVISIONS_INDEX = (
    "CREATE UNIQUE INDEX revisions_live_clip ON revisions(clip_id) WHERE deleted IS NULL"
)
SHARD_COLUMNS = """
    id INTEGER PRIMARY KEY,
    file TEXT NOT NULL UNIQUE,
    size INTEGER NOT NULL,
    sha256 TEXT NOT NULL
"""
SCHEMA = f"""{BASES_TABLE};
{JOINT_ERRORS_TABLE};
CREATE TABLE skeletons (
    id INTEGER PRIMARY KEY,
    digest TEXT NOT NULL UNIQUE,
    name TEXT NOT NULL,
    channels INTEGER NOT NULL,
    json TEXT NOT NULL
);
CREATE TABLE builds (
    id INTEGER PRIMARY KEY,
    corpus TEXT NOT NULL,
    settings TEXT NOT NULL,
    started TEXT NOT NULL,
    finished TEXT
);
CREATE TABLE shards ({SHARD_COLUMNS});
CREATE TABLE feature_shards ({SHARD_COLUMNS});
CREATE TABLE clips (
    id INTEGER PRIMARY KEY,
    name TEXT NOT NULL,
    stem TEXT NOT NULL,
    label TEXT,
    label_source TEXT NOT NULL DEFAULT 'corpus',
    description TEXT NOT NULL,
    skeleton_id INTEGER NOT NULL REFERENCES skeletons(id),
    frames INTEGER NOT NULL,
    fps REAL NOT NULL,
    fps_source TEXT NOT NULL,
    frame_time_text TEXT NOT NULL,
    provenance TEXT NOT NULL,
    corpus TEXT NOT NULL,
    source TEXT NOT NULL,
    source_bytes INTEGER NOT NULL,
    source_sha256 TEXT NOT NULL,
    settings TEXT NOT NULL,
    codec TEXT NOT NULL,
    payload_bytes INTEGER NOT NULL,
    skinned_error REAL NOT NULL,
    error_mean_mm REAL NOT NULL,
    error_p95_mm REAL NOT NULL,
    error_max_mm REAL NOT NULL,
    shard_id INTEGER NOT NULL REFERENCES shards(id),
    shard_row INTEGER NOT NULL,
    build_id INTEGER NOT NULL REFERENCES builds(id),
    deleted TEXT,
    {", ".join(f"{name} {declared}" for name, (declared, _) in SINCE_2.items())}
);
CREATE TABLE features (
    clip_id INTEGER PRIMARY KEY REFERENCES clips(id),
    shard_id INTEGER REFERENCES feature_shards(id),
    shard_row INTEGER,
    problem TEXT
);
{REVISIONS_TABLE};
{REVISIONS_INDEX};
CREATE UNIQUE INDEX clips_live_name ON clips(name) WHERE deleted IS NULL;
CREATE INDEX clips_stem ON clips(stem);
CREATE INDEX clips_label ON clips(label);
CREATE VIEW classes AS
    SELECT label AS name, count(*) AS clips, sum(frames) AS frames
    FROM clips WHERE deleted IS NULL AND label IS NOT NULL GROUP BY label;
"""
SEARCHED = ("name", "label", "description")


class CatalogueWriter(Catalogue):
    """The catalogue of one library, to read and to write; only the library's only writer may.

    Writing methods belong inside ``with catalogue.transaction():``.
    """

    writable = True

    def _prepare(self) -> None:
        from sqlite_utils import Database  # here, as queries import this module and never write

        super()._prepare()
        self._connection.execute("PRAGMA journal_mode = WAL")
        self._connection.execute("PRAGMA synchronous = FULL")
        self._database = Database(self._connection)
        if self.version < CATALOGUE_FORMAT:
            self._bring_up_to_date()

    def _bring_up_to_date(self) -> None:
        """Add what an earlier format lacks, all or nothing; of a clip, what its skeleton tells."""
        with self.transaction():
            if self.version < 2:
                for name, (declared, _) in SINCE_2.items():
                    self._connection.execute(f"ALTER TABLE clips ADD COLUMN {name} {declared}")
                told = ", ".join(
                    f"{name} = (SELECT {SINCE_2[name][1]} FROM skeletons WHERE id = skeleton_id)"
                    for name in ("unit_m", "up")
                )
                self._connection.execute(f"UPDATE clips SET {told}")
            self._connection.execute(REVISIONS_TABLE)
            self._connection.execute(REVISIONS_INDEX)
            self._connection.execute(f"PRAGMA user_version = {CATALOGUE_FORMAT}")
        self.version = CATALOGUE_FORMAT

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Commit everything in the block, or nothing of it."""
        with sqlite_errors(self.path), self._connection:
            self._connection.execute("BEGIN IMMEDIATE")
            yield  # what sqlite-utils commits in here are savepoints of this transaction

    # -- rows ----------------------------------------------------------------------------------

    def insert(self, table: str, fields: Mapping[str, Any]) -> int:
        """Insert a row and return its number."""
        rows: Any = self._database.table(table)
        return int(rows.insert(fields, pk="id").last_pk)

    def finish_build(self, build_id: int, finished: str) -> None:
        """Note that a build has ended."""
        self._database.table("builds").update(build_id, {"finished": finished})

    def add_shard(self, folder: str, image: bytes) -> int:
        """Write a shard into a folder of them, note it and return its row."""
        return self.insert(SHARD_TABLES[folder], write_shard(self.path.parent / folder, image))

    def add_skeleton(self, skeleton: Skeleton) -> int:
        """Keep a skeleton, once, and return its row."""
        for row in self._rows("SELECT id FROM skeletons WHERE digest = ?", [skeleton.digest]):
            return int(row["id"])
        return self.insert(
            "skeletons",
            {
                "digest": skeleton.digest,
                "name": skeleton.name,
                "channels": skeleton.n_channels,
                "json": json.dumps(skeleton.to_dict()),
            },
        )

    def update_clips(self, updates: Mapping[int, dict[str, Any]]) -> None:
        """Change columns of clips. Names change in two steps, so that two clips may swap."""
        clips = self._database.table("clips")
        renamed = {row: {"name": f"\0{row}"} for row, own in updates.items() if "name" in own}
        for clip_id, columns in [*renamed.items(), *updates.items()]:
            clips.update(clip_id, columns)

    def add_basis(self, digest: bytes, label: str, layout: str, data: bytes) -> None:
        """Keep a basis of a class for clips whose channels have that layout."""
        self._database.execute(BASES_TABLE)
        self._database.table("bases").insert(
            {"digest": digest.hex(), "label": label, "layout": layout, "data": data}, ignore=True
        )

    def add_joint_errors(self, clip_id: int, data: bytes) -> None:
        """Keep what the joints of a clip lost of their own motion (see `joint_losses`)."""
        self._database.execute(JOINT_ERRORS_TABLE)
        self._database.table("joint_errors").insert({"clip_id": clip_id, "data": data})

    def add_features(self, rows: Iterable[dict[str, Any]]) -> None:
        """Note where the features of clips are, or why they have none, in place of earlier notes.

        Rows have ``clip_id``, and ``shard_id`` and ``shard_row`` or ``problem``.
        """
        self._database.table("features").upsert_all(rows, pk="clip_id")

    def drop_revisions(self, clip_ids: Iterable[int], when: str) -> None:
        """Take back the revisions of clips, by the clips' rows."""
        for clip_id in clip_ids:
            self._connection.execute(
                "UPDATE revisions SET deleted = ? WHERE clip_id = ? AND deleted IS NULL",
                [when, clip_id],
            )

    def move_revisions(self, places: Mapping[int, tuple[int, int]]) -> None:
        """Say where the payloads of revisions are now: shard and row, by the revisions' rows."""
        for row, (shard_id, shard_row) in places.items():
            self._connection.execute(
                "UPDATE revisions SET shard_id = ?, shard_row = ? WHERE id = ?",
                [shard_id, shard_row, row],
            )

    def remove_features(self, clip_ids: Iterable[int]) -> None:
        """Forget the features of clips, so that they are computed anew."""
        for clip_id in clip_ids:
            self._connection.execute("DELETE FROM features WHERE clip_id = ?", [clip_id])

    # -- compacting ----------------------------------------------------------------------------

    def remove_deleted(self) -> None:
        """Remove deleted clips for good, and shards and skeletons that nothing refers to."""
        for table, where in (
            ("joint_errors", "clip_id IN (SELECT id FROM clips WHERE deleted IS NOT NULL)"),
            ("features", "clip_id IN (SELECT id FROM clips WHERE deleted IS NOT NULL)"),
            (
                "feature_shards",
                "id NOT IN (SELECT shard_id FROM features WHERE shard_id IS NOT NULL)",
            ),
            (
                "revisions",
                "deleted IS NOT NULL OR "
                "clip_id IN (SELECT id FROM clips WHERE deleted IS NOT NULL)",
            ),
            ("clips", "deleted IS NOT NULL"),
            (
                "shards",
                "id NOT IN (SELECT shard_id FROM clips UNION "
                "SELECT shard_id FROM revisions WHERE shard_id IS NOT NULL)",
            ),
            ("skeletons", "id NOT IN (SELECT skeleton_id FROM clips)"),
        ):
            if self._database.table(table).exists():  # libraries of before have no joint_errors
                self._database.table(table).delete_where(where)

    def shrink(self) -> None:
        """Give the file's free pages back to the disk."""
        with sqlite_errors(self.path):
            self._database.vacuum()


def create_catalogue(folder: Path) -> None:
    """Make an empty catalogue in a library's folder, whole or not at all.

    Raises
    ------
    LibraryError
        If the disk is full or cannot be written; nothing is left behind.
    """
    from sqlite_utils import Database

    path = folder / CATALOGUE_FILE
    with (
        replacing(path, failed=_cannot_make, one_writer=True) as (unfinished,),
        sqlite_errors(path),
        closing(sqlite3.connect(unfinished, isolation_level=None)) as connection,
    ):
        connection.execute("PRAGMA journal_mode = MEMORY")  # no journal file is left behind
        connection.executescript(SCHEMA)
        Database(connection).table("clips").enable_fts(SEARCHED, create_triggers=True)
        connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        connection.execute(f"PRAGMA user_version = {CATALOGUE_FORMAT}")


def _cannot_make(path: Path, problem: OSError) -> LibraryError:
    return LibraryError(f"{path.parent}: cannot make the library ({problem.strerror}).")
