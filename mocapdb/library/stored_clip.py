"""A clip of a library as another process decodes it: from its shard alone, without the catalogue.

SQLite's files are for processes of one machine; shards never change, and any number may read them.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import CodecError
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.revision import Revision
from mocapdb.library.shards import ShardReader
from mocapdb.motion.clip import CODED, Clip
from mocapdb.motion.skeleton import Skeleton

__all__ = ["StoredClip", "clip_of_row", "payload_digest", "shard_row", "whole_channels"]


@dataclass(frozen=True, eq=False)
class StoredClip:
    """All that it takes to decode a clip of a library.

    Attributes
    ----------
    library : str
        What errors call the library.
    shard : Path
        The file that holds its payload.
    record : ClipRecord
    row : ClipRecord or Revision
        Whose payload is decoded: the clip's, or that of what was cleaned in it.
    skeleton : Skeleton
    bases : mapping of bytes to bytes
        What payloads of the library refer to.
    """

    library: str
    shard: Path
    record: ClipRecord
    row: ClipRecord | Revision
    skeleton: Skeleton
    bases: Mapping[bytes, bytes]

    def decode(self, shard: ShardReader | None = None) -> Clip:
        """Return the clip.

        Parameters
        ----------
        shard : ShardReader, optional
            Its shard, if it is open already.

        Raises
        ------
        LibraryError, CodecError
            If its shard is missing, or bytes are damaged.
        """
        if shard is None:
            with closing(ShardReader(self.shard)) as opened:
                return self.decode(opened)
        payload = shard.payload(shard_row(self.row), payload_digest(self.row))
        try:
            channels = whole_channels(payload, self.record, self.skeleton, self.bases)
        except CodecError as problem:
            raise CodecError(f"{self.library}: {self.record.name}: {problem}") from None
        return clip_of_row(self.record, self.row, self.skeleton, channels)


def whole_channels(
    payload: bytes, record: ClipRecord, skeleton: Skeleton, bases: Mapping[bytes, bytes]
) -> FloatArray:
    """Return the channels (F, C) of all frames of a clip.

    Raises
    ------
    CodecError
        If the payload is damaged, or has another number of frames.
    """
    from mocapdb.compression import decode

    channels = decode(payload, skeleton, bases=bases)
    if len(channels) != record.frames:
        raise CodecError(f"expected {record.frames} frames, but got {len(channels)}.")
    return channels


def clip_of_row(
    record: ClipRecord, row: ClipRecord | Revision | None, skeleton: Skeleton, channels: FloatArray
) -> Clip:
    """Return channels as a clip with all that the catalogue says of it.

    They were decoded from the payload of a row, or, where that is None, read from the clip's file.
    """
    steps = [] if row is None else [f"{CODED} {row.codec}"]
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


def payload_digest(row: ClipRecord | Revision) -> str:
    """Return what a shard says of the payload of a row, so that it is no other's."""
    return row.sha256 if isinstance(row, Revision) else row.source_sha256


def shard_row(row: ClipRecord | Revision) -> int:
    """Return the place of a row's payload in its shard; -1 if it has none."""
    return -1 if row.shard_row is None else row.shard_row
