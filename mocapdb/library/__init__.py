"""Libraries of compressed clips: built, read, searched and kept sound.

`Library` reads. What builds, searches and looks after libraries stands beside it and uses it.

===============  ========================================================================
`library`        `Library`: listing, decoding and exporting what is there
`addresses`      libraries in object storage, and where this machine has copies of them
`remote`         copying what is read of them
`catalogue`      the SQLite file that says what is there, as it is read
`clip_record`    its row of a clip
`revision`       its row of a clip that was cleaned
`facets`         numbers that clips are chosen by: how fast the root goes, and others
`words`          finding clips by words, their stems, and other words for the same
`joint_losses`   what each joint of a clip lost of its own motion
`database`       how the SQLite file is opened, and what its errors say
`shards`         the HDF5 files that hold the payloads, as they are read
`stored_clip`    a clip as another process decodes it, without the catalogue
`shard_entries`  what a shard says of its payloads, so that no catalogue is needed
`row_checksums`  checksums of the catalogue's rows
`index_pieces`   the search index on the disk, as it is read
`cycles_file`    the cycles of classes that a library keeps
`outlying`       clips that lie so far off that the search is made without them
`hdf5`           what its HDF5 files have in common: versions, described datasets, errors
`layout`         names of the files and folders of a library
`naming`         what clips are called, and who performs them
`tuning`         the tuned numbers
`writing`        one writer at a time: the lock, the catalogue, the shards
`building`       a folder of motion files to a library
`searching`      the index, queries by example, classes, their cycles
`training`       windows of motion as a dataset
`upkeep`         checking, compacting, indexing
===============  ========================================================================
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.library.building.assumptions import Assumptions as Assumptions
    from mocapdb.library.building.build import build_library as build_library
    from mocapdb.library.building.commit_clips import BuildReport as BuildReport
    from mocapdb.library.building.settings import BuildSettings as BuildSettings
    from mocapdb.library.clip_record import ClipRecord as ClipRecord
    from mocapdb.library.facets import FACETS as FACETS
    from mocapdb.library.facets import FacetRange as FacetRange
    from mocapdb.library.facets import Facets as Facets
    from mocapdb.library.library import Library as Library
    from mocapdb.library.revision import Revision as Revision
    from mocapdb.library.searching.many_libraries import query_libraries as query_libraries
    from mocapdb.library.searching.retrieval import Filter as Filter
    from mocapdb.library.searching.retrieval import Growth as Growth
    from mocapdb.library.searching.retrieval import Hit as Hit
    from mocapdb.library.searching.retrieval import Retrieval as Retrieval
    from mocapdb.library.searching.saved_queries import SavedQuery as SavedQuery
    from mocapdb.library.searching.saved_queries import forget_query as forget_query
    from mocapdb.library.searching.saved_queries import save_query as save_query
    from mocapdb.library.training.motion_windows import MotionWindows as MotionWindows
    from mocapdb.library.upkeep.clean import clean_library as clean_library
    from mocapdb.library.upkeep.clean import undo_cleaning as undo_cleaning
    from mocapdb.library.upkeep.compact import compact_library as compact_library
    from mocapdb.library.upkeep.index import apply_labels as apply_labels
    from mocapdb.library.upkeep.index import index_library as index_library
    from mocapdb.library.upkeep.index import take_labels_back as take_labels_back
    from mocapdb.library.upkeep.recover import recover_library as recover_library
    from mocapdb.library.upkeep.verify import verify_library as verify_library

__getattr__, __dir__, __all__ = attach(__name__)
