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

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocapdb.library.build import BuildReport, BuildSettings, build_library
    from mocapdb.library.library import Library

__all__ = ["BuildReport", "BuildSettings", "Library", "build_library"]


def __getattr__(name: str) -> Any:
    """Load on first use."""
    if name == "Library":
        from mocapdb.library import library

        return library.Library
    if name in __all__:
        from importlib import import_module

        return getattr(import_module("mocapdb.library.build"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
