"""Curves of actions as arrays: read all at once, written all at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from bpy.utils import escape_identifier
from mathutils import Euler, Quaternion

from . import compat
from .motions import BoolArray, FloatArray

__all__ = [
    "BoneKeys",
    "bone_keys",
    "curves_by_path",
    "make_cyclic",
    "playing_curves",
    "replace_keys",
    "write_keys",
]

LINEAR = 1  # the value of the enumeration, which foreach_set takes
SAME_TIME = 1e-3  # frames: keys that are nearer are at that frame
OTHER_WAY = 0.01  # by which numbers of one rotation differ that are written in two ways
AT_ONCE = 0.05  # frames in which a curve goes from one to the other; Blender joins keys within .01
ROTATION_PATHS = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}


class BoneKeys(NamedTuple):
    """What a bone does against its rest, in each of some frames.

    Attributes
    ----------
    quat_wxyz : (F, 4)
    location : (F, 3) or None
        None of a bone that only turns.
    """

    quat_wxyz: FloatArray
    location: FloatArray | None


def curves_by_path(bag: Any) -> dict[tuple[str, int], Any]:
    """Return the curves that play, by the path of what they animate and their index in it."""
    return {(curve.data_path, curve.array_index): curve for curve in playing_curves(bag)}


def playing_curves(bag: Any) -> list[Any]:
    """Return the curves that Blender plays: neither they nor their groups are muted."""
    return [
        curve
        for curve in bag.fcurves
        if not (curve.mute or getattr(curve.group, "mute", False) or curve.is_empty)
    ]


def bone_keys(curves: Mapping[tuple[str, int], Any], pose_bone: Any, times: FloatArray) -> BoneKeys:
    """Return what a bone does at some times: its curves, and what it has now where it has none."""
    mode = pose_bone.rotation_mode
    path = ROTATION_PATHS.get(mode, "rotation_euler")
    turn = _values(curves, pose_bone, path, times)
    if mode == "QUATERNION":
        quat = turn / np.maximum(np.linalg.norm(turn, axis=1, keepdims=True), 1e-12)
    elif mode == "AXIS_ANGLE":
        axis = turn[:, 1:] / np.maximum(np.linalg.norm(turn[:, 1:], axis=1, keepdims=True), 1e-12)
        half = turn[:, :1] / 2.0
        quat = np.concatenate([np.cos(half), np.sin(half) * axis], axis=1)
    else:
        quat = _quaternions_of_euler(mode, turn)
    return BoneKeys(quat, _values(curves, pose_bone, "location", times))


def write_keys(
    action: Any,
    slot: Any,
    pose_bones: Any,
    keys: Mapping[str, BoneKeys],
    times: FloatArray,
) -> None:
    """Give an action a key at every time for each of some bones, straight lines between."""
    bag = compat.curves_of(action, slot)
    for name, own in keys.items():
        group = bag.groups.new(name)
        for path, values in _channels(pose_bones[name], own):
            for index, column in enumerate(values.T):
                curve = bag.fcurves.new(path, index=index)
                curve.group = group
                points = curve.keyframe_points
                points.add(len(times))
                points.foreach_set(
                    "co", np.column_stack([times, column]).astype(np.float32).ravel()
                )
                points.foreach_set("interpolation", np.full(len(times), LINEAR, dtype=np.int32))
                curve.update()


def replace_keys(
    action: Any,
    slot: Any,
    pose_bone: Any,
    keys: BoneKeys,
    times: FloatArray,
    frames: Sequence[int],
    *,
    moves: bool,
) -> None:
    """Change the keys of one bone in some frames only; all others stay as they are.

    Parameters
    ----------
    keys : BoneKeys
        In all frames.
    times : (F,)
    frames : sequence of int
        Those to change: rows of both.
    moves : bool
        Whether the location is changed, too.
    """
    bag = compat.curves_of(action, slot)
    curves = curves_by_path(bag)
    silent = {(curve.data_path, curve.array_index): curve for curve in bag.fcurves}
    own = keys if moves else keys._replace(location=None)
    changed = np.zeros(len(times), dtype=bool)
    changed[list(frames)] = True
    beside = changed | np.roll(changed, 1) | np.roll(changed, -1)  # they hold what is around
    for path, wanted in _channels(pose_bone, own):
        before = _values(curves, pose_bone, path, times)
        values, turns = _carried_on(pose_bone, path, before, wanted, changed)
        for index, column in enumerate(values.T):
            curve = curves.get((path, index))
            if curve is None:
                if (path, index) in silent:  # a muted one, which would keep the repair silent
                    bag.fcurves.remove(silent[path, index])
                curve = bag.fcurves.new(path, index=index)
            points, at = curve.keyframe_points, _key_rows(curve)
            without = []
            for frame in np.flatnonzero(beside):
                row = at.get(round(float(times[frame]) / SAME_TIME))
                if row is None:
                    without.append(frame)
                elif changed[frame]:
                    points[row].co[1] = float(column[frame])
            for frame in without:  # afterwards, for rows change
                key = points.insert(float(times[frame]), float(column[frame]), options={"FAST"})
                key.interpolation = "LINEAR"
            for following, same in turns.items():  # from one way of writing to the other in no time
                key = points.insert(float(times[following]) - AT_ONCE, float(same[index]))
                key.interpolation = "LINEAR"
            curve.update()


def make_cyclic(action: Any, slot: Any, *, advances: bool) -> None:
    """Repeat all curves of an action for ever; locations carry on from where a lap ends."""
    for curve in compat.curves_of(action, slot).fcurves:
        goes_on = advances and curve.data_path.endswith("location")
        cycles = curve.modifiers.new("CYCLES")
        cycles.mode_before = cycles.mode_after = "REPEAT_OFFSET" if goes_on else "REPEAT"


def _channels(pose_bone: Any, keys: BoneKeys) -> Iterator[tuple[str, FloatArray]]:
    """Yield the paths of a bone's channels, as its rotation mode has them, with their values."""
    prefix = f'pose.bones["{escape_identifier(pose_bone.name)}"].'
    mode = pose_bone.rotation_mode
    quat = _continuous(keys.quat_wxyz)
    if mode == "QUATERNION":
        yield prefix + "rotation_quaternion", quat
    elif mode == "AXIS_ANGLE":
        sine = np.linalg.norm(quat[:, 1:], axis=1, keepdims=True)
        angle = 2.0 * np.arctan2(sine, quat[:, :1])
        axis = np.where(sine > 1e-9, quat[:, 1:] / np.maximum(sine, 1e-9), [0.0, 1.0, 0.0])
        yield prefix + "rotation_axis_angle", np.concatenate([angle, axis], axis=1)
    else:
        yield prefix + "rotation_euler", _euler_of_quaternions(mode, quat)
    if keys.location is not None:
        yield prefix + "location", keys.location


