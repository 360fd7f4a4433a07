"""The detector: how likely each hypothesis is a fault, given all evidence.

Discontinuity alone finds what has sharp edges but cannot tell a glitch from a sharp movement;
self-similarity alone knows what is unusual but not what is wrong. Both make hypotheses
(`hypotheses`, `similarity_evidence`), both and the limits of the joints (`joint_limits`) give
evidence, which `fault_confidence` weighs for each hypothesis alone and `corroboration` beside all
others. What is left here is to choose: one hypothesis for each fault.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.base.kept_answers import kept_with_first
from mocapdb.cleaning.evidence.corroboration import corroborated
from mocapdb.cleaning.evidence.exchanges import find_exchanges
from mocapdb.cleaning.evidence.excursions import find_excursions
from mocapdb.cleaning.evidence.fault_confidence import Witnesses, probability
from mocapdb.cleaning.evidence.foot_faults import find_foot_faults
from mocapdb.cleaning.evidence.hypotheses import Hypothesis, find_hypotheses
from mocapdb.cleaning.evidence.jitter import find_jitter
from mocapdb.cleaning.evidence.joint_limits import RotationLimits
from mocapdb.cleaning.evidence.pooled_spread import PooledSpread
from mocapdb.cleaning.evidence.root_jumps import find_root_jumps
from mocapdb.cleaning.evidence.similarity_evidence import find_dissimilar
from mocapdb.cleaning.evidence.straight_lines import find_straight_lines
from mocapdb.cleaning.local_rotations import Texture, local_rotations, motion_texture
from mocapdb.cleaning.map.clip_ends import frames_between_cuts
from mocapdb.cleaning.map.digression_map import (
    MovementDigressionMap,
    Span,
    literal_map,
    shifted,
)
from mocapdb.cleaning.map.extents import grow_spans
from mocapdb.cleaning.neighbours.counterpart_joints import OtherMotion, context_of
from mocapdb.cleaning.neighbours.nearest_words import Neighbours, Vocabulary, find_neighbours
from mocapdb.cleaning.neighbours.similarity import (
    Consensus,
    consensus_with_others,
    find_consensus,
    two_stage_consensus,
)
from mocapdb.cleaning.tuning import (
    COVERED_SHARE,
    DETECTION_THRESHOLD,
    EXACT_OWN_S,
    EXACT_SEARCH_S,
    LITERAL_THRESHOLD,
    N_CANDIDATES,
    N_OWN_CANDIDATES,
    NOISE_PAUSE_S,
    PAUSE_FRAMES,
    SAME_EDGE_S,
    SMALL_PART,
    SOURCE_FRAMES,
    TARGET_FRAMES,
)
from mocapdb.errors import ClipError
from mocapdb.motion.clip import Clip
from mocapdb.motion.frame_range import FrameRange

__all__ = ["Context", "choose_spans", "detect_faults", "find_clip_consensus", "gather"]

Context: TypeAlias = Iterable[Clip] | Vocabulary | Sequence[Vocabulary]
"""What a clip is compared with besides itself."""


def detect_faults(
    clip: Clip,
    context: Context = (),
    *,
    threshold: float | None = None,
    similarity: bool = True,
    two_stage: bool = False,
    literal: bool = False,
) -> MovementDigressionMap:
    """Find the stretches of joints that look like faults of the capture.

    Frames at either end that a cut parts from the motion, such as a T-pose in front of it, are not
    searched (see `clip_ends`); the map says which.

    Parameters
    ----------
    clip : Clip
        Of any skeleton that has rotation channels, at any rate.
    context : iterable of Clip, Vocabulary, or sequence of Vocabulary
        Other clips to find similar motion in. The clip itself always counts. Clips of another rate
        are resampled, those of other joints put onto the clip's (see `counterpart_joints`). A
        vocabulary made once serves many clips; of more than an hour, only promising candidates are
        compared.
    threshold : float, optional
        Confidence from which a span is flagged, in (0, 1]. By default the calibrated one.
    similarity : bool
        Whether to look for similar motion at all. It is left out where clip and context are
        shorter than a word, too.
    two_stage : bool
        Whether only words that are distinct within the clip are looked for in the context, by
        groups of joints (see `similarity.two_stage_consensus`).
    literal : bool
        Whether to take the paper's map as printed instead (see `digression_map.literal_map`), to
        compare with: it flags nearly everything.

    Raises
    ------
    ClipError
        If no joint rotates, the threshold makes no sense, a context clip's rate is below that
        of the texture, a literal map is wanted where there are no words, or a context has two
        vocabularies of the clip's joints, or one and such clips.
    SkeletonError
        If a context clip has other joints that do not map to the clip's.
    """
    usual = LITERAL_THRESHOLD if literal else DETECTION_THRESHOLD
    least = usual if threshold is None else threshold
    if not 0.0 < least <= 1.0:
        raise ClipError(f"Expected a threshold in (0, 1], but got {least}.")
    native = local_rotations(clip)
    searched = None if literal else frames_between_cuts(clip, native)
    if searched is not None and len(searched) < len(clip):
        part = clip[searched.frames]
        found = _detect(
            part, local_rotations(part), context, least,
            similarity=similarity, two_stage=two_stage, literal=False,
        )  # fmt: skip
        scores = np.zeros((len(clip), clip.skeleton.n_joints))
        scores[searched.frames] = found.scores
        return replace(found, scores=scores, spans=shifted(found.spans, searched.start),
                       searched=searched)  # fmt: skip
    return _detect(
        clip, native, context, least, similarity=similarity, two_stage=two_stage, literal=literal
    )


def _detect(
    clip: Clip,
    native: Texture,
    context: Context,
    least: float,
    *,
    similarity: bool,
    two_stage: bool,
    literal: bool,
) -> MovementDigressionMap:
    """Find faults in all frames of a clip; see `detect_faults`."""
    texture = motion_texture(clip)
    vocabulary, others = _vocabularies(clip, texture, context)
    alone = find_clip_consensus(texture) if similarity else None
    consensus = alone
    if similarity and (vocabulary is not None or others):
        consensus = find_clip_consensus(texture, vocabulary, two_stage, others)
    if literal:
        if consensus is None:
            raise ClipError(
                f"Expected similar motion to {clip.name!r} to make the paper's map of, but there "
                "is none: the clip is too short, or similarity is off."
            )
        return literal_map(clip, texture, consensus.neighbours, threshold=least)
    views = [Witnesses(native, texture, alone, RotationLimits(texture))]
    if consensus is not alone:
        views.append(Witnesses(native, texture, consensus, RotationLimits(texture, vocabulary)))
    scores = np.zeros((len(clip), clip.skeleton.n_joints))
    likely = []
    for hypothesis, sure in _surest(clip, native, texture, views).items():
        joint = int(native.joints[hypothesis.row])
        covered = scores[hypothesis.frames, joint]
        np.maximum(covered, sure, out=covered)
        if sure >= least:
            likely.append((sure, hypothesis))
    grown = grow_spans(choose_spans(likely, native.joints, clip.fps), native)
    spans = _in_order(_joined(grown, clip.fps))
    spans = _in_order([*spans, *_foot_spans(clip, spans, scores, least)])
    for span in spans:
        covered = scores[span.frames, span.joint]
        np.maximum(covered, min(span.confidence, least), out=covered)
    return MovementDigressionMap(clip.skeleton, clip.fps, scores, spans, least, consensus, texture)


def _surest(
    clip: Clip, native: Texture, texture: Texture, views: Sequence[Witnesses]
) -> dict[Hypothesis, float]:
    """Return all hypotheses with how sure the surest view of the clip is of each.

    A context adds what it knows: strangers who do something else take nothing back of what the clip
    alone tells. So the clip alone and the clip in its context are both asked.
    """
    spread = PooledSpread(texture)
    surest: dict[Hypothesis, float] = {}
    for view in views:
        found = [h for h in gather(clip, native, texture, view.consensus) if view.moves(h)]
        alone = np.array([view.log_odds(hypothesis) for hypothesis in found])
        together = corroborated(found, alone, spread, len(clip), clip.fps)
        for hypothesis, log_odds in zip(found, together.tolist(), strict=True):
            sure = probability(log_odds - view.restless_log_odds(hypothesis))
            surest[hypothesis] = max(sure, surest.get(hypothesis, 0.0))
    return surest


def _foot_spans(
    clip: Clip, spans: Sequence[Span], scores: FloatArray, least: float
) -> Iterator[Span]:
    """Yield the feet that slide or sink, and bodies that do, and note how sure that is of all.

    Not of those whose leg, or what carries it, is flagged: that is why.
    """
    for fault in find_foot_faults(clip):
        whole = FrameRange(fault.start, fault.end)
        above = clip.skeleton.chain_to_root(fault.leg.ball)
        if any(
            span.joint in above and 2 * span.overlap(whole) > min(len(span), len(whole))
            for span in spans
        ):
            continue
        covered = scores[whole.frames, fault.joint]
        np.maximum(covered, fault.confidence, out=covered)
        if fault.confidence >= least:
            yield Span(fault.start, fault.end, fault.joint, fault.confidence, fault.kind)


def find_clip_consensus(
    texture: Texture,
    vocabulary: Vocabulary | None = None,
    two_stage: bool = False,
    others: Sequence[Vocabulary] = (),
) -> Consensus | None:
    """Return what the neighbours in a clip and its context say; None where there are no words.

    Parameters
    ----------
    texture : Texture
    vocabulary : Vocabulary, optional
        The context that has every joint.
    two_stage : bool
        See `detect_faults`.
    others : sequence of Vocabulary
        Context of other bodies, which show some joints.
    """
    if len(texture) < SOURCE_FRAMES:
        return None
    own = None
    if len(texture) >= TARGET_FRAMES:
        long = len(texture) > EXACT_OWN_S * texture.fps
        own = find_neighbours(texture, [texture], n_candidates=N_OWN_CANDIDATES if long else None)
    if vocabulary is not None and vocabulary.valid.any():
        if two_stage and own and not others:
            return two_stage_consensus(texture, vocabulary)
        found = _neighbours_in(texture, vocabulary)
        own = own.merged(found, len(texture)) if own else found
    elsewhere = [
        (other.rows, _neighbours_in(texture, other))
        for other in others
        if other.rows is not None and other.valid.any()
    ]
    if elsewhere:
        return consensus_with_others(texture, own, elsewhere)
    return find_consensus(texture, own) if own else None


def _neighbours_in(texture: Texture, vocabulary: Vocabulary) -> Neighbours:
    exactly = len(vocabulary) <= EXACT_SEARCH_S * texture.fps
    return find_neighbours(texture, vocabulary, n_candidates=None if exactly else N_CANDIDATES)


def _vocabularies(
    clip: Clip, texture: Texture, context: Context
) -> tuple[Vocabulary | None, list[Vocabulary]]:
    """Return what of a context has every joint, and what is of other bodies."""
    several = [context] if isinstance(context, Vocabulary) else list(context)
    made = [each for each in several if isinstance(each, Vocabulary)]
    clips = [each for each in several if isinstance(each, Clip)]
    own = [each for each in made if each.rows is None]
    others = [each for each in made if each.rows is not None]
    textures = [motion_texture(other, texture.fps) for other in clips]
    same = [other for other in textures if other.names == texture.names]
    if same:
        own.append(Vocabulary.of(same))
    if len(own) > 1:
        raise ClipError(
            "Expected one vocabulary of the clip's joints, or clips in its place, but got more. "
            "Make one of all clips with Vocabulary.of."
        )
    if len(same) < len(clips):
        bodies = (
            OtherMotion.of(other, texture.fps)
            for other, theirs in zip(clips, textures, strict=True)
            if theirs.names != texture.names
        )
        others += context_of(clip, bodies)
    return own[0] if own else None, others


def gather(
    clip: Clip, native: Texture, texture: Texture, consensus: Consensus | None
) -> list[Hypothesis]:
    """Return all hypotheses: by edges, finest first, then of all other sorts."""
    found = list(_gather_alone(clip, native))
    if consensus is not None:
        found += find_dissimilar(texture, consensus, native.fps, len(native))
    return found


@kept_with_first
def _gather_alone(clip: Clip, native: Texture) -> list[Hypothesis]:
    """Return the hypotheses that need no similar motion.

    They are most of the work and the same in every context, so they are kept with the clip.
    """
    return [
        *find_hypotheses(native),
        *find_straight_lines(clip, native),
        *find_exchanges(native),
        *find_root_jumps(clip, native),
        *find_jitter(native),
        *find_excursions(native),
    ]


def choose_spans(
    likely: Sequence[tuple[float, Hypothesis]], joints: IntArray, fps: float
) -> tuple[Span, ...]:
    """Return the spans that likely hypotheses make, by start, one for each fault.

    Parameters
    ----------
    likely : sequence of (float, Hypothesis)
        With their confidence.
    joints : (K,)
        Of the rows of the texture.
    fps : float, frames per second
    """
    spans = [
        Span(h.start, h.end, int(joints[h.row]), sure, h.kind)
        for sure, h in _without_repeats(likely, SAME_EDGE_S * fps)
    ]
    return _in_order(_joined(spans, fps))


def _in_order(spans: Iterable[Span]) -> tuple[Span, ...]:
    return tuple(sorted(spans, key=lambda span: (span.start, span.joint)))


def _without_repeats(
    likely: Sequence[tuple[float, Hypothesis]], near: float
) -> list[tuple[float, Hypothesis]]:
    """Leave out hypotheses that others explain.

    A hypothesis is left out if most of its frames are covered by hypotheses of a higher rate, or by
    surer ones of its own rate. One that only says that a joint differs from its neighbours, or goes
    where it never does, is left out if any of its frames is covered, since every fault makes a
    joint differ; but not if all that covers it lies well within, is a small part of it, has not
    both its edges, and is no freeze. Of a slow drift and a drift to one edge the slow one counts.
    Drifts, freezes and stretches that an end of the clip cuts off are left out if one of their
    edges is at one of a surer hypothesis, or of an exchange, which explains two edges of two
    joints; the last also if it is at one of any that has both its edges, or within a surer one
    that has.
    """
    slow = [h for _, h in likely if h.cue == "slow drift"]
    likely = [
        (sure, h)
        for sure, h in likely
        if h.kind != "drift"
        or h.cue == "slow drift"
        or not any(k.row == h.row and abs(k.end - h.end) <= near for k in slow)
    ]
    exchanges = [h for _, h in likely if h.cue == "exchange"]
    likely = [
        (sure, h)
        for sure, h in likely
        if not _may_have_one_edge(h)
        or not any(_same(k, h) and _apart(h, k) <= near for k in exchanges)
    ]
    kept: list[tuple[float, Hypothesis]] = []
    for sure, h in sorted(likely, key=lambda pair: (pair[1].halvings, -pair[0])):
        shared = {i: h.core.overlap(k) for i, (_, k) in enumerate(kept) if _same(k, h)}
        covered = sum(shared.values())
        explainers = [kept[i][1] for i, n in shared.items() if n]
        if covered > COVERED_SHARE * len(h.core) or (explainers and not _says_more(h, explainers)):
            alike = (i for i, n in shared.items() if n > COVERED_SHARE * len(kept[i][1].core))
            for i in alike:
                kept[i] = max(kept[i][0], sure), _with_start(kept[i], (sure, h), near)
        else:
            kept.append((sure, h))
    return [
        (sure, h)
        for sure, h in kept
        if not _may_have_one_edge(h)
        or not any(
            _same(k, h) and _explains_edge(k, h, surer=other > sure, near=near)
            for other, k in kept
            if k is not h
        )
    ]


def _says_more(h: Hypothesis, explainers: Sequence[Hypothesis]) -> bool:
    """Return whether a hypothesis, if it is of a soft sort, goes beyond others that overlap it."""
    if h.cue not in ("similarity", "excursion"):
        return True
    if any(_has_both_edges(other) or other.kind == "freeze" for other in explainers):
        return False  # nor is anything surer of where it begins and ends
    within = all(h.start < other.start and other.end < h.end for other in explainers)
    return within and sum(map(len, explainers)) <= SMALL_PART * len(h)


def _same(a: Hypothesis, b: Hypothesis) -> bool:
    """Return whether two hypotheses are of the same numbers: of one joint's rotation, say."""
    return a.row == b.row and (a.kind == "pop") == (b.kind == "pop")


