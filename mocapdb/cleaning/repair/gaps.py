"""One span of one joint, and the ways to fill it; `repair` says which there are."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Literal, TypeAlias

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.cleaning.evidence.exchanges import MIRRORS
from mocapdb.cleaning.evidence.fault_confidence import line_across
from mocapdb.cleaning.evidence.fault_shapes import turn_between
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.map.digression_map import MovementDigressionMap, Span
from mocapdb.cleaning.tuning import (
    BEND_S,
    BLEND_S,
    CALM_WIDTHS_S,
    FILLED_MUST_BEAT,
    LARGEST_ERROR_DEG,
    LARGEST_JUMP_LEFT,
    LEAST_ANGLE_DEG,
    LEAST_MOVED_DEG,
    LINE_BEND,
    LINE_FRAMES,
    MUST_COME_NEARER,
    N_NEIGHBOURS,
    N_TRIALS,
    NEIGHBOURS_MUST_BEAT,
    ONSET_MISFIT,
    PACE_FRAMES,
    PACE_QUANTILE,
    PLACES_PER_TRIAL,
    TRIAL_REACH_S,
    UNTRIED_ERROR_DEG_S,
)
from mocapdb.motion.frame_range import FrameRange
from mocapdb.motion.quaternions import (
    angles_deg,
    conjugate,
    continuous,
    from_rotation_vectors_deg,
    multiply,
    rotation_vectors_deg,
    slerp,
)

__all__ = ["TAKEN_BACK", "Gap", "Method", "smoothed", "usual_step"]

TAKEN_BACK = frozenset[str](("exchange", "offset", "flip", "drift"))
"""Kinds of fault in which the capture saw the motion, elsewhere or turned."""
NOISE_ROUNDS = 8  # until size and smoothness of noise agree; more diverge where little is seen
LEAST_SEEN = 0.05  # share of noise's variance below which nothing tells its size

Method: TypeAlias = Literal[
    "undone", "line", "bridged", "neighbours", "neighbours, moved", "neighbour at contact",
    "smoothed", "swapped back", "held", "left",
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
        # a span at an end of the clip has one edge, and so has what is tried in its stead
        self._has_edges = span.start > 0, span.end < len(self.quats)
        self._gaps: list[tuple[int, int]] | None = None

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
        seen = self.quats[start:end]
        if self.wrong.all():
            return seen, "left", float("nan")
        expected, method = self._best_fill()
        values = self._blended(self._fills()[method](start, end))
        if self.span.kind == "noise":
            calm, left_over = self._calmed(method)
            if left_over < expected:
                expected, method, values = left_over, "smoothed", calm
        for taken_back, error, name in self._taken_back(values):
            if error < expected:
                expected, method, values = error, name, taken_back
        if expected > LARGEST_ERROR_DEG:
            return seen, "left", expected
        if method in ("undone", "swapped back"):
            return values, method, expected
        if float(angles_deg(seen, values).mean()) < expected:
            return seen, "left", expected  # the fill is no surer than what is there
        if self.span.kind == "filled" and not self._beats_a_line(expected):
            return seen, "left", expected
        if from_contact is None or not method.startswith("neighbours"):
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

    def _fills(self) -> dict[Method, Callable[[int, int], FloatArray]]:
        """Return the ways to fill a gap, each of which takes its frames: interpolation first."""
        fills: dict[Method, Callable[[int, int], FloatArray]] = {
            "line": self._nearly_line,
            "bridged": self._bridge,
        }
        if self._similar(self.span.start, self.span.end) is not None:
            fills["neighbours"] = lambda a, b: self._or_bridge(a, b, self._similar(a, b))
            fills["neighbours, moved"] = lambda a, b: self._or_bridge(a, b, self._moved(a, b))
        return fills

    def _best_fill(self) -> tuple[float, Method]:
        """Return the error to expect of the best way to fill the gap, and which it is.

        Similar motion has to beat interpolation by so much that it is not by chance.
        """
        best: tuple[float, Method] = (np.inf, "line")
        for method, fill in self._fills().items():
            error = self._trial_error(fill)
            is_similar = method.startswith("neighbours")
            if is_similar:
                error = max(error, self._similar_misfit_deg(method))
            if error < best[0] * (NEIGHBOURS_MUST_BEAT if is_similar else 1.0):
                best = error, method
        return best

    def _similar_misfit_deg(self, method: Method) -> float:
        """Return how badly similar motion fits the frames beside the span, in degrees.

        What was found for a faulty word may be none: elsewhere, where nothing is wrong, it fits
        better. Moved, it may be off by half of what it is moved by more at one edge than at the
        other.
        """
        start, end = self.span.start, self.span.end
        shown = self._similar(start, end)
        if shown is None:
            return 0.0
        if method == "neighbours":
            return self._edge_misfit_deg(shown)
        edges = self._edge_turns(start, end)
        return 0.0 if edges is None else float(np.linalg.norm(edges[1] - edges[0])) / 2.0

    def _beats_a_line(self, expected: float) -> bool:
        """Return whether a repair is surer than the line that a gap is already filled by."""
        seen, line = self.quats[self.span.frames], self._line(self.span.start, self.span.end)
        if float(angles_deg(seen, line).mean()) > LEAST_MOVED_DEG:
            return True  # what is there goes elsewhere
        return expected < FILLED_MUST_BEAT * self._trial_error(self._line)

    def _taken_back(self, filled: FloatArray) -> Iterator[tuple[FloatArray, float, Method]]:
        """Yield the span without its turn, or with left and right swapped, and errors to expect.

        Only what leaves no jump at the edges. Where the clip's end leaves one edge, nothing tells
        how badly the turn fits: so it has to bring the joint nearer to what fills the gap, too.
        """
        start, end, kind = self.span.start, self.span.end, self.span.kind
        before = self._roughness(self.quats[start:end])
        if self.opposite is not None and kind in TAKEN_BACK:
            there = self.opposite[start:end]
            options = [there * signs for signs in MIRRORS]
            rough = [self._roughness(values) for values in options]
            best = int(np.argmin(rough))
            if rough[best] < LARGEST_JUMP_LEFT * before:
                yield options[best], self._edge_misfit_deg(options[best]), "swapped back"
        of_one_edge = ("offset", "flip")
        if kind not in (("drift", *of_one_edge) if all(self._has_edges) else of_one_edge):
            return
        ways = []
        for left in (False, True):
            values, misfit = self._turned_back(start, end, left)
            jump = self._roughness(values)
            if jump < LARGEST_JUMP_LEFT * before:
                ways.append((misfit, jump, left, values))
        if not ways:
            return
        ways.sort(key=lambda way: way[:2])
        misfit, _, left, values = ways[0]
        if not all(self._has_edges):
            away = [
                float(angles_deg(one, filled).mean()) for one in (values, self.quats[start:end])
            ]
            if away[0] > MUST_COME_NEARER * away[1]:
                return
        elif len(ways) > 1:  # the less sure the side of the turn is, the more it may be off
            unsure = misfit / max(misfit + ways[1][0], LEAST_ANGLE_DEG)
            misfit = max(misfit, unsure * float(angles_deg(values, ways[1][3]).mean()))
        usual = self._trial_error(lambda a, b: self._turned_back(a, b, left)[0])
        yield values, max(usual, misfit), "undone"

    def _turned_back(self, start: int, end: int, left: bool) -> tuple[FloatArray, float]:
        """Return a gap with its turn taken back, and how badly the turn fits, in degrees.

        The turn of an offset is found at both edges: by half of what these differ it may be off.
        At an end of the clip it is found at the one edge, and nothing tells how badly it fits.
        That of a drift is found at its end; where it begins is never sure.
        """
        length = end - start
        ramp = np.arange(1, length + 1) / length
        seen = self.quats[start:end]
        if not all(self._has_edges):
            if self._has_edges[0]:
                turn = turn_between(self._pace_onwards(start - 1, 1), seen[0], left)
            else:
                turn = turn_between(self._pace_onwards(end, -1), seen[-1], left)
            return (
                multiply(conjugate(turn), seen) if left else multiply(seen, conjugate(turn))
            ), 0.0
        turn_last = turn_between(self._pace_onwards(end, -1), seen[-1], left)
        if self.span.kind == "drift":
            vector = rotation_vectors_deg(turn_last)
            turns = from_rotation_vectors_deg(ramp[:, None] * vector)
            misfit = ONSET_MISFIT * float(np.linalg.norm(vector))
        else:
            turn_first = turn_between(self._pace_onwards(start - 1, 1), seen[0], left)
            turns = slerp(turn_first[None], turn_last[None], ramp)
            misfit = float(angles_deg(turn_first, turn_last)) / 2.0
        back = conjugate(turns)
        return (multiply(back, seen) if left else multiply(seen, back)), misfit

    def swapped(self, mirror: int) -> FloatArray:
        """Return what the opposite joint has in the span, mirrored in one of the `MIRRORS`.

        Only where there is an opposite joint.
        """
        assert self.opposite is not None
        values: FloatArray = self.opposite[self.span.frames] * MIRRORS[mirror]
        return values

    def swapped_misfits_deg(self) -> FloatArray | None:
        """Return (4,) how badly what the opposite joint has fits the edges, by mirror.

        None where there is no opposite joint, or an edge is no frame of the clip.
        """
        if self.opposite is None or self.span.start < 1 or self.span.end >= len(self.quats):
            return None
        return np.array(
            [self._edge_misfit_deg(self.swapped(mirror)) for mirror in range(len(MIRRORS))]
        )

    def misfit_deg(self) -> float:
        """Return how badly what was captured fits the frames beside the span."""
        return self._edge_misfit_deg(self.quats[self.span.frames])

    def _edge_misfit_deg(self, values: FloatArray) -> float:
        """Return how far values are from what the frames beside the span lead to."""
        start, end = self.span.start, self.span.end
        apart = []
        if start > 0:
            apart.append(angles_deg(self._pace_onwards(start - 1, 1), values[0]))
        if end < len(self.quats):
            apart.append(angles_deg(self._pace_onwards(end, -1), values[-1]))
        return float(np.max(apart))

    def _calmed(self, method: Method) -> tuple[FloatArray, float]:
        """Return the span without its jitter, and the error to expect.

        What the capture saw beyond a fill of the gap is smoothed, so that it fades to the fill at
        the edges. Of several widths the one is taken that errs least: a wide filter takes motion
        away, by how much is tried on other gaps; a narrow one leaves jitter in.
        """
        fill = self._fills()[method]
        start, end = self.span.start, self.span.end
        gaps = [(fill(a, b), self.quats[a:b]) for a, b in self._trial_gaps()]
        others = [rotation_vectors_deg(multiply(conjugate(f), q)) for f, q in gaps]
        filled = fill(start, end)
        beyond = rotation_vectors_deg(multiply(conjugate(filled), self.quats[start:end]))
        quick = beyond - self._slow(beyond, CALM_WIDTHS_S[1])
        size, smooth_frames = _noise_of(
            _root_mean_square(quick),
            _root_mean_square(np.diff(beyond, axis=0)),
            CALM_WIDTHS_S[1] * self.fps,
        )  # of noise that was smoothed over so many frames ...
        best = (np.inf, filled)
        for width_s in CALM_WIDTHS_S if others else ():
            ratio = width_s * self.fps / max(smooth_frames, 1e-9)
            left_over = size * (1.0 + ratio**2) ** -0.25  # ... leaves this behind a filter
            lost = np.mean([_root_mean_square(o - self._slow(o, width_s)) for o in others])
            error = math.hypot(left_over, float(lost))
            if error < best[0]:
                slow = from_rotation_vectors_deg(self._slow(beyond, width_s))
                best = error, multiply(filled, slow)
        return best[1], best[0]

    def _slow(self, vectors: FloatArray, width_s: float) -> FloatArray:
        """Return the slow part of vectors (n, 3), which are zero beside the span."""
        from scipy.ndimage import gaussian_filter1d

        return np.asarray(gaussian_filter1d(vectors, width_s * self.fps, axis=0, mode="constant"))

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

    def _line(self, start: int, end: int) -> FloatArray:
        """Return a spherical line from the frame before to the frame after."""
        return line_across(self.quats, FrameRange(start, end))

    def _nearly_line(self, start: int, end: int) -> FloatArray:
        """Return a line that is bent a little towards the paces at its edges.

        An exactly straight one looks like what a program drew, and would be flagged as such.
        """
        return self._bridge(start, end, LINE_BEND if end - start >= LINE_FRAMES - 2 else 0.0)

    def _bridge(self, start: int, end: int, bend: float = 1.0) -> FloatArray:
        """Return a curve from the frame before to the frame after, at their paces.

        Spherical, plus cubic Hermite terms for the paces, which fade on gaps over `BEND_S` and
        count as much as they are told to.
        """
        first, last = start - 1, end
        if not all(self._has_edges):
            at = first if self._has_edges[0] else last
            return np.repeat(self.quats[at : at + 1], end - start, axis=0)
        length = last - first
        s = (np.arange(1, length) / length)[:, None]
        line = slerp(self.quats[first][None], self.quats[last][None], s[:, 0])
        mean = rotation_vectors_deg(multiply(conjugate(self.quats[first]), self.quats[last]))
        trust = bend * min(1.0, BEND_S * self.fps / length)
        pace_in = self._pace(first - PACE_FRAMES, first) * length - mean
        pace_out = self._pace(last, last + PACE_FRAMES) * length - mean
        turns = trust * (s * (1 - s) ** 2 * pace_in - s**2 * (1 - s) * pace_out)
        return multiply(line, from_rotation_vectors_deg(turns))

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
        edges = self._edge_turns(start, end, k)
        shown = self._similar(start, end, k)
        if edges is None or shown is None:
            return None
        s = (np.arange(1, end - start + 1) / (end - start + 1))[:, None]
        return multiply(shown, from_rotation_vectors_deg((1 - s) * edges[0] + s * edges[1]))

    def _edge_turns(self, start: int, end: int, k: int | None = None) -> FloatArray | None:
        """Return (2, 3) how similar motion is turned against the frames beside a gap.

        At an end of the clip what holds for the other edge.
        """
        turns = []
        for frame, is_there in zip((start - 1, end), self._has_edges, strict=True):
            if is_there:
                shown = self._similar(frame, frame + 1, k)
                if shown is None:
                    return None
                turn = multiply(conjugate(shown[0]), self.quats[frame])
                turns.append(rotation_vectors_deg(turn))
        return np.stack([turns[0], turns[-1]]) if turns else None

    def _trial_error(self, fill: Callable[[int, int], FloatArray]) -> float:
        """Return the mean error of a fill on other gaps of this length, in degrees."""
        gaps = self._trial_gaps()
        if not gaps:  # only its pace is left to go by
            return UNTRIED_ERROR_DEG_S * len(self.span) / self.fps
        errors = [angles_deg(fill(a, b), self.quats[a:b]).mean() for a, b in gaps]
        return float(np.mean(errors))

    def _trial_gaps(self) -> list[tuple[int, int]]:
        """Return other gaps of this length in the same joint, where nothing is flagged.

        Near ones tell more than those far away: in a long clip only these are tried.
        """
        if self._gaps is not None:
            return self._gaps
        length, n_frames = len(self.span), len(self.quats)
        reach = max(TRIAL_REACH_S * self.fps, 2.0 * PLACES_PER_TRIAL * N_TRIALS)
        low = max(1.0, min(self.span.start - reach, n_frames - length - 1 - 2 * reach))
        high = max(low, min(n_frames - length - 1.0, low + 2 * reach))
        places = np.linspace(low, high, PLACES_PER_TRIAL * N_TRIALS)
        starts = np.unique(places.astype(np.int64))
        starts = starts[np.argsort(np.abs(starts - self.span.start), kind="stable")]
        gaps: list[tuple[int, int]] = []
        for start in starts.tolist():
            end = start + length
            beyond = self.wrong[max(0, start - PACE_FRAMES - 1) : end + PACE_FRAMES + 1]
            if start >= 1 and end < n_frames and not beyond.any() and len(gaps) < N_TRIALS:
                gaps.append((start, end))
        self._gaps = gaps
        return gaps

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


def _noise_of(quick: float, step: float, width: float) -> tuple[float, float]:
    """Return the size of noise that was smoothed by a bell, and the bell's deviation in frames.

    Parameters
    ----------
    quick : float
        Root mean square of what a bell of `width` frames leaves out of it: the slow part of the
        noise is not seen there.
    step : float
        That of its steps from frame to frame.
    width : float, frames
    """
    size = smooth = quick
    for _ in range(NOISE_ROUNDS):
        smooth = size / max(math.sqrt(2.0) * step, 1e-9)
        ratio = width / max(smooth, 1e-9)
        seen = 1.0 - 2.0 / math.sqrt(1.0 + ratio**2 / 2.0) + 1.0 / math.sqrt(1.0 + ratio**2)
        size = quick / math.sqrt(max(seen, LEAST_SEEN))
    return size, smooth


def _root_mean_square(vectors: FloatArray) -> float:
    """Return the root mean square length of vectors (n, 3); of none, 0."""
    return float(np.sqrt((vectors**2).sum(axis=1).mean())) if len(vectors) else 0.0
