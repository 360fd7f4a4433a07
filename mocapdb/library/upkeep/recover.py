"""A way back: the catalogue made anew from the shards, and what is damaged left out and named.

Where the catalogue is sound, it says what there was, and only what is damaged goes. Where it is not
or is gone, the shards say what they hold (`mocapdb.library.shard_entries`). Nothing is thrown away:
what is of no use any more is put into the folder ``set-aside``. What was lost is taken from the
corpus again, where its files are there; what is made from clips is made anew.

Killed at any moment, it can be started again: until the new catalogue is whole and in its place,
every shard stays where it was, or its clips are in another; and what is to be taken from the corpus
is noted before it is dropped.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from contextlib import closing, suppress
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mocapdb.base.arrays import StrPath
from mocapdb.base.files import make_folder, sync, write_whole
from mocapdb.base.progress import Progress, silent
from mocapdb.errors import CorpusError, LibraryError, MocapdbError
from mocapdb.library.addresses import expect_local
from mocapdb.library.catalogue import SHARD_TABLES, Catalogue
from mocapdb.library.cycles_file import list_cycles, read_cycle
from mocapdb.library.hdf5 import file_sha256
from mocapdb.library.layout import (
    CATALOGUE_FILE,
    CYCLES_FILE,
    FEATURES_FOLDER,
    MODELS_FILE,
    OLD_SEARCH_FILE,
    RECOVERING_FILE,
    RECOVERING_FOLDER,
    SEARCH_FOLDER,
    SET_ASIDE_FOLDER,
    SHARDS_FOLDER,
)
from mocapdb.library.library import Library
from mocapdb.library.naming import SourceFile, clip_names, file_and_take
from mocapdb.library.shard_entries import entry_bytes
from mocapdb.library.shards import ShardReader
from mocapdb.library.upkeep.gather import Dropped, Gathered, Kept, gather
from mocapdb.library.writing.catalogue_writer import CatalogueWriter, create_catalogue
from mocapdb.library.writing.open_for_writing import (
    expect_no_links,
    only_writer,
    open_for_writing,
)
from mocapdb.library.writing.pack_shards import Stored, packed_shard, rewrite_shards
from mocapdb.library.writing.shard_writer import write_shard

if TYPE_CHECKING:
    from mocapdb.io.reading import ReadOptions

__all__ = ["RecoveryReport", "recover_library"]

SAID_OF_A_CLIP = ("label", "label_source", "description", "subject", "subject_source", "columns")
"""What others have said of a clip, and its file may not say again."""


@dataclass(frozen=True)
class ToDo:
    """What is left to do once the catalogue is sound, kept in a file until it is done.

    Attributes
    ----------
    dropped : tuple of Dropped
    lacks_files : bool
        Whether there are shards that do not tell which files their clips are of.
    is_indexed : bool
    """

    dropped: tuple[Dropped, ...] = ()
    lacks_files: bool = False
    is_indexed: bool = False

    @classmethod
    def of_library(cls, folder: Path) -> ToDo:
        """Read what a recovery that was stopped has left to do.

        Raises
        ------
        LibraryError
            If that cannot be read.
        """
        path = folder / RECOVERING_FILE
        if not path.is_file():
            return cls()
        try:
            told = json.loads(path.read_bytes())
            dropped = tuple(Dropped(**each) for each in told["dropped"])
            for each in dropped:
                _expect_row(each.row)
            return cls(dropped, bool(told["lacks_files"]), bool(told["is_indexed"]))
        except (AttributeError, KeyError, OSError, TypeError, ValueError):
            raise LibraryError(
                f"{path}: expected what a recovery has left to do, but it cannot be read. Delete "
                "it, and build the corpus again afterwards: what it named may be missing."
            ) from None

    def __or__(self, other: ToDo) -> ToDo:
        known = {each.what for each in self.dropped}
        new = tuple(each for each in other.dropped if each.what not in known)
        return ToDo(
            self.dropped + new,
            self.lacks_files or other.lacks_files,
            self.is_indexed or other.is_indexed,
        )

    def keep(self, folder: Path) -> None:
        """Write it down."""
        text = json.dumps(asdict(self), default=str)
        write_whole(folder / RECOVERING_FILE, text.encode(), failed=_cannot_note, one_writer=True)


def _expect_row(row: Mapping[str, Any] | None) -> None:
    """Raise what a row raises that lacks what is looked for in it."""
    for name in ("name", "corpus", "source", "settings", *SAID_OF_A_CLIP) if row else ():
        row[name]  # type: ignore[index]


def _cannot_note(path: Path, problem: OSError) -> LibraryError:
    return LibraryError(f"{path}: cannot write ({problem.strerror}). Nothing was changed.")


@dataclass
class RecoveryReport:
    """What was found, and what became of it.

    Attributes
    ----------
    library : str
    catalogue : str
        What was wrong with the catalogue, so that it was made anew; empty if nothing.
    clips, revisions : int
        Clips, and cleaned revisions of clips, that are in the library now.
    dropped : list of dict
        ``what`` was damaged, and the ``reason``.
    retaken : list of str
        Clips of these that were built again from their files.
    lost : list of str
        What is not in the library any more.
    set_aside : list of str
        Files that were moved into the folder ``set-aside``.
    indexed : int
        Clips whose features were computed anew.
    cycles : list of str
        Classes whose kept cycle is gone; empty text for all of a file that cannot be read.
    """

    library: str
    catalogue: str = ""
    clips: int = 0
    revisions: int = 0
    dropped: list[dict[str, str]] = field(default_factory=list)
    retaken: list[str] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)
    set_aside: list[str] = field(default_factory=list)
    indexed: int = 0
    cycles: list[str] = field(default_factory=list)

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers, strings and lists, ready for JSON."""
        return asdict(self)


