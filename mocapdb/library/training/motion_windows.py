"""Windows of equal length over the clips of a library, as a map-style dataset.

Windows that lie together in a clip are decoded together, and kept as long as the cache has room.
The order of a seed goes through the library in pools of such stretches, whose windows it mixes: so
each stretch is decoded about once in an epoch, however small the cache.
"""

from __future__ import annotations

import math
import operator
import os
from collections import OrderedDict
from collections.abc import Collection, Iterator, Sequence
from numbers import Integral
from typing import Any, Literal, Self

import numpy as np

from mocapdb.base.arrays import BoolArray, IntArray, is_number
from mocapdb.errors import ClipError, LibraryError
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.library import Library
from mocapdb.library.training.window_features import FEATURES, FeatureName, Features, features_of
from mocapdb.library.tuning import POOLED_STRETCHES, STRETCH_WINDOWS
from mocapdb.motion.edits import channels_at, frames_of_rate

__all__ = ["MotionWindows"]


class MotionWindows:
    """Windows of equal length over clips of a library.

    `Library.windows` makes one. It has a length and gives a window for each number below it, so
    torch's ``DataLoader`` takes it as it is, also with workers: each opens the library by itself.

    Parameters
    ----------
    library : Library
        It may be closed afterwards.
    records : sequence of ClipRecord
        The clips.
    length, stride : int, frames
        Of a window, and from the start of one to that of the next, at the rate `fps`.
    fps : float, frames per second
        Frames between those of a clip are made as by `Clip.resample`.
    features : {"positions", "quaternions", "6d", "canonical"}
        What a window holds (see `window_features`).
    seed : int, optional
        Mixes the windows; `set_epoch` mixes them anew. Without one they are in the clips' order.
    cache_mb : float, megabytes
        How much may be kept decoded.
    short : {"error", "skip"}
        What to do with a clip that is shorter than a window.

    Attributes
    ----------
    clips, subjects : tuple of str
        Of each clip its name, and who performs it; empty where that is not known.
    classes : tuple of str
        The classes of the clips, by name: a window's ``label`` is a place in it, -1 without one.

    Raises
    ------
    ClipError
        If a number is not positive, a window is longer than a clip, the features are unknown, or
        the clips have different joints where the features need the same.
    LibraryError
        If there is no clip.
    """

    def __init__(
        self,
        library: Library,
        records: Sequence[ClipRecord],
        *,
        length: int = 64,
        stride: int = 16,
        fps: float = 30.0,
        features: FeatureName = "positions",
        seed: int | None = None,
        cache_mb: float = 256.0,
        short: Literal["error", "skip"] = "error",
    ) -> None:
        for value, what in ((length, "length"), (stride, "stride"), (fps, "rate")):
            if not (is_number(value) and math.isfinite(value) and value > 0):
                raise ClipError(f"Expected a positive {what} of windows, but got {value!r}.")
        for value, what in ((length, "length"), (stride, "stride")):
            if value != int(value):
                raise ClipError(f"Expected whole frames as {what} of windows, but got {value}.")
        if not (is_number(cache_mb) and cache_mb >= 0):
            raise ClipError(f"Expected a cache of 0 MB or more, but got {cache_mb!r}.")
        if seed is not None and not (isinstance(seed, Integral) and seed >= 0):
            raise ClipError(f"Expected a whole number of 0 or more as seed, but got {seed!r}.")
        if features not in FEATURES:
            raise ClipError(
                f"Expected features out of {', '.join(FEATURES)}, but got {features!r}."
            )
        if short not in ("error", "skip"):
            raise ClipError(f"Expected short 'error' or 'skip', but got {short!r}.")
        self.length, self.stride, self.fps = int(length), int(stride), float(fps)
        self.features: FeatureName = features
        self.seed, self.epoch, self.cache_mb = seed, 0, cache_mb
        self._path, self._original = library.path, library.original
        self._records = self._long_enough(records, short)
        if features != "canonical":
            _expect_one_skeleton(library, self._records, features)
        subjects = library.catalogue.subjects()
        self.clips = tuple(record.name for record in self._records)
        self.subjects = tuple(subjects.get(record.id) or "" for record in self._records)
        labels = [record.label for record in self._records]
        self.classes = tuple(sorted({label for label in labels if label}))
        self._labels = [-1 if not label else self.classes.index(label) for label in labels]
        self._library: Library | None = None
        self._cache: OrderedDict[int, Features] = OrderedDict()
        self._counts = np.array([self._n_windows(record) for record in self._records])
        self._lay_out(np.ones(len(self._records), dtype=np.bool_))
        self._forget()

    # -- what there is -----------------------------------------------------------------------------

    def __len__(self) -> int:
        return int(self._starts[-1])

    def __getitem__(self, number: int) -> dict[str, Any]:
        """Return a window: its motion, and where it is from.

        Returns
        -------
        dict
            ``motion`` (length, J, n) float32; ``root`` (length, m) float32, but for positions;
            ``label``, ``clip`` (places in `classes` and `clips`) and ``start`` (its first frame in
            the clip, at `fps`) as numbers.

        Raises
        ------
        ClipError
            If it is no number of one window.
        IndexError
            If there is no such window.
        """
        try:
            number = operator.index(number)
        except TypeError:
            raise ClipError(
                f"Expected the number of one window, but got {number!r}. For several: "
                "windows.batch(range(8))."
            ) from None
        if not -len(self) <= number < len(self):
            raise IndexError(f"Expected a window below {len(self)}, but got {number}.")
        window = int(self._order[number])
        stretch = int(np.searchsorted(self._starts, window, side="right")) - 1
        clip, first = self._stretches[stretch]
        found = self._decoded(stretch)
        at = (window - int(self._starts[stretch])) * self.stride
        frames = slice(at, at + self.length)
        sample: dict[str, Any] = {"motion": found.motion[frames].copy()}
        if found.root.shape[1]:
            sample["root"] = found.root[frames].copy()
        return sample | {
            "label": self._labels[clip],
            "clip": int(clip),
            "start": int(first) * self.stride + at,
        }

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return (self[number] for number in range(len(self)))

    def batch(self, numbers: Sequence[int]) -> dict[str, np.ndarray]:
        """Return several windows as arrays with one more axis in front, for those without torch.

        Raises
        ------
        ClipError
            If there is no number.
        """
        if not len(numbers):
            raise ClipError("Expected the numbers of one or more windows, but got none.")
        samples = [self[number] for number in numbers]
        return {name: np.stack([sample[name] for sample in samples]) for name in samples[0]}

    def __repr__(self) -> str:
        clips = int(self._taken.sum())
        return (
            f"MotionWindows({len(self)} windows of {self.length} frames at {self.fps:g} Hz, every "
            f"{self.stride}, {self.features}, from {clips} clips of {str(self._path)!r})"
        )

    # -- order and parts ---------------------------------------------------------------------------

    def set_epoch(self, epoch: int) -> None:
        """Mix the windows anew: the same seed and epoch give the same order, on every machine."""
        self.epoch = epoch
        self._mix()

    def of_subjects(self, subjects: Collection[str]) -> MotionWindows:
        """Return the windows of some people's clips.

        Raises
        ------
        LibraryError
            If they have none.
        """
        wanted = np.array([subject in subjects for subject in self.subjects], dtype=np.bool_)
        return self._part(wanted, f"of subjects {', '.join(map(str, subjects)) or 'none'}")

    def split(
        self, share: float = 0.2, *, seed: int = 0, by: Literal["subject", "clip"] = "subject"
    ) -> tuple[MotionWindows, MotionWindows]:
        """Return the windows in two parts, no subject in both: to train on, and to test on.

        Parameters
        ----------
        share : float
            How many of the windows are to test on, about.
        seed : int
            Chooses the subjects.
        by : {"subject", "clip"}
            What is never parted. Where it is not known who performs a clip, clips of the same
            skeleton count as one subject.

        Raises
        ------
        ClipError
            If the share is not between 0 and 1.
        LibraryError
            If there is only one to choose from.
        """
        if not 0 < share < 1:
            raise ClipError(f"Expected a share between 0 and 1, but got {share}.")
        whose = [
            name if by == "clip" else subject or f"body {record.skeleton_id}"
            for name, subject, record in zip(self.clips, self.subjects, self._records, strict=True)
        ]
        mine = [who for who, taken in zip(whose, self._taken, strict=True) if taken]
        groups = sorted(set(mine))
        if len(groups) < 2:
            raise LibraryError(
                f"Expected windows of two or more {by}s to part, but all are of {groups[0]!r}. "
                "Give by='clip', or say who performs a clip in a column subject of the labels."
            )
        np.random.default_rng(seed).shuffle(groups)
        sizes = dict.fromkeys(groups, 0)
        for who, count, taken in zip(whose, self._counts, self._taken, strict=True):
            sizes[who] = sizes.get(who, 0) + int(count) * int(taken)
        chosen: list[str] = []
        for who in groups[:-1]:
            before = abs(sum(sizes[each] for each in chosen) - share * len(self))
            after = abs(sum(sizes[each] for each in (*chosen, who)) - share * len(self))
            if not chosen or after < before:
                chosen.append(who)
        held_out = np.array([who in chosen for who in whose], dtype=np.bool_)
        return self._part(~held_out, "to train on"), self._part(held_out, "to test on")

    def _part(self, wanted: BoolArray, what: str) -> MotionWindows:
        part = object.__new__(type(self))
        part.__dict__.update(self.__getstate__())
        part._forget()
        wanted = wanted & self._taken
        if not wanted.any():
            raise LibraryError(f"{self._path}: no windows {what}.")
        part._lay_out(wanted)
        return part

    def _lay_out(self, taken: BoolArray) -> None:
        """Number the windows of some clips, and the stretches that are decoded together."""
        self._taken = taken
        self._stretches = [
            (clip, first)
            for clip in np.flatnonzero(taken).tolist()
            for first in range(0, int(self._counts[clip]), STRETCH_WINDOWS)
        ]
        sizes = [
            min(STRETCH_WINDOWS, int(self._counts[clip]) - first) for clip, first in self._stretches
        ]
        self._starts: IntArray = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
        self._mix()

    def _mix(self) -> None:
        """Put the windows into the order of seed and epoch."""
        self._order: IntArray = np.arange(len(self))
        if self.seed is None:
            return
        rng = np.random.default_rng([self.seed, self.epoch])
        stretches = rng.permutation(len(self._stretches))
        pools = []
        for first in range(0, len(stretches), POOLED_STRETCHES):
            pool = [
                np.arange(self._starts[each], self._starts[each + 1])
                for each in stretches[first : first + POOLED_STRETCHES]
            ]
            pools.append(rng.permutation(np.concatenate(pool)))
        self._order = np.concatenate(pools)

    # -- decoding ----------------------------------------------------------------------------------

    def _decoded(self, stretch: int) -> Features:
        """Return the frames of a stretch, from the cache where they are in it."""
        if self._process != os.getpid():  # a fork: open files are the other process's
            self._forget()
        if stretch in self._cache:
            self._cache.move_to_end(stretch)
            return self._cache[stretch]
        found = self._decode(*self._stretches[stretch])
        self._cache[stretch] = found
        self._kept += _size(found)
        while self._kept > self.cache_mb * 1e6 and len(self._cache) > 1:
            self._kept -= _size(self._cache.popitem(last=False)[1])
        return found

    def _decode(self, clip: int, first: int) -> Features:
        if self._library is None:
            self._library = Library(self._path, original=self._original)
        record = self._records[clip]
        skeleton = self._library.skeleton(record)
        count = min(STRETCH_WINDOWS, int(self._counts[clip]) - first)
        start = first * self.stride
        step = record.fps / self.fps
        times = step * np.arange(start, start + (count - 1) * self.stride + self.length)
        low = max(math.floor(times[0] + 1e-6), 0)
        high = min(math.ceil(times[-1] - 1e-6) + 1, record.frames)
        channels = self._library.channels(record, slice(low, high))
        return features_of(
            skeleton, channels_at(skeleton, channels, times - low), self.fps, self.features
        )

    def _forget(self) -> None:
        self._process = os.getpid()
        self._library = None
        self._cache = OrderedDict()
        self._kept = 0

    def close(self) -> None:
        """Close the library and give back what is kept; the next window opens it again."""
        if self._library is not None and self._process == os.getpid():
            self._library.close()
        self._forget()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __getstate__(self) -> dict[str, Any]:
        """Return what another process needs: neither open files nor what is kept."""
        own: dict[str, Any] = {"_library": None, "_cache": OrderedDict(), "_kept": 0}
        return self.__dict__ | own

    # -- clips -------------------------------------------------------------------------------------

    def _n_windows(self, record: ClipRecord) -> int:
        frames = len(frames_of_rate(record.frames, record.fps / self.fps))
        return max((frames - self.length) // self.stride + 1, 0)

    def _long_enough(self, records: Sequence[ClipRecord], short: str) -> list[ClipRecord]:
        """Return the clips that have a window; the others are an error, or left out."""
        kept = [record for record in records if self._n_windows(record)]
        if not records:
            raise LibraryError(f"{self._path}: no clip to take windows from.")
        if (short == "error" and len(kept) < len(records)) or not kept:
            shortest = min(records, key=lambda record: record.duration_s)
            or_skip = ", or leave them out with short='skip'" if kept else ""
            raise ClipError(
                f"Expected clips of {self.length} frames at {self.fps:g} Hz or more "
                f"({self.length / self.fps:.2f} s), but {len(records) - len(kept)} of "
                f"{len(records)} are shorter: {shortest.name} has {shortest.duration_s:.2f} s. "
                f"Take a shorter window{or_skip}."
            )
        return kept


def _expect_one_skeleton(library: Library, records: Sequence[ClipRecord], features: str) -> None:
    """Refuse clips of different joints, whose windows would not go into one array."""
    first = library.skeleton(records[0])
    for record in records:
        other = library.skeleton(record)
        if other.names != first.names or other.convention != first.convention:
            raise ClipError(
                f"Expected clips of the same joints for {features}, but {records[0].name} has "
                f"{first.n_joints} ({first.convention}) and {record.name} has {other.n_joints} "
                f"({other.convention}). Choose clips of one skeleton, or features='canonical'."
            )


def _size(found: Features) -> int:
    return found.motion.nbytes + found.root.nbytes
