"""A library: a folder of compressed clips that can be listed, decoded and exported."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.errors import CodecError, LibraryError, UnknownClipError
from mocapdb.library.catalogue import Catalogue
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.cycles_file import list_cycles
from mocapdb.library.joint_losses import JointLoss, lost_most, unpack_losses
from mocapdb.library.layout import SHARDS_FOLDER, disk_bytes
from mocapdb.library.outlying import outlying_clips
from mocapdb.library.revision import Revision
from mocapdb.library.shards import ShardReader
from mocapdb.library.tuning import MOST_READERS
from mocapdb.motion.clip import CODED, Clip
from mocapdb.motion.skeleton import Skeleton

if TYPE_CHECKING:
    from mocapdb.compression import PayloadReader
    from mocapdb.motion.representations import RepresentationName

__all__ = ["Library", "payload_digest"]


class Library:
    """An open library, to read.

    What searches it, changes it or checks it stands beside it and takes it: `Retrieval`,
    `build_library`, `verify_library` and the others of `mocapdb.library`.

    Parameters
    ----------
    path : path-like
        The library's folder.
    original : bool
        Whether clips that have a cleaned revision are decoded as they were captured.

    Attributes
    ----------
    path : Path
    original : bool
    catalogue : Catalogue
        What it holds, row by row.

    Raises
    ------
    LibraryError
        If it is no library, or its format is newer than this version's.

    Examples
    --------
    >>> from mocapdb import BuildSettings, Target, build_library
    >>> from mocapdb.corpus import synthetic
    >>> from mocapdb.io import write_clip
    >>> _ = write_clip(synthetic.make_clip("walk", seed=1, duration_s=2), "07_01.bvh")
    >>> settings = BuildSettings(Target("mean_mm", 1.0))
    >>> report = build_library(".", "small.mocapdb", settings, jobs=1, index=False)
    >>> with Library("small.mocapdb") as library:
    ...     clip = library.clip("07_01", frames=slice(60, 180))
    >>> len(clip), clip.fps
    (120, 120.0)
    """

    def __init__(self, path: StrPath, *, original: bool = False) -> None:
        self.path = Path(path)
        self.original = original
        self.catalogue = Catalogue(self.path)
        self._shards: dict[int, ShardReader] = {}
        self._readers: dict[tuple[int, int], PayloadReader] = {}
        self._skeleton = cache(self.catalogue.skeleton)

    # -- what is in it ---------------------------------------------------------------------------

    def records(
        self,
        *,
        label: str | None = None,
        search: str | None = None,
        where: Mapping[str, str] | None = None,
    ) -> list[ClipRecord]:
        """Return the catalogue's rows by name.

        Only those of one class, that match a text search, or whose further columns have the values
        that `where` names.

        Raises
        ------
        LibraryError
            If no clip has one of these columns.
        """
        return list(self.catalogue.records(label=label, search=search, where=where))

    def record(self, name: str) -> ClipRecord:
        """Return the row of the clip of that name, or of the only one with that stem.

        Raises
        ------
        UnknownClipError
            If there is none, or the stem fits several.
        """
        return self.catalogue.resolve(name)

    def classes(self) -> dict[str, int]:
        """Return the number of clips of each class."""
        return self.catalogue.classes()

    def __len__(self) -> int:
        return self.catalogue.n_clips()

    def __iter__(self) -> Iterator[Clip]:
        for record in self.records():
            yield self.decode(record)

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
        return self.decode(self.record(name), frames)

    def skeleton(self, record: ClipRecord) -> Skeleton:
        """Return the skeleton of a clip."""
        return self._skeleton(record.skeleton_id)

    def revision(self, record: ClipRecord) -> Revision | None:
        """Return the cleaned revision of a clip, if it has one."""
        return self.catalogue.revision(record.id)

    def captured(self, record: ClipRecord) -> Clip:
        """Decode the clip of a row as it was captured, also where it was cleaned since."""
        return self._decoded(record, record)

    def payload(self, record: ClipRecord) -> bytes:
        """Return the compressed bytes of a clip, checked against their checksum."""
        return self.stored_payload(self._taken(record))

    def stored_payload(self, row: ClipRecord | Revision) -> bytes:
        """Return the compressed bytes of just this row, of a clip or of a revision."""
        return self._shard(row).payload(_shard_row(row), payload_digest(row))

    def channels(self, record: ClipRecord, frames: slice) -> FloatArray:
        """Return the channels (F, C) of a range of frames, reading only the blocks they are in.

        The quickest way to single poses: what is in front of a clip's blocks is read once.

        Raises
        ------
        LibraryError, CodecError
            If the bytes are damaged.
        """
        return self._channels(record, self._taken(record), frames)

    def _channels(
        self, record: ClipRecord, row: ClipRecord | Revision, frames: slice
    ) -> FloatArray:
        from mocapdb.compression import PayloadReader

        key = record.id, row.id if isinstance(row, Revision) else 0
        if key not in self._readers:
            if len(self._readers) >= MOST_READERS:
                self._readers.pop(next(iter(self._readers)))
            source = self._shard(row).source(_shard_row(row), payload_digest(row))
            reader = PayloadReader(source, self.skeleton(record), bases=self._bases)
            self._readers[key] = reader
        return self._readers[key].channels(frames)

    def _taken(self, record: ClipRecord) -> ClipRecord | Revision:
        """Return the row whose payload is decoded: the revision's, unless told otherwise."""
        revision = None if self.original else self.revision(record)
        return record if revision is None or not revision.changes else revision

    @cached_property
    def _bases(self) -> dict[bytes, bytes]:
        return self.catalogue.bases()

    def _shard(self, row: ClipRecord | Revision) -> ShardReader:
        if row.shard_id is None:
            raise LibraryError(f"{self.path}: revision {row.id} has no payload of its own.")
        if row.shard_id not in self._shards:
            file = self.catalogue.shard_file(row.shard_id)
            self._shards[row.shard_id] = ShardReader(self.path / SHARDS_FOLDER / file)
        return self._shards[row.shard_id]

    def export(
        self, name: str, path: StrPath, representation: RepresentationName | None = None
    ) -> ClipRecord:
        """Decode a clip and write it as AMC with ASF, BVH or NPZ, by the path's suffix.

        In a representation it is written as NPZ or CSV, with names, units and root track.

        A stem that fits several clips is understood where exactly one of them was read from a
        file of the format asked for. Returns the row of the clip that was taken.

        Raises
        ------
        UnknownClipError, LibraryError, CodecError, FormatError
        """
        from mocapdb.io import write_clip, write_representation

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
        clip = self.decode(record)
        if representation is None:
            row = self._taken(record)
            error_mm = record.error_max_mm + (0 if row is record else row.error_max_mm)
            write_clip(clip, path, error_m=error_mm / 1000)
        else:
            write_representation(clip, representation, path)
        return record

    def decode(self, record: ClipRecord, frames: slice | None = None) -> Clip:
        """Decode the clip of a row, or a range of its frames; see `clip`."""
        return self._decoded(record, self._taken(record), frames)

    def decode_revision(self, record: ClipRecord, revision: Revision) -> Clip:
        """Decode a clip as it was cleaned; as it is where nothing was repaired."""
        return self._decoded(record, revision if revision.changes else record)

    def _decoded(
        self, record: ClipRecord, row: ClipRecord | Revision, frames: slice | None = None
    ) -> Clip:
        from mocapdb.compression import decode

        skeleton = self.skeleton(record)
        try:
            if frames is None:
                payload = self.stored_payload(row)
                channels = decode(payload, skeleton, bases=self._bases)
                if len(channels) != record.frames:
                    raise CodecError(f"expected {record.frames} frames, but got {len(channels)}.")
            else:
                channels = self._channels(record, row, frames)
        except CodecError as problem:
            raise CodecError(f"{self.path}: {record.name}: {problem}") from None
        steps = [f"{CODED} {row.codec}"]
        if isinstance(row, Revision):
            steps.append(
                f"repaired {row.n_repaired} of {len(row.spans)} flagged spans on {row.created}"
            )
        return Clip(
            skeleton,
            channels,
            record.fps,
            name=record.name,
            label=record.label,
            source=record.source,
            fps_source=record.fps_source,
            unit_source=record.unit_source,
            up_source=record.up_source,
            frame_time_text=record.frame_time_text,
            provenance=(*record.provenance, *steps),
        )

    # -- figures ---------------------------------------------------------------------------------

    def info(self, name: str | None = None) -> dict[str, Any]:
        """Return the figures of the library, or of one clip, as the JSON contract names them.

        Errors are those measured when the clips were built. Over a library the mean errors are
        ``joints`` has what each joint lost of its own motion; of a library those that lost most,
        as ``worst_clips`` has the clips. ``unmeasured`` is the number of clips that an earlier
        version built, of which that is not known. Over a library the mean errors are
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
        errors = self.catalogue.joint_errors(records[0].id if name is not None else None)
        figures["unmeasured"] = sum(record.id not in errors for record in records)
        if name is None:
            figures |= lost_most(
                (record.name, record.fps, loss)
                for record in records
                for loss in self._joint_losses(record, errors)
            )
            figures["classes"] = self.classes()
            figures["codecs"] = dict(Counter(_codec_choice(record.codec) for record in records))
            figures["unsearchable"] = len(self.catalogue.unsearchable())
            figures["outlying"] = outlying_clips(self.path, self.catalogue)
            figures["cycles"] = list_cycles(self.path)
            figures["revisions"] = _revised(self.catalogue.revisions().values())
            # the second: what queries and classes need and decoding does not
            figures["disk_bytes"], figures["index_bytes"] = disk_bytes(self.path)
            figures["shared_axes"] = len(self._bases)
            figures["shared_axes_bytes"] = sum(map(len, self._bases.values()))
            return figures
        (record,) = records
        figures["classes"] = {record.label: 1} if record.label else {}
        revision = self.revision(record)
        return figures | {
            "clip": record.name,
            "label": record.label,
            "description": record.description,
            **assumed_of(record),
            "mended": list(record.mended),
            "unsearchable": self.catalogue.unsearchable().get(record.name),
            "subject": record.subject,
            "subject_source": record.subject_source,
            "columns": dict(record.columns),
            "source": record.source,
            "codec": record.codec,
            "revision": None if revision is None else revision.to_dict(),
            "joints": [
                asdict(loss) | {"worst_s": loss.worst_frame / record.fps}
                for loss in self._joint_losses(record, errors)
            ],
        }

    def _joint_losses(self, record: ClipRecord, errors: Mapping[int, bytes]) -> list[JointLoss]:
        """Return what the joints of a clip lost; nothing where it was not measured."""
        return unpack_losses(errors.get(record.id, b""), self.skeleton(record).names)

    # -- opening and closing ---------------------------------------------------------------------

    def close(self) -> None:
        """Close every open file."""
        for shard in self._shards.values():
            shard.close()
        self._shards.clear()
        self._readers.clear()
        self.catalogue.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Library({str(self.path)!r}: {len(self)} clips)"


def payload_digest(row: ClipRecord | Revision) -> str:
    """Return what a shard says of the payload of a row, so that it is no other's."""
    return row.sha256 if isinstance(row, Revision) else row.source_sha256


