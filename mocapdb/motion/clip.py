"""The clip: a skeleton and its channels over time."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import ClipError
from mocapdb.motion.skeleton import Skeleton

if TYPE_CHECKING:
    from mocapdb.motion.representations import Representation, RepresentationName

__all__ = ["CODED", "Clip"]

CODED = "coded by"  # how the provenance of a decoded clip names its codec


@dataclass(frozen=True, eq=False, repr=False)
class Clip:
    """A stretch of motion: the channels of a skeleton, frame by frame.

    Parameters
    ----------
    skeleton : Skeleton
        The skeleton that the channels move.
    channels : (F, C) array-like
        Exactly as read: angles in degrees, translations in skeleton units. Kept read-only.
    fps : float, frames per second
        Frame rate.
    name : str
        Name of the clip; a file's stem where it came from a file.
    label : str, optional
        Class of the motion, such as ``"walk"``.
    source : str
        Path of the file that it came from.
    fps_source : str
        Who stated the frame rate: ``"file"``, ``"labels"``, ``"manifest"``, ``"settings"`` (a
        ``mocapdb.toml``), ``"caller"``; ``"default"`` where nobody did.
    unit_source, up_source : str
        Who stated the unit of length and the vertical axis: ``"file"``, ``"settings"``,
        ``"caller"``; ``"inferred"`` where the motion tells, ``"default"`` where nothing does.
    frame_time_text : str
        The frame time as a BVH file spells it, so that it is written back as it was.
    provenance : tuple of str
        The processing steps so far, oldest first.

    Raises
    ------
    ClipError
        If the channels do not fit the skeleton or are not finite, or the rate is not positive.

    Examples
    --------
    >>> from mocapdb.corpus import synthetic
    >>> clip = synthetic.make_clip("walk", seed=1)
    >>> second = clip[:120]
    >>> len(second), second.duration_s
    (120, 1.0)
    """

    skeleton: Skeleton
    channels: FloatArray
    fps: float
    name: str
    label: str | None
    source: str
    fps_source: str
    unit_source: str
    up_source: str
    frame_time_text: str
    provenance: tuple[str, ...]

    def __init__(
        self,
        skeleton: Skeleton,
        channels: ArrayLike,
        fps: float,
        *,
        name: str = "",
        label: str | None = None,
        source: str = "",
        fps_source: str = "caller",
        unit_source: str = "caller",
        up_source: str = "caller",
        frame_time_text: str = "",
        provenance: tuple[str, ...] = (),
    ) -> None:
        array = np.asarray(channels, dtype=np.float64)
        if array.ndim != 2 or array.shape[1] != skeleton.n_channels:
            raise ClipError(
                f"Expected channels of shape (frames, {skeleton.n_channels}) for skeleton "
                f"{skeleton.name!r}, but got {array.shape}."
            )
        if len(array) == 0:
            raise ClipError(f"Expected clip {name!r} to have at least one frame, but got none.")
        if not (math.isfinite(fps) and fps > 0):
            raise ClipError(f"Expected a positive frame rate, but got {fps}.")
        if not np.isfinite(array).all():
            frame, channel = np.argwhere(~np.isfinite(array))[0]
            raise ClipError(
                f"Expected finite channels, but frame {frame} of {name or 'the clip'!r} has "
                f"{array[frame, channel]} in {skeleton.channel_names[channel]}."
            )
        if array.flags.writeable:
            array = array.copy()
            array.flags.writeable = False
        assign = object.__setattr__  # the dataclass is frozen
        assign(self, "skeleton", skeleton)
        assign(self, "channels", array)
        assign(self, "fps", float(fps))
        assign(self, "name", name)
        assign(self, "label", label)
        assign(self, "source", source)
        assign(self, "fps_source", fps_source)
        assign(self, "unit_source", unit_source)
        assign(self, "up_source", up_source)
        assign(self, "frame_time_text", frame_time_text)
        assign(self, "provenance", tuple(provenance))

    def __len__(self) -> int:
        return len(self.channels)

    @property
    def n_frames(self) -> int:
        """Number of frames F."""
        return len(self.channels)

    @property
    def duration_s(self) -> float:
        """Frames over frame rate, in seconds."""
        return len(self.channels) / self.fps

    def __getitem__(self, frames: slice) -> Clip:
        """Return the frames ``a:b`` as a clip of their own.

        Raises
        ------
        ClipError
            If the range is empty, or the step is not 1 (use `replace` with channels and a rate).
        """
        if not isinstance(frames, slice):
            raise ClipError(f"Expected a range of frames such as clip[10:20], but got {frames!r}.")
        start, stop, step = frames.indices(len(self))
        if step != 1 or start >= stop:
            raise ClipError(
                f"Expected a range within the {len(self)} frames of {self.name!r}, "
                f"but got {frames.start}:{frames.stop}:{frames.step}."
            )
        if stop - start == len(self):
            return self
        return self.replace(channels=self.channels[start:stop], step=f"frames {start}:{stop}")

    def replace(
        self,
        *,
        channels: ArrayLike | None = None,
        fps: float | None = None,
        name: str | None = None,
        label: str | None = None,
        step: str | None = None,
    ) -> Clip:
        """Return a clip with some parts replaced, and `step` added to its provenance."""
        return Clip(
            self.skeleton,
            self.channels if channels is None else channels,
            self.fps if fps is None else fps,
            name=self.name if name is None else name,
            label=self.label if label is None else label,
            source=self.source,
            fps_source=self.fps_source if fps is None else "caller",
            unit_source=self.unit_source,
            up_source=self.up_source,
            frame_time_text=self.frame_time_text if fps is None else "",
            provenance=self.provenance if step is None else (*self.provenance, step),
        )

    @property
    def was_coded(self) -> bool:
        """Whether the numbers come from a payload, so that a codec drew some of the curve."""
        return any(step.startswith(CODED) for step in self.provenance)

    def represent(self, name: RepresentationName) -> Representation:
        """Return the frames in one of O'Kane's representations, with names, units and root track.

        Parameters
        ----------
        name : {"channels", "positions", "aligned", "scaled", "normalised"}
            See `mocapdb.motion.representations`.

        Raises
        ------
        SkeletonError
            If there is no representation of that name.

        Examples
        --------
        >>> from mocapdb.corpus import synthetic
        >>> walk = synthetic.make_clip("walk", seed=1)
        >>> aligned = walk.represent("aligned")
        >>> aligned.values.shape == (len(walk), 183)
        True
        >>> bool(abs(aligned.restore() - walk.channels).max() < 1e-6)
        True
        """
        from mocapdb.motion.representations import represent

        found = represent(self, name)
        if name == "channels":  # which are the clip's own
            found = replace(found, values=found.values.copy())
        return found

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Clip):
            return NotImplemented
        return (
            self.skeleton == other.skeleton
            and self.fps == other.fps
            and self.name == other.name
            and self.label == other.label
            and np.array_equal(self.channels, other.channels)
        )

    def __hash__(self) -> int:
        return hash((self.skeleton, self.fps, self.name, self.label, self.channels.shape))

    def __repr__(self) -> str:
        label = f", {self.label}" if self.label else ""
        return (
            f"Clip({self.name!r}{label}: {len(self)} frames x {self.skeleton.n_channels} channels, "
            f"{self.duration_s:.2f} s at {self.fps:g} Hz, skeleton {self.skeleton.name!r})"
        )
