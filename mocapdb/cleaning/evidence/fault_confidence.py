"""How likely a hypothesis is a fault, given all evidence: one logistic regression for each kind.

Hypotheses by edges are asked how unlike similar motion they are and how far beyond the joint's
limits, each also times the lowness of the rate. The newer sorts, and what an end of the clip cuts
off, are asked more (`Witnesses`):

====================  ============================================================================
`dissimilarity`       how much further from similar motion the joint is inside than beside it
`beyond_limits`       how far it is from every rotation that the joint has elsewhere
                      (`joint_limits`)
`odd_pose`            how odd its rotations are among the joint's others (`pose_spread`)
`moved`               how far a line from edge to edge would move the joint (logarithm of degrees)
`neighbours_move`     how far similar motion, moved to meet the edges, would
`arm` ... `toe`       1 where the joint is of such a part: a toe says less than a knee
`rate`                how low the clip's rate is; 0 at 120 Hz; and its products with some others
====================  ============================================================================

`scripts/fit_cleaning.py` fits the regressions to clean clips with injected faults. What they say is
weighed once more beside the other hypotheses (see `corroboration`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray, quantile_of
from mocapdb.cleaning.evidence.exchanges import EXCHANGE_EVIDENCE
from mocapdb.cleaning.evidence.excursions import EXCURSION_EVIDENCE
from mocapdb.cleaning.evidence.hypotheses import EVIDENCE, Hypothesis
from mocapdb.cleaning.evidence.jitter import JITTER_EVIDENCE
from mocapdb.cleaning.evidence.joint_limits import RotationLimits
from mocapdb.cleaning.evidence.pose_spread import PoseSpread
from mocapdb.cleaning.evidence.root_jumps import ROOT_EVIDENCE
from mocapdb.cleaning.evidence.similarity_evidence import SIMILARITY_EVIDENCE
from mocapdb.cleaning.evidence.straight_lines import LINE_EVIDENCE
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.neighbours.similarity import Consensus
from mocapdb.cleaning.tuning import (
    BESIDE_S,
    CUT_OFFSET_MODEL,
    DRIFT_MODEL,
    EXCHANGE_MODEL,
    EXCURSION_MODEL,
    FREEZE_MODEL,
    HELD_MODEL,
    JITTER_MODEL,
    LEAST_APART_DEG,
    LEAST_MOVED_DEG,
    MOVED_QUANTILE,
    NOISE_MODEL,
    OFFSET_MODEL,
    REFERENCE_FPS,
    RESTLESS_LOG_ODDS,
    RESTLESS_RATE_LOG_ODDS,
    ROOT_MODEL,
    SIMILARITY_MODEL,
    SLOW_DRIFT_MODEL,
    SOFT_DRIFT_MODEL,
    SOFT_NOISE_MODEL,
    SOFT_OFFSET_MODEL,
    STRAIGHT_LINE_MODEL,
)
from mocapdb.motion.frame_range import FrameRange
from mocapdb.motion.quaternions import (
    angles_deg,
    conjugate,
    from_rotation_vectors_deg,
    multiply,
    rotation_vectors_deg,
    slerp,
)

__all__ = [
    "FEATURES", "MODELS", "Model", "Witnesses", "bridge_deg", "line_across", "log_odds_of",
    "model_of", "probability", "restless_log_odds",
]  # fmt: skip


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
    "slow drift": SLOW_DRIFT_MODEL,
    "held": HELD_MODEL,
    "soft offset": SOFT_OFFSET_MODEL,
    "soft noise": SOFT_NOISE_MODEL,
    "soft drift": SOFT_DRIFT_MODEL,
    "similarity": SIMILARITY_MODEL,
    "excursion": EXCURSION_MODEL,
    "jitter": JITTER_MODEL,
    "straight line": STRAIGHT_LINE_MODEL,
    "exchange": EXCHANGE_MODEL,
    "root": ROOT_MODEL,
}
COMMON = (
    "dissimilarity", "beyond_limits", "odd_pose", "moved", "neighbours_move", "arm", "leg", "hand",
    "toe", "rate", "rate_hand_or_toe", "rate_dissimilarity", "rate_beyond_limits", "rate_odd_pose",
)  # fmt: skip
"""What is asked of every hypothesis: see the module."""
OWN = {
    "similarity": SIMILARITY_EVIDENCE,
    "excursion": EXCURSION_EVIDENCE,
    "jitter": JITTER_EVIDENCE,
    "straight line": LINE_EVIDENCE,
    "exchange": EXCHANGE_EVIDENCE,
    "root": ROOT_EVIDENCE,
}
JUDGED_BY_EDGES = (
    "dissimilarity", "low_rate_dissimilarity", "beyond_limits", "low_rate_beyond_limits"
)  # fmt: skip
OF_JOINT = ("odd_pose", "moved", "neighbours_move", "arm", "leg", "hand", "toe", "root")
FEATURES: dict[str, tuple[str, ...]] = {
    name: (*OWN[name], *COMMON) if name in OWN else (*EVIDENCE, *JUDGED_BY_EDGES)
    for name in ENTRIES
}
FEATURES["cut offset"] += OF_JOINT
FEATURES["slow drift"] = (
    "strength", "size", "simultaneous", "low_rate", "length", "isolation", "moved",
)  # fmt: skip
EDGES_ALONE = {name for name, asked in FEATURES.items() if "moved" not in asked}
"""Models that do not ask how a joint is otherwise."""
MODELS = {
    name: Model(
        entry["constant"], np.array([entry.get(feature, 0.0) for feature in FEATURES[name]])
    )
    for name, entry in ENTRIES.items()
}


def log_odds_of(
    hypothesis: Hypothesis, evidence: Sequence[float], models: Mapping[str, Model] = MODELS
) -> float:
    """Return the log-odds that a hypothesis is a fault, by its own evidence."""
    constant, weights = models[model_of(hypothesis)]
    return constant + float(weights @ np.asarray(evidence))


def probability(log_odds: float) -> float:
    """Return the probability of log-odds."""
    return 1.0 / (1.0 + math.exp(-min(max(log_odds, -50.0), 50.0)))


def restless_log_odds(fps: float) -> float:
    """Return what a hand or a toe takes off the log-odds of a fault, in a clip of some rate."""
    rate = max(0.0, math.log(REFERENCE_FPS / fps))
    return RESTLESS_LOG_ODDS + RESTLESS_RATE_LOG_ODDS * rate


def model_of(hypothesis: Hypothesis) -> str:
    """Return which of `MODELS` judges a hypothesis.

    A flip is a large offset; what showed at a lower rate only has soft edges.
    """
    if hypothesis.cue in OWN:
        return hypothesis.cue
    kind: str = "offset" if hypothesis.kind == "flip" else hypothesis.kind
    kind = {"cut off": "cut offset", "held": "held", "slow drift": "slow drift"}.get(
        hypothesis.cue, kind
    )
    return f"soft {kind}" if hypothesis.halvings else kind


class Witnesses:
    """What all hypotheses about a clip are asked about.

    Parameters
    ----------
    native : Texture
        At the clip's own rate.
    texture : Texture
        As words are cut from it.
    consensus : Consensus or None
        What similar motion shows.
    limits : RotationLimits
    """

    def __init__(
        self, native: Texture, texture: Texture, consensus: Consensus | None, limits: RotationLimits
    ) -> None:
        self.native, self.texture = native, texture
        self.consensus, self.limits = consensus, limits
        self.spread = PoseSpread(texture)
        self._bridges: dict[tuple[int, int, int], float] = {}
        self._moves: dict[tuple[int, int, int], float | None] = {}

    def moves(self, hypothesis: Hypothesis) -> bool:
        """Return whether both a line and similar motion would move the joint as far as is seen.

        Quickly asked, and most hypotheses end here: a fault that its own repair does not move is
        none. A straight line is what a repair makes: it may be right. To ask similar motion about
        it, too, leaves 48 of 127 lines found.
        """
        if hypothesis.cue in ("root", "straight line"):
            return True
        if self._bridge_deg(hypothesis) < LEAST_MOVED_DEG:
            return False
        move = self._neighbours_move_deg(hypothesis)
        return move is None or move >= LEAST_MOVED_DEG

    def _bridge_deg(self, hypothesis: Hypothesis) -> float:
        """Return how far a line across a stretch would move the joint."""
        key = (hypothesis.row, hypothesis.start, hypothesis.end)
        if key not in self._bridges:
            self._bridges[key] = bridge_deg(self.native.quat_xyzw[:, hypothesis.row], hypothesis)
        return self._bridges[key]

    def _neighbours_move_deg(self, hypothesis: Hypothesis) -> float | None:
        """Return how far similar motion would move the joint; None where it does not tell.

        It never tells of the root, which it shows without its heading.
        """
        row, texture = hypothesis.row, self.texture
        if self.consensus is None or self.native.joints[row] == self.native.root:
            return None
        first, last = _texture_frames(hypothesis, self.native.fps, texture)
        key = (row, first, last)
        if key not in self._moves:
            self._moves[key] = neighbours_move_deg(texture, self.consensus, row, first, last)
        return self._moves[key]

    def log_odds(self, hypothesis: Hypothesis) -> float:
        """Return the log-odds that a hypothesis is a fault, by its own evidence."""
        return log_odds_of(hypothesis, self.features(hypothesis))

    def restless_log_odds(self, hypothesis: Hypothesis) -> float:
        """Return what is taken off these for what the joint is."""
        is_restless = self.native.row_roles[hypothesis.row] in ("hand", "toe")
        return restless_log_odds(self.native.fps) if is_restless else 0.0

    def features(self, hypothesis: Hypothesis) -> tuple[float, ...]:
        """Return the evidence on a hypothesis, in the order of its `FEATURES`."""
        row, native = hypothesis.row, self.native
        first, last = _texture_frames(hypothesis, native.fps, self.texture)
        role, name = native.row_roles[row], model_of(hypothesis)
        rate = math.log(REFERENCE_FPS / native.fps)
        said = dict(zip(OWN.get(hypothesis.cue, EVIDENCE), hypothesis.evidence, strict=True))
        said |= {one: float(role == one) for one in ("arm", "leg", "hand", "toe")}
        said |= {"root": float(native.joints[row] == native.root), "rate": rate}
        said["rate_hand_or_toe"] = rate * float(role in ("hand", "toe"))
        about_joint = hypothesis.cue != "root"
        if about_joint and name not in EDGES_ALONE:
            said["odd_pose"] = self.spread.oddness(row, first, last)
            said["moved"] = math.log(self._bridge_deg(hypothesis) + LEAST_APART_DEG)
            move = self._neighbours_move_deg(hypothesis)
            said["neighbours_move"] = (
                said["moved"] if move is None else math.log(move + LEAST_APART_DEG)
            )
        if about_joint:
            most = _size_deg(hypothesis)
            said["beyond_limits"] = self.limits.beyond(row, first, last, most)
            if self.consensus is not None:
                said["dissimilarity"] = _dissimilarity(
                    row, first, last, most, self.texture.fps, self.consensus
                )
        for one in ("dissimilarity", "beyond_limits", "odd_pose"):
            said[f"rate_{one}"] = rate * said.get(one, 0.0)
            said[f"low_rate_{one}"] = said.get("low_rate", 0.0) * said.get(one, 0.0)
        return tuple(said.get(feature, 0.0) for feature in FEATURES[name])


def line_across(quats: FloatArray, stretch: FrameRange) -> FloatArray:
    """Return a spherical line (n, 4) across a stretch of a joint, between the frames beside it.

    At an end of the clip it stays where the one frame beside it is.
    """
    first, last = max(stretch.start - 1, 0), min(stretch.end, len(quats) - 1)
    if stretch.start == 0:
        first = last
    if stretch.end >= len(quats):
        last = first
    share = (np.arange(stretch.start, stretch.end) - first) / max(last - first, 1)
    return slerp(quats[first][None], quats[last][None], np.clip(share, 0.0, 1.0))


def bridge_deg(quats: FloatArray, stretch: FrameRange) -> float:
    """Return how far a joint is from a line across a stretch."""
    line = line_across(quats, stretch)
    return quantile_of(angles_deg(line, quats[stretch.frames]), MOVED_QUANTILE)


def neighbours_move_deg(
    texture: Texture, consensus: Consensus, row: int, first: int, last: int
) -> float | None:
    """Return how far similar motion, moved to meet the edges, is from a joint in frames.

    None where no similar motion is known.
    """
    low, high = max(first - 1, 0), min(last, len(texture) - 1)
    if last <= first or not consensus.known[low : high + 1].all():
        return None
    quats, shown = (
        texture.quat_xyzw[low : high + 1, row],
        consensus.median_quats[low : high + 1, row],
    )
    offsets = rotation_vectors_deg(multiply(conjugate(shown), quats))
    ends = [
        offsets[0] if first > 0 else offsets[-1],
        offsets[-1] if last < len(texture) else offsets[0],
    ]
    share = np.linspace(0.0, 1.0, len(quats))[:, None]
    usual = (1.0 - share) * ends[0] + share * ends[1]
    met = multiply(shown, from_rotation_vectors_deg(usual))
    inside = angles_deg(met, quats)[first - low : last - low]
    return quantile_of(inside, MOVED_QUANTILE)


def _size_deg(hypothesis: Hypothesis) -> float:
    """Return by how much the joint would be wrong, by what gave it away."""
    names = OWN.get(hypothesis.cue, EVIDENCE)
    evidence = dict(zip(names, hypothesis.evidence, strict=True))
    size = math.exp(next(evidence[name] for name in ("size", "jump", "turn") if name in evidence))
    if hypothesis.kind == "freeze" and "missed" in evidence:
        return size + math.expm1(evidence["missed"])
    return size


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