def recover_library(
    path: StrPath,
    *,
    corpus: StrPath | None = None,
    jobs: int | None = None,
    progress: Progress = silent,
) -> RecoveryReport:
    """Bring a damaged library back, as far as its shards and its corpus reach.

    Parameters
    ----------
    path : path-like
        The library.
    corpus : path-like, optional
        Where the motion files are that clips are taken from again. By default where they were.
    jobs : int, optional
        Worker processes.
    progress : callable, optional

    Raises
    ------
    LibraryError
        If there is no library, or it is locked or cannot be written.
    """
    folder = Path(path)
    expect_local(folder)
    report = RecoveryReport(str(folder))
    if not (folder / SHARDS_FOLDER).is_dir() and not (folder / CATALOGUE_FILE).is_file():
        raise LibraryError(
            f"{folder}: not a library (neither {CATALOGUE_FILE} nor {SHARDS_FOLDER} in it)."
        )
    expect_no_links(folder)
    to_do = ToDo.of_library(folder)
    wrong = _wrong_with_catalogue(folder)
    if wrong is None:
        with open_for_writing(folder) as catalogue:
            to_do |= ToDo(is_indexed=catalogue.is_indexed())
            to_do = _drop_damaged(folder, catalogue, to_do, report, progress)
    else:
        report.catalogue = wrong
        is_indexed = any(
            any((folder / name).glob(pattern))
            for name, pattern in ((FEATURES_FOLDER, "*.h5"), (SEARCH_FOLDER, "*.frames"))
        )
        with only_writer(folder):
            found = gather(folder, progress)
            to_do |= ToDo(tuple(found.dropped), bool(found.unknown), is_indexed)
            to_do.keep(folder)
            _make_catalogue(folder, found, report)
    report.dropped = [{"what": each.what, "reason": each.reason} for each in to_do.dropped]
    _retake(folder, to_do, corpus, jobs, report)
    with open_for_writing(folder) as catalogue, Library(folder) as library:
        _check_cycles(folder, catalogue, report)
        if to_do.is_indexed:
            from mocapdb.library.upkeep.index import add_features

            report.indexed = add_features(library, catalogue, progress)["indexed"]
        report.clips = catalogue.n_clips()
        report.revisions = sum(each.changes for each in catalogue.revisions().values())
        _remove_unfinished(folder / RECOVERING_FOLDER)
        (folder / RECOVERING_FILE).unlink(missing_ok=True)
    return report


def _is_there(folder: Path, name: str) -> bool:
    return (folder / name).is_file()


# -- with a sound catalogue ------------------------------------------------------------------------


