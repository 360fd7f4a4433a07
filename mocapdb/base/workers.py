"""Work that is shared out: to processes of this machine, or to the workers of a Dask cluster.

`on_workers`      the answers to many orders, in their order
`marked_folders`  files by which the workers of a cluster show that they see some folders
"""

from __future__ import annotations

import hashlib
import os
import secrets
import signal
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any, TypeVar

from mocapdb.base.files import PARTIAL_SUFFIX
from mocapdb.errors import MissingExtraError, WorkerError

__all__ = ["marked_folders", "on_workers"]

Answer = TypeVar("Answer")

CONNECT_S = 10  # for a scheduler, and for its first worker
CLOSE_S = 3  # to take leave of a scheduler that may be gone
LOOK_S = 5.0  # how often to ask whether any worker is left
WATCH_S = 1.0  # how often a worker looks whether the process that started it is there
ALONE_S = 60.0  # how long a cluster may be without a worker
AHEAD = 3  # orders that wait at each thread of a cluster, so that none is idle
KEPT = 64  # answers, for each thread, that wait for one before them
HEAD_BYTES = 2**16  # of a file that workers must see as this process does

Seen = tuple[str, int, str]
"""What a process sees at a path: file, folder or nothing; its bytes; a hash of the first ones."""


def on_workers(
    work: Callable[..., Answer],
    orders: Iterable[Sequence[Any]],
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    seen: Sequence[Path] = (),
) -> Generator[Answer]:
    """Yield what some work makes of each order, in their order, a few ahead of what is asked for.

    Close it where not all answers are taken: work that has not begun is given up then.

    Parameters
    ----------
    work : callable
        A function of a module, which other processes import.
    orders : iterable of sequences
        The arguments of each call.
    jobs : int, optional
        Processes of this machine; as many as there are processors by default. One is this process.
    scheduler : str, optional
        Address of a Dask scheduler whose workers do the work instead.
    seen : sequence of Path
        Files and folders that the workers have to see as this process sees them.

    Raises
    ------
    WorkerError
        If no scheduler answers, it dies, it has no workers, they have another mocapdb or none, do
        not see the files, or one order killed several of them; or if a process of this machine
        was killed.
    MissingExtraError
        If Dask is not installed.
    """
    every = list(orders)
    if not every:
        return
    if scheduler is not None:
        yield from _on_cluster(work, every, scheduler, seen)
    elif jobs is not None and min(jobs, len(every)) == 1:
        yield from (work(*order) for order in every)
    else:
        yield from _on_processes(work, every, min(jobs, len(every)) if jobs else -1)


def _on_processes(
    work: Callable[..., Answer], orders: Sequence[Sequence[Any]], n_processes: int
) -> Generator[Answer]:
    from concurrent.futures.process import BrokenProcessPool

    from joblib import Parallel, delayed

    run = Parallel(
        n_jobs=n_processes,
        return_as="generator",
        initializer=_end_with,
        initargs=(os.getpid(),),
    )
    with _children_ignore_interrupts():
        answers = run(delayed(_work_at)(_here(), work, order) for order in orders)
    try:
        for answer in answers:  # noqa: UP028 - to be closed below, and quietly
            yield answer
    except BrokenProcessPool:
        raise WorkerError(
            "A worker process was killed, perhaps for want of memory. Try again with fewer --jobs: "
            "what is committed is safe."
        ) from None
    finally:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that work is thrown away: so it shall be
            answers.close()


def _here() -> str | None:
    """Return the working folder; None if it was removed, where nothing relative can be meant."""
    try:
        return os.getcwd()  # noqa: PTH109 - of this moment, and text for other processes
    except FileNotFoundError:
        return None


def _work_at(folder: str | None, work: Callable[..., Answer], order: Sequence[Any]) -> Answer:
    """Do a piece of work where the caller stands: processes are kept, and may stand elsewhere."""
    if folder is not None:
        os.chdir(folder)
    return work(*order)


def _end_with(parent: int) -> None:
    """Have this process end soon after the one that started it, however that has ended.

    Where that was killed, workers would wait minutes for the next piece of work.
    """
    if os.name == "posix" and os.getpid() != parent:  # other systems do not tell
        threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(WATCH_S)
    os._exit(1)


@contextmanager
def _children_ignore_interrupts() -> Iterator[None]:
    """Start processes that ignore Ctrl-C, which the terminal sends to all of them."""
    in_main_thread = threading.current_thread() is threading.main_thread()
    if not in_main_thread or signal.getsignal(signal.SIGINT) is None:  # it cannot be set
        yield
        return
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)


@contextmanager
def marked_folders(*folders: Path) -> Iterator[list[Path]]:
    """Give, while it lasts, a file in each of some folders that no other folder has.

    For `on_workers` to look for, where workers write. Folders are made, and go again if nothing
    was written to them.
    """
    with ExitStack() as marks:
        paths = []
        for folder in folders:
            if not folder.is_dir():
                folder.mkdir(parents=True)
                marks.callback(_remove_empty, folder)
            mark = marks.enter_context(
                NamedTemporaryFile(dir=folder, prefix=".mocapdb.", suffix=PARTIAL_SUFFIX)
            )
            mark.write(secrets.token_bytes(16))
            mark.flush()
            paths.append(Path(mark.name))
        yield paths


def _remove_empty(folder: Path) -> None:
    if not any(folder.iterdir()):
        folder.rmdir()


# -- a cluster -----------------------------------------------------------------------------------


