"""What runs inside Blender: imports files and samples their skeletons, or writes an FBX.

Blender, or a Python that has bpy, runs this file by itself; nothing else of mocapdb is there. It
answers requests, each a line of JSON on stdin, with a line of JSON each; arrays go through files of
numpy's. It ends when stdin does, and removes the folder that is its last argument, in which these
files are.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
LEAST_VERSION = (4, 5)
DEFAULT_FPS = 24.0  # of USD, and of a new scene
IMPORTERS: dict[str, tuple[str, dict[str, Any]]] = {
    ".fbx": ("fbx_import", {"use_custom_normals": False, "validate_meshes": False}),
    ".dae": ("collada_import", {"import_units": True}),
    **dict.fromkeys(
        (".usd", ".usda", ".usdc", ".usdz"),
        (
            "usd_import",
            {
                "import_materials": False,
                "import_textures_mode": "IMPORT_NONE",
                "import_lights": False,
                "import_cameras": False,
                "import_volumes": False,
                "set_frame_range": True,
            },
        ),
    ),
}
"""Blender's operator for each suffix, and what it is told; meshes bring their skeletons' rest."""
KINDS = (
    *("objects", "armatures", "actions", "meshes", "materials", "images", "cameras", "lights"),
    *("curves", "collections", "node_groups", "cache_files"),
)
"""Of what an import leaves behind."""
EVEN = 0.02  # of a step: how far keys of an even rate may be off
AGREE = 1e-4  # of a body's size: how far poses worked out here may be off Blender's own
CHECKED = 3  # frames at which they are compared


class CannotError(Exception):
    """Something that the user is told as it stands."""


def main() -> None:
    """Answer requests until there are no more."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # importers print on stdout
    import bpy

    known = {"version": bpy.app.version_string, "usable": bpy.app.version[:2] >= LEAST_VERSION}
    print(json.dumps(known), file=answers, flush=True)
    for line in sys.stdin.buffer:
        request = json.loads(line)
        try:
            answer = {"read": read, "write": write}[request["do"]](request)
        except CannotError as problem:
            answer = {"error": str(problem)}
        except Exception as problem:  # whatever a file does, the next one is read
            said = str(problem).strip().removeprefix("Error: ")
            answer = {"error": f"Blender says: {said or type(problem).__name__}"}
        print(json.dumps(answer), file=answers, flush=True)
    shutil.rmtree(sys.argv[-1], ignore_errors=True)  # also where who asked was killed


def read(request: dict[str, Any]) -> dict[str, Any]:
    """Import a file, and save the matrices of each skeleton's bones in each take."""
    import bpy

    _empty(request.get("scene_fps") or DEFAULT_FPS)
    suffix = os.path.splitext(request["path"])[1].lower()  # noqa: PTH122 - as it stands
    operator, told = IMPORTERS[suffix]
    run = getattr(bpy.ops.wm, operator, None)
    if run is None or operator not in dir(bpy.ops.wm):
        raise CannotError(
            f"Expected a Blender that reads {suffix}, but {bpy.app.version_string} does not"
            + (": Collada is in versions before 5.0." if suffix == ".dae" else ".")
        )
    known = run.get_rna_type().properties.keys()
    before = set(bpy.data.objects)
    done = run(filepath=request["path"], **{key: told[key] for key in told if key in known})
    if "FINISHED" not in done:
        raise CannotError("Expected a whole file, but Blender could not import it.")
    objects = [thing for thing in bpy.data.objects if thing not in before]
    skeletons = [thing for thing in objects if thing.type == "ARMATURE" and thing.data.bones]
    kinds: dict[str, int] = {}
    for thing in objects:
        kinds[thing.type.lower()] = kinds.get(thing.type.lower(), 0) + 1
    arrays: dict[str, Any] = {}
    clips: list[dict[str, Any]] = []
    if skeletons:
        for skeleton in skeletons:
            _loosen(skeleton)
        scene = _Scene(objects, request.get("fps"))
        for take in scene.takes:
            scene.play(take)
            for skeleton in skeletons:
                clip = scene.sampled(skeleton, take)
                if clip is not None:
                    key = str(len(clips))
                    arrays |= {f"{name}_{key}": array for name, array in clip.pop("arrays").items()}
                    clips.append(clip)
    with open(request["out"], "wb") as file:  # noqa: PTH123 - numpy adds a suffix to paths
        np.savez(file, **arrays)
    return {"clips": clips, "skeletons": [thing.name for thing in skeletons], "objects": kinds}


