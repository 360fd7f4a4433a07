"""Feature shards: every clip on the canonical body, immutable, beside the shards of the payloads.

A frame is the directions of 17 bones, each number a byte, and where the hips are and face: as
differences over time, number by number, which deflates to some 22 bytes. All that a query or a
class model needs is computed from it without decoding the clip.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.errors import ClipError, LibraryError, SkeletonError
from mocapdb.indexing.canonical.canonical_body import JOINTS, LENGTHS_M, PARENTS
from mocapdb.indexing.canonical.canonical_motion import FPS, CanonicalMotion, canonical_motion
from mocapdb.library.layout import FEATURES_FOLDER
from mocapdb.library.writing.catalogue_writer import CatalogueWriter
from mocapdb.library.writing.shard_writer import WrittenShard, next_shard_path, write_image
from mocapdb.motion.clip import Clip

__all__ = [
    "FeatureReader",
    "PackedMotion",
    "commit_features",
    "compact_features",
    "pack_motion",
    "packed_features",
    "write_features",
]

FEATURES_FORMAT = 2
BONE_UNITS = 256.0
"""A metre, in the unit of a bone's ends: the longest bone stays below a byte's 127."""

ROOT_UNITS = 512.0
"""A metre, or a radian, in the unit of the root's."""

N_BONES = len(JOINTS) - 1


@dataclass(frozen=True, eq=False)
class PackedMotion:
    """A canonical motion as it is stored.

    Attributes
    ----------
    bones : (51, F) int8, 1/256 m
        From each joint's parent to the joint: the first frame, then differences. They may wrap
        around; so does their sum, back.
    root : (4, F) int32, 1/512 m and 1/512 radian
        Position and heading, likewise.
    """

    bones: NDArray[np.int8]
    root: NDArray[np.int32]

    def unpack(self) -> CanonicalMotion:
        """Return the motion; its bones have their lengths again."""
        bones = np.cumsum(self.bones, axis=1, dtype=np.int8).T.reshape(-1, N_BONES, 3) / BONE_UNITS
        lengths = np.linalg.norm(bones, axis=2, keepdims=True)
        bones *= LENGTHS_M[1:, None] / np.maximum(lengths, 1 / BONE_UNITS)
        pose = np.zeros((len(bones), len(JOINTS), 3))
        for joint, parent in enumerate(PARENTS[1:], start=1):
            pose[:, joint] = pose[:, parent] + bones[:, joint - 1]
        root = np.cumsum(self.root, axis=1, dtype=np.int32).T / ROOT_UNITS
        return CanonicalMotion(pose, root[:, :3], root[:, 3], FPS)


def pack_motion(motion: CanonicalMotion) -> PackedMotion:
    """Return a motion as it is stored."""
    bones = motion.pose[:, 1:] - motion.pose[:, PARENTS[1:]]
    root = np.column_stack([motion.root, motion.yaw])
    return PackedMotion(
        _differences(bones.reshape(len(motion), -1) * BONE_UNITS).astype(np.int8),
        _differences(root * ROOT_UNITS).astype(np.int32),
    )


def _differences(values: FloatArray) -> IntArray:
    """Return whole numbers (D, F): the first frame, and the change from frame to frame."""
    whole = np.rint(values).T.astype(np.int64)
    return np.diff(whole, axis=1, prepend=0)


def write_features(folder: Path, motions: Sequence[PackedMotion]) -> WrittenShard:
    """Write motions as a new feature shard and return what was written.

    Raises
    ------
    LibraryError
        If the disk is full or cannot be written; nothing is left behind.
    """
    folder.mkdir(exist_ok=True)
    return write_image(next_shard_path(folder), _image(motions))


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
                self._bones: NDArray[np.int8] = file["bones"][:]
                self._root: NDArray[np.int32] = file["root"][:]
                self._starts: IntArray = file["starts"][:]
        except FileNotFoundError:
            raise LibraryError(
                f"{path}: the feature shard is missing. Restore a copy of the library."
            ) from None
        except (OSError, KeyError, ValueError) as problem:
            raise LibraryError(f"{path}: not a readable feature shard ({problem}).") from None

    def packed(self, row: int) -> PackedMotion:
        """Return one clip's motion as it is stored."""
        first, end = self._starts[row], self._starts[row + 1]
        return PackedMotion(
            self._bones[3 * N_BONES * first : 3 * N_BONES * end].reshape(3 * N_BONES, -1),
            self._root[4 * first : 4 * end].reshape(4, -1),
        )


def _image(motions: Sequence[PackedMotion]) -> bytes:
    import h5py

    starts = np.zeros(len(motions) + 1, dtype=np.int64)
    np.cumsum([motion.root.shape[1] for motion in motions], out=starts[1:])
    arrays: tuple[tuple[str, Any, str, str], ...] = (
        ("bones", _end_to_end([m.bones for m in motions]), "1/256 metre", "coordinate*frame"),
        ("root", _end_to_end([m.root for m in motions]), "1/512 metre", "xyz+yaw*frame"),
        ("starts", starts, "frame", "clip+1"),
    )
    buffer = io.BytesIO()
    # older layouts spend 2 kB on the chunks of each dataset, which is much for a few clips
    with h5py.File(buffer, "w", libver=("v110", "v110")) as file:
        file.attrs["format"] = FEATURES_FORMAT
        file.attrs["fps"] = FPS
        file.attrs["joints"] = " ".join(JOINTS[1:])
        for name, values, units, dims in arrays:
            packed = {"compression": "gzip", "compression_opts": 6, "shuffle": True}
            dataset = file.create_dataset(name, data=values, **(packed if name != "starts" else {}))
            dataset.attrs["units"] = units
            dataset.attrs["dims"] = dims
    return buffer.getvalue()


def _end_to_end(arrays: Sequence[NDArray[Any]]) -> NDArray[Any]:
    return np.concatenate([array.ravel() for array in arrays])


def packed_features(clip: Clip) -> tuple[PackedMotion | None, str | None]:
    """Return what is stored of a clip, or why its skeleton has no place in an index."""
    try:
        return pack_motion(canonical_motion(clip)), None
    except (SkeletonError, ClipError) as problem:
        return None, str(problem)


def commit_features(
    folder: Path,
    catalogue: CatalogueWriter,
    clips: Sequence[tuple[int, PackedMotion | None, str | None]],
) -> None:
    """Write a feature shard and note it, as a part of the catalogue's open transaction.

    Parameters
    ----------
    folder : Path
        The library's.
    catalogue : CatalogueWriter
    clips : sequence of (clip row, features, problem)
        One of the two last is None.
    """
    packed = [features for _, features, _ in clips if features is not None]
    shard_id = None
    if packed:
        shard = write_features(folder / FEATURES_FOLDER, packed)
        shard_id = catalogue.add_feature_shard(shard)
    row = 0
    for clip_id, features, problem in clips:
        if features is None:
            catalogue.add_features(clip_id, None, None, problem)
        else:
            catalogue.add_features(clip_id, shard_id, row, None)
            row += 1


def compact_features(folder: Path, catalogue: CatalogueWriter) -> None:
    """Rewrite the shards that hold deleted clips, as a part of the catalogue's open transaction."""
    places = catalogue.feature_places()
    for file in catalogue.feature_files_with_buried():
        reader = FeatureReader(folder / FEATURES_FOLDER / file)
        moving = [(clip_id, row) for clip_id, where, row in places if where == file]
        commit_features(
            folder, catalogue, [(clip_id, reader.packed(row), None) for clip_id, row in moving]
        )
