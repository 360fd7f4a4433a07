"""A skeleton as a tree of bones' starts, posed over some frames.

In BVH a joint sits where its bones start, in Acclaim where its own bone ends. Here every node is a
joint seen as the start of its bones, as in BVH; an Acclaim bone without children has one more node
where it ends. So names and shapes mean the same in both conventions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray, IntArray
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.tuning import POSED_FRAMES, POSED_FRAMES_OF_EACH, SAME_PLACE

__all__ = ["PoseTree", "pose_tree", "some_frames"]


@dataclass(frozen=True, eq=False)
class PoseTree:
    """Nodes, where they are over some frames, and how they hang together.

    Attributes
    ----------
    parents : (N,)
        Index of each node's parent, -1 for the root; parents come before their children.
    names : tuple of str
        The joint that a node was made of; empty for the end of an Acclaim bone.
    places : (N,)
        The joint of the skeleton that is where the node is.
    is_end : (N,)
        Whether a node only marks where a bone ends: it has no channels and no children.
    positions : (F, N, 3), skeleton units
    """

    parents: IntArray
    names: tuple[str, ...]
    places: IntArray
    is_end: BoolArray
    positions: FloatArray
    children: tuple[tuple[int, ...], ...]
    _distances: dict[tuple[int, int], float] = field(default_factory=dict, repr=False)

    @property
    def n_nodes(self) -> int:
        """Number of nodes N."""
        return len(self.parents)

    @cached_property
    def lengths(self) -> FloatArray:
        """(N,) the median distance of each node from its parent, 0 for the root."""
        above = np.maximum(self.parents, 0)
        away = self.positions - self.positions[:, above]
        return np.asarray(np.median(np.sqrt((away * away).sum(axis=2)), axis=0))

    @cached_property
    def depths(self) -> FloatArray:
        """(N,) length of the way from the root to each node."""
        depths = self.lengths.copy()
        for node, parent in enumerate(self.parents[1:], start=1):
            depths[node] += depths[parent]
        return depths

    @cached_property
    def extent(self) -> float:
        """Length of the longest way between two nodes: 1.3 to 1.6 times a human's stature."""
        reach = np.zeros(self.n_nodes)
        longest = 0.0
        for node in range(self.n_nodes - 1, 0, -1):
            parent, below = self.parents[node], reach[node] + self.lengths[node]
            longest = max(longest, reach[parent] + below)
            reach[parent] = max(reach[parent], below)
        return float(longest)

    def way_up(self, node: int) -> list[int]:
        """Return the nodes from one up to the root, both included."""
        way = [node]
        while self.parents[way[-1]] >= 0:
            way.append(int(self.parents[way[-1]]))
        return way

    def way_down(self, start: int, node: int) -> list[int]:
        """Return the nodes from one down to one below it, both included."""
        way = self.way_up(node)
        return way[: way.index(start) + 1][::-1]

    def is_above(self, above: int, node: int) -> bool:
        """Return whether a node is an ancestor of another, or that one itself."""
        return above in self.way_up(node)

    def meeting(self, *nodes: int) -> int:
        """Return the last node that the ways from the root to some nodes share."""
        ways = [self.way_up(node)[::-1] for node in nodes]
        shared = 0
        for together in zip(*ways, strict=False):
            if len(set(together)) > 1:
                break
            shared = together[0]
        return int(shared)

    def leaves_below(self, node: int) -> list[int]:
        """Return the ends of the branches below a node; itself where it is an end."""
        below, leaves = [node], []
        for at in below:
            below.extend(self.children[at])
            if not self.children[at]:
                leaves.append(at)
        return leaves

    def places_apart(self, way: list[int]) -> list[int]:
        """Return one node for each place along a way: the one that turns what comes after it."""
        kept = way[:1]
        for node in way[1:]:
            if self.distance(node, kept[-1]) > SAME_PLACE * self.extent:
                kept.append(node)
            elif len(kept) > 1 and self.lengths[node] == 0 and not self.is_end[node]:
                kept[-1] = node
        return kept

    def distance(self, a: int, b: int) -> float:
        """Return the median distance of two nodes."""
        pair = (a, b) if a < b else (b, a)
        if pair not in self._distances:
            away = self.positions[:, a] - self.positions[:, b]
            squares = np.sort(np.einsum("fi,fi->f", away, away))
            self._distances[pair] = math.sqrt(float(squares[len(squares) // 2]))
        return self._distances[pair]


def some_frames(clips: Sequence[FloatArray]) -> list[FloatArray]:
    """Return frames (F, ...) spread over each of some clips: 48 of one, 12 of each of many."""
    clips = clips[:: -(-len(clips) // (POSED_FRAMES // 2))] if clips else clips
    each = max(POSED_FRAMES_OF_EACH, POSED_FRAMES // max(1, len(clips)))
    return [channels[:: -(-len(channels) // each)] for channels in clips]


def pose_tree(skeleton: Skeleton, positions: FloatArray) -> PoseTree:
    """Return a skeleton's nodes where its joints are, positions (F, J, 3) in skeleton units."""
    parents = skeleton.parents
    places = np.arange(skeleton.n_joints)
    names = skeleton.names
    is_leaf = np.array([not below for below in skeleton.children])
    no_channels = np.array([not dofs for dofs in skeleton.dofs])
    is_end = is_leaf & no_channels
    if skeleton.convention == "acclaim":
        leaves = np.flatnonzero(is_leaf)
        places = np.concatenate([np.maximum(parents, 0), leaves])
        parents = np.concatenate([parents, leaves])
        names = (*names, *[""] * len(leaves))
        is_end = np.arange(len(parents)) >= skeleton.n_joints
    below: list[list[int]] = [[] for _ in parents]
    for node, parent in enumerate(parents[1:].tolist(), start=1):
        below[parent].append(node)
    return PoseTree(
        parents=parents,
        names=names,
        places=places,
        is_end=is_end,
        positions=np.ascontiguousarray(positions[:, places]),
        children=tuple(map(tuple, below)),
    )
