"""What a query reads: the frames of all clips and their sketch, memory-mapped.

The index is derived from the feature shards. Whoever writes clips brings it up to date: what is new
is appended (`mocapdb.library.index_pieces`); where a clip has changed or is gone, the others are
copied into a new one; and once a library has doubled, its axes are found anew. The catalogue notes
each clip that the index does not know as it is, so that a stale one is never used.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import astuple
from itertools import pairwise
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from mocapdb.base.arrays import IntArray
from mocapdb.indexing.canonical.canonical_motion import CanonicalMotion
from mocapdb.indexing.search.features import FeatureSpace, Weights
from mocapdb.indexing.search.frame_store import (
    SKETCH_AXES,
    SKETCH_FRAMES,
    Frames,
    MotionIndex,
    code_clip,
    coded_turns,
    steps_of,
)
from mocapdb.indexing.tuning import OUTLYING_M
from mocapdb.library.catalogue import Catalogue
from mocapdb.library.index_pieces import ENTRY, PARTS, StoredIndex, stored_index
from mocapdb.library.layout import FEATURES_FOLDER, OLD_SEARCH_FILE
from mocapdb.library.searching.canonical_shards import FeatureReader
from mocapdb.library.tuning import KNOWN_SHARE, PIECE_BYTES, SPACE_CLIPS
from mocapdb.library.writing.catalogue_writer import CatalogueWriter
from mocapdb.library.writing.index_writer import append_clips, next_number, remove_index

__all__ = ["StoredMotions", "make_index", "open_index", "refresh_search"]

Place = tuple[int, str, int]


class StoredMotions(Sequence[CanonicalMotion]):
    """The motions of a library, each read from its feature shard when it is asked for.

    Parameters
    ----------
    folder : Path
        The library's.
    places : sequence of (clip row, shard's file, row in it)
    hashes : mapping of str to str, optional
        SHA-256 of each shard's file, which it is compared with.
    """

    def __init__(
        self, folder: Path, places: Sequence[Place], hashes: Mapping[str, str] | None = None
    ) -> None:
        self.folder = folder
        self._places = places
        self._hashes = hashes or {}
        self._open: tuple[str, FeatureReader] | None = None

    def __len__(self) -> int:
        return len(self._places)

    @overload
    def __getitem__(self, i: int) -> CanonicalMotion: ...
    @overload
    def __getitem__(self, i: slice) -> StoredMotions: ...
    def __getitem__(self, i: int | slice) -> CanonicalMotion | StoredMotions:
        if isinstance(i, slice):
            return StoredMotions(self.folder, self._places[i], self._hashes)
        _, file, row = self._places[i]
        if self._open is None or self._open[0] != file:  # neighbours share a shard
            path = self.folder / FEATURES_FOLDER / file
            self._open = file, FeatureReader(path, self._hashes.get(file))
        return self._open[1].packed(row).unpack()

    @classmethod
    def of(cls, catalogue: Catalogue, places: Sequence[Place]) -> StoredMotions:
        """Return motions of a library, by what its catalogue says of them."""
        return cls(catalogue.path.parent, places, catalogue.shard_hashes(FEATURES_FOLDER))


def make_index(motions: StoredMotions, weights: Weights | None = None) -> MotionIndex:
    """Return the index of a library's motions, in memory."""
    return MotionIndex.of(motions, _space_of(motions, weights))


def _space_of(motions: StoredMotions, weights: Weights | None = None) -> FeatureSpace:
    """Return the space of a library's motions, found from an even choice of them if they are many.

    It takes a few thousand clips to know along which axes people move, and not all of a million.
    """
    return FeatureSpace.fit(motions[:: max(1, len(motions) // SPACE_CLIPS)], weights)


def open_index(catalogue: Catalogue) -> tuple[MotionIndex, IntArray]:
    """Return the index of a library and the catalogue's row of each of its clips.

    Where it is damaged, or stale because a build was killed before it came to write it, or an
    earlier version wrote the library, the index is made in memory.
    """
    index = stored_index(catalogue)
    if index is not None and not catalogue.unsearched():
        with suppress(OSError, ValueError):  # a writer has just replaced it
            if _is_of_use(index):
                return _mapped(index)
    places = catalogue.feature_places()
    return make_index(StoredMotions.of(catalogue, places)), _clip_rows(places)


def _clip_rows(places: Sequence[Place]) -> IntArray:
    return np.array([clip_id for clip_id, _, _ in places], dtype=np.int64)


def _is_of_use(index: StoredIndex, *, thorough: bool = False) -> bool:
    """Return whether an index is there whole, and in a space of use.

    Earlier versions let a clip that lies 10 km away stretch the space, until nothing in it could be
    told apart: no people move by so much.
    """
    return index.deviations.max(initial=0.0) <= OUTLYING_M and index.is_sound(thorough=thorough)


def _space(index: StoredIndex) -> FeatureSpace:
    return FeatureSpace(Weights(*index.weights), index.mean, index.axes, index.deviations)


def _mapped(index: StoredIndex) -> tuple[MotionIndex, IntArray]:
    """Return an index as memory that is read when it is touched, and the row of each clip."""
    entries, space = index.entries(), _space(index)
    steps, counts = steps_of(space), entries["frames"].astype(np.int64)
    motions = MotionIndex(
        space,
        Frames(index.mapped("frames"), steps, _starts(counts)),
        Frames(index.mapped("sketch"), steps[:SKETCH_AXES], _starts(-(-counts // SKETCH_FRAMES))),
        index.mapped("signatures").view("<f4"),
        entries["usual"] != 0,
        index.mapped("turns")[:, 0],
    )
    return motions, entries["clip"].astype(np.int64)


def _starts(counts: IntArray) -> IntArray:
    return np.concatenate([[0], np.cumsum(counts)])


# -- bringing it up to date ------------------------------------------------------------------------


def refresh_search(catalogue: CatalogueWriter, *, thorough: bool = False) -> None:
    """Bring the index up to date with the catalogue; only the library's only writer may.

    Parameters
    ----------
    catalogue : CatalogueWriter
    thorough : bool
        Whether all of it is compared with its checksums, also where it is large.
    """
    changed, index = catalogue.unsearched(), stored_index(catalogue)
    is_of_use = index is not None and _is_of_use(index, thorough=thorough)
    catalogue.drop_derived(catalogue.path.parent / OLD_SEARCH_FILE)
    if is_of_use and not changed:
        return
    if not catalogue.has_searchable():
        if index is not None or changed:
            remove_index(catalogue)
        return
    if index is not None and is_of_use and _update(catalogue, index, changed):
        return
    places = catalogue.feature_places()
    motions = StoredMotions.of(catalogue, places)
    space = _space_of(motions)
    clips = (_coded(space, clip_id, motions[i]) for i, (clip_id, _, _) in enumerate(places))
    append_clips(catalogue, _empty(catalogue, space, len(places)), clips)


def _update(catalogue: CatalogueWriter, index: StoredIndex, changed: Sequence[int]) -> bool:
    """Bring an index up to date without another space; return whether that will do.

    It will not once the space was found in, or would be kept for, less than half of the clips.
    """
    known = index.entries()["clip"]
    is_kept = ~np.isin(known, changed)
    new = catalogue.feature_places(changed)
    n_clips = int(is_kept.sum()) + len(new)
    if min(index.fitted, int(is_kept.sum())) < KNOWN_SHARE * n_clips:
        return False
    space, motions = _space(index), StoredMotions.of(catalogue, new)
    coded = (_coded(space, clip_id, motions[i]) for i, (clip_id, _, _) in enumerate(new))
    if is_kept.all() and (not new or new[0][0] > known[-1]):
        append_clips(catalogue, index, coded)
    else:
        clips = _merged(index, is_kept, [clip_id for clip_id, _, _ in new], coded)
        append_clips(catalogue, _empty(catalogue, space, index.fitted), clips)
    return True


def _empty(catalogue: CatalogueWriter, space: FeatureSpace, n_fitted: int) -> StoredIndex:
    """Return a new index without clips."""
    return StoredIndex(
        catalogue.path.parent,
        next_number(catalogue),
        tuple(float(weight) for weight in astuple(space.weights)),
        space.mean,
        space.axes,
        space.deviations,
        n_fitted,
    )


def _coded(space: FeatureSpace, clip_id: int, motion: CanonicalMotion) -> dict[str, NDArray[Any]]:
    """Return what the index keeps of a clip."""
    coded = code_clip(space, space.frames(motion))
    return {
        "clips": np.array([(clip_id, len(motion), not space.is_outlying(motion))], ENTRY),
        "frames": coded.frames,
        "sketch": coded.sketch,
        "turns": coded_turns(motion),
        "signatures": coded.signature[None].astype("<f4"),
    }


def _merged(
    index: StoredIndex,
    is_kept: NDArray[np.bool_],
    new: Sequence[int],
    coded: Iterator[dict[str, NDArray[Any]]],
) -> Iterator[dict[str, NDArray[Any]]]:
    """Yield what is kept of an index, and new clips, by their rows of the catalogue."""
    entries = index.entries()
    counts = entries["frames"].astype(np.int64)
    frames, sketch = _starts(counts), _starts(-(-counts // SKETCH_FRAMES))
    mapped = {part: index.mapped(part) for part in PARTS}
    clips = np.arange(len(entries) + 1)
    rows = dict.fromkeys(PARTS, clips) | {"frames": frames, "turns": frames, "sketch": sketch}
    # where to cut: at new clips, at clips that are gone, and often enough to hold little in memory
    at = np.searchsorted(entries["clip"], new)
    gone = np.flatnonzero(~is_kept)
    full = np.flatnonzero(np.diff(frames * index.row_bytes("frames") // PIECE_BYTES)) + 1
    cuts = np.unique(np.concatenate([[0, len(entries)], at, gone, gone + 1, full]))
    done = 0
    for first, end in [*pairwise(cuts.tolist()), (len(entries), len(entries))]:
        while done < len(new) and at[done] <= first:
            yield next(coded)
            done += 1
        if first < end and is_kept[first]:
            yield {part: mapped[part][slice(*rows[part][[first, end]])] for part in PARTS}
