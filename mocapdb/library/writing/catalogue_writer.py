"""The catalogue as its only writer has it: made, written and shrunk. Its commit is *the* commit."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from mocapdb.base.files import replacing
from mocapdb.errors import LibraryError
from mocapdb.library.catalogue import ASSUMED, NOTED, SHARD_TABLES, Catalogue
from mocapdb.library.database import (
    APPLICATION_ID,
    CATALOGUE_FORMAT,
    CLASSES_VIEW,
    SINCE_2,
    sqlite_errors,
)
from mocapdb.library.facets import Facets
from mocapdb.library.hdf5 import file_sha256
from mocapdb.library.layout import CATALOGUE_FILE, SHARDS_FOLDER
from mocapdb.library.row_checksums import CHECKSUMS_TABLE, fill_checksums, keep_checksums
from mocapdb.library.writing.shard_writer import write_shard
from mocapdb.motion.skeleton import Skeleton

__all__ = ["CatalogueWriter", "create_catalogue"]

BASES_TABLE = """
CREATE TABLE IF NOT EXISTS bases (
    digest TEXT PRIMARY KEY,
    label TEXT NOT NULL,
    layout TEXT NOT NULL,
    data BLOB NOT NULL
)
"""
JOINT_ERRORS_TABLE = """
CREATE TABLE IF NOT EXISTS joint_errors (
    clip_id INTEGER PRIMARY KEY REFERENCES clips(id),
    data BLOB NOT NULL
)
"""
#: Of clips that earlier versions have built ``mocapdb index`` measures them.
FACETS_TABLE = """
CREATE TABLE IF NOT EXISTS facets (
    clip_id INTEGER PRIMARY KEY REFERENCES clips(id),
    root_speed_ms REAL NOT NULL,
    turn_deg REAL NOT NULL,
    contacts INTEGER NOT NULL
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
QUERIES_TABLE = """
CREATE TABLE IF NOT EXISTS saved_queries (
    name TEXT PRIMARY KEY,
    data TEXT NOT NULL
)
"""
DERIVED_TABLE = """
CREATE TABLE IF NOT EXISTS derived_files (
    file TEXT NOT NULL,
    sha256 TEXT PRIMARY KEY
)
"""
#: How the file of a clip looked when it was hashed: see `mocapdb.library.building.file_states`.
SOURCE_FILES_TABLE = """
CREATE TABLE IF NOT EXISTS source_files (
    clip_id INTEGER PRIMARY KEY REFERENCES clips(id),
    state TEXT,
    bones TEXT
)
"""
#: One row or none: see `mocapdb.library.index_pieces`.
SEARCH_INDEX_TABLE = """
CREATE TABLE IF NOT EXISTS search_index (
    id INTEGER PRIMARY KEY,
    fitted INTEGER NOT NULL,
    weights INTEGER NOT NULL,
    features INTEGER NOT NULL,
    dims INTEGER NOT NULL,
    space BLOB NOT NULL
)
"""
SEARCH_PIECES_TABLE = """
CREATE TABLE IF NOT EXISTS search_pieces (
    id INTEGER PRIMARY KEY,
    clips INTEGER NOT NULL,
    frames INTEGER NOT NULL,
    sketch INTEGER NOT NULL,
    clips_sha256 TEXT NOT NULL,
    sha256 TEXT NOT NULL
)
"""
#: Clips that the search index, the classes, and the last build's plan do not know as they are now.
CHANGED_TABLES = tuple(
    f"CREATE TABLE IF NOT EXISTS {name} (clip_id INTEGER PRIMARY KEY)"
    for name in ("unsearched", "unlearned", "unplanned")
)
SINCE_5 = (SOURCE_FILES_TABLE, SEARCH_INDEX_TABLE, SEARCH_PIECES_TABLE, *CHANGED_TABLES)
#: What the last build of a corpus went by: see `mocapdb.library.building.changed_files`.
PLANS_TABLE = """
CREATE TABLE IF NOT EXISTS plans (
    corpus TEXT PRIMARY KEY,
    inputs TEXT NOT NULL,
    unused TEXT NOT NULL
)
"""
PLANNED_FOLDERS_TABLE = """
CREATE TABLE IF NOT EXISTS planned_folders (
    id INTEGER PRIMARY KEY,
    corpus TEXT NOT NULL,
    folder TEXT NOT NULL,
    digest TEXT NOT NULL,
    clips INTEGER NOT NULL,
    UNIQUE (corpus, folder)
)
"""
#: What a build asks of clips, so that it need not read each: where they are from, what their files
#: hold, and what was assumed of them.
INDEXES = (
    "CREATE INDEX IF NOT EXISTS clips_source ON clips(corpus, source) WHERE deleted IS NULL",
    "CREATE INDEX IF NOT EXISTS clips_sha256 ON clips(source_sha256) WHERE deleted IS NULL",
    f"CREATE INDEX IF NOT EXISTS clips_assumed ON clips(corpus, {', '.join(ASSUMED)}, height_m, "
    "name) WHERE deleted IS NULL",
    f"CREATE INDEX IF NOT EXISTS clips_noted ON clips(corpus) WHERE {NOTED}",
)
SINCE_6 = (QUERIES_TABLE, PLANS_TABLE, PLANNED_FOLDERS_TABLE, *INDEXES)
COMPLETE = "complete INTEGER NOT NULL DEFAULT 0"
SHARD_COLUMNS = """
    id INTEGER PRIMARY KEY,
    file TEXT NOT NULL UNIQUE,
    size INTEGER NOT NULL,
    sha256 TEXT NOT NULL
"""
SCHEMA = f"""{BASES_TABLE};
{JOINT_ERRORS_TABLE};
{FACETS_TABLE};
{DERIVED_TABLE};
{CHECKSUMS_TABLE};
{";".join(SINCE_5)};
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
CREATE TABLE shards ({SHARD_COLUMNS}, {COMPLETE});
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
{";".join(SINCE_6)};
{CLASSES_VIEW};
"""
SEARCHED = ("name", "label", "description")
PLANNED = (
    "name", "stem", "label", "label_source", "description", "corpus", "source", "source_sha256",
    "settings", "fps", "fps_source", "subject", "subject_source", "columns", "deleted",
)  # fmt: skip
"""Columns of clips that a build's plan decides, or goes by."""


class CatalogueWriter(Catalogue):
    """The catalogue of one library, to read and to write; only the library's only writer may.

    Writing methods belong inside ``with catalogue.transaction():``.
    """

    writable = True

    def _prepare(self) -> None:
        super()._prepare()
        self._connection.execute("PRAGMA journal_mode = WAL")
        self._connection.execute("PRAGMA synchronous = FULL")
        self._connection.execute("PRAGMA recursive_triggers = ON")  # also of rows replaced
        if self.version < CATALOGUE_FORMAT:
            self._bring_up_to_date()
        keep_checksums(self._connection)
        _note_changes(self._connection)

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
            if self.version < 3:
                self._connection.execute(REVISIONS_TABLE)
                self._connection.execute(REVISIONS_INDEX)
            for table in (
                BASES_TABLE,
                JOINT_ERRORS_TABLE,
                FACETS_TABLE,
                DERIVED_TABLE,
                CHECKSUMS_TABLE,
                *SINCE_5,
                *SINCE_6,
            ):
                self._connection.execute(table)
            if self.version < 4:
                self._connection.execute(f"ALTER TABLE shards ADD COLUMN {COMPLETE}")
            if self.version < 5:
                for table in ("unsearched", "unlearned"):
                    self._connection.execute(f"INSERT INTO {table} SELECT clip_id FROM features")
            self._connection.execute(f"PRAGMA user_version = {CATALOGUE_FORMAT}")
            fill_checksums(self._connection)
        self.version = CATALOGUE_FORMAT

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Commit everything in the block, or nothing of it."""
        with sqlite_errors(self.path), self._connection:
            self._connection.execute("BEGIN IMMEDIATE")
            yield

    # -- rows ----------------------------------------------------------------------------------

    def insert(self, table: str, fields: Mapping[str, Any]) -> int:
        """Insert a row and return its number."""
        names = ", ".join(f'"{name}"' for name in fields)
        places = ", ".join("?" * len(fields))
        sql = f"INSERT INTO {table} ({names}) VALUES ({places})"
        return int(self._connection.execute(sql, [*fields.values()]).lastrowid or 0)

    def _put(self, table: str, rows: Iterable[Mapping[str, Any]], key: str) -> None:
        """Insert rows, or change those that there are, by their key."""
        for row in rows:
            names = ", ".join(f'"{name}"' for name in row)
            changed = ", ".join(f'"{name}" = excluded."{name}"' for name in row if name != key)
            self._connection.execute(
                f"INSERT INTO {table} ({names}) VALUES ({', '.join('?' * len(row))}) "
                f"ON CONFLICT ({key}) DO UPDATE SET {changed}",
                [*row.values()],
            )

    def _change(self, table: str, row_id: int, fields: Mapping[str, Any]) -> None:
        """Change columns of a row."""
        names = ", ".join(f'"{name}" = ?' for name in fields)
        values = [json.dumps(each) if isinstance(each, dict) else each for each in fields.values()]
        self._connection.execute(f"UPDATE {table} SET {names} WHERE id = ?", [*values, row_id])

    def finish_build(self, build_id: int, finished: str) -> None:
        """Note that a build has ended."""
        self._change("builds", build_id, {"finished": finished})

    def add_shard(self, folder: str, image: bytes) -> int:
        """Write a shard into a folder of them, note it and return its row."""
        row = write_shard(self.path.parent / folder, image)
        if folder == SHARDS_FOLDER:
            row["complete"] = 1
        return self.insert(SHARD_TABLES[folder], row)

    def column_kinds(self, table: str) -> dict[str, str]:
        """Return the columns of a table, and how each is declared."""
        return {row["name"]: row["type"] for row in self._rows(f"PRAGMA table_info({table})")}

    def remove_unused_shards(self) -> None:
        """Forget shards that no row refers to: those that were joined into others."""
        self._connection.execute(
            "DELETE FROM shards WHERE id NOT IN (SELECT shard_id FROM clips UNION "
            "SELECT shard_id FROM revisions WHERE shard_id IS NOT NULL)"
        )
        self._connection.execute(
            "DELETE FROM feature_shards "
            "WHERE id NOT IN (SELECT shard_id FROM features WHERE shard_id IS NOT NULL)"
        )

    def remove_shards(self, shards: Iterable[tuple[str, int]]) -> None:
        """Forget shards, by folder and row, that no live row refers to."""
        for folder, row in shards:
            self._connection.execute(f"DELETE FROM {SHARD_TABLES[folder]} WHERE id = ?", [row])

    def row(self, table: str, row_id: int) -> dict[str, Any]:
        """Return a row of a table as it is.

        Raises
        ------
        LibraryError
            If it is missing.
        """
        for row in self._rows(f"SELECT * FROM {table} WHERE id = ?", [row_id]):
            return dict(row)
        raise LibraryError(f"{self.path}: row {row_id} of {table} is missing.")

    def add_derived(self, file: str, sha256: str) -> None:
        """Note a checksum that a file made from others may have, beside any that it has now."""
        self._put("derived_files", [{"file": file, "sha256": sha256}], "sha256")

    def keep_derived(self, path: Path) -> None:
        """Note the checksum of a file that is made from others and no other; none if it is gone."""
        self._connection.execute("DELETE FROM derived_files WHERE file = ?", [path.name])
        if path.is_file():
            self.add_derived(path.name, file_sha256(path))

    def drop_derived(self, path: Path) -> None:
        """Remove a file that is made from others, if it is there."""
        if path.exists() or path.name in self.derived_files():
            path.unlink(missing_ok=True)
            with self.transaction():
                self.keep_derived(path)

    def keep_index(
        self, row: Mapping[str, Any] | None, pieces: Iterable[Sequence[Any]], n_kept: int = 0
    ) -> None:
        """Say what the search index is now: it knows every clip.

        Parameters
        ----------
        row : mapping, optional
            Of ``search_index``; None where there is no index any more.
        pieces : iterable
            Their rows.
        n_kept : int
            How many of the pieces that there are stay, before these.
        """
        if row is None or row["id"] not in {
            each["id"] for each in self._rows("SELECT id FROM search_index")
        }:
            self._connection.execute("DELETE FROM search_index")
            if row is not None:
                self.insert("search_index", row)
        self._connection.execute("DELETE FROM search_pieces WHERE id > ?", [n_kept])
        for number, piece in enumerate(pieces, start=n_kept + 1):
            self._connection.execute(
                "INSERT INTO search_pieces VALUES (?, ?, ?, ?, ?, ?)", [number, *piece]
            )
        self._connection.execute("DELETE FROM unsearched")

    def keep_learned(self, clip_ids: Iterable[int] | None = None) -> None:
        """Note that classes know these clips, or all, as they are now."""
        if clip_ids is None:
            self._connection.execute("DELETE FROM unlearned")
            return
        self._connection.executemany(
            "DELETE FROM unlearned WHERE clip_id = ?", ([clip_id] for clip_id in clip_ids)
        )

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
        renamed = {row: {"name": f"\0{row}"} for row, own in updates.items() if "name" in own}
        for clip_id, columns in [*renamed.items(), *updates.items()]:
            self._change("clips", clip_id, columns)

    def keep_seen(self, seen: Mapping[int, tuple[str | None, str | None]]) -> None:
        """Note how files looked when they were hashed, and their bones, by the clips' rows."""
        self._connection.executemany(
            "INSERT OR REPLACE INTO source_files VALUES (?, ?, ?)",
            ([clip_id, *own] for clip_id, own in seen.items()),
        )

    def keep_plan(
        self,
        corpus: str,
        inputs: str,
        unused: str,
        folders: Mapping[str, tuple[str, int] | None],
        *,
        only_these: bool,
    ) -> None:
        """Note what a build of a corpus went by, and that all its clips are as it planned them.

        Parameters
        ----------
        corpus : str
        inputs, unused : str
            See `Catalogue.plan`.
        folders : mapping of str to (str, int)
            Digest and number of clips of folders; None of those that are not as planned.
        only_these : bool
            Whether there are no others any more.
        """
        plan = {"corpus": corpus, "inputs": inputs, "unused": unused}
        if self.plan(corpus) != (inputs, unused):
            self._put("plans", [plan], "corpus")
        if only_these:
            self._connection.execute(
                "DELETE FROM planned_folders WHERE corpus = ? "
                "AND folder NOT IN (SELECT value FROM json_each(?))",
                [corpus, json.dumps([*folders])],
            )
        for folder, planned in folders.items():
            if planned is None:
                self._connection.execute(
                    "DELETE FROM planned_folders WHERE corpus = ? AND folder = ?", [corpus, folder]
                )
            elif self.planned_folder(corpus, folder) != planned:
                row = {"corpus": corpus, "folder": folder, "digest": planned[0]}
                self._put("planned_folders", [row | {"clips": planned[1]}], "corpus, folder")
        self._connection.execute(
            "DELETE FROM unplanned WHERE NOT EXISTS "
            "(SELECT 1 FROM clips WHERE id = clip_id AND deleted IS NULL AND corpus <> ?)",
            [corpus],
        )

    def add_basis(self, digest: bytes, label: str, layout: str, data: bytes) -> None:
        """Keep a basis of a class for clips whose channels have that layout."""
        row = {"digest": digest.hex(), "label": label, "layout": layout, "data": data}
        self._put("bases", [row], "digest")

    def add_joint_errors(self, clip_id: int, data: bytes) -> None:
        """Keep what the joints of a clip lost of their own motion (see `joint_losses`)."""
        self.insert("joint_errors", {"clip_id": clip_id, "data": data})

    def add_features(self, rows: Iterable[dict[str, Any]]) -> None:
        """Note where the features of clips are, or why they have none, in place of earlier notes.

        Rows have ``clip_id``, and ``shard_id`` and ``shard_row`` or ``problem``.
        """
        self._put("features", rows, "clip_id")

    def add_facets(self, facets: Mapping[int, Facets]) -> None:
        """Keep what was measured of clips, by the clips' rows, in place of what there was."""
        rows = ({"clip_id": clip_id, **asdict(own)} for clip_id, own in facets.items())
        self._put("facets", rows, "clip_id")

    def keep_query(self, name: str, data: str | None) -> None:
        """Keep a query under a name, in place of one of that name; None forgets it."""
        self._connection.execute("DELETE FROM saved_queries WHERE name = ?", [name])
        if data is not None:
            self._connection.execute("INSERT INTO saved_queries VALUES (?, ?)", [name, data])

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

    def move_features(self, places: Mapping[int, tuple[int, int]]) -> None:
        """Say where the features of clips are now: shard and row, by the clips' rows."""
        self._connection.executemany(
            "UPDATE features SET shard_id = ?, shard_row = ? WHERE clip_id = ?",
            ((*place, clip_id) for clip_id, place in places.items()),
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
            ("facets", "clip_id IN (SELECT id FROM clips WHERE deleted IS NOT NULL)"),
            ("source_files", "clip_id IN (SELECT id FROM clips WHERE deleted IS NOT NULL)"),
            ("features", "clip_id IN (SELECT id FROM clips WHERE deleted IS NOT NULL)"),
            (
                "revisions",
                "deleted IS NOT NULL OR "
                "clip_id IN (SELECT id FROM clips WHERE deleted IS NOT NULL)",
            ),
            ("clips", "deleted IS NOT NULL"),
            ("skeletons", "id NOT IN (SELECT skeleton_id FROM clips)"),
        ):
            self._connection.execute(f"DELETE FROM {table} WHERE {where}")
        self.remove_unused_shards()

    def shrink(self) -> None:
        """Give the file's free pages back to the disk."""
        with sqlite_errors(self.path):
            self._connection.execute("VACUUM")


def _note_changes(connection: sqlite3.Connection) -> None:
    """Have every change of this connection that matters to the index or the classes noted."""
    said = ("label", "subject", "stem")
    is_other = " OR ".join(f"NEW.{name} IS NOT OLD.{name}" for name in said)
    gone = "UPDATE OF deleted ON main.clips WHEN NEW.deleted IS NOT OLD.deleted", "NEW.id"
    changes = [
        # features that are only moved stay as they are: see `move_features`
        *(
            (f"{event} ON main.features", "NEW.clip_id")
            for event in ("INSERT", "UPDATE OF problem")
        ),
        ("DELETE ON main.features", "OLD.clip_id"),
        gone,
    ]
    relabelled = f"UPDATE OF {', '.join(said)} ON main.clips WHEN {is_other}", "NEW.id"
    planned = ", ".join(PLANNED)
    replanned = [
        ("INSERT ON main.clips", "NEW.id"),
        (f"UPDATE OF {planned} ON main.clips", "NEW.id"),
    ]
    for table, noted in (
        ("unsearched", changes),
        ("unlearned", [*changes, relabelled]),
        ("unplanned", replanned),
    ):
        for number, (event, clip) in enumerate(noted):
            # not INSERT OR IGNORE: what a statement that fires it does in a conflict wins
            connection.execute(
                f"CREATE TEMP TRIGGER IF NOT EXISTS {table}_{number} AFTER {event} "
                f"BEGIN INSERT INTO {table} SELECT {clip} "
                f"WHERE {clip} NOT IN (SELECT clip_id FROM {table}); END"
            )
    # a corpus whose clip another one has taken over is planned anew, whatever its folders look like
    connection.execute(
        "CREATE TEMP TRIGGER IF NOT EXISTS taken_over AFTER UPDATE OF corpus ON main.clips "
        "WHEN NEW.corpus IS NOT OLD.corpus BEGIN DELETE FROM plans WHERE corpus = OLD.corpus; END"
    )


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
        connection.execute(f"PRAGMA user_version = {CATALOGUE_FORMAT}")
        fill_checksums(connection)
        connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")


def _cannot_make(path: Path, problem: OSError) -> LibraryError:
    return LibraryError(f"{path.parent}: cannot make the library ({problem.strerror}).")
