"""The catalogue: the SQLite file that says what a library holds, and how it is read."""

from __future__ import annotations

import json
import re
import sqlite3
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Self

from mocapdb.errors import LibraryError, SkeletonError, UnknownClipError
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.database import (
    APPLICATION_ID,
    CATALOGUE_FORMAT,
    SINCE_2,
    connect,
    sqlite_errors,
)
from mocapdb.library.hdf5 import expect_format
from mocapdb.library.layout import CATALOGUE_FILE, FEATURES_FOLDER, SHARDS_FOLDER
from mocapdb.library.naming import subject_of
from mocapdb.library.revision import Revision
from mocapdb.library.tuning import CLOSE_NAMES, CLOSENESS
from mocapdb.motion.skeleton import Skeleton

__all__ = ["SHARD_TABLES", "Catalogue"]

SHARD_TABLES = {SHARDS_FOLDER: "shards", FEATURES_FOLDER: "feature_shards"}
"""What says which files belong to a folder of shards."""


class Catalogue:
    """The catalogue of one library, to read; `CatalogueWriter` also writes.

    Parameters
    ----------
    folder : Path
        The library's.

    Attributes
    ----------
    version : int
        Of its format: the first lacks what was assumed of clips, the second revisions. Whoever
        writes to it next adds them.

    Raises
    ------
    LibraryError
        If there is no catalogue, it is something else, or its format is newer than ours.
    """

    writable = False

    def __init__(self, folder: Path) -> None:
        self.path = folder / CATALOGUE_FILE
        if not self.path.is_file():
            raise LibraryError(
                f"{folder}: not a library (no {CATALOGUE_FILE} in it). "
                "Make one with: mocapdb build CORPUS -o NAME.mocapdb"
            )
        with sqlite_errors(self.path):
            self._connection = connect(self.path, self.writable)
            try:
                self._expect_our_format()
                self._prepare()
            except BaseException:
                self._connection.close()
                raise

    def _expect_our_format(self) -> None:
        (application,) = self._connection.execute("PRAGMA application_id").fetchone()
        (version,) = self._connection.execute("PRAGMA user_version").fetchone()
        if application != APPLICATION_ID:
            raise LibraryError(f"{self.path}: a SQLite file, but not a library's catalogue.")
        expect_format(self.path, "library format", version, CATALOGUE_FORMAT)
        self.version = int(version)

    def _prepare(self) -> None:
        """Set up the connection, once the file is known to be a catalogue."""
        self._connection.row_factory = sqlite3.Row

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # -- reading -------------------------------------------------------------------------------

    def records(
        self,
        *,
        label: str | None = None,
        search: str | None = None,
        where: Mapping[str, str] | None = None,
    ) -> Iterator[ClipRecord]:
        """Yield the live clips by name; of one class, that match a text search, of such columns.

        Raises
        ------
        LibraryError
            If no clip has one of the further columns that `where` names.
        """
        condition, values = self._fitting(label, search, where)
        yield from self._select(f"{condition} ORDER BY clips.name", values)

    def ids(
        self,
        *,
        label: str | None = None,
        search: str | None = None,
        where: Mapping[str, str] | None = None,
    ) -> Iterator[int]:
        """Yield the rows of the live clips that `records` yields."""
        condition, values = self._fitting(label, search, where)
        for row in self._rows(f"SELECT clips.id AS id FROM clips WHERE {condition}", values):
            yield int(row["id"])

    def subjects(self) -> dict[int, str]:
        """Return who performs the live clips, by row: as was said, else as the stem tells."""
        said = "subject" if self.version >= 2 else "NULL"
        rows = self._rows(f"SELECT id, stem, {said} AS said FROM clips WHERE deleted IS NULL")
        return {row["id"]: row["said"] or subject_of(row["stem"]) for row in rows}

    def column_names(self) -> list[str]:
        """Return the names of the further columns that live clips have, sorted."""
        if self.version < 2:
            return []
        rows = self._rows(
            "SELECT DISTINCT each.key AS name FROM clips, json_each(clips.columns) AS each "
            "WHERE deleted IS NULL ORDER BY each.key"
        )
        return [row["name"] for row in rows]

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
            return self._as_asked(record, name)
        fitting = list(self._select("stem = ? AND deleted IS NULL ORDER BY clips.name", [name]))
        if len(fitting) == 1:
            return self._as_asked(fitting[0], name)
        if fitting:
            names = [record.name for record in fitting]
            raise UnknownClipError(
                f"{self.path.parent}: {name!r} is ambiguous. Use one of: {', '.join(names)}.", names
            )
        close = self._names_like(name)
        hint = f" Did you mean: {', '.join(close)}?" if close else " See: mocapdb ls LIB"
        raise UnknownClipError(f"{self.path.parent}: no clip is named {name!r}.{hint}", close)

    def _as_asked(self, record: ClipRecord, name: str) -> ClipRecord:
        """Return a row, once it is known to be what an index was asked for."""
        if name not in (record.name, record.stem):
            raise LibraryError(
                f"{self.path}: damaged: asked for {name!r}, its index leads to {record.name!r}. "
                "Restore a copy of the library, or build it anew in another folder."
            )
        return record

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

    def shards(self, folder: str) -> list[sqlite3.Row]:
        """Return (id, file, size, sha256) of every committed file of a folder of shards."""
        table = SHARD_TABLES[folder]
        return list(self._rows(f"SELECT id, file, size, sha256 FROM {table} ORDER BY id"))

    def stray_files(self) -> list[Path]:
        """Return the files among the shards that no commit knows of."""
        strays = []
        for folder in SHARD_TABLES:
            known = {row["file"] for row in self.shards(folder)}
            here = self.path.parent / folder
            files = sorted(here.iterdir()) if here.is_dir() else []
            strays += [path for path in files if path.name not in known]
        return strays

    def shard_file(self, shard_id: int) -> str:
        """Return the file name of a shard."""
        for row in self._rows("SELECT file FROM shards WHERE id = ?", [shard_id]):
            return str(row["file"])
        raise LibraryError(f"{self.path}: shard {shard_id} is missing.")

    def feature_places(self) -> list[tuple[int, str, int]]:
        """Return (clip row, feature shard's file, row in it) of every live clip with features."""
        rows = self._features("deleted IS NULL")
        return [(row["clip_id"], row["file"], row["place"]) for row in rows]

    def feature_digests(self) -> list[str]:
        """Return for each of `feature_places` what tells its features from any others."""
        return [f"{row['sha256']}/{row['place']}" for row in self._features("deleted IS NULL")]

    def feature_files(self) -> dict[str, int]:
        """Return the names of the feature shards, and how many live clips have features there."""
        live = Counter(file for _, file, _ in self.feature_places())
        return {row["file"]: live[row["file"]] for row in self.shards(FEATURES_FOLDER)}

    def _features(self, which: str) -> Iterator[sqlite3.Row]:
        return self._rows(
            "SELECT clip_id, file, sha256, features.shard_row AS place FROM features "
            "JOIN feature_shards ON feature_shards.id = features.shard_id "
            f"JOIN clips ON clips.id = clip_id WHERE {which} ORDER BY clip_id"
        )

    def is_indexed(self) -> bool:
        """Say whether features of any clip were computed, or tried in vain."""
        return bool(list(self._rows("SELECT 1 FROM features LIMIT 1")))

    def feature_problems(self) -> dict[str, str]:
        """Return the live clips that can have no features, by name, and why."""
        rows = self._rows(
            "SELECT name, problem FROM features JOIN clips ON clips.id = clip_id "
            "WHERE deleted IS NULL AND problem IS NOT NULL ORDER BY name"
        )
        return {row["name"]: row["problem"] for row in rows}

    def unsearchable(self) -> dict[str, str]:
        """Return the live clips that no query looks at, by name, and why."""
        rows = self._rows(
            "SELECT name, problem FROM clips LEFT JOIN features ON clips.id = clip_id "
            "WHERE deleted IS NULL AND features.shard_id IS NULL ORDER BY name"
        )
        missing = f"It is not in the index yet. Run: mocapdb index {self.path.parent}"
        return {row["name"]: row["problem"] or missing for row in rows}

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

    def joint_errors(self, clip_id: int | None = None) -> dict[int, bytes]:
        """Return what the joints of clips lost (see `joint_losses`), by the clips' rows.

        Of one clip or of all. Clips that an earlier version built have none.
        """
        if not list(self._rows("SELECT 1 FROM sqlite_master WHERE name = 'joint_errors'")):
            return {}
        rows = self._rows(
            "SELECT clip_id, data FROM joint_errors WHERE ?1 IS NULL OR clip_id = ?1", [clip_id]
        )
        return {int(row["clip_id"]): bytes(row["data"]) for row in rows}

    def revision(self, clip_id: int) -> Revision | None:
        """Return the revision of a clip by the clip's row, if it has one."""
        return next(iter(self._revisions("revisions.clip_id = ?", [clip_id])), None)

    def revisions(self) -> dict[int, Revision]:
        """Return the revisions of the live clips, by the clips' rows."""
        return {revision.clip_id: revision for revision in self._revisions("1")}

    def _revisions(self, where: str, values: Sequence[Any] = ()) -> Iterator[Revision]:
        if self.version < 3:
            return
        columns = ", ".join(f"revisions.{name}" for name in Revision.__dataclass_fields__)
        for row in self._rows(
            f"SELECT {columns} FROM revisions JOIN clips ON clips.id = revisions.clip_id WHERE "
            f"{where} AND revisions.deleted IS NULL AND clips.deleted IS NULL ORDER BY clip_id",
            values,
        ):
            fields = dict(row)
            try:
                fields["spans"] = tuple(json.loads(fields["spans"]))
                fields["settings"] = dict(json.loads(fields["settings"]))
            except (TypeError, ValueError):
                raise LibraryError(
                    f"{self.path}: the revision of clip {fields['clip_id']} is damaged. Restore a "
                    f"copy of the library, or run: mocapdb clean {self.path.parent} --undo"
                ) from None
            yield Revision(**fields)

    def shards_with_deleted(self) -> set[int]:
        """Return the rows of the shards that hold bytes of deleted clips or revisions."""
        tables = ["clips", *["revisions"] * (self.version >= 3)]
        return {
            row["shard_id"]
            for table in tables
            for row in self._rows(
                f"SELECT DISTINCT shard_id FROM {table} "
                "WHERE deleted IS NOT NULL AND shard_id IS NOT NULL"
            )
        }

    def check(self) -> str | None:
        """Return what SQLite finds wrong with the file, or None."""
        (answer,) = next(iter(self._rows("PRAGMA integrity_check(1)")))  # indices too
        if answer != "ok":
            return str(answer)
        for table, row, missing, _ in self._rows("PRAGMA foreign_key_check"):
            return f"row {row} of {table} refers to a row that is missing from {missing}"
        return None

    # -- SQL -----------------------------------------------------------------------------------

    def _select(self, where: str, values: Sequence[Any]) -> Iterator[ClipRecord]:
        columns = [f"clips.{name}" for name in ClipRecord.__dataclass_fields__]
        columns[columns.index("clips.n_channels")] = "skeletons.channels AS n_channels"
        if self.version < 2:
            for name, (_, instead) in SINCE_2.items():
                columns[columns.index(f"clips.{name}")] = f"{instead} AS {name}"
        for row in self._rows(
            f"SELECT {', '.join(columns)} FROM clips "
            f"JOIN skeletons ON skeletons.id = clips.skeleton_id WHERE {where}",
            values,
        ):
            fields = dict(row)
            try:
                fields["provenance"] = tuple(json.loads(fields["provenance"]))
                fields["columns"] = dict(json.loads(fields["columns"]))
            except (TypeError, ValueError):
                raise LibraryError(
                    f"{self.path}: the provenance of {fields['name']!r} is damaged. Restore a copy "
                    "of the library, or build it anew in another folder."
                ) from None
            yield ClipRecord(**fields)

    def _fitting(
        self, label: str | None, search: str | None, where: Mapping[str, str] | None
    ) -> tuple[str, list[Any]]:
        """Return the condition, and its values, for live clips of a class, words and columns."""
        conditions, values = ["deleted IS NULL"], []
        if label is not None:
            conditions.append("label = ?")
            values.append(label)
        # quoted, so that a name such as 07_01 or a dash is text and not query syntax
        words = [f'"{word}"*' for word in re.sub(r'["\0]', " ", search or "").split()]
        if words:
            conditions.append("clips.id IN (SELECT rowid FROM clips_fts WHERE clips_fts MATCH ?)")
            values.append(" ".join(words))
        if where:
            self.expect_columns(where)
        for name, value in (where or {}).items():
            if name == "subject":
                subjects = self.subjects().items()
                fitting = ", ".join(str(row) for row, subject in subjects if subject == value)
                conditions.append(f"clips.id IN ({fitting})")
                continue
            conditions.append(
                "EXISTS (SELECT 1 FROM json_each(clips.columns) AS each "
                "WHERE each.key = ? AND each.value = ?)"
            )
            values += [name, value]
        return " AND ".join(conditions), values

    def expect_columns(self, names: Iterable[str]) -> None:
        """Raise a `LibraryError` if no clip has one of these further columns."""
        known = ["subject", *self.column_names()]
        for name in names:
            if name not in known:
                raise LibraryError(
                    f"{self.path.parent}: expected a column out of {', '.join(known)}, but got "
                    f"{name!r}. Columns come from the labels: build again with them."
                )

    def _rows(self, sql: str, values: Sequence[Any] = ()) -> Iterator[sqlite3.Row]:
        with sqlite_errors(self.path):
            yield from self._connection.execute(sql, values)

    def _names_like(self, name: str) -> list[str]:
        """Return a few names of clips that are, or whose stems are, close to a name."""
        import difflib

        names: dict[str, list[str]] = {}  # by all that they are called
        for row in self._rows("SELECT name, stem FROM clips WHERE deleted IS NULL ORDER BY name"):
            for spelling in {row["name"], row["stem"]}:
                names.setdefault(spelling, []).append(row["name"])
        close = difflib.get_close_matches(name, names, n=CLOSE_NAMES, cutoff=CLOSENESS)
        found = dict.fromkeys(full for spelling in close for full in names[spelling])
        return list(found)[:CLOSE_NAMES]
