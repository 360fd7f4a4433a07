"""What the catalogue says of a clip: all there is to know without decoding it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Self

from mocapdb.library.naming import subject_of

__all__ = ["ClipLine", "ClipRecord"]


MENDED = "mended:"  # how `mocapdb.io` begins such a step of the provenance


@dataclass(frozen=True)
class ClipRecord:
    """One row of the catalogue.

    Attributes
    ----------
    name, stem : str
        The clip's unique name, and its file's stem.
    label, description : str
        Class and free text from the labels; label may be None. `label_source` is ``"corpus"``, or
        ``"classify"`` where ``mocapdb classify --apply`` gave it.
    frames, fps
        Length in frames and rate in frames per second; `fps_source` says who stated the rate.
    unit_m : float, metres
        Length of the skeleton's unit. `unit_source` says who stated it: see `Clip.unit_source`;
        ``"unknown"`` for clips of before it was kept.
    up : str
        The vertical axis; `up_source` likewise.
    body : str
        How its joints were found, ``"by names"`` or ``"by shape"``; ``"none"`` where it is no whole
        human body, ``"unknown"`` for clips of before it was kept.
    height_m : float, metres, optional
        Stature, or the vertical extent of what is no human body.
    subject : str, optional
        Who performs it, as `subject_source` says: ``"labels"``, ``"manifest"``, ``"caller"`` or
        ``"settings"`` by a pattern of names, or the file's ``"name"``.
    columns : mapping of str to str
        Further columns of its row of the labels.
    source, source_bytes, source_sha256
        File relative to the corpus, its size, and the hash of its bytes and its skeleton's.
    codec : str
        What the codec chose.
    payload_bytes : int
        Size of the compressed clip.
    skinned_error : float, skeleton units
    error_mean_mm, error_p95_mm, error_max_mm : float
        Distances of the skin's vertices after decoding.
    """

    id: int
    name: str
    stem: str
    label: str | None
    label_source: str
    description: str
    skeleton_id: int
    frames: int
    fps: float
    fps_source: str
    frame_time_text: str
    provenance: tuple[str, ...]
    corpus: str
    source: str
    source_bytes: int
    source_sha256: str
    settings: str
    codec: str
    payload_bytes: int
    skinned_error: float
    error_mean_mm: float
    error_p95_mm: float
    error_max_mm: float
    shard_id: int
    shard_row: int
    n_channels: int
    unit_m: float
    unit_source: str
    up: str
    up_source: str
    body: str
    height_m: float | None
    subject: str | None
    subject_source: str
    columns: Mapping[str, str] = field(hash=False)

    @classmethod
    def of_row(cls, names: Sequence[str], values: Iterable[object]) -> Self:
        """Return the record with these values, all of them, by their names.

        As the class itself does, but ten times as fast.
        """
        record = cls.__new__(cls)
        vars(record).update(zip(names, values, strict=True))
        return record

    @property
    def performer(self) -> str:
        """Who performs it: its subject, else whom its file's name tells; empty where nobody knows.

        Clips of before subjects were kept have only their names.
        """
        return self.subject or subject_of(self.stem)

    @property
    def duration_s(self) -> float:
        """Length in seconds."""
        return self.frames / self.fps

    @property
    def mended(self) -> tuple[str, ...]:
        """What was mended when its file was read."""
        steps = (step.partition(MENDED) for step in self.provenance)
        return tuple(what.strip() for before, found, what in steps if found and not before)

    @property
    def bytes_per_frame(self) -> float:
        """Payload bytes a frame."""
        return self.payload_bytes / self.frames


class ClipLine(NamedTuple):
    """What a list says of a clip: some of what its record does, which takes a third of the time."""

    id: int
    name: str
    label: str | None
    description: str
    frames: int
    fps: float
    payload_bytes: int
    error_mean_mm: float
    error_max_mm: float

    @property
    def duration_s(self) -> float:
        """Length in seconds."""
        return self.frames / self.fps

    @property
    def bytes_per_frame(self) -> float:
        """Payload bytes a frame."""
        return self.payload_bytes / self.frames
