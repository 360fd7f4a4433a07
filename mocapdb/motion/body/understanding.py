"""Understanding a skeleton from its motion: the one place that decides, which all others ask."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import SkeletonError
from mocapdb.motion.body.anatomy import body_fault, stature
from mocapdb.motion.body.canonical_joints import JOINTS, SIDES, other_side
from mocapdb.motion.body.findings import Body, Finding, Given, NoBodyError
from mocapdb.motion.body.given_joints import beside_given, check_limbs, given_nodes
from mocapdb.motion.body.head import find_head
from mocapdb.motion.body.named_joints import NEEDED, named_nodes
from mocapdb.motion.body.pose_tree import PoseTree, pose_tree, some_frames
from mocapdb.motion.body.position_channels import positions_are_added
from mocapdb.motion.body.shaped_joints import shaped_nodes
from mocapdb.motion.body.sides import are_named_otherwise, facing_left
from mocapdb.motion.body.trunk import add_toes, add_trunk, shoulder_starts
from mocapdb.motion.body.unit_and_up import find_unit, find_up
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.tuning import SAME_PLACE, SURELY_MIRRORED

__all__ = ["understand", "understand_pose"]


def understand(
    skeleton: Skeleton,
    clips: FloatArray | Sequence[FloatArray] = (),
    given: Given | None = None,
) -> Body:
    """Understand a skeleton from its names, its shape and its motion.

    Parameters
    ----------
    skeleton : Skeleton
        Its unit and vertical axis are not asked.
    clips : (F, C) or sequence of (F, C)
        The channels of a clip, or of several clips of the skeleton, which then agree. Without any
        the rest pose is all there is.
    given : Given, optional
        What the user says.

    Returns
    -------
    Body
        Each finding with its evidence and a confidence.

    Raises
    ------
    SkeletonError
        If a joint map, given here or kept by the skeleton, names no joint, names one twice, or
        gives a left one to the right.

    Examples
    --------
    >>> from mocapdb.corpus import synthetic
    >>> clip = synthetic.make_clip("walk", seed=1)
    >>> body = understand(clip.skeleton, clip.channels)
    >>> clip.skeleton.names[body.joints.value["left_knee"]], round(body.unit_m.value, 6)
    ('lfemur', 0.056444)
    """
    clips = [clips] if isinstance(clips, np.ndarray) else list(clips)
    if not clips:
        return _understand(skeleton, skeleton.rest_positions[None], given or Given(), None)
    some = some_frames(clips)
    frames = np.concatenate(some)
    added = positions_are_added(skeleton, frames)
    if added.value != skeleton.adds_offsets:
        skeleton = replace(skeleton, displaces=added.value)
    positions = forward_kinematics(skeleton, frames).positions
    return _understand(skeleton, positions, given or Given(), added, [len(own) for own in some])


def understand_pose(skeleton: Skeleton, positions: FloatArray) -> Body:
    """Understand a skeleton from its names and from where its joints are.

    Parameters
    ----------
    skeleton : Skeleton
    positions : (F, J, 3), skeleton units
        As of `mocapdb.motion.kinematics.forward_kinematics`.

    Returns
    -------
    Body
        What position channels mean is not asked: the positions say it already.
    """
    added = Finding(skeleton.adds_offsets, "positions are known", 1.0)
    return _understand(skeleton, some_frames([positions])[0], Given(), added)


def _understand(
    skeleton: Skeleton,
    positions: FloatArray,
    given: Given,
    added: Finding[bool] | None,
    counts: Sequence[int] = (),
) -> Body:
    """Return what positions (F, J, 3) tell; without `added` they are only those at rest.

    With `counts` they are of several clips, of so many frames each.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # absurd lengths: no body is found
        tree = pose_tree(skeleton, positions)
        rest = tree if added is None else pose_tree(skeleton, skeleton.rest_positions[None])
        found = _find_joints(
            tree, given.joints or skeleton.joint_map, skeleton, is_posed=added is not None
        )
        nodes = found.nodes
        height, what = stature(tree, nodes), "stature by the lengths of limbs"
        clips = np.split(tree.positions, np.cumsum(counts)[:-1]) if counts else [tree.positions]
        up = find_up(tree, clips, rest, nodes)
        if given.up is not None:
            up = Finding(given.up, "given", 1.0, "given")
        is_told = height is not None
        if height is None:
            height, what = _vertical_extent(tree, up.value), "the body's vertical extent"
        unit = find_unit(height, what, is_human=is_told and not found.is_faulty)
        if given.unit_m is not None:
            unit = Finding(given.unit_m, "given", 1.0, "given")

        parts = {name: int(tree.places[nodes[name]]) for name in JOINTS if name in nodes}
        collars = shoulder_starts(tree, nodes) if found.joints.value else {}
        return Body(
            root=_body_root(tree, nodes),
            up=up,
            unit_m=unit,
            adds_positions=added or Finding(skeleton.adds_offsets, "there is no motion", 0.0),
            joints=replace(found.joints, value=parts if found.joints.value else {}),
            parts={} if found.is_faulty else parts,
            by=found.by,
            neck=int(tree.places[nodes["neck"]]) if found.joints.value else None,
            collars={name: int(tree.places[node]) for name, node in collars.items()},
            turns={name: nodes[name] for name in parts if nodes[name] < skeleton.n_joints},
            height_m=height * unit.value,
            is_mirrored=found.is_mirrored,
        )


