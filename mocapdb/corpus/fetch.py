"""Download the clips of a manifest.

The files of a subject go into a folder of their own, ``DIR/02/02_01.amc`` beside ``DIR/02/02.asf``,
which is where `mocapdb.io` looks for the skeleton. What is there already is not asked for again, a
skeleton is asked for once, and a clip that cannot be had does not keep the others from coming.
"""

from __future__ import annotations

import importlib.metadata
import os
import time
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlsplit

from mocapdb.base.arrays import StrPath
from mocapdb.corpus._transfer import ByteProgress, Policy, Transfer, file_sha256
from mocapdb.corpus.manifest import ManifestEntry
from mocapdb.errors import CorpusError, FetchError

if TYPE_CHECKING:
    import httpx

__all__ = [
    "POLITE",
    "Download",
    "Failure",
    "FetchPlan",
    "FetchProgress",
    "FetchReport",
    "Policy",
    "fetch",
    "plan",
]

POLITE: Final = Policy()
"""At most two requests a second, five retries, half a minute of patience."""

_GIVE_UP_AFTER: Final = 3  # files in a row: the server or the network is down


@dataclass(frozen=True)
class Download:
    """One file to download.

    Parameters
    ----------
    url : str
        Where it is.
    path : Path
        Where it goes.
    sha256 : str or None
        Its checksum, where known.
    clips : tuple of str
        The clips that need it; all of a subject's clips for a skeleton.
    """

    url: str
    path: Path
    sha256: str | None
    clips: tuple[str, ...]

    def is_present(self) -> bool:
        """Whether the file is there: not empty, and with the right checksum where it is known."""
        if not self.path.is_file() or self.path.stat().st_size == 0:
            return False
        return self.sha256 is None or file_sha256(self.path) == self.sha256


