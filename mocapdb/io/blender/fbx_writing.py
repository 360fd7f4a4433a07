"""A clip as FBX, which Blender exports: a skeleton and its motion, without a body.

The file has the clip's own unit and vertical axis. Each joint is a bone that starts in it, an End
Site too; a bone's length says nothing.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.base.files import replacing
from mocapdb.errors import FormatError
from mocapdb.io.blender.process import BlenderError, shared_blender
from mocapdb.io.blender.program import find_blender
from mocapdb.io.conventions import to_bvh_convention
from mocapdb.io.posed_clips import STILL_M
from mocapdb.io.tuning import BLENDER_S, BLENDER_S_PER_MB
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.skeleton import Skeleton

__all__ = ["write_fbx"]

SHORTEST_M = 1e-3  # of a bone: Blender removes those that have no length
BYTES_PER_KEY = 100  # about what Blender has to go through for one bone in one frame


def write_fbx(clip: Clip, path: StrPath, *, blender: StrPath | None = None) -> Clip:
    """Write a clip as binary FBX by way of Blender; the file appears whole or not at all.

    Parameters
    ----------
    clip : Clip
    path : path-like
    blender : path-like, optional
        See `find_blender`.

    Returns
    -------
    Clip
        As it was written, in BVH's convention.

    Raises
    ------
    FormatError
        If there is no Blender, or it cannot write the file.
    """
    process = shared_blender(find_blender(path, blender))
    clip = to_bvh_convention(clip)
    skeleton = clip.skeleton
    pose = forward_kinematics(skeleton, clip.channels)
    stands = skeleton.rest_positions + skeleton.offsets[0]  # with the height of the root
    turns, shifts = _local(skeleton, stands, pose.positions, pose.rotations)
    shifting = [
        joint
        for joint in range(skeleton.n_joints)
        if joint == 0 or np.abs(shifts[:, joint]).max() * skeleton.metres_per_unit > STILL_M
    ]
    heads, tails = _bones(skeleton, stands)
    try:
        arrays = process.folder / "write.npz"
        np.savez(arrays, heads=heads, tails=tails, quat_wxyz=turns, shifts=shifts[:, shifting])
        with replacing(Path(path)) as (partial,):
            exported = process.folder / "written.fbx"
            answer = process.ask(
                {
                    "do": "write",
                    "arrays": str(arrays),
                    "path": str(exported),
                    "name": clip.name or "clip",
                    "names": list(skeleton.names),
                    "parents": skeleton.parents.tolist(),
                    "shifting": shifting,
                    "fps": clip.fps,
                    "unit_m": skeleton.metres_per_unit,
                    "up": skeleton.up,
                },
                BLENDER_S + BLENDER_S_PER_MB * BYTES_PER_KEY * turns[..., 0].size / 1e6,
            )
            partial.write_bytes(exported.read_bytes())
    except (BlenderError, FileNotFoundError) as problem:
        raise FormatError(path, str(problem)) from None
    renamed = [f"{old!r} is called {new!r}" for old, new in answer["renamed"]]
    steps = (f"joints renamed by Blender: {', '.join(renamed)}",) if renamed else ()
    return replace(clip, provenance=(*clip.provenance, *steps))


def _local(
    skeleton: Skeleton, stands: FloatArray, positions: FloatArray, rotations: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return turns against parents, (F, J, 4) wxyz, and shifts from the rest pose, (F, J, 3).

    Both are in the axes of the skeleton as the parent has turned them, in which rest poses are.
    """
    from scipy.spatial.transform import Rotation

    turns, shifts = rotations.copy(), positions - stands
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            back = np.swapaxes(rotations[:, parent], 1, 2)
            turns[:, joint] = back @ rotations[:, joint]
            away = positions[:, joint] - positions[:, parent]
            bone = stands[joint] - stands[parent]
            shifts[:, joint] = np.einsum("fij,fj->fi", back, away) - bone
    quat_xyzw = Rotation.from_matrix(turns.reshape(-1, 3, 3)).as_quat().reshape(*turns.shape[:2], 4)
    agree = np.einsum("fji,fji->fj", quat_xyzw[1:], quat_xyzw[:-1]) >= 0
    signs = np.concatenate([np.ones((1, turns.shape[1])), np.where(agree, 1.0, -1.0)]).cumprod(
        axis=0
    )
    return (quat_xyzw * signs[..., None])[..., [3, 0, 1, 2]], shifts


def _bones(skeleton: Skeleton, heads: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return where bones start and end in the rest pose, (J, 3): towards a child's joint."""
    shortest = SHORTEST_M / skeleton.metres_per_unit
    tails = np.empty_like(heads)
    for joint, children in enumerate(skeleton.children):
        ways = [heads[child] - heads[joint] for child in children]
        if joint:
            ways.append(heads[joint] - heads[skeleton.parents[joint]])
        upright = np.array([0.0, 1.0, 0.0] if skeleton.up == "y" else [0.0, 0.0, 1.0])
        way = next((way for way in ways if np.linalg.norm(way) > shortest), 10 * shortest * upright)
        tails[joint] = heads[joint] + way
    return heads, tails
