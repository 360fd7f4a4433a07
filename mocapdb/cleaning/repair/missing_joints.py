"""Filling in joints that were not captured, from similar motion (Aristidou 2018, section 4).

The words of the joints at hand find their neighbours in clips that have all joints, and these show
what the others do. The paper strings whole neighbours together; here every frame takes the median
of all neighbours that cover it, which needs no decision where to change over.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from mocapdb.cleaning.local_rotations import motion_texture
from mocapdb.cleaning.neighbours.nearest_words import Vocabulary, find_neighbours
from mocapdb.cleaning.neighbours.similarity import find_consensus
from mocapdb.cleaning.repair.gaps import smoothed
from mocapdb.cleaning.repair.repair import write_rotations
from mocapdb.cleaning.tuning import DROPPED_JOINTS_OF_GROUP, SMOOTHING_S, SOURCE_FRAMES
from mocapdb.errors import ClipError
from mocapdb.motion.body import understand
from mocapdb.motion.body.canonical_joints import SIDES
from mocapdb.motion.clip import Clip
from mocapdb.motion.quaternions import angles_deg, continuous, slerp

__all__ = ["NINE", "Filling", "fill_joints", "fill_with_misfit", "kept_joints", "nine_joints"]

NINE = ("shoulder", "elbow", "hip", "knee")
"""Of either side; with the neck they are the nine joints of a sparse capture (section 6)."""


def nine_joints(clip: Clip) -> tuple[str, ...]:
    """Return the joints of a sparse capture: neck, and both shoulders, elbows, hips and knees.

    Each by the name of the joint whose rotation turns what begins there, in the skeleton's order;
    none of a body that is no whole human one.

    Examples
    --------
    >>> from mocapdb.corpus import synthetic
    >>> nine_joints(synthetic.make_clip("walk", seed=1))[:2]
    ('lfemur', 'ltibia')
    """
    skeleton = clip.skeleton
    body = understand(skeleton, clip.channels)
    if not body.is_human:
        return ()
    joints = [body.turns.get(f"{side}_{part}") for side in SIDES for part in NINE]
    above = skeleton.chain_to_root(body.turns.get("head", body.joints.value["head"]))
    starts = (
        skeleton.parents if skeleton.convention == "acclaim" else np.arange(len(skeleton.names))
    )
    joints.append(next((joint for joint in above if starts[joint] == body.neck), None))
    turning = set(joints) & set(skeleton.rotating_joints)
    return tuple(name for joint, name in enumerate(skeleton.names) if joint in turning)


class Filling(NamedTuple):
    """A filled clip.

    Attributes
    ----------
    clip : Clip
    misfit_deg : float, degrees
        Mean angle of the known joints to what the similar motion shows of them: how far it is from
        what the clip does.
    """

    clip: Clip
    misfit_deg: float


def kept_joints(clip: Clip) -> tuple[int, ...]:
    """Return the joints that no filling changes: the one that carries the body, and those above.

    Where the body is and which way it faces no similar motion tells.

    Examples
    --------
    >>> from mocapdb.corpus import synthetic
    >>> kept_joints(synthetic.make_clip("walk", seed=1))
    (0,)
    """
    root = understand(clip.skeleton, clip.channels).root.value
    return tuple(clip.skeleton.chain_to_root(root))


def fill_joints(clip: Clip, known: Sequence[str], context: Iterable[Clip] | Vocabulary) -> Clip:
    """Return a clip with all joints, of which only some were captured.

    Parameters
    ----------
    clip : Clip
        What its other joints hold is ignored. The joint that carries the body, and those above it,
        are always kept as they are (see `kept_joints`).
    known : sequence of str
        Names of the joints that were captured.
    context : iterable of Clip, or Vocabulary
        Clips that have all joints, of the same names. A vocabulary, of textures at the rate of the
        clip's own (see `motion_texture`), serves many clips.

    Returns
    -------
    Clip
        The channels of the joints that are kept and of the known ones are those of the clip, bit
        for bit.

    Raises
    ------
    ClipError
        If no known joint besides those kept rotates, all do, or clip or context are shorter than
        a word.
    SkeletonError
        If a name is no joint's, or a context clip has other joints.
    """
    return fill_with_misfit(clip, known, context).clip


def fill_with_misfit(
    clip: Clip, known: Sequence[str], context: Iterable[Clip] | Vocabulary
) -> Filling:
    """Fill a clip, and tell how far similar motion is from its known joints; see `fill_joints`."""
    texture = motion_texture(clip)
    kept = kept_joints(clip)
    at_hand = {clip.skeleton.joint(name) for name in known}
    joints = texture.joints.tolist()
    rows = [row for row, joint in enumerate(joints) if joint in at_hand]
    missing = [row for row, joint in enumerate(joints) if joint not in at_hand.union(kept)]
    if rows and at_hand.isdisjoint(set(joints).difference(kept)):
        raise ClipError(
            f"Expected joints besides the root {clip.skeleton.names[kept[0]]!r} of {clip.name!r}: "
            "which way the body faces does not tell what it does."
        )
    if known and not rows:
        raise ClipError(
            f"Expected joints of {clip.name!r} that rotate, but got "
            f"{', '.join(map(repr, known))}, which cannot."
        )
    if not rows or not missing:
        raise ClipError(
            f"Expected some of the {len(joints)} joints of {clip.name!r} that rotate to be known, "
            f"but got {len(rows)}."
        )
    if len(texture) < SOURCE_FRAMES:
        raise ClipError(
            f"Expected {clip.name!r} to have a word of {SOURCE_FRAMES} frames at "
            f"{texture.fps:g} Hz, but it has {len(texture)}."
        )
    if not isinstance(context, Vocabulary):
        context = Vocabulary.of(motion_texture(other, texture.fps) for other in context)
    neighbours = find_neighbours(texture, context, rows=rows, n_drop=DROPPED_JOINTS_OF_GROUP)
    shown = find_consensus(texture, neighbours).median_quats
    misfit = float(angles_deg(shown[:, rows], texture.quat_xyzw[:, rows]).mean())
    median = shown[:, missing]
    at = np.minimum(np.arange(len(clip)) * texture.fps / clip.fps, len(texture) - 1.0)
    low = at.astype(np.int64)
    high = np.minimum(low + 1, len(texture) - 1)
    quats = continuous(slerp(median[low], median[high], (at - low)[:, None]))
    window = min(2 * round(SMOOTHING_S * clip.fps / 2) + 1, (len(clip) - 1) // 2 * 2 + 1)
    if window > 2:
        quats = smoothed(quats, window)
    channels = clip.channels.copy()
    for column, row in enumerate(missing):
        write_rotations(clip.skeleton, channels, joints[row], 0, quats[:, column])
    step = f"filled {len(missing)} joints from similar motion"
    return Filling(clip.replace(channels=channels, step=step), misfit)
