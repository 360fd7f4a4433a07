"""The catalogue: the SQLite file that says what a library holds, and how it is read."""

from __future__ import annotations

import json
import os
import re
import sqlite3
import weakref
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from shlex import quote
from typing import Any, Self

from mocapdb.base.spelling import did_you_mean
from mocapdb.errors import LibraryError, NoClipFitsError, SkeletonError, UnknownClipError
from mocapdb.library.addresses import address_of, expect_local, is_copy
from mocapdb.library.clip_record import ClipLine, ClipRecord
from mocapdb.library.database import (
    APPLICATION_ID,
    CATALOGUE_FORMAT,
    SINCE_2,
    connect,
    expect_our_tables,
    sqlite_errors,
)
from mocapdb.library.facets import FACETS, Facets, checked_facets
from mocapdb.library.hdf5 import expect_format, file_sha256
from mocapdb.library.layout import CATALOGUE_FILE, FEATURES_FOLDER, SHARDS_FOLDER
from mocapdb.library.naming import subject_of
from mocapdb.library.revision import Revision
from mocapdb.library.row_checksums import find_damage
from mocapdb.library.tuning import CLOSE_NAMES, CLOSENESS, MOST_HASHED
from mocapdb.library.words import clips_with_words
from mocapdb.motion.skeleton import Skeleton

__all__ = ["ASSUMED", "NOTED", "SHARD_TABLES", "Catalogue", "Chosen"]

ASSUMED = (
    "unit_m", "unit_source", "up", "up_source", "fps", "fps_source", "body", "subject",
    "subject_source",
)  # fmt: skip
"""What was taken for granted of clips, and who says so."""

NOTED = (
    "deleted IS NULL AND (instr(provenance, 'mended:') > 0 OR instr(provenance, 'warning:') > 0)"
)
"""Of which clips reading noted something; as their index says it."""

SHARD_TABLES = {SHARDS_FOLDER: "shards", FEATURES_FOLDER: "feature_shards"}
"""What says which files belong to a folder of shards."""

SHOWN_VALUES = 20
"""Of a column at most, where a message names what there is."""


