"""A motion on another armature: bone by bone, by what bones are of the body. In the worker: no bpy.

Every bone of the target points where its bone of the source points, whatever both do at rest. The
root goes as far as its legs are long.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from mocapdb.errors import SkeletonError
from mocapdb.motion.body import understand_pose
from mocapdb.motion.body.joint_names import parse_name

from .clips import clip_of
from .motions import FloatArray, Motion

__all__ = ["map_bones", "on_armature"]

LEAST_SHARE = 0.5  # of the source's bones that have to be found in the target
SAME_DEG = 0.5  # rest directions that differ by less are the same


def map_bones(source: Motion, target: Motion) -> dict[int, int]:
    """Return for each bone of the target, where there is one, the bone of the source.

    By name, without regard to case and prefixes; then by what a name says, such as a left knee;
    then by what joints are of a human body.

    Raises
    ------
    SkeletonError
        If less than half of the source's bones are found.
    """
    ways = [_plain_names, _said_names, _body_parts]
    found: dict[int, int] = {}
    for way in ways:
        of_source = {key: bone for bone, key in way(source).items()}
        for bone, key in way(target).items():
            if key in of_source and bone not in found and of_source[key] not in found.values():
                found[bone] = of_source[key]
        if len(found) >= LEAST_SHARE * len(source.names):
            return found
    missing = [name for i, name in enumerate(source.names) if i not in found.values()]
    raise SkeletonError(
        f"Expected an armature with the bones of {source.name!r}, but only {len(found)} of its "
        f"{len(source.names)} are there. It has none for: {', '.join(missing[:8])}. "
        "Import it as a new armature."
    )


def on_armature(source: Motion, target: Motion) -> Motion:
    """Return the motion of a source on the bones of a target; bones without a partner rest.

    Parameters
    ----------
    source : Motion
    target : Motion
        Of one frame: the armature at rest.

    Raises
    ------
    SkeletonError
        If the armature has other bones.
    """
    found = map_bones(source, target)
    facing = _facing(source, target, found)
    scale = _size(target, list(found)) / _size(source, list(found.values()))
    n_frames, n_bones = len(source), len(target.names)
    rotations = np.empty((n_frames, n_bones, 3, 3))
    positions = np.empty((n_frames, n_bones, 3))
    for bone in range(n_bones):
        parent = int(target.parents[bone])
        above = rotations[:, parent] if parent >= 0 else np.broadcast_to(facing, (n_frames, 3, 3))
        if bone in found:
            own = found[bone]
            to = source.tails[own] - source.heads[own]
            of = facing @ (target.tails[bone] - target.heads[bone])
            rotations[:, bone] = source.rotations[:, own] @ _turn(of, to) @ facing
        else:
            rotations[:, bone] = above
        if parent >= 0:
            offset = target.heads[bone] - target.heads[parent]
            positions[:, bone] = positions[:, parent] + rotations[:, parent] @ offset
        elif bone in found:
            positions[:, bone] = scale * source.positions[:, found[bone]]
        else:
            positions[:, bone] = target.heads[bone]
    return replace(
        target, positions=positions, rotations=rotations, fps=source.fps, name=source.name
    )


def _plain_names(motion: Motion) -> dict[int, str]:
    plain = [re.sub(r"[^a-z0-9]", "", name.split(":")[-1].lower()) for name in motion.names]
    return {bone: name for bone, name in enumerate(plain) if plain.count(name) == 1}


def _said_names(motion: Motion) -> dict[int, str]:
    said = [parse_name(name) for name in motion.names]
    keys = [f"{name.side} {name.word} {name.number}" if name.word else "" for name in said]
    return {bone: key for bone, key in enumerate(keys) if key and keys.count(key) == 1}


def _body_parts(motion: Motion) -> dict[int, str]:
    clip = clip_of(motion)
    body = understand_pose(clip.skeleton, clip.positions("m", "z"))
    names = clip.skeleton.names
    return {
        motion.names.index(names[joint]): part
        for part, joint in body.joints.value.items()
        if names[joint] in motion.names
    }


def _facing(source: Motion, target: Motion, found: dict[int, int]) -> FloatArray:
    """Return the turn about the vertical that brings the target at rest to face as the source does.

    Fitted to all heads at rest, level, so that it needs no legs nor arms.
    """
    bones, partners = list(found), list(found.values())
    a = target.heads[bones, :2] - target.heads[bones, :2].mean(axis=0)
    b = source.heads[partners, :2] - source.heads[partners, :2].mean(axis=0)
    cosine = float((a * b).sum())
    sine = float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())
    angle = np.arctan2(sine, cosine)
    if abs(np.rad2deg(angle)) < SAME_DEG:
        return np.eye(3)
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _size(motion: Motion, bones: list[int]) -> float:
    """Return how large the body is by some bones: the sum of their distances from their parents."""
    child = np.array([bone for bone in bones if motion.parents[bone] >= 0], dtype=int)
    lengths = np.linalg.norm(motion.heads[child] - motion.heads[motion.parents[child]], axis=1)
    return max(float(lengths.sum()), 1e-9)


def _turn(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the least rotation from the direction of `a` to that of `b`."""
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    cosine = float(a @ b)
    if cosine > np.cos(np.deg2rad(SAME_DEG)):
        return np.eye(3)
    if cosine < -1.0 + 1e-9:
        across = np.eye(3)[np.argmin(np.abs(a))]
        across = across - (across @ a) * a
        across /= np.linalg.norm(across)
        return np.asarray(2.0 * np.outer(across, across) - np.eye(3), dtype=np.float64)
    x, y, z = np.cross(a, b)
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + skew + skew @ skew / (1.0 + cosine))
