"""From the limbs and the head to the trunk: hips, spine, chest, neck, and where bones turn."""

from __future__ import annotations

from collections.abc import Mapping

from mocapdb.motion.body.canonical_joints import SIDES
from mocapdb.motion.body.joint_names import parse_name, rank
from mocapdb.motion.body.pose_tree import PoseTree
from mocapdb.motion.tuning import SAME_PLACE

__all__ = ["add_toes", "add_trunk", "shoulder_starts"]


def add_trunk(tree: PoseTree, nodes: dict[str, int], neck: int | None) -> None:
    """Add hips, spine, chest and neck to the nodes of hips and head.

    The hips are where both legs and the spine meet. Of the nodes between them and the neck the
    first is the spine and the last the chest; where there is only one it is the spine, and where
    there is none both are the base of the neck.
    """
    thighs = [nodes[f"{side}_hip"] for side in SIDES]
    arms = [nodes[f"{side}_shoulder"] for side in SIDES if f"{side}_shoulder" in nodes]
    head = nodes["head"]
    hips = tree.meeting(*thighs, head)
    chest = tree.meeting(head, *arms) if arms else hips
    if not tree.is_above(hips, chest):
        chest = hips
    way = tree.way_down(hips, head)
    if neck is None or neck not in way or neck == head:
        after = [node for node in way[way.index(chest) + 1 :] if node != head]
        neck = after[0] if after else (chest if chest != hips else head)
    way = way[: way.index(neck) + 1]
    between = _apart(tree, way)
    nodes["hips"] = _named_hips(tree, hips, tree.meeting(*thighs))
    nodes["spine"] = between[0] if between else neck
    nodes["chest"] = (between[-2] if len(between) > 2 else between[-1]) if between else neck
    if len(between) == 2 and rank("chest", parse_name(tree.names[between[0]]).word) is not None:
        nodes["chest"] = between[0]
    nodes["neck"] = neck


def add_toes(tree: PoseTree, nodes: dict[str, int]) -> None:
    """Add the toes: the first node beyond an ankle that is in another place, End Sites too."""
    for side in SIDES:
        ankle = nodes.get(f"{side}_ankle")
        if ankle is None:
            continue
        toe = nodes.get(f"{side}_toe")
        if toe is not None and tree.distance(ankle, toe) > 0:
            continue
        below = _ways_below(tree, ankle)
        apart = [node for node in below if tree.distance(ankle, node) > 0]
        if apart:
            nodes[f"{side}_toe"] = apart[0]
        elif toe is None and below:
            nodes[f"{side}_toe"] = below[0]


def shoulder_starts(tree: PoseTree, nodes: Mapping[str, int]) -> dict[str, int]:
    """Return for each shoulder the node that its collarbone starts in.

    That is the first one above it in another place, unless it sits as low as the hips: then the
    base of the neck.
    """
    near = SAME_PLACE * tree.extent
    starts = {}
    for side in SIDES:
        shoulder = nodes[f"{side}_shoulder"]
        above = tree.way_up(shoulder)[1:]
        apart = [node for node in above if tree.distance(node, shoulder) > near]
        start = apart[0] if apart else nodes["neck"]
        if tree.distance(start, nodes["hips"]) <= near:
            start = nodes["neck"]
        starts[f"{side}_shoulder"] = start
    return starts


def _apart(tree: PoseTree, way: list[int]) -> list[int]:
    """Return the nodes of a way that are in another place than the one kept before them."""
    kept = way[:1]
    for node in way[1:]:
        if tree.distance(node, kept[-1]) > SAME_PLACE * tree.extent:
            kept.append(node)
    return kept[1:]


def _named_hips(tree: PoseTree, hips: int, legs: int) -> int:
    """Return the first node between the body's root and the legs that is called hips, if any."""
    for node in tree.way_down(hips, legs):
        if rank("hips", parse_name(tree.names[node]).word) is not None:
            return node
    return hips


def _ways_below(tree: PoseTree, node: int) -> list[int]:
    """Return the nodes below one, level by level."""
    found = list(tree.children[node])
    for below in found:
        found.extend(tree.children[below])
    return found