def _values(
    curves: Mapping[tuple[str, int], Any], pose_bone: Any, path: str, times: FloatArray
) -> FloatArray:
    """Return (F, n) what curves have at some times, and what the bone has where there is none."""
    name = path.rpartition(".")[2]
    full = f'pose.bones["{escape_identifier(pose_bone.name)}"].{name}'
    columns = []
    for index, now in enumerate(getattr(pose_bone, name)):
        curve = curves.get((full, index))
        columns.append(np.full(len(times), now) if curve is None else _sampled(curve, times))
    return np.column_stack(columns)


def _sampled(curve: Any, times: FloatArray) -> FloatArray:
    """Return what a curve has at some times; at once where these are its keys."""
    points = curve.keyframe_points
    if len(points) >= len(times) and not len(curve.modifiers):
        co = np.empty(2 * len(points), dtype=np.float32)
        points.foreach_get("co", co)
        at, values = co[::2].astype(np.float64), co[1::2].astype(np.float64)
        rows = np.clip(np.searchsorted(at, times - SAME_TIME), 0, len(at) - 1)
        if np.abs(at[rows] - times).max() < SAME_TIME:
            return np.asarray(values[rows])
    return np.array([curve.evaluate(time) for time in times.tolist()])


def _key_rows(curve: Any) -> dict[int, int]:
    """Return the row of the key at each time that has one, times in thousandths of a frame."""
    co = np.empty(2 * len(curve.keyframe_points), dtype=np.float32)
    curve.keyframe_points.foreach_get("co", co)
    return {round(float(time) / SAME_TIME): row for row, time in enumerate(co[::2])}


def _continuous(quat: FloatArray) -> FloatArray:
    """Return the same rotations (F, 4), each on the side of the one before."""
    flips = np.concatenate([[0], np.cumsum((quat[1:] * quat[:-1]).sum(axis=1) < 0)])
    return np.asarray(quat * np.where(flips % 2 == 1, -1.0, 1.0)[:, None])


def _carried_on(
    pose_bone: Any, path: str, before: FloatArray, wanted: FloatArray, changed: BoolArray
) -> tuple[FloatArray, dict[int, FloatArray]]:
    """Return old values with new ones in changed frames, each written as near the frame before.

    A rotation can be written in several ways, and between two keys Blender goes from number to
    number: keys that are written in different ways make a bone swing between them. Where the key
    after changed ones, which stays, is written in another way, it is returned as it continues them.
    """
    values = before.copy()
    turns: dict[int, FloatArray] = {}
    mode = pose_bone.rotation_mode
    for frame in np.flatnonzero(changed).tolist():
        if frame:
            values[frame] = _near(path, mode, wanted[frame], values[frame - 1])
        else:
            values[frame] = wanted[frame]
        following = frame + 1
        if following < len(values) and not changed[following]:
            own = _near(path, mode, before[following], values[frame])
            if np.abs(own - before[following]).max() > OTHER_WAY:
                turns[following] = own
    return values, turns


def _near(path: str, mode: str, value: FloatArray, near: FloatArray) -> FloatArray:
    """Return the same rotation, written as near another one as can be."""
    if path.endswith("quaternion"):
        return -value if near @ value < 0 else value
    if path.endswith("euler"):
        turned = Euler(value.tolist(), mode).to_quaternion()
        return np.array(turned.to_euler(mode, Euler(near.tolist(), mode)))
    return value


def _quaternions_of_euler(mode: str, angles_rad: FloatArray) -> FloatArray:
    """Return (F, 4) wxyz; Blender's order names the axis first that is turned about first."""
    from mocapdb.motion.quaternions import from_euler_deg

    order = mode[::-1]
    columns = ["XYZ".index(axis) for axis in order]
    quat = from_euler_deg(order, np.rad2deg(angles_rad[:, columns]))
    return np.asarray(quat[:, [3, 0, 1, 2]])


def _euler_of_quaternions(mode: str, quat_wxyz: FloatArray) -> FloatArray:
    """Return (F, 3) radians, each frame as near as can be to the one before."""
    angles = []
    near = None
    for quat in quat_wxyz.tolist():
        turned = Quaternion(quat)
        near = turned.to_euler(mode) if near is None else turned.to_euler(mode, near)
        angles.append(tuple(near))
    return np.array(angles)
