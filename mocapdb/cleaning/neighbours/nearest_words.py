"""Nearest words: K confirmed local minima of the warping distance (Aristidou 2018, section 3.3).

The search is exact, or among candidates. Exactly: a lower bound of the distance to every target
costs little; blocks of neighbouring targets are evaluated in its order, until the bound of what is
left exceeds the K-th smallest minimum found. A target that was left out is then larger than any
neighbour kept, so the minima are those of the whole distance function. Among candidates: only the
blocks whose sketches are nearest are evaluated, for long clips and contexts of many hours (the
paper leaves that open: "a simpler distance measure can first be used to collect a candidates set").
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mocapdb.base.arrays import BoolArray, Float32Array, FloatArray, IntArray
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.neighbours import _word_warping as warping
from mocapdb.cleaning.neighbours._neighbour_kernels import search_all, search_candidates
from mocapdb.cleaning.neighbours.sketches import promising_blocks
from mocapdb.cleaning.tuning import (
    COPY_DEG,
    COPY_SHARE,
    DROPPED_JOINTS,
    N_NEIGHBOURS,
    SOURCE_FRAMES,
    STRIDE,
    TARGET_FRAMES,
)
from mocapdb.errors import ClipError, SkeletonError
from mocapdb.motion.quaternions import slerp

__all__ = ["Neighbours", "Vocabulary", "find_neighbours", "gathered"]

NOT_IN_CONTEXT = -(10**9)  # first frame of a source that the context does not hold
PADDING = warping.LANES + TARGET_FRAMES

WORDS_AT_ONCE = 256  # no result depends on it


@dataclass(frozen=True, eq=False)
class Vocabulary:
    """The textures of many clips, put after each other for a search.

    Attributes
    ----------
    names : tuple of str
        Of the joints.
    fps : float, frames per second
    quats : (K, 4, T + padding) of float32
        Rotations, time last; the last frame is repeated, so that kernels may look beyond it.
    ends : (n,)
        The frame after each clip's last.
    clips : tuple of str
        Names of the clips.
    hidden : frozenset of int
        Clips that a search passes over.
    rows : (R,), optional
        The joints that the clips show, where they are of another body; all by default.
    """

    names: tuple[str, ...]
    fps: float
    quats: Float32Array
    ends: IntArray
    clips: tuple[str, ...]
    hidden: frozenset[int] = frozenset()
    rows: IntArray | None = None

    @classmethod
    def of(cls, textures: Iterable[Texture], *, rows: IntArray | None = None) -> Vocabulary:
        """Put textures of the same joints and rate, which show all or some, after each other.

        Raises
        ------
        ClipError
            If there is no texture, or rates differ.
        SkeletonError
            If joints differ.
        """
        parts: list[Float32Array] = []
        clips: list[str] = []
        first: Texture | None = None
        for texture in textures:
            first = first or texture
            _expect_alike(first, texture)
            parts.append(np.moveaxis(texture.quat_xyzw, 0, 2).astype(np.float32))
            clips.append(texture.name)
        if first is None:
            raise ClipError("Expected a context with a clip at least, but it has none.")
        ends = np.cumsum([part.shape[2] for part in parts])
        parts.append(np.repeat(parts[-1][:, :, -1:], PADDING, axis=2))
        quats = np.concatenate(parts, axis=2)
        return cls(first.names, first.fps, quats, ends, tuple(clips), rows=rows)

    @classmethod
    def families(cls, textures: Iterable[Texture]) -> dict[tuple[str, ...], Vocabulary]:
        """Return a vocabulary for each set of joints that textures of one rate have, by its names.

        Raises
        ------
        ClipError
            If rates differ.
        """
        sorted_out: dict[tuple[str, ...], list[Texture]] = {}
        for texture in textures:
            light = replace(texture, quat_xyzw=texture.quat_xyzw.astype(np.float32))
            sorted_out.setdefault(texture.names, []).append(light)
        return {names: cls.of(family) for names, family in sorted_out.items()}

    def without_copies(self, texture: Texture) -> Vocabulary:
        """Return the vocabulary without clips that show the same motion, frame by frame.

        A clip that is coded with a loss counts as a copy; one that differs for more than a moment
        does not. A fault would find itself in a copy.
        """
        starts = self.ends - np.diff(self.ends, prepend=0)
        same_length = np.flatnonzero(np.diff(self.ends, prepend=0) == len(texture))
        hidden = set(self.hidden)
        rows = slice(None) if self.rows is None else self.rows
        for clip in same_length.tolist():
            other = np.moveaxis(self.quats[:, :, starts[clip] : self.ends[clip]], 2, 0)
            cosine = np.abs(np.sum(other * texture.quat_xyzw, axis=-1))[:, rows].min(axis=1)
            apart = 2.0 * np.rad2deg(np.arccos(np.clip(cosine, 0.0, 1.0))) > COPY_DEG
            if apart.mean() <= COPY_SHARE:
                hidden.add(clip)
        return replace(self, hidden=frozenset(hidden))

    def __len__(self) -> int:
        return int(self.ends[-1])

    @property
    def shown(self) -> list[str]:
        """Names of the clips that are not hidden."""
        return [name for clip, name in enumerate(self.clips) if clip not in self.hidden]

    @cached_property
    def shown_frames(self) -> BoolArray:
        """(T + padding,) whether a frame is of a clip that is not hidden."""
        shown = np.zeros(self.quats.shape[2], dtype=np.bool_)
        for clip, (start, end) in enumerate(zip([0, *self.ends[:-1]], self.ends, strict=True)):
            shown[start:end] = clip not in self.hidden
        return shown

    @cached_property
    def valid(self) -> BoolArray:
        """(T + padding,) whether a target starts at a frame and ends in the same clip."""
        valid = np.zeros(self.quats.shape[2], dtype=np.bool_)
        for clip, (start, end) in enumerate(zip([0, *self.ends[:-1]], self.ends, strict=True)):
            if clip not in self.hidden:
                valid[start : max(start, end - TARGET_FRAMES + 1)] = True
        return valid


@dataclass(frozen=True, eq=False)
class Neighbours:
    """The nearest words of every word of a texture.

    Attributes
    ----------
    starts : (W,)
        First frame of each source word, of `SOURCE_FRAMES` frames.
    targets : (W, K)
        First frame of each neighbour in the context, clip after clip, nearest first; -1 where the
        context has fewer minima.
    distances : (W, K) square radians
        Mean of eq. 1 over the matched frames; infinite where there is no neighbour.
    frames : (W, K, SOURCE_FRAMES)
        Context frame, whole or fractional, that each source frame is matched with.
    words : (W, K, SOURCE_FRAMES, K', 4) of float32
        What the neighbours show of all joints in those frames; NaN where there is none.
    """

    starts: IntArray
    targets: IntArray
    distances: FloatArray
    frames: FloatArray
    words: Float32Array

    def merged(self, other: Neighbours, n_frames: int) -> Neighbours:
        """Return the nearest of the neighbours in two contexts.

        Parameters
        ----------
        other : Neighbours
            Of the same words.
        n_frames : int
            Frames of this context, after which the other's are numbered.
        """
        shift = np.where(other.targets >= 0, n_frames, 0)
        distances = np.concatenate([self.distances, other.distances], axis=1)
        nearest = np.argsort(distances, axis=1, kind="stable")[:, : self.targets.shape[1]]

        def chosen(a: np.ndarray, b: np.ndarray) -> np.ndarray:
            both = np.concatenate([a, b], axis=1)
            at = nearest.reshape(nearest.shape + (1,) * (both.ndim - 2))
            return np.take_along_axis(both, at, axis=1)

        return Neighbours(
            self.starts,
            chosen(self.targets, other.targets + shift),
            chosen(self.distances, other.distances),
            chosen(self.frames, other.frames + shift[..., None]),
            chosen(self.words, other.words),
        )


def find_neighbours(
    source: Texture,
    context: Sequence[Texture] | Vocabulary,
    *,
    rows: Sequence[int] | IntArray | None = None,
    n_drop: int = DROPPED_JOINTS,
    k: int = N_NEIGHBOURS,
    stride: int = STRIDE,
    starts: IntArray | None = None,
    n_candidates: int | None = None,
) -> Neighbours:
    """Find the K nearest words of every word, in a context that may hold the source itself.

    Parameters
    ----------
    source : Texture
    context : sequence of Texture, or Vocabulary
        Of the same joints and rate. Where a texture *is* the source, words whose middles are less
        than half a word apart are no neighbours.
    rows : sequence of int, optional
        Rows of the texture that count; by default all that the context shows.
    n_drop : int
        How many of the largest joint distances are left out of each frame's, 0 to 3.
    k : int
        Neighbours wanted; where the context has fewer, the rest are marked as missing.
    stride : int
        Frames between the starts of source words; the last word ends with the texture.
    starts : (W,) array of int, optional
        First frames of the source words, instead of a stride.
    n_candidates : int, optional
        Evaluate only so many blocks of 16 targets for each word, those whose sketch is nearest
        (see `sketches`).
        By default the search is exact.

    Raises
    ------
    ClipError
        If the source is shorter than a word, no context clip is as long as a target, rates
        differ, or a number makes no sense.
    SkeletonError
        If the joints differ.
    """
    _check(source, k, n_drop, stride, n_candidates)
    own = NOT_IN_CONTEXT
    if isinstance(context, Vocabulary):
        vocabulary = context
    else:
        for texture in context:
            _expect_alike(source, texture)
        vocabulary = Vocabulary.of(context)
        firsts = [0, *vocabulary.ends[:-1].tolist()]
        own = next((n for n, t in zip(firsts, context, strict=True) if t is source), NOT_IN_CONTEXT)
    _expect_alike(source, vocabulary)
    if not vocabulary.valid.any():
        raise ClipError(
            f"Expected a context with a clip of {TARGET_FRAMES} frames at {source.fps:g} Hz, "
            "but it has none."
        )
    rows = vocabulary.rows if rows is None else rows
    chosen = np.arange(len(source.joints)) if rows is None else np.asarray(rows, dtype=np.int64)
    if starts is None:
        starts = np.arange(0, len(source) - SOURCE_FRAMES + 1, stride)
        if starts[-1] + SOURCE_FRAMES < len(source):
            starts = np.append(starts, len(source) - SOURCE_FRAMES)
    shape = (len(starts), k)
    targets = np.full(shape, -1, dtype=np.int64)
    distances = np.full(shape, np.inf)
    frames = np.full((*shape, SOURCE_FRAMES), np.nan)
    problem = (
        vocabulary.quats,
        source.quat_xyzw.astype(np.float32),
        chosen,
        min(n_drop, len(chosen) - 1),
        starts,
        vocabulary.valid,
        own,
    )
    if n_candidates is None:
        search_all(*problem, targets, distances, frames)
    else:
        quats, seen = problem[:2]
        chosen_blocks = promising_blocks(
            quats[chosen], seen[:, chosen], starts, vocabulary.valid[: quats.shape[2] - PADDING],
            None if own == NOT_IN_CONTEXT else own + starts - (TARGET_FRAMES - SOURCE_FRAMES) // 2,
            warping.LANES, n_candidates,
        )  # fmt: skip
        search_candidates(*problem, chosen_blocks, targets, distances, frames)
    return gathered(vocabulary, starts, targets, distances, frames)


def gathered(
    vocabulary: Vocabulary,
    starts: IntArray,
    targets: IntArray,
    distances: FloatArray,
    frames: FloatArray,
) -> Neighbours:
    """Return what a search has found, with the words that were found."""
    ends = vocabulary.ends
    last = ends[np.minimum(np.searchsorted(ends, targets, side="right"), len(ends) - 1)] - 1
    frames = np.minimum(frames, last[..., None])  # what goes on after the path stays in the clip
    return Neighbours(starts, targets, distances, frames, _words(vocabulary.quats, frames))


def _words(quats: Float32Array, frames: FloatArray) -> Float32Array:
    """Return (..., K, 4) the rotations at whole or fractional frames.

    Some words at a time: in double precision all of a long clip's take half a gigabyte.
    """
    by_frame = np.moveaxis(quats, 2, 0)
    words = np.full((*frames.shape, *by_frame.shape[1:]), np.nan, dtype=np.float32)
    for first in range(0, len(frames), WORDS_AT_ONCE):
        some = frames[first : first + WORDS_AT_ONCE]
        known = np.isfinite(some)
        low = some[known].astype(np.int64)
        high = low + 1  # within the padding
        shown = slerp(by_frame[low], by_frame[high], (some[known] - low)[:, None])
        words[first : first + WORDS_AT_ONCE][known] = shown
    return words


def _expect_alike(first: Texture, other: Texture | Vocabulary) -> None:
    """Raise an error if a context has other joints than a texture, or another rate."""
    name = other.name if isinstance(other, Texture) else other.clips[0]
    if other.names != first.names:
        raise SkeletonError(
            f"Expected a context with the joints of {first.name!r}, but {name!r} has others. "
            "Leave it out, or convert it."
        )
    if abs(other.fps - first.fps) > 1e-6:
        raise ClipError(
            f"Expected a context at {first.fps:g} Hz, but {name!r} has {other.fps:g} Hz. "
            "Make its texture at that rate."
        )


def _check(source: Texture, k: int, n_drop: int, stride: int, n_candidates: int | None) -> None:
    if k < 1 or stride < 1 or not 0 <= n_drop <= warping.MOST_DROPPED:
        raise ClipError(
            f"Expected k and stride of at least 1 and n_drop from 0 to {warping.MOST_DROPPED}, "
            f"but got k {k}, stride {stride}, n_drop {n_drop}."
        )
    if n_candidates is not None and n_candidates < 1:
        raise ClipError(f"Expected a candidate at least, but got n_candidates {n_candidates}.")
    if len(source) < SOURCE_FRAMES:
        raise ClipError(
            f"Expected {source.name!r} to have a word of {SOURCE_FRAMES} frames at "
            f"{source.fps:g} Hz, but it has {len(source)}."
        )
