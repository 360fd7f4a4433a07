"""How likely a hypothesis is a fault, given all evidence: one logistic regression for each kind.

The constants ship with the package (`scripts/fit_cleaning.py` makes them from clips of calibration
subjects with injected faults).
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cleaning.evidence.hypotheses import EVIDENCE, Hypothesis
from mocapdb.cleaning.evidence.joint_limits import RotationLimits
from mocapdb.cleaning.evidence.similarity_evidence import UNLIKE_EVIDENCE
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.neighbours.similarity import Consensus
from mocapdb.errors import ClipError

__all__ = ["FEATURES", "MODELS", "Calibration", "calibration", "features", "model_of"]

MODELS = (
    "offset", "noise", "freeze", "drift", "cut offset", "held",
    "soft offset", "soft noise", "soft drift", "unlike",
)  # fmt: skip
FEATURES: dict[str, tuple[str, ...]] = dict.fromkeys(
    MODELS, (*EVIDENCE, "unlikeness", "slow_unlikeness", "beyond", "slow_beyond")
)
FEATURES["unlike"] = (*UNLIKE_EVIDENCE, "beyond")
AROUND_S = 0.5


class Calibration(NamedTuple):
    """The regressions: for each of `MODELS` a constant and a weight for each of its features.

    Attributes
    ----------
    threshold : float
        Confidence from which a span is flagged.
    constants : dict of str to float
    weights : dict of str to array
        In the order of `FEATURES`.
    """

    threshold: float
    constants: dict[str, float]
    weights: dict[str, FloatArray]

    def confidence(self, hypothesis: Hypothesis, evidence: Sequence[float]) -> float:
        """Return the probability that a hypothesis is a fault."""
        name = model_of(hypothesis)
        score = self.constants[name] + float(self.weights[name] @ evidence)
        return 1.0 / (1.0 + math.exp(-min(max(score, -50.0), 50.0)))


@cache
def calibration() -> Calibration:
    """Return the constants that ship with the package."""
    text = files("mocapdb.cleaning").joinpath("data/calibration.json").read_text("utf-8")
    stored: dict[str, Any] = json.loads(text)
    models = stored["models"]
    if any(tuple(models[name]["weights"]) != FEATURES[name] for name in MODELS):
        raise ClipError(
            "Expected constants for the evidence of this version, but data/calibration.json has "
            "others. Run scripts/fit_cleaning.py."
        )
    return Calibration(
        float(stored["threshold"]),
        {name: float(models[name]["constant"]) for name in MODELS},
        {name: np.array(list(models[name]["weights"].values())) for name in MODELS},
    )


def model_of(hypothesis: Hypothesis) -> str:
    """Return which of `MODELS` judges a hypothesis.

    A flip is a large offset; what showed at a lower rate only has soft edges.
    """
    if hypothesis.sign == "unlike":
        return "unlike"
    kind: str = "offset" if hypothesis.kind == "flip" else hypothesis.kind
    kind = {"edge": "cut offset", "held": "held"}.get(hypothesis.sign, kind)
    return f"soft {kind}" if hypothesis.coarseness else kind


def features(
    hypothesis: Hypothesis,
    fps: float,
    texture: Texture,
    consensus: Consensus | None,
    limits: RotationLimits,
) -> tuple[float, ...]:
    """Return the evidence on a hypothesis, in the order of its `FEATURES`."""
    first, last = _texture_frames(hypothesis, fps, texture)
    if hypothesis.sign == "unlike":
        most = math.exp(hypothesis.evidence[UNLIKE_EVIDENCE.index("size")])
        return (*hypothesis.evidence, limits.beyond(hypothesis.row, first, last, most))
    most = _size_deg(hypothesis)
    beyond = limits.beyond(hypothesis.row, first, last, most)
    unlike = (
        _unlikeness(hypothesis.row, first, last, most, texture.fps, consensus) if consensus else 0.0
    )
    slowness = hypothesis.evidence[EVIDENCE.index("slowness")]
    return (*hypothesis.evidence, unlike, slowness * unlike, beyond, slowness * beyond)


def _size_deg(hypothesis: Hypothesis) -> float:
    """Return by how much the joint would be wrong, by its jumps."""
    size = math.exp(hypothesis.evidence[EVIDENCE.index("size")])
    missed = math.expm1(hypothesis.evidence[EVIDENCE.index("missed")])
    return size + missed if hypothesis.kind == "freeze" else size


def _texture_frames(hypothesis: Hypothesis, fps: float, texture: Texture) -> tuple[int, int]:
    rate = texture.fps / fps
    first = math.ceil(hypothesis.start * rate - 1e-9)
    return first, min(math.ceil(hypothesis.end * rate - 1e-9), len(texture))


def _unlikeness(
    row: int, first: int, last: int, most_deg: float, fps: float, consensus: Consensus
) -> float:
    """Return how much further from its neighbours the joint is inside than beside the stretch.

    High-passed: a joint that is unlike its neighbours throughout, by style or by body, is not
    wrong. On a logarithmic scale, over the spread of the neighbours. No more than what the
    hypothesis explains counts.
    """
    if not consensus.known[first:last].any():  # shorter than a frame of the texture, too
        return 0.0
    around = round(AROUND_S * fps)
    residual = consensus.residual_deg[:, row]
    beside = np.concatenate(
        [residual[max(0, first - around) : max(0, first - 1)], residual[last + 1 : last + around]]
    )
    usual = float(np.median(beside)) if len(beside) else 0.0
    spread = float(np.median(consensus.spread_deg[first:last, row]))
    inside = min(float(np.median(residual[first:last])), usual + most_deg)
    return math.log((inside + 1.0) / (usual + spread + 1.0))