class _Scene:
    """What was imported: objects, and the actions that move them, take by take."""

    def __init__(self, objects: list[Any], wanted_fps: float | None) -> None:
        import bpy

        self.wanted_fps = wanted_fps
        render = bpy.context.scene.render
        self.fps = render.fps / render.fps_base
        self.objects = objects
        self._rest = {}
        self.actions: dict[str, dict[str, tuple[Any, Any]]] = {}
        meshes = [thing for thing in objects if thing.type == "MESH"]
        self.objects = [thing for thing in objects if thing.type != "MESH"]
        for thing in self.objects:
            if thing.animation_data:
                thing.animation_data.action = None
            bones = thing.pose.bones if thing.type == "ARMATURE" else ()
            self._rest[thing.name] = (
                thing.matrix_basis.copy(),
                [b.matrix_basis.copy() for b in bones],
            )
        bpy.data.batch_remove(meshes)
        names = {thing.name for thing in self.objects}
        for action in bpy.data.actions:
            for slot in action.slots:
                moved = slot.identifier[2:]
                if slot.identifier[:2] == "OB" and moved in names and len(_curves(action, slot)):
                    take = action.name.removeprefix(f"{moved}|")
                    self.actions.setdefault(take, {})[moved] = (action, slot)
        self.takes = list(self.actions)

    def play(self, take: str) -> None:
        """Give each object its action of a take; what has none rests."""
        for thing in self.objects:
            basis, bones = self._rest[thing.name]
            thing.matrix_basis = basis
            for i, matrix in enumerate(bones):
                thing.pose.bones[i].matrix_basis = matrix
            own = self.actions[take].get(thing.name)
            if own is not None:
                data = thing.animation_data_create()
                data.action, data.action_slot = own
            elif thing.animation_data:
                thing.animation_data.action = None

    def sampled(self, skeleton: Any, take: str) -> dict[str, Any] | None:
        """Return the matrices of a skeleton's bones in a take; None if nothing moves it."""
        own = self.actions[take]
        movers = [thing.name for thing in (skeleton, *_above(skeleton)) if thing.name in own]
        curves = [curve for name in movers for curve in _curves(*own[name])]
        if not curves:
            return None
        tracks = [_keys(curve) for curve in curves]
        times, fps, keyed = _times([keys for keys, _ in tracks], self.fps, self.wanted_fps)
        bones = skeleton.data.bones
        index = {bone.name: i for i, bone in enumerate(bones)}
        rest = np.array([bone.matrix_local for bone in bones], dtype=np.float64)
        worlds = self._worked_out(skeleton, own, times)
        if worlds is None or not self._right(skeleton, worlds, times):
            worlds = self._played(skeleton, times)
        objects, poses = worlds
        where = np.eye(4)
        for thing in (skeleton, *_above(skeleton)):
            where = (
                np.array(thing.matrix_parent_inverse) @ np.array(self._rest[thing.name][0]) @ where
            )
        return {
            "take": take,
            "skeleton": skeleton.name,
            "names": [bone.name for bone in bones],
            "parents": [index[bone.parent.name] if bone.parent else -1 for bone in bones],
            "fps": fps,
            "keyed": keyed,
            "arrays": {
                "rest": where @ rest,
                "worlds": (objects[:, None] @ poses)[..., :3, :].astype(np.float32),
                "object": where,
                "objects": objects[:, :3, :].astype(np.float32),
            },
        }

    def _worked_out(
        self, skeleton: Any, own: dict[str, tuple[Any, Any]], times: Array
    ) -> tuple[Array, Array] | None:
        """Return matrices by the rules of plain skeletons; None where others hold.

        Blender's own evaluation takes about a millisecond for each frame.
        """
        world = np.tile(np.eye(4), (len(times), 1, 1))
        for thing in reversed([skeleton, *_above(skeleton)]):
            if thing.constraints or (thing.parent and thing.parent_type != "OBJECT"):
                return None
            moved = _moved(thing, "", _by_path(own.get(thing.name)), times)
            if moved is None:
                return None
            world = world @ np.array(thing.matrix_parent_inverse) @ moved
        curves = _by_path(own.get(skeleton.name))
        bones = skeleton.data.bones
        poses = np.empty((len(times), len(bones), 4, 4))
        index = {bone.name: i for i, bone in enumerate(bones)}
        for i, bone in enumerate(bones):
            posed = skeleton.pose.bones[i]
            plain = bone.inherit_scale == "FULL" and bone.use_inherit_rotation
            if posed.constraints or posed.name != bone.name or not plain:
                return None
            moved = _moved(posed, f"{posed.path_from_id()}.", curves, times)
            if moved is None:
                return None
            rest = np.array(bone.matrix_local, dtype=np.float64)
            if bone.parent is None:
                poses[:, i] = rest @ moved
            else:
                above = np.array(bone.parent.matrix_local, dtype=np.float64)
                poses[:, i] = (
                    poses[:, index[bone.parent.name]] @ np.linalg.solve(above, rest) @ moved
                )
        return world, poses

    def _right(
        self,
        skeleton: Any,
        worlds: tuple[Array, Array],
        times: Array,
    ) -> bool:
        """Tell whether Blender poses some of the frames so, too."""
        some = np.unique(np.linspace(0, len(times) - 1, CHECKED).astype(int))
        objects, poses = self._played(skeleton, times[some])
        theirs = objects[:, None] @ poses
        ours = worlds[0][some][:, None] @ worlds[1][some]
        size = max(float(np.ptp(theirs[..., :3, 3], axis=(0, 1)).max()), 1e-6)
        scale = max(float(np.abs(theirs[..., :3, :3]).max()), 1e-12)
        far = float(np.abs(ours - theirs)[..., :3, 3].max()) / size
        turned = float(np.abs(ours - theirs)[..., :3, :3].max()) / scale
        return far < AGREE and turned < AGREE

    def _played(self, skeleton: Any, times: Array) -> tuple[Array, Array]:
        """Return the matrices (F, 4, 4) of an object, and (F, B, 4, 4) of its bones on it."""
        import bpy

        scene, bones = bpy.context.scene, skeleton.pose.bones
        objects = np.empty((len(times), 4, 4))
        poses = np.empty((len(times), len(bones), 4, 4))
        flat = np.empty(len(bones) * 16, dtype=np.float32)
        for frame, time in enumerate(times):
            whole = int(np.floor(time))
            scene.frame_set(whole, subframe=float(min(time - whole, 0.999999)))
            bones.foreach_get("matrix", flat)
            poses[frame] = flat.reshape(-1, 4, 4).transpose(0, 2, 1)
            objects[frame] = np.array(skeleton.matrix_world)
        return objects, poses


