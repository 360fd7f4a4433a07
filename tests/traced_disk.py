"""What a process does to a folder, recorded, stopped and failed call by call; a disk to replay it.

`strace` sees every call, SQLite's and HDF5's too. `Disk` keeps apart what a disk has to have kept
(it was flushed) and what it may have lost: `Disk.after_power_loss` drops, tears and reorders that.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from random import Random

CALLS = (
    "open", "openat", "creat", "read", "pread64", "write", "pwrite64", "writev", "pwritev", "lseek",
    "ftruncate", "truncate", "fallocate", "fsync", "fdatasync", "rename", "renameat", "renameat2",
    "unlink", "unlinkat", "mkdir", "mkdirat", "rmdir", "link", "linkat", "symlink", "symlinkat",
    "copy_file_range", "sendfile", "fcntl", "stat", "lstat", "newfstatat", "fstat", "getdents64",
    "chmod", "fchmod", "fchmodat",
)  # fmt: skip
UNKNOWN = {"writev", "pwritev", "fallocate", "link", "linkat", "symlink", "symlinkat",
           "copy_file_range", "sendfile", "truncate"}  # fmt: skip
LINE = re.compile(r"(\d+) +(\w+)\((.*)\) += (-?\w+|\?)(.*)")
"""Process, call, arguments, result, and what is said of the result."""

UNFINISHED = re.compile(r"(\d+) +(.*) <unfinished \.\.\.>$")
RESUMED = re.compile(r"(\d+) +<\.\.\. \w+ resumed>(.*)$")
SECTOR = 512
SHARED = "-shm"
"""What a file ends with that SQLite maps into memory: nothing that has to last."""


@dataclass(frozen=True)
class Call:
    """A call of the system: its name, the how many-th of that name of its process, its failure."""

    name: str
    number: int
    error: str = "EIO"


@dataclass(frozen=True)
class Step:
    """A change of the folder; paths are relative to it."""

    kind: str  # create, write, cut, sync, rename, remove or make
    path: str
    to: str = ""
    offset: int = 0
    data: bytes = b""


@dataclass
class Trace:
    """What a process has done to a folder, and which of its calls touched it."""

    status: int
    said: str
    steps: list[Step] = field(default_factory=list)
    calls: list[Call] = field(default_factory=list)


def expect_strace() -> None:
    """Exit, and say why, where there is no strace."""
    if shutil.which("strace") is None:
        raise SystemExit("strace is not installed: apt install strace")


def run_traced(
    work: Callable[[], int], folder: Path, call: Call | None = None, *, kill: bool = False
) -> Trace:
    """Run something in a process of its own; record what it does, or stop it at one call.

    Parameters
    ----------
    work : callable
        Returns the status to exit with.
    folder : Path
        Calls that touch it are looked at.
    call : Call, optional
        The one that fails; or, if `kill`, in which the process is killed.

    Returns
    -------
    Trace
        Without steps and calls if one was to fail. The status of a process that was killed is -9.
    """
    # by a signal: a call that waits on a pipe would be counted, or not
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGUSR1})
    with tempfile.TemporaryDirectory() as name:
        said, log = Path(name, "said"), Path(name, "log")
        pid = os.fork()
        if pid == 0:
            status = 99
            try:
                os.setsid()
                output = os.open(said, os.O_WRONLY | os.O_CREAT)
                os.dup2(output, 1)
                os.dup2(output, 2)
                signal.sigwait({signal.SIGUSR1})
                status = work()
            finally:
                os._exit(status)
        # a question mark: not every machine has all of them
        calls, what = ",".join(f"?{each}" for each in CALLS), ["-y", "-xx", "-s", "100000000"]
        if call is not None:
            calls = call.name
            how = "signal=KILL" if kill else f"error={call.error}"
            what = ["-e", f"inject={call.name}:{how}:when={call.number}"]
        tracer = subprocess.Popen(
            ["strace", "-f", "-o", log, "-e", f"trace={calls}", *what, "-p", str(pid)],
            stderr=subprocess.PIPE,
            text=True,
        )
        assert tracer.stderr is not None
        while "attached" not in (line := tracer.stderr.readline()):
            if not line:
                raise RuntimeError(f"strace could not trace: {tracer.wait()}")
        os.kill(pid, signal.SIGUSR1)
        status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
        end_session(pid)
        tracer.stderr.close()
        tracer.wait()
        trace = Trace(status, said.read_text(errors="replace") if said.exists() else "")
        if call is None:
            recorder = Recorder(folder)
            recorder.read(log, str(pid))
            trace.steps, trace.calls = recorder.steps, recorder.calls
    return trace


def end_session(pid: int, patience_s: float = 120.0) -> None:
    """Wait until the workers of a process that has ended are gone, too.

    Raises
    ------
    AssertionError
        If one is left behind.
    """
    until = time.monotonic() + patience_s
    while left := session(pid):
        if time.monotonic() > until:
            for each in left:
                os.kill(each, 9)
            raise AssertionError(f"workers were left behind: {left}")
        time.sleep(0.02)


def session(pid: int) -> list[int]:
    """Return the processes of a session that still run."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[3]) == pid and fields[0] not in "ZX":
            found.append(int(stat.parent.name))
    return found


