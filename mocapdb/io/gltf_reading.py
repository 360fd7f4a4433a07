"""glTF 2.0 read: the joints of a skin and the animation that moves them (``.glb`` and ``.gltf``).

The rest pose is that of the file's nodes; rotations are from there, in the world's axes, so that
the body stands when all angles are zero. Nodes above the joints take part where they move or join
the joints together; else where they stand, how they are turned and how large they make the body is
put into the joints. After the Khronos Group's glTF 2.0 specification, sections 3.6, 3.7 and 3.11.
"""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote

import numpy as np

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.base.files import expect_file
from mocapdb.errors import ClipError, FormatError, SkeletonError
from mocapdb.io.conventions import unique
from mocapdb.io.posed_clips import clip_of_pose
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import Pose
from mocapdb.motion.quaternions import slerp

__all__ = ["files_beside", "read_gltf", "says_it_moves"]

DEFAULT_FPS = 30.0  # where keys are not evenly spaced
EVEN = 0.02  # of a frame: how far keys of an even rate may be off
MOST_FRAMES = 10_000_000  # what the times of a file may ask for
MOST_BYTES = 4_000_000_000
BROKEN = (
    KeyError, IndexError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError,
    struct.error
)  # fmt: skip
COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
REST = {"translation": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0)}


class _Track(NamedTuple):
    """What an animation does to one property of a node."""

    times: FloatArray
    values: FloatArray
    way: str


def read_gltf(path: StrPath, *, fps: float | None = None, take: str | None = None) -> Clip:
    """Read an animation of a file's skin.

    Parameters
    ----------
    path : path-like
        A ``.glb``, or a ``.gltf`` with its arrays inside or in files beside it.
    fps : float, optional, frames per second
        At which the animation is sampled. By default the rate of its keys, or 30 where they are
        not evenly spaced.
    take : str, optional
        Name of the animation, in either case; by default the first one.

    Raises
    ------
    FormatError
        If the file breaks the format, or has no skin, no animation of its joints or none of that
        name.
    """
    try:
        expect_file(path)
        document, binary = _parts(path)
        with np.errstate(all="ignore"):  # absurd numbers are told by the clip
            return _clip(path, _Document(path, document, binary), fps, take)
    except FileNotFoundError:
        raise FormatError(path, "Expected a motion file, but there is none.") from None
    except OSError as problem:
        raise FormatError(path, f"Expected a glTF, but cannot read it: {problem}.") from None
    except BROKEN as problem:
        raise FormatError(path, f"Expected a whole glTF, but got {problem!r}.") from None
    except (ClipError, SkeletonError) as problem:
        raise FormatError(path, str(problem)) from None


def says_it_moves(path: StrPath) -> bool:
    """Tell whether a file says that it has a skin and an animation.

    Also of a file that cannot be read: whoever reads it learns why.
    """
    document = _heading(path)
    return document is None or bool(document.get("skins") and document.get("animations"))


def files_beside(path: StrPath) -> list[Path]:
    """Return the files that hold a document's arrays, in its order; none where it is broken."""
    document = _heading(path) or {}
    try:
        uris = [buffer.get("uri") for buffer in document.get("buffers", [])]
        beside = [Path(path).parent / unquote(uri) for uri in uris if uri and ":" not in uri]
        return [file for file in beside if file.is_file()]
    except (*BROKEN, OSError):
        return []


def _heading(path: StrPath) -> dict[str, Any] | None:
    """Return a file's document, without the arrays behind it; None where there is none."""
    try:
        with Path(path).open("rb") as file:
            start = file.read(20)
            if start[:4] == b"glTF":
                length, kind = struct.unpack_from("<I4s", start, 12)
                data = file.read(length) if kind == b"JSON" else b""
            else:
                data = start + file.read()
        document = json.loads(data)
    except (*BROKEN, OSError):
        return None
    return document if isinstance(document, dict) else None


