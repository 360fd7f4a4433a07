"""Clips as NumPy archives: everything that a clip holds, exactly.

The archive has ``channels`` (F, C) float64, and ``header``: the UTF-8 bytes of a JSON object with
the skeleton and the rest. Nothing in it is pickled. One that holds a clip in another representation
has ``values`` and ``root`` instead, and says so in its header (`representation_files`).
"""

from __future__ import annotations

import json
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.base.files import expect_file, replacing
from mocapdb.errors import ClipError, FormatError, SkeletonError
from mocapdb.motion.clip import Clip
from mocapdb.motion.representations import REPRESENTATIONS, Representation
from mocapdb.motion.skeleton import Skeleton

__all__ = ["header_bytes", "read_npz", "write_npz"]

VERSION = 1
MOST_UNPACKED = 4_000_000_000  # bytes: a day of 60 joints at 30 Hz


def read_npz(path: StrPath) -> Clip:
    """Read what `write_npz` wrote; the clip equals the one written.

    Raises
    ------
    FormatError
        If the file is no archive of a clip.
    """
    header, arrays = _read_arrays(path)
    if header.get("version") != VERSION:
        raise FormatError(
            path, f"Expected a clip of version {VERSION}, but got {header.get('version')!r}."
        )
    try:
        skeleton = Skeleton.from_dict(header["skeleton"])
        return Clip(
            skeleton,
            _channels(skeleton, header.get("representation"), arrays),
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
    with replacing(path) as (temporary,), temporary.open("wb") as file:
        np.savez_compressed(file, channels=clip.channels, header=header_bytes(clip))


def header_bytes(clip: Clip, **more: str) -> NDArray[np.uint8]:
    """Return all that a clip holds besides its frames, as the bytes of a JSON object."""
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
    return np.frombuffer(json.dumps(header | more).encode(), dtype=np.uint8)


def _expect_bounded(archive: zipfile.ZipFile) -> None:
    """Refuse an archive that unpacks to more than any clip, before anything is unpacked."""
    size = sum(member.file_size for member in archive.infolist())
    if size > MOST_UNPACKED:
        raise ValueError(
            f"{size / 1e9:.1f} GB unpacked, where {MOST_UNPACKED / 1e9:g} are the most"
        )


def _channels(skeleton: Skeleton, name: Any, arrays: tuple[FloatArray, ...]) -> FloatArray:
    """Return the channels of an archive's arrays.

    Raises
    ------
    ValueError
        If they do not fit the representation that they are said to be in.
    """
    if name is None:
        return arrays[0]
    if name not in REPRESENTATIONS:
        raise ValueError(f"representation {name!r}")
    values, root = arrays
    shown = Representation(name, values, root, skeleton)
    n_root = 0 if name in {"channels", "positions"} else 4
    if values.shape != (len(root), len(shown.columns)) or root.shape[1:] != (n_root,):
        raise ValueError(f"values {values.shape} and root track {root.shape} of {name}")
    return shown.restore()


def _read_arrays(path: StrPath) -> tuple[dict[str, Any], tuple[FloatArray, ...]]:
    """Return the header of an archive, and its channels or its values and root track."""
    try:
        expect_file(path)
        with Path(path).open("rb") as file, np.load(file, allow_pickle=False) as archive:
            _expect_bounded(archive.zip)
            header = json.loads(archive["header"].tobytes())
            is_clip = not isinstance(header, dict) or "representation" not in header
            names = ("channels",) if is_clip else ("values", "root")
            arrays = tuple(archive[name] for name in names)
    except FileNotFoundError:
        raise FormatError(path, "Expected a motion file, but there is none.") from None
    except (OSError, ValueError, KeyError, TypeError, AttributeError, EOFError) as problem:
        raise FormatError(path, f"Expected an archive of a clip, but got: {problem}.") from None
    except (zipfile.BadZipFile, zlib.error) as problem:
        raise FormatError(path, f"Expected a whole archive, but got: {problem}.") from None
    if not isinstance(header, dict) or any(array.dtype != np.float64 for array in arrays):
        raise FormatError(path, "Expected a header and float64 channels, but got others.")
    return header, arrays
