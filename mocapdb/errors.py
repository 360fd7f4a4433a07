"""Every error that mocapdb raises on purpose.

::

    MocapdbError
    ├── FormatError          a motion file breaks its format (knows path and line)
    ├── SkeletonError        joints, channels or skeletons that do not fit together
    ├── ClipError            a clip, frame range or frame rate that cannot be used
    ├── CorpusError          a corpus folder, manifest or label file that cannot be used
    │   └── FetchError       a download that failed for good
    ├── CycleError           a setting of a cycle, or cycles, that do not fit
    │   └── NoPeriodError        a clip in which nothing repeats
    ├── GaitError            a body without feet, a clip without a stride
    ├── CodecError           a target that cannot be met, a payload that cannot be decoded
    ├── LibraryError         a library that cannot be opened, read or written
    │   ├── NoClipFitsError      no clip is as a search asks for
    │   ├── UnknownClipError     no such clip, or an ambiguous name
    │   └── LibraryLockedError   another process is writing
    ├── WorkerError          processes or a cluster that cannot do the work
    └── MissingExtraError    an optional dependency that is not installed

A message says where, what was expected, what was found, and what to do. The command line prints
it as it is and exits with 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike

__all__ = [
    "ClipError",
    "CodecError",
    "CorpusError",
    "CycleError",
    "FetchError",
    "FormatError",
    "GaitError",
    "LibraryError",
    "LibraryLockedError",
    "MissingExtraError",
    "MocapdbError",
    "NoClipFitsError",
    "NoPeriodError",
    "SkeletonError",
    "UnknownClipError",
    "WorkerError",
]


class MocapdbError(Exception):
    """Base of every error that mocapdb raises on purpose."""


class FormatError(MocapdbError):
    """A motion file that breaks its format.

    Parameters
    ----------
    path : path-like
        The file.
    message : str
        What was expected and what was found.
    line : int, optional
        The 1-based line, where one line is to blame.
    """

    def __init__(self, path: str | PathLike[str], message: str, line: int | None = None) -> None:
        self.path = str(path)
        self.line = line
        self.message = message
        super().__init__(path, message, line)  # what pickle (joblib's workers) rebuilds it from

    def __str__(self) -> str:
        where = self.path if self.line is None else f"{self.path}:{self.line}"
        return f"{where}: {self.message}"


class SkeletonError(MocapdbError):
    """Joints, channels or skeletons that do not fit together."""


class ClipError(MocapdbError):
    """A clip, a frame range or a frame rate that cannot be used."""


class CorpusError(MocapdbError):
    """A corpus folder, a manifest or a label file that cannot be used."""


class FetchError(CorpusError):
    """A download that failed for good."""


class CodecError(MocapdbError):
    """A target that cannot be met, or a payload that cannot be decoded."""


class CycleError(MocapdbError):
    """A setting of a cycle's extraction, or cycles, that do not fit."""


class NoPeriodError(CycleError):
    """A clip in which nothing repeats, or not often enough."""


class GaitError(MocapdbError):
    """A body without feet, or a clip without a stride."""


class LibraryError(MocapdbError):
    """A library that cannot be opened, read or written."""


class UnknownClipError(LibraryError):
    """A clip name that is not in the library, or that fits several clips.

    Parameters
    ----------
    message : str
        What was asked for.
    candidates : sequence of str, optional
        Names that would have been understood.
    """

    def __init__(self, message: str, candidates: Sequence[str] = ()) -> None:
        self.candidates = tuple(candidates)
        super().__init__(message, self.candidates)

    def __str__(self) -> str:
        return str(self.args[0])


class NoClipFitsError(LibraryError):
    """No clip of a library is as a search asks for: of a class, a column, a range."""


class LibraryLockedError(LibraryError):
    """Another process is writing to the library."""


class WorkerError(MocapdbError):
    """Processes or a Dask cluster that cannot do the work: not there, gone, or unlike this one."""


class MissingExtraError(MocapdbError):
    """An optional dependency that is not installed.

    Parameters
    ----------
    package : str
        What could not be imported.
    extra : str
        The extra of mocapdb that installs it.
    """

    def __init__(self, package: str, extra: str) -> None:
        self.package = package
        self.extra = extra
        super().__init__(package, extra)

    def __str__(self) -> str:
        return f"{self.package} is not installed. Run: pip install 'mocapdb[{self.extra}]'"