def _parts(path: StrPath) -> tuple[dict[str, Any], bytes]:
    """Return the document, and the bytes that a ``.glb`` has behind it."""
    data = Path(path).read_bytes()
    if not data:
        raise FormatError(path, "Expected a glTF, but the file is empty.")
    if data[:4] != b"glTF":
        document = _json(path, data)
        if not isinstance(document, dict) or "asset" not in document:
            raise FormatError(path, "Expected a glTF document with an asset, but got another.")
        return document, b""
    version, size = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise FormatError(path, f"Expected glTF of version 2, but got {version}.")
    if size > len(data):
        raise FormatError(path, f"Expected {size} bytes, but got {len(data)}: it is cut short.")
    chunks: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= size:
        length, kind = struct.unpack_from("<I4s", data, at)
        chunks.setdefault(kind, data[at + 8 : at + 8 + length])
        at += 8 + length + -length % 4
    if b"JSON" not in chunks:
        raise FormatError(path, "Expected a glTF document in the file, but it holds none.")
    return _json(path, chunks[b"JSON"]), chunks.get(b"BIN\0", b"")


def _json(path: StrPath, data: bytes) -> Any:
    """Return what a document says."""
    try:
        return json.loads(data)
    except ValueError as problem:
        raise FormatError(
            path, f"Expected a glTF document, which is JSON, or a .glb, but got neither: {problem}."
        ) from None


class _Document:
    """A glTF document, and the arrays that it describes."""

    def __init__(self, path: StrPath, document: Mapping[str, Any], binary: bytes) -> None:
        self.path = Path(path)
        self.tree = document
        self.nodes: list[dict[str, Any]] = document.get("nodes", [])
        self._binary = binary
        self._buffers: dict[int, bytes] = {}
        needed = document.get("extensionsRequired", [])
        packed = [name for name in needed if "compression" in name or "quantization" in name]
        if packed:
            raise FormatError(path, f"Expected plain arrays, but the file needs {packed[0]}.")

    def _buffer(self, number: int) -> bytes:
        if number not in self._buffers:
            uri = self.tree["buffers"][number].get("uri")
            if uri is None:
                self._buffers[number] = self._binary
            elif uri.startswith("data:"):
                self._buffers[number] = base64.b64decode(uri.partition(",")[2])
            else:
                beside = self.path.parent / unquote(uri)
                if ":" in uri.partition("/")[0] or not beside.is_file():
                    raise FormatError(self.path, f"Expected its arrays in {uri!r} beside it.")
                if beside.stat().st_size > MOST_BYTES:
                    raise FormatError(self.path, f"Expected less than 4 GB in {uri!r}.")
                self._buffers[number] = beside.read_bytes()
        return self._buffers[number]

    def array(self, number: int) -> FloatArray:
        """Return an accessor's elements, a row each."""
        accessor = self.tree["accessors"][number]
        if "sparse" in accessor or "bufferView" not in accessor:
            raise FormatError(self.path, "Expected plain arrays, but accessor is sparse.")
        view = self.tree["bufferViews"][accessor["bufferView"]]
        kind = np.dtype(COMPONENTS[accessor["componentType"]])
        count, width = int(accessor["count"]), WIDTHS[accessor["type"]]
        stride = int(view.get("byteStride") or kind.itemsize * width)
        start = int(view.get("byteOffset", 0)) + int(accessor.get("byteOffset", 0))
        data = self._buffer(view["buffer"])
        end = start + stride * (count - 1) + kind.itemsize * width
        if count < 1 or start < 0 or stride < kind.itemsize * width or end > len(data):
            raise FormatError(self.path, f"Expected {count} elements, but the arrays end before.")
        found = np.ndarray((count, width), kind, data, start, (stride, kind.itemsize))
        values = found.astype(np.float64)
        if accessor.get("normalized"):
            values = np.maximum(values / np.iinfo(kind).max, -1.0)
        return values

    def parents(self) -> list[int]:
        """Return the parent of each node, -1 where it has none."""
        above = [-1] * len(self.nodes)
        for number, node in enumerate(self.nodes):
            for child in node.get("children", []):
                above[child] = number
        for number in range(len(above)):
            seen, at = 0, number
            while at >= 0:
                at, seen = above[at], seen + 1
                if seen > len(above):
                    raise FormatError(self.path, "Expected a tree of nodes, but got a circle.")
        return above

    def tracks(self, animation: Mapping[str, Any]) -> dict[tuple[int, str], _Track]:
        """Return what an animation does to each property of a node."""
        found = {}
        for channel in animation["channels"]:
            target = channel["target"]
            if "node" not in target or target["path"] not in REST:
                continue
            sampler = animation["samplers"][channel["sampler"]]
            times = self.array(sampler["input"])[:, 0]
            values = self.array(sampler["output"])
            way = sampler.get("interpolation", "LINEAR")
            rows = 3 * len(times) if way == "CUBICSPLINE" else len(times)
            if len(values) != rows or (np.diff(times) <= 0).any() or not np.isfinite(values).all():
                raise FormatError(self.path, "Expected rising times with a finite value each.")
            found[target["node"], target["path"]] = _Track(times, values, way)
        return found


