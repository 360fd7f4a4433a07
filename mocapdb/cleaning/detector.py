"""The detector: how likely each hypothesis is a fault, given all evidence.

Discontinuity alone finds what has sharp edges but cannot tell a glitch from a sharp movement;
self-similarity alone knows what is unusual but not what is wrong. Both make hypotheses and both
give evidence, weighed by a logistic regression for each kind of hypothesis. Its constants ship with
the package (`scripts/fit_cleaning.py` makes them from clips of calibration subjects with injected
faults): confidence is the probability that a hypothesis is a fault, in [0, 1].
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np

from mocapdb._typing import FloatArray
from mocapdb.cleaning.digression import (
    LITERAL_THRESHOLD,
    MovementDigressionMap,
    Span,
    literal_map,
)
from mocapdb.cleaning.hypotheses import EVIDENCE, Hypothesis, find_hypotheses
from mocapdb.cleaning.neighbours import (
    N_CANDIDATES,
    SOURCE_FRAMES,
    TARGET_FRAMES,
    Vocabulary,
    find_neighbours,
)
from mocapdb.cleaning.similarity import Consensus, find_consensus, two_stage_consensus
from mocapdb.cleaning.texture import Texture, local_rotations, motion_texture
from mocapdb.cleaning.unlike import UNLIKE_EVIDENCE, find_unlike
from mocapdb.errors import ClipError
from mocapdb.motion.clip import Clip

__all__ = [
    "FEATURES",
    "MODELS",
    "detect_faults",
    "features",
    "gather",
    "model_of",
]

MODELS = (
    "offset", "noise", "freeze", "drift", "soft offset", "soft noise", "soft drift", "unlike",
)  # fmt: skip
FEATURES: dict[str, tuple[str, ...]] = dict.fromkeys(
    MODELS, (*EVIDENCE, "unlikeness", "slow_unlikeness")
)
FEATURES["unlike"] = UNLIKE_EVIDENCE
SOFT_DOUBT = 1.0  # soft edges are more often movement than in the trials calibrated on
EXACT_S = 3600.0  # of context, beyond which only candidates are evaluated
AROUND_S = 0.5
COVERED = 0.5  # of a hypothesis, by finer or surer ones: it says nothing new
NEAR_S = 0.07
GAP_S = 0.05  # between two stretches of noise that are one


def detect_faults(
    clip: Clip,
    context: Iterable[Clip] | Vocabulary = (),
    *,
    threshold: float | None = None,
    similarity: bool = True,
    two_stage: bool = False,
    literal: bool = False,
) -> MovementDigressionMap:
    """Find the stretches of joints that look like faults of the capture.

    Parameters
    ----------
    clip : Clip
        Of any skeleton that has rotation channels, at any rate.
    context : iterable of Clip, or Vocabulary
        Other clips to find similar motion in, of the same joints. The clip itself always counts.
        Clips of another rate are resampled. A vocabulary made once serves many clips; of more than
        an hour, only promising candidates are compared.
    threshold : float, optional
        Confidence from which a span is flagged, in (0, 1]. By default the calibrated one.
    similarity : bool
        Whether to look for similar motion at all. It is left out where clip and context are
        shorter than a word, too.
    two_stage : bool
        Whether only words that are distinct within the clip are looked for in the context, by
        groups of joints (see `similarity.two_stage_consensus`).
    literal : bool
        Whether to take the paper's map as printed instead (see `digression.literal_map`), which is
        there for comparison: it flags nearly everything.

    Raises
    ------
    ClipError
        If no joint rotates, the threshold makes no sense, a context clip's rate is below that
        of the texture, or a literal map is wanted where there are no words.
    SkeletonError
        If a context clip has other joints.
    """
    models = _calibration()
    usual = LITERAL_THRESHOLD if literal else models.threshold
    least = usual if threshold is None else threshold
    if not 0.0 < least <= 1.0:
        raise ClipError(f"Expected a threshold in (0, 1], but got {least}.")
    texture = motion_texture(clip)
    consensus = find_clip_consensus(texture, context, two_stage) if similarity else None
    if literal:
        if consensus is None:
            raise ClipError(
                f"Expected similar motion to {clip.name!r} to make the paper's map of, but there "
                "is none: the clip is too short, or similarity is off."
            )
        return literal_map(clip, texture, consensus.neighbours, threshold=least)
    native = local_rotations(clip)
    hypotheses = gather(native, texture, consensus)
    scores = np.zeros((len(clip), clip.skeleton.n_joints))
    likely = []
    for hypothesis in hypotheses:
        sure = models.confidence(hypothesis, features(hypothesis, clip.fps, texture, consensus))
        joint = int(native.joints[hypothesis.row])
        covered = scores[hypothesis.start : hypothesis.end, joint]
        np.maximum(covered, sure, out=covered)
        if sure >= least:
            likely.append((sure, hypothesis))
    spans = [
        Span(int(native.joints[h.row]), h.start, h.end, sure, h.kind)
        for sure, h in _without_repeats(likely, NEAR_S * clip.fps)
    ]
    spans = sorted(_joined(spans, GAP_S * clip.fps), key=lambda span: (span.start, span.joint))
    return MovementDigressionMap(
        clip.skeleton, clip.fps, scores, tuple(spans), least, consensus, texture
    )


def find_clip_consensus(
    texture: Texture, context: Iterable[Clip] | Vocabulary, two_stage: bool = False
) -> Consensus | None:
    """Return what the neighbours in a clip and its context say; None where there are no words."""
    if len(texture) < SOURCE_FRAMES:
        return None
    own = find_neighbours(texture, [texture]) if len(texture) >= TARGET_FRAMES else None
    vocabulary = context if isinstance(context, Vocabulary) else _vocabulary(context, texture.fps)
    if vocabulary is None or not vocabulary.valid.any():
        return find_consensus(texture, own) if own else None
    if two_stage and own:
        return two_stage_consensus(texture, vocabulary)
    exactly = len(vocabulary) <= EXACT_S * texture.fps
    found = find_neighbours(texture, vocabulary, n_candidates=None if exactly else N_CANDIDATES)
    return find_consensus(texture, own.merged(found, len(texture)) if own else found)


def _vocabulary(clips: Iterable[Clip], fps: float) -> Vocabulary | None:
    textures = [motion_texture(clip, fps) for clip in clips]
    return Vocabulary.of(textures) if textures else None


def gather(native: Texture, texture: Texture, consensus: Consensus | None) -> list[Hypothesis]:
    """Return all hypotheses: by edges, finest first, then by self-similarity."""
    found = find_hypotheses(native)
    if consensus is not None:
        found += find_unlike(texture, consensus, native.fps, len(native))
    return found


def model_of(hypothesis: Hypothesis) -> str:
    """Return which of `MODELS` judges a hypothesis.

    A flip is a large offset; what showed at a lower rate only has soft edges.
    """
    if hypothesis.sign == "unlike":
        return "unlike"
    kind = "offset" if hypothesis.kind == "flip" else hypothesis.kind
    return f"soft {kind}" if hypothesis.coarseness else kind


def features(
    hypothesis: Hypothesis, fps: float, texture: Texture, consensus: Consensus | None
) -> tuple[float, ...]:
    """Return the evidence on a hypothesis, in the order of its `FEATURES`."""
    if hypothesis.sign == "unlike":
        return hypothesis.evidence
    unlike = _unlikeness(hypothesis, fps, texture, consensus) if consensus else 0.0
    slowness = hypothesis.evidence[EVIDENCE.index("slowness")]
    return (*hypothesis.evidence, unlike, slowness * unlike)


def _unlikeness(
    hypothesis: Hypothesis, fps: float, texture: Texture, consensus: Consensus
) -> float:
    """Return how much further from its neighbours the joint is inside than beside the stretch.

    High-passed: a joint that is unlike its neighbours throughout, by style or by body, is not
    wrong. On a logarithmic scale, over the spread of the neighbours.
    """
    n_frames, row = len(texture), hypothesis.row
    rate = texture.fps / fps
    first = math.ceil(hypothesis.start * rate - 1e-9)
    last = min(math.ceil(hypothesis.end * rate - 1e-9), n_frames)
    if not consensus.known[first:last].any():  # shorter than a frame of the texture, too
        return 0.0
    around = round(AROUND_S * texture.fps)
    residual = consensus.residual_deg[:, row]
    beside = np.concatenate(
        [residual[max(0, first - around) : max(0, first - 1)], residual[last + 1 : last + around]]
    )
    usual = float(np.median(beside)) if len(beside) else 0.0
    spread = float(np.median(consensus.spread_deg[first:last, row]))
    inside = float(np.median(residual[first:last]))
    return math.log((inside + 1.0) / (usual + spread + 1.0))


def _without_repeats(
    likely: list[tuple[float, Hypothesis]], near: float
) -> list[tuple[float, Hypothesis]]:
    """Leave out hypotheses about what others have explained.

    That is those whose frames finer ones, or surer ones of the same rate, cover for the most part;
    and drifts and freezes that owe an end to the edge of a surer one.
    """
    kept: list[tuple[float, Hypothesis]] = []
    for sure, h in sorted(likely, key=lambda pair: (pair[1].coarseness, -pair[0])):
        start, end = h.core
        shared = {
            i: max(0, min(end, k.end) - max(start, k.start))
            for i, (_, k) in enumerate(kept)
            if k.row == h.row
        }
        if sum(shared.values()) > COVERED * (end - start):
            for i in (i for i, n in shared.items() if n > 0):
                kept[i] = max(kept[i][0], sure), kept[i][1]
        else:
            kept.append((sure, h))
    return [
        (sure, h)
        for sure, h in kept
        if h.kind not in ("drift", "freeze")
        or not any(
            k.row == h.row and other > sure and _apart(h, k) <= near
            for other, k in kept
            if k is not h
        )
    ]


def _apart(a: Hypothesis, b: Hypothesis) -> int:
    """Return the frames between the nearest ends of two hypotheses."""
    return min(abs(x - y) for x in (a.start, a.end) for y in (b.start, b.end))


def _joined(spans: list[Span], gap: float) -> list[Span]:
    """Join spans of one joint that touch or overlap, under the surer one's kind.

    Noise may pause for a moment, of up to `gap` frames.
    """
    joined: list[Span] = []
    for span in sorted(spans, key=lambda span: (span.joint, span.start)):
        last = joined[-1] if joined else None
        if last is not None and last.joint == span.joint:
            both_noise = last.kind == span.kind == "noise"
            if span.start <= last.end + (gap if both_noise else 0):
                surer = max(last, span, key=lambda other: other.confidence)
                joined[-1] = surer._replace(start=last.start, end=max(last.end, span.end))
                continue
        joined.append(span)
    return joined


class _Models(NamedTuple):
    """The regressions: for each of `MODELS` a constant and a weight for each of its features."""

    threshold: float
    constants: dict[str, float]
    weights: dict[str, FloatArray]

    def confidence(self, hypothesis: Hypothesis, evidence: Sequence[float]) -> float:
        """Return the probability that a hypothesis is a fault."""
        name = model_of(hypothesis)
        score = self.constants[name] + float(self.weights[name] @ evidence)
        score -= SOFT_DOUBT if name.startswith("soft") else 0.0
        return 1.0 / (1.0 + math.exp(-min(max(score, -50.0), 50.0)))


@cache
def _calibration() -> _Models:
    text = files("mocapdb.cleaning").joinpath("data/calibration.json").read_text("utf-8")
    stored: dict[str, Any] = json.loads(text)
    models = stored["models"]
    if any(tuple(models[name]["weights"]) != FEATURES[name] for name in MODELS):
        raise ClipError(
            "Expected constants for the evidence of this version, but data/calibration.json has "
            "others. Run scripts/fit_cleaning.py."
        )
    return _Models(
        float(stored["threshold"]),
        {name: float(models[name]["constant"]) for name in MODELS},
        {name: np.array(list(models[name]["weights"].values())) for name in MODELS},
    )
