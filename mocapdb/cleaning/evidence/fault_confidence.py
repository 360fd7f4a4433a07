"""How likely a hypothesis is a fault, given all evidence: one logistic regression for each kind.

`scripts/fit_cleaning.py` fits the regressions to clean clips with injected faults.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cleaning.evidence.hypotheses import EVIDENCE, Hypothesis
from mocapdb.cleaning.evidence.joint_limits import RotationLimits
from mocapdb.cleaning.evidence.similarity_evidence import SIMILARITY_EVIDENCE
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.neighbours.similarity import Consensus
from mocapdb.cleaning.tuning import (
    BESIDE_S,
    CUT_OFFSET_MODEL,
    DRIFT_MODEL,
    FREEZE_MODEL,
    HELD_MODEL,
    LEAST_APART_DEG,
    NOISE_MODEL,
    OFFSET_MODEL,
    SIMILARITY_MODEL,
    SOFT_DRIFT_MODEL,
    SOFT_NOISE_MODEL,
    SOFT_OFFSET_MODEL,
)

__all__ = ["FEATURES", "MODELS", "Model", "confidence", "features", "model_of"]


class Model(NamedTuple):
    """One regression.

    Attributes
    ----------
    constant : float
    weights : (n,)
        One for each feature, in the order of the model's `FEATURES`.
    """

    constant: float
    weights: FloatArray


ENTRIES: dict[str, Mapping[str, float]] = {
    "offset": OFFSET_MODEL,
    "noise": NOISE_MODEL,
    "freeze": FREEZE_MODEL,
    "drift": DRIFT_MODEL,
    "cut offset": CUT_OFFSET_MODEL,
    "held": HELD_MODEL,
    "soft offset": SOFT_OFFSET_MODEL,
    "soft noise": SOFT_NOISE_MODEL,
    "soft drift": SOFT_DRIFT_MODEL,
    "similarity": SIMILARITY_MODEL,
}
FEATURES: dict[str, tuple[str, ...]] = dict.fromkeys(
    ENTRIES,
    (
        *EVIDENCE,
        "dissimilarity",
        "low_rate_dissimilarity",
        "beyond_limits",
        "low_rate_beyond_limits",
    ),
)
FEATURES["similarity"] = (*SIMILARITY_EVIDENCE, "beyond_limits")
MODELS = {
    name: Model(entry["constant"], np.array([entry[feature] for feature in FEATURES[name]]))
    for name, entry in ENTRIES.items()
}


def confidence(
    hypothesis: Hypothesis, evidence: Sequence[float], models: Mapping[str, Model] = MODELS
) -> float:
    """Return the probability that a hypothesis is a fault."""
    constant, weights = models[model_of(hypothesis)]
    log_odds = constant + float(weights @ evidence)
    return 1.0 / (1.0 + math.exp(-min(max(log_odds, -50.0), 50.0)))


def model_of(hypothesis: Hypothesis) -> str:
    """Return which of `MODELS` judges a hypothesis.

    A flip is a large offset; what showed at a lower rate only has soft edges.
    """
    if hypothesis.cue == "similarity":
        return "similarity"
    kind: str = "offset" if hypothesis.kind == "flip" else hypothesis.kind
    kind = {"cut off": "cut offset", "held": "held"}.get(hypothesis.cue, kind)
    return f"soft {kind}" if hypothesis.halvings else kind


def features(
    hypothesis: Hypothesis,
    fps: float,
    texture: Texture,
    consensus: Consensus | None,
    limits: RotationLimits,
) -> tuple[float, ...]:
    """Return the evidence on a hypothesis, in the order of its `FEATURES`."""
    first, last = _texture_frames(hypothesis, fps, texture)
    if hypothesis.cue == "similarity":
        most = math.exp(hypothesis.evidence[SIMILARITY_EVIDENCE.index("size")])
        return (*hypothesis.evidence, limits.beyond(hypothesis.row, first, last, most))
    most = _size_deg(hypothesis)
    beyond = limits.beyond(hypothesis.row, first, last, most)
    apart = 0.0
    if consensus:
        apart = _dissimilarity(hypothesis.row, first, last, most, texture.fps, consensus)
    low_rate = hypothesis.evidence[EVIDENCE.index("low_rate")]
    return (*hypothesis.evidence, apart, low_rate * apart, beyond, low_rate * beyond)


def _size_deg(hypothesis: Hypothesis) -> float:
    """Return by how much the joint would be wrong, by its jumps."""
    size = math.exp(hypothesis.evidence[EVIDENCE.index("size")])
    missed = math.expm1(hypothesis.evidence[EVIDENCE.index("missed")])
    return size + missed if hypothesis.kind == "freeze" else size


def _texture_frames(hypothesis: Hypothesis, fps: float, texture: Texture) -> tuple[int, int]:
    rate = texture.fps / fps
    first = math.ceil(hypothesis.start * rate - 1e-9)
    return first, min(math.ceil(hypothesis.end * rate - 1e-9), len(texture))


def _dissimilarity(
    row: int, first: int, last: int, most_deg: float, fps: float, consensus: Consensus
) -> float:
    """Return how much further from its neighbours the joint is inside than beside the stretch.

    A joint may differ from its neighbours all the time, by style or by body, and not be wrong: so
    it is compared with the frames beside the stretch. The result is the logarithm of the ratio,
    to which the spread of the neighbours is added below. A difference larger than the hypothesis
    explains does not count.
    """
    if not consensus.known[first:last].any():  # none, or no frame of the texture
        return 0.0
    around = round(BESIDE_S * fps)
    residual = consensus.residual_deg[:, row]
    beside = np.concatenate(
        [residual[max(0, first - around) : max(0, first - 1)], residual[last + 1 : last + around]]
    )
    usual = float(np.median(beside)) if len(beside) else 0.0
    spread = float(np.median(consensus.spread_deg[first:last, row]))
    inside = min(float(np.median(residual[first:last])), usual + most_deg)
    return math.log((inside + LEAST_APART_DEG) / (usual + spread + LEAST_APART_DEG))
