"""What the catalogue says of a clip: all there is to know without decoding it."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["ClipRecord"]


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

    @property
    def duration_s(self) -> float:
        """Length in seconds."""
        return self.frames / self.fps

    @property
    def bytes_per_frame(self) -> float:
        """Payload bytes a frame."""
        return self.payload_bytes / self.frames
