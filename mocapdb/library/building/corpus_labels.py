"""What a label file or a manifest says of a corpus: read only if a plan needs it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from mocapdb.library.hdf5 import file_sha256

if TYPE_CHECKING:
    from mocapdb.base.arrays import StrPath
    from mocapdb.corpus.labels import Labels

__all__ = ["CorpusLabels"]


class CorpusLabels:
    """The labels of a corpus: from a file that is named, else its own LABELS.csv.

    Parameters
    ----------
    root : Path
        The corpus folder.
    labels, manifest : path-like, optional
    """

    def __init__(self, root: Path, labels: StrPath | None, manifest: StrPath | None) -> None:
        self._root = root
        self._labels = labels
        self._manifest = manifest

    def read(self) -> Labels | None:
        """Return what is said.

        Raises
        ------
        CorpusError
            If a file is named that cannot be used.
        """
        from mocapdb.corpus.labels import Labels, find_labels, read_labels
        from mocapdb.corpus.manifest import read_manifest

        if self._labels is None and self._manifest is not None:
            return Labels.from_manifest(read_manifest(self._manifest))
        found = self._labels if self._labels is not None else find_labels(self._root)
        return None if found is None else read_labels(found, self._root)

    def digest(self) -> str | None:
        """Return what tells their content from any other; None where it cannot be known."""
        from mocapdb.corpus.labels import LABELS_NAME

        root = self._root.resolve()
        named = self._labels if self._labels is not None else self._manifest
        places = [Path(named)] if named is not None else [root, root.parent]
        if named is None:
            places = [place / LABELS_NAME for place in places]
        try:
            for place in places:
                if named is not None or place.is_file():
                    role = "labels" if self._labels is not None or named is None else "manifest"
                    return f"{role} {place.resolve()} {file_sha256(place)}"
        except OSError:
            return None
        return ""
