"""What a query and a classification read: two files that are made from the feature shards.

``search.h5``   the frames of all clips and their sketch (`frame_store`), memory-mapped
``models.h5``   the classes learned from the labelled clips

Both are derived: a build, or ``mocapdb index``, writes them anew when clips or labels have changed
and puts them in place in one step. Each carries a stamp of what it was made from; a stale one is
never used, but what search.h5 has of clips that are still there is copied.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import astuple
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from mocapdb.base.arrays import IntArray
from mocapdb.base.files import replacing
from mocapdb.errors import LibraryError
from mocapdb.indexing.canonical.canonical_motion import CanonicalMotion
from mocapdb.indexing.search.features import FeatureSpace, Weights
from mocapdb.indexing.search.frame_store import (
    SKETCH_AXES,
    SKETCH_FRAMES,
    Frames,
    MotionIndex,
    code_clip,
    steps_of,
)
from mocapdb.indexing.tuning import OUTLYING_M
from mocapdb.library.catalogue import Catalogue
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.hdf5 import add_datasets, opened
from mocapdb.library.layout import FEATURES_FOLDER, MODELS_FILE, SEARCH_FILE
from mocapdb.library.searching.canonical_shards import FeatureReader
from mocapdb.library.tuning import KNOWN_SHARE, SPACE_CLIPS

if TYPE_CHECKING:  # scikit-learn is slow to import, and a query can do without
    from mocapdb.indexing.recognition.class_models import ClassIndex

__all__ = [
    "StoredMotions",
    "make_index",
    "open_index",
    "open_models",
    "refresh_index",
]

INDEX_FORMAT = 2
NOT_LEARNED = frozenset({"unknown", "other", "mixed", "calibration", "sequence"})
"""Labels that name no motion, so that no class is learned from them (docs/classes.md)."""

Place = tuple[int, str, int]


class StoredMotions(Sequence[CanonicalMotion]):
    """The motions of a library, each read from its feature shard when it is asked for.

    Parameters
    ----------
    folder : Path
        The library's.
    places : sequence of (clip row, shard's file, row in it)
    """

    def __init__(self, folder: Path, places: Sequence[Place]) -> None:
        self.folder = folder
        self._places = places
        self._open: tuple[str, FeatureReader] | None = None

    def __len__(self) -> int:
        return len(self._places)

    @overload
    def __getitem__(self, i: int) -> CanonicalMotion: ...
    @overload
    def __getitem__(self, i: slice) -> StoredMotions: ...
    def __getitem__(self, i: int | slice) -> CanonicalMotion | StoredMotions:
        if isinstance(i, slice):
            return StoredMotions(self.folder, self._places[i])
        _, file, row = self._places[i]
        if self._open is None or self._open[0] != file:  # neighbours share a shard
            self._open = file, FeatureReader(self.folder / FEATURES_FOLDER / file)
        return self._open[1].packed(row).unpack()


# -- the search ----------------------------------------------------------------------------------


def make_index(motions: StoredMotions, weights: Weights | None = None) -> MotionIndex:
    """Return the index of a library's motions, in memory."""
    return MotionIndex.of(motions, _space_of(motions, weights))


def _space_of(motions: StoredMotions, weights: Weights | None = None) -> FeatureSpace:
    """Return the space of a library's motions, found from an even choice of them if they are many.

    It takes a few thousand clips to know along which axes people move, and not all of a million.
    """
    return FeatureSpace.fit(motions[:: max(1, len(motions) // SPACE_CLIPS)], weights)


def refresh_index(folder: Path, catalogue: Catalogue) -> bool:
    """Bring search.h5 and models.h5 up to date with the catalogue; return whether they were not.

    Only the library's only writer may.
    """
    places = catalogue.feature_places()
    stamp = _stamp(places)
    stale = not _is_sound(folder / SEARCH_FILE, stamp)
    if not places:
        for file in (SEARCH_FILE, MODELS_FILE):
            (folder / file).unlink(missing_ok=True)
        return stale
    if stale:
        _write_index(folder / SEARCH_FILE, StoredMotions(folder, places), catalogue, stamp)
    labelled = _labelled(catalogue)
    model_stamp = _model_stamp(labelled)
    if not _is_sound(folder / MODELS_FILE, model_stamp):
        index, _ = _read_index(folder / SEARCH_FILE)
        _write_models(folder / MODELS_FILE, _learn(folder, labelled, index.space), model_stamp)
        stale = True
    return stale


def open_index(folder: Path, places: Sequence[Place]) -> tuple[MotionIndex, IntArray]:
    """Return the index of a library and the catalogue's row of each of its clips.

    Where search.h5 is stale, because a build was killed before it came to write it, the index is
    made in memory.
    """
    if _is_sound(folder / SEARCH_FILE, _stamp(places)):
        return _read_index(folder / SEARCH_FILE)
    return make_index(StoredMotions(folder, places)), _clip_rows(places)


def _clip_rows(places: Sequence[Place]) -> IntArray:
    return np.array([clip_id for clip_id, _, _ in places], dtype=np.int64)


def _write_index(path: Path, motions: StoredMotions, catalogue: Catalogue, stamp: str) -> None:
    """Write the frames part by part: the library need not fit into memory."""
    digests = np.array([_short_digest(text) for text in catalogue.feature_digests()])
    old, rows, n_fitted = _to_copy(path, digests)
    space = old.space if old else _space_of(motions)
    counts = np.diff(old.frames.starts)[rows] if old else np.zeros(len(rows), dtype=np.int64)
    for new in np.flatnonzero(rows < 0):
        counts[new] = len(motions[int(new)])
    starts, sketch_starts = _starts(counts), _starts(-(-counts // SKETCH_FRAMES))
    about = {"weights": np.array(astuple(space.weights)), "fitted": n_fitted}
    coded_units = {"units": "1/16 deviation", "dims": "frame,axis"}
    with _replacing(path, stamp) as file:
        file.attrs.update(about)
        frames = file.create_dataset("frames", (int(starts[-1]), space.n_dims), dtype="i1")
        sketch = file.create_dataset("sketch", (int(sketch_starts[-1]), SKETCH_AXES), dtype="i1")
        frames.attrs.update(coded_units)
        sketch.attrs.update(coded_units)
        signatures = np.zeros((len(motions), 2 * space.n_dims), dtype=np.float32)
        usual = np.ones(len(motions), dtype=np.uint8)
        for first, end in _runs(rows):
            own = slice(starts[first], starts[end])
            own_sketch = slice(sketch_starts[first], sketch_starts[end])
            if rows[first] < 0:
                motion = motions[first]
                usual[first] = not space.is_outlying(motion)
                coded = code_clip(space, space.frames(motion))
                frames[own], sketch[own_sketch] = coded.frames, coded.sketch
                signatures[first] = coded.signature
            elif old:
                frames[own] = old.frames.of_clips(rows[first], rows[end - 1])
                sketch[own_sketch] = old.sketch.of_clips(rows[first], rows[end - 1])
                signatures[first:end] = old.signatures[rows[first] : rows[end - 1] + 1]
                usual[first:end] = old.usual[rows[first] : rows[end - 1] + 1]
        del old  # its memory is the file that is to be replaced
        add_datasets(
            file,
            [
                ("starts", starts, "frame", "clip+1"),
                ("sketch_starts", sketch_starts, "frame", "clip+1"),
                ("clips", _clip_rows(catalogue.feature_places()), "1", "clip"),
                ("digests", digests, "1", "clip"),
                ("signatures", signatures, "metre", "clip,axis"),
                ("usual", usual, "1", "clip"),
                ("mean", space.mean, "metre", "feature"),
                ("axes", space.axes, "1", "feature,axis"),
                ("deviations", space.deviations, "metre", "axis"),
            ],
        )


def _short_digest(text: str) -> int:
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little", signed=True)


def _to_copy(path: Path, digests: IntArray) -> tuple[MotionIndex | None, IntArray, int]:
    """Return an index to copy clips from, each clip's row in it or -1, and its `fitted`.

    None, where its space was found in less than half as many clips: find a new one then.
    """
    nothing = None, np.full(len(digests), -1), len(digests)
    try:
        with _opened(path) as file:
            known, n_fitted = file["digests"][:], int(file.attrs["fitted"])
            stretched = file["deviations"][:].max(initial=0.0) > OUTLYING_M
        old, _ = _read_index(path)
    except LibraryError:
        return nothing
    row_of = {int(digest): row for row, digest in enumerate(known)}
    rows = np.array([row_of.get(int(digest), -1) for digest in digests])
    if stretched or min(n_fitted, int((rows >= 0).sum())) < KNOWN_SHARE * len(rows):
        return nothing
    return old, rows, n_fitted


def _runs(rows: IntArray) -> list[tuple[int, int]]:
    """Return ranges of clips whose rows follow one another; a clip of row -1 is one alone."""
    breaks = np.flatnonzero((np.diff(rows) != 1) | (rows[:-1] < 0)) + 1
    return list(pairwise([0, *breaks.tolist(), len(rows)]))


def _starts(counts: IntArray) -> IntArray:
    return np.concatenate([[0], np.cumsum(counts)])


def _read_index(path: Path) -> tuple[MotionIndex, IntArray]:
    with _opened(path) as file:
        weights = Weights(*file.attrs["weights"])
        parts = (file[name][:] for name in ("mean", "axes", "deviations"))
        space = FeatureSpace(weights, *parts)
        steps = steps_of(space)
        frames = Frames(_mapped(path, file["frames"]), steps, file["starts"][:])
        sketch = Frames(
            _mapped(path, file["sketch"]), steps[:SKETCH_AXES], file["sketch_starts"][:]
        )
        signatures = file["signatures"][:]
        usual = file["usual"][:] if "usual" in file else np.ones(len(signatures))
        index = MotionIndex(space, frames, sketch, signatures, usual.astype(np.bool_))
        return index, file["clips"][:]


def _mapped(path: Path, dataset: Any) -> NDArray[np.int8]:
    """Return a contiguous dataset as memory that is read when it is touched."""
    offset = dataset.id.get_offset()
    if offset is None or dataset.size == 0:
        return np.asarray(dataset[:])
    return np.memmap(path, dataset.dtype, "r", offset, dataset.shape)


# -- the classes ---------------------------------------------------------------------------------


def open_models(folder: Path, catalogue: Catalogue) -> ClassIndex:
    """Return the classes of a library; learned now where models.h5 is stale."""
    labelled = _labelled(catalogue)
    if _is_sound(folder / MODELS_FILE, _model_stamp(labelled)):
        return _read_models(folder / MODELS_FILE)
    index, _ = open_index(folder, catalogue.feature_places())
    return _learn(folder, labelled, index.space)


def _labelled(catalogue: Catalogue) -> list[tuple[Place, ClipRecord]]:
    """Return the clips that classes are learned from."""
    records = {record.id: record for record in catalogue.records()}
    placed = ((place, records[place[0]]) for place in catalogue.feature_places())
    return [
        (place, record)
        for place, record in placed
        if record.label and record.label not in NOT_LEARNED
    ]


def _learn(
    folder: Path, labelled: Sequence[tuple[Place, ClipRecord]], space: FeatureSpace
) -> ClassIndex:
    """Learn the classes of a library from its labelled clips; none if there are none."""
    from mocapdb.indexing.recognition.class_models import ClassIndex

    if not labelled:
        return ClassIndex()
    return ClassIndex().fit(
        StoredMotions(folder, [place for place, _ in labelled]),
        [str(record.label) for _, record in labelled],
        groups=[record.performer or record.name for _, record in labelled],
        space=space,
    )


def _write_models(path: Path, classes: ClassIndex, stamp: str) -> None:
    from mocapdb.indexing.recognition.class_models import ARRAYS

    about = {"labels": json.dumps(classes.labels), "settings": json.dumps(classes.settings())}
    with _replacing(path, stamp) as file:
        file.attrs.update(about)
        arrays = classes.to_arrays()
        add_datasets(file, [(name, values, *ARRAYS[name]) for name, values in arrays.items()])


def _read_models(path: Path) -> ClassIndex:
    from mocapdb.indexing.recognition.class_models import ClassIndex

    with _opened(path, "not readable as class models") as file:
        return ClassIndex.from_arrays(
            json.loads(file.attrs["labels"]),
            json.loads(file.attrs["settings"]),
            {name: file[name][:] for name in file},
        )


# -- files ---------------------------------------------------------------------------------------


def _stamp(places: Sequence[Place]) -> str:
    """Return a digest of which clips there are and where their features lie."""
    return hashlib.sha256(repr([INDEX_FORMAT, *places]).encode()).hexdigest()


def _model_stamp(labelled: Sequence[tuple[Place, ClipRecord]]) -> str:
    """Return a digest of which clips classes are learned from."""
    learned = [(place, record.label) for place, record in labelled]
    return hashlib.sha256(repr([INDEX_FORMAT, learned]).encode()).hexdigest()


def _is_sound(path: Path, stamp: str) -> bool:
    """Return whether a derived file is there, was made from that, and in a space of use.

    Earlier versions let a clip that lies 10 km away stretch the space, until nothing in it could be
    told apart: no people move by so much.
    """
    try:
        with _opened(path) as file:
            deviations = file.get("deviations", file.get("space_deviations"))
            stretched = deviations is not None and deviations[:].max(initial=0.0) > OUTLYING_M
            return str(file.attrs["stamp"]) == stamp and not stretched
    except LibraryError:
        return False


def _opened(path: Path, unreadable: str = "not a readable index") -> AbstractContextManager[Any]:
    return opened(path, unreadable, f"Remove it and run: mocapdb index {path.parent}")


@contextmanager
def _replacing(path: Path, stamp: str) -> Iterator[Any]:
    """Yield an HDF5 file that takes the place of `path` when it is complete."""
    import h5py

    with (
        replacing(path, failed=_cannot_write, one_writer=True) as (partial,),
        h5py.File(partial, "w", libver=("earliest", "v108")) as file,
    ):
        file.attrs.update(format=INDEX_FORMAT, stamp=stamp)
        yield file


def _cannot_write(path: Path, problem: OSError) -> LibraryError:
    return LibraryError(
        f"{path}: cannot write ({problem.strerror or problem}). Free space on the disk and "
        f"run: mocapdb index {path.parent}"
    )
