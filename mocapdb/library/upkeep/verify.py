"""Checking a library: every checksum, every file, every clip."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

from mocapdb.base.progress import Progress, silent
from mocapdb.base.workers import on_workers
from mocapdb.errors import LibraryError, MocapdbError
from mocapdb.library.catalogue import SHARD_TABLES
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.hdf5 import file_sha256, no_file
from mocapdb.library.index_pieces import damaged_pieces, stray_index_files
from mocapdb.library.layout import CYCLES_FILE, SEARCH_FOLDER, SHARDS_FOLDER
from mocapdb.library.library import Library
from mocapdb.library.remote import present
from mocapdb.library.revision import Revision
from mocapdb.library.shards import ShardReader
from mocapdb.library.stored_clip import StoredClip

__all__ = ["verify_library"]

AT_ONCE = 16  # clips of one order: so many share the opening of a shard


def verify_library(
    library: Library,
    progress: Progress = silent,
    *,
    jobs: int | None = 1,
    scheduler: str | None = None,
) -> dict[str, Any]:
    """Check every checksum, look for strays, and decode every clip and every revision.

    Parameters
    ----------
    library : Library
    progress : callable, optional
    jobs : int, optional
        Processes that decode: this one by default; None for as many as there are processors.
    scheduler : str, optional
        Address of a Dask scheduler whose workers decode instead and see the library's files.

    Returns
    -------
    dict
        ``clips``, the number checked; ``bad``, a list of ``{"clip", "reason"}``; ``shards``,
        the same for shards as ``{"shard", "reason"}``; ``stray``, files that belong to no
        commit: a build that is at work, or was killed, leaves them, and the next removes them.

    Raises
    ------
    WorkerError
        If workers cannot do the work.
    """
    bad_shards = _damaged_shards(library)
    records = library.records()
    bad: dict[str, str] = {}
    clips = sorted(_stored(library, records, bad), key=lambda clip: clip.shard)
    orders = [[clips[i : i + AT_ONCE]] for i in range(0, len(clips), AT_ONCE)]
    seen = [clip.shard for clip in clips[:1]]
    done = 0
    with closing(
        on_workers(_problems, orders, jobs=jobs, scheduler=scheduler, seen=seen)
    ) as answers:
        for (own,), answer in zip(orders, answers, strict=True):
            done += len(own)
            for clip, reason in zip(own, answer, strict=True):
                if reason is not None:
                    bad.setdefault(clip.record.name, reason)
            progress(done, len(clips), own[-1].record.name)
    told = [
        {"clip": record.name, "reason": bad[record.name]}
        for record in records
        if record.name in bad
    ]
    strays: list[Path] = []
    if not library.address:  # who may list them elsewhere?
        strays = [*library.catalogue.stray_files(), *stray_index_files(library.catalogue)]
    stray = [_shown(path.parent.name, path.name) for path in strays]
    return {"clips": len(records), "bad": told, "shards": bad_shards, "stray": stray}


def _stored(
    library: Library, records: Sequence[ClipRecord], bad: dict[str, str]
) -> Iterator[StoredClip]:
    """Yield all that has to be decoded; what is wrong with a clip's row is noted."""
    revisions = library.catalogue.revisions()
    for record in records:
        revision = revisions.get(record.id)
        rows: list[ClipRecord | Revision] = [record]
        rows += [revision] if revision is not None and revision.changes else []
        for row in rows:
            try:
                yield library.stored(record, row)
            except MocapdbError as problem:
                bad.setdefault(record.name, str(problem))


def _problems(clips: Sequence[StoredClip]) -> list[str | None]:
    """Decode clips and return what is wrong with each, or None; runs in a worker."""
    found: list[str | None] = []
    with ExitStack() as opened:
        shards: dict[Path, ShardReader] = {}
        for clip in clips:
            try:
                if clip.shard not in shards:
                    shards[clip.shard] = opened.enter_context(closing(ShardReader(clip.shard)))
                clip.decode(shards[clip.shard])
                found.append(None)
            except MocapdbError as problem:
                found.append(str(problem))
    return found


def _damaged_shards(library: Library) -> list[dict[str, str]]:
    damaged = []
    problem = library.catalogue.check()
    if problem:
        damaged.append({"shard": library.catalogue.path.name, "reason": problem})
    for folder in SHARD_TABLES:
        for row in library.catalogue.shards(folder):
            reason = None
            try:
                if file_sha256(present(library.path / folder / row["file"])) != row["sha256"]:
                    reason = "fails its SHA-256"
            except OSError as missing:
                reason = f"cannot read: {missing.strerror}"
            except LibraryError as problem:  # of a library in object storage
                reason = str(problem)
            if reason:
                damaged.append({"shard": _shown(folder, row["file"]), "reason": reason})
    wrong = library.copy_derived()
    damaged += [{"shard": file, "reason": reason} for file, reason in wrong.items()]
    damaged += [
        {"shard": f"{SEARCH_FOLDER}/{piece}", "reason": "fails its SHA-256"}
        for piece in damaged_pieces(library.catalogue)
    ]
    for file, hashes in library.catalogue.derived_files().items():
        if file in wrong:
            continue
        path = library.path / file
        if path.is_file() and file_sha256(path) not in hashes:
            damaged.append({"shard": file, "reason": "fails its SHA-256"})
        elif not path.is_file() and file == CYCLES_FILE and no_file(file) not in hashes:
            # the others are made again
            damaged.append({"shard": file, "reason": "is missing"})
    return damaged


def _shown(folder: str, file: str) -> str:
    return file if folder == SHARDS_FOLDER else f"{folder}/{file}"
