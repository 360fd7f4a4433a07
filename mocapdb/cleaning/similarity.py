"""What the neighbours say of every joint and frame: the middle of them, their spread, the map.

Every frame lies in up to three words, so up to three times K neighbours show it. All that is said
of a joint here is said at the texture's rate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocapdb._typing import BoolArray, FloatArray
from mocapdb.cleaning.neighbours import SOURCE_FRAMES, Neighbours
from mocapdb.cleaning.texture import Texture, angles_deg, slerp

__all__ = ["Consensus", "find_consensus", "literal_map", "mean_texture", "neighbour_samples"]


@dataclass(frozen=True, eq=False)
class Consensus:
    """The middle of the neighbours and how far they and the clip are from it.

    Attributes
    ----------
    median_quats : (F, K, 4)
        Median of the neighbours' rotations.
    residual_deg : (F, K)
        Angle between the clip and the median. Zero where there is no neighbour.
    spread_deg : (F, K)
        Median angle between the neighbours and their median.
    known : (F,) of bool
        Whether the frame has neighbours.
    """

    median_quats: FloatArray
    residual_deg: FloatArray
    spread_deg: FloatArray
    known: BoolArray


def neighbour_samples(texture: Texture, neighbours: Neighbours) -> list[FloatArray]:
    """Return for each frame the (S, K, 4) rotations that the neighbours show there.

    In the hemisphere of the clip's own rotation.
    """
    quats = neighbours.context_quats
    samples: list[list[FloatArray]] = [[] for _ in range(len(texture))]
    for w, start in enumerate(neighbours.starts.tolist()):
        found = neighbours.targets[w] >= 0
        at = neighbours.frames[w, found]
        low = np.clip(np.floor(at).astype(np.int64), 0, len(quats) - 1)
        high = np.minimum(low + 1, len(quats) - 1)
        shown = slerp(quats[low], quats[high], (at - low)[..., None])
        for i in range(SOURCE_FRAMES):
            samples[start + i].append(shown[:, i])
    joined = []
    for frame, parts in enumerate(samples):
        both = np.concatenate(parts) if parts else np.empty((0, *texture.quat_xyzw.shape[1:]))
        behind = np.sum(both * texture.quat_xyzw[frame], axis=-1) < 0
        joined.append(np.where(behind[..., None], -both, both))
    return joined


def find_consensus(texture: Texture, neighbours: Neighbours) -> Consensus:
    """Return the median of the neighbours and the residuals of a texture."""
    n_frames, n_rows, _ = texture.quat_xyzw.shape
    median = texture.quat_xyzw.copy()
    spread = np.zeros((n_frames, n_rows))
    known = np.zeros(n_frames, dtype=np.bool_)
    for frame, shown in enumerate(neighbour_samples(texture, neighbours)):
        if len(shown) == 0:
            continue
        middle = np.median(shown, axis=0)
        median[frame] = middle / np.linalg.norm(middle, axis=-1, keepdims=True)
        spread[frame] = np.median(angles_deg(median[frame], shown), axis=0)
        known[frame] = True
    residual = angles_deg(median, texture.quat_xyzw)
    return Consensus(median, residual, spread, known)


def mean_texture(texture: Texture, neighbours: Neighbours) -> FloatArray:
    """Return (F, K, 4) the mean of all neighbours' words that cover a frame (section 3.4)."""
    mean = texture.quat_xyzw.copy()
    for frame, shown in enumerate(neighbour_samples(texture, neighbours)):
        if len(shown):
            total = shown.mean(axis=0)
            mean[frame] = total / np.linalg.norm(total, axis=-1, keepdims=True)
    return mean


def literal_map(
    texture: Texture, neighbours: Neighbours, *, row_scale: float = 1.0, floor_deg: float = 0.0
) -> FloatArray:
    """Return the movement digression map as the paper states it (section 3.4).

    Parameters
    ----------
    texture : Texture
    neighbours : Neighbours
    row_scale : float
        What a row is divided by, in row means; 1 in the paper.
    floor_deg : float, degrees
        Least row mean; 0 in the paper, which flags joints that hardly move.

    Returns
    -------
    (F, K)
        ``1 - exp(-M**2)`` of the differences M, each row divided by its mean.
    """
    difference = angles_deg(mean_texture(texture, neighbours), texture.quat_xyzw)
    scale = row_scale * np.maximum(difference.mean(axis=0), floor_deg)
    scaled = np.divide(difference, scale, out=np.zeros_like(difference), where=scale > 0)
    return np.asarray(1.0 - np.exp(-(scaled**2)))
