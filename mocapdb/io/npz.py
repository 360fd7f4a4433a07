"""Clips as NumPy archives: everything that a clip holds, exactly, and what others want of it.

===================  ============================================================================
``positions``        (F, J, 3) float32, metres, Y up: where joints are in the world
``quaternions``      (F, J, 4) float32, xyzw: their rotations in the frames of their parents
``names``            (J,) str
``parents``          (J,) int, -1 for the root
``offsets``          (J, 3) float32, metres, Y up: bones of the rest pose, from their parents
``fps``              float, frames a second
``units``            str, of the above: ``"metres, y up, quaternions xyzw local"``
``convention``       str: ``bvh`` where a joint turns the bones that start in it, ``acclaim`` where
                     it turns the one that ends in it
``channels``         (F, C) float64 as they were read, in degrees and the skeleton's units
``channel_names``    (C,) str
``header``           str: a JSON object with the skeleton and all else, for `read_npz`
===================  ============================================================================

`read_npz` takes channels and header, which are exact; the others are made of them. Archives of
earlier versions had no more than these two, the header as UTF-8 bytes. Nothing is pickled. One
that holds a clip in another representation has ``values`` and ``root`` instead
(`representation_files`); `plain_arrays` reads archives without a header, `amass` those of SMPL's
family.
"""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.base.files import expect_file, replacing
from mocapdb.errors import ClipError, FormatError, SkeletonError
from mocapdb.motion.clip import Clip
from mocapdb.motion.joint_tracks import in_units
from mocapdb.motion.representations import REPRESENTATIONS, Representation
from mocapdb.motion.skeleton import Skeleton

__all__ = ["BROKEN", "UNREADABLE", "header_of", "opened_archive", "read_npz", "write_npz"]

VERSION = 2
READABLE = (1, 2)
UNREADABLE = (
    OSError,
    ValueError,
    KeyError,
    TypeError,
    AttributeError,
    EOFError,
    RuntimeError,
    MemoryError,  # an array says it is larger than any memory
    TokenError,  # numpy's, of an array's header
)
BROKEN = (zipfile.BadZipFile, zlib.error)
UNITS = "metres, y up, quaternions xyzw local"
MOST_GROWTH = 10
"""How many times its size an archive may unpack to; motion packs to a half or a fifth."""

MOST_UNASKED = 100_000_000
"""Bytes that it may unpack to besides: a body at rest packs far better."""


def arrays_of(path: StrPath, wanted: Collection[str]) -> dict[str, Any] | None:
    """Return the plain arrays of an archive that is no clip's but has one of those wanted.

    None where it is something else, which `read_npz` tells.
    """
    try:
        with opened_archive(path) as archive:
            if "header" in archive.files or not set(wanted) & set(archive.files):
                return None
            return dict(_plain_arrays(archive))
    except (*UNREADABLE, *BROKEN):
        return None


def _plain_arrays(archive: Any) -> Iterator[tuple[str, Any]]:
    """Yield what can be read without unpickling; what cannot is left out."""
    for name in archive.files:
        with suppress(ValueError):
            yield name, archive[name]


def read_npz(path: StrPath) -> Clip:
    """Read what `write_npz` wrote; the clip equals the one written.

    Raises
    ------
    FormatError
        If the file is no archive of a clip.
    """
    header, arrays = _read_arrays(path)
    if header.get("version") not in READABLE:
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
    skeleton = clip.skeleton
    with replacing(path) as (temporary,), temporary.open("wb") as file, np.errstate(all="ignore"):
        np.savez_compressed(
            file,
            channels=clip.channels,
            header=header_of(clip),
            positions=clip.positions().astype(np.float32),
            quaternions=clip.rotations().astype(np.float32),
            names=np.array(skeleton.names),
            parents=skeleton.parents,
            offsets=in_units(skeleton, skeleton.offsets).astype(np.float32),
            fps=np.array(clip.fps),
            units=np.array(UNITS),
            convention=np.array(skeleton.convention),
            channel_names=np.array(skeleton.channel_names, dtype=str),
        )


def header_of(clip: Clip, **more: str) -> NDArray[np.str_]:
    """Return all that a clip holds besides its frames, as a JSON object."""
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
    return np.array(json.dumps(header | more))


@contextmanager
def opened_archive(path: StrPath) -> Iterator[Any]:
    """Open an archive of arrays; what it raises is in `UNREADABLE` or `BROKEN`.

    One that unpacks to far more than any motion does is refused before anything is unpacked, and an
    array that says it is larger than the archive before there is memory for it.
    """
    expect_file(path)
    with Path(path).open("rb") as file, np.load(file, allow_pickle=False) as archive:
        size = sum(member.file_size for member in archive.zip.infolist())
        most = MOST_GROWTH * Path(path).stat().st_size + MOST_UNASKED
        if size > most:
            raise ValueError(
                f"{size / 1e6:.0f} MB unpacked, where {most / 1e6:.0f} MB are the most of so small "
                "a file"
            )
        yield archive


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
        with opened_archive(path) as archive:
            said = archive["header"]  # a text, or the bytes of one
            header = json.loads(said.item() if said.dtype.kind == "U" else said.tobytes())
            is_clip = not isinstance(header, dict) or "representation" not in header
            names = ("channels",) if is_clip else ("values", "root")
            arrays = tuple(archive[name] for name in names)
    except FileNotFoundError:
        raise FormatError(path, "Expected a motion file, but there is none.") from None
    except UNREADABLE as problem:
        raise FormatError(path, f"Expected an archive of a clip, but got: {problem}.") from None
    except BROKEN as problem:
        raise FormatError(path, f"Expected a whole archive, but got: {problem}.") from None
    if not isinstance(header, dict) or any(array.dtype != np.float64 for array in arrays):
        raise FormatError(path, "Expected a header and float64 channels, but got others.")
    return header, arrays
