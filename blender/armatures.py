"""Armatures and their actions as motions, and the other way.

A bone's matrix at rest turns its own axes into the armature's; what an action keys is against
that. A motion says instead how far a bone is turned in the world, so that bones' own axes, their
rolls and the object's transform do not matter. Lengths are metres: units of the scene times its
scale.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import bpy
import numpy as np

from . import compat
from .keying import BoneKeys, bone_keys, curves_by_path, playing_curves
from .motions import FloatArray, Motion

__all__ = [
    "RefusedError",
    "Span",
    "frame_rate",
    "keys_of",
    "make_armature",
    "moving_bones",
    "read_action",
    "rest_motion",
    "span_of_action",
]

LEAST_FRAMES = 4
EVEN = 1e-3  # by which the scales of an object's axes may differ


class RefusedError(Exception):
    """What an operator cannot be applied to, said to the user."""


class Span(NamedTuple):
    """The frames of an action that are looked at: ``start + step * k``.

    A step is one frame of the scene, less where the action has denser keys.
    """

    start: float
    n_frames: int
    step: float

    @property
    def times(self) -> FloatArray:
        """(F,) in frames of the scene."""
        return np.asarray(self.start + self.step * np.arange(self.n_frames), dtype=np.float64)


class _Rest(NamedTuple):
    """An armature at rest, in the armature's own space, and where that is in the world."""

    bones: list[Any]
    parents: list[int]
    matrices: FloatArray  # (B, 4, 4)
    turn: FloatArray  # (3, 3)
    scale_m: float
    place_m: FloatArray  # (3,)

    def to_world(self, places: FloatArray) -> FloatArray:
        return np.asarray(self.scale_m * places @ self.turn.T + self.place_m)

    def from_world(self, places: FloatArray) -> FloatArray:
        return np.asarray((places - self.place_m) @ self.turn / self.scale_m)


def frame_rate(scene: Any) -> float:
    """Return the frames a second of a scene."""
    return float(scene.render.fps / scene.render.fps_base)


def span_of_action(
    action: Any, slot: Any, first: int | None = None, most: int | None = None
) -> Span:
    """Return the frames of an action, from `first` on and no more than `most`.

    Raises
    ------
    RefusedError
        If these are fewer than four.
    """
    bag = compat.curves_of(action, slot)
    playing = [] if bag is None else playing_curves(bag)
    curves = [curve for curve in playing if len(curve.keyframe_points)]
    if not curves:
        has = "only muted ones" if bag is not None and len(bag.fcurves) > len(playing) else "none"
        raise RefusedError(f"Expected an action with keys, but {action.name!r} has {has}.")
    longest = max(curves, key=lambda curve: len(curve.keyframe_points))
    co = np.empty(2 * len(longest.keyframe_points), dtype=np.float32)
    longest.keyframe_points.foreach_get("co", co)
    apart = np.diff(co[::2].astype(np.float64))
    usual = float(np.median(apart)) if len(apart) else 1.0
    is_dense = 0.01 < usual < 0.999 and float(np.abs(apart - usual).max()) < 0.01
    step = usual if is_dense else 1.0
    start = min(float(curve.keyframe_points[0].co[0]) for curve in curves)
    end = max(float(curve.keyframe_points[-1].co[0]) for curve in curves)
    if is_dense:
        step = (end - start) / max(round((end - start) / usual), 1)
    if first is not None:
        start += max(0, np.ceil((first - start) / step - 1e-6)) * step
    n_frames = int(np.floor((end - start) / step + 1e-3)) + 1
    if most is not None:
        n_frames = min(n_frames, int(np.floor((most - 1) / step + 1e-3)) + 1)
    if n_frames < LEAST_FRAMES:
        raise RefusedError(
            f"Expected a motion of {LEAST_FRAMES} frames or more, but {action.name!r} has "
            f"{max(n_frames, 0)} there."
        )
    return Span(start, n_frames, step)


