"""One span of one joint, and the ways to fill it; `repair` says which there are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, TypeAlias

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.cleaning.evidence.exchanges import MIRRORS
from mocapdb.cleaning.evidence.fault_shapes import turn_between
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.map.digression_map import MovementDigressionMap, Span
from mocapdb.cleaning.tuning import (
    BEND_S,
    BLEND_S,
    CALM_LEFT_OVER,
    CALM_S,
    LARGEST_ERROR_DEG,
    LARGEST_JUMP_LEFT,
    N_NEIGHBOURS,
    N_TRIALS,
    PACE_FRAMES,
    PACE_QUANTILE,
    PLACES_PER_TRIAL,
    TRIAL_REACH_S,
    UNTRIED_ERROR_DEG_S,
)
from mocapdb.motion.quaternions import (
    angles_deg,
    conjugate,
    continuous,
    from_rotation_vectors_deg,
    multiply,
    rotation_vectors_deg,
    slerp,
)

__all__ = ["Gap", "Method", "smoothed", "usual_step"]

Method: TypeAlias = Literal[
    "undone", "bridged", "neighbours", "neighbours, moved", "neighbour at contact", "smoothed",
    "swapped back", "left",
]  # fmt: skip


class Gap:
    """A span of one joint, and the ways to fill it.

    Parameters
    ----------
    texture : Texture
        Of the clip, at its own rate.
    row : int
    span : Span
    wrong : (F,) of bool
        Where the joint is flagged.
    usual_step_deg : float, degrees
        What most of the joint's steps stay below (see `usual_step`).
    digression : MovementDigressionMap
    across : int, optional
        Row of the opposite joint.
    """

    def __init__(
        self,
        texture: Texture,
        row: int,
        span: Span,
        wrong: BoolArray,
        usual_step_deg: float,
        digression: MovementDigressionMap,
        across: int | None = None,
    ) -> None:
        self.quats = texture.quat_xyzw[:, row]
        self.fps, self.row, self.span, self.digression = texture.fps, row, span, digression
        self.wrong, self.usual_step_deg = wrong, usual_step_deg
        self.opposite = None if across is None else texture.quat_xyzw[:, across]
        self.n_turns = len(texture.skeleton.rotation_orders[span.joint])

    def repaired(
        self, from_contact: Callable[[FloatArray], float] | None = None
    ) -> tuple[FloatArray, Method, float]:
        """Return new rotations of the span, how they were found, and the error to expect.

        Parameters
        ----------
        from_contact : callable, optional
            Takes rotations of the span and returns how far they leave a joint from its contact.
        """
        start, end = self.span.start, self.span.end
        if self.wrong.all():
            return self.quats[start:end], "left", float("nan")
        if self.span.kind == "exchange":
            swapped = self._swapped_back()
            if swapped is not None:
                return swapped, "swapped back", float("nan")
        undone = self._undone()
        if undone is not None:
            return undone, "undone", float("nan")
        best: tuple[float, Method] = (np.inf, "left")
        fills: dict[Method, Callable[[int, int], FloatArray]] = {"bridged": self._bridge}
        if self._similar(start, end) is not None:
            fills["neighbours"] = lambda a, b: self._or_bridge(a, b, self._similar(a, b))
            fills["neighbours, moved"] = lambda a, b: self._or_bridge(a, b, self._moved(a, b))
        for method, fill in fills.items():
            best = min(best, (self._trial_error(fill), method))
        expected, method = best
        if expected > LARGEST_ERROR_DEG:
            return self.quats[start:end], "left", expected
        values = self._blended(fills[method](start, end))
        moved = float(angles_deg(self.quats[start:end], values).mean())
        if self.span.kind == "noise":
            calm = self._smoothed()
            left_over = CALM_LEFT_OVER * float(angles_deg(self.quats[start:end], calm).mean())
            if left_over < expected:
                return calm, "smoothed", left_over
        if moved < expected and self.span.kind != "filled":
            # the fill is no surer than what is there
            return self.quats[start:end], "left", expected
        if from_contact is None or method in ("bridged", "left"):
            return values, method, expected
        least = from_contact(values)
        for k in range(N_NEIGHBOURS):
            shown = self._moved(start, end, k)
            if shown is None:
                break
            own = self._blended(shown)
            apart = from_contact(own)
            if apart < least:
                least, values, method = apart, own, "neighbour at contact"
        return values, method, expected

    def _undone(self) -> FloatArray | None:
        """Return the span with its turn taken back, if that leaves no jump at the edges."""
        start, end, kind = self.span.start, self.span.end, self.span.kind
        if kind not in ("offset", "flip", "drift") or end >= len(self.quats) or start < 1:
            return None
        length = len(self.span)
        ramp = np.arange(1, length + 1) / length
        right_last = self._pace_onwards(end, -1)
        right_first = self._pace_onwards(start - 1, 1)
        wrong = self.quats[start:end]
        best: tuple[float, FloatArray | None] = (np.inf, None)
        for left in (False, True):
            turn_last = turn_between(right_last, wrong[-1], left)
            if kind == "drift":
                turns = from_rotation_vectors_deg(ramp[:, None] * rotation_vectors_deg(turn_last))
            else:
                turn_first = turn_between(right_first, wrong[0], left)
                turns = slerp(turn_first[None], turn_last[None], ramp)
            back = conjugate(turns)
            values = multiply(back, wrong) if left else multiply(wrong, back)
            roughness = self._roughness(values)
            if roughness < best[0]:
                best = (roughness, values)
        before = self._roughness(wrong)
        return best[1] if best[0] < LARGEST_JUMP_LEFT * before else None

    def _swapped_back(self) -> FloatArray | None:
        """Return what the opposite joint has in the span, if that leaves no jump at the edges."""
        if self.opposite is None:
            return None
        there = self.opposite[self.span.start : self.span.end]
        options = [there * signs for signs in MIRRORS]
        rough = [self._roughness(values) for values in options]
        best = int(np.argmin(rough))
        before = self._roughness(self.quats[self.span.start : self.span.end])
        return options[best] if rough[best] < LARGEST_JUMP_LEFT * before else None

    def _smoothed(self) -> FloatArray:
        """Return the span without its quick part, mixed in at the edges."""
        from scipy.ndimage import gaussian_filter1d

        start, end = self.span.start, self.span.end
        around = round(4 * CALM_S * self.fps)
        low, high = max(0, start - around), min(len(self.quats), end + around)
        quats = continuous(self.quats[low:high])
        smooth = gaussian_filter1d(quats, CALM_S * self.fps, axis=0, mode="nearest")
        smooth /= np.linalg.norm(smooth, axis=-1, keepdims=True)
        return np.asarray(smooth[start - low : end - low])

    def _roughness(self, values: FloatArray) -> float:
        """Return the largest jump of the joint in the span and at its edges, in degrees."""
        start, end = self.span.start, self.span.end
        low, high = max(0, start - 3), min(len(self.quats), end + 3)
        quats = np.concatenate([self.quats[low:start], values, self.quats[end:high]])
        steps = rotation_vectors_deg(multiply(conjugate(quats[:-1]), quats[1:]))
        return float(np.linalg.norm(np.diff(steps, axis=0), axis=1).max())

    def _pace_onwards(self, frame: int, direction: int) -> FloatArray:
        """Return the rotation one frame on from a right frame, at the pace it has there."""
        before = frame - direction
        here: FloatArray = self.quats[frame]
        if not 0 <= before < len(self.quats) or self.wrong[before]:
            return here
        return multiply(here, multiply(conjugate(self.quats[before]), here))

    def _bridge(self, start: int, end: int) -> FloatArray:
        """Return a curve from the frame before to the frame after, at their paces.

        Spherical, plus cubic Hermite terms for the paces, which fade on gaps over `BEND_S`.
        """
        first, last = start - 1, end
        if first < 0 or last >= len(self.quats):
            at = last if first < 0 else first
            return np.repeat(self.quats[at : at + 1], end - start, axis=0)
        length = last - first
        s = (np.arange(1, length) / length)[:, None]
        line = slerp(self.quats[first][None], self.quats[last][None], s[:, 0])
        mean = rotation_vectors_deg(multiply(conjugate(self.quats[first]), self.quats[last]))
        trust = min(1.0, BEND_S * self.fps / length)
        pace_in = self._pace(first - PACE_FRAMES, first) * length - mean
        pace_out = self._pace(last, last + PACE_FRAMES) * length - mean
        bend = trust * (s * (1 - s) ** 2 * pace_in - s**2 * (1 - s) * pace_out)
        return multiply(line, from_rotation_vectors_deg(bend))

    def _pace(self, first: int, last: int) -> FloatArray:
        """Return the mean step between two frames; zero where there is none.

        No longer than the joint's steps usually are: a wrong frame that was not flagged must not
        throw the joint about.
        """
        first, last = max(0, first), min(len(self.quats) - 1, last)
        if last <= first or self.wrong[first : last + 1].any():
            return np.zeros(3)
        turn = multiply(conjugate(self.quats[first]), self.quats[last])
        pace: FloatArray = rotation_vectors_deg(turn) / (last - first)
        return pace * min(1.0, self.usual_step_deg / max(float(np.linalg.norm(pace)), 1e-9))

    def _similar(self, start: int, end: int, k: int | None = None) -> FloatArray | None:
        """Return what similar motion shows in the clip's frames; None where there is none.

        That is the median of the neighbours, or the k-th of them alone, of the word whose middle
        is nearest.
        """
        consensus, rate = self.digression.consensus, self.digression.texture.fps / self.fps
        if consensus is None or self.span.joint == 0:  # the root's heading is not in the texture
            return None
        at = np.arange(start, end) * rate
        low = np.minimum(at.astype(np.int64), len(consensus.known) - 1)
        high = np.minimum(low + 1, len(consensus.known) - 1)
        if k is None:
            known = consensus.known[low] & consensus.known[high]
            first, second = (consensus.median_quats[f, self.row] for f in (low, high))
        else:
            starts, words = consensus.neighbours.starts, consensus.neighbours.words
            middles = starts + words.shape[2] // 2
            word = np.abs(at[:, None] - middles).argmin(axis=1)
            first, second = (
                words[word, k, np.clip(f - starts[word], 0, words.shape[2] - 1), self.row]
                for f in (low, high)
            )
            known = np.isfinite(first)
        return slerp(first, second, np.minimum(at - low, 1.0)) if known.all() else None

    def _or_bridge(self, start: int, end: int, shown: FloatArray | None) -> FloatArray:
        return self._bridge(start, end) if shown is None else shown

    def _moved(self, start: int, end: int, k: int | None = None) -> FloatArray | None:
        """Return what similar motion shows, moved to meet the frames beside the gap."""
        low, high = max(0, start - 1), min(len(self.quats), end + 1)
        shown = self._similar(low, high, k)
        if shown is None:
            return None
        inside = shown[start - low : len(shown) - (high - end)]
        ends = [0.0, 0.0]
        offsets = np.zeros((2, 3))
        for i, (frame, place) in enumerate(((start - 1, 0), (end, -1))):
            if 0 <= frame < len(self.quats):
                ends[i] = 1.0
                turn = multiply(conjugate(shown[place]), self.quats[frame])
                offsets[i] = rotation_vectors_deg(turn)
        if ends == [1.0, 0.0]:
            offsets[1] = offsets[0]
        elif ends == [0.0, 1.0]:
            offsets[0] = offsets[1]
        s = (np.arange(1, end - start + 1) / (end - start + 1))[:, None]
        return multiply(inside, from_rotation_vectors_deg((1 - s) * offsets[0] + s * offsets[1]))

    def _trial_error(self, fill: Callable[[int, int], FloatArray]) -> float:
        """Return the mean error of a fill on other gaps of this length, in degrees."""
        length, n_frames = len(self.span), len(self.quats)
        # gaps near the span tell more than those far away: in a long clip only these are tried
        reach = max(TRIAL_REACH_S * self.fps, 2.0 * PLACES_PER_TRIAL * N_TRIALS)
        low = max(1.0, min(self.span.start - reach, n_frames - length - 1 - 2 * reach))
        high = max(low, min(n_frames - length - 1.0, low + 2 * reach))
        places = np.linspace(low, high, PLACES_PER_TRIAL * N_TRIALS)
        starts = np.unique(places.astype(np.int64))
        starts = starts[np.argsort(np.abs(starts - self.span.start), kind="stable")]
        errors = []
        for start in starts.tolist():
            end = start + length
            beyond = self.wrong[max(0, start - PACE_FRAMES - 1) : end + PACE_FRAMES + 1]
            if start < 1 or end >= n_frames or beyond.any():
                continue
            errors.append(angles_deg(fill(start, end), self.quats[start:end]).mean())
            if len(errors) == N_TRIALS:
                break
        # a clip without another gap of this length leaves only its pace to go by
        return float(np.mean(errors)) if errors else UNTRIED_ERROR_DEG_S * length / self.fps

    def _blended(self, values: FloatArray) -> FloatArray:
        """Return the span with its first and last frames smoothed across the edges.

        A quadratic Savitzky-Golay filter over the span and what is beside it, mixed in near the
        edges; frames outside stay as they are.
        """
        start, end = self.span.start, self.span.end
        half = max(2, round(BLEND_S * self.fps / 2))
        low, high = max(0, start - 2 * half), min(len(self.quats), end + 2 * half)
        quats = np.concatenate([self.quats[low:start], values, self.quats[end:high]])
        if len(quats) < 2 * half + 1:
            return values
        quats = continuous(quats)
        smooth = smoothed(quats, 2 * half + 1)
        frames = np.arange(start, end)
        to_edge = np.full(end - start, np.inf)
        if start > 0:
            to_edge = np.minimum(to_edge, frames - start + 1)
        if end < len(self.quats):
            to_edge = np.minimum(to_edge, end - frames)
        weight = np.clip(1.0 - to_edge / (half + 1), 0.0, 1.0)
        return slerp(quats[start - low : end - low], smooth[start - low : end - low], weight)


def usual_step(quats: FloatArray, wrong: BoolArray) -> float:
    """Return what most steps of a joint (F, 4) outside faults stay below, in degrees."""
    right = ~(wrong[:-1] | wrong[1:])
    steps = angles_deg(quats[:-1][right], quats[1:][right])
    return float(np.quantile(steps, PACE_QUANTILE)) if len(steps) else 0.0


def smoothed(quats: FloatArray, window: int) -> FloatArray:
    """Return continuous rotations (F, ..., 4) through a quadratic Savitzky-Golay filter."""
    from scipy.signal import savgol_filter

    smooth = savgol_filter(quats, window, 2, axis=0)
    return np.asarray(smooth / np.linalg.norm(smooth, axis=-1, keepdims=True))
