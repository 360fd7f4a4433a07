"""The detector: how likely each hypothesis is a fault, given all evidence.

Discontinuity alone misses little but cannot tell a glitch from a sharp movement; self-similarity
alone knows what is unusual but not what is wrong. The two are weighed by a logistic regression
whose few constants ship with the package (`scripts/fit_cleaning.py` makes them from clips of
calibration subjects with injected faults): confidence is the probability that a hypothesis is a
fault, in [0, 1].
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np

from mocapdb._typing import BoolArray, FloatArray
from mocapdb.cleaning.hypotheses import (
    EVIDENCE,
    KINDS,
    Hypothesis,
    Kind,
    find_hypotheses,
)
from mocapdb.cleaning.jumps import find_jumps
from mocapdb.cleaning.neighbours import SOURCE_FRAMES, TARGET_FRAMES, find_neighbours
from mocapdb.cleaning.similarity import Consensus, find_consensus
from mocapdb.cleaning.texture import Texture, local_rotations, motion_texture
from mocapdb.errors import ClipError
from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import Skeleton

__all__ = ["FEATURES", "Detection", "Span", "detect_faults", "evidence_matrix"]

FEATURES = (
    *EVIDENCE,
    "unlikeness",
    *KINDS,
    *(f"strength of {kind}" for kind in ("noise", "freeze", "drift")),
)
AROUND_S = 0.5


class Span(NamedTuple):
    """A stretch of a joint that was flagged.

    Attributes
    ----------
    joint : int
        Index in the skeleton.
    start, end : int
        Frames ``start:end``.
    confidence : float
        Probability that it is a fault.
    kind : str
        ``"offset"``, ``"flip"``, ``"noise"``, ``"freeze"`` or ``"drift"``: what it looks like.
    """

    joint: int
    start: int
    end: int
    confidence: float
    kind: Kind


@dataclass(frozen=True, eq=False)
class Detection:
    """What was found in a clip.

    Attributes
    ----------
    skeleton : Skeleton
    fps : float, frames per second
    scores : (F, J)
        The movement digression map: the confidence of the likeliest hypothesis that covers a
        joint's frame, flagged or not.
    spans : tuple of Span
        What reaches the threshold, by start.
    threshold : float
    consensus : Consensus or None
        What the neighbours say, at the texture's rate; None where the context has no words.
    texture : Texture
        The texture that they were found for.
    """

    skeleton: Skeleton
    fps: float
    scores: FloatArray
    spans: tuple[Span, ...]
    threshold: float
    consensus: Consensus | None
    texture: Texture

    @property
    def mask(self) -> BoolArray:
        """(F, J) whether a joint's frame is flagged."""
        flagged = np.zeros(self.scores.shape, dtype=np.bool_)
        for span in self.spans:
            flagged[span.start : span.end, span.joint] = True
        return flagged


def detect_faults(
    clip: Clip,
    context: Iterable[Clip] = (),
    *,
    threshold: float | None = None,
    similarity: bool = True,
) -> Detection:
    """Find the stretches of joints that look like faults of the capture.

    Parameters
    ----------
    clip : Clip
        Of any skeleton that has rotation channels, at any rate.
    context : iterable of Clip
        Other clips to find similar motion in, of the same joints. The clip itself always counts.
        Clips of another rate are resampled.
    threshold : float, optional
        Confidence from which a span is flagged, in (0, 1]. By default the calibrated one.
    similarity : bool
        Whether to look for similar motion at all. It is left out where clip and context are
        shorter than a word, too.

    Raises
    ------
    ClipError
        If no joint rotates, the threshold makes no sense, or a context clip's rate is below that
        of the texture.
    SkeletonError
        If a context clip has other joints.
    """
    constants = _calibration()
    least = float(constants["threshold"]) if threshold is None else threshold
    if not 0.0 < least <= 1.0:
        raise ClipError(f"Expected a threshold in (0, 1], but got {least}.")
    texture = motion_texture(clip)
    consensus = find_clip_consensus(texture, context) if similarity else None
    native = local_rotations(clip)
    hypotheses = find_hypotheses(native, find_jumps(native))
    scores = np.zeros((len(clip), clip.skeleton.n_joints))
    if not hypotheses:
        return Detection(clip.skeleton, clip.fps, scores, (), least, consensus, texture)
    evidence = evidence_matrix(hypotheses, clip.fps, texture, consensus)
    scaled = (evidence - constants["mean"]) / constants["scale"]
    confidence = 1.0 / (1.0 + np.exp(-(scaled @ constants["weights"] + constants["intercept"])))
    spans = []
    for hypothesis, sure in zip(hypotheses, confidence.tolist(), strict=True):
        joint = int(native.joints[hypothesis.row])
        covered = scores[hypothesis.start : hypothesis.end, joint]
        np.maximum(covered, sure, out=covered)
        if sure >= least:
            spans.append(Span(joint, hypothesis.start, hypothesis.end, sure, hypothesis.kind))
    spans = sorted(_disjoint(spans), key=lambda span: (span.start, span.joint))
    return Detection(clip.skeleton, clip.fps, scores, tuple(spans), least, consensus, texture)