def _clip(path: StrPath, document: _Document, fps: float | None, take: str | None) -> Clip:
    skins, animations = document.tree.get("skins", []), document.tree.get("animations", [])
    if not skins:
        raise FormatError(path, "Expected a skin with joints, but the file has none.")
    if not animations:
        raise FormatError(path, "Expected an animation, but the file has none.")
    above = document.parents()
    moves = [document.tracks(animation) for animation in animations]
    called = [str(each.get("name", f"number {i}")) for i, each in enumerate(animations)]
    wanted = [take is None or name.lower() == take.lower() for name in called]
    if not any(wanted):
        known = ", ".join(map(repr, called))
        raise FormatError(path, f"Expected a take out of {known}, but got {take!r}.")
    chosen = next((i for i, tracks in enumerate(moves) if tracks and wanted[i]), None)
    if chosen is None:
        raise FormatError(path, "Expected an animation of nodes, but it moves none.")
    tracks = moves[chosen]
    moved = {node for node, _ in tracks}
    skin = max(skins, key=lambda each: len(moved.intersection(each["joints"])))
    tree = _joint_tree(skin["joints"], above, moved)
    if not moved.intersection(tree):
        raise FormatError(path, "Expected an animation of the skin's joints, but it moves others.")
    own_rate = _rate_of(tracks)
    rate = fps or own_rate or DEFAULT_FPS
    source = "caller" if fps else "file" if own_rate else "default"
    times = _sample_times(path, tracks, rate)
    positions, rotations = _world(document, tracks, times, tree, above)
    rest, turned = _world(document, {}, np.zeros(1), tree, above)
    rotations = rotations @ np.swapaxes(turned, -1, -2)
    index = {node: i for i, node in enumerate(tree)}
    parents = [index.get(above[node], -1) for node in tree]
    names: list[str] = []
    for node in tree:
        names.append(unique(str(document.nodes[node].get("name") or f"node_{node}"), names))
    steps = []
    if len(animations) > 1 and take is None:
        read = called.pop(chosen)
        left = ", ".join(map(repr, called))
        steps.append(f"warning: animation {read!r} is read, and {left} left out")
    if any(np.ptp(track.values, axis=0).max() > 1e-4 for (_, what), track in tracks.items()
           if what == "scale"):  # fmt: skip
        steps.append("warning: scales that change are not a skeleton's, and are left out of it")
    return clip_of_pose(
        names,
        parents,
        rest[0] - rest[0, 0] * [1.0, 0.0, 1.0],
        Pose(positions, rotations),
        rate,
        name=Path(path).stem,
        source=str(path),
        fps_source=source,
        provenance=tuple(steps),
    )


def _joint_tree(joints: list[int], above: list[int], moved: set[int]) -> list[int]:
    """Return the joints, and what moves above them or joins them; parents before children.

    Raises
    ------
    SkeletonError
        If nothing joins them.
    """
    chains = []
    for joint in joints:
        chain = [joint]
        while above[chain[-1]] >= 0:
            chain.append(above[chain[-1]])
        chains.append(chain[::-1])  # from the scene down
    shared = [
        nodes[0] for nodes in zip(*chains, strict=False) if all(node == nodes[0] for node in nodes)
    ]
    if not shared:
        raise SkeletonError("Expected joints that hang on one node, but they hang on several.")
    taken = (i for i, node in enumerate(shared) if node in moved or node in joints)
    first = next(taken, len(shared) - 1)
    order: dict[int, None] = {}
    for chain in chains:
        order.update(dict.fromkeys(chain[first:]))
    return list(order)


