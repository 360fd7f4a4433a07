"""Files that are there whole or not at all, also after a loss of power."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from tempfile import mkstemp
from typing import TYPE_CHECKING

from mocapdb.errors import FormatError, MocapdbError

if TYPE_CHECKING:
    from mocapdb.base.arrays import StrPath

__all__ = [
    "PARTIAL_SUFFIX",
    "advice_to_write",
    "expect_file",
    "expect_no_pipe",
    "keeping_inputs",
    "make_folder",
    "partial_path",
    "plain_file_name",
    "replacing",
    "sync",
    "write_whole",
]

PARTIAL_SUFFIX = ".partial"

Failed = Callable[[Path, OSError], MocapdbError]
"""What to raise when a file cannot be written: from its path and what the system said."""


def cannot_write(path: Path, problem: OSError) -> FormatError:
    """Return the error for a motion file, picture or page that cannot be written."""
    reason = problem.strerror or problem
    return FormatError(path, f"Expected a place that can be written to, but got: {reason}.")


def advice_to_write(problem: OSError) -> str:
    """Return what is to be done where a file could not be written, as the start of a sentence."""
    if problem.errno in {errno.ENOSPC, errno.EDQUOT}:
        return "Free space on the disk"
    if problem.errno in {errno.EACCES, errno.EPERM, errno.EROFS}:
        return "Make it writable"
    return "Check the disk"


_inputs: ContextVar[set[tuple[int, int]] | None] = ContextVar("inputs", default=None)
"""The files read so far, by device and number, where they are not to be written over."""


@contextmanager
def keeping_inputs() -> Iterator[None]:
    """Refuse, within a block, to write over a file that is read in it.

    ``mocapdb clean take.bvh -o take.bvh`` would leave nothing of what was captured.
    """
    token = _inputs.set(set())
    try:
        yield
    finally:
        _inputs.reset(token)


def expect_file(path: StrPath) -> None:
    """Note that a file is read, which is then not written over; refuse what `expect_no_pipe` does.

    Raises
    ------
    OSError
        If nothing can be found out, or it is a pipe or a device.
    """
    found = expect_no_pipe(path)
    if (inputs := _inputs.get()) is not None:
        inputs.add((found.st_dev, found.st_ino))


def expect_no_pipe(path: StrPath) -> os.stat_result:
    """Refuse to read a pipe, which may wait for ever, and a device, which may have no end.

    Raises
    ------
    OSError
        If that is what is there, or nothing can be found out.
    """
    found = Path(path).stat()
    kind = stat.S_IFMT(found.st_mode)
    if kind not in {stat.S_IFREG, stat.S_IFDIR}:
        raise OSError(errno.EINVAL, "it is a pipe or a device and no file", os.fspath(path))
    return found


def partial_path(path: Path) -> Path:
    """Return where a file stands until it is complete, if only one process writes it."""
    return path.with_name(path.name + PARTIAL_SUFFIX)


@contextmanager
def replacing(
    *targets: StrPath, failed: Failed = cannot_write, one_writer: bool = False
) -> Iterator[list[Path]]:
    """Give a temporary file beside each target; put all in place at the end, or none.

    Every file is on the disk before it takes its target's name.

    Parameters
    ----------
    targets : path
    failed : callable
        Makes the error to raise from a target and the system's own.
    one_writer : bool
        Name the temporary file `partial_path`, so that what a killed process leaves is known by
        its name. By default it has a name of its own, since several may write the same target.

    Raises
    ------
    MocapdbError
        What `failed` makes, if a file cannot be written; nothing is left behind.
    """
    paths = [Path(target) for target in targets]
    temporaries: list[Path] = []
    current = paths[0]
    try:
        for path in paths:
            current = path
            _expect_replaceable(path)
            temporaries.append(_reserve(path, one_writer))
        yield temporaries
        for path in paths:  # before any file is moved, check that all can be
            current = path
            if path.is_dir():
                raise IsADirectoryError(errno.EISDIR, f"{path.name} is a folder")
        for temporary, path in zip(temporaries, paths, strict=True):
            current = path
            sync(temporary)
            temporary.replace(path)
        for folder in {path.parent for path in paths}:
            sync(folder)
    except OSError as problem:
        raise failed(current, problem) from None
    finally:
        for temporary in temporaries:
            temporary.unlink(missing_ok=True)


def write_whole(
    target: StrPath, content: bytes, *, failed: Failed = cannot_write, one_writer: bool = False
) -> None:
    """Write a file, whole or not at all; see `replacing`.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     write_whole(Path(folder, "note.txt"), b"here")
    ...     Path(folder, "note.txt").read_bytes()
    b'here'
    """
    with replacing(target, failed=failed, one_writer=one_writer) as (temporary,):
        temporary.write_bytes(content)


def _expect_replaceable(path: Path) -> None:
    """Refuse a target that says it is not to be changed, or that is an input of the command."""
    try:
        found = path.stat()
    except OSError:
        return  # nothing is there, or what is wrong shows when it is written
    if (found.st_dev, found.st_ino) in (_inputs.get() or ()):
        raise OSError(errno.EEXIST, "it is read here and would be lost; name another file")
    if stat.S_ISREG(found.st_mode) and not found.st_mode & 0o222:
        raise PermissionError(errno.EACCES, "the file is read-only")


def _reserve(path: Path, one_writer: bool) -> Path:
    """Make an empty file to write in place of a target."""
    if one_writer:
        partial = partial_path(path)
        partial.unlink(missing_ok=True)  # a link would be written through
        partial.write_bytes(b"")
        return partial
    handle, name = mkstemp(PARTIAL_SUFFIX, f".{path.name}.", path.parent)
    temporary = Path(name)
    try:
        os.close(handle)
        temporary.chmod(0o666 & ~_umask())  # only their owner may read temporary files
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
    return temporary


def make_folder(path: Path) -> None:
    """Make a folder and those above it where they are missing; their names are on the disk then."""
    above = [path, *path.parents]
    missing = [each for each in above if not each.exists()]
    path.mkdir(parents=True, exist_ok=True)
    for each in reversed(missing):
        sync(each.parent)


def plain_file_name(name: str) -> str:
    """Return a clip's name as every system can have it in the name of a file.

    Examples
    --------
    >>> plain_file_name("walks/take 1?")
    'walks-take 1-'
    """
    return "".join(
        "-" if letter in '<>:"/\\|?*' or not letter.isprintable() else letter for letter in name
    )


def sync(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    is_folder = path.is_dir()
    if is_folder and os.name != "posix":
        return  # other systems cannot
    handle = os.open(path, os.O_RDONLY if is_folder else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _umask() -> int:
    """Return the process's file mode mask, which can only be read by setting it."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
