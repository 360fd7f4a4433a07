"""A range of frames: the one interval that spans, hits, segments and periodic ranges are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray

__all__ = ["FrameRange", "Segment", "live_frames", "ranges_where"]


@dataclass(frozen=True)
class FrameRange:
    """Frames ``start:end``, end-exclusive as a slice.

    Attributes
    ----------
    start, end : int
        The first frame, and the first that is no longer in it.

    Examples
    --------
    >>> walk = FrameRange(10, 40)
    >>> len(walk), walk.frames
    (30, slice(10, 40, None))
    >>> walk.overlap(FrameRange(30, 60))
    10
    """

    start: int
    end: int

    def __len__(self) -> int:
        return max(self.end - self.start, 0)

    def __bool__(self) -> bool:
        return True  # an empty range is still a range

    @property
    def frames(self) -> slice:
        """The same as a slice, to index arrays and clips with."""
        return slice(self.start, self.end)

    def overlap(self, other: FrameRange) -> int:
        """Return how many frames two ranges share."""
        return max(min(self.end, other.end) - max(self.start, other.start), 0)


@dataclass(frozen=True)
class Segment(FrameRange):
    """Frames ``start:end`` in which one class of motion goes on.

    Attributes
    ----------
    label : str
        The class.
    """

    label: str


def ranges_where(flags: BoolArray) -> list[FrameRange]:
    """Return the unbroken ranges of True.

    Examples
    --------
    >>> ranges_where(np.array([True, False, True, True]))
    [FrameRange(start=0, end=1), FrameRange(start=2, end=4)]
    """
    bounds = np.flatnonzero(np.diff(flags, prepend=False, append=False))
    return [FrameRange(*pair) for pair in bounds.reshape(-1, 2).tolist()]


def live_frames(channels: FloatArray) -> FrameRange:
    """Return the frames (F, C) without the one that a capture holds before it begins or ends.

    Of a frame that is held, one is left. All frames, where nothing ever changes.

    Examples
    --------
    >>> live_frames(np.array([[0.0], [0.0], [0.0], [1.0], [1.0], [2.0]]))
    FrameRange(start=2, end=6)
    """
    changes = np.flatnonzero(np.any(np.diff(channels, axis=0) != 0, axis=1))
    if not len(changes):
        return FrameRange(0, len(channels))
    return FrameRange(int(changes[0]), int(changes[-1]) + 2)
