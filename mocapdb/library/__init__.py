"""Libraries of compressed clips: build, open, list, decode, export, verify.

==============  ==================================================================================
`Library`       an open library
`build`         a folder of motion files to a library
`plan`          which files a build has to encode
`naming`        what clips are called
`catalogue`     the SQLite file that says what is there; its commit is the commit
`shards`        the HDF5 files that hold the payloads
`cycles`        the cycles of classes that a library keeps
`lock`          one writer at a time
==============  ==================================================================================
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.library.build import BuildReport as BuildReport
    from mocapdb.library.build import BuildSettings as BuildSettings
    from mocapdb.library.build import build_library as build_library
    from mocapdb.library.library import Library as Library

__getattr__, __dir__, __all__ = attach(__name__)
