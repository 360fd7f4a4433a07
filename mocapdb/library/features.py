"""Feature shards: every clip on the canonical body, immutable, beside the shards of the payloads.

A frame is 17 joint positions in half millimetres, as differences over time, which deflate
well, and the root in metres and radians. All that a query or a class model needs is computed from
it without decoding the clip. A shard is written as `mocapdb.library.shards` writes its own: whole
or not at all, and visible with the commit of the catalogue that names it.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mocapdb._typing import Float32Array, IntArray
from mocapdb.errors import ClipError, LibraryError, SkeletonError
from mocapdb.indexing.body import JOINTS
from mocapdb.indexing.canonical import FPS, CanonicalMotion, canonical_motion
from mocapdb.library.catalogue import FEATURES_FOLDER, Catalogue
from mocapdb.library.shards import WrittenShard, next_shard_number, write_image
from mocapdb.motion.clip import Clip

__all__ = [
    "FEATURES_FOLDER",
    "FeatureReader",
    "PackedMotion",
    "commit_features",
    "pack_motion",
    "packed_features",
    "write_features",
]

FEATURES_FORMAT = 1
UNITS_PER_METRE = 2_000.0
N_COLUMNS = 3 * (len(JOINTS) - 1)


@dataclass(frozen=True, eq=False)
class PackedMotion:
    """A canonical motion as it is stored.

    Attributes
    ----------
    steps : (F, 51) int16, 0.5 mm
        Joint positions without the root's: the first frame, then differences. They may wrap
        around; so does their sum, back.
    root : (F, 4) float32
        Position in metres and yaw in radians.
    """

    steps: NDArray[np.int16]
    root: Float32Array

    def unpack(self) -> CanonicalMotion:
        """Return the motion, to within a quarter of a millimetre."""
        units = np.cumsum(self.steps, axis=0, dtype=np.int16)
        pose = np.zeros((len(units), len(JOINTS), 3))
        pose[:, 1:] = units.reshape(len(units), -1, 3) / UNITS_PER_METRE
        root = self.root.astype(np.float64)
        return CanonicalMotion(pose, root[:, :3], root[:, 3], FPS)


def pack_motion(motion: CanonicalMotion) -> PackedMotion:
    """Return a motion as it is stored."""
    units = np.rint(motion.pose[:, 1:].reshape(len(motion), -1) * UNITS_PER_METRE)
    steps: NDArray[np.int16] = units.astype(np.int16)
    steps[1:] -= steps[:-1].copy()
    return PackedMotion(steps, np.column_stack([motion.root, motion.yaw]).astype(np.float32))


def write_features(folder: Path, motions: Sequence[PackedMotion]) -> WrittenShard:
    """Write motions as a new feature shard and return what was written.

    Raises
    ------
    LibraryError
        If the disk is full or cannot be written; nothing is left behind.
    """
    folder.mkdir(exist_ok=True)
    return write_image(folder / f"{next_shard_number(folder):06d}.h5", _image(motions))


class FeatureReader:
    """An open feature shard.

    Raises
    ------
    LibraryError
        If the file is missing, is no feature shard, or has a newer format.
    """

    def __init__(self, path: Path) -> None:
        import h5py

        try:
            with h5py.File(path, "r") as file:
                version = int(file.attrs["format"])
                if version > FEATURES_FORMAT:
                    raise LibraryError(
                        f"{path}: expected feature format {FEATURES_FORMAT} or older, but got "
                        f"{version}. Install a newer mocapdb."
                    )
                self._steps: NDArray[np.int16] = file["steps"][:]
                self._root: Float32Array = file["root"][:]
                self._starts: IntArray = file["starts"][:]
        except FileNotFoundError:
            raise LibraryError(
                f"{path}: the feature shard is missing. Restore a copy of the library."
            ) from None
        except (OSError, KeyError, ValueError) as problem:
            raise LibraryError(f"{path}: not a readable feature shard ({problem}).") from None

    def packed(self, row: int) -> PackedMotion:
        """Return one clip's motion as it is stored."""
        own = slice(self._starts[row], self._starts[row + 1])
        return PackedMotion(self._steps[own], self._root[own])


def _image(motions: Sequence[PackedMotion]) -> bytes:
    import h5py

    starts = np.zeros(len(motions) + 1, dtype=np.int64)
    np.cumsum([len(motion.root) for motion in motions], out=starts[1:])
    arrays: tuple[tuple[str, Any, str, str], ...] = (
        ("steps", np.concatenate([m.steps for m in motions]), "0.5 mm", "frame,coordinate"),
        ("root", np.concatenate([m.root for m in motions]), "metre,radian", "frame,xyz+yaw"),
        ("starts", starts, "frame", "clip+1"),
    )
    buffer = io.BytesIO()
    with h5py.File(buffer, "w", libver=("earliest", "v108")) as file:
        file.attrs["format"] = FEATURES_FORMAT
        file.attrs["fps"] = FPS
        file.attrs["joints"] = " ".join(JOINTS[1:])
        for name, values, units, dims in arrays:
            packed = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
            dataset = file.create_dataset(name, data=values, **(packed if name != "starts" else {}))
            dataset.attrs["units"] = units
            dataset.attrs["dims"] = dims
    return buffer.getvalue()


def packed_features(clip: Clip) -> tuple[PackedMotion | None, str | None]:
    """Return what is stored of a clip, or why its skeleton has no place in an index."""
    try:
        return pack_motion(canonical_motion(clip)), None
    except (SkeletonError, ClipError) as problem:
        return None, str(problem)


def commit_features(
    folder: Path, catalogue: Catalogue, clips: Sequence[tuple[int, PackedMotion | None, str | None]]
) -> None:
    """Write a feature shard and note it, as a part of the catalogue's open transaction.

    Parameters
    ----------
    folder : Path
        The library's.
    catalogue : Catalogue
    clips : sequence of (clip row, features, problem)
        One of the two last is None.
    """
    packed = [features for _, features, _ in clips if features is not None]
    shard_id = None
    if packed:
        shard = write_features(folder / FEATURES_FOLDER, packed)
        shard_id = catalogue.add_feature_shard(shard.file, shard.size, shard.sha256)
    row = 0
    for clip_id, features, problem in clips:
        if features is None:
            catalogue.add_features(clip_id, None, None, problem)
        else:
            catalogue.add_features(clip_id, shard_id, row, None)
            row += 1


def compact_features(folder: Path, catalogue: Catalogue) -> None:
    """Rewrite the shards that hold deleted clips, as a part of the catalogue's open transaction."""
    places = catalogue.feature_places()
    for file in catalogue.feature_files_with_buried():
        reader = FeatureReader(folder / FEATURES_FOLDER / file)
        moving = [(clip_id, row) for clip_id, where, row in places if where == file]
        commit_features(
            folder, catalogue, [(clip_id, reader.packed(row), None) for clip_id, row in moving]
        )
