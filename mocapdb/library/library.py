"""A library: a folder of compressed clips that can be listed, decoded and exported."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.base.progress import Progress
from mocapdb.errors import CodecError, LibraryError, UnknownClipError
from mocapdb.library.addresses import address_of
from mocapdb.library.catalogue import Catalogue, Chosen
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.cycles_file import list_cycles
from mocapdb.library.joint_losses import ClipLosses, lost_most, unpack_losses
from mocapdb.library.layout import SHARDS_FOLDER, disk_bytes
from mocapdb.library.naming import file_and_take
from mocapdb.library.outlying import outlying_clips
from mocapdb.library.remote import copy_derived, library_bytes, local_copy
from mocapdb.library.revision import Revision
from mocapdb.library.shards import ShardReader
from mocapdb.library.stored_clip import (
    StoredClip,
    clip_of_row,
    payload_digest,
    shard_row,
    whole_channels,
)
from mocapdb.library.tuning import MOST_READERS
from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import Skeleton

if TYPE_CHECKING:
    from mocapdb.compression import PayloadReader
    from mocapdb.indexing.recognition.class_models import Classification
    from mocapdb.library.searching.retrieval import Hit, Retrieval
    from mocapdb.library.training.motion_windows import MotionWindows
    from mocapdb.library.training.window_features import FeatureName
    from mocapdb.motion.representations import RepresentationName

__all__ = ["Library"]


class Library:
    """An open library, to read.

    What searches it, changes it or checks it stands beside it and takes it: `Retrieval`,
    `build_library`, `verify_library` and the others of `mocapdb.library`.

    Parameters
    ----------
    path : path-like
        The library's folder, or its address in object storage, such as
        ``"s3://bucket/cmu.mocapdb"``: see `mocapdb.library.remote`.
    original : bool
        Whether clips that have a cleaned revision are decoded as they were captured.

    Attributes
    ----------
    path : Path
        The folder; of a library in object storage that of its copy.
    address : str or None
        Where it is in object storage.
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
        self.address = address_of(path)
        self.path = local_copy(self.address) if self.address else Path(path)
        self.original = original
        self.catalogue = Catalogue(self.path)
        self._shards: dict[Path, ShardReader] = {}
        self._readers: dict[tuple[int, int], PayloadReader] = {}
        self._skeleton = cache(self.catalogue.skeleton)
        self._shard_file = cache(self.catalogue.shard_file)

    # -- what is in it ---------------------------------------------------------------------------

    def records(
        self,
        *,
        label: str | None = None,
        search: str | None = None,
        where: Mapping[str, str] | None = None,
        facets: Mapping[str, tuple[float | None, float | None]] | None = None,
        flagged: bool | None = None,
    ) -> list[ClipRecord]:
        """Return the catalogue's rows by name; with a text search, the best first.

        Parameters
        ----------
        label : str, optional
            Only clips of this class.
        search : str, optional
            Only clips with these words, their stems or beginnings, or other words for them.
        where : mapping of str to str, optional
            Only clips whose further columns have these values.
        facets : mapping of str to (low, high), optional
            Only clips of which these numbers lie in these ranges, such as
            ``{"root_speed": (1.0, 1.6)}``; None where a range is open. See `FACETS`.
        flagged : bool, optional
            Only clips in which flagged faults are left, or that were searched and have none left.

        Raises
        ------
        LibraryError
            If no clip has one of these columns, or a facet is unknown or cannot be so.
        """
        for given, what, such in (
            (where, "where", '{"style": "old"}'),
            (facets, "facets", '{"root_speed": (1.0, 1.6)}'),
        ):
            if given is not None and not isinstance(given, Mapping):
                raise LibraryError(f"Expected a dict as {what}, such as {such}, but got {given!r}.")
        return list(
            self.catalogue.records(Chosen(label, search, where or {}, facets or {}, flagged))
        )

    def record(self, name: str) -> ClipRecord:
        """Return the row of the clip of that name, or of the only one with that stem.

        Raises
        ------
        UnknownClipError
            If there is none, or the stem fits several.
        """
        return self.catalogue.resolve(name)

    def facets(self, record: ClipRecord) -> dict[str, float] | None:
        """Return what was measured of a clip, as the JSON contract names it; None if nothing."""
        measured = self.catalogue.facets().get(record.id)
        return None if measured is None else asdict(measured)

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
        return self._shard(row).payload(shard_row(row), payload_digest(row))

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
            source = self._shard(row).source(shard_row(row), payload_digest(row))
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
        path = self._shard_path(row)
        if path not in self._shards:
            self._shards[path] = ShardReader(path)
        return self._shards[path]

    def _shard_path(self, row: ClipRecord | Revision) -> Path:
        if row.shard_id is None:
            raise LibraryError(f"{self.place}: revision {row.id} has no payload of its own.")
        return self.path / SHARDS_FOLDER / self._shard_file(row.shard_id)

    def export(
        self,
        name: str,
        path: StrPath,
        representation: RepresentationName | None = None,
        *,
        blender: StrPath | None = None,
        progress: Progress | None = None,
    ) -> ClipRecord:
        """Decode a clip and write it in any format that there is, by the path's suffix.

        AMC with its ASF, BVH, NPZ, CSV, FBX and GLB, or an animated GIF, MP4 or HTML page, of which
        `progress` is told pictures drawn, pictures in all, and the file's name. In a representation
        it is written as NPZ or CSV, with names, units and root track.

        A stem that fits several clips is understood where exactly one of them was read from a
        file of the format asked for. Returns the row of the clip that was taken.

        Raises
        ------
        UnknownClipError, LibraryError, CodecError, FormatError
        """
        from mocapdb.io import write_clip, write_representation
        from mocapdb.scenes.animation import is_animation, write_animation

        try:
            record = self.record(name)
        except UnknownClipError as problem:
            suffix = Path(path).suffix.lower()
            same = [
                fitting
                for fitting in map(self.record, problem.candidates)
                if fitting.stem == name
                and Path(file_and_take(fitting.source)[0]).suffix.lower() == suffix
            ]
            if len(same) != 1:
                raise
            (record,) = same
        clip = self.decode(record)
        if representation is None and is_animation(path):
            write_animation(clip, path, progress=progress)
        elif representation is None:
            row = self._taken(record)
            error_mm = record.error_max_mm + (0 if row is record else row.error_max_mm)
            write_clip(clip, path, error_m=error_mm / 1000, blender=blender)
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
        skeleton = self.skeleton(record)
        try:
            if frames is None:
                payload = self.stored_payload(row)
                channels = whole_channels(payload, record, skeleton, self._bases)
            else:
                channels = self._channels(record, row, frames)
        except CodecError as problem:
            raise CodecError(f"{self.place}: {record.name}: {problem}") from None
        return clip_of_row(record, row, skeleton, channels)

    def stored(self, record: ClipRecord, row: ClipRecord | Revision | None = None) -> StoredClip:
        """Return a clip as another process decodes it, which does not open the library.

        Parameters
        ----------
        record : ClipRecord
        row : ClipRecord or Revision, optional
            Whose payload: the clip's own, or its revision's; by default what `decode` takes.
        """
        row = row or self._taken(record)
        return StoredClip(
            self.place,
            self._shard_path(row),
            record,
            row,
            self.skeleton(record),
            self._bases,
        )

    # -- searching -------------------------------------------------------------------------------

    @cached_property
    def retrieval(self) -> Retrieval:
        """What queries and classes need, opened on first use.

        Raises
        ------
        LibraryError
            If the library is empty, or was built without features.
        """
        from mocapdb.library.searching.retrieval import Retrieval

        return Retrieval(self)

    def query(
        self, examples: Clip | str | Sequence[Clip | str], *, k: int = 10, **options: Any
    ) -> list[Hit]:
        """Return the stretches that are like a clip, or like a clip of the library by its name.

        Parameters
        ----------
        examples : Clip, str, or sequence of them
        k : int
            How many hits, the nearest first.
        **options
            Those of `mocapdb.library.Retrieval.query`.

        Raises
        ------
        UnknownClipError, SkeletonError, ClipError, LibraryError
        """
        return self.retrieval.query(examples, k=k, **options)

    def classify(self, clip: Clip | str) -> Classification:
        """Return what a clip is, or a clip of the library by its name.

        Raises
        ------
        UnknownClipError, SkeletonError, LibraryError
        """
        return self.retrieval.classify(clip)

    # -- training --------------------------------------------------------------------------------

    def windows(
        self,
        length: int = 64,
        stride: int = 16,
        fps: float = 30.0,
        features: FeatureName = "positions",
        *,
        label: str | None = None,
        where: Mapping[str, str] | None = None,
        seed: int | None = None,
        cache_mb: float = 256.0,
        short: Literal["error", "skip"] = "error",
    ) -> MotionWindows:
        """Return windows of equal length over the clips: a dataset that torch's loader takes.

        Parameters
        ----------
        length, stride : int, frames
            Of a window, and from the start of one to that of the next, at `fps`.
        fps : float, frames per second
        features : {"positions", "quaternions", "6d", "canonical"}
            What a window holds; see `mocapdb.library.training`.
        label, where
            Which clips, as of `records`.
        seed : int, optional
            Mixes the windows, always in the same order.
        cache_mb : float, megabytes
            How much may be kept decoded.
        short : {"error", "skip"}
            What to do with a clip that is shorter than a window.

        Raises
        ------
        ClipError
            If a window is longer than a clip, a number is not positive, or the clips have
            different joints where the features need the same.
        LibraryError
            If no clip fits.
        """
        from mocapdb.library.training.motion_windows import MotionWindows

        return MotionWindows(
            self,
            self.records(label=label, where=where),
            length=length,
            stride=stride,
            fps=fps,
            features=features,
            seed=seed,
            cache_mb=cache_mb,
            short=short,
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
        record = None if name is None else self.record(name)
        self.copy_derived()
        total = self.catalogue.totals(None if record is None else record.id)
        frames, payload = total["frames"], total["payload_bytes"]
        each_frame = 1 / frames if frames else 0.0
        figures: dict[str, Any] = {
            "clips": total["clips"],
            "frames": frames,
            "seconds": total["seconds"],
            "payload_bytes": payload,
            "bytes_per_frame": payload * each_frame,
            "ratio_float32": total["float32_bytes"] / payload if payload else 0.0,
            "ratio_source": total["source_bytes"] / payload if payload else 0.0,
            "skinned_error": total["skinned_error"] * each_frame,
            "skinned_error_max": total["skinned_error_max"],
            "error_mm": {
                "mean": total["error_mean_mm"] * each_frame,
                "p95": total["error_p95_mm"] * each_frame,
                "max": total["error_max_mm"],
            },
        }
        if record is None:
            return figures | self._of_all(total["clips"])
        return figures | self._of_clip(record)

    def _of_all(self, n_clips: int) -> dict[str, Any]:
        """Return what `info` says of a library and not of a clip."""
        losses = [ClipLosses(*each) for each in self.catalogue.all_joint_errors()]
        codecs: Counter[str] = Counter()
        for codec, clips in self.catalogue.codecs():
            codecs[_codec_choice(codec)] += clips
        # the second: what queries and classes need and decoding does not
        disk, for_queries = (library_bytes if self.address else disk_bytes)(self.path)
        return {
            "unmeasured": n_clips - len(losses),
            **lost_most(losses, lambda skeleton: self._skeleton(skeleton).names),
            "classes": self.classes(),
            "codecs": dict(codecs),
            "unsearchable": len(self.catalogue.unsearchable()),
            "outlying": outlying_clips(self.catalogue),
            "cycles": list_cycles(self.path),
            "revisions": _revised(self.catalogue.revisions().values()),
            "disk_bytes": disk,
            "index_bytes": for_queries,
            "shared_axes": len(self._bases),
            "shared_axes_bytes": sum(map(len, self._bases.values())),
        }

    def _of_clip(self, record: ClipRecord) -> dict[str, Any]:
        """Return what `info` says of a clip and not of a library."""
        errors = self.catalogue.joint_errors(record.id)
        losses = unpack_losses(errors.get(record.id, b""), self.skeleton(record).names)
        revision = self.revision(record)
        return {
            "unmeasured": int(record.id not in errors),
            "classes": {record.label: 1} if record.label else {},
            "clip": record.name,
            "label": record.label,
            "description": record.description,
            **assumed_of(record),
            "mended": list(record.mended),
            "unsearchable": self.catalogue.unsearchable().get(record.name),
            "subject": record.subject,
            "subject_source": record.subject_source,
            "columns": dict(record.columns),
            "facets": self.facets(record),
            "source": record.source,
            "codec": record.codec,
            "revision": None if revision is None else revision.to_dict(),
            "joints": [
                asdict(loss) | {"worst_s": loss.worst_frame / record.fps} for loss in losses
            ],
        }

    @property
    def place(self) -> str:
        """Where the library is, as a text: its folder, or its address."""
        return self.address or str(self.path)

    def copy_derived(self) -> dict[str, str]:
        """Copy what queries and cycles read of a library in object storage, once it is needed.

        Returns what could not be copied, by file, and why.
        """
        return copy_derived(self.path, self.catalogue) if self.address else {}

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
        return f"Library({self.place!r}: {len(self)} clips)"


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
