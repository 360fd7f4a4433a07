"""Archives of plain arrays, as `npz` has them and as anyone makes them with ``numpy.savez``.

====================  ==========================================================================
``quaternions``       (F, J, 4) xyzw, each in the frame of its parent; identity at rest
``names``             (J,) str
``parents``           (J,) int, -1 for the root; parents before their children
``fps``               frames a second
``offsets``           (J, 3) metres, Y up: bones of the rest pose, from their parents
``root``              (F, 3) metres, Y up: where the root is; or ``positions`` (F, J, 3), of which
                      the root's are taken
``convention``        ``bvh``, the default: a joint turns the bones that start in it; ``acclaim``:
                      the bone that ends in it
====================  ==========================================================================

So an NPZ of mocapdb can be changed in numpy and read again: leave ``header`` out.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.errors import ClipError, FormatError, SkeletonError
from mocapdb.io.posed_clips import clip_of_pose, world_positions, world_rotations
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import Pose
from mocapdb.motion.skeleton import Convention

__all__ = ["clip_of_arrays"]

NEEDED = ("quaternions", "names", "parents", "offsets")


def clip_of_arrays(path: StrPath, arrays: Mapping[str, Any], *, fps: float | None = None) -> Clip:
    """Return the clip of an archive's arrays.

    Parameters
    ----------
    path : path-like
        Where they are from.
    arrays : mapping of str to array
    fps : float, optional, frames per second
        Overrides the archive's.

    Raises
    ------
    FormatError
        If an array is missing, or they do not fit together.
    """
    missing = [name for name in NEEDED if name not in arrays]
    if fps is None and "fps" not in arrays:
        missing.append("fps")
    if not {"root", "positions"} & set(arrays):
        missing.append("root or positions")
    if missing:
        raise FormatError(
            path,
            f"Expected the arrays of a motion, but the archive has no {', no '.join(missing)}.",
        )
    try:
        with np.errstate(all="ignore"):  # absurd numbers are told by the clip
            return _clip(path, arrays, fps)
    except (ValueError, TypeError, IndexError) as problem:
        raise FormatError(path, f"Expected the arrays of a motion, but got {problem!r}.") from None
    except (ClipError, SkeletonError) as problem:
        raise FormatError(path, str(problem)) from None


def _clip(path: StrPath, arrays: Mapping[str, Any], fps: float | None) -> Clip:
    names = [str(name) for name in np.asarray(arrays["names"]).tolist()]
    parents = np.asarray(arrays["parents"], dtype=np.int64).tolist()
    n_joints = len(names)
    quats = np.asarray(arrays["quaternions"], dtype=np.float64)
    if quats.ndim != 3 or quats.shape[1:] != (n_joints, 4) or len(parents) != n_joints:
        raise FormatError(
            path,
            f"Expected quaternions (frames, {n_joints}, 4) and {n_joints} parents for {n_joints} "
            f"names, but got {quats.shape} and {len(parents)}.",
        )
    lengths = np.linalg.norm(quats, axis=-1)
    if not (np.isfinite(lengths) & (lengths > 0)).all():
        frame, joint = np.argwhere(~(np.isfinite(lengths) & (lengths > 0)))[0]
        raise FormatError(
            path, f"Expected a quaternion in frame {frame} for {names[joint]!r}, but got none."
        )
    said = str(arrays["convention"]) if "convention" in arrays else "bvh"
    if said not in get_args(Convention):
        raise FormatError(path, f"Expected convention 'bvh' or 'acclaim', but got {said!r}.")
    convention = cast(Convention, said)
    root = arrays["root"] if "root" in arrays else arrays["positions"][:, 0]
    root = np.asarray(root, dtype=np.float64).reshape(len(quats), 3)
    offsets = np.asarray(arrays["offsets"], dtype=np.float64).reshape(n_joints, 3)
    rest = np.zeros_like(offsets)
    for joint, parent in enumerate(parents):
        if not -1 <= parent < max(joint, 0) or (parent == -1) != (joint == 0):
            raise FormatError(
                path, f"Expected the parent of {names[joint]!r} before it, but got {parent}."
            )
        rest[joint] = rest[parent] + offsets[joint] if joint else 0.0
    world = world_rotations(parents, _matrices(quats / lengths[..., None]))
    bones = np.where(np.arange(n_joints)[:, None] > 0, offsets, 0.0)
    positions = world_positions(parents, bones, root, world, convention)
    rate = float(np.asarray(arrays["fps"]).reshape(())) if fps is None else fps
    return clip_of_pose(
        names,
        parents,
        rest,
        Pose(positions, world),
        rate,
        convention,
        name=Path(path).stem,
        source=str(path),
        fps_source="file" if fps is None else "caller",
        provenance=("read from plain arrays",),
    )


def _matrices(quats: FloatArray) -> FloatArray:
    from scipy.spatial.transform import Rotation

    flat = Rotation.from_quat(quats.reshape(-1, 4)).as_matrix()
    return np.asarray(flat.reshape(*quats.shape[:2], 3, 3))