def read_action(
    scene: Any, owner: Any, span: Span, said: Callable[[str], None] = lambda text: None
) -> Motion:
    """Return what an armature does while it plays its action.

    From the curves, all frames at once; where constraints, drivers, other tracks, scales of bones
    or the object's own motion have a say, frame by frame as Blender evaluates them.

    Parameters
    ----------
    scene, owner
        The scene, and the armature's object.
    span : Span
    said : callable
        Is told what was left out.
    """
    action, slot = compat.assigned(owner)
    bag = compat.curves_of(action, slot)
    curves = curves_by_path(bag)
    rest = _rest_of(scene, owner)
    reason = _needs_evaluation(owner, curves)
    if reason:
        said(f"{reason}: its pose is taken frame by frame as Blender shows it")
        places, turns = _evaluated(scene, owner, rest, span)
    else:
        places, turns = _composed(owner, rest, curves, span)
    names = tuple(bone.name for bone in rest.bones)
    at_rest = rest.turn @ rest.matrices[:, :3, :3]
    return Motion(
        names=names,
        parents=np.array(rest.parents),
        heads=rest.to_world(rest.matrices[:, :3, 3]),
        tails=_tails(rest),
        positions=rest.to_world(places),
        rotations=rest.turn @ turns @ np.swapaxes(at_rest, -1, -2),
        fps=frame_rate(scene) / span.step,
        name=action.name,
    )


def rest_motion(scene: Any, owner: Any) -> Motion:
    """Return an armature at rest, as a motion of one frame."""
    rest = _rest_of(scene, owner)
    heads = rest.to_world(rest.matrices[:, :3, 3])
    return Motion(
        names=tuple(bone.name for bone in rest.bones),
        parents=np.array(rest.parents),
        heads=heads,
        tails=_tails(rest),
        positions=heads[None],
        rotations=np.broadcast_to(np.eye(3), (1, len(heads), 3, 3)),
        fps=frame_rate(scene),
        name=owner.name,
    )


def moving_bones(motion: Motion) -> set[str]:
    """Return the bones whose heads move against their parents, or that have none."""
    moving = set()
    for bone, parent in enumerate(motion.parents.tolist()):
        if parent < 0:
            moving.add(motion.names[bone])
            continue
        apart = motion.positions[:, bone] - motion.positions[:, parent]
        local = np.einsum("fji,fj->fi", motion.rotations[:, parent], apart)
        if np.abs(local - (motion.heads[bone] - motion.heads[parent])).max() > 1e-4:
            moving.add(motion.names[bone])
    return moving


def keys_of(
    scene: Any, owner: Any, motion: Motion, moving: Sequence[str] | set[str] | None = None
) -> dict[str, BoneKeys]:
    """Return what each bone of an armature has to be keyed to, so that it does a motion.

    Parameters
    ----------
    motion : Motion
        Of bones of these names; bones of the armature that it does not have rest.
    moving : collection of str, optional
        The bones whose location is keyed; by default those that move against their parents.
    """
    rest = _rest_of(scene, owner)
    moving = moving_bones(motion) if moving is None else set(moving)
    index = {name: row for row, name in enumerate(motion.names)}
    n_frames = len(motion)
    turns = np.empty((n_frames, len(rest.bones), 3, 3))
    places = np.empty((n_frames, len(rest.bones), 3))
    keys: dict[str, BoneKeys] = {}
    for bone, data in enumerate(rest.bones):
        base_turn, base_place = _base(rest, bone, turns, places)
        row = index.get(data.name)
        if row is None:
            turns[:, bone], places[:, bone] = base_turn, base_place
            continue
        turns[:, bone] = (
            rest.turn.T @ motion.rotations[:, row] @ rest.turn @ rest.matrices[bone, :3, :3]
        )
        local = np.swapaxes(base_turn, -1, -2) @ turns[:, bone]
        location = None
        places[:, bone] = base_place
        if data.name in moving:
            places[:, bone] = rest.from_world(motion.positions[:, row])
            location = np.einsum("fji,fj->fi", base_turn, places[:, bone] - base_place)
        keys[data.name] = BoneKeys(_quat_wxyz(local), location)
    return keys


