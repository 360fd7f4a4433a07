"""A clip as a file that the browser keeps."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from mocapdb.motion.clip import Clip

if TYPE_CHECKING:
    from mocapdb.viewer.panel import PanelHost

__all__ = ["FORMATS", "download_clip"]

FORMATS = ("bvh", "amc", "npz", "glb", "gif", "html")


def download_clip(host: PanelHost, clip: Clip, name: str, suffix: str) -> None:
    """Have the browser keep a clip, in a format by its suffix, and say so.

    Parameters
    ----------
    host : PanelHost
    clip : Clip
    name : str
        Of the file; what no file's name should have becomes a hyphen.
    suffix : str
        One of `FORMATS`.
    """
    from mocapdb.io import write_clip
    from mocapdb.scenes.animation import is_animation, write_animation

    stem = "".join(c if c.isalnum() or c in "-_" else "-" for c in name) or "clip"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{stem}.{suffix}"
        if is_animation(path):
            write_animation(clip, path)
        else:
            write_clip(clip, path)
        for file in sorted(Path(folder).iterdir()):  # an AMC comes with its ASF
            host.download(file.name, file.read_bytes())
            host.say(f"Exported {file.name}")
