"""The joints of SMPL's family of bodies, and how long their bones are.

=========  ======  ==========================================================
model      joints  what it has
=========  ======  ==========================================================
``smpl``   24      the body, a joint for each hand
``smplh``  52      the body and 15 joints for each hand (Romero et al. 2017)
``smplx``  55      besides jaw and eyes (Pavlakos et al. 2019)
=========  ======  ==========================================================

Bone lengths are those of a body model file, shaped by a clip's betas (Loper et al. 2015, eq. 8 and
10). Without one they are a generic adult's of 1.75 m, by the shares of stature of Drillis and
Contini (1966); hands by those of Buryanov and Kotiuk (2010). No number of SMPL is in mocapdb.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal, NamedTuple, TypeAlias, get_args
from zipfile import is_zipfile

import numpy as np

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.errors import FormatError
from mocapdb.io.npz import BROKEN, UNREADABLE, opened_archive
from mocapdb.motion.representations import UNIVERSAL_HEIGHT_M

__all__ = ["BODY_MODELS", "BodyModelName", "SmplBody", "generic_body", "read_body_model"]

BodyModelName: TypeAlias = Literal["smpl", "smplh", "smplx"]
BODY_MODELS: tuple[BodyModelName, ...] = get_args(BodyModelName)

BODY = (
    "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2",
    "left_ankle", "right_ankle", "spine3", "left_foot", "right_foot", "neck", "left_collar",
    "right_collar", "head", "left_shoulder", "right_shoulder", "left_elbow", "right_elbow",
    "left_wrist", "right_wrist",
)  # fmt: skip
BODY_PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19)
FINGERS = ("index", "middle", "pinky", "ring", "thumb")
FACE = ("jaw", "left_eye", "right_eye")

# Where joints are at rest, as shares of stature: to the left, up, ahead. Arms are stretched out.
GENERIC = {
    "pelvis": (0.0, 0.545, 0.0),
    "left_hip": (0.052, 0.530, 0.0),
    "left_knee": (0.052, 0.285, 0.0),
    "left_ankle": (0.052, 0.039, 0.0),
    "left_foot": (0.052, 0.008, 0.076),
    "spine1": (0.0, 0.605, 0.0),
    "spine2": (0.0, 0.675, 0.0),
    "spine3": (0.0, 0.715, 0.0),
    "neck": (0.0, 0.830, 0.0),
    "head": (0.0, 0.882, 0.02),
    "left_collar": (0.040, 0.800, 0.0),
    "left_shoulder": (0.129, 0.818, 0.0),
    "left_elbow": (0.315, 0.818, 0.0),
    "left_wrist": (0.461, 0.818, 0.0),
    "left_hand": (0.510, 0.818, 0.0),
    "jaw": (0.0, 0.885, 0.02),
    "left_eye": (0.018, 0.936, 0.055),
}
KNUCKLES = {  # of the left hand, from the wrist: along the arm, ahead; then the bones of a finger
    "index": (0.052, 0.014, (0.0227, 0.0128)),
    "middle": (0.052, 0.003, (0.0256, 0.0151)),
    "ring": (0.050, -0.007, (0.0237, 0.0147)),
    "pinky": (0.047, -0.017, (0.0187, 0.0104)),
    "thumb": (0.014, 0.018, (0.0264, 0.0180)),
}


class SmplBody(NamedTuple):
    """The joints of a body at rest.

    Attributes
    ----------
    names : tuple of str
    parents : tuple of int
    rest_m : (J, 3) metres
        Where they are, in the model's own frame: Y up, X to the left, Z ahead.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    rest_m: FloatArray