def _may_have_one_edge(h: Hypothesis) -> bool:
    return h.kind in ("drift", "freeze") or h.cue == "cut off"


def _has_both_edges(h: Hypothesis) -> bool:
    return h.cue == "exchange" or (h.cue == "edges" and h.kind in ("offset", "flip"))


def _explains_edge(k: Hypothesis, h: Hypothesis, *, surer: bool, near: float) -> bool:
    """Return whether a hypothesis explains the one edge that another may have."""
    both = h.cue == "cut off" and _has_both_edges(k)
    if _apart(h, k) <= near:
        return surer or both
    edge = h.end if h.start == 0 else h.start
    return surer and both and k.start < edge < k.end


def _with_start(
    kept: tuple[float, Hypothesis], other: tuple[float, Hypothesis], near: float
) -> Hypothesis:
    """Return the kept hypothesis; of two drifts to one edge, the surer one's start counts."""
    (sure, h), (surer, k) = kept, other
    same = h.kind == k.kind == "drift" and k.cue == "edges" and abs(h.end - k.end) <= near
    return replace(h, start=k.start) if same and surer > sure else h


def _apart(a: Hypothesis, b: Hypothesis) -> int:
    """Return the frames between the nearest edges of two hypotheses."""
    return min(abs(x - y) for x in _edges(a) for y in _edges(b))


def _edges(h: Hypothesis) -> tuple[int, ...]:
    """Return where a hypothesis has edges: a drift sets in without one."""
    return (h.end,) if h.kind == "drift" else (h.start, h.end)


def _joined(spans: list[Span], fps: float) -> list[Span]:
    """Join spans of one joint that touch or nearly touch, under the surer one's kind.

    What is between two faults for so short a time tells nothing right. Noise may pause for longer.
    """
    joined: list[Span] = []
    for span in sorted(spans, key=lambda s: (s.kind == "pop", s.joint, s.start)):
        last = joined[-1] if joined else None
        if last is not None and (last.kind == "pop", last.joint) == (
            span.kind == "pop",
            span.joint,
        ):
            pause = 0.0 if span.kind == "pop" else PAUSE_FRAMES
            if last.kind == span.kind == "noise":
                pause = NOISE_PAUSE_S * fps
            if span.start <= last.end + pause:
                surer = max(last, span, key=lambda other: other.confidence)
                joined[-1] = replace(surer, start=last.start, end=max(last.end, span.end))
                continue
        joined.append(span)
    return joined
