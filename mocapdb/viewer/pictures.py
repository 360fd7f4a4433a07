"""Pictures of clips, which a browser asks for when it shows them: poses in a row, and loops.

They are made on demand, from some frames of a clip, and kept in a folder of the user's cache until
others need the room. A picture's name has a digest of what it was made of, so that one of a clip
that was cleaned or built anew since is another one.
"""

from __future__ import annotations

import hashlib
import html
import re
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mocapdb.base.files import write_whole
from mocapdb.errors import FormatError, MocapdbError
from mocapdb.library.addresses import cache_folder
from mocapdb.scenes.pose_strip import LOOP_FPS, loop_svg, strip_svg
from mocapdb.scenes.stage import Actor

if TYPE_CHECKING:
    from mocapdb.library import Library
    from mocapdb.library.clip_record import ClipRecord
    from mocapdb.motion.clip import Clip

__all__ = ["Pictures", "picture_html"]

FOLDER = "pictures"
DRAWN = 1  # rises when pictures are drawn in another way
MOST_KEPT_BYTES = 64 * 2**20
SWEPT_EVERY = 200  # pictures that are added before room is made for them
STRIP_FRAMES = 25  # of a clip that a strip chooses its poses from
LOOP_S = 4.0  # of a clip that a loop shows, from its middle
DECODED_WHOLE = 4000  # frames; of a longer stretch each frame is decoded by itself

ADDRESS = re.compile(
    r"/pictures/(?P<kind>strip|loop)/(?P<row>\d{1,12})-(?P<digest>[0-9a-f]{16})"
    r"(?:-(?P<start>\d{1,9})-(?P<end>\d{1,9}))?\.svg"
)


def picture_html(library: Library, record: ClipRecord, frames: slice | None = None) -> str:
    """Return the picture of a clip, or of some of its frames, as HTML: it plays under the mouse."""
    part = "" if frames is None else f"-{frames.start}-{frames.stop}"
    name = f"{record.id}-{_digest(library, record)}{part}.svg"
    return (
        f'<img class="mt-picture" loading="lazy" alt="" src="pictures/strip/{name}" '
        f'data-loop="pictures/loop/{name}">'
    )


def _digest(library: Library, record: ClipRecord) -> str:
    """Return what tells a clip of a library, as it is decoded now, from every other."""
    revision = None if library.original else library.revision(record)
    said = (
        DRAWN, library.place, record.id, record.source_sha256, record.source, record.settings,
        record.frames, record.payload_bytes, record.shard_id, record.shard_row,
        None if revision is None else revision.sha256,
    )  # fmt: skip
    return hashlib.sha256(repr(said).encode()).hexdigest()[:16]


class Pictures:
    """The pictures of one library, made by one thread that has a library of its own.

    Parameters
    ----------
    path : Path
        Of the library.
    original : bool
        Whether clips are shown as they were captured, also where they were cleaned since.
    """

    def __init__(self, path: Path, *, original: bool = False) -> None:
        self._path, self._original = path, original
        self._folder = cache_folder() / FOLDER
        self._worker = ThreadPoolExecutor(1, "mocapdb pictures")
        self._library: Library | None = None
        self._added = 0
        self._closed = threading.Event()

    def answer(self, address: str) -> Future[str | None] | None:
        """Return what is at an address, once it is made; None where that is no picture's.

        What comes in the end is None where there is no such clip, or not any more.
        """
        found = ADDRESS.fullmatch(address.partition("?")[0])
        if found is None or self._closed.is_set():
            return None
        return self._worker.submit(self._kept, found)

    def close(self) -> None:
        """Make no more pictures, and close the library."""
        self._closed.set()
        self._worker.submit(self._close_library)
        self._worker.shutdown(wait=True)

    # -- by the one thread -------------------------------------------------------------------------

    def _close_library(self) -> None:
        if self._library is not None:
            self._library.close()
            self._library = None

    def _kept(self, found: re.Match[str]) -> str | None:
        if self._closed.is_set():
            return None
        name = found[0].rpartition("/")[2]
        path = self._folder / f"{found['kind']}-{name}"
        with suppress(OSError, UnicodeDecodeError):
            text = path.read_text(encoding="utf-8")
            path.touch()  # it is of use still
            return text
        try:
            picture = self._made(found)
        except MocapdbError as problem:  # damaged bytes, or a clip that is gone
            return None if self._library is None else _no_picture(str(problem))
        if picture is not None:
            self._keep(path, picture)
        return picture

    def _made(self, found: re.Match[str]) -> str | None:
        from mocapdb.library import Library

        if self._library is None:
            self._library = Library(self._path, original=self._original)
        library = self._library
        record = library.catalogue.record(int(found["row"]))
        if found["digest"] != _digest(library, record):
            return None
        start = min(int(found["start"] or 0), record.frames - 1)
        end = min(max(int(found["end"] or record.frames), start + 1), record.frames)
        draw, frames = _drawing(found["kind"], start, end, record.fps)
        return draw(_actor(library, record, frames))

    def _keep(self, path: Path, picture: str) -> None:
        with suppress(FormatError, OSError):  # without a cache they are made each time
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_whole(path, picture.encode())
            if self._added % SWEPT_EVERY == 0:
                make_room(path.parent, MOST_KEPT_BYTES)
            self._added += 1


def _drawing(
    kind: str, start: int, end: int, fps: float
) -> tuple[Callable[[Actor], str], np.ndarray]:
    """Return how a picture is drawn, and the frames that it is drawn of."""
    if kind == "strip":
        count = min(STRIP_FRAMES, end - start)
        return strip_svg, np.linspace(start, end - 1, count).round().astype(int)
    first = max(start, (start + end) // 2 - round(LOOP_S * fps / 2))
    seconds = min(LOOP_S, (end - first) / fps)
    count = max(1, round(seconds * LOOP_FPS))
    times = first + np.arange(count) / LOOP_FPS * fps
    return loop_svg, np.minimum(times.round().astype(int), end - 1)


def _actor(library: Library, record: ClipRecord, frames: np.ndarray) -> Actor:
    """Return some frames of a clip as an actor, at the rate of a loop."""
    start, end = int(frames[0]), int(frames[-1]) + 1
    if end - start <= DECODED_WHOLE:
        clip = library.decode(record, slice(start, end))
        channels = clip.channels[frames - start]
    else:
        clips = [library.decode(record, slice(int(f), int(f) + 1)) for f in frames]
        clip = clips[0]
        channels = np.concatenate([each.channels for each in clips])
    some: Clip = replace(clip, channels=channels, fps=LOOP_FPS)
    return Actor.of(some, fps=LOOP_FPS)


def _no_picture(why: str) -> str:
    """Return a picture that says why there is none, when the mouse is over it."""
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 300 100">'
        f"<title>{html.escape(why)}</title>"
        '<path stroke="#c3ccd4" stroke-width="4" d="M130 30L170 70M170 30L130 70"/></svg>'
    )


def make_room(folder: Path, most_bytes: int) -> None:
    """Delete the pictures of a folder that were not used for the longest, until the rest fits."""
    sizes: list[tuple[float, int, Path]] = []
    for path in folder.glob("*.svg"):
        with suppress(OSError):  # another viewer has deleted it meanwhile
            about = path.stat()
            sizes.append((about.st_mtime, about.st_size, path))
    room = most_bytes
    for _, size, path in sorted(sizes, reverse=True, key=lambda each: each[0]):
        room -= size
        if room < 0:
            with suppress(OSError):
                path.unlink()
