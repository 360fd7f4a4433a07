"""Clips as NumPy archives: everything that a clip holds, exactly.

The archive has ``channels`` (F, C) float64, and ``header``: the UTF-8 bytes of a JSON object with
the skeleton and the rest. Nothing in it is pickled.
"""

from __future__ import annotations

import json
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.base.files import replacing
from mocapdb.errors import ClipError, FormatError, SkeletonError
from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import Skeleton

__all__ = ["read_npz", "write_npz"]

VERSION = 1


def read_npz(path: StrPath) -> Clip:
    """Read what `write_npz` wrote; the clip equals the one written.

    Raises
    ------
    FormatError
        If the file is no archive of a clip.
    """
    header, channels = _read_arrays(path)
    if header.get("version") != VERSION:
        raise FormatError(
            path, f"Expected a clip of version {VERSION}, but got {header.get('version')!r}."
        )
    try:
        return Clip(
            Skeleton.from_dict(header["skeleton"]),
            channels,
            float(header["fps"]),
            name=str(header["name"]),
            label=header["label"],
            source=str(header["source"]),
            fps_source=str(header["fps_source"]),
            unit_source=str(header.get("unit_source", "file")),  # not in the first archives
            up_source=str(header.get("up_source", "file")),
            frame_time_text=str(header["frame_time_text"]),
            provenance=tuple(map(str, header["provenance"])),
        )
    except (KeyError, TypeError, ValueError) as problem:
        raise FormatError(path, f"Expected the fields of a clip, but got {problem!r}.") from None
    except (ClipError, SkeletonError) as problem:
        raise FormatError(path, str(problem)) from None


def write_npz(clip: Clip, path: StrPath) -> None:
    """Write a clip with all that it holds.

    Raises
    ------
    FormatError
        If the file cannot be written.
    """
    header = {
        "version": VERSION,
        "skeleton": clip.skeleton.to_dict(),
        "fps": clip.fps,
        "name": clip.name,
        "label": clip.label,
        "source": clip.source,
        "fps_source": clip.fps_source,
        "unit_source": clip.unit_source,
        "up_source": clip.up_source,
        "frame_time_text": clip.frame_time_text,
        "provenance": clip.provenance,
    }
    header_bytes = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
    with replacing(path) as (temporary,), temporary.open("wb") as file:
        np.savez_compressed(file, channels=clip.channels, header=header_bytes)


def _read_arrays(path: StrPath) -> tuple[dict[str, Any], FloatArray]:
    """Return the header and the channels of an archive."""
    try:
        with Path(path).open("rb") as file, np.load(file, allow_pickle=False) as archive:
            header = json.loads(archive["header"].tobytes())
            channels = archive["channels"]
    except FileNotFoundError:
        raise FormatError(path, "Expected a motion file, but there is none.") from None
    except (OSError, ValueError, KeyError, TypeError, AttributeError, EOFError) as problem:
        raise FormatError(path, f"Expected an archive of a clip, but got: {problem}.") from None
    except (zipfile.BadZipFile, zlib.error) as problem:
        raise FormatError(path, f"Expected a whole archive, but got: {problem}.") from None
    if not isinstance(header, dict) or channels.dtype != np.float64:
        raise FormatError(path, "Expected a header and float64 channels, but got others.")
    return header, channels
