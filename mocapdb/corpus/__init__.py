"""Where clips come from: manifests, downloads, labels, and the synthetic corpus.

==========================  ======================================================================
`read_manifest`             the clips of the CMU database, what they show and where they are
`select`                    entries of a manifest by clip, subject or class
`mocapdb.corpus.fetch`      downloading them: `plan` and `fetch`
`find_labels`               the label file that belongs to a folder
`read_labels`, `Labels`     class, frame rate and description of the clips of a folder
`classify_description`      the class of `CLASSES` that a description speaks of
`mocapdb.corpus.synthetic`  a corpus that is made, with known truth
==========================  ======================================================================

Names and submodules load when they are first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocapdb.corpus import fetch as fetch
    from mocapdb.corpus import synthetic as synthetic
    from mocapdb.corpus.labels import LabelRow, Labels, find_labels, read_labels
    from mocapdb.corpus.manifest import ManifestEntry, read_manifest, select
    from mocapdb.corpus.vocabulary import CLASSES, classify_description

__all__ = [
    "CLASSES",
    "LabelRow",
    "Labels",
    "ManifestEntry",
    "classify_description",
    "fetch",
    "find_labels",
    "read_labels",
    "read_manifest",
    "select",
    "synthetic",
]

_SUBMODULES = {"fetch", "synthetic"}
_HOMES = {
    "CLASSES": "vocabulary",
    "LabelRow": "labels",
    "Labels": "labels",
    "ManifestEntry": "manifest",
    "classify_description": "vocabulary",
    "find_labels": "labels",
    "read_labels": "labels",
    "read_manifest": "manifest",
    "select": "manifest",
}


def __getattr__(name: str) -> Any:
    if name in _SUBMODULES:
        return importlib.import_module(f"{__name__}.{name}")
    if name in _HOMES:
        return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
