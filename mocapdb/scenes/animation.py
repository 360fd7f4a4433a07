"""A stage as a file: GIF, MP4 where ffmpeg is there, or a page that plays it."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from mocapdb.base.arrays import StrPath
from mocapdb.base.files import replacing, write_whole
from mocapdb.base.progress import Progress, silent
from mocapdb.errors import ClipError, FormatError
from mocapdb.motion.clip import Clip
from mocapdb.scenes.stage import SHOWN_FPS, Actor, Stage

if TYPE_CHECKING:
    from PIL.Image import Image

__all__ = ["ANIMATED_SUFFIXES", "is_animation", "usual_rate", "write_animation", "write_stage"]

ANIMATED_SUFFIXES = (".gif", ".mp4", ".html")
GLTF_SUFFIX = ".glb"
GIF_FPS = 25.0  # a GIF counts in hundredths of a second
PALETTE_FRAMES, PALETTE_COLOURS = 9, 192  # frames that a GIF's colours are taken from, and colours
SMALLEST, LARGEST = 64, 4096  # pixels of a side
SIZE = (480, 360)  # pixels, width and height, unless told otherwise


def is_animation(path: StrPath) -> bool:
    """Return whether `write_animation` writes a path's suffix."""
    return Path(path).suffix.lower() in (*ANIMATED_SUFFIXES, GLTF_SUFFIX)


def write_animation(
    clip: Clip,
    path: StrPath,
    *,
    size: tuple[int, int] = SIZE,
    fps: float | None = None,
    progress: Progress | None = None,
) -> None:
    """Write a clip as an animated picture, or as ``.glb``, by the path's suffix.

    See `write_stage` for the errors. A ``.glb`` has every frame and no size.
    """
    if Path(path).suffix.lower() == GLTF_SUFFIX:
        from mocapdb.scenes.gltf import write_glb

        write_glb(clip, path)
        return
    rate = fps or usual_rate(path)
    stage = Stage.together([Actor.of(clip, fps=rate)], title=clip.name)
    write_stage(stage, path, size=size, progress=progress)


def write_stage(
    stage: Stage,
    path: StrPath,
    *,
    size: tuple[int, int] = SIZE,
    progress: Progress | None = None,
) -> None:
    """Write a stage as GIF, MP4 or HTML, by the path's suffix; it appears whole or not at all.

    Parameters
    ----------
    stage : Stage
    path : path-like
    size : (int, int)
        Width and height in pixels, even for MP4. A page fills its window instead.
    progress : callable, optional
        Called with frames done, frames in all, and the file's name.

    Raises
    ------
    FormatError
        If the suffix is none of `ANIMATED_SUFFIXES`, ffmpeg is needed and not there or fails, or
        the file cannot be written.
    ClipError
        If the size cannot be used.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix == ".html":
        from mocapdb.scenes.player import page

        write_whole(path, page(stage).encode())
        return
    if suffix not in ANIMATED_SUFFIXES:
        raise FormatError(
            path, f"Expected one of {', '.join(ANIMATED_SUFFIXES)} for clips side by side."
        )
    if not all(SMALLEST <= side <= LARGEST for side in size):
        raise ClipError(
            f"Expected a picture of {SMALLEST} to {LARGEST} pixels a side, but got "
            f"{size[0]} x {size[1]}."
        )
    from mocapdb.scenes.raster import draw_frames

    frames = _reported(draw_frames(stage, size), stage.n_frames, path.name, progress or silent)
    with replacing(path) as (partial,):
        if suffix == ".gif":
            _write_gif(frames, stage, partial)
        else:
            _write_mp4(frames, stage.fps, size, partial, path)


def usual_rate(path: StrPath) -> float:
    """Return the frames a second that an animation has unless it is told otherwise."""
    return GIF_FPS if Path(path).suffix.lower() == ".gif" else SHOWN_FPS


def _reported(
    frames: Iterator[Image], total: int, name: str, progress: Progress
) -> Iterator[Image]:
    for done, frame in enumerate(frames, start=1):
        progress(done, total, name)
        yield frame


def _write_gif(frames: Iterator[Image], stage: Stage, path: Path) -> None:
    """Write a GIF of one palette, taken from frames all over it, so that nothing flickers."""
    from PIL import Image

    drawn = list(frames)
    some = drawn[:: max(1, len(drawn) // PALETTE_FRAMES)]
    together = Image.new("RGB", (some[0].width, some[0].height * len(some)))
    for i, frame in enumerate(some):
        together.paste(frame, (0, i * frame.height))
    palette = together.quantize(PALETTE_COLOURS)
    indexed = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in drawn]
    hundredths = max(2, round(100 / stage.fps))
    indexed[0].save(
        path, format="GIF", save_all=True, append_images=indexed[1:], duration=10 * hundredths,
        loop=0, disposal=1,
    )  # fmt: skip


def _write_mp4(
    frames: Iterable[Image], fps: float, size: tuple[int, int], path: Path, shown: Path
) -> None:
    ffmpeg = shutil.which("ffmpeg")
    if ffmpeg is None:
        raise FormatError(
            shown,
            "Expected ffmpeg, which writes MP4, but it is not installed. Install it, or write "
            ".gif or .html, which need nothing.",
        )
    if size[0] % 2 or size[1] % 2:
        raise ClipError(f"Expected even sides for an MP4, but got {size[0]} x {size[1]}.")
    command = [
        ffmpeg, "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24",
        "-s", f"{size[0]}x{size[1]}", "-r", f"{fps:g}", "-i", "-",
        "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", str(path),
    ]  # fmt: skip
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin is not None and process.stderr is not None
        try:
            for frame in frames:
                process.stdin.write(frame.tobytes())
            process.stdin.close()
        except BrokenPipeError:
            pass  # it says why on stderr, below
        said = process.stderr.read().decode(errors="replace").strip()
        process.stdin = None
    if process.returncode:
        raise FormatError(shown, f"Expected ffmpeg to write it, but it said: {said[-300:]}")