def make_armature(context: Any, motion: Motion) -> tuple[Any, dict[str, str]]:
    """Return a new armature that is shaped like a motion, and its bones by the motion's names.

    It is the active object then, in object mode, and the only one selected.
    """
    unit = context.scene.unit_settings.scale_length
    data = bpy.data.armatures.new(motion.name or "Motion")
    owner = bpy.data.objects.new(motion.name or "Motion", data)
    context.collection.objects.link(owner)
    for other in context.selected_objects:
        other.select_set(False)
    owner.select_set(True)
    context.view_layer.objects.active = owner
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        bones: list[Any] = []
        for row, name in enumerate(motion.names):
            bone = data.edit_bones.new(name)
            bone.head, bone.tail = motion.heads[row] / unit, motion.tails[row] / unit
            parent = int(motion.parents[row])
            if parent >= 0:
                bone.parent = bones[parent]
            bones.append(bone)
        names = {name: bone.name for name, bone in zip(motion.names, bones, strict=True)}
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
    data.display_type = "OCTAHEDRAL"
    owner.show_in_front = True
    return owner, names


# -- inside ----------------------------------------------------------------------------------------


def _rest_of(scene: Any, owner: Any) -> _Rest:
    bones: list[Any] = []

    def gather(bone: Any) -> None:
        bones.append(bone)
        for child in bone.children:
            gather(child)

    for bone in owner.data.bones:
        if bone.parent is None:
            gather(bone)
    if not bones:
        raise RefusedError(f"Expected an armature with bones, but {owner.name!r} has none.")
    rows = {bone.name: row for row, bone in enumerate(bones)}
    world = np.array(owner.matrix_world)
    sizes = np.linalg.norm(world[:3, :3], axis=0)
    if np.ptp(sizes) > EVEN * sizes.max() or np.linalg.det(world[:3, :3]) <= 0:
        raise RefusedError(
            f"Expected an armature of even scale, but {owner.name!r} is stretched or mirrored. "
            "Apply its scale (Object > Apply > Scale)."
        )
    unit = scene.unit_settings.scale_length
    return _Rest(
        bones,
        [rows[bone.parent.name] if bone.parent else -1 for bone in bones],
        np.array([np.array(bone.matrix_local) for bone in bones]),
        world[:3, :3] / sizes,
        float(sizes.mean() * unit),
        world[:3, 3] * unit,
    )


def _tails(rest: _Rest) -> FloatArray:
    return rest.to_world(np.array([np.array(bone.tail_local) for bone in rest.bones]))