def _loosen(skeleton: Any) -> None:
    """Let bones move against their parents: importers connect those that touch in the rest pose."""
    import bpy

    if not any(bone.use_connect for bone in skeleton.data.bones):
        return
    skeleton.hide_set(False)
    bpy.context.view_layer.objects.active = skeleton
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in skeleton.data.edit_bones:
        bone.use_connect = False
    bpy.ops.object.mode_set(mode="OBJECT")


def _above(thing: Any) -> Iterator[Any]:
    """Yield the parents of an object, the nearest first."""
    while thing.parent is not None:
        thing = thing.parent
        yield thing


def _curves(action: Any, slot: Any) -> list[Any]:
    """Return the curves of an action that move what its slot is for."""
    return [
        curve
        for layer in action.layers
        for strip in layer.strips
        if (bag := strip.channelbag(slot)) is not None
        for curve in bag.fcurves
        if len(curve.keyframe_points)
    ]


def _by_path(own: tuple[Any, Any] | None) -> dict[tuple[str, int], Any]:
    curves = _curves(*own) if own is not None else []
    return {(curve.data_path, curve.array_index): curve for curve in curves}


def _keys(curve: Any) -> tuple[Array, Array]:
    """Return the times, in frames of the scene, and the values of a curve's keys."""
    points = curve.keyframe_points
    flat = np.empty(2 * len(points), dtype=np.float32)
    points.foreach_get("co", flat)
    pairs = flat.reshape(-1, 2).astype(np.float64)
    return pairs[:, 0], pairs[:, 1]