@dataclass(frozen=True)
class _Found:
    """The nodes that were found of a body, and whether they are a whole one without a fault."""

    nodes: dict[str, int]
    joints: Finding[Mapping[str, int]]
    by: Literal["names", "shape"]
    is_faulty: bool = False
    is_mirrored: bool = False


def _find_joints(
    tree: PoseTree, given: Mapping[str, str], skeleton: Skeleton, *, is_posed: bool
) -> _Found:
    """Return what was found of a body, and whether it is a whole one."""
    nodes, neck = named_nodes(tree)
    said = given_nodes(tree, given, skeleton)
    nodes |= said
    told = dict(nodes)
    missing = [joint for joint in (*NEEDED, "head") if joint not in nodes]
    by: Literal["names", "shape"] = "names" if set(missing) <= {"head"} else "shape"
    try:
        if by == "shape":
            nodes = beside_given(tree, nodes | shaped_nodes(tree), said)
            neck = None
        if "head" not in nodes:
            _add_head(tree, nodes)
        add_toes(tree, nodes)
        add_trunk(tree, nodes, neck)
    except NoBodyError as problem:
        add_toes(tree, told)
        reason = f"no whole human body by its {by}: {problem}"
        if 0 < len(missing) < len(NEEDED) + 1:
            reason += f" (its names have no {_listed(missing)})"
        return _Found(told, Finding({}, reason, 0.9), by)
    check_limbs(tree, nodes, said)
    fault = body_fault(tree, nodes, is_posed=is_posed)
    if fault:
        reason = f"no whole human body by its {by}: {fault}"
        return _Found(nodes, Finding({}, reason, 0.9), by, is_faulty=True)
    source: Literal["given", "found"] = "given" if len(said) >= len(NEEDED) else "found"
    evidence = f"joints by {by}" + (", some given" if said and source == "found" else "")
    confidence = 0.95 if by == "names" else 0.8
    facing = facing_left(tree, nodes) if is_posed else 0.0
    if facing < SURELY_MIRRORED and said.keys() >= {"left_hip", "right_hip"}:
        raise SkeletonError(
            "Expected the joints of the left leg on the left, but the joint map makes feet and "
            f"knees point backwards (by {-facing:.2f} of 1). Exchange left and right."
        )
    if facing < SURELY_MIRRORED and not said:
        nodes = {other_side(name): node for name, node in nodes.items()}
        facing = -facing
    is_mirrored = not said and are_named_otherwise(tree, nodes)
    if is_mirrored:
        evidence += ", but left and right exchanged as feet and knees point"
    if facing < 0:
        confidence -= 0.3
        evidence += "; its feet point as if left were right"
    return _Found(nodes, Finding(nodes, evidence, confidence, source), by, is_mirrored=is_mirrored)


def _add_head(tree: PoseTree, nodes: dict[str, int]) -> None:
    height = stature(tree, nodes)
    head = find_head(tree, nodes, height) if height else None
    if head is None:
        raise NoBodyError("it has no head beyond its arms")
    nodes["head"] = head


def _listed(missing: list[str]) -> str:
    """Return the missing joints, both sides of a pair as one."""
    words = {joint.partition("_")[2] or joint for joint in missing}
    return " or ".join(sorted(words))


def _body_root(tree: PoseTree, nodes: Mapping[str, int]) -> Finding[int]:
    """Return the joint that carries the body.

    For a human it is the joint where both legs and the spine meet, or a joint above it that is in
    the same place and moves. For any other skeleton it is the first joint that moves, turns its
    child, or has more than one child.
    """
    if {"left_hip", "right_hip", "head"} <= set(nodes):
        root = tree.meeting(*(nodes[f"{side}_hip"] for side in SIDES), nodes["head"])
    else:
        root = _below_still_joints(tree)
    top = root
    for above in tree.way_up(root)[1:]:
        if tree.distance(above, root) > SAME_PLACE * tree.extent:
            break
        if np.ptp(tree.positions[:, above], axis=0).max() > 0 or len(tree.positions) == 1:
            top = above
    joint = int(top)
    if joint == 0:
        return Finding(0, "the first joint carries the body", 0.95)
    still = np.ptp(tree.positions[:, 0], axis=0).max() == 0
    why = "stands still" if still else "only carries the scene"
    return Finding(joint, f"{tree.names[0]!r} {why}; {tree.names[joint]!r} carries the body", 0.9)


def _below_still_joints(tree: PoseTree) -> int:
    """Return the first node that belongs to the body, where no human body was found.

    A node that stands still, with one child, only carries the scene; unless the child moves at
    the same distance from it all the time, since then the node turns it.
    """
    root = 0
    while len(tree.children[root]) == 1 and np.ptp(tree.positions[:, root], axis=0).max() == 0:
        child = tree.children[root][0]
        is_still = np.ptp(tree.positions[:, child], axis=0).max() == 0
        away = np.linalg.norm(tree.positions[:, child] - tree.positions[:, root], axis=1)
        if not is_still and np.ptp(away) <= SAME_PLACE * tree.extent:
            return root
        root = child
    return root if tree.children[root] and len(tree.positions) > 1 else 0


def _vertical_extent(tree: PoseTree, up: str) -> float:
    extents = np.ptp(tree.positions, axis=1)[:, "xyz".index(up)]
    return float(np.median(extents))
