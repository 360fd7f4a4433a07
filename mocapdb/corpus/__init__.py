"""Where clips come from: manifests, downloads, labels, and the synthetic corpus.

===============  =================================================================================
`manifest`       the clips of the CMU database, what they show and where they are: `read_manifest`
`fetch`          downloading them: `plan` and `fetch`
`_transfer`      one file over HTTP, with resume, retries and checks
`labels`         class, frame rate and description of the clips of a folder: `read_labels`
`columns`        names of further columns, and those that are reserved
`name_patterns`  what a file's name says, by a pattern
`class_rules`    the classes of motion, and the one that a description speaks of
`_table`         reading small CSV files, with errors that name the line
`synthetic`      a corpus that is made, with known truth
`tuning`         the chosen numbers of synthetic motion, each with its unit and origin
===============  =================================================================================

Names and submodules load when they are first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.corpus import fetch as fetch
    from mocapdb.corpus import synthetic as synthetic
    from mocapdb.corpus.class_rules import CLASSES as CLASSES
    from mocapdb.corpus.class_rules import classify_description as classify_description
    from mocapdb.corpus.labels import LabelRow as LabelRow
    from mocapdb.corpus.labels import Labels as Labels
    from mocapdb.corpus.labels import find_labels as find_labels
    from mocapdb.corpus.labels import read_labels as read_labels
    from mocapdb.corpus.manifest import ManifestEntry as ManifestEntry
    from mocapdb.corpus.manifest import read_manifest as read_manifest
    from mocapdb.corpus.manifest import select as select

__getattr__, __dir__, __all__ = attach(__name__)
