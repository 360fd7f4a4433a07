"""The catalogue: the SQLite file that says what a library holds. Its commit is *the* commit."""

from __future__ import annotations

import json
import re
import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mocapdb.errors import LibraryError, SkeletonError, UnknownClipError
from mocapdb.motion.skeleton import Skeleton

__all__ = [
    "CATALOGUE_FILE",
    "CATALOGUE_FORMAT",
    "FEATURES_FOLDER",
    "MODELS_FILE",
    "SEARCH_FILE",
    "Catalogue",
    "ClipRecord",
]

CATALOGUE_FILE = "catalogue.db"
FEATURES_FOLDER, SEARCH_FILE, MODELS_FILE = "features", "search.h5", "models.h5"
CATALOGUE_FORMAT = 1
APPLICATION_ID = 0x6D6F6361  # "moca"

BASES_TABLE = """
CREATE TABLE bases (
    digest TEXT PRIMARY KEY,
    label TEXT NOT NULL,
    layout TEXT NOT NULL,
    data BLOB NOT NULL
)
"""
SCHEMA = f"""{BASES_TABLE};
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
CREATE TABLE shards (
    id INTEGER PRIMARY KEY,
    file TEXT NOT NULL UNIQUE,
    size INTEGER NOT NULL,
    sha256 TEXT NOT NULL
);
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
    deleted TEXT
);
CREATE TABLE feature_shards (
    id INTEGER PRIMARY KEY,
    file TEXT NOT NULL UNIQUE,
    size INTEGER NOT NULL,
    sha256 TEXT NOT NULL
);
CREATE TABLE features (
    clip_id INTEGER PRIMARY KEY REFERENCES clips(id),
    shard_id INTEGER REFERENCES feature_shards(id),
    shard_row INTEGER,
    problem TEXT
);
CREATE UNIQUE INDEX clips_live_name ON clips(name) WHERE deleted IS NULL;
CREATE INDEX clips_stem ON clips(stem);
CREATE INDEX clips_label ON clips(label);
CREATE VIEW classes AS
    SELECT label AS name, count(*) AS clips, sum(frames) AS frames
    FROM clips WHERE deleted IS NULL AND label IS NOT NULL GROUP BY label;
"""
SEARCHED = ("name", "label", "description")
CANNOT_WRITE = {
    sqlite3.SQLITE_CANTOPEN,
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_IOERR,
    sqlite3.SQLITE_READONLY,
}


@dataclass(frozen=True)
class ClipRecord:
    """One row of the catalogue: all there is to know of a clip without decoding it.

    Attributes
    ----------
    name, stem : str
        The clip's unique name, and its file's stem.
    label, description : str
        Class and free text from the labels; label may be None. `label_source` is ``"corpus"``, or
        ``"classify"`` where ``mocapdb classify --apply`` gave it.
    frames, fps
        Length in frames and rate in frames per second; `fps_source` says who stated the rate.
    source, source_bytes, source_sha256
        File relative to the corpus, its size, and the hash of its bytes and its skeleton's.
    codec : str
        What the codec chose.
    payload_bytes : int
        Size of the compressed clip.
    skinned_error : float, skeleton units
    error_mean_mm, error_p95_mm, error_max_mm : float
        Distances of the skin's vertices after decoding.
    """

    id: int
    name: str
    stem: str
    label: str | None
    label_source: str
    description: str
    skeleton_id: int
    frames: int
    fps: float
    fps_source: str
    frame_time_text: str
    provenance: tuple[str, ...]
    corpus: str
    source: str
    source_bytes: int
    source_sha256: str
    settings: str
    codec: str
    payload_bytes: int
    skinned_error: float
    error_mean_mm: float
    error_p95_mm: float
    error_max_mm: float
    shard_id: int
    shard_row: int
    n_channels: int

    @property
    def duration_s(self) -> float:
        """Length in seconds."""
        return self.frames / self.fps

    @property
    def bytes_per_frame(self) -> float:
        """Payload bytes a frame."""
        return self.payload_bytes / self.frames