def _on_cluster(
    work: Callable[..., Answer],
    orders: Sequence[Sequence[Any]],
    address: str,
    seen: Sequence[Path],
) -> Generator[Answer]:
    """Yield the answers of a cluster's workers.

    Through Dask's own executor and not joblib's backend: where an order kills its workers, that
    one waits for ever, and where the scheduler dies, it gives errors as answers.
    """
    with _connected(address) as client:
        n_threads = _expect_workers(client, address, seen)
        executor = client.get_executor(pure=False)
        left = iter(orders)
        waiting: deque[Future[Answer]] = deque()
        undone: set[Future[Answer]] = set()
        alone_s, asked = 0.0, time.monotonic()
        try:
            while True:
                undone = {each for each in undone if not each.done()}
                while len(undone) < AHEAD * n_threads and len(waiting) < KEPT * n_threads:
                    order = next(left, None)
                    if order is None:
                        break
                    with _scheduler_asked(address):
                        waiting.append(executor.submit(work, *order))
                    undone.add(waiting[-1])
                if not waiting:
                    return
                if waiting[0].done():
                    yield _answer(waiting.popleft(), address)
                    continue
                wait(undone, LOOK_S, FIRST_COMPLETED)
                since = time.monotonic() - asked
                if since < LOOK_S:
                    continue
                with _scheduler_asked(address):  # workers come and go
                    n_now = int(sum(client.nthreads().values()))
                alone_s = 0.0 if n_now else alone_s + since
                n_threads, asked = max(n_now, 1), time.monotonic()
                if alone_s >= ALONE_S:
                    raise WorkerError(
                        f"{address}: no worker has been left for {ALONE_S:g} s. Start workers, and "
                        "try again: what is committed is safe."
                    )
        finally:
            for future in waiting:
                future.cancel()


def _answer(future: Future[Answer], address: str) -> Answer:
    """Return an answer; what Dask says in its place is told in our words."""
    import distributed
    from distributed.comm.core import CommClosedError

    try:
        return future.result()
    except distributed.KilledWorker as problem:
        raise WorkerError(
            f"{address}: one piece of work has killed its worker, or lost it, again and again "
            f"({problem.last_worker.address}), perhaps for want of memory. Give workers more, or "
            "find what it is with --jobs 1: what is committed is safe."
        ) from None
    except (CancelledError, CommClosedError) as problem:
        raise _gone(address, problem) from None


@contextmanager
def _scheduler_asked(address: str) -> Iterator[None]:
    """Tell that the scheduler is gone where it is asked for something and does not answer."""
    try:
        yield
    except Exception as problem:  # what Dask raises then depends on the moment
        raise _gone(address, problem) from None


def _gone(address: str, problem: BaseException) -> WorkerError:
    return WorkerError(
        f"{address}: the Dask scheduler is gone ({type(problem).__name__}). Start it and try "
        "again: what is committed is safe."
    )


@contextmanager
def _connected(address: str) -> Iterator[Any]:
    try:
        import distributed
    except ImportError:
        raise MissingExtraError("distributed", "distributed") from None
    connect: Any = distributed.Client  # typed in some versions only
    try:
        if not address.strip():  # Dask would start a cluster of its own
            raise ValueError("the address is empty")
        client = connect(address, timeout=f"{CONNECT_S}s", set_as_default=False)
    except Exception as problem:  # what a wrong address raises depends on how it is wrong
        why = str(problem).partition("\n")[0] or type(problem).__name__
        raise WorkerError(
            f"{address}: no Dask scheduler answers ({why}). Expected an address such as "
            "tcp://10.0.0.1:8786."
        ) from None
    try:
        yield client
    finally:
        client.close(timeout=CLOSE_S)


def _expect_workers(client: Any, address: str, seen: Sequence[Path]) -> int:
    """Return how many threads the workers have, once they are known to be of use."""
    from mocapdb import __version__

    try:
        client.wait_for_workers(1, timeout=CONNECT_S)
    except TimeoutError:
        raise WorkerError(
            f"{address}: the Dask scheduler has no worker. Start some with: dask worker {address}"
        ) from None
    paths = [str(path.absolute()) for path in seen]
    expected = __version__, [_look(path) for path in paths]
    for worker, found in client.run(_look_around, paths, on_error="return").items():
        if isinstance(found, BaseException):
            raise WorkerError(
                f"{worker}: this worker cannot run mocapdb ({found}). Install mocapdb "
                f"{__version__} where it runs."
            )
        if found[0] != __version__:
            raise WorkerError(
                f"{worker}: expected mocapdb {__version__} on this worker, but got {found[0]}: its "
                "results might be others."
            )
        for path, ours, theirs in zip(paths, expected[1], found[1], strict=True):
            if ours != theirs:
                raise WorkerError(
                    f"{worker}: expected this worker to see {path} as this machine does, but got "
                    f"{theirs[0]}. Share the folder with it, under the same path."
                )
    return max(int(sum(client.nthreads().values())), 1)


def _look_around(paths: Sequence[str]) -> tuple[str, list[Seen]]:
    """Return which mocapdb a worker has, and what it sees."""
    from mocapdb import __version__

    return __version__, [_look(path) for path in paths]


def _look(path: str) -> Seen:
    try:
        if Path(path).is_dir():
            return "a folder", 0, ""
        with Path(path).open("rb") as file:
            head = hashlib.sha256(file.read(HEAD_BYTES)).hexdigest()
        return "another file", Path(path).stat().st_size, head
    except OSError as problem:
        return problem.strerror or "nothing", 0, ""
