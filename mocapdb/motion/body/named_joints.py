"""Finding a body's joints by their names."""

from __future__ import annotations

from mocapdb.motion.body.canonical_joints import CHAINS, SIDES
from mocapdb.motion.body.joint_names import JointName, parse_name, rank
from mocapdb.motion.body.pose_tree import PoseTree

__all__ = ["NEEDED", "named_nodes"]

NEEDED = tuple(f"{side}_{part}" for side in SIDES for chain in CHAINS for part in chain[:3])
"""The limbs' joints that a body must have."""


def named_nodes(tree: PoseTree) -> tuple[dict[str, int], int | None]:
    """Return the nodes of the canonical joints that have a name known to the table, and the neck.

    Along a limb each joint is below the one before it. The head is the node so called, or else
    the last one of the neck.
    """
    names = [
        JointName("", "", 0) if _is_link(tree, node) else parse_name(name)
        for node, name in enumerate(tree.names)
    ]
    nodes: dict[str, int] = {}
    for side in SIDES:
        for chain in CHAINS:
            _add_chain(tree, names, side, chain, nodes)
    middle = [node for node, name in enumerate(names) if not name.side and name.word]
    necks = _best("neck", middle, names)
    heads = _best("head", middle, names)
    neck = necks[0] if necks else None
    if heads:
        nodes["head"] = heads[0]
    elif neck is not None:
        nodes["head"] = _end_of_neck(tree, names, neck)
    return nodes, neck


def _is_link(tree: PoseTree, node: int) -> bool:
    """Return whether a node only leads to a child, as the bone ``X_base`` that an AMC needs to X.

    See `mocapdb.io.conventions.to_acclaim_convention`.
    """
    name = tree.names[node]
    return any(name == f"{tree.names[child]}_base" for child in tree.children[node])


def _add_chain(
    tree: PoseTree,
    names: list[JointName],
    side: str,
    chain: tuple[str, ...],
    nodes: dict[str, int],
) -> None:
    """Add the joints of one limb, from its middle one outwards: that has the clearest names."""
    own = [node for node, name in enumerate(names) if name.side == side and name.word]
    start, middle, *ends = chain
    found = _best(middle, own, names)
    # "Leg" is the knee beside a thigh or a hip, and "Arm" the shoulder beside a forearm
    if not found:
        return
    at = found[0]
    above = [node for node in tree.way_up(at)[1:] if node in own]
    starts = _best(start, above[::-1], names)
    if starts:
        nodes[f"{side}_{start}"] = starts[0]
        nodes[f"{side}_{middle}"] = at
    else:
        return
    for part in ends:
        below = [node for node in own if node != at and tree.is_above(at, node)]
        found = _best(part, below, names)
        if found:
            at = found[0]
            nodes[f"{side}_{part}"] = at


def _best(part: str, among: list[int], names: list[JointName]) -> list[int]:
    """Return the nodes whose words are the best ones for a part, the first of a chain first."""
    ranked = [(rank(part, names[node].word), node) for node in among]
    known = [(place, node) for place, node in ranked if place is not None]
    if not known:
        return []
    best = min(place for place, _ in known)
    return sorted(
        (node for place, node in known if place == best),
        key=lambda node: (names[node].number, node),
    )


def _end_of_neck(tree: PoseTree, names: list[JointName], neck: int) -> int:
    """Return the last joint of a neck that is continued by others of the same name, or its end."""
    at = neck
    while True:
        below = [node for node in tree.children[at] if not names[node].side]
        more = [node for node in below if rank("neck", names[node].word) is not None]
        if more:
            at = more[0]
        elif at == neck and below:
            return below[0]
        else:
            return at
