"""Feature shards: every clip on the canonical body, immutable, beside the shards of the payloads.

A frame is the directions of 17 bones, each number a byte, and where the hips are and face: as
differences over time, number by number, which deflates to some 22 bytes. All that a query or a
class model needs is computed from it without decoding the clip.
"""

from __future__ import annotations

import io
import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from shlex import quote

import numpy as np
from numpy.typing import NDArray

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.errors import ClipError, LibraryError, SkeletonError
from mocapdb.indexing.canonical.canonical_body import JOINTS, LENGTHS_M, PARENTS
from mocapdb.indexing.canonical.canonical_motion import FPS, CanonicalMotion, canonical_motion
from mocapdb.library.facets import Facets
from mocapdb.library.hdf5 import add_datasets, expect_format, file_sha256, opened
from mocapdb.library.layout import FEATURES_FOLDER
from mocapdb.library.remote import present
from mocapdb.library.writing.catalogue_writer import CatalogueWriter
from mocapdb.library.writing.pack_shards import alike_shards
from mocapdb.motion.clip import Clip

__all__ = [
    "FeatureReader",
    "PackedMotion",
    "commit_features",
    "compact_features",
    "join_features",
    "pack_motion",
    "packed_features",
]

FEATURES_FORMAT = 2
BONE_UNITS = 256.0
"""A metre, in the unit of a bone's ends: the longest bone stays below a byte's 127."""

ROOT_UNITS = 512.0
"""A metre, or a radian, in the unit of the root's."""

FURTHEST_M = 1e6
"""Four times as far, the root's numbers overflow."""

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
    facets : Facets, optional
        What was measured of the clip; None of what a shard has, since the catalogue keeps it.
    """

    bones: NDArray[np.int8]
    root: NDArray[np.int32]
    facets: Facets | None = None

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


class FeatureReader:
    """An open feature shard.

    Parameters
    ----------
    path : Path
    sha256 : str, optional
        What the catalogue says of the file.

    Raises
    ------
    LibraryError
        If the file is missing or damaged, is no feature shard, or has a newer format.
    """

    def __init__(self, path: Path, sha256: str | None = None) -> None:
        if not present(path).is_file():
            raise LibraryError(
                f"{path}: the feature shard is missing. "
                f"Run: mocapdb recover {quote(str(path.parent.parent))}"
            )
        if sha256 is not None and file_sha256(path) != sha256:
            raise LibraryError(
                f"{path}: damaged. Run: mocapdb recover {quote(str(path.parent.parent))}"
            )
        with opened(path, "not a readable feature shard") as file:
            expect_format(path, "feature format", int(file.attrs["format"]), FEATURES_FORMAT)
            self._bones: NDArray[np.int8] = file["bones"][:]
            self._root: NDArray[np.int32] = file["root"][:]
            self._starts: IntArray = file["starts"][:]

    def __len__(self) -> int:
        return len(self._starts) - 1

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
    bones = np.concatenate([motion.bones.ravel() for motion in motions])
    root = np.concatenate([motion.root.ravel() for motion in motions])
    packed = {"compression": "gzip", "compression_opts": 6, "shuffle": True}
    buffer = io.BytesIO()
    # older layouts spend 2 kB on the chunks of each dataset, which is much for a few clips
    with h5py.File(buffer, "w", libver=("v110", "v110")) as file:
        file.attrs.update(format=FEATURES_FORMAT, fps=FPS, joints=" ".join(JOINTS[1:]))
        add_datasets(file, [("bones", bones, "1/256 metre", "coordinate*frame")], **packed)
        add_datasets(file, [("root", root, "1/512 metre", "xyz+yaw*frame")], **packed)
        add_datasets(file, [("starts", starts, "frame", "clip+1")])
    return buffer.getvalue()


def packed_features(clip: Clip) -> tuple[PackedMotion | None, str | None]:
    """Return what is stored of a clip, or why it has no place in an index."""
    try:
        motion = canonical_motion(clip)
    except (SkeletonError, ClipError) as problem:
        return None, str(problem)
    if not np.abs(motion.root).max() <= FURTHEST_M:  # nor is one that is no number
        return None, f"Expected a body within {FURTHEST_M / 1000:g} km of the origin."
    from mocapdb.library.searching.clip_facets import measure_facets

    return replace(pack_motion(motion), facets=measure_facets(clip)), None


def commit_features(
    catalogue: CatalogueWriter, clips: Sequence[tuple[int, PackedMotion | None, str | None]]
) -> None:
    """Write a feature shard and note it, as a part of the catalogue's open transaction.

    Parameters
    ----------
    catalogue : CatalogueWriter
    clips : sequence of (clip row, features, problem)
        One of the two last is None.
    """
    packed = [features for _, features, _ in clips if features is not None]
    shard_id = catalogue.add_shard(FEATURES_FOLDER, _image(packed)) if packed else None
    rows = itertools.count()
    catalogue.add_features(
        {"clip_id": clip_id, "shard_id": None, "shard_row": None, "problem": problem}
        if features is None
        else {"clip_id": clip_id, "shard_id": shard_id, "shard_row": next(rows), "problem": None}
        for clip_id, features, problem in clips
    )
    catalogue.add_facets(
        {clip_id: own.facets for clip_id, own, _ in clips if own is not None and own.facets}
    )


def join_features(catalogue: CatalogueWriter, *, shortly: bool = False) -> int:
    """Join small feature shards; return how many were joined. See `join_shards`.

    Raises
    ------
    LibraryError
        If one of them is damaged, or the disk is full.
    """
    if not alike_shards(catalogue.shards(FEATURES_FOLDER), shortly=shortly):
        return 0
    with catalogue.transaction():
        catalogue.remove_unused_shards()
    with_deleted = catalogue.features_of_deleted()
    hashes = catalogue.shard_hashes(FEATURES_FOLDER)
    shards = catalogue.shards(FEATURES_FOLDER)
    n_joined = 0
    whole = [row for row in shards if row["id"] not in with_deleted]
    for shard_ids in alike_shards(whole, shortly=shortly):
        packed: list[PackedMotion] = []
        clips: list[int] = []
        places = catalogue.feature_places(shard_ids=shard_ids)
        for file, own in groupby(sorted(places, key=lambda each: each[1]), lambda each: each[1]):
            reader = FeatureReader(catalogue.path.parent / FEATURES_FOLDER / file, hashes[file])
            for clip_id, _, row in own:
                clips.append(clip_id)
                packed.append(reader.packed(row))
        with catalogue.transaction():
            new = catalogue.add_shard(FEATURES_FOLDER, _image(packed))
            catalogue.move_features({clip_id: (new, row) for row, clip_id in enumerate(clips)})
        n_joined += len(shard_ids)
    return n_joined


def compact_features(catalogue: CatalogueWriter) -> None:
    """Rewrite the shards that hold features of no live clip, in the catalogue's transaction.

    These are the features of clips that were deleted, and those of before a clip was cleaned.
    """
    places = catalogue.feature_places()
    hashes = catalogue.shard_hashes(FEATURES_FOLDER)
    for file, n_live in catalogue.feature_files().items():
        reader = FeatureReader(catalogue.path.parent / FEATURES_FOLDER / file, hashes[file])
        if len(reader) == n_live:
            continue
        moving = [(clip_id, row) for clip_id, where, row in places if where == file]
        commit_features(catalogue, [(clip_id, reader.packed(row), None) for clip_id, row in moving])