def joints_of(model: BodyModelName) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Return names and parents of the joints of a model, in its order."""
    names, parents = list(BODY), list(BODY_PARENTS)
    if model == "smpl":
        return (*names, "left_hand", "right_hand"), (*parents, 20, 21)
    if model == "smplx":
        names += FACE
        parents += [15, 15, 15]
    for side, wrist in (("left", 20), ("right", 21)):
        for finger in FINGERS:
            for bone in (1, 2, 3):
                parents.append(wrist if bone == 1 else len(names) - 1)
                names.append(f"{side}_{finger}{bone}")
    return tuple(names), tuple(parents)


def generic_body(model: BodyModelName) -> SmplBody:
    """Return a model's joints on a generic adult of 1.75 m, the pelvis at the origin.

    Examples
    --------
    >>> body = generic_body("smplh")
    >>> len(body.names), body.names[20:24]
    (52, ('left_wrist', 'right_wrist', 'left_index1', 'left_index2'))
    """
    names, parents = joints_of(model)
    rest = np.array([_generic_place(name) for name in names])
    return SmplBody(names, parents, (rest - rest[0]) * UNIVERSAL_HEIGHT_M)


def _generic_place(name: str) -> tuple[float, float, float]:
    side, _, part = name.partition("_")
    left = name if side != "right" else f"left_{part}"
    if left in GENERIC:
        x, y, z = GENERIC[left]
    else:  # of a finger
        along, ahead, bones = KNUCKLES[part[:-1]]
        x, y, z = GENERIC["left_wrist"]
        x, z = x + along + sum(bones[: int(part[-1]) - 1]), z + ahead
    return (-x if side == "right" else x), y, z


def read_body_model(path: StrPath, model: BodyModelName, betas: FloatArray) -> SmplBody:
    """Return a model's joints by a body model file, shaped by betas.

    Parameters
    ----------
    path : path-like
        An ``.npz`` with ``v_template`` (V, 3), ``J_regressor`` (J, V) and ``shapedirs`` (V, 3, B),
        as SMPL, SMPL-H and SMPL-X are given out.
    model : {"smpl", "smplh", "smplx"}
        Which one is needed.
    betas : (b,)
        Shape; those that the file has no direction for are left out.

    Raises
    ------
    FormatError
        If it is no such file, or of another kind of body.
    """
    if Path(path).suffix.lower() in (".pkl", ".pickle"):
        raise FormatError(
            path,
            "Expected a body model as .npz, but got a pickle, which may run any program when it "
            "is read. Take the .npz of the model, or save its arrays with numpy.savez.",
        )
    if Path(path).is_file() and not is_zipfile(path):
        raise FormatError(
            path,
            "Expected a body model as .npz for a clip of AMASS, but it is no archive of arrays. "
            "Leave it out for the bones of a generic adult.",
        )
    try:
        with opened_archive(path) as archive:
            missing = [name for name in ("v_template", "J_regressor") if name not in archive.files]
            if missing:
                raise FormatError(
                    path, f"Expected a body model, but it has no {' and no '.join(missing)}."
                )
            vertices = np.asarray(archive["v_template"], dtype=np.float64)
            regressor = np.asarray(archive["J_regressor"], dtype=np.float64)
            directions = archive["shapedirs"] if "shapedirs" in archive.files else None
    except FileNotFoundError:
        raise FormatError(path, "Expected a body model, but there is none.") from None
    except (*UNREADABLE, *BROKEN) as problem:
        raise FormatError(path, f"Expected a body model as .npz, but got: {problem}.") from None
    names, parents = joints_of(model)
    if vertices.ndim != 2 or regressor.shape != (len(regressor), len(vertices)):
        raise FormatError(
            path,
            f"Expected a regressor (J, V) of the template's vertices, but got {regressor.shape} "
            f"for {vertices.shape}.",
        )
    if len(regressor) != len(names):
        kinds = {len(joints_of(each)[0]): each for each in BODY_MODELS} | {16: "mano", 5: "flame"}
        other = kinds.get(len(regressor), "another kind")
        raise FormatError(
            path,
            f"Expected a body model of {model}, {len(names)} joints, but got one of {other}, "
            f"{len(regressor)} joints.",
        )
    if directions is not None:
        count = min(len(betas), directions.shape[-1])
        vertices = vertices + np.asarray(directions[..., :count]) @ betas[:count]
    return SmplBody(names, parents, regressor @ vertices)