def find_clip_consensus(texture: Texture, context: Iterable[Clip]) -> Consensus | None:
    """Return what the neighbours in a clip and its context say; None where there are no words."""
    textures = [texture, *(motion_texture(other, texture.fps) for other in context)]
    longest = max(len(other) for other in textures)
    if len(texture) < SOURCE_FRAMES or longest < TARGET_FRAMES:
        return None
    return find_consensus(texture, find_neighbours(texture, textures))


def evidence_matrix(
    hypotheses: Sequence[Hypothesis], fps: float, texture: Texture, consensus: Consensus | None
) -> FloatArray:
    """Return (N, features) the evidence on hypotheses, in the order of `FEATURES`."""
    rows = []
    for hypothesis in hypotheses:
        kinds = [float(hypothesis.kind == kind) for kind in KINDS]
        strength = hypothesis.evidence[0]
        unlike = _unlikeness(hypothesis, fps, texture, consensus) if consensus else 0.0
        slopes = [strength * kinds[KINDS.index(kind)] for kind in ("noise", "freeze", "drift")]
        rows.append([*hypothesis.evidence, unlike, *kinds, *slopes])
    return np.array(rows).reshape(len(rows), len(FEATURES))


def _unlikeness(
    hypothesis: Hypothesis, fps: float, texture: Texture, consensus: Consensus
) -> float:
    """Return how much further from its neighbours the joint is inside than beside the stretch.

    High-passed: a joint that is unlike its neighbours throughout, by style or by body, is not
    wrong. On a logarithmic scale, over the spread of the neighbours.
    """
    n_frames, row = len(texture), hypothesis.row
    rate = texture.fps / fps
    first = min(math.ceil(hypothesis.start * rate - 1e-9), n_frames - 1)
    last = min(max(first + 1, math.ceil(hypothesis.end * rate - 1e-9)), n_frames)
    if not consensus.known[first:last].any():
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


def _disjoint(spans: list[Span]) -> list[Span]:
    """Join spans of one joint that touch or overlap, under the surer one's kind."""
    joined: list[Span] = []
    for span in sorted(spans, key=lambda span: (span.joint, span.start)):
        last = joined[-1] if joined else None
        if last is not None and last.joint == span.joint and span.start <= last.end:
            surer = max(last, span, key=lambda other: other.confidence)
            joined[-1] = surer._replace(start=last.start, end=max(last.end, span.end))
        else:
            joined.append(span)
    return joined


@cache
def _calibration() -> dict[str, Any]:
    """Return the constants of the regression, the sequences as arrays."""
    text = files("mocapdb.cleaning").joinpath("data/calibration.json").read_text("utf-8")
    constants: dict[str, Any] = json.loads(text)
    if tuple(constants["features"]) != FEATURES:
        raise ClipError(
            "Expected constants for the evidence of this version, but data/calibration.json has "
            "others. Run scripts/fit_cleaning.py."
        )
    return {k: np.array(v) if isinstance(v, list) else v for k, v in constants.items()}
