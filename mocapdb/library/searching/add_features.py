"""Adding to a library's index the clips that it does not have yet."""

from __future__ import annotations

from mocapdb.base.progress import Progress, silent
from mocapdb.library.library import Library
from mocapdb.library.searching.canonical_shards import (
    PackedMotion,
    commit_features,
    packed_features,
)
from mocapdb.library.searching.search_index import open_models, refresh_index
from mocapdb.library.tuning import COMMIT_CLIPS
from mocapdb.library.writing.catalogue_writer import CatalogueWriter

__all__ = ["add_features"]


def add_features(
    library: Library, catalogue: CatalogueWriter, progress: Progress = silent
) -> dict[str, int]:
    """Compute what is missing for queries from the decoded clips; only the only writer may."""
    missing = catalogue.without_features()
    waiting: list[tuple[int, PackedMotion | None, str | None]] = []
    for done, record in enumerate(missing, start=1):
        waiting.append((record.id, *packed_features(library.clip(record.name))))
        if len(waiting) == COMMIT_CLIPS or done == len(missing):
            with catalogue.transaction():
                commit_features(library.path, catalogue, waiting)
            waiting = []
        progress(done, len(missing), record.name)
    refresh_index(library.path, catalogue)
    places = catalogue.feature_places()
    return {
        "indexed": len(missing),
        "unmapped": len(catalogue.feature_problems()),
        "classes": len(open_models(library.path, catalogue).labels) if places else 0,
    }
