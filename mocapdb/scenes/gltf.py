"""A clip as binary glTF 2.0 (``.glb``): joints, a body of capsules skinned to them, the animation.

Metres, Y up, every frame at the clip's own rate. Root motion may stand on a bone of its own,
above all others, as engines want it (`RootTrack`). A bone's capsule turns with the joint that it
hangs on, so the skin is rigid. After the Khronos Group's glTF 2.0 specification, sections 3.7 and
4.4.
"""

from __future__ import annotations

import json
import struct
from typing import Any, NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray, StrPath
from mocapdb.base.files import write_whole
from mocapdb.io.conventions import to_bvh_convention, to_y_up
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics, to_metres
from mocapdb.motion.rotations import basis_along, elementary
from mocapdb.motion.skeleton import Skeleton
from mocapdb.scenes.capsule_body import Body, body_of

__all__ = ["RootTrack", "glb_bytes", "write_glb"]

ROUND, RINGS = 12, 3  # segments round a capsule, and rings of each of its ends
STILL_M = 1e-6  # a joint that shifts by less has no track of positions
ROUGHNESS = 0.8  # of the material, from a mirror (0) to chalk (1)
COLOUR = (0.0, 0.168, 0.445, 1.0)  # #0072B2 in linear light
# of the specification: what a buffer view is for, types of elements by shape, types of numbers
ARRAYS, ELEMENTS = 34962, 34963
TYPES = {(): "SCALAR", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
COMPONENTS = {"<f4": 5126, "<u2": 5123, "<u4": 5125}


ROOT_BONE = "root_motion"


class RootTrack(NamedTuple):
    """Where a bone is that carries a whole body, which itself stays in place.

    Attributes
    ----------
    path : (F, 3)
        In the units and axes of the clip's skeleton.
    heading_rad : (F,) radians
        Turned about its vertical axis.
    """

    path: FloatArray
    heading_rad: FloatArray


def write_glb(clip: Clip, path: StrPath, carrier: RootTrack | None = None) -> None:
    """Write a clip as binary glTF; the file appears whole or not at all.

    See `glb_bytes`.

    Raises
    ------
    FormatError
        If the file cannot be written.
    """
    write_whole(path, glb_bytes(clip, carrier))


def glb_bytes(clip: Clip, carrier: RootTrack | None = None) -> bytes:
    """Return a clip as the bytes of a ``.glb``.

    Parameters
    ----------
    clip : Clip
    carrier : RootTrack, optional
        A bone ``root_motion`` is put above all joints, which goes this way and carries the clip's
        motion on it.
    """
    source, clip = clip.skeleton, to_bvh_convention(to_y_up(clip))
    skeleton = clip.skeleton
    rest = skeleton.rest_positions * skeleton.metres_per_unit
    out = _Buffer()
    first = 0 if carrier is None else 1  # of the joints among the nodes
    nodes: list[dict[str, Any]] = []
    if carrier is not None:
        nodes.append({"name": _unused(ROOT_BONE, skeleton), "children": [first]})
    for joint, children in enumerate(skeleton.children):
        above = rest[skeleton.parents[joint]] if joint else np.zeros(3)
        node = {"name": skeleton.names[joint], "translation": (rest[joint] - above).tolist()}
        below = [first + child for child in children]
        nodes.append(node | ({"children": below} if below else {}))
    mesh = len(nodes)
    joints = range(mesh)
    binds = np.tile(np.eye(4), (mesh, 1, 1))
    binds[first:, 3, :3] = -rest  # column-major: the last column comes last
    tracks = _tracks(clip, first)
    if carrier is not None:
        tracks = _carrier_tracks(carrier, source) + tracks
    nodes.append({"name": "body", "mesh": 0, "skin": 0})
    document = {
        "asset": {"version": "2.0", "generator": "mocapdb"},
        "scene": 0,
        "scenes": [{"name": clip.name or "clip", "nodes": [0, mesh]}],
        "nodes": nodes,
        "skins": [
            {
                "joints": list(joints),
                "skeleton": 0,
                "inverseBindMatrices": out.add(binds.astype("<f4")),
            }
        ],
        "meshes": [{"name": "body", "primitives": [_primitive(out, skeleton, rest, first)]}],
        "materials": [
            {
                "name": "body",
                "pbrMetallicRoughness": {
                    "baseColorFactor": COLOUR,
                    "metallicFactor": 0.0,
                    "roughnessFactor": ROUGHNESS,
                },
            }
        ],
        "animations": [_animation(out, clip, tracks)],
    }
    return out.packed(document)


class _Track(NamedTuple):
    """What a node does: ``"rotation"``, quaternions (F, 4), or ``"translation"``, metres (F, 3)."""

    node: int
    path: str
    values: FloatArray


def _animation(out: _Buffer, clip: Clip, tracks: list[_Track]) -> dict[str, Any]:
    times = out.add((np.arange(len(clip)) / clip.fps).astype("<f4"), bounds=True)
    return {
        "name": clip.name or "motion",
        "samplers": [
            {"input": times, "output": out.add(track.values.astype("<f4"))} for track in tracks
        ],
        "channels": [
            {"sampler": i, "target": {"node": track.node, "path": track.path}}
            for i, track in enumerate(tracks)
        ],
    }


def _tracks(clip: Clip, first: int) -> list[_Track]:
    """Return a rotation for each joint, and a translation for those that shift.

    `first` is the node of the first joint.
    """
    skeleton = clip.skeleton
    pose = forward_kinematics(skeleton, clip.channels)
    positions = pose.positions * skeleton.metres_per_unit
    tracks = []
    for joint, parent in enumerate(skeleton.parents):
        rotations, shifts = pose.rotations[:, joint], positions[:, joint]
        if joint:
            back = np.swapaxes(pose.rotations[:, parent], 1, 2)
            rotations = back @ rotations
            shifts = np.einsum("fij,fj->fi", back, shifts - positions[:, parent])
        if skeleton.rotation_orders[joint]:
            tracks.append(_Track(first + joint, "rotation", _quaternions(rotations)))
        offset = skeleton.offsets[joint] * skeleton.metres_per_unit
        if joint == 0 or np.abs(shifts - offset).max() > STILL_M:
            tracks.append(_Track(first + joint, "translation", shifts))
    return tracks


def _carrier_tracks(carrier: RootTrack, skeleton: Skeleton) -> list[_Track]:
    """Return what the bone does that carries the body, in metres, Y up."""
    turns = _quaternions(elementary("Y", carrier.heading_rad))
    return [
        _Track(0, "rotation", turns),
        _Track(0, "translation", to_metres(skeleton, carrier.path)),
    ]


def _quaternions(rotations: FloatArray) -> FloatArray:
    from scipy.spatial.transform import Rotation

    return _continuous(Rotation.from_matrix(rotations).as_quat())


def _unused(name: str, skeleton: Skeleton) -> str:
    while name in skeleton.names:
        name += "_"
    return name


def _continuous(quat_xyzw: FloatArray) -> FloatArray:
    """Return the quaternions (F, 4) with signs that never jump, so that they interpolate."""
    agree = np.einsum("fi,fi->f", quat_xyzw[1:], quat_xyzw[:-1]) >= 0
    signs = np.concatenate([[1.0], np.cumprod(np.where(agree, 1.0, -1.0))])
    return np.asarray(quat_xyzw * signs[:, None])


def _primitive(
    out: _Buffer, skeleton: Skeleton, rest: FloatArray, first_joint: int
) -> dict[str, Any]:
    """Return the body in its rest pose, each vertex bound to the joint that carries its bone."""
    body: Body = body_of(skeleton)
    points, normals, joints, faces = [], [], [], []
    first = 0
    for tail, head, radius in zip(body.tails, body.heads, body.radii_m, strict=True):
        around, along, triangles = _capsule(rest[head] - rest[tail], float(radius))
        points.append(rest[tail] + along)
        normals.append(around)
        joints.append(np.full(len(along), tail))
        faces.append(first + triangles)
        first += len(along)
    bound = np.zeros((first, 4), dtype="<u2")
    bound[:, 0] = first_joint + np.concatenate(joints)
    weights = np.zeros((first, 4), dtype="<f4")
    weights[:, 0] = 1.0
    return {
        "attributes": {
            "POSITION": out.add(np.concatenate(points).astype("<f4"), ARRAYS, bounds=True),
            "NORMAL": out.add(np.concatenate(normals).astype("<f4"), ARRAYS),
            "JOINTS_0": out.add(bound, ARRAYS),
            "WEIGHTS_0": out.add(weights, ARRAYS),
        },
        "indices": out.add(np.concatenate(faces).ravel().astype("<u4"), ELEMENTS),
        "material": 0,
    }


def _capsule(way: FloatArray, radius: float) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return the normals, the points and the triangles of a capsule from the origin along `way`."""
    length = float(np.linalg.norm(way))
    axes = basis_along(way) if length > 1e-9 else np.eye(3)  # x along the capsule
    polar = np.linspace(0, np.pi / 2, RINGS + 1)
    polar = np.concatenate([np.pi - polar, polar[::-1]])  # from the one pole to the other
    angle = 2 * np.pi * np.arange(ROUND) / ROUND
    local = np.stack(
        [
            np.repeat(np.cos(polar)[:, None], ROUND, axis=1),
            np.outer(np.sin(polar), np.cos(angle)),
            np.outer(np.sin(polar), np.sin(angle)),
        ],
        axis=-1,
    )
    normals = local.reshape(-1, 3) @ axes.T
    far = np.repeat(np.arange(len(polar)) > RINGS, ROUND)
    points = radius * normals + np.where(far[:, None], way, 0.0)
    i, j = (part.ravel() for part in np.mgrid[: len(polar) - 1, :ROUND])
    a, b = ROUND * i + j, ROUND * i + (j + 1) % ROUND
    triangles = np.concatenate(
        [np.stack([a, a + ROUND, b], axis=1), np.stack([b, a + ROUND, b + ROUND], axis=1)]
    )
    outward = np.cross(points[triangles[:, 1]] - points[triangles[:, 0]],
                       points[triangles[:, 2]] - points[triangles[:, 0]])  # fmt: skip
    if np.einsum("ij,ij->i", outward, normals[triangles[:, 0]]).sum() < 0:
        triangles = triangles[:, ::-1]
    return normals, points, triangles


class _Buffer:
    """The binary part of a file, and where what lies in it."""

    def __init__(self) -> None:
        self._data = bytearray()
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []

    def add(
        self, values: np.ndarray[Any, Any], target: int | None = None, *, bounds: bool = False
    ) -> int:
        """Add an array, an element a row, and return the accessor's number."""
        view = {"buffer": 0, "byteOffset": len(self._data), "byteLength": values.nbytes}
        self._views.append(view | ({"target": target} if target else {}))
        self._data += values.tobytes()
        self._data += b"\0" * (-len(self._data) % 4)
        accessor: dict[str, Any] = {
            "bufferView": len(self._views) - 1,
            "componentType": COMPONENTS[values.dtype.str],
            "count": len(values),
            "type": TYPES[values.shape[1:]],
        }
        if bounds:
            accessor["min"] = np.atleast_1d(values.min(axis=0)).tolist()
            accessor["max"] = np.atleast_1d(values.max(axis=0)).tolist()
        self._accessors.append(accessor)
        return len(self._accessors) - 1

    def packed(self, document: dict[str, Any]) -> bytes:
        """Return the whole file: a header, the document as JSON, the binary part."""
        document = document | {
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._data)}],
        }
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        size = 12 + 8 + len(text) + 8 + len(self._data)
        return b"".join(
            [
                struct.pack("<4sII", b"glTF", 2, size),
                struct.pack("<I4s", len(text), b"JSON"),
                text,
                struct.pack("<I4s", len(self._data), b"BIN\0"),
                bytes(self._data),
            ]
        )