@dataclass(frozen=True)
class FetchPlan:
    """What a fetch would do.

    Parameters
    ----------
    directory : Path
        Where the files go.
    missing : tuple of Download
        What would be downloaded, a subject's skeleton before its motions.
    present : tuple of Download
        What is there already.
    """

    directory: Path
    missing: tuple[Download, ...]
    present: tuple[Download, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the plan as what ``mocapdb fetch --dry-run --json`` prints."""
        return {
            "directory": str(self.directory),
            "dry_run": True,
            "missing": [{"url": item.url, "path": str(item.path)} for item in self.missing],
            "skipped": [str(item.path) for item in self.present],
        }


@dataclass(frozen=True)
class Failure:
    """A file that could not be had, and why."""

    download: Download
    reason: str


@dataclass(frozen=True)
class FetchProgress:
    """Where a fetch stands.

    Parameters
    ----------
    n_done, n_files : int
        Files before this one, and files to download in all.
    download : Download
        The file at hand.
    bytes_done : int
        Bytes of it that are there.
    bytes_total : int or None
        Its size, where the server says.
    """

    n_done: int
    n_files: int
    download: Download
    bytes_done: int
    bytes_total: int | None


@dataclass
class FetchReport:
    """What a fetch did.

    Parameters
    ----------
    directory : Path
        Where the files went.
    skipped : tuple of Download
        What was there already.
    done : list of Download
        What was downloaded.
    failed : list of Failure
        What could not be had.
    bytes_received : int
        Bytes that came over the wire, lost attempts included.
    seconds : float
        Duration.
    """

    directory: Path
    skipped: tuple[Download, ...]
    done: list[Download] = field(default_factory=list)
    failed: list[Failure] = field(default_factory=list)
    bytes_received: int = 0
    seconds: float = 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return the report as what ``mocapdb fetch --json`` prints."""
        return {
            "directory": str(self.directory),
            "dry_run": False,
            "done": [str(item.path) for item in self.done],
            "skipped": [str(item.path) for item in self.skipped],
            "failed": [
                {
                    "url": failure.download.url,
                    "path": str(failure.download.path),
                    "clips": list(failure.download.clips),
                    "reason": failure.reason,
                }
                for failure in self.failed
            ],
            "bytes": self.bytes_received,
            "seconds": round(self.seconds, 3),
        }


def plan(entries: Iterable[ManifestEntry], directory: StrPath) -> FetchPlan:
    """Return what a fetch would download and what is there already, without the network.

    Parameters
    ----------
    entries : iterable of ManifestEntry
        The clips that are wanted.
    directory : path-like
        Where the files are to go.

    Raises
    ------
    CorpusError
        If two files of different address or checksum would go to one path, or a file that is
        there cannot be read.
    """
    directory = Path(directory)
    downloads: dict[Path, Download] = {}
    for entry in entries:
        folder = directory / entry.subject
        for url, name, sha256 in (
            (entry.skeleton_url, f"{entry.subject}.asf", entry.skeleton_sha256),
            (entry.motion_url, f"{entry.clip}.amc", entry.sha256),
        ):
            path = folder / name
            before = downloads.get(path, Download(url, path, sha256, ()))
            if (before.url, before.sha256) != (url, sha256):
                raise CorpusError(
                    f"Expected one source for {path}, but clip {entry.clip} gives {url} and clip "
                    f"{before.clips[0]} gives {before.url}, or another checksum. "
                    "Correct the manifest."
                )
            downloads[path] = Download(url, path, sha256, (*before.clips, entry.clip))
    missing: list[Download] = []
    present: list[Download] = []
    for download in downloads.values():
        try:
            (present if download.is_present() else missing).append(download)
        except OSError as error:
            raise _cannot_use(download.path, error) from None
    return FetchPlan(directory, tuple(missing), tuple(present))


def fetch(
    entries: Iterable[ManifestEntry],
    directory: StrPath,
    *,
    policy: Policy = POLITE,
    progress: Callable[[FetchProgress], None] = lambda _: None,
    sleep: Callable[[float], None] = time.sleep,
    clock: Callable[[], float] = time.monotonic,
) -> FetchReport:
    """Download clips and their skeletons.

    Parameters
    ----------
    entries : iterable of ManifestEntry
        The clips that are wanted.
    directory : path-like
        Where the files go; made where it does not exist.
    policy : Policy
        Requests a second, retries and time limits.
    progress : callable
        Called with a `FetchProgress` when a file is begun and as its bytes arrive.
    sleep, clock : callable
        `time.sleep` and `time.monotonic`, for tests to replace.

    Returns
    -------
    FetchReport
        What was downloaded, skipped and failed, with reasons.

    Raises
    ------
    CorpusError
        If files cannot be written, or the manifest contradicts itself. What was finished stays.
    """
    todo = plan(entries, directory)
    report = FetchReport(todo.directory, todo.present)
    begin_s = clock()
    hosts = {urlsplit(download.url).hostname for download in todo.missing}
    with _client(policy.timeout_s, hosts) as client:
        transfer = Transfer(client, policy, sleep=sleep, clock=clock)
        for index, download in enumerate(todo.missing):
            if transfer.given_up_in_a_row == _GIVE_UP_AFTER:
                reason = f"Not tried, because {_GIVE_UP_AFTER} files in a row could not be had."
                report.failed.append(Failure(download, f"{download.url}: {reason}"))
                continue
            advance = _progress_of_file(progress, index, todo.missing)
            _fetch_one(transfer, download, advance, report)
        report.bytes_received = transfer.bytes_received
    report.seconds = clock() - begin_s
    return report


def _fetch_one(
    transfer: Transfer, download: Download, advance: ByteProgress, report: FetchReport
) -> None:
    advance(0, None)
    try:
        transfer.download(download.url, download.path, download.sha256, advance)
    except FetchError as error:
        report.failed.append(Failure(download, str(error)))
    except OSError as error:
        raise _cannot_use(download.path, error) from None
    else:
        report.done.append(download)


def _progress_of_file(
    progress: Callable[[FetchProgress], None], index: int, downloads: Sequence[Download]
) -> ByteProgress:
    def advance(bytes_done: int, bytes_total: int | None) -> None:
        progress(FetchProgress(index, len(downloads), downloads[index], bytes_done, bytes_total))

    return advance


def _client(timeout_s: float, hosts: Collection[str | None]) -> httpx.Client:
    """Return the connection; it follows redirects to the manifest's own hosts, and no others."""
    import httpx

    def stay(request: httpx.Request) -> None:
        if request.url.host not in hosts:
            raise FetchError(
                f"{request.url}: Expected a file of {', '.join(sorted(map(str, hosts)))}, but was "
                "sent elsewhere. If that is right, write the new address into the manifest."
            )

    try:
        version = importlib.metadata.version("mocapdb")
    except importlib.metadata.PackageNotFoundError:  # run from a checkout
        version = "unknown"
    headers = {"User-Agent": f"mocapdb/{version}", "Accept-Encoding": "identity"}
    return httpx.Client(
        headers=headers,
        timeout=timeout_s,
        follow_redirects=True,
        event_hooks={"request": [stay]},
    )


def _cannot_use(path: Path, error: OSError) -> CorpusError:
    where = error.filename or os.fspath(path)
    return CorpusError(f"{where}: Expected to read and write here, but got: {error.strerror}.")