# -- reading what strace says ----------------------------------------------------------------------


class Recorder:
    """Makes steps of what strace has written of a process and its workers."""

    def __init__(self, folder: Path) -> None:
        self.steps: list[Step] = []
        self.calls: list[Call] = []
        self._root = os.fspath(folder)
        self._hex = "".join(f"\\x{byte:02x}" for byte in self._root.encode())
        self._places: dict[tuple[str, str], int] = {}  # where each process is in its files
        self._there: set[str] = set()

    def read(self, log: Path, main: str) -> None:
        """Read a log; `main` is the process whose calls may be made to fail."""
        begun: dict[str, str] = {}
        counts: Counter[str] = Counter()
        with log.open() as lines:
            for line in lines:
                whole = line.rstrip("\n")
                if unfinished := UNFINISHED.match(whole):
                    begun[unfinished[1]] = f"{unfinished[1]} {unfinished[2]}"
                    continue
                if resumed := RESUMED.match(whole):
                    whole = begun.pop(resumed[1]) + resumed[2]
                if not (found := LINE.match(whole)):
                    continue  # a signal, or an end
                pid, name, given = found[1], found[2], found[3].split(", ")
                counts[name] += pid == main
                named = given[:1] if name in {"read", "write", "pread64", "pwrite64"} else [whole]
                if self._hex not in named[0]:
                    continue
                if pid == main:
                    self.calls.append(Call(name, counts[name]))
                if not found[4].startswith(("-", "?")):
                    self._record(pid, name, given, found[4], found[5])

    def _record(self, pid: str, name: str, given: list[str], result: str, about: str) -> None:
        """Note what a call has changed, if anything."""
        file = pid, given[0].partition("<")[0]
        if name in {"openat", "open"}:
            self._open(pid, given, result, _path(about))
        elif name == "lseek":
            self._places[file] = int(result)
        elif name == "read":
            self._places[file] += int(result)
        elif name == "write":
            data = _bytes(given[1])[: int(result)]
            self._note("write", _path(given[0]), offset=self._places[file], data=data)
            self._places[file] += len(data)
        elif name == "pwrite64":
            data = _bytes(given[1])[: int(result)]
            self._note("write", _path(given[0]), offset=int(given[3]), data=data)
        elif name == "ftruncate":
            self._note("cut", _path(given[0]), offset=int(given[1]))
        elif name in {"fsync", "fdatasync"}:
            self._note("sync", _path(given[0]))
        elif name.startswith("rename"):
            self._note("rename", *_paths(given))
        elif name.startswith(("unlink", "rmdir")):
            self._note("remove", *_paths(given))
        elif name.startswith("mkdir"):
            self._note("make", *_paths(given))
        elif name in UNKNOWN:
            raise AssertionError(f"expected a call that can be replayed, but got {name}")

    def _open(self, pid: str, given: list[str], handle: str, path: str) -> None:
        flags = next(each for each in given if "O_" in each).split("|")
        assert "O_APPEND" not in flags, path
        self._places[pid, handle] = 0
        if "O_CREAT" in flags:
            self._note("create", path)
        if "O_TRUNC" in flags:
            self._note("cut", path)

    def _note(
        self, kind: str, path: str, to: str = "", *, offset: int = 0, data: bytes = b""
    ) -> None:
        within = self._root, f"{self._root}/"
        if path == within[0] or path.startswith(within[1]):
            own, other = (os.path.relpath(each, self._root) if each else "" for each in (path, to))
            self.steps.append(Step(kind, own, other, offset, data))


def _bytes(told: str) -> bytes:
    return bytes.fromhex(told.strip('".').replace("\\x", ""))


def _path(told: str) -> str:
    """Return what a handle is of: ``5<path>``."""
    found = re.search("<([^>]*)>", told)
    return os.fsdecode(_bytes(found[1])) if found else ""