@dataclass(frozen=True)
class Chosen:
    """Which clips of a catalogue; every part that is given must fit.

    Attributes
    ----------
    label : str, optional
        Their class.
    text : str, optional
        Words of name, class or description; see `mocapdb.library.words`.
    where : mapping of str to str
        Values of further columns of the labels.
    facets : mapping of str to (low, high)
        Ranges of what `mocapdb.library.FACETS` names; None where one is open.
    flagged : bool, optional
        Whether flagged faults were left in them; clips that nobody has searched fit neither way.
    """

    label: str | None = None
    text: str | None = None
    where: Mapping[str, str] = field(default_factory=dict, hash=False)
    facets: Mapping[str, tuple[float | None, float | None]] = field(
        default_factory=dict, hash=False
    )
    flagged: bool | None = None


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
        if address_of(folder) is not None:
            expect_local(folder)
        self.path = folder / CATALOGUE_FILE
        self._hashed: dict[Path, tuple[object, str]] = {}
        if not self.path.is_file():
            raise LibraryError(
                f"{folder}: not a library (no {CATALOGUE_FILE} in it). "
                "Make one with: mocapdb build CORPUS -o NAME.mocapdb"
            )
        with sqlite_errors(self.path):
            self._connection = connect(self.path, self.writable, unchanging=is_copy(folder))
            try:
                self._expect_our_format()
                self._prepare()
            except BaseException:
                self._connection.close()
                raise
        # one line is enough to open a library and take something from it: nobody closes that one
        weakref.finalize(self, _close_own, self._connection, os.getpid())

    def _expect_our_format(self) -> None:
        (application,) = self._connection.execute("PRAGMA application_id").fetchone()
        (version,) = self._connection.execute("PRAGMA user_version").fetchone()
        if application != APPLICATION_ID:
            raise LibraryError(f"{self.path}: a SQLite file, but not a library's catalogue.")
        expect_format(self.path, "library format", version, CATALOGUE_FORMAT)
        expect_our_tables(self.path, self._connection)
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

    def records(self, chosen: Chosen | None = None) -> Iterator[ClipRecord]:
        """Yield the live clips that were chosen, by name; the best first where words are asked for.

        Raises
        ------
        LibraryError
            If no clip has one of the further columns, or a facet is not what it can be.
        """
        condition, values, order = self._fitting(chosen or Chosen())
        records = self._select(f"{condition} ORDER BY clips.name", values)
        return iter(sorted(records, key=lambda each: order[each.id])) if order else records

    def lines(self, chosen: Chosen | None = None) -> Iterator[ClipLine]:
        """Yield what a list says of the live clips that `records` yields, in its order."""
        condition, values, order = self._fitting(chosen or Chosen())
        names = ", ".join(f"clips.{name}" for name in ClipLine._fields)
        lines = map(
            ClipLine._make,
            self._tuples(f"SELECT {names} FROM clips WHERE {condition} ORDER BY name", values),
        )
        return iter(sorted(lines, key=lambda each: order[each.id])) if order else lines

    def columns(
        self, names: Sequence[str], stems: Iterable[str] | None = None
    ) -> Iterator[tuple[Any, ...]]:
        """Yield some columns of the live clips, and of their row of ``source_files``, by name.

        Of all, or of those with some stems. Only of what the only writer has opened: earlier
        formats lack some. So it is with all that follows on files and plans.
        """
        which = "" if stems is None else "AND stem IN (SELECT value FROM json_each(?))"
        return self._tuples(
            f"SELECT {', '.join(names)} FROM clips LEFT JOIN source_files "
            f"ON source_files.clip_id = clips.id WHERE deleted IS NULL {which} ORDER BY name",
            [] if stems is None else [json.dumps([*stems])],
        )

    def clips_of_files(
        self, corpus: str, folder: str | None = None
    ) -> Iterator[tuple[str, int, str | None, str | None]]:
        """Yield source, row, state and bones of the live clips of a corpus.

        Of all, or of those whose files are in a folder itself; see ``source_files``.
        """
        which = ""
        values: list[Any] = []
        if folder is not None:
            start = f"{folder}/" if folder else ""
            which = "AND instr(substr(source, ?), '/') = 0"
            values = [len(start) + 1]
            if folder:  # "0" comes after "/"
                which = f"AND source > ? AND source < ? {which}"
                values = [start, f"{folder}0", *values]
        return self._tuples(
            "SELECT source, clips.id, state, bones FROM clips LEFT JOIN source_files "
            f"ON source_files.clip_id = clips.id WHERE deleted IS NULL AND corpus = ? {which}",
            [corpus, *values],
        )

    def plan(self, corpus: str) -> tuple[str, str] | None:
        """Return what the last build of a corpus went by, and what it had no use for, as JSON."""
        row = next(
            self._tuples("SELECT inputs, unused FROM plans WHERE corpus = ?", [corpus]), None
        )
        return None if row is None else (row[0], row[1])

    def planned_folder(self, corpus: str, folder: str) -> tuple[str, int] | None:
        """Return digest and number of clips of a folder that is as the last build planned it."""
        rows = self._tuples(
            "SELECT digest, clips FROM planned_folders WHERE corpus = ? AND folder = ?",
            [corpus, folder],
        )
        return next(((row[0], row[1]) for row in rows), None)

    def n_planned_folders(self, corpus: str) -> int:
        """Return how many folders of a corpus have such a digest."""
        sql = "SELECT count(*) FROM planned_folders WHERE corpus = ?"
        return int(next(self._tuples(sql, [corpus]))[0])

    def unplanned(self) -> list[tuple[str | None, str | None, str | None]]:
        """Return corpus, source and stem of clips that are not as the last build planned them.

        They may be deleted; None stands for what is gone altogether.
        """
        return list(
            self._tuples(
                "SELECT corpus, source, stem FROM unplanned LEFT JOIN clips ON clips.id = clip_id"
            )
        )

    def with_content(self, hashes: Iterable[str]) -> set[int]:
        """Return the rows of the live clips whose files have one of some hashes."""
        rows = self._tuples(
            "SELECT id FROM clips WHERE deleted IS NULL "
            "AND source_sha256 IN (SELECT value FROM json_each(?))",
            [json.dumps([*hashes])],
        )
        return {row[0] for row in rows}

    def named(self, names: Iterable[str]) -> set[int]:
        """Return the rows of the live clips that have one of some names."""
        rows = self._tuples(
            "SELECT id FROM clips WHERE deleted IS NULL "
            "AND name IN (SELECT value FROM json_each(?))",
            [json.dumps([*names])],
        )
        return {row[0] for row in rows}

    def _tuples(self, sql: str, values: Sequence[Any] = ()) -> Iterator[tuple[Any, ...]]:
        """Yield rows as plain tuples, which is quicker where there are many."""
        with sqlite_errors(self.path):
            cursor = self._connection.cursor()
            cursor.row_factory = None
            yield from cursor.execute(sql, values)

    def notable(self, corpus: str, least_m: float, most_m: float) -> Iterator[ClipRecord]:
        """Yield the live clips of a corpus by name of which reading noted something.

        Or whose bodies are not between two heights.
        """
        yield from self._select(
            f"clips.id IN (SELECT id FROM clips WHERE {NOTED} AND corpus = ? UNION SELECT id "
            "FROM clips WHERE deleted IS NULL AND corpus = ? AND (height_m < ? OR height_m > ?)) "
            "ORDER BY clips.name",
            [corpus, corpus, least_m, most_m],
        )

    def alike(self, columns: Sequence[str], corpus: str) -> list[tuple[Any, ...]]:
        """Return what the live clips of a corpus have in some columns, their number and first name.

        One of each combination.
        """
        names = ", ".join(columns)
        rows = self._tuples(
            f"SELECT {names}, count(*), min(name) FROM clips "
            f"WHERE deleted IS NULL AND corpus = ? GROUP BY {names}",
            [corpus],
        )
        return list(rows)

    def ids(self, chosen: Chosen | None = None) -> Iterator[int]:
        """Yield the rows of the live clips that `records` yields, in any order."""
        condition, values, _ = self._fitting(chosen or Chosen())
        for row in self._rows(f"SELECT clips.id AS id FROM clips WHERE {condition}", values):
            yield int(row["id"])

    def facets(self) -> dict[int, Facets]:
        """Return what is measured of the live clips, by row; see `without_facets`."""
        if not self._has_table("facets"):
            return {}
        columns = ", ".join(f"facets.{name}" for name in Facets.__dataclass_fields__)
        rows = self._tuples(
            f"SELECT clip_id, {columns} FROM facets "
            "JOIN clips ON clips.id = clip_id WHERE deleted IS NULL"
        )
        return {clip_id: Facets(*own) for clip_id, *own in rows}

    def saved_queries(self) -> list[str]:
        """Return the names of the queries that the library keeps, sorted."""
        if not self._has_table("saved_queries"):
            return []
        return [row["name"] for row in self._rows("SELECT name FROM saved_queries ORDER BY name")]

    def saved_query(self, name: str) -> str:
        """Return a saved query as text; see `mocapdb.library.searching.saved_queries`.

        Raises
        ------
        LibraryError
            If there is none of that name.
        """
        names = self.saved_queries()
        if name not in names:
            known = f"It has: {', '.join(names)}." if names else "None was saved yet."
            raise LibraryError(
                f"{self.path.parent}: no query is saved as {name!r}. {known} "
                f"Save one with: mocapdb query {quote(str(self.path.parent))} CLIP --save NAME"
            )
        (row,) = self._rows("SELECT data FROM saved_queries WHERE name = ?", [name])
        return str(row["data"])

    def without_facets(self) -> list[ClipRecord]:
        """Return the live clips with features of which nothing was measured.

        Earlier versions built them; or their bodies have not two legs and feet.
        """
        known = " AND clips.id NOT IN (SELECT clip_id FROM facets)"
        missing = (
            "deleted IS NULL AND clips.id IN "
            "(SELECT clip_id FROM features WHERE features.shard_id IS NOT NULL)"
        )
        return list(self._select(missing + (known if self._has_table("facets") else ""), []))

    def unmeasured(self) -> tuple[int, int]:
        """Return how many live clips were not measured yet, and how many cannot be.

        A version that measures tries every clip that it can map to the canonical body. So a clip
        cannot be measured if it cannot be mapped, or was built when others had been measured.
        """
        facets = self._has_table("facets")
        known = "(SELECT clip_id FROM facets)" if facets else "(SELECT NULL WHERE 0)"
        since = (
            "SELECT min(build_id) FROM clips WHERE id IN (SELECT clip_id FROM facets)"
            if facets
            else "SELECT NULL"
        )
        ((cannot, all_of_them),) = self._tuples(
            "SELECT coalesce(sum(problem IS NOT NULL OR (shard IS NOT NULL AND build_id >= "
            f"({since}))), 0), count(*) FROM (SELECT problem, features.shard_id AS shard, build_id "
            "FROM clips LEFT JOIN features ON clips.id = clip_id WHERE deleted IS NULL "
            f"AND clips.id NOT IN {known})"
        )
        return all_of_them - cannot, cannot

    def subjects(self) -> dict[int, str]:
        """Return who performs the live clips, by row: as was said, else as the stem tells."""
        said = "subject" if self.version >= 2 else "NULL"
        rows = self._rows(f"SELECT id, stem, {said} AS said FROM clips WHERE deleted IS NULL")
        return {row["id"]: row["said"] or subject_of(row["stem"]) for row in rows}

    def labels(self, only: Iterable[int] | None = None) -> Iterator[tuple[int, str, str, str]]:
        """Yield row, name, label and performer of the live clips that have a label.

        Of all, or of these clips only, by their rows.
        """
        said = "subject" if self.version >= 2 else "NULL"
        which = "" if only is None else "AND id IN (SELECT value FROM json_each(?))"
        for row in self._rows(
            f"SELECT id, name, label, stem, {said} FROM clips "
            f"WHERE deleted IS NULL AND label <> '' {which} ORDER BY id",
            [] if only is None else [json.dumps([*only])],
        ):
            yield row[0], row[1], row[2], row[4] or subject_of(row[3])

    def column_names(self) -> list[str]:
        """Return the names of the further columns that live clips have, sorted."""
        if self.version < 2:
            return []
        rows = self._rows(
            "SELECT DISTINCT each.key AS name FROM clips, json_each(clips.columns) AS each "
            "WHERE deleted IS NULL ORDER BY each.key"
        )
        return [row["name"] for row in rows]

    def names(self, rows: Iterable[int], corpus: str | None = None) -> list[str]:
        """Return the names of the live clips, of a corpus or of all, among some rows, sorted."""
        which = "" if corpus is None else "AND corpus = ?"
        found = self._rows(
            "SELECT name FROM clips WHERE deleted IS NULL "
            f"AND id IN (SELECT value FROM json_each(?)) {which} ORDER BY name",
            [json.dumps([*rows]), *([] if corpus is None else [corpus])],
        )
        return [row["name"] for row in found]

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
                f"Run: mocapdb recover {quote(str(self.path.parent))}"
            )
        return record

    def skeleton(self, skeleton_id: int) -> Skeleton:
        """Return a skeleton by its row."""
        for row in self._rows("SELECT json FROM skeletons WHERE id = ?", [skeleton_id]):
            try:
                return Skeleton.from_dict(json.loads(row["json"]))
            except (SkeletonError, ValueError, RecursionError) as problem:
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

    def live_in_shards(self, shard_ids: Iterable[int]) -> list[ClipRecord | Revision]:
        """Return the live clips and revisions whose payloads are in some shards, in their order."""
        chosen = json.dumps([*shard_ids])
        found: list[ClipRecord | Revision] = [
            *self._select(
                "deleted IS NULL AND shard_id IN (SELECT value FROM json_each(?))", [chosen]
            ),
            *self._revisions("revisions.shard_id IN (SELECT value FROM json_each(?))", [chosen]),
        ]
        return sorted(found, key=lambda row: (row.shard_id or 0, row.shard_row or 0))

    def stray_files(self) -> list[Path]:
        """Return the files among the shards that no commit knows of."""
        strays = []
        for folder in SHARD_TABLES:
            known = {row["file"] for row in self.shards(folder)}
            here = self.path.parent / folder
            files = sorted(here.iterdir()) if here.is_dir() else []
            strays += [path for path in files if path.name not in known]
        return strays

    def incomplete_shards(self) -> list[int]:
        """Return the rows of the shards that do not say what is in them: of earlier versions."""
        complete = "complete" if self.version >= 4 else "0"
        return [row["id"] for row in self._rows(f"SELECT id FROM shards WHERE NOT {complete}")]

    def derived_files(self) -> dict[str, set[str]]:
        """Return the files that are made from others, and the SHA-256 that each may have.

        Those of earlier versions have none.
        """
        found: dict[str, set[str]] = {}
        for row in self._rows("SELECT * FROM derived_files") if self.version >= 4 else ():
            found.setdefault(row["file"], set()).add(row["sha256"])
        return found

    def is_as_written(self, path: Path) -> bool:
        """Tell whether a file that is made from others is there, and has not changed since.

        One of over `MOST_HASHED` bytes is taken for sound: `verify` reads all of it.
        """
        if not path.is_file():
            return False
        kept, found = self.derived_files().get(path.name), path.stat()
        if kept is None or found.st_size > MOST_HASHED:
            return True
        state = found.st_size, found.st_mtime_ns, found.st_ctime_ns, found.st_ino
        if self._hashed.get(path, (None,))[0] != state:  # a build asks several times
            self._hashed[path] = state, file_sha256(path)
        return self._hashed[path][1] in kept

    def shard_hashes(self, folder: str) -> dict[str, str]:
        """Return the SHA-256 of every committed file of a folder of shards."""
        return {row["file"]: row["sha256"] for row in self.shards(folder)}

    def shard_file(self, shard_id: int) -> str:
        """Return the file name of a shard."""
        for row in self._rows("SELECT file FROM shards WHERE id = ?", [shard_id]):
            return str(row["file"])
        raise LibraryError(f"{self.path}: shard {shard_id} is missing.")

    def features_of_deleted(self) -> set[int]:
        """Return the rows of the feature shards that hold features of deleted clips."""
        return {
            row["shard_id"]
            for row in self._rows(
                "SELECT DISTINCT features.shard_id FROM features JOIN clips ON clips.id = clip_id "
                "WHERE deleted IS NOT NULL AND features.shard_id IS NOT NULL"
            )
        }

    def feature_places(
        self, only: Iterable[int] | None = None, *, shard_ids: Iterable[int] | None = None
    ) -> list[tuple[int, str, int]]:
        """Return (clip row, feature shard's file, row in it) of the live clips with features.

        Of all, of these clips only, by their rows, or of those in some feature shards.
        """
        which = "" if only is None else "AND clip_id IN (SELECT value FROM json_each(?))"
        if shard_ids is not None:
            which, only = "AND features.shard_id IN (SELECT value FROM json_each(?))", shard_ids
        rows = self._rows(
            "SELECT clip_id, file, features.shard_row FROM features "
            "JOIN feature_shards ON feature_shards.id = features.shard_id "
            f"JOIN clips ON clips.id = clip_id WHERE deleted IS NULL {which} ORDER BY clip_id",
            [] if only is None else [json.dumps([*only])],
        )
        return [(row[0], row[1], row[2]) for row in rows]

    def has_searchable(self) -> bool:
        """Return whether any live clip has features."""
        rows = self._rows(
            "SELECT 1 FROM features JOIN clips ON clips.id = clip_id "
            "WHERE deleted IS NULL AND features.shard_id IS NOT NULL LIMIT 1"
        )
        return next(rows, None) is not None

    def search_index(self) -> sqlite3.Row | None:
        """Return what is said of the search index; see `mocapdb.library.index_pieces`."""
        if self.version < 5:
            return None
        return next(self._rows("SELECT * FROM search_index"), None)

    def search_pieces(self) -> list[tuple[Any, ...]]:
        """Return the pieces of the search index, in their order."""
        sql = "SELECT clips, frames, sketch, clips_sha256, sha256 FROM search_pieces ORDER BY id"
        return [tuple(row) for row in self._rows(sql)]

    def unsearched(self) -> list[int]:
        """Return the rows of clips that the search index does not know as they are."""
        return self._clip_ids("unsearched")

    def unlearned(self) -> list[int]:
        """Return the rows of clips that the classes do not know as they are."""
        return self._clip_ids("unlearned")

    def _clip_ids(self, table: str) -> list[int]:
        if self.version < 5:
            return [clip_id for clip_id, _, _ in self.feature_places()]
        return [row[0] for row in self._rows(f"SELECT clip_id FROM {table} ORDER BY clip_id")]

    def feature_files(self) -> dict[str, int]:
        """Return the names of the feature shards, and how many live clips have features there."""
        live = Counter(file for _, file, _ in self.feature_places())
        return {row["file"]: live[row["file"]] for row in self.shards(FEATURES_FOLDER)}

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

    def unsearchable(self, corpus: str | None = None) -> dict[str, str]:
        """Return why no query looks at live clips, of a corpus or of all, by name."""
        which = "" if corpus is None else "AND corpus = ?"
        rows = self._rows(
            "SELECT name, problem FROM clips LEFT JOIN features ON clips.id = clip_id "
            f"WHERE deleted IS NULL AND features.shard_id IS NULL {which} ORDER BY name",
            [] if corpus is None else [corpus],
        )
        missing = f"It is not in the index yet. Run: mocapdb index {quote(str(self.path.parent))}"
        return {row["name"]: row["problem"] or missing for row in rows}

    def without_features(self) -> list[ClipRecord]:
        """Return the live clips for which nobody has tried to compute features."""
        missing = "deleted IS NULL AND clips.id NOT IN (SELECT clip_id FROM features)"
        return list(self._select(f"{missing} ORDER BY clips.id", []))

    def bases(self) -> dict[bytes, bytes]:
        """Return the bases that clips refer to, by their digests."""
        return {bytes.fromhex(row["digest"]): row["data"] for row in self.basis_rows()}

    def class_bases(self) -> dict[tuple[str, str], bytes]:
        """Return the basis of each class, by label and layout of channels."""
        return {(row["label"], row["layout"]): row["data"] for row in self.basis_rows()}

    def basis_rows(self) -> list[sqlite3.Row]:
        """Return (digest, label, layout, data) of every basis."""
        if not self._has_table("bases"):
            return []  # a library from before there were any
        return list(self._rows("SELECT digest, label, layout, data FROM bases"))

    def joint_errors(self, clip_id: int | None = None) -> dict[int, bytes]:
        """Return what the joints of clips lost (see `joint_losses`), by the clips' rows.

        Of one clip or of all. Clips that an earlier version built have none.
        """
        if not self._has_table("joint_errors"):
            return {}
        rows = self._rows(
            "SELECT clip_id, data FROM joint_errors WHERE ?1 IS NULL OR clip_id = ?1", [clip_id]
        )
        return {int(row["clip_id"]): bytes(row["data"]) for row in rows}

    def all_joint_errors(self) -> list[tuple[str, float, int, bytes]]:
        """Return name, rate, skeleton's row and what its joints lost of the live clips, by name."""
        if not self._has_table("joint_errors"):
            return []
        rows = self._tuples(
            "SELECT name, fps, skeleton_id, data FROM clips "
            "JOIN joint_errors ON clip_id = clips.id WHERE deleted IS NULL ORDER BY name"
        )
        return list(rows)

    def codecs(self) -> list[tuple[str, int]]:
        """Return what codecs say of the live clips, and of how many."""
        rows = self._rows(
            "SELECT codec, count(*) FROM clips WHERE deleted IS NULL "
            "GROUP BY codec ORDER BY min(name)"
        )
        return [tuple(row) for row in rows]

    def totals(self, clip_id: int | None = None) -> dict[str, Any]:
        """Return sums over the live clips, or of one: sizes, lengths, errors over the frames."""
        sums = {
            "clips": "count(*)",
            "frames": "sum(frames)",
            "seconds": "sum(frames / fps)",
            "payload_bytes": "sum(payload_bytes)",
            "source_bytes": "sum(source_bytes)",
            "float32_bytes": "sum(4 * frames * channels)",
            "skinned_error_max": "max(skinned_error)",
            "error_max_mm": "max(error_max_mm)",
        }
        names = ("skinned_error", "error_mean_mm", "error_p95_mm")
        sums |= {name: f"sum({name} * frames)" for name in names}
        which = "" if clip_id is None else "AND clips.id = ?"
        (row,) = self._rows(
            f"SELECT {', '.join(f'{sql} AS {name}' for name, sql in sums.items())} FROM clips "
            f"JOIN skeletons ON skeletons.id = skeleton_id WHERE deleted IS NULL {which}",
            [] if clip_id is None else [clip_id],
        )
        return {name: value or 0 for name, value in dict(row).items()}

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
            except (TypeError, ValueError, RecursionError):
                raise LibraryError(
                    f"{self.path}: the revision of clip {fields['clip_id']} is damaged. Restore a "
                    "copy of the library, or run: "
                    f"mocapdb clean {quote(str(self.path.parent))} --undo"
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
        if self.version >= 4:
            with sqlite_errors(self.path):
                return find_damage(self._connection)
        if list(self._rows("SELECT 1 FROM sqlite_master WHERE name = 'checksums'")):
            return f"it says that its format is {self.version}, which is not so"
        return None

    # -- SQL -----------------------------------------------------------------------------------

    def _select(self, where: str, values: Sequence[Any]) -> Iterator[ClipRecord]:
        columns = [f"clips.{name}" for name in ClipRecord.__dataclass_fields__]
        columns[columns.index("clips.n_channels")] = "skeletons.channels AS n_channels"
        if self.version < 2:
            for name, (_, instead) in SINCE_2.items():
                columns[columns.index(f"clips.{name}")] = f"{instead} AS {name}"
        parsed: dict[str, Any] = {}  # of the texts that many clips share
        names = [*ClipRecord.__dataclass_fields__]
        provenance, further = names.index("provenance"), names.index("columns")
        for row in self._tuples(
            f"SELECT {', '.join(columns)} FROM clips "
            f"JOIN skeletons ON skeletons.id = clips.skeleton_id WHERE {where}",
            values,
        ):
            fields = list(row)
            try:
                for place, kind in ((provenance, tuple), (further, dict)):
                    text = fields[place]
                    if text not in parsed:
                        parsed[text] = kind(json.loads(text))
                    fields[place] = parsed[text]
            except (TypeError, ValueError, RecursionError):
                raise LibraryError(
                    f"{self.path}: the provenance of {row[names.index('name')]!r} is damaged. Run: "
                    f"mocapdb recover {quote(str(self.path.parent))}"
                ) from None
            yield ClipRecord.of_row(names, fields)

    def _fitting(
        self, chosen: Chosen
    ) -> tuple[str, list[Any], dict[int, tuple[int, float]] | None]:
        """Return the condition, and its values, for live clips; and which words put first."""
        conditions, order = ["deleted IS NULL"], None
        values: list[Any] = []
        if chosen.label is not None:
            conditions.append("label = ?")
            values.append(chosen.label)
        if chosen.text is not None and chosen.text.strip():
            with sqlite_errors(self.path):
                order = clips_with_words(self._connection, chosen.text)
            conditions.append(f"clips.id IN ({', '.join(map(str, order))})")
        where = self.conditions(chosen.where)
        if where:
            self.expect_columns(where)
        for name, value in where.items():
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
        for name, ends in checked_facets(chosen.facets).items():
            condition = f"{FACETS[name].sql} BETWEEN ? AND ?"
            if FACETS[name].measured:
                self._expect_facets()
                condition = f"clips.id IN (SELECT clip_id FROM facets WHERE {condition})"
            elif name == "height" and self.version < 2:
                condition = "? > ?"  # nobody knows
            conditions.append(condition)
            values += ends
        if chosen.flagged is not None:
            flagged = {row: bool(each.left) for row, each in self.revisions().items()}
            rows = [str(row) for row, is_so in flagged.items() if is_so == chosen.flagged]
            conditions.append(f"clips.id IN ({', '.join(rows)})")
        return " AND ".join(conditions), values, order

    def _expect_facets(self) -> None:
        if not self._has_table("facets") or not list(self._rows("SELECT 1 FROM facets LIMIT 1")):
            raise NoClipFitsError(
                f"{self.path.parent}: an earlier version built it and measured no speed, turn or "
                f"contacts. Measure them with: mocapdb index {quote(str(self.path.parent))}"
            )

    def _has_table(self, name: str) -> bool:
        return bool(list(self._rows("SELECT 1 FROM sqlite_master WHERE name = ?", [name])))

    def expect_columns(self, names: Iterable[str]) -> None:
        """Raise a `LibraryError` if no clip has one of these further columns."""
        known = ["subject", *self.column_names()]
        for name in names:
            if name not in known:
                if name in ("class", "label"):
                    raise NoClipFitsError(
                        f"{self.path.parent}: {name!r} is no column of its own. Choose clips of a "
                        "class with --class, in Python with label=."
                    )
                raise NoClipFitsError(
                    f"{self.path.parent}: expected a column out of {', '.join(known)}, but got "
                    f"{name!r}.{did_you_mean(name, known)} Columns come from the labels: build "
                    "again with them."
                )

    def conditions(self, where: Mapping[str, str]) -> dict[str, str]:
        """Return the value that is asked of each column, where commas may part conditions.

        A value with commas that some clip has is that value; of any other, what is written
        ``column=value`` after a comma is a further condition: ``style=old,actor=2``.

        Raises
        ------
        LibraryError
            If a column is asked for twice.
        """
        found: dict[str, str] = {}
        for column, text in where.items():
            value, *others = [text]
            if "," in text and text not in self.values_of(column):
                value, *others = re.split(r",(?=[^,=]+=)", text)
            for name, own in [(column, value), *(other.split("=", 1) for other in others)]:
                if name.strip() in found:
                    raise LibraryError(
                        f"Expected each column once, but got {name.strip()!r} twice: {text!r}."
                    )
                found[name.strip()] = own
        return found

    def expect_class(self, label: str) -> None:
        """Raise a `NoClipFitsError` that names the nearest if no clip has a class."""
        known = self.classes()
        if label not in known:
            has = f"It has: {', '.join(known)}." if known else "No clip of it has a class."
            raise NoClipFitsError(
                f"{self.path.parent}: no clip has class {label!r}."
                f"{did_you_mean(label, known)} {has}"
            )

    def missing_value(self, where: Mapping[str, str]) -> str | None:
        """Return what is to be said of the first value that no clip at all has, or None."""
        for column, value in self.conditions(where).items():
            known = self.values_of(column)
            if value not in known:
                some = ", ".join(known[:SHOWN_VALUES])
                more = " and others" if len(known) > SHOWN_VALUES else ""
                has = f"It has: {some}{more}." if known else f"Of none the {column} is known."
                return (
                    f"{self.path.parent}: no clip has {column} {value!r}."
                    f"{did_you_mean(value, known)} {has}"
                )
        return None

    def values_of(self, column: str) -> list[str]:
        """Return what a further column, or the subject, says of the live clips, sorted."""
        if column == "subject":
            return sorted({*self.subjects().values()} - {""})
        rows = self._rows(
            "SELECT DISTINCT each.value AS value FROM clips, json_each(clips.columns) AS each "
            "WHERE deleted IS NULL AND each.key = ? ORDER BY each.value",
            [column],
        )
        return [str(row["value"]) for row in rows]

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


def _close_own(connection: sqlite3.Connection, process: int) -> None:
    """Close a connection in the process that has opened it: a fork would close it for both."""
    if process == os.getpid():
        connection.close()