def _times(
    keys: list[Array], scene_fps: float, wanted_fps: float | None
) -> tuple[Array, float, bool]:
    """Return when to sample, in frames of the scene, at what rate, and whether keys say so.

    Unless a rate is wanted that is where the keys are, if they are as dense as the scene's frames
    or denser; a step that is a hair off the scene's is a rate such as 29.97.
    """
    start = min(float(times[0]) for times in keys)
    end = max(float(times[-1]) for times in keys)
    together = np.unique(np.round(np.concatenate(keys), 3))
    keyed = False
    step = 1.0 if wanted_fps is None else scene_fps / wanted_fps
    if len(together) > 1 and wanted_fps is None:
        apart = np.diff(together)
        usual = float(np.median(apart[apart > EVEN]))
        count = max(round((end - start) / usual), 1)
        exact = (end - start) / count
        even = np.abs((together - start) / exact - np.round((together - start) / exact)).max()
        if even < EVEN and exact < 1 + EVEN:
            step, keyed = exact, True
    count = int((end - start) / step + EVEN) + 1
    return start + step * np.arange(count), scene_fps / step, keyed


def _moved(thing: Any, path: str, curves: dict[tuple[str, int], Any], times: Array) -> Array | None:
    """Return what an object's or a bone's own channels do, (F, 4, 4); None for unusual ones."""

    def values(name: str, count: int) -> Array:
        found = np.tile(np.array(getattr(thing, name), dtype=np.float64), (len(times), 1))
        for axis in range(count):
            curve = curves.get((path + name, axis))
            if curve is not None:
                found[:, axis] = _evaluated(curve, times)
        return found

    matrices = np.tile(np.eye(4), (len(times), 1, 1))
    if thing.rotation_mode == "QUATERNION":
        turns = _of_quaternions(values("rotation_quaternion", 4))
    elif thing.rotation_mode == "AXIS_ANGLE":
        return None
    else:
        turns = _of_euler(values("rotation_euler", 3), thing.rotation_mode)
    matrices[:, :3, :3] = turns * values("scale", 3)[:, None, :]
    matrices[:, :3, 3] = values("location", 3)
    return matrices


def _evaluated(curve: Any, times: Array) -> Array:
    """Return a curve's values: its keys where those are, or on the way if that is straight."""
    keys, values = _keys(curve)
    near = keys[np.clip(np.searchsorted(keys, times), 0, len(keys) - 1)]
    before = keys[np.clip(np.searchsorted(keys, times) - 1, 0, len(keys) - 1)]
    off = np.minimum(np.abs(near - times), np.abs(before - times))
    outside = (times <= keys[0]) | (times >= keys[-1])
    flat = curve.extrapolation == "CONSTANT" and not len(curve.modifiers)
    if flat and bool(((off < EVEN) | outside).all()):
        return np.asarray(np.interp(times, keys, values))
    return np.array([curve.evaluate(time) for time in times.tolist()])


def _of_quaternions(quat_wxyz: Array) -> Array:
    lengths = np.linalg.norm(quat_wxyz, axis=1, keepdims=True)
    w, x, y, z = (quat_wxyz / np.where(lengths > 0, lengths, 1.0)).T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return np.moveaxis(np.array(rows), -1, 0)


def _of_euler(angles_rad: Array, order: str) -> Array:
    """Return the rotations of angles about x, y and z; of ``"XYZ"`` that about x is the first."""
    turns = np.tile(np.eye(3), (len(angles_rad), 1, 1))
    for letter in order:
        axis = "XYZ".index(letter)
        one, other = (axis + 1) % 3, (axis + 2) % 3
        turn = np.tile(np.eye(3), (len(angles_rad), 1, 1))
        cosine, sine = np.cos(angles_rad[:, axis]), np.sin(angles_rad[:, axis])
        turn[:, one, one] = turn[:, other, other] = cosine
        turn[:, other, one], turn[:, one, other] = sine, -sine
        turns = turn @ turns
    return turns