def _paths(given: list[str]) -> list[str]:
    """Return the paths among the arguments of a call; what is relative is so to the one before."""
    return [
        str(Path(_path(given[i - 1]) if i else "") / os.fsdecode(_bytes(each)))
        for i, each in enumerate(given)
        if each.startswith('"')
    ]


# -- a disk ----------------------------------------------------------------------------------------

Tree = dict[str, bytes | None]
"""A folder: files by path, and None for folders."""


def tree_of(folder: Path) -> Tree:
    """Return what a folder holds, but what processes only share while they run."""
    return {
        path.relative_to(folder).as_posix(): None if path.is_dir() else path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if not path.name.endswith(SHARED)
    }


def write_tree(tree: Tree, folder: Path) -> None:
    """Make a folder of what it is to hold."""
    folder.mkdir()
    for path, content in sorted(tree.items()):
        if content is None:
            (folder / path).mkdir()
        else:
            (folder / path).write_bytes(content)


class File:
    """A file: what it holds for certain, and what was written to it since."""

    def __init__(self, kept: bytes = b"") -> None:
        self.kept = kept
        self.since: list[Step] = []

    def content(self, survives: Callable[[Step], Step | None] = lambda step: step) -> bytes:
        """Return what it holds if of every step since that survives which a function returns."""
        data = bytearray(self.kept)
        for step in filter(None, map(survives, self.since)):
            if step.kind == "cut":
                del data[step.offset :]
            data.extend(bytes(max(step.offset + len(step.data) - len(data), 0)))
            data[step.offset : step.offset + len(step.data)] = step.data
        return bytes(data)


class Disk:
    """A folder on a disk to which steps are done, and which may lose what was not flushed.

    Names may be lost independently of each other, as POSIX allows; no file system is known that
    tears one name.
    """

    def __init__(self, tree: Tree) -> None:
        self._kept: dict[str, File | None] = {
            path: None if content is None else File(content) for path, content in tree.items()
        }
        self._names = dict(self._kept)
        self._since: list[tuple[Step, File | None]] = []

    def do(self, step: Step) -> None:
        """Do a step."""
        if step.path.endswith(SHARED):
            return
        if step.kind in {"write", "cut"}:
            file = self._names.get(step.path)
            if file is not None:  # else it has no name any more
                file.since.append(step)
        elif step.kind == "sync":
            self._sync(step.path)
        elif step.kind != "create" or step.path not in self._names:
            made = File() if step.kind == "create" else None
            self._since.append((step, made))
            _rename(self._names, step, made)

    def _sync(self, path: str) -> None:
        file = self._names.get(path)
        if file is not None:
            file.kept, file.since = file.content(), []
            return
        left = []
        for step, made in self._since:
            if path in {str(Path(each).parent) for each in (step.path, step.to) if each}:
                _rename(self._kept, step, made)
            else:
                left.append((step, made))
        self._since = left

    def tree(self) -> Tree:
        """Return what is there if nothing is lost."""
        return {
            path: None if file is None else file.content() for path, file in self._names.items()
        }

    def after_power_loss(self, chance: Random) -> Tree:
        """Return what may be there after a loss of power."""
        of_names, of_data = chance.choice([0, 0.5, 1]), chance.choice([0, 0.5, 0.8, 1])
        names = dict(self._kept)
        for step, made in self._since:
            if chance.random() < of_names:
                _rename(names, step, made)

        def survives(step: Step) -> Step | None:
            if chance.random() >= of_data:
                return None
            return _torn(step, chance) if of_data < 1 and chance.random() < 0.3 else step

        return {
            path: None if file is None else file.content(survives)
            for path, file in names.items()
            if all(str(above) in names for above in list(Path(path).parents)[:-1])
        }


def _rename(names: dict[str, File | None], step: Step, made: File | None) -> None:
    """Do to names what a step does, where what it needs is there."""
    if step.kind in {"create", "make"}:
        names[step.path] = made
    elif step.path in names:
        file = names.pop(step.path)
        if step.kind == "rename":
            names[step.to] = file


def _torn(step: Step, chance: Random) -> Step:
    """Return a part of what was written, of whole sectors: up to one of them, or from it on."""
    at = chance.randrange(0, len(step.data) + 1, SECTOR)
    if chance.random() < 0.5:
        return replace(step, data=step.data[:at])
    return replace(step, offset=step.offset + at, data=step.data[at:])
