"""The joints that a user gives, checked against the skeleton and against what a body is."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from itertools import pairwise, product

from mocapdb.errors import SkeletonError
from mocapdb.motion.body.canonical_joints import CHAINS, JOINTS, SIDES, other_side
from mocapdb.motion.body.joint_names import parse_name
from mocapdb.motion.body.pose_tree import PoseTree
from mocapdb.motion.skeleton import Skeleton

__all__ = ["beside_given", "check_canonical_names", "check_limbs", "given_nodes"]


def check_canonical_names(names: Iterable[str]) -> None:
    """Refuse names that no canonical joint has.

    Raises
    ------
    SkeletonError
        For the first of them, with the nearest names.
    """
    for name in names:
        if name not in JOINTS:
            close = get_close_matches(name.lower().replace(" ", "_"), JOINTS, n=3)
            near = f"Did you mean {' or '.join(close)}? " if close else ""
            raise SkeletonError(
                f"Expected a joint map to give canonical joints, but {name!r} is none. "
                f"{near}They are: {', '.join(JOINTS)}."
            )


def given_nodes(tree: PoseTree, given: Mapping[str, str], skeleton: Skeleton) -> dict[str, int]:
    """Return the nodes of a given joint map.

    Raises
    ------
    SkeletonError
        If it has a name that is no canonical joint's, names no joint of the skeleton, names one
        twice, or gives a joint that is named after one side to the other.
    """
    check_canonical_names(given)
    places = {name: node for node, name in enumerate(tree.names) if name}
    joint_of: dict[str, str] = {}
    for joint, name in given.items():
        if name not in places:
            raise SkeletonError(_no_such_joint(joint, name, list(places), skeleton))
        if name in joint_of:
            raise SkeletonError(
                f"Expected each joint once in a joint map, but {name!r} is both "
                f"{joint_of[name]} and {joint}."
            )
        joint_of[name] = joint
        side = joint.partition("_")[0]
        named_side = parse_name(name).side
        if side in SIDES and named_side and named_side != side:
            raise SkeletonError(
                f"Expected a joint of the {side} side as {joint}, but got {name!r}."
            )
    return {joint: places[name] for joint, name in given.items()}


def beside_given(
    tree: PoseTree, found: Mapping[str, int], said: Mapping[str, int]
) -> dict[str, int]:
    """Return joints that were found and joints that were given, which win.

    A joint that was found where another one is given is left out.

    Raises
    ------
    SkeletonError
        If a given joint is found to be the same one of the other side, which is not given.
    """
    for joint, node in said.items():
        across = other_side(joint)
        if across != joint and across not in said and found.get(across) == node:
            side, other = (name.partition("_")[0] for name in (joint, across))
            raise SkeletonError(
                f"Expected a joint of the {side} side as {joint}, but {_name(tree, node)} is on "
                f"the {other} side by where feet and knees point. If that is wrong, give the "
                f"joint of the {other} side too."
            )
    given = set(said.values())
    rest = {joint: node for joint, node in found.items() if node not in given}
    return rest | dict(said)


def check_limbs(tree: PoseTree, nodes: Mapping[str, int], given: Iterable[str]) -> None:
    """Refuse a joint map that puts a joint of one limb on another.

    Parameters
    ----------
    tree : PoseTree
    nodes : mapping of str to int
        All joints of the body, the given ones among them.
    given : iterable of str
        The canonical joints that were given.

    Raises
    ------
    SkeletonError
        If a given joint does not hang below the joint before it along its limb, or its limb's
        next joint not below it.
    """
    said = set(given)
    for side, chain in product(SIDES, CHAINS):
        for above, below in pairwise(f"{side}_{part}" for part in chain):
            pair = {above, below}
            if not pair & said or not pair <= nodes.keys():
                continue
            if nodes[above] == nodes[below]:
                raise SkeletonError(
                    f"Expected {below} below {above}, but with the joint map both are "
                    f"{_name(tree, nodes[below])}. In an ASF a bone is where it starts."
                )
            if not tree.is_above(nodes[above], nodes[below]):
                raise SkeletonError(
                    f"Expected {below} below {above}, but with the joint map they are "
                    f"{_name(tree, nodes[below])} and {_name(tree, nodes[above])}"
                    f"{_crossed(tree, nodes, above, below)}. Give the joint of that side, or all "
                    "joints of the limb."
                )


def _crossed(tree: PoseTree, nodes: Mapping[str, int], above: str, below: str) -> str:
    """Say whether a joint hangs on the other side's limb."""
    across = other_side(above)
    if across in nodes and tree.is_above(nodes[across], nodes[below]):
        side, other = below.partition("_")[0], across.partition("_")[0]
        return f", which is on the {other} side, not the {side}"
    return ""


def _name(tree: PoseTree, node: int) -> str:
    return repr(tree.names[node] or "the end of a bone")


def _no_such_joint(joint: str, name: str, names: list[str], skeleton: Skeleton) -> str:
    lower = {each.lower(): each for each in names}
    close = [lower[each] for each in get_close_matches(name.lower(), lower, n=3)]
    near = f"Did you mean {' or '.join(close)}?" if close else f"It has: {', '.join(names)}."
    return (
        f"Expected a joint of skeleton {skeleton.name!r} as {joint}, but it has no {name!r}. {near}"
    )
