"""A body as capsules in the browser's scene: a cylinder for each bone, a ball at each of its ends.

All cylinders are one batch of instances, all balls another: a frame is five small arrays, whatever
the body.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mocapdb.base.arrays import ByteArray, FloatArray, IntArray
from mocapdb.scenes.stage import Actor

__all__ = ["ShownBody", "rotations_from_up"]

ROUND = 14  # segments round a capsule
STRETCHING_M = 0.003  # a body whose bones change by more is scaled anew in every frame
GAMMA = 1.9  # viser takes the colours of a batch as linear light


class ShownBody:
    """An actor in a browser's scene.

    Parameters
    ----------
    scene : viser.SceneApi
    name : str
        In the scene's tree.
    actor : Actor
    most_error_mm : float
        What is drawn as the darkest colour, where the actor has an error.
    """

    def __init__(self, scene: Any, name: str, actor: Actor, most_error_mm: float) -> None:
        self._actor = actor
        self._most = most_error_mm
        body = actor.body
        self._ends = np.stack([body.tails, body.heads], axis=1)
        lengths = np.linalg.norm(
            actor.positions[:, body.heads] - actor.positions[:, body.tails], axis=-1
        )
        self._stretches = float(np.ptp(lengths, axis=0).max()) > STRETCHING_M
        radii = body.radii_m
        self._scales = np.stack([radii, lengths.mean(axis=0), radii], axis=1)
        colours = self._colours(0)
        n_bones = len(body)
        still = np.tile([1.0, 0.0, 0.0, 0.0], (n_bones, 1))
        self._bones = scene.add_batched_meshes_simple(
            f"{name}/bones", *_cylinder(), still, np.zeros((n_bones, 3)),
            batched_scales=self._scales, batched_colors=colours, lod="off",
        )  # fmt: skip
        self._balls = scene.add_batched_meshes_simple(
            f"{name}/balls", *_ball(), np.repeat(still, 2, axis=0), np.zeros((2 * n_bones, 3)),
            batched_scales=np.repeat(radii, 2), batched_colors=np.repeat(colours, 2, axis=0),
            lod="off",
        )  # fmt: skip

    def draw(self, frame: int, origin: FloatArray) -> None:
        """Show a frame, seen from an origin (3,) in metres; beyond the last, the last."""
        frame = min(frame, len(self._actor) - 1)
        ends = self._actor.positions[frame][self._ends] - origin  # (B, 2, 3)
        way = ends[:, 1] - ends[:, 0]
        self._bones.batched_positions = ends.mean(axis=1).astype(np.float32)
        self._bones.batched_wxyzs = rotations_from_up(way).astype(np.float32)
        self._balls.batched_positions = ends.reshape(-1, 3).astype(np.float32)
        if self._stretches:
            self._scales[:, 1] = np.linalg.norm(way, axis=1)
            self._bones.batched_scales = self._scales.astype(np.float32)
        if self._actor.error_mm is not None:
            colours = self._colours(frame)
            self._bones.batched_colors = colours
            self._balls.batched_colors = np.repeat(colours, 2, axis=0)

    def _colours(self, frame: int) -> ByteArray:
        linear = (self._actor.colours(frame, self._most) / 255) ** GAMMA
        return np.asarray((255 * linear).round().astype(np.uint8))

    def remove(self) -> None:
        """Take the body off the scene."""
        self._bones.remove()
        self._balls.remove()


def rotations_from_up(ways: FloatArray) -> FloatArray:
    """Return (N, 4) wxyz, the shortest turns that bring +y along vectors (N, 3); none for zero."""
    length = np.linalg.norm(ways, axis=1, keepdims=True)
    unit = np.where(length > 0, ways / np.maximum(length, 1e-300), [0.0, 1.0, 0.0])
    x, y, z = unit.T
    quats = np.stack([1.0 + y, z, np.zeros_like(x), -x], axis=1)
    size = np.linalg.norm(quats, axis=1, keepdims=True)
    return np.where(size > 1e-6, quats / np.maximum(size, 1e-6), [0.0, 1.0, 0.0, 0.0])


def _cylinder() -> tuple[FloatArray, IntArray]:
    """Return an open cylinder of radius 1 and height 1 about the y axis."""
    angle = 2 * np.pi * np.arange(ROUND) / ROUND
    ring = np.stack([np.cos(angle), np.zeros(ROUND), np.sin(angle)], axis=1)
    half = np.array([0.0, 0.5, 0.0])
    vertices = np.concatenate([ring - half, ring + half])
    here, there = np.arange(ROUND), (np.arange(ROUND) + 1) % ROUND
    faces = np.concatenate(
        [
            np.stack([here, here + ROUND, there], axis=1),
            np.stack([there, here + ROUND, there + ROUND], axis=1),
        ]
    )
    return vertices, faces


def _ball() -> tuple[FloatArray, IntArray]:
    """Return a ball of radius 1."""
    rows = ROUND // 2
    polar = np.pi * np.arange(rows + 1) / rows
    angle = 2 * np.pi * np.arange(ROUND) / ROUND
    vertices = np.stack(
        [
            np.outer(np.sin(polar), np.cos(angle)),
            np.repeat(np.cos(polar)[:, None], ROUND, axis=1),
            np.outer(np.sin(polar), np.sin(angle)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rows), np.arange(ROUND), indexing="ij")
    a, b = (ROUND * i + j).ravel(), (ROUND * i + (j + 1) % ROUND).ravel()
    faces = np.concatenate(
        [np.stack([a, b, a + ROUND], axis=1), np.stack([b, b + ROUND, a + ROUND], axis=1)]
    )
    return vertices, faces