def _wrong_with_catalogue(folder: Path) -> str | None:
    """Return why the catalogue cannot be used, or None."""
    if not _is_there(folder, CATALOGUE_FILE):
        return "it was missing"
    try:
        with Catalogue(folder) as catalogue:
            return catalogue.check()
    except LibraryError as problem:
        return str(problem)


def _drop_damaged(
    folder: Path,
    catalogue: CatalogueWriter,
    to_do: ToDo,
    report: RecoveryReport,
    progress: Progress,
) -> ToDo:
    """Take out of a library what cannot be decoded, and the files that are not as they were.

    Returns what is to be done afterwards, with what was left to do before.
    """
    damaged = {
        (name, row["id"]): folder / name / row["file"]
        for name in SHARD_TABLES
        for row in catalogue.shards(name)
        if not _is_sound(folder / name / row["file"], row["sha256"])
    }
    clips, revisions, dropped = _undecodable(folder, catalogue, progress)
    to_do |= ToDo(tuple(dropped))
    if not damaged and not dropped:
        return to_do
    to_do.keep(folder)
    now = datetime.now(UTC).isoformat(timespec="seconds")
    with catalogue.transaction():
        catalogue.drop_revisions([*clips, *revisions], now)
        catalogue.update_clips({row: {"deleted": now} for row in clips})
        catalogue.remove_features(
            clip_id
            for clip_id, file, _ in catalogue.feature_places()
            if folder / FEATURES_FOLDER / file in damaged.values()
        )
        if catalogue.is_indexed() or catalogue.shards(FEATURES_FOLDER):
            catalogue.remove_features(revisions)
        hit = {row for name, row in damaged if name == SHARDS_FOLDER}
        rewrite_shards(catalogue, hit | catalogue.shards_with_deleted())
        catalogue.remove_deleted()
        catalogue.remove_shards(damaged)
    _set_aside(folder, damaged.values(), report)
    return to_do


def _is_sound(path: Path, sha256: str) -> bool:
    try:
        return file_sha256(path) == sha256
    except OSError:
        return False


def _undecodable(
    folder: Path, catalogue: CatalogueWriter, progress: Progress
) -> tuple[list[int], list[int], list[Dropped]]:
    """Return the clips that cannot be decoded, those whose revision cannot, and why."""
    clips, revised, dropped = [], [], []
    revisions = catalogue.revisions()
    with Library(folder) as library:
        records = library.records()
        for done, record in enumerate(records, start=1):
            try:
                library.captured(record)
            except MocapdbError as problem:
                clips.append(record.id)
                row = catalogue.row("clips", record.id)
                dropped.append(Dropped(record.name, str(problem), row))
            revision = revisions.get(record.id)
            try:
                if revision is not None and revision.changes:
                    library.decode_revision(record, revision)
            except MocapdbError as problem:
                revised.append(record.id)
                dropped.append(Dropped(f"{record.name}, as it was cleaned", str(problem)))
            progress(done, len(records), record.name)
    return clips, revised, dropped


# -- without one -----------------------------------------------------------------------------------


def _make_catalogue(folder: Path, found: Gathered, report: RecoveryReport) -> None:
    """Make the catalogue of what was found, whole, and only then put it in its place."""
    work = folder / RECOVERING_FOLDER
    _remove_unfinished(work)
    work.mkdir()
    create_catalogue(work)
    whole = found.whole_files()
    with CatalogueWriter(work) as catalogue, catalogue.transaction():
        for basis in found.bases.values():
            catalogue.add_basis(basis.digest, basis.label, basis.layout, basis.data)
        shards = {file: _add_shard(catalogue, folder / SHARDS_FOLDER / file) for file in whole}
        places = _rewrite(folder, catalogue, found, whole)
        places |= {
            (kept.file, kept.place): (shards[kept.file], kept.place)
            for kept in [*found.clips, *(revision for revision, _ in found.revisions)]
            if kept.file in whole
        }
        _add_clips(catalogue, found, places)
    sync(work / CATALOGUE_FILE)
    shards_folder = folder / SHARDS_FOLDER
    old = [shards_folder / file for file in {*found.files, *found.unknown} - whole]
    log = (folder / f"{CATALOGUE_FILE}{end}" for end in ("", "-wal", "-shm", "-journal"))
    _set_aside(folder, [*old, *log], report)
    (work / CATALOGUE_FILE).replace(folder / CATALOGUE_FILE)
    sync(folder)
    for file in (OLD_SEARCH_FILE, MODELS_FILE):  # they are made anew, from what is there now
        (folder / file).unlink(missing_ok=True)