def _rate_of(tracks: Mapping[tuple[int, str], _Track]) -> float | None:
    """Return the rate of the keys of the track that has the most; None where it is uneven."""
    times = max((track.times for track in tracks.values()), key=len)
    if len(times) < 3:
        return None
    step = float(times[-1] - times[0]) / (len(times) - 1)
    off = np.abs(np.diff(times) / step - 1.0).max()
    if off > max(EVEN, 4e-7 * abs(times[-1]) / step):  # times are single precision
        return None
    return float(np.round(1.0 / step, 3))


def _sample_times(
    path: StrPath, tracks: Mapping[tuple[int, str], _Track], fps: float
) -> FloatArray:
    start = min(float(track.times[0]) for track in tracks.values())
    end = max(float(track.times[-1]) for track in tracks.values())
    count = (end - start) * fps
    if not count < MOST_FRAMES:
        raise FormatError(path, f"Expected fewer than {MOST_FRAMES} frames, but got {count:.3g}.")
    return np.asarray(start + np.arange(int(count + 0.01) + 1) / fps)


def _world(
    document: _Document,
    tracks: Mapping[tuple[int, str], _Track],
    times: FloatArray,
    tree: list[int],
    above: list[int],
) -> tuple[FloatArray, FloatArray]:
    """Return where nodes are, (F, J, 3), and how they are turned, (F, J, 3, 3)."""
    found: dict[int, FloatArray] = {}

    def matrix(node: int) -> FloatArray:
        if node not in found:
            local = _local(document.nodes[node], node, tracks, times)
            found[node] = local if above[node] < 0 else matrix(above[node]) @ local
        return found[node]

    worlds = np.stack([matrix(node) for node in tree], axis=1)
    turns = worlds[..., :3, :3]
    u, _, v = np.linalg.svd(turns)  # the nearest rotation, whatever the scale
    u[..., 2] *= np.linalg.det(u @ v)[..., None]
    return worlds[..., :3, 3], u @ v


def _local(
    node: Mapping[str, Any],
    number: int,
    tracks: Mapping[tuple[int, str], _Track],
    times: FloatArray,
) -> FloatArray:
    """Return (F, 4, 4) what a node does to what hangs on it."""
    from scipy.spatial.transform import Rotation

    matrices = np.tile(np.eye(4), (len(times), 1, 1))
    if "matrix" in node:
        matrices[:] = np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
        return matrices
    values = {
        what: _sampled(tracks[number, what], times, turns=what == "rotation")
        if (number, what) in tracks and what != "scale"
        else np.tile(np.array(node.get(what, REST[what]), dtype=np.float64), (len(times), 1))
        for what in REST
    }
    turns = Rotation.from_quat(values["rotation"]).as_matrix()
    matrices[:, :3, :3] = turns * values["scale"][:, None, :]
    matrices[:, :3, 3] = values["translation"]
    return matrices


def _sampled(track: _Track, times: FloatArray, *, turns: bool) -> FloatArray:
    """Return a track's values at times; before its first key and after its last those."""
    keys = track.times
    at = np.clip(times, keys[0], keys[-1])
    low = np.clip(np.searchsorted(keys, at + 1e-9, side="right") - 1, 0, max(len(keys) - 2, 0))
    high = np.minimum(low + 1, len(keys) - 1)
    step = np.maximum(keys[high] - keys[low], 1e-12)
    share = np.clip((at - keys[low]) / step, 0.0, 1.0)[:, None]
    if track.way == "CUBICSPLINE":
        entry, value, leave = np.moveaxis(track.values.reshape(len(keys), 3, -1), 1, 0)
        s, d = share, step[:, None]
        return np.asarray(
            (2 * s**3 - 3 * s**2 + 1) * value[low]
            + d * (s**3 - 2 * s**2 + s) * leave[low]
            + (3 * s**2 - 2 * s**3) * value[high]
            + d * (s**3 - s**2) * entry[high]
        )
    first, second = track.values[low], track.values[high]
    if track.way == "STEP":
        return np.asarray(np.where(share >= 1.0, second, first))
    if turns:
        lengths = [np.linalg.norm(each, axis=1, keepdims=True) for each in (first, second)]
        return slerp(first / lengths[0], second / lengths[1], share[:, 0])
    return np.asarray(first + share * (second - first))
