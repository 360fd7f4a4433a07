"""A library: a folder of compressed clips that can be listed, read, checked and exported."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.errors import CodecError, LibraryError, MocapdbError, UnknownClipError
from mocapdb.library.build import SHARDS_FOLDER, Progress, open_for_writing
from mocapdb.library.catalogue import (
    FEATURES_FOLDER,
    MODELS_FILE,
    SEARCH_FILE,
    Catalogue,
    ClipRecord,
)
from mocapdb.library.shards import ShardReader, next_shard_number, stray_files, write_shard
from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import Skeleton

if TYPE_CHECKING:
    from mocapdb.compression import PayloadReader
    from mocapdb.library.retrieval import Retrieval

__all__ = ["Library"]

MOST_READERS = 256  # payloads kept open for ranges of frames


class Library:
    """An open library.

    Parameters
    ----------
    path : path-like
        The library's folder.

    Raises
    ------
    LibraryError
        If it is no library, or its format is newer than this version's.

    Examples
    --------
    >>> with Library("cmu.mocapdb") as library:  # doctest: +SKIP
    ...     clip = library.clip("02_03", frames=slice(0, 120))
    """

    def __init__(self, path: StrPath) -> None:
        self.path = Path(path)
        self._catalogue = Catalogue.open(self.path)
        self._shards: dict[int, ShardReader] = {}
        self._readers: dict[int, PayloadReader] = {}
        self._skeletons: dict[int, Skeleton] = {}

    # -- what is in it ---------------------------------------------------------------------------

    def records(self, *, label: str | None = None, search: str | None = None) -> list[ClipRecord]:
        """Return the catalogue's rows by name; of one class, or that match a text search."""
        return list(self._catalogue.records(label=label, search=search))

    def record(self, name: str) -> ClipRecord:
        """Return the row of the clip of that name, or of the only one with that stem.

        Raises
        ------
        UnknownClipError
            If there is none, or the stem fits several.
        """
        return self._catalogue.resolve(name)

    def classes(self) -> dict[str, int]:
        """Return the number of clips of each class."""
        return self._catalogue.classes()

    def __len__(self) -> int:
        return self._catalogue.n_clips()

    def __iter__(self) -> Iterator[Clip]:
        for record in self.records():
            yield self._decode(record)

    # -- reading ---------------------------------------------------------------------------------

    def clip(self, name: str, frames: slice | None = None) -> Clip:
        """Decode a clip, or a range of its frames.

        Parameters
        ----------
        name : str
        frames : slice, optional
            Frames, end-exclusive; all by default.

        Raises
        ------
        UnknownClipError
            If no clip has that name.
        LibraryError, CodecError
            If its bytes are damaged.
        """
        return self._decode(self.record(name), frames)

    def skeleton(self, record: ClipRecord) -> Skeleton:
        """Return the skeleton of a clip."""
        if record.skeleton_id not in self._skeletons:
            self._skeletons[record.skeleton_id] = self._catalogue.skeleton(record.skeleton_id)
        return self._skeletons[record.skeleton_id]

    def payload(self, record: ClipRecord) -> bytes:
        """Return the compressed bytes of a clip, checked against their checksum."""
        return self._shard(record).payload(record.shard_row)

    def channels(self, record: ClipRecord, frames: slice) -> FloatArray:
        """Return the channels (F, C) of a range of frames, reading only the blocks they are in.

        The quickest way to single poses: what is in front of a clip's blocks is read once.

        Raises
        ------
        LibraryError, CodecError
            If the bytes are damaged.
        """
        from mocapdb.compression import PayloadReader

        if record.id not in self._readers:
            if len(self._readers) >= MOST_READERS:
                self._readers.pop(next(iter(self._readers)))
            source = self._shard(record).source(record.shard_row)
            reader = PayloadReader(source, self.skeleton(record), bases=self._bases)
            self._readers[record.id] = reader
        return self._readers[record.id].channels(frames)

    @cached_property
    def _bases(self) -> dict[bytes, bytes]:
        return self._catalogue.bases()

    def _shard(self, record: ClipRecord) -> ShardReader:
        if record.shard_id not in self._shards:
            file = self._catalogue.shard_file(record.shard_id)
            self._shards[record.shard_id] = ShardReader(self.path / SHARDS_FOLDER / file)
        return self._shards[record.shard_id]

    def export(self, name: str, path: StrPath) -> ClipRecord:
        """Decode a clip and write it as AMC with ASF, BVH or NPZ, by the path's suffix.

        A stem that fits several clips is understood where exactly one of them was read from a
        file of the format asked for. Returns the row of the clip that was taken.

        Raises
        ------
        UnknownClipError, LibraryError, CodecError, FormatError
        """
        from mocapdb.io import write_clip

        try:
            record = self.record(name)
        except UnknownClipError as problem:
            suffix = Path(path).suffix.lower()
            same = [
                fitting
                for fitting in map(self.record, problem.candidates)
                if fitting.stem == name and Path(fitting.source).suffix.lower() == suffix
            ]
            if len(same) != 1:
                raise
            (record,) = same
        write_clip(self._decode(record), path)
        return record

    def _decode(self, record: ClipRecord, frames: slice | None = None) -> Clip:
        from mocapdb.compression import decode

        skeleton = self.skeleton(record)
        try:
            if frames is None:
                channels = decode(self.payload(record), skeleton, bases=self._bases)
            else:
                channels = self.channels(record, frames)
        except CodecError as problem:
            raise CodecError(f"{self.path}: {record.name}: {problem}") from None
        return Clip(
            skeleton,
            channels,
            record.fps,
            name=record.name,
            label=record.label,
            source=record.source,
            fps_source=record.fps_source,
            frame_time_text=record.frame_time_text,
            provenance=(*record.provenance, f"coded by {record.codec}"),
        )

    # -- searching by example ---------------------------------------------------------------------

    @cached_property
    def retrieval(self) -> Retrieval:
        """The library as something to search by example and to classify with (docs/query.md).

        Raises
        ------
        LibraryError
            If the library is empty, or was built without features.
        """
        from mocapdb.library.retrieval import Retrieval

        return Retrieval(self, self._catalogue)

    @staticmethod
    def index(path: StrPath, progress: Progress | None = None) -> dict[str, int]:
        """Make a library ready for queries: what a build that was told not to has left out.

        Returns
        -------
        dict
            ``indexed``, the clips that were added; ``unmapped``, the clips whose skeletons cannot
            be brought to the canonical body; ``classes`` that were learned.

        Raises
        ------
        LibraryError, CodecError
            If the library is locked, damaged, or the disk is full.
        """
        from mocapdb.library.retrieval import add_features

        folder = Path(path)
        with open_for_writing(folder) as catalogue, Library(folder) as library:
            return add_features(library, catalogue, progress)

    @staticmethod
    def apply_labels(path: StrPath, labels: Mapping[str, str]) -> None:
        """Give clips classes that no label file has given, and learn the classes anew.

        They stay through later builds, until the corpus itself says what such a clip is.

        Parameters
        ----------
        path : path-like
            The library.
        labels : mapping of str to str
            Class by name of the clip.

        Raises
        ------
        UnknownClipError
            If there is no such clip.
        LibraryError
            If the library is locked or cannot be written.
        """
        from mocapdb.library.search_index import refresh_index

        folder = Path(path)
        with open_for_writing(folder) as catalogue:
            updates: list[tuple[int, dict[str, Any]]] = [
                (catalogue.resolve(name).id, {"label": label, "label_source": "classify"})
                for name, label in labels.items()
            ]
            with catalogue.transaction():
                catalogue.update_clips(updates)
            refresh_index(folder, catalogue)

    # -- figures ---------------------------------------------------------------------------------

    def info(self, name: str | None = None) -> dict[str, Any]:
        """Return the figures of the library, or of one clip, as the JSON contract names them.

        Errors are those measured when the clips were built. Over a library the mean errors are
        means over frames, ``p95`` is the mean over frames of the clips' own 95th percentiles, and
        ``max`` is the largest of all.
        """
        records = self.records() if name is None else [self.record(name)]
        frames = sum(record.frames for record in records)
        payload = sum(record.payload_bytes for record in records)
        float32 = sum(4 * record.frames * record.n_channels for record in records)
        source = sum(record.source_bytes for record in records)

        def over_frames(column: str) -> float:
            total = sum(getattr(record, column) * record.frames for record in records)
            return total / frames if frames else 0.0

        figures: dict[str, Any] = {
            "clips": len(records),
            "frames": frames,
            "seconds": sum(record.duration_s for record in records),
            "payload_bytes": payload,
            "bytes_per_frame": payload / frames if frames else 0.0,
            "ratio_float32": float32 / payload if payload else 0.0,
            "ratio_source": source / payload if payload else 0.0,
            "skinned_error": over_frames("skinned_error"),
            "skinned_error_max": max((record.skinned_error for record in records), default=0.0),
            "error_mm": {
                "mean": over_frames("error_mean_mm"),
                "p95": over_frames("error_p95_mm"),
                "max": max((record.error_max_mm for record in records), default=0.0),
            },
        }
        if name is None:
            figures["classes"] = self.classes()
            figures["codecs"] = dict(Counter(_codec_choice(record.codec) for record in records))
            from mocapdb.library.stored_cycles import list_cycles

            figures["cycles"] = list_cycles(self.path)
            files = [path for path in self.path.rglob("*") if path.is_file()]
            figures["disk_bytes"] = sum(file.stat().st_size for file in files)
            # of that, what queries and classes need and decoding does not
            figures["index_bytes"] = sum(
                file.stat().st_size
                for file in files
                if file.parent.name == FEATURES_FOLDER or file.name in (SEARCH_FILE, MODELS_FILE)
            )
            return figures
        (record,) = records
        figures["classes"] = {record.label: 1} if record.label else {}
        return figures | {
            "clip": record.name,
            "label": record.label,
            "description": record.description,
            "fps": record.fps,
            "fps_source": record.fps_source,
            "source": record.source,
            "codec": record.codec,
        }

    # -- keeping it sound ------------------------------------------------------------------------

    def verify(self, progress: Progress | None = None) -> dict[str, Any]:
        """Check every checksum, look for strays, and decode every clip.

        Returns
        -------
        dict
            ``clips``, the number checked; ``bad``, a list of ``{"clip", "reason"}``; ``shards``,
            the same for shards as ``{"shard", "reason"}``; ``stray``, files that belong to no
            commit: a build that is at work, or was killed, leaves them, and the next removes them.
        """
        bad_shards = self._damaged_shards()
        bad = []
        records = self.records()
        for done, record in enumerate(records, start=1):
            try:
                clip = self._decode(record)
                if len(clip) != record.frames:
                    raise LibraryError(f"expected {record.frames} frames, but decoded {len(clip)}")
            except MocapdbError as problem:
                bad.append({"clip": record.name, "reason": str(problem)})
            if progress:
                progress(done, len(records), record.name)
        known = self._catalogue.shard_files()
        stray = [path.name for path in stray_files(self.path / SHARDS_FOLDER, known)]
        if (self.path / FEATURES_FOLDER).is_dir():
            known = self._catalogue.feature_files()
            strays = stray_files(self.path / FEATURES_FOLDER, known)
            stray += [f"{FEATURES_FOLDER}/{path.name}" for path in strays]
        return {"clips": len(records), "bad": bad, "shards": bad_shards, "stray": stray}

    def _damaged_shards(self) -> list[dict[str, str]]:
        damaged = []
        problem = self._catalogue.check()
        if problem:
            damaged.append({"shard": self._catalogue.path.name, "reason": problem})
        shards = [(SHARDS_FOLDER, row) for row in self._catalogue.shards()]
        shards += [(FEATURES_FOLDER, row) for row in self._catalogue.feature_shards()]
        for place, row in shards:
            path = self.path / place / row["file"]
            name = row["file"] if place == SHARDS_FOLDER else f"{place}/{row['file']}"
            try:
                with path.open("rb") as file:
                    digest = hashlib.file_digest(file, "sha256").hexdigest()
            except OSError as missing:
                damaged.append({"shard": name, "reason": f"cannot read: {missing.strerror}"})
                continue
            if digest != row["sha256"]:
                damaged.append({"shard": name, "reason": "fails its SHA-256"})
        return damaged

    @staticmethod
    def compact(path: StrPath) -> int:
        """Rewrite a library without the clips that were replaced; return the bytes freed.

        Killed at any moment it leaves the library as it was, or as it will be.

        Raises
        ------
        LibraryError
            If the library is locked or damaged, or the disk is full.
        """
        folder = Path(path)
        shards = folder / SHARDS_FOLDER
        before = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
        with open_for_writing(folder) as catalogue, Library(folder) as library:
            wasteful = catalogue.shards_with_buried()
            moving = [record for record in library.records() if record.shard_id in wasteful]
            by_shard: dict[int, list[ClipRecord]] = {record.shard_id: [] for record in moving}
            for record in moving:
                by_shard[record.shard_id].append(record)
            number = next_shard_number(shards)
            rewritten = []
            for i, records in enumerate(by_shard.values()):
                payloads = [library.payload(record) for record in records]
                digests = [record.source_sha256 for record in records]
                rewritten.append((records, write_shard(shards, number + i, payloads, digests)))
            with catalogue.transaction():
                for records, shard in rewritten:
                    shard_id = catalogue.add_shard(shard.file, shard.size, shard.sha256)
                    for row, record in enumerate(records):
                        catalogue.move(record.id, shard_id, row)
                if catalogue.feature_files_with_buried():
                    from mocapdb.library.canonical_shards import compact_features

                    compact_features(folder, catalogue)
                catalogue.forget_buried()
            catalogue.shrink()
            if catalogue.feature_files():
                from mocapdb.library.search_index import refresh_index

                refresh_index(folder, catalogue)
        return before - sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())

    # -- opening and closing ---------------------------------------------------------------------

    def close(self) -> None:
        """Close every open file."""
        for shard in self._shards.values():
            shard.close()
        self._shards.clear()
        self._readers.clear()
        self._catalogue.close()

    def __enter__(self) -> Library:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Library({str(self.path)!r}: {len(self)} clips)"


def _codec_choice(codec: str) -> str:
    """Return what a codec chose first, of what it says of a clip: ``"pose spline"``."""
    words = codec.split()
    shares = [i for i, word in enumerate(words) if word.endswith("%")]
    return " ".join(words[: shares[0]] if shares else words[:3])
