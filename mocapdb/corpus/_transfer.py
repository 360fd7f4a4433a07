"""One file over HTTP: politely, with resume, retries and checks.

A download grows in ``NAME.partial`` and takes its name only when it is whole. The partial file's
modification time is set to the server's ``Last-Modified``: that is what a later attempt, or a later
run, sends as ``If-Range``, so bytes of two versions of a file are never joined, and no second file
is needed to remember the version. A partial file that a killed process left carries another time,
and the server answers with the whole file.
"""

from __future__ import annotations

import email.utils
import hashlib
import os
import random
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Final, TypeAlias

from mocapdb.base.files import make_folder
from mocapdb.errors import FetchError

if TYPE_CHECKING:
    import httpx

__all__ = ["ByteProgress", "Policy", "Transfer", "file_sha256"]

_MIN_BYTES_PER_S: Final = 256  # slower than this, an attempt is given up
_MAX_WAIT_S: Final = 60.0  # before the next attempt
_MAX_RETRY_AFTER_S: Final = 300.0  # of what a server may ask for; after that the file has failed
MOST_BYTES: Final = 256 << 20  # ten times the largest clip of the CMU database
_CONTENT_RANGE = re.compile(r"bytes (\d+)-\d+/(\d+|\*)")

ByteProgress: TypeAlias = Callable[[int, int | None], None]
"""Called with the bytes of the file so far and its size, None where the server does not say."""


@dataclass(frozen=True)
class Policy:
    """How patient a download is.

    Parameters
    ----------
    min_interval_s : float
        Seconds between the starts of two requests, at least.
    retries : int
        Further attempts after one that failed in a way that may pass.
    timeout_s : float
        Seconds without a byte, or for a connection, before an attempt is given up; also the time
        after which an attempt that trickles is given up.
    backoff_s : float
        Seconds before the first retry, doubled for each one that follows.
    """

    min_interval_s: float = 0.5
    retries: int = 5
    timeout_s: float = 30.0
    backoff_s: float = 1.0


class _PassingError(Exception):
    """An attempt failed in a way that may pass; the server may have said when to come back."""

    def __init__(self, reason: str, retry_after_s: float = 0.0) -> None:
        super().__init__(reason)
        self.retry_after_s = retry_after_s