def _remove_unfinished(work: Path) -> None:
    """Remove the folder that a catalogue was made in, by this recovery or one that was stopped."""
    if work.is_dir():
        for path in work.glob(f"{CATALOGUE_FILE}*"):
            path.unlink()
        work.rmdir()


def _add_shard(catalogue: CatalogueWriter, path: Path) -> int:
    row = {"file": path.name, "size": path.stat().st_size, "sha256": file_sha256(path)}
    return catalogue.insert("shards", row | {"complete": 1})


def _rewrite(
    folder: Path, catalogue: CatalogueWriter, found: Gathered, whole: set[str]
) -> dict[tuple[str, int], tuple[int, int]]:
    """Write what is live in shards that are not whole into new ones; return where it is now."""
    by_file: dict[str, list[Kept]] = {}
    for kept in [*found.clips, *(revision for revision, _ in found.revisions)]:
        if kept.file not in whole:
            by_file.setdefault(kept.file, []).append(kept)
    places: dict[tuple[str, int], tuple[int, int]] = {}
    for file, own in by_file.items():
        with closing(ShardReader(folder / SHARDS_FOLDER / file)) as reader:
            stored = [Stored.again(reader, kept.place, kept.skeleton) for kept in own]
        row = write_shard(folder / SHARDS_FOLDER, packed_shard(catalogue, stored))
        shard_id = catalogue.insert("shards", row | {"complete": 1})
        places |= {(kept.file, kept.place): (shard_id, i) for i, kept in enumerate(own)}
    return places


def _add_clips(
    catalogue: CatalogueWriter, found: Gathered, places: dict[tuple[str, int], tuple[int, int]]
) -> None:
    """Note the clips and revisions that were found, under the names that a build gives them."""
    names = clip_names({kept.key: SourceFile(*kept.key) for kept in found.clips})
    known = set(catalogue.column_kinds("clips"))
    builds: dict[tuple[str, str], int] = {}
    rows: dict[tuple[str, str], int] = {}
    for kept in found.clips:
        row = {name: value for name, value in kept.row.items() if name in known}
        settings = {k: v for k, v in json.loads(row["settings"]).items() if k != "reading"}
        build = row["corpus"], json.dumps(settings, sort_keys=True)
        if build not in builds:
            now = datetime.now(UTC).isoformat(timespec="seconds")
            columns = {"corpus": build[0], "settings": build[1], "started": now, "finished": now}
            builds[build] = catalogue.insert("builds", columns)
        shard_id, place = places[kept.file, kept.place]
        rows[kept.key] = catalogue.insert(
            "clips",
            row
            | {
                "name": names[kept.key],
                "skeleton_id": catalogue.add_skeleton(kept.skeleton),
                "shard_id": shard_id,
                "shard_row": place,
                "build_id": builds[build],
            },
        )
        errors = kept.entry.get("joint_errors")
        if errors is not None:
            catalogue.add_joint_errors(rows[kept.key], entry_bytes(str(errors)))
    known = set(catalogue.column_kinds("revisions"))
    for revision, clip in found.revisions:
        row = {name: value for name, value in revision.row.items() if name in known}
        shard_id, place = places[revision.file, revision.place]
        own = {"clip_id": rows[clip.key], "shard_id": shard_id, "shard_row": place}
        catalogue.insert("revisions", row | own)


def _set_aside(folder: Path, paths: Iterable[Path], report: RecoveryReport) -> None:
    """Move files that are of no use any more out of the way, under names that are free."""
    for path in paths:
        if not path.exists():
            continue
        aside = folder / SET_ASIDE_FOLDER
        make_folder(aside)
        own, number = path.relative_to(folder).as_posix().replace("/", "-"), 0
        place = aside / own
        while place.exists():
            number += 1
            place = aside / f"{own}.{number}"
        path.rename(place)
        report.set_aside.append(place.name)


