"""AMASS and other motions of SMPL's bodies, as NPZ (Mahmood et al. 2019).

============================  ==================================================================
``poses``                     (F, 3 J) rotation vectors in radians, local; or in parts
                              ``root_orient``, ``pose_body``, ``pose_jaw``, ``pose_eye``,
                              ``pose_hand``
``trans``                     (F, 3) metres, to which the pelvis at rest is added
``betas``, ``gender``         the shape of the body
``mocap_framerate``           frames a second; also ``mocap_frame_rate``, ``fps``
============================  ==================================================================

The world of AMASS is Z up while its bodies rest Y up. A clip that is read is Y up in both: its
root, and nothing else, is turned. Rotations are the file's; the bones are those of the body model
that is named, else of a generic adult (`smpl_bodies`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.base.files import replacing
from mocapdb.errors import FormatError
from mocapdb.io.npz import BROKEN, UNREADABLE, opened_archive
from mocapdb.io.posed_clips import (
    clip_of_pose,
    local_rotations,
    world_positions,
    world_rotations,
)
from mocapdb.io.smpl_bodies import (
    BODY,
    BODY_MODELS,
    BodyModelName,
    SmplBody,
    generic_body,
    joints_of,
    read_body_model,
)
from mocapdb.motion.clip import Clip
from mocapdb.motion.joint_tracks import Z_TO_Y
from mocapdb.motion.kinematics import Pose

__all__ = ["clip_of_smpl", "write_smpl"]

RATES = ("mocap_framerate", "mocap_frame_rate", "mocap_fps", "fps", "frame_rate", "framerate")
PARTS: dict[BodyModelName, tuple[str, ...]] = {
    "smplx": ("root_orient", "pose_body", "pose_jaw", "pose_eye", "pose_hand"),
    "smplh": ("root_orient", "pose_body", "pose_hand"),
}
N_BETAS = 16


def clip_of_smpl(
    path: StrPath,
    arrays: Mapping[str, Any],
    *,
    fps: float | None = None,
    body_model: StrPath | None = None,
    up: str | None = None,
) -> Clip:
    """Return the clip of an archive's arrays.

    Parameters
    ----------
    path : path-like
        Where they are from.
    arrays : mapping of str to array
    fps : float, optional, frames per second
        Overrides the file's.
    body_model : path-like, optional
        The body model whose bones are taken; a generic adult's otherwise.
    up : {"y", "z"}, optional
        The vertical axis of its world; z by default, as AMASS has it.

    Raises
    ------
    FormatError
        If poses or a frame rate are missing, arrays do not fit together, or the body model is of
        another kind.
    """
    try:
        with np.errstate(all="ignore"):  # absurd numbers are told by the clip
            return _clip(path, arrays, fps, body_model, up)
    except (ValueError, TypeError, IndexError) as problem:
        raise FormatError(path, f"Expected arrays of a SMPL body, but got {problem!r}.") from None


def _clip(
    path: StrPath,
    arrays: Mapping[str, Any],
    fps: float | None,
    body_model: StrPath | None,
    up: str | None,
) -> Clip:
    model, turns = _poses(path, arrays)
    trans = _numbers(path, arrays, "trans", (len(turns), 3))
    betas = np.asarray(arrays["betas"], dtype=np.float64).reshape(-1) if "betas" in arrays else ()
    rate, source = (fps, "caller") if fps is not None else (_rate(path, arrays), "file")
    if body_model is None:
        body, bones = generic_body(model), "bones of a generic adult of 1.75 m"
    else:
        body = read_body_model(body_model, model, np.asarray(betas, dtype=np.float64))
        bones = f"bones of {Path(body_model).name}"
    n_joints = turns.shape[1]  # files may have the body alone
    body = SmplBody(body.names[:n_joints], body.parents[:n_joints], body.rest_m[:n_joints])
    local = _matrices(turns)
    root = trans + body.rest_m[0]
    steps = [f"read as {model}", bones]
    if up in (None, "z"):
        local[:, 0] = Z_TO_Y @ local[:, 0]
        root = root @ Z_TO_Y.T
        steps.append("turned from z up to y up")
    rest = body.rest_m - body.rest_m[0]
    offsets = rest.copy()
    offsets[1:] -= rest[list(body.parents[1:])]
    world = world_rotations(body.parents, local)
    positions = world_positions(body.parents, offsets, root, world)
    return clip_of_pose(
        body.names,
        body.parents,
        rest,
        Pose(positions, world),
        rate,
        name=Path(path).stem,
        source=str(path),
        fps_source=source,
        up_source="file" if up is None else "caller",
        provenance=tuple(steps),
    )


def write_smpl(
    clip: Clip,
    path: StrPath,
    model: BodyModelName = "smplh",
    *,
    like: StrPath | None = None,
    body_model: StrPath | None = None,
) -> Clip:
    """Write a clip as AMASS does: of a SMPL body exactly, of any other human body carried over.

    Parameters
    ----------
    clip : Clip
        Of a skeleton with the joints of the model's body by their names, whose rotations are kept;
        or of another whole human body (see `smpl_carrying`). Hands and faces that it has not are at
        rest.
    path : path-like
        An ``.npz``.
    model : {"smpl", "smplh", "smplx"}
    like : path-like, optional
        The archive that the clip is from: its betas and gender are kept. Otherwise they are zero
        and neutral.
    body_model : path-like, optional
        The body model that the clip was read with.

    Returns
    -------
    Clip
        The clip, its provenance saying what was written.

    Raises
    ------
    FormatError
        If the suffix is another one, or the file cannot be written.
    SkeletonError
        If the clip has no whole human body.
    """
    if Path(path).suffix.lower() != ".npz":
        raise FormatError(path, f"Expected an .npz for {model}, but got {Path(path).suffix!r}.")
    if model not in BODY_MODELS:
        raise FormatError(
            path, f"Expected a body out of {', '.join(BODY_MODELS)}, but got {model!r}."
        )
    betas, gender = np.zeros(N_BETAS), "neutral"
    if like is not None:
        if not Path(like).is_file():
            raise FormatError(like, "Expected the archive that the clip is from, but got none.")
        try:
            with opened_archive(like) as archive:
                betas = np.asarray(archive["betas"]) if "betas" in archive.files else betas
                gender = str(archive["gender"]) if "gender" in archive.files else gender
        except (*UNREADABLE, *BROKEN) as problem:
            raise FormatError(
                like, f"Expected the archive that the clip is from, but got: {problem}."
            ) from None
    body = generic_body(model) if body_model is None else read_body_model(body_model, model, betas)
    skeleton = clip.skeleton
    steps: tuple[str, ...] = ()
    if skeleton.convention == "bvh" and set(BODY) <= set(skeleton.names):
        own = [name for name in body.names if name in skeleton.names]
        turns = np.zeros((len(clip), len(body.names), 3))
        local = clip.rotations(form="matrix")[:, [skeleton.joint(name) for name in own]]
        pelvis_m = clip.positions()[:, 0]
    else:
        from mocapdb.io.smpl_carrying import carried_to_smpl

        carried = carried_to_smpl(clip, body)
        own, pelvis_m, steps = list(BODY), carried.pelvis_m, carried.steps
        local = local_rotations(body.parents, carried.world)[:, : len(BODY)]
        turns = np.zeros((len(clip), len(body.names), 3))
    local[:, 0] = Z_TO_Y.T @ local[:, 0]
    turns[:, [body.names.index(name) for name in own]] = _vectors(local)
    at_rest = len(body.names) - len(own)
    trans = pelvis_m @ Z_TO_Y - body.rest_m[0]
    with replacing(path) as (temporary,), temporary.open("wb") as file:
        np.savez_compressed(
            file,
            poses=turns.reshape(len(clip), -1),
            trans=trans,
            betas=betas,
            gender=np.array(gender),
            mocap_framerate=np.array(clip.fps),
            surface_model_type=np.array(model),
        )
    step = f"written as {model}" + (f", {at_rest} joints at rest" if at_rest else "")
    provenance = (*clip.provenance, *(f"carried over to {model}: {each}" for each in steps), step)
    return replace(clip, provenance=provenance)


def _poses(path: StrPath, arrays: Mapping[str, Any]) -> tuple[BodyModelName, FloatArray]:
    """Return the model, and rotation vectors (F, J, 3)."""
    if "poses" in arrays:
        poses = np.asarray(arrays["poses"], dtype=np.float64)
    else:
        wanted = next((parts for parts in PARTS.values() if set(parts) <= set(arrays)), None)
        wanted = wanted or ("root_orient", "pose_body")
        if not set(wanted) <= set(arrays):
            raise FormatError(
                path,
                "Expected poses, or root_orient and pose_body, but the archive has only "
                f"{', '.join(sorted(arrays)) or 'nothing'}. Files of shapes have no motion.",
            )
        poses = np.concatenate([np.asarray(arrays[part], dtype=float) for part in wanted], axis=1)
    if poses.ndim == 3 and poses.shape[2] == 3:
        poses = poses.reshape(len(poses), -1)
    widths = {3 * len(joints_of(model)[0]): model for model in BODY_MODELS}
    widths[3 * len(BODY)] = "smplh"
    width = poses.shape[-1] if poses.ndim == 2 else 0
    if width not in widths:
        known = ", ".join(f"{3 * len(joints_of(model)[0])} ({model})" for model in BODY_MODELS)
        raise FormatError(
            path,
            f"Expected poses of {known} or {3 * len(BODY)} numbers a frame, but got shape "
            f"{poses.shape}.",
        )
    if not len(poses) or not np.isfinite(poses).all():
        raise FormatError(path, "Expected finite poses of one frame at least.")
    return widths[width], poses.reshape(len(poses), -1, 3)


def _rate(path: StrPath, arrays: Mapping[str, Any]) -> float:
    for name in RATES:
        if name in arrays:
            rate = float(np.asarray(arrays[name]).reshape(-1)[0])
            if np.isfinite(rate) and rate > 0:
                return rate
            raise FormatError(path, f"Expected a positive {name}, but got {rate}. Say --fps.")
    raise FormatError(
        path,
        "Expected a frame rate as mocap_framerate, but the archive has none. Say it: --fps, or "
        "fps= in Python.",
    )


def _numbers(
    path: StrPath, arrays: Mapping[str, Any], name: str, shape: tuple[int, ...]
) -> FloatArray:
    if name not in arrays:
        raise FormatError(path, f"Expected {name} {shape}, but the archive has none.")
    found = np.asarray(arrays[name], dtype=np.float64)
    if found.shape != shape or not np.isfinite(found).all():
        raise FormatError(path, f"Expected finite {name} {shape}, but got shape {found.shape}.")
    return found


def _matrices(vectors: FloatArray) -> FloatArray:
    from scipy.spatial.transform import Rotation

    flat = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix()
    return np.asarray(flat.reshape(*vectors.shape[:2], 3, 3))


def _vectors(matrices: FloatArray) -> FloatArray:
    from scipy.spatial.transform import Rotation

    flat = Rotation.from_matrix(matrices.reshape(-1, 3, 3)).as_rotvec()
    return np.asarray(flat.reshape(*matrices.shape[:2], 3))
