"""The kit of faults: every kind that captures have, as recipes that can be put into any clip.

`faults` turns one joint by a chosen angle. Captures fail in more ways: several joints at once, left
and right exchanged, gaps that a program filled by a straight line, jitter that was smoothed, a root
that jumps. A recipe names one of them, with its size and its length.

=================  =============================================================================
`offset`           turned by one angle, with hard or eased edges
`drift and snap`   turned more and more, then right at once
`drift`            turned more and more, and less and less again
`jitter`           turned by low-passed noise
`noise`, `flip`    as in `faults`
`freeze`           held where it was
`straight line`    filled by a straight line, in channels or on the sphere
`exchange`         a limb takes the rotations of the opposite one
`root jump`        the whole body is elsewhere
`yaw drift`        the whole body turns slowly about the vertical, and snaps back
`foot slide`       a foot that rests is drawn aside, level, and back, by its hip, knee and ankle
`foot sink`        the same, down through the floor
=================  =============================================================================
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.corpus.synthetic.faults import Fault, Injection
from mocapdb.corpus.tuning import FAULT_JITTER_S, LEAST_FAULT_DEG, PLACE_TRIES, REST_EDGE_S
from mocapdb.errors import ClipError
from mocapdb.motion.body import understand
from mocapdb.motion.body.joint_names import across_by_names
from mocapdb.motion.clip import Clip
from mocapdb.motion.foot_contacts import find_contacts, find_legs, runs
from mocapdb.motion.ik import reach
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.quaternions import (
    angles_deg,
    from_euler_deg,
    from_rotation_vectors_deg,
    multiply,
    slerp,
)
from mocapdb.motion.rotations import extract_angles
from mocapdb.motion.skeleton import Skeleton

__all__ = ["IN_METRES", "RECIPES", "Recipe", "inject_recipe"]

How: TypeAlias = Literal[
    "offset", "drift and snap", "drift", "jitter", "noise", "flip", "freeze", "straight line",
    "exchange", "root jump", "yaw drift", "foot slide", "foot sink",
]  # fmt: skip
Where: TypeAlias = Literal["one joint", "several joints", "chain", "root", "foot"]
IN_METRES: tuple[How, ...] = ("root jump", "foot slide", "foot sink")


class Recipe(NamedTuple):
    """A kind of fault.

    Attributes
    ----------
    name : str
    how : str
        What happens: see the module.
    size : (float, float)
        Range of its size, in degrees; of a root jump and of feet in metres.
    length_s : (float, float), seconds
        Range of its length.
    ease_s : (float, float), seconds
        Range of how long it eases in, and out.
    where : {"one joint", "several joints", "chain", "root", "foot"}
        A chain is a joint with those below it, up to four; several are three to five, anywhere; a
        foot is the joint that turns it, while it rests.
    frames : (int, int), optional
        Range of its length in frames instead.
    """

    name: str
    how: How
    size: tuple[float, float] = (20.0, 90.0)
    length_s: tuple[float, float] = (0.15, 1.0)
    ease_s: tuple[float, float] = (0.0, 0.0)
    where: Where = "one joint"
    frames: tuple[int, int] | None = None


RECIPES: tuple[Recipe, ...] = (
    Recipe("offset 10", "offset", (10, 10)),
    Recipe("offset 20", "offset", (20, 20)),
    Recipe("offset 45 to 90", "offset", (45, 90)),
    Recipe("eased offset 45 and 90", "offset", (45, 90), (0.3, 1.2), (0.1, 0.5)),
    Recipe("several joints 20", "offset", (20, 20), where="several joints"),
    Recipe("several joints 45 to 90", "offset", (45, 90), where="several joints"),
    Recipe("chain", "offset", (20, 90), where="chain"),
    Recipe("left and right exchanged", "exchange", (0, 0), where="chain"),
    Recipe("straight line", "straight line", (0, 0), (0.1, 1.0), where="chain"),
    Recipe("drift and snap 20", "drift and snap", (20, 20), (0.3, 1.5)),
    Recipe("drift and snap 45", "drift and snap", (45, 45), (0.3, 1.5)),
    Recipe("drift and return", "drift", (20, 90), (0.5, 2.0)),
    Recipe("jitter 20", "jitter", (20, 20), (0.3, 1.0)),
    Recipe("jitter 45", "jitter", (45, 45), (0.3, 1.0)),
    Recipe("spike, 1 frame", "offset", (20, 90), frames=(1, 1)),
    Recipe("spike, 2 frames", "offset", (20, 90), frames=(2, 2)),
    Recipe("pop by 180", "offset", (180, 180), frames=(1, 3)),
    Recipe("flip", "flip", (180, 180)),
    Recipe("noise", "noise"),
    Recipe("limb frozen", "freeze", (0, 0), where="chain"),
    Recipe("root jump", "root jump", (0.05, 0.5), (0.0, 0.5), where="root"),
    Recipe("yaw drift", "yaw drift", (20, 60), (2.0, 5.0), where="root"),
    Recipe("foot slide", "foot slide", (0.04, 0.12), (0.3, 1.0), (0.1, 0.2), where="foot"),
    Recipe("foot through the floor", "foot sink", (0.04, 0.12), (0.2, 0.8), (0.05, 0.2), "foot"),
)


def inject_recipe(
    clip: Clip, recipe: Recipe, *, seed: int, n: int = 1, joints: Sequence[int] | None = None
) -> Injection:
    """Return a clip with faults of one kind at random places, and where they are.

    Parameters
    ----------
    clip : Clip
    recipe : Recipe
    seed : int
    n : int
        How many; those of one joint do not touch, and of feet there is at most one for each rest.
        One that moves several joints is a fault of each.
    joints : sequence of int, optional
        Joints to choose from; by default all that rotate, except the root.

    Returns
    -------
    Injection
        Faults that turned out below `LEAST_FAULT_DEG` (what is frozen or exchanged may hardly
        differ) are in the mask and not among the faults. Straight lines always count.

    Raises
    ------
    ClipError
        If there is no room for the faults.

    Examples
    --------
    >>> from mocapdb.corpus import synthetic
    >>> clip = synthetic.make_clip("walk", seed=1)
    >>> [len(inject_recipe(clip, r, seed=1).faults) for r in RECIPES if r.name == "pop by 180"]
    [1]
    """
    rng = np.random.default_rng(seed)
    skeleton = clip.skeleton
    candidates = [j for j in skeleton.rotating_joints if j > 0] if joints is None else list(joints)
    root = understand(skeleton, clip.channels).root.value
    channels = clip.channels.copy()
    if recipe.where == "foot":
        return _inject_foot_faults(rng, clip, recipe, n, seed)
    mask = np.zeros((len(clip), skeleton.n_joints), dtype=np.bool_)
    faults: list[Fault] = []
    for _ in range(n):
        for _ in range(PLACE_TRIES):
            if recipe.frames:
                length = int(rng.integers(recipe.frames[0], recipe.frames[1] + 1))
            else:
                length = max(1, round(rng.uniform(*recipe.length_s) * clip.fps))
            if recipe.how == "straight line":
                length = max(length, 5)
            if length + 2 > len(clip):
                continue
            start = int(rng.integers(1, len(clip) - length))
            chosen = _chosen(rng, skeleton, recipe, candidates, root)
            if chosen and not mask[start - 1 : start + length + 1, chosen].any():
                break
        else:
            raise ClipError(
                f"Expected room for {n} faults of the kind {recipe.name!r}, but found none in the "
                f"{len(clip)} frames of {clip.name!r}. Ask for fewer."
            )
        span = slice(start, start + length)
        sizes = _change(rng, clip, channels, recipe, chosen, span)
        mask[span, chosen] = True
        faults += [
            Fault(joint, start, start + length, recipe.how, size)
            for joint, size in zip(chosen, sizes, strict=True)
            if recipe.how in ("straight line", *IN_METRES) or size >= LEAST_FAULT_DEG
        ]
    faults.sort(key=lambda fault: (fault.start, fault.joint))
    step = f"{n} injected faults: {recipe.name}, seed {seed}"
    return Injection(clip.replace(channels=channels, step=step), mask, tuple(faults))


def _inject_foot_faults(
    rng: np.random.Generator, clip: Clip, recipe: Recipe, n: int, seed: int
) -> Injection:
    """Return a clip whose feet are drawn from where they rest; see `inject_recipe`."""
    skeleton = clip.skeleton
    positions = forward_kinematics(skeleton, clip.channels).positions
    legs = find_legs(skeleton, positions)
    contacts = find_contacts(skeleton, positions, clip.fps)
    metres = understand(skeleton, clip.channels).unit_m.value
    rests = [(leg, r) for leg, down in zip(legs, contacts.T, strict=True) for r in runs(down)]
    least = max(4, round(recipe.length_s[0] * clip.fps))
    edge = max(1, round(REST_EDGE_S * clip.fps))  # a foot that has come to rest
    rests = [(leg, rest[edge:-edge]) for leg, rest in rests if len(rest) >= least + 2 * edge]
    if not rests:
        raise ClipError(
            f"Expected a foot that rests for {recipe.length_s[0]:g} s in {clip.name!r}, but none "
            "does. Choose another kind of fault."
        )
    channels = clip.channels.copy()
    mask = np.zeros((len(clip), skeleton.n_joints), dtype=np.bool_)
    faults = []
    for place in rng.choice(len(rests), min(n, len(rests)), replace=False).tolist():
        leg, rest = rests[place]
        length = min(len(rest), max(least, round(rng.uniform(*recipe.length_s) * clip.fps)))
        first = int(rest[0]) + int(rng.integers(0, len(rest) - length + 1))
        size = float(rng.uniform(*recipe.size))
        aim = -np.eye(3)[skeleton.up_index]
        if recipe.how == "foot slide":
            level = [axis for axis in range(3) if axis != skeleton.up_index]
            angle = rng.uniform(0.0, 2.0 * np.pi)
            aim = np.zeros(3)
            aim[level] = np.cos(angle), np.sin(angle)
        moved = _eased(rng, recipe, length, clip.fps)[:, None] * aim * size / metres
        frames = np.arange(first, first + length)
        goals = {joint: positions[frames, joint] + moved for joint in {leg.ankle, leg.ball}}
        turning = list(dict.fromkeys((leg.upper, leg.lower, leg.foot)))
        channels[frames] = reach(skeleton, channels[frames], goals, turning)
        there = forward_kinematics(skeleton, channels[frames]).positions[:, leg.ball]
        size = float(np.linalg.norm(there - positions[frames, leg.ball], axis=1).max()) * metres
        mask[first : first + length, turning] = True
        if size >= recipe.size[0] / 2.0:  # a leg that is stretched goes no further
            faults.append(Fault(leg.foot, first, first + length, recipe.how, size))
    faults.sort(key=lambda fault: (fault.start, fault.joint))
    step = f"{n} injected faults: {recipe.name}, seed {seed}"
    return Injection(clip.replace(channels=channels, step=step), mask, tuple(faults))


def _eased(rng: np.random.Generator, recipe: Recipe, length: int, fps: float) -> FloatArray:
    """Return (length,) how a fault swells and fades, from 0 to 1."""
    ease = max(1.0, min(rng.uniform(*recipe.ease_s) * fps, length / 2))
    to_edge = np.minimum(np.arange(1, length + 1), np.arange(length, 0, -1))
    s = np.clip(to_edge / ease, 0.0, 1.0)
    return np.asarray(s * s * (3.0 - 2.0 * s))


def _chosen(
    rng: np.random.Generator, skeleton: Skeleton, recipe: Recipe, candidates: list[int], root: int
) -> list[int]:
    """Return the joints of one fault."""
    if recipe.where == "root":
        return [root]
    across = across_by_names(skeleton.names)
    paired = [j for j in candidates if across[j] != j and across[j] in candidates]
    first = int(rng.choice(paired if recipe.how == "exchange" and paired else candidates))
    if recipe.where == "one joint":
        return [first]
    if recipe.where == "several joints":
        n = min(int(rng.integers(3, 6)), len(candidates))
        return sorted(int(j) for j in rng.choice(candidates, n, replace=False))
    chain = [j for j in candidates if first in skeleton.chain_to_root(j)][:4]
    if recipe.how == "exchange":
        chain = [j for j in chain if j in paired]
        return sorted({*chain, *(int(across[j]) for j in chain)})
    return chain


def _change(
    rng: np.random.Generator,
    clip: Clip,
    channels: FloatArray,
    recipe: Recipe,
    chosen: list[int],
    span: slice,
) -> list[float]:
    """Change channels in place and return the largest angle by which each joint is wrong."""
    skeleton, length = clip.skeleton, span.stop - span.start
    if recipe.how == "root jump":
        columns = _positions(skeleton, chosen[0])
        aim = rng.standard_normal(len(columns))
        size = rng.uniform(*recipe.size)
        metres = understand(skeleton, clip.channels).unit_m.value
        channels[span, columns] += aim / np.linalg.norm(aim) * size / metres
        return [size]
    in_channels, mirrored = rng.random() < 0.5, rng.random() < 0.5
    across = across_by_names(skeleton.names)
    sizes = []
    for joint in chosen:
        columns, order = skeleton.rotation_columns(joint), skeleton.rotation_orders[joint]
        before, after = clip.channels[span.start - 1, columns], clip.channels[span.stop, columns]
        share = (np.arange(1, length + 1) / (length + 1))[:, None]
        right = from_euler_deg(order, clip.channels[span, columns])
        if recipe.how == "freeze":
            channels[span, columns] = before
        elif recipe.how == "exchange":
            other = clip.channels[span, skeleton.rotation_columns(int(across[joint]))]
            signs = [1.0 if axis == "X" or not mirrored else -1.0 for axis in order]
            if other.shape[1] == len(columns):
                channels[span, columns] = other * signs
        elif recipe.how == "straight line":
            if in_channels or len(order) < 3:
                channels[span, columns] = before + share * (after - before)
            else:
                ends = from_euler_deg(order, np.stack([before, after]))
                line = slerp(ends[:1], ends[1:], share[:, 0])
                channels[span, columns] = _angles_near(order, line, channels[span, columns])
        else:
            turns = _turns_deg(rng, recipe, length, clip.fps)
            if len(order) < 3:
                amounts = np.linalg.norm(turns, axis=1) * np.sign(turns[:, 0])
                channels[span, columns[0]] += amounts
            elif recipe.how == "yaw drift":
                amounts = np.linalg.norm(turns, axis=1) * np.sign(turns[:, 0])
                turn = from_rotation_vectors_deg(amounts[:, None] * np.eye(3)[skeleton.up_index])
                wrong = multiply(turn, right)
                channels[span, columns] = _angles_near(order, wrong, channels[span, columns])
            else:
                wrong = multiply(right, from_rotation_vectors_deg(turns))
                channels[span, columns] = _angles_near(order, wrong, channels[span, columns])
        wrong = from_euler_deg(order, channels[span, columns])
        sizes.append(float(angles_deg(right, wrong).max()))
    return sizes


def _turns_deg(rng: np.random.Generator, recipe: Recipe, length: int, fps: float) -> FloatArray:
    """Return (length, 3) rotation vectors by which a joint is wrong."""
    from scipy.ndimage import gaussian_filter1d

    size = rng.uniform(*recipe.size)
    axis = rng.standard_normal(3)
    axis /= np.linalg.norm(axis)
    if recipe.how in ("noise", "jitter"):
        random = rng.standard_normal((length, 3))
        if recipe.how == "jitter":
            random = gaussian_filter1d(random, FAULT_JITTER_S * fps, axis=0)
        return np.asarray(random * size / np.linalg.norm(random, axis=1).max())
    ramp = np.arange(1, length + 1) / length
    if recipe.how in ("drift and snap", "yaw drift"):
        return np.asarray(size * ramp[:, None] * axis)
    if recipe.how == "drift":
        return np.asarray(size * (1.0 - np.abs(2.0 * ramp - 1.0))[:, None] * axis)
    turns = np.full(length, size)
    if recipe.ease_s[1] > 0:
        turns *= _eased(rng, recipe, length, fps)
    return np.asarray(turns[:, None] * axis)


def _angles_near(order: str, quats: FloatArray, near_deg: FloatArray) -> FloatArray:
    """Return the angles of rotations, in the form and the turn that is nearest to others."""
    from scipy.spatial.transform import Rotation

    angles = np.rad2deg(extract_angles(order, Rotation.from_quat(quats).as_matrix()))
    other = np.stack([angles[:, 0] + 180.0, 180.0 - angles[:, 1], angles[:, 2] + 180.0], axis=1)
    apart = (np.stack([angles, other]) - near_deg + 180.0) % 360.0 - 180.0
    nearest = np.abs(apart).sum(axis=2).argmin(axis=0)
    return np.asarray(near_deg + apart[nearest, np.arange(len(angles))])


def _positions(skeleton: Skeleton, joint: int) -> list[int]:
    """Return the columns of a joint's translation."""
    start = int(skeleton.channel_starts[joint])
    return [start + i for i, dof in enumerate(skeleton.dofs[joint]) if dof.startswith("t")]