class Catalogue:
    """The catalogue of one library.

    Use `create` or `open`. Writing methods belong inside ``with catalogue.transaction():``.
    """

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self._connection = connection
        self._connection.row_factory = sqlite3.Row
        self._connection.execute("PRAGMA recursive_triggers = on")  # a replaced row is deleted

    # -- opening -------------------------------------------------------------------------------

    @classmethod
    def create(cls, folder: Path) -> Catalogue:
        """Make an empty catalogue in a library's folder, whole or not at all, and open it."""
        from sqlite_utils import Database

        path = folder / CATALOGUE_FILE
        unfinished = path.with_name(path.name + ".partial")
        unfinished.unlink(missing_ok=True)
        try:
            with _sqlite_errors(path), closing(sqlite3.connect(unfinished)) as connection:
                connection.execute("PRAGMA journal_mode = MEMORY")  # a file less to leave behind
                connection.executescript(SCHEMA)
                clips: Any = Database(connection)["clips"]
                clips.enable_fts(SEARCHED, create_triggers=True)
                connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
                connection.execute(f"PRAGMA user_version = {CATALOGUE_FORMAT}")
                connection.commit()
            unfinished.replace(path)
        finally:
            unfinished.unlink(missing_ok=True)
        return cls.open(folder, writable=True)

    @classmethod
    def open(cls, folder: Path, *, writable: bool = False) -> Catalogue:
        """Open the catalogue in a library's folder.

        Raises
        ------
        LibraryError
            If there is none, it is something else, or its format is newer than ours.
        """
        path = folder / CATALOGUE_FILE
        if not path.is_file():
            raise LibraryError(
                f"{folder}: not a library (no {CATALOGUE_FILE} in it). "
                "Make one with: mocapdb build CORPUS -o NAME.mocapdb"
            )
        with _sqlite_errors(path):
            connection = _connect(path, writable)
            try:
                (application,) = connection.execute("PRAGMA application_id").fetchone()
                (version,) = connection.execute("PRAGMA user_version").fetchone()
                if application != APPLICATION_ID:
                    raise LibraryError(f"{path}: a SQLite file, but not a library's catalogue.")
                if version > CATALOGUE_FORMAT:
                    raise LibraryError(
                        f"{path}: expected library format {CATALOGUE_FORMAT} or older, but got "
                        f"{version}. Install a newer mocapdb."
                    )
                if writable:
                    connection.execute("PRAGMA journal_mode = WAL")
                    connection.execute("PRAGMA synchronous = FULL")
            except BaseException:
                connection.close()
                raise
        return cls(path, connection)

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Commit everything in the block, or nothing of it."""
        with _sqlite_errors(self.path), self._connection:
            self._connection.execute("BEGIN IMMEDIATE")
            yield

    # -- reading -------------------------------------------------------------------------------

    def records(
        self, *, label: str | None = None, search: str | None = None
    ) -> Iterator[ClipRecord]:
        """Yield the live clips by name; of one class, or that match a full-text search."""
        where, values = _fitting(label, search)
        yield from self._select(f"{where} ORDER BY clips.name", values)

    def ids(self, *, label: str | None = None, search: str | None = None) -> Iterator[int]:
        """Yield the rows of the live clips of one class, or that match a full-text search."""
        where, values = _fitting(label, search)
        for row in self._rows(f"SELECT clips.id AS id FROM clips WHERE {where}", values):
            yield int(row["id"])

    def stems(self) -> dict[int, str]:
        """Return the stems of the live clips by row."""
        rows = self._rows("SELECT id, stem FROM clips WHERE deleted IS NULL")
        return {row["id"]: row["stem"] for row in rows}

    def n_clips(self) -> int:
        """Return the number of live clips."""
        (row,) = self._rows("SELECT count(*) AS n FROM clips WHERE deleted IS NULL")
        return int(row["n"])

    def record(self, clip_id: int) -> ClipRecord:
        """Return a live clip by its row."""
        for record in self._select("clips.id = ? AND deleted IS NULL", [clip_id]):
            return record
        raise LibraryError(f"{self.path}: clip {clip_id} is missing.")

    def resolve(self, name: str) -> ClipRecord:
        """Return the clip of that name, or the only one with that stem.

        Raises
        ------
        UnknownClipError
            If there is none, or the stem fits several; the message lists what would be understood.
        """
        for record in self._select("clips.name = ? AND deleted IS NULL", [name]):
            return record
        fitting = list(self._select("stem = ? AND deleted IS NULL ORDER BY clips.name", [name]))
        if len(fitting) == 1:
            return fitting[0]
        if fitting:
            names = [record.name for record in fitting]
            raise UnknownClipError(
                f"{self.path.parent}: {name!r} is ambiguous. Use one of: {', '.join(names)}.", names
            )
        close = self._names_like(name)
        hint = f" Did you mean: {', '.join(close)}?" if close else " See: mocapdb ls LIB"
        raise UnknownClipError(f"{self.path.parent}: no clip is named {name!r}.{hint}", close)

    def skeleton(self, skeleton_id: int) -> Skeleton:
        """Return a skeleton by its row."""
        for row in self._rows("SELECT json FROM skeletons WHERE id = ?", [skeleton_id]):
            try:
                return Skeleton.from_dict(json.loads(row["json"]))
            except (SkeletonError, ValueError) as problem:
                raise LibraryError(
                    f"{self.path}: skeleton {skeleton_id} is damaged: {problem}"
                ) from None
        raise LibraryError(f"{self.path}: skeleton {skeleton_id} is missing.")

    def classes(self) -> dict[str, int]:
        """Return the number of clips of each class."""
        rows = self._rows("SELECT name, clips FROM classes ORDER BY name")
        return {row["name"]: row["clips"] for row in rows}

    def shards(self) -> list[sqlite3.Row]:
        """Return (id, file, size, sha256) of every committed shard."""
        return list(self._rows("SELECT id, file, size, sha256 FROM shards ORDER BY id"))

    def shard_files(self) -> set[str]:
        """Return the names of the files that the commits know of."""
        return {row["file"] for row in self.shards()}

    def shard_file(self, shard_id: int) -> str:
        """Return the file name of a shard."""
        for row in self._rows("SELECT file FROM shards WHERE id = ?", [shard_id]):
            return str(row["file"])
        raise LibraryError(f"{self.path}: shard {shard_id} is missing.")

    def feature_shards(self) -> list[sqlite3.Row]:
        """Return (id, file, size, sha256) of every committed feature shard."""
        return list(self._rows("SELECT id, file, size, sha256 FROM feature_shards ORDER BY id"))

    def feature_files(self) -> set[str]:
        """Return the names of the feature shards that the commits know of."""
        return {row["file"] for row in self.feature_shards()}

    def feature_places(self) -> list[tuple[int, str, int]]:
        """Return (clip row, feature shard's file, row in it) of every live clip with features."""
        rows = self._rows(
            "SELECT clip_id, file, features.shard_row AS place FROM features "
            "JOIN feature_shards ON feature_shards.id = features.shard_id "
            "JOIN clips ON clips.id = clip_id WHERE deleted IS NULL ORDER BY clip_id"
        )
        return [(row["clip_id"], row["file"], row["place"]) for row in rows]

    def feature_digests(self) -> list[str]:
        """Return for each of `feature_places` what tells its features from any others."""
        rows = self._rows(
            "SELECT sha256, features.shard_row AS place FROM features "
            "JOIN feature_shards ON feature_shards.id = features.shard_id "
            "JOIN clips ON clips.id = clip_id WHERE deleted IS NULL ORDER BY clip_id"
        )
        return [f"{row['sha256']}/{row['place']}" for row in rows]

    def feature_files_with_buried(self) -> list[str]:
        """Return the names of the feature shards that hold deleted clips."""
        rows = self._rows(
            "SELECT DISTINCT file FROM features "
            "JOIN feature_shards ON feature_shards.id = features.shard_id "
            "JOIN clips ON clips.id = clip_id WHERE deleted IS NOT NULL ORDER BY file"
        )
        return [row["file"] for row in rows]

    def feature_problems(self) -> dict[str, str]:
        """Return the live clips that can have no features, by name, and why."""
        rows = self._rows(
            "SELECT name, problem FROM features JOIN clips ON clips.id = clip_id "
            "WHERE deleted IS NULL AND problem IS NOT NULL ORDER BY name"
        )
        return {row["name"]: row["problem"] for row in rows}

    def without_features(self) -> list[ClipRecord]:
        """Return the live clips for which nobody has tried to compute features."""
        missing = "deleted IS NULL AND clips.id NOT IN (SELECT clip_id FROM features)"
        return list(self._select(f"{missing} ORDER BY clips.id", []))

    def bases(self) -> dict[bytes, bytes]:
        """Return the bases that clips refer to, by their digests."""
        return {bytes.fromhex(row["digest"]): row["data"] for row in self._bases()}

    def class_bases(self) -> dict[tuple[str, str], bytes]:
        """Return the basis of each class, by label and layout of channels."""
        return {(row["label"], row["layout"]): row["data"] for row in self._bases()}

    def _bases(self) -> list[sqlite3.Row]:
        if not list(self._rows("SELECT 1 FROM sqlite_master WHERE name = 'bases'")):
            return []  # a library from before there were any
        return list(self._rows("SELECT digest, label, layout, data FROM bases"))

    def shards_with_buried(self) -> set[int]:
        """Return the rows of the shards that hold bytes of deleted clips."""
        rows = self._rows("SELECT DISTINCT shard_id FROM clips WHERE deleted IS NOT NULL")
        return {row["shard_id"] for row in rows}

    def check(self) -> str | None:
        """Return what SQLite finds wrong with the file, or None."""
        (answer,) = next(iter(self._rows("PRAGMA quick_check(1)")))
        if answer != "ok":
            return str(answer)
        for table, row, missing, _ in self._rows("PRAGMA foreign_key_check"):
            return f"row {row} of {table} refers to a row that is missing from {missing}"
        return None

    # -- writing -------------------------------------------------------------------------------

    def add_skeleton(self, skeleton: Skeleton) -> int:
        """Keep a skeleton, once, and return its row."""
        for row in self._rows("SELECT id FROM skeletons WHERE digest = ?", [skeleton.digest]):
            return int(row["id"])
        return self._insert(
            "skeletons",
            {
                "digest": skeleton.digest,
                "name": skeleton.name,
                "channels": skeleton.n_channels,
                "json": json.dumps(skeleton.to_dict()),
            },
        )

    def add_build(self, corpus: str, settings: str, started: str) -> int:
        """Note that a build has begun and return its row."""
        return self._insert("builds", {"corpus": corpus, "settings": settings, "started": started})

    def finish_build(self, build_id: int, finished: str) -> None:
        """Note that a build has ended."""
        self._execute("UPDATE builds SET finished = ? WHERE id = ?", [finished, build_id])

    def add_shard(self, file: str, size: int, sha256: str) -> int:
        """Note a shard and return its row."""
        return self._insert("shards", {"file": file, "size": size, "sha256": sha256})

    def add_clip(self, fields: dict[str, Any]) -> int:
        """Add a clip; its fields are the table's columns."""
        return self._insert("clips", fields)

    def add_basis(self, digest: bytes, label: str, layout: str, data: bytes) -> None:
        """Keep a basis of a class for clips whose channels have that layout."""
        self._execute(
            BASES_TABLE.replace("TABLE", "TABLE IF NOT EXISTS"),  # for a library from before
            [],
        )
        self._execute(
            "INSERT OR IGNORE INTO bases (digest, label, layout, data) VALUES (?, ?, ?, ?)",
            [digest.hex(), label, layout, data],
        )

    def add_feature_shard(self, file: str, size: int, sha256: str) -> int:
        """Note a feature shard and return its row."""
        return self._insert("feature_shards", {"file": file, "size": size, "sha256": sha256})

    def add_features(
        self, clip_id: int, shard_id: int | None, shard_row: int | None, problem: str | None
    ) -> None:
        """Note where the features of a clip are, or why it has none; replaces what was noted."""
        self._execute(
            "INSERT OR REPLACE INTO features (clip_id, shard_id, shard_row, problem) "
            "VALUES (?, ?, ?, ?)",
            [clip_id, shard_id, shard_row, problem],
        )

    def bury(self, clip_ids: Iterable[int], when: str) -> None:
        """Mark clips as deleted; their bytes stay until the library is compacted."""
        rows = [(when, clip_id) for clip_id in clip_ids]
        self._connection.executemany("UPDATE clips SET deleted = ? WHERE id = ?", rows)

    def update_clips(self, updates: Sequence[tuple[int, dict[str, Any]]]) -> None:
        """Change columns of clips. Names change in two steps, so that two clips may swap."""
        for clip_id, columns in updates:
            if "name" in columns:
                self._execute("UPDATE clips SET name = ? WHERE id = ?", [f"\0{clip_id}", clip_id])
        for clip_id, columns in updates:
            assignments = ", ".join(f"{column} = ?" for column in columns)
            self._execute(
                f"UPDATE clips SET {assignments} WHERE id = ?", [*columns.values(), clip_id]
            )

    def move(self, clip_id: int, shard_id: int, shard_row: int) -> None:
        """Point a clip to another place in the shards."""
        self._execute(
            "UPDATE clips SET shard_id = ?, shard_row = ? WHERE id = ?",
            [shard_id, shard_row, clip_id],
        )

    def forget_buried(self) -> None:
        """Remove deleted clips for good, and shards and skeletons that nothing refers to."""
        self._execute(
            "DELETE FROM features WHERE clip_id IN "
            "(SELECT id FROM clips WHERE deleted IS NOT NULL)",
            [],
        )
        self._execute(
            "DELETE FROM feature_shards WHERE id NOT IN "
            "(SELECT shard_id FROM features WHERE shard_id IS NOT NULL)",
            [],
        )
        self._execute("DELETE FROM clips WHERE deleted IS NOT NULL", [])
        self._execute("DELETE FROM shards WHERE id NOT IN (SELECT shard_id FROM clips)", [])
        self._execute("DELETE FROM skeletons WHERE id NOT IN (SELECT skeleton_id FROM clips)", [])

    def shrink(self) -> None:
        """Give the file's free pages back to the disk."""
        with _sqlite_errors(self.path):
            self._connection.execute("VACUUM")

    # -- SQL -----------------------------------------------------------------------------------

    def _select(self, where: str, values: Sequence[Any]) -> Iterator[ClipRecord]:
        columns = [f"clips.{name}" for name in ClipRecord.__dataclass_fields__]
        columns[columns.index("clips.n_channels")] = "skeletons.channels AS n_channels"
        for row in self._rows(
            f"SELECT {', '.join(columns)} FROM clips "
            f"JOIN skeletons ON skeletons.id = clips.skeleton_id WHERE {where}",
            values,
        ):
            fields = dict(row)
            try:
                fields["provenance"] = tuple(json.loads(fields["provenance"]))
            except ValueError:
                raise LibraryError(
                    f"{self.path}: the provenance of {fields['name']!r} is damaged. Restore a copy "
                    "of the library, or build it anew in another folder."
                ) from None
            yield ClipRecord(**fields)

    def _rows(self, sql: str, values: Sequence[Any] = ()) -> Iterator[sqlite3.Row]:
        with _sqlite_errors(self.path):
            yield from self._connection.execute(sql, values)

    def _names_like(self, name: str) -> list[str]:
        """Return up to three names of clips that are, or whose stems are, close to a name."""
        import difflib

        names: dict[str, list[str]] = {}  # by all that they are called
        for row in self._rows("SELECT name, stem FROM clips WHERE deleted IS NULL ORDER BY name"):
            for spelling in {row["name"], row["stem"]}:
                names.setdefault(spelling, []).append(row["name"])
        close = difflib.get_close_matches(name, names, n=3, cutoff=0.5)
        return list(dict.fromkeys(full for spelling in close for full in names[spelling]))[:3]

    def _execute(self, sql: str, values: Sequence[Any]) -> None:
        self._connection.execute(sql, values)

    def _insert(self, table: str, fields: dict[str, Any]) -> int:
        marks = ", ".join("?" * len(fields))
        cursor = self._connection.execute(
            f"INSERT INTO {table} ({', '.join(fields)}) VALUES ({marks})", list(fields.values())
        )
        return int(cursor.lastrowid or 0)


def _fitting(label: str | None, search: str | None) -> tuple[str, list[Any]]:
    """Return the condition, and its values, for live clips of a class and of a text search."""
    where, values = ["deleted IS NULL"], []
    if label is not None:
        where.append("label = ?")
        values.append(label)
    # quoted, so that a name such as 07_01 or a dash is text and not query syntax
    words = [f'"{word}"*' for word in re.sub(r'["\0]', " ", search or "").split()]
    if words:
        where.append("clips.id IN (SELECT rowid FROM clips_fts WHERE clips_fts MATCH ?)")
        values.append(" ".join(words))
    return " AND ".join(where), values


def _connect(path: Path, writable: bool) -> sqlite3.Connection:
    """Open the file; where SQLite cannot keep its log beside it, as it stands."""
    uri = path.resolve().as_uri()
    # a reader too opens it to write if it may: only so does SQLite clear its log away at the end
    connection = sqlite3.connect(f"{uri}?mode=rw", uri=True, timeout=10.0, isolation_level=None)
    try:
        connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
        if not writable:
            connection.execute("PRAGMA query_only = ON")
        return connection
    except sqlite3.Error as problem:
        connection.close()
        log = path.with_name(path.name + "-wal")
        complete = not log.exists() or log.stat().st_size == 0
        if writable or not complete or _primary_code(problem) not in CANNOT_WRITE:
            raise
    return sqlite3.connect(f"{uri}?immutable=1", uri=True, isolation_level=None)


def _primary_code(problem: sqlite3.Error) -> int:
    """Return SQLite's own number for a kind of error; 0 where Python raised it."""
    return getattr(problem, "sqlite_errorcode", 0) & 0xFF


@contextmanager
def _sqlite_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except UnicodeDecodeError:  # in the names of tables
        raise LibraryError(f"{path}: the file is damaged. Restore a copy of the library.") from None
    except sqlite3.Error as problem:
        advice = ""
        if _primary_code(problem) in {sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR}:
            advice = " Check the disk, and free space if it is full: what is committed is safe."
        elif _primary_code(problem) in {sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_CORRUPT}:
            advice = " Restore a copy of the library, or build it anew in another folder."
        raise LibraryError(f"{path}: {problem}.{advice}") from None