def write(request: dict[str, Any]) -> dict[str, Any]:
    """Build a skeleton and its action from arrays, and export them as FBX."""
    import bpy

    _empty(request["fps"])
    with np.load(request["arrays"], allow_pickle=False) as file:
        heads, tails, quat_wxyz, shifts = (
            file[name] for name in ("heads", "tails", "quat_wxyz", "shifts")
        )
    names, parents, shifting = request["names"], request["parents"], request["shifting"]
    scene = bpy.context.scene
    scene.unit_settings.system = "METRIC"
    scene.unit_settings.scale_length = request["unit_m"]
    scene.frame_start, scene.frame_end = 0, len(quat_wxyz) - 1
    data = bpy.data.armatures.new(request["name"])
    skeleton = bpy.data.objects.new(request["name"], data)
    skeleton.rotation_euler = (np.pi / 2 if request["up"] == "y" else 0.0, 0.0, 0.0)
    scene.collection.objects.link(skeleton)
    bpy.context.view_layer.objects.active = skeleton
    skeleton.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    for name, parent, head, tail in zip(names, parents, heads, tails, strict=True):
        bone = data.edit_bones.new(name)
        bone.head, bone.tail = head, tail
        if parent >= 0:
            bone.parent = data.edit_bones[parent]
    given = [bone.name for bone in data.edit_bones]
    bpy.ops.object.mode_set(mode="OBJECT")
    if len(data.bones) != len(names):
        raise CannotError(f"Expected {len(names)} bones, but Blender made {len(data.bones)}.")
    _animate(skeleton, given, quat_wxyz, shifts, shifting)
    scene.frame_set(-1)  # the file's nodes stand as the skeleton does now
    bpy.ops.export_scene.fbx(
        filepath=request["path"],
        object_types={"ARMATURE"},
        add_leaf_bones=False,
        apply_scale_options="FBX_SCALE_ALL",
        bake_anim_use_nla_strips=False,
        bake_anim_use_all_actions=False,
        bake_anim_use_all_bones=True,
        bake_anim_simplify_factor=0.0,
        axis_up="Y" if request["up"] == "y" else "Z",
        axis_forward="-Z" if request["up"] == "y" else "Y",
    )
    renamed = [pair for pair in zip(names, given, strict=True) if pair[0] != pair[1]]
    return {"renamed": renamed}


def _animate(
    skeleton: Any,
    names: list[str],
    quat_wxyz: Array,
    shifts: Array,
    shifting: list[int],
) -> None:
    """Key the turns (F, J, 4) of all bones, and the shifts (F, K, 3) of some, from their rest.

    Both are in the skeleton's axes; a bone's own channels are in those of its rest. The frame
    before the first one is the rest pose.
    """
    import bpy

    action = bpy.data.actions.new(skeleton.name)
    slot = action.slots.new("OBJECT", skeleton.name)
    bag = action.layers.new("motion").strips.new(type="KEYFRAME").channelbag(slot, ensure=True)
    data = skeleton.animation_data_create()
    data.action, data.action_slot = action, slot
    keys = np.zeros((len(quat_wxyz) + 1, 2), dtype=np.float32)
    keys[:, 0] = np.arange(len(keys)) - 1

    def key(path: str, values: Array, rest: tuple[float, ...]) -> None:
        for axis in range(values.shape[1]):
            curve = bag.fcurves.new(path, index=axis)
            curve.keyframe_points.add(len(keys))
            keys[0, 1], keys[1:, 1] = rest[axis], values[:, axis]
            curve.keyframe_points.foreach_set("co", keys.ravel())
            curve.keyframe_points.foreach_set("interpolation", np.ones(len(keys), dtype=np.int32))
            curve.update()

    for i, name in enumerate(names):
        bone = skeleton.pose.bones[name]
        bone.rotation_mode = "QUATERNION"
        turned = np.array(bone.bone.matrix_local.to_3x3(), dtype=np.float64)
        local = quat_wxyz[:, i].copy()
        local[:, 1:] = local[:, 1:] @ turned  # the axis of a turn, seen from the bone
        key(f"{bone.path_from_id()}.rotation_quaternion", local, (1.0, 0.0, 0.0, 0.0))
        if i in shifting:
            moved = shifts[:, shifting.index(i)] @ turned
            key(f"{bone.path_from_id()}.location", moved, (0.0, 0.0, 0.0))


def _empty(fps: float) -> None:
    """Leave nothing of the file before, and set the rate of the scene."""
    import bpy

    for kind in KINDS:
        things = list(getattr(bpy.data, kind))
        if things:
            bpy.data.batch_remove(things)
    render = bpy.context.scene.render
    render.fps = max(1, round(fps))
    render.fps_base = render.fps / fps
    bpy.context.scene.unit_settings.scale_length = 1.0
    bpy.context.scene.frame_set(0)  # objects stand as in their first frame, which is later


if __name__ == "__main__":
    main()
