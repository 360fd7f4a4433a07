"""The classes of a library: ``models.h5``, learned from the labelled clips.

Learning takes time with the size of a library, so classes stay as they are while they lack but a
few clips. The catalogue notes each clip that they do not know as it is.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import numpy as np

from mocapdb.base.files import advice_to_write
from mocapdb.errors import LibraryError
from mocapdb.indexing.search.features import FeatureSpace
from mocapdb.indexing.tuning import OUTLYING_M
from mocapdb.library.catalogue import Catalogue
from mocapdb.library.hdf5 import add_datasets, opened
from mocapdb.library.layout import MODELS_FILE
from mocapdb.library.naming import UNKNOWN
from mocapdb.library.searching.search_index import Place, StoredMotions, open_index
from mocapdb.library.tuning import NEW_SHARE
from mocapdb.library.writing.catalogue_writer import CatalogueWriter
from mocapdb.library.writing.derived_files import replacing_derived

if TYPE_CHECKING:  # scikit-learn is slow to import, and a query can do without
    from mocapdb.indexing.recognition.class_models import ClassIndex

__all__ = ["clips_not_learned", "count_classes", "open_models", "refresh_classes"]

MODELS_FORMAT = 3
NOT_LEARNED = frozenset({UNKNOWN, "other", "mixed", "calibration", "sequence"})
"""Labels that name no motion, so that no class is learned from them (docs/classes.md)."""


@dataclass(frozen=True)
class Labelled:
    """A clip that classes are learned from: where its features are, and what is said of it."""

    place: Place
    name: str
    label: str
    performer: str


@dataclass(frozen=True)
class Lacking:
    """What classes that are of use do not know.

    Attributes
    ----------
    clips : int
        Labelled clips that are new to them.
    beside : list of int
        Rows of clips that have changed and have nothing to do with classes.
    """

    clips: int
    beside: list[int]


def open_models(catalogue: Catalogue) -> ClassIndex:
    """Return the classes of a library; learned now where models.h5 is stale."""
    if _lacking(catalogue) is not None:
        return _read_models(catalogue.path.parent / MODELS_FILE)
    index, _ = open_index(catalogue)
    return _learn(catalogue, _labelled(catalogue), index.space)


def count_classes(catalogue: Catalogue) -> int:
    """Return how many classes are learned; quicker than to open them."""
    if _lacking(catalogue) is None:
        return len(open_models(catalogue).labels)
    with _opened(catalogue.path.parent / MODELS_FILE) as file:
        return len(json.loads(file.attrs["labels"]))


def clips_not_learned(catalogue: Catalogue) -> int:
    """Return how many labelled clips the classes do not know yet: they are too few to matter."""
    lacking = _lacking(catalogue)
    return 0 if lacking is None else lacking.clips


def refresh_classes(catalogue: CatalogueWriter, *, anew: bool = False) -> None:
    """Learn the classes if they are of no use any more, or lack a clip and are to be `anew`."""
    path = catalogue.path.parent / MODELS_FILE
    if not catalogue.has_searchable():
        catalogue.drop_derived(path)
        return
    lacking = _lacking(catalogue)
    if lacking is not None and not (lacking.clips and anew):
        if lacking.beside:
            with catalogue.transaction():
                catalogue.keep_learned(lacking.beside)
        return
    labelled = _labelled(catalogue)
    index, _ = open_index(catalogue)
    _write_models(path, _learn(catalogue, labelled, index.space), catalogue, labelled)
    with catalogue.transaction():
        catalogue.keep_learned()


def _lacking(catalogue: Catalogue) -> Lacking | None:
    """Return what models.h5 does not know, if it is otherwise of use; else None.

    It is of no use once a clip that it has learned from is another, or gone, or has another label;
    nor if a class is missing, or more than a small share of the clips.
    """
    path = catalogue.path.parent / MODELS_FILE
    if not catalogue.is_as_written(path):
        return None
    try:
        with _opened(path) as file:
            deviations = file.get("space_deviations")
            if deviations is not None and deviations[:].max(initial=0.0) > OUTLYING_M:
                return None  # see `search_index`
            if "clips" not in file or "example_frames" not in file:
                return None  # of an earlier version
            changed = catalogue.unlearned()
            if not changed:
                return Lacking(0, [])
            learned, labels = file["clips"][:], set(json.loads(file.attrs["labels"]))
    except LibraryError:
        return None
    new = _labelled(catalogue, changed)
    if np.isin(changed, learned).any() or not {each.label for each in new} <= labels:
        return None
    if len(new) > NEW_SHARE * len(learned):
        return None
    return Lacking(len(new), sorted({*changed} - {each.place[0] for each in new}))


def _labelled(catalogue: Catalogue, only: Iterable[int] | None = None) -> list[Labelled]:
    """Return the clips that classes are learned from; of these rows only, if they are given."""
    places = {place[0]: place for place in catalogue.feature_places(only)}
    return [
        Labelled(places[row], name, label, performer)
        for row, name, label, performer in catalogue.labels(only)
        if row in places and label not in NOT_LEARNED
    ]


def _learn(catalogue: Catalogue, labelled: Sequence[Labelled], space: FeatureSpace) -> ClassIndex:
    """Learn the classes of a library from its labelled clips; none if there are none."""
    from mocapdb.indexing.recognition.class_models import ClassIndex

    if not labelled:
        return ClassIndex()
    return ClassIndex().fit(
        StoredMotions.of(catalogue, [each.place for each in labelled]),
        [each.label for each in labelled],
        groups=[each.performer or each.name for each in labelled],
        space=space,
    )


def _write_models(
    path: Path, classes: ClassIndex, catalogue: CatalogueWriter, labelled: Sequence[Labelled]
) -> None:
    import h5py

    from mocapdb.indexing.recognition.class_models import ARRAYS

    about = {"labels": json.dumps(classes.labels), "settings": json.dumps(classes.settings())}
    clips = np.array([each.place[0] for each in labelled], dtype=np.int64)
    with (
        replacing_derived(catalogue, path, _cannot_write) as partial,
        h5py.File(partial, "w", libver=("earliest", "v108")) as file,
    ):
        file.attrs.update(format=MODELS_FORMAT, **about)
        arrays = classes.to_arrays()
        add_datasets(file, [(name, values, *ARRAYS[name]) for name, values in arrays.items()])
        add_datasets(file, [("clips", clips, "1", "clip")])


def _read_models(path: Path) -> ClassIndex:
    from mocapdb.indexing.recognition.class_models import ClassIndex

    with _opened(path) as file:
        return ClassIndex.from_arrays(
            json.loads(file.attrs["labels"]),
            json.loads(file.attrs["settings"]),
            {name: file[name][:] for name in file if name != "clips"},
        )


def _opened(path: Path) -> AbstractContextManager[Any]:
    advice = f"Remove it and run: mocapdb index {quote(str(path.parent))}"
    return opened(path, "not readable as class models", advice)


def _cannot_write(path: Path, problem: OSError) -> LibraryError:
    return LibraryError(
        f"{path}: cannot write ({problem.strerror or problem}). "
        f"{advice_to_write(problem)} and run: mocapdb index {quote(str(path.parent))}"
    )