class Transfer:
    """Downloads files one after the other over one client.

    Parameters
    ----------
    client : httpx.Client
        The connection.
    policy : Policy
        How patient to be.
    sleep, clock : callable
        `time.sleep` and `time.monotonic`, for tests to replace.

    Attributes
    ----------
    bytes_received : int
        What came over the wire so far.
    given_up_in_a_row : int
        How many of the last files failed on every attempt, without the server refusing them.
    """

    def __init__(
        self,
        client: httpx.Client,
        policy: Policy,
        *,
        sleep: Callable[[float], None] = time.sleep,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.bytes_received = 0
        self.given_up_in_a_row = 0
        self._client = client
        self._policy = policy
        self._sleep = sleep
        self._clock = clock
        self._next_request = -float("inf")

    def download(self, url: str, path: Path, sha256: str | None, progress: ByteProgress) -> None:
        """Download `url` to `path`, whole and checked, or not at all.

        Raises
        ------
        FetchError
            If the server refuses, keeps failing, or sends something else than the file. What was
            received of a file whose connection broke stays in ``NAME.partial`` for the next time.
        OSError
            If the file cannot be written.
        """
        partial = path.with_name(path.name + ".partial")
        make_folder(path.parent)
        self._receive_whole(url, partial, progress)
        try:
            _check_content(url, partial, sha256)
        except FetchError:
            partial.unlink()
            raise
        partial.replace(path)

    def _receive_whole(self, url: str, partial: Path, progress: ByteProgress) -> None:
        given_up_before, self.given_up_in_a_row = self.given_up_in_a_row, 0
        for attempt in range(self._policy.retries + 1):
            try:
                return self._attempt(url, partial, progress)
            except _PassingError as error:
                reason = str(error)
                if attempt < self._policy.retries:
                    self._sleep(max(self._backoff_s(attempt), error.retry_after_s))
        self.given_up_in_a_row = given_up_before + 1
        raise FetchError(
            f"{url}: {reason} That was the last of {self._policy.retries + 1} attempts. "
            "Try again later."
        )

    def _backoff_s(self, attempt: int) -> float:
        wait_s = min(_MAX_WAIT_S, self._policy.backoff_s * 2.0**attempt)
        return wait_s * random.uniform(0.5, 1.0)  # so that many clients do not come back at once

    def _wait_for_turn(self) -> None:
        now = self._clock()
        if now < self._next_request:
            self._sleep(self._next_request - now)
        self._next_request = max(now, self._next_request) + self._policy.min_interval_s

    def _attempt(self, url: str, partial: Path, progress: ByteProgress) -> None:
        import httpx

        self._wait_for_turn()
        have = partial.stat().st_size if partial.exists() else 0
        headers = {}
        if have:
            version = email.utils.formatdate(partial.stat().st_mtime, usegmt=True)
            headers = {"Range": f"bytes={have}-", "If-Range": version}
        try:
            with self._client.stream("GET", url, headers=headers) as response:
                _check_status(url, response, partial)
                start = _start(response, have, partial)
                self._receive(response, start, partial, progress)
        except httpx.TimeoutException:
            raise _PassingError(f"No answer within {self._policy.timeout_s:g} s.") from None
        except httpx.TransportError as error:
            raise _PassingError(f"The connection broke: {error}.") from None
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            raise FetchError(f"{url}: {error}. Correct the address.") from None

    def _receive(
        self, response: httpx.Response, start: int, partial: Path, progress: ByteProgress
    ) -> None:
        """Write the body behind the `start` bytes that are there, and check its length."""
        expected = _expected_size(response, start)
        with partial.open("ab" if start else "wb") as file:
            try:
                size = self._copy(response, file, start, expected, progress)
            finally:
                file.flush()
                _remember_version(partial, response)  # after the last write, which sets the time
            os.fsync(file.fileno())
        if expected is not None and size != expected:
            raise _PassingError(f"Expected {expected} bytes, but got {size}.")

    def _copy(
        self,
        response: httpx.Response,
        file: BinaryIO,
        start: int,
        expected: int | None,
        progress: ByteProgress,
    ) -> int:
        size = start
        begin_s = self._clock()
        if expected is not None and expected > MOST_BYTES:
            raise FetchError(_too_large(response, expected))
        for chunk in response.iter_raw():
            file.write(chunk)
            size += len(chunk)
            if size > MOST_BYTES:
                raise FetchError(_too_large(response, size))
            self.bytes_received += len(chunk)
            progress(size, expected)
            elapsed_s = self._clock() - begin_s
            too_slow = size - start < elapsed_s * _MIN_BYTES_PER_S
            if too_slow and elapsed_s > self._policy.timeout_s:
                raise _PassingError(f"Got only {size - start} bytes in {elapsed_s:.0f} s.")
        return size


def _too_large(response: httpx.Response, size: int) -> str:
    return (
        f"{response.url}: Expected at most {MOST_BYTES >> 20} MiB, but got {size >> 20} or more. "
        "No clip is so large: check the address in the manifest."
    )


def _check_status(url: str, response: httpx.Response, partial: Path) -> None:
    status = response.status_code
    if status in {200, 206}:
        encoding = response.headers.get("Content-Encoding", "identity")
        if encoding != "identity":
            raise FetchError(f"{url}: Expected the file as it is, but got it as {encoding}.")
        return
    said = f"The server answered {status} {response.reason_phrase}.".replace(" .", ".")
    if status == 416:  # the partial file is as long as the file, or longer
        partial.unlink(missing_ok=True)
        raise _PassingError(said)
    if status in {408, 429} or status >= 500:
        wait_s = _retry_after_s(response)
        if wait_s > _MAX_RETRY_AFTER_S:
            raise FetchError(f"{url}: {said} It asks to come back in {wait_s:.0f} s.")
        raise _PassingError(said, wait_s)
    raise FetchError(f"{url}: {said} Check the address in the manifest.")


def _retry_after_s(response: httpx.Response) -> float:
    """Return the seconds that ``Retry-After`` asks for, which may be given as a date."""
    text = response.headers.get("Retry-After", "").strip()
    if text.isdecimal():
        return float(text)
    date = _http_date(text)
    return max(0.0, date - datetime.now(UTC).timestamp()) if date is not None else 0.0


def _http_date(text: str) -> float | None:
    try:
        date = email.utils.parsedate_to_datetime(text)
    except (TypeError, ValueError):
        return None
    return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()


def _start(response: httpx.Response, have: int, partial: Path) -> int:
    """Return how many bytes of the partial file the answer continues."""
    if response.status_code == 200:
        return 0
    match = _CONTENT_RANGE.fullmatch(response.headers.get("Content-Range", ""))
    if match and int(match[1]) == have and have:
        version = _http_date(response.headers.get("Last-Modified", ""))
        if version == partial.stat().st_mtime:
            return have
    # A server that does not heed If-Range, or sends another part than asked for.
    partial.unlink(missing_ok=True)
    raise _PassingError("Expected the rest of the file, but got another part or version.")


def _expected_size(response: httpx.Response, start: int) -> int | None:
    if response.status_code == 206:
        match = _CONTENT_RANGE.fullmatch(response.headers["Content-Range"])
        if match and match[2] != "*":
            return int(match[2])
    length = response.headers.get("Content-Length", "")
    return start + int(length) if length.isdecimal() else None


def _remember_version(partial: Path, response: httpx.Response) -> None:
    version = _http_date(response.headers.get("Last-Modified", ""))
    if version is not None:
        os.utime(partial, (version, version))


def _check_content(url: str, partial: Path, sha256: str | None) -> None:
    with partial.open("rb") as file:
        head = file.read(1024)
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if not text:
        raise FetchError(f"{url}: Expected motion data, but got an empty file.")
    if text.startswith(b"<"):
        raise FetchError(f"{url}: Expected motion data, but got a web page. Open it in a browser.")
    if b"\0" in head:
        raise FetchError(f"{url}: Expected motion data, but got a binary file.")
    if sha256 is not None:
        digest = file_sha256(partial)
        if digest != sha256:
            raise FetchError(
                f"{url}: Expected SHA-256 {sha256}, but got {digest}. Nothing was kept. "
                "Try again; if it stays so, the file or the manifest has changed."
            )


def file_sha256(path: Path) -> str:
    """Return the SHA-256 of a file in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
