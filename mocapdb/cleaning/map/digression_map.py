"""The movement digression map: how sure each joint is wrong in each frame, and what is flagged.

Our detector makes it (`detector`), or the paper's rule as printed (`literal_map`, section 3.4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.cleaning.evidence.fault_shapes import Kind
from mocapdb.cleaning.evidence.similarity_evidence import kind_of_turns
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.neighbours.nearest_words import Neighbours
from mocapdb.cleaning.neighbours.similarity import Consensus, find_consensus, mean_texture
from mocapdb.cleaning.tuning import LITERAL_THRESHOLD
from mocapdb.errors import ClipError
from mocapdb.motion.clip import Clip
from mocapdb.motion.frame_range import FrameRange, ranges_where
from mocapdb.motion.quaternions import conjugate, multiply, rotation_vectors_deg
from mocapdb.motion.skeleton import Skeleton

__all__ = ["MovementDigressionMap", "Span", "literal_map", "shifted"]


@dataclass(frozen=True)
class Span(FrameRange):
    """A stretch of a joint that was flagged.

    Attributes
    ----------
    start, end : int
        Frames ``start:end``.
    joint : int
        Index in the skeleton.
    confidence : float
        Probability that it is a fault; of the literal map, its largest score.
    kind : str
        ``"offset"``, ``"flip"``, ``"noise"``, ``"freeze"``, ``"drift"``, ``"filled"`` (by a
        straight line), ``"exchange"`` (of left and right) or ``"pop"`` (the joint's translation has
        jumped away); of the joint that turns a foot ``"slide"`` (the foot slides where it stands)
        or ``"sink"`` (it goes through the floor): what it looks like.
    """

    joint: int
    confidence: float
    kind: Kind


def shifted(spans: Sequence[Span], frames: int) -> tuple[Span, ...]:
    """Return spans so many frames later."""
    return tuple(replace(s, start=s.start + frames, end=s.end + frames) for s in spans)


@dataclass(frozen=True, eq=False)
class MovementDigressionMap:
    """How sure each joint of a clip is wrong in each frame.

    Attributes
    ----------
    skeleton : Skeleton
    fps : float, frames per second
    scores : (F, J)
        In [0, 1]: the confidence of the likeliest hypothesis that covers a joint's frame, flagged
        or not; of the literal map, the paper's scores.
    spans : tuple of Span
        What reaches the threshold, by start.
    threshold : float
    consensus : Consensus or None
        What the neighbours say, at the texture's rate; None where the context has no words.
    texture : Texture
        The texture that they were found for.
    searched : FrameRange, optional
        The frames that were searched, of which consensus and texture are; None means all. Those
        beside them were cut on to the motion (see `clip_ends`).
    """

    skeleton: Skeleton
    fps: float
    scores: FloatArray
    spans: tuple[Span, ...]
    threshold: float
    consensus: Consensus | None
    texture: Texture
    searched: FrameRange | None = None

    @property
    def cut_off(self) -> tuple[FrameRange, ...]:
        """The ranges of frames, at the ends of the clip, that were not searched."""
        if self.searched is None:
            return ()
        ends = FrameRange(0, self.searched.start), FrameRange(self.searched.end, len(self.scores))
        return tuple(each for each in ends if len(each))

    @property
    def mask(self) -> BoolArray:
        """(F, J) whether a joint's frame is flagged."""
        flagged = np.zeros(self.scores.shape, dtype=np.bool_)
        for span in self.spans:
            flagged[span.frames, span.joint] = True
        return flagged


def literal_map(
    clip: Clip,
    texture: Texture,
    neighbours: Neighbours,
    *,
    threshold: float = LITERAL_THRESHOLD,
    row_scale: float = 1.0,
    floor_deg: float = 0.0,
) -> MovementDigressionMap:
    """Return the map as the paper states it (section 3.4): ``1 - exp(-M**2)``.

    M is the angle between a joint and the mean of its neighbours, each joint's divided by its mean
    over the clip.

    Parameters
    ----------
    clip : Clip
    texture : Texture
        Of the clip, as `motion_texture` makes it.
    neighbours : Neighbours
        Of the texture's words.
    threshold : float
        Score over which a joint's frame is flagged; 0.5 in the paper, which flags nearly every
        word.
    row_scale : float
        What a joint's angles are divided by, in means; 1 in the paper.
    floor_deg : float, degrees
        Least mean; 0 in the paper, which flags joints that hardly move.

    Raises
    ------
    ClipError
        If threshold or scale make no sense.
    """
    if not (0.0 < threshold <= 1.0 and row_scale > 0.0 and floor_deg >= 0.0):
        raise ClipError(
            "Expected a threshold in (0, 1], a row_scale over 0 and a floor_deg of at least 0, "
            f"but got {threshold}, {row_scale} and {floor_deg}."
        )
    mean = mean_texture(texture, neighbours)
    turns = rotation_vectors_deg(multiply(conjugate(mean), texture.quat_xyzw))
    angles = np.linalg.norm(turns, axis=-1)
    scale = row_scale * np.maximum(angles.mean(axis=0), floor_deg)
    scaled = np.divide(angles, scale, out=np.zeros_like(angles), where=scale > 0)
    at = np.arange(len(clip)) * texture.fps / clip.fps
    shown = np.minimum((at + 1e-9).astype(np.int64), len(texture) - 1)
    scores = np.zeros((len(clip), clip.skeleton.n_joints))
    scores[:, texture.joints] = (1.0 - np.exp(-(scaled**2)))[shown]
    spans = []
    for row, joint in enumerate(texture.joints.tolist()):
        for run in ranges_where(scores[:, joint] > threshold):
            sure = float(scores[run.frames, joint].max())
            kind = kind_of_turns(turns[shown[run.start] : shown[run.end - 1] + 1, row])
            spans.append(Span(run.start, run.end, joint, sure, kind))
    spans.sort(key=lambda span: (span.start, span.joint))
    return MovementDigressionMap(
        clip.skeleton, clip.fps, scores, tuple(spans), threshold,
        find_consensus(texture, neighbours), texture,
    )  # fmt: skip