def _base(
    rest: _Rest, bone: int, turns: FloatArray, places: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return how a bone stands while it is not keyed: turns (F, 3, 3) and places (F, 3)."""
    own, parent = rest.matrices[bone], rest.parents[bone]
    if parent < 0:
        n_frames = len(turns)
        return (
            np.broadcast_to(own[:3, :3], (n_frames, 3, 3)),
            np.broadcast_to(own[:3, 3], (n_frames, 3)),
        )
    above = rest.matrices[parent]
    back = above[:3, :3].T
    place = places[:, parent] + turns[:, parent] @ (back @ (own[:3, 3] - above[:3, 3]))
    if not rest.bones[bone].use_inherit_rotation:
        return np.broadcast_to(own[:3, :3], (len(turns), 3, 3)), place
    return turns[:, parent] @ (back @ own[:3, :3]), place


def _composed(
    owner: Any, rest: _Rest, curves: dict[tuple[str, int], Any], span: Span
) -> tuple[FloatArray, FloatArray]:
    """Return where heads are, and how bones are turned, in the armature's space, by the curves."""
    times = span.times
    turns = np.empty((span.n_frames, len(rest.bones), 3, 3))
    places = np.empty((span.n_frames, len(rest.bones), 3))
    for bone, data in enumerate(rest.bones):
        keys = bone_keys(curves, owner.pose.bones[data.name], times)
        base_turn, base_place = _base(rest, bone, turns, places)
        turns[:, bone] = base_turn @ _matrices(keys.quat_wxyz)
        places[:, bone] = base_place
        if keys.location is not None and not data.use_connect:
            places[:, bone] += np.einsum("fij,fj->fi", base_turn, keys.location)
    return places, turns


def _evaluated(scene: Any, owner: Any, rest: _Rest, span: Span) -> tuple[FloatArray, FloatArray]:
    """Return the same as `_composed`, as Blender evaluates it, in the armature's space at rest."""
    before = scene.frame_current_final
    back = np.linalg.inv(np.array(owner.matrix_world))
    matrices = np.empty((span.n_frames, len(rest.bones), 4, 4))
    try:
        for row, time in enumerate(span.times.tolist()):
            scene.frame_set(int(np.floor(time)), subframe=time - np.floor(time))
            posed = owner.evaluated_get(bpy.context.evaluated_depsgraph_get())
            world = back @ np.array(posed.matrix_world)
            for bone, data in enumerate(rest.bones):
                matrices[row, bone] = world @ np.array(posed.pose.bones[data.name].matrix)
    finally:
        scene.frame_set(int(np.floor(before)), subframe=before - np.floor(before))
    u, _, v = np.linalg.svd(matrices[..., :3, :3])  # a bone may be scaled, and sheared by that
    u[..., -1] *= np.linalg.det(u @ v)[..., None]  # or mirrored
    return matrices[..., :3, 3], u @ v


def _needs_evaluation(owner: Any, curves: dict[tuple[str, int], Any]) -> str:
    """Return why curves alone do not tell what an armature does; empty where they do."""
    if any(not constraint.mute for constraint in owner.constraints):
        return f"{owner.name!r} has constraints"
    if any(not path.startswith("pose.bones") for path, _ in curves):
        return f"{owner.name!r} moves as an object"
    for bone in owner.pose.bones:
        if any(not constraint.mute for constraint in bone.constraints):
            return f"bone {bone.name!r} has constraints"
        data = bone.bone
        if bone.parent and not data.use_local_location:
            return f"bone {bone.name!r} moves along the armature's axes"
        if _is_scaled(bone, curves):
            return (
                f"bone {bone.name!r} is scaled, and what is keyed onto it would be scaled again "
                "(Pose > Clear Transform > Scale takes a scale away)"
            )
    if len(owner.animation_data.drivers):
        return f"{owner.name!r} has drivers"
    return _other_tracks(owner)


def _is_scaled(pose_bone: Any, curves: dict[tuple[str, int], Any]) -> bool:
    """Return whether a bone has another size than at rest, now or by its keys."""
    path = f"{pose_bone.path_from_id()}.scale"
    for axis, now in enumerate(pose_bone.scale):
        curve = curves.get((path, axis))
        sizes = [now] if curve is None else [key.co[1] for key in curve.keyframe_points]
        if any(abs(size - 1.0) > EVEN for size in sizes):
            return True
    return False


def _other_tracks(owner: Any) -> str:
    """Return how tracks of the nonlinear animation have a say; empty where the action is all."""
    data = owner.animation_data
    if not data.use_nla or not len(data.nla_tracks):
        return ""
    if any(not strip.mute for track in data.nla_tracks if not track.mute for strip in track.strips):
        return f"{owner.name!r} plays tracks of the nonlinear animation beside its action"
    if data.action_blend_type != "REPLACE" or data.action_influence < 1.0:
        return f"the action of {owner.name!r} is blended"
    return ""


def _matrices(quat_wxyz: FloatArray) -> FloatArray:
    """Return the rotation matrices (F, 3, 3) of unit quaternions (F, 4)."""
    w, x, y, z = quat_wxyz.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def _quat_wxyz(matrices: FloatArray) -> FloatArray:
    from mocapdb.motion.quaternions import from_matrices

    return np.asarray(from_matrices(matrices)[..., [3, 0, 1, 2]])
