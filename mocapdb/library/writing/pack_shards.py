"""Shards that are complete in themselves: payloads with all that the catalogue says of them.

What is live in some shards is written into new ones to give space back, to leave out what is
damaged, to make shards of earlier versions complete, and to make one of many small ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import cache
from itertools import groupby
from typing import Any

from mocapdb.errors import LibraryError
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.layout import SHARDS_FOLDER
from mocapdb.library.revision import Revision
from mocapdb.library.shard_entries import (
    basis_entry,
    clip_entry,
    revision_entry,
    skeleton_entry,
)
from mocapdb.library.shards import ShardReader
from mocapdb.library.tuning import COMMIT_BYTES, JOINED_BYTES, JOINED_SHARDS
from mocapdb.library.writing.catalogue_writer import CatalogueWriter
from mocapdb.library.writing.shard_writer import shard_image
from mocapdb.motion.skeleton import Skeleton

__all__ = [
    "Stored",
    "alike_shards",
    "complete_shards",
    "join_shards",
    "packed_shard",
    "rewrite_shards",
]


@dataclass(frozen=True)
class Stored:
    """A payload as a shard holds it: its bytes, whose they are, its entry and its skeleton."""

    payload: bytes
    digest: str
    entry: bytes
    skeleton: Skeleton

    @classmethod
    def again(cls, reader: ShardReader, row: int, skeleton: Skeleton) -> Stored:
        """Return a payload as it is in a shard that says what it is."""
        return cls(reader.payload(row, reader.digest(row)), reader.digest(row),
                   reader.entry_data(row), skeleton)  # fmt: skip


def packed_shard(catalogue: CatalogueWriter, stored: Sequence[Stored]) -> bytes:
    """Return the content of a shard, with the skeletons and bases that its payloads refer to."""
    skeletons = {each.skeleton.digest: each.skeleton for each in stored}
    shared = [skeleton_entry(skeleton) for skeleton in skeletons.values()]
    for row in catalogue.basis_rows():
        digest = bytes.fromhex(row["digest"])
        if any(digest in each.payload for each in stored):  # a payload names its bases so
            shared.append(basis_entry(digest, row["label"], row["layout"], row["data"]))
    return shard_image(
        [each.payload for each in stored],
        [each.digest for each in stored],
        [each.entry for each in stored],
        shared,
    )


def rewrite_shards(catalogue: CatalogueWriter, shard_ids: Collection[int]) -> None:
    """Write what is live in shards anew, one for each, in the open transaction.

    Raises
    ------
    LibraryError
        If anything live in them is damaged.
    """
    live = catalogue.live_in_shards(shard_ids)
    for _, rows in groupby(live, key=lambda row: row.shard_id):
        _write_anew(catalogue, list(rows), _stored)


def join_shards(catalogue: CatalogueWriter, *, shortly: bool = False) -> int:
    """Join small shards, where there are many of about one size; return how many were joined.

    All of them, or `shortly` one group of very small ones.

    Those that were joined are forgotten by the next call, or by `compact`, and their files
    removed after that: who reads the library meanwhile finds them. Killed at any moment, it has
    joined a group of shards or has not.

    Raises
    ------
    LibraryError
        If anything live in them is damaged, or the disk is full.
    """
    if not alike_shards(catalogue.shards(SHARDS_FOLDER), shortly=shortly):
        return 0
    with catalogue.transaction():
        catalogue.remove_unused_shards()
    with_deleted = catalogue.shards_with_deleted()
    whole = [row for row in catalogue.shards(SHARDS_FOLDER) if row["id"] not in with_deleted]
    n_joined = 0
    for shard_ids in alike_shards(whole, shortly=shortly):
        with catalogue.transaction():
            _write_anew(catalogue, catalogue.live_in_shards(shard_ids), _as_it_is)
        n_joined += len(shard_ids)
    return n_joined


def alike_shards(shards: Iterable[Any], *, shortly: bool = False) -> list[list[int]]:
    """Return groups of shards, by their rows, that are to be joined into one each.

    Those of a group are of about one size, a power of `JOINED_SHARDS`; so no payload is written
    more often than there are powers up to the size of a commit.

    Parameters
    ----------
    shards : iterable of rows
        ``id`` and ``size`` of each, the oldest first.
    shortly : bool
        Whether one group will do, of `JOINED_BYTES` and not of a commit's.
    """
    most = JOINED_BYTES if shortly else COMMIT_BYTES
    levels: dict[int, list[list[int]]] = {}
    sizes: dict[int, int] = {}  # of the last group of each level
    for shard in shards:
        size = int(shard["size"])
        if size * JOINED_SHARDS > most:
            continue
        level = _level(size)
        groups = levels.setdefault(level, [[]])
        if sizes.get(level, 0) + size > most:
            groups.append([])
            sizes[level] = 0
        groups[-1].append(int(shard["id"]))
        sizes[level] = sizes.get(level, 0) + size
    every = [group for groups in levels.values() for group in groups]
    enough = [group for group in every if len(group) >= JOINED_SHARDS]
    return enough[:1] if shortly else enough


def _level(size: int) -> int:
    """Return the power of `JOINED_SHARDS` that a size is next above."""
    return int(math.log(max(size, 1), JOINED_SHARDS))


def _write_anew(
    catalogue: CatalogueWriter,
    rows: Sequence[ClipRecord | Revision],
    stored_of: Callable[
        [CatalogueWriter, ShardReader, ClipRecord | Revision, Callable[[int], Skeleton]], Stored
    ],
) -> None:
    """Write payloads into one new shard and point their rows there, in the open transaction."""
    stored: list[Stored] = []
    skeleton_of = cache(catalogue.skeleton)
    for shard_id, own in groupby(rows, key=lambda row: row.shard_id or 0):
        path = catalogue.path.parent / SHARDS_FOLDER / catalogue.shard_file(shard_id)
        with closing(ShardReader(path)) as reader:
            stored += [stored_of(catalogue, reader, row, skeleton_of) for row in own]
    if not stored:
        return
    new = catalogue.add_shard(SHARDS_FOLDER, packed_shard(catalogue, stored))
    catalogue.update_clips(
        {
            row.id: {"shard_id": new, "shard_row": number}
            for number, row in enumerate(rows)
            if isinstance(row, ClipRecord)
        }
    )
    catalogue.move_revisions(
        {row.id: (new, i) for i, row in enumerate(rows) if isinstance(row, Revision)}
    )


def complete_shards(catalogue: CatalogueWriter) -> None:
    """Make the shards of earlier versions complete; what was deleted goes on the way.

    One that is damaged stays as it is: `verify` tells, and `recover` mends.
    """
    incomplete = catalogue.incomplete_shards()
    if not incomplete:
        return
    with catalogue.transaction():
        for shard_id in {*incomplete, *catalogue.shards_with_deleted()}:
            with suppress(LibraryError):
                rewrite_shards(catalogue, [shard_id])
        catalogue.remove_deleted()


def _as_it_is(
    catalogue: CatalogueWriter,
    reader: ShardReader,
    row: ClipRecord | Revision,
    skeleton_of: Callable[[int], Skeleton],
) -> Stored:
    """Return a payload with its entry as it is, by which `recover` knows copies of a clip."""
    clip = row if isinstance(row, ClipRecord) else catalogue.record(row.clip_id)
    digest = row.source_sha256 if isinstance(row, ClipRecord) else row.sha256
    place = -1 if row.shard_row is None else row.shard_row
    payload = reader.payload(place, digest)
    return Stored(payload, digest, reader.entry_data(place), skeleton_of(clip.skeleton_id))


def _stored(
    catalogue: CatalogueWriter,
    reader: ShardReader,
    row: ClipRecord | Revision,
    skeleton_of: Callable[[int], Skeleton],
) -> Stored:
    """Return a payload with an entry of what the catalogue says now."""
    if isinstance(row, ClipRecord):
        skeleton = skeleton_of(row.skeleton_id)
        errors = catalogue.joint_errors(row.id).get(row.id)
        entry = clip_entry(catalogue.row("clips", row.id), skeleton.digest, errors)
        digest = row.source_sha256
    else:
        clip = catalogue.row("clips", row.clip_id)
        skeleton = skeleton_of(clip["skeleton_id"])
        entry = revision_entry(catalogue.row("revisions", row.id), clip, skeleton.digest)
        digest = row.sha256
    place = -1 if row.shard_row is None else row.shard_row
    return Stored(reader.payload(place, digest), digest, entry, skeleton)