# -- what is taken again ---------------------------------------------------------------------------


def _retake(
    folder: Path, to_do: ToDo, corpus: StrPath | None, jobs: int | None, report: RecoveryReport
) -> None:
    """Build again what was dropped, from its files as they are now.

    Where a shard does not tell what was in it, these are the files of which there is no clip.
    """
    rows = [dict(each.row) for each in to_do.dropped if each.row is not None]
    lacks_files = to_do.lacks_files
    if corpus is not None:
        rows = [row | {"corpus": str(Path(corpus).resolve())} for row in rows]
    with Library(folder) as library:
        live = library.records()
    there = {(record.corpus, record.source): record.name for record in live}
    again = {(row["corpus"], row["source"]): row for row in rows}
    # an earlier recovery has taken them, and may have been stopped before it said this
    _say_again(folder, {there[key]: again[key] for key in again.keys() & there.keys()})
    rows = [row for key, row in again.items() if key not in there]
    told = rows or [{"corpus": record.corpus} for record in live if lacks_files]
    corpora = {str(row["corpus"]) for row in told}
    if lacks_files:
        corpora |= {record.corpus for record in live} if corpus is None else set()
        corpora |= {str(Path(corpus).resolve())} if corpus is not None else set()
    for root in sorted(corpora):
        lost = {str(row["source"]): row for row in rows if row["corpus"] == root}
        have = _files(record.source for record in live if lacks_files or record.corpus == root)
        how = Counter([row["settings"] for row in lost.values()] or [r.settings for r in live])
        if how:
            built = _build_again(
                folder,
                Path(root),
                how,
                None if lacks_files else _files(lost),
                have,
                to_do.is_indexed,
                jobs,
            )
            _say_again(folder, {name: lost[source] for name, source in built if source in lost})
            report.retaken += sorted(name for name, _ in built)
            rows = [row for row in rows if row["source"] not in {source for _, source in built}]
    report.lost = [str(row["name"]) for row in rows]


def _files(sources: Iterable[str]) -> set[str]:
    """Return the files of clips' sources, of which some hold several."""
    return {file_and_take(source)[0] for source in sources}


def _build_again(
    folder: Path,
    root: Path,
    how: Counter[str],
    wanted: set[str] | None,
    have: set[str],
    index: bool,
    jobs: int | None,
) -> list[tuple[str, str]]:
    """Build files of a corpus, all that are wanted and not there; return names and sources."""
    from mocapdb.library.building.build import build_library
    from mocapdb.library.building.settings import BuildSettings, reading_of

    (most, _) = how.most_common(1)[0]
    said: list[ReadOptions] = [reading_of(settings) for settings in how]
    with Library(folder) as library:
        before = {record.id for record in library.records()}
    with suppress(CorpusError):  # the files are not there any more
        build_library(
            root,
            folder,
            BuildSettings.from_json(most),
            reading=said[0] if len(set(map(str, said))) == 1 else None,
            only=lambda file: file not in have if wanted is None else file in wanted,
            index=index,
            jobs=jobs,
        )
    with Library(folder) as library:
        new = [record for record in library.records() if record.id not in before]
    return [(record.name, record.source) for record in new]


def _say_again(folder: Path, rows: dict[str, dict[str, Any]]) -> None:
    """Give clips that were built again what was known of them before."""
    if not rows:
        return
    with open_for_writing(folder) as catalogue, catalogue.transaction():
        catalogue.update_clips(
            {
                catalogue.resolve(name).id: {key: row[key] for key in SAID_OF_A_CLIP}
                for name, row in rows.items()
            }
        )


def _check_cycles(folder: Path, catalogue: CatalogueWriter, report: RecoveryReport) -> None:
    """Set the cycles of classes aside where they are damaged: they are made anew by a command."""
    path = folder / CYCLES_FILE
    if not path.is_file():
        return
    names: list[str] = []
    try:
        names = [str(row["class"]) for row in list_cycles(folder)]
        for name in names:
            read_cycle(folder, name)
    except LibraryError:
        report.cycles = names or [""]
        _set_aside(folder, [path], report)
    with catalogue.transaction():
        catalogue.keep_derived(path)