def _shard_row(row: ClipRecord | Revision) -> int:
    return -1 if row.shard_row is None else row.shard_row


def _revised(revisions: Iterable[Revision]) -> dict[str, int]:
    """Return how many clips were searched for faults, and what came of it."""
    every = list(revisions)
    return {
        "searched": len(every),
        "cleaned": sum(revision.changes for revision in every),
        "spans": sum(len(revision.spans) for revision in every),
        "left": sum(len(revision.left) for revision in every),
        "payload_bytes": sum(revision.payload_bytes for revision in every),
    }


def assumed_of(record: ClipRecord) -> dict[str, Any]:
    """Return what was taken for granted of a clip, as the JSON contract names it."""
    return {
        "unit_m": record.unit_m,
        "unit_m_source": record.unit_source,
        "up": record.up,
        "up_source": record.up_source,
        "fps": record.fps,
        "fps_source": record.fps_source,
        "body": record.body,
        "height_m": record.height_m,
    }


def _codec_choice(codec: str) -> str:
    """Return what a codec chose first, of what it says of a clip.

    ``"pose spline"``, or ``"okane aligned dwt db4 pca of a set"``.
    """
    words = re.sub(r"pca=\d+", "pca", codec).split()
    shares = [i for i, word in enumerate(words) if word.endswith("%")]
    return " ".join(words[: shares[0]] if shares else words)
