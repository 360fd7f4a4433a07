"""mocapdb turns a folder of motion-capture files into a compressed, searchable library.

=============  ===================================================================================
`motion`       skeletons, clips, kinematics, representations, skin
`io`           ASF/AMC, BVH and NPZ files
`corpus`       the CMU manifest, downloads, labels, and synthetic motion with known truth
`compression`  codecs that keep an error you name
`library`      libraries on disk: build, open, decode, export, verify
`plots`        every still picture, one function each
`scenes`       clips in motion: GIF, MP4, a page that plays them
`report`       a library on one page
`viewer`       a library in a browser
`reproduce`    the papers' tables beside ours
`cli`          the ``mocapdb`` command
=============  ===================================================================================

The names most programs need are here; they load on first use, so that the import is quick.

Examples
--------
>>> import mocapdb
>>> clip = mocapdb.read_clip("02_03.amc")  # doctest: +SKIP
>>> with mocapdb.Library("cmu.mocapdb") as library:  # doctest: +SKIP
...     walk = library.clip("07_01")
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocapdb.compression import Target
    from mocapdb.errors import MocapdbError
    from mocapdb.io import read_clip, write_clip
    from mocapdb.library import BuildSettings, Library, build_library
    from mocapdb.motion.clip import Clip
    from mocapdb.motion.skeleton import Skeleton

__version__ = "0.1.0"

_HOMES = {
    "BuildSettings": "mocapdb.library",
    "Clip": "mocapdb.motion.clip",
    "Library": "mocapdb.library",
    "MocapdbError": "mocapdb.errors",
    "Skeleton": "mocapdb.motion.skeleton",
    "Target": "mocapdb.compression",
    "build_library": "mocapdb.library",
    "read_clip": "mocapdb.io",
    "write_clip": "mocapdb.io",
}

__all__ = [  # noqa: RUF022 - the version stands apart
    "__version__",
    "BuildSettings",
    "Clip",
    "Library",
    "MocapdbError",
    "Skeleton",
    "Target",
    "build_library",
    "read_clip",
    "write_clip",
]


def __getattr__(name: str) -> Any:
    """Load a name from its home on first use."""
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
