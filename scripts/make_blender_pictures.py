#!/usr/bin/env python3
"""Render the pictures of docs/blender.md, from synthetic motion, in the Blender that bpy is.

.venv-blender/bin/python scripts/make_blender_pictures.py
"""

from __future__ import annotations

import importlib.util
import os
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from mocapdb.corpus import synthetic
from mocapdb.io import write_clip

ROOT = Path(__file__).resolve().parents[1]
PICTURES = ROOT / "docs" / "pictures"
GREY, BLUE, RED, PALE = (0.35, 0.35, 0.37), (0.08, 0.25, 0.6), (0.75, 0.08, 0.05), (0.7, 0.75, 0.8)
SAMPLES = 48

sys.path.insert(0, str(ROOT / "tests"))
from in_blender import import_bvh  # noqa: E402
from rendered_bodies import body, look_at, shoot  # noqa: E402


def main() -> None:
    """Render a walk and its loop, a loop of the arms, and a fault and its repair."""
    load_addon()
    with tempfile.TemporaryDirectory() as folder:
        files = Path(folder)
        walk = synthetic.make_clip("walk", seed=1, duration_s=6.0).resample(30)
        write_clip(walk, files / "walk.bvh")
        faulty = synthetic.inject_faults(walk, seed=3, n=2).clip
        write_clip(faulty, files / "faulty.bvh")
        a_walk_and_its_loop(files / "walk.bvh")
        a_fault_and_its_repair(files / "faulty.bvh")
    sys.stdout.flush()
    os._exit(0)  # bpy may wait for ever for its own threads


def load_addon() -> None:
    """Register the add-on from its folder."""
    spec = importlib.util.spec_from_file_location(
        "mocapdb_blender",
        ROOT / "blender" / "__init__.py",
        submodule_search_locations=[str(ROOT / "blender")],
    )
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["mocapdb_blender"] = module
    spec.loader.exec_module(module)
    module.register()


def a_walk_and_its_loop(path: Path) -> None:
    """Render six seconds of a walk, and below as long of the loop; then the arms' alone."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    owner = import_bvh(bpy, path, global_scale=0.0564444)
    along(owner)
    frames = np.linspace(1, 165, 12)
    solids = poses(owner, frames, GREY, lower=0.0)
    bpy.ops.mocapdb.extract()
    solids += poses(owner, frames, BLUE, lower=2.1)
    picture("blender_loop.png", owner, solids, (1200, 560))

    select = sys.modules["mocapdb_blender"].cleaning.compat.select_bone
    upper = below(owner, "lowerback")
    bpy.ops.object.mode_set(mode="POSE")
    for bone in owner.pose.bones:
        select(bone, bone.name in upper)
    bpy.ops.mocapdb.extract()
    rest = {bone.name for bone in owner.data.bones} - upper
    solids = []
    for i, frame in enumerate(np.linspace(1, 34, 7)[:-1]):
        set_frame(frame)
        moved = tuple(0.9 * i * np.array(along(owner)))
        solids.append(body(bpy, owner, PALE, bones=rest, moved=moved))
        solids.append(body(bpy, owner, BLUE, bones=upper, moved=moved))
    bpy.ops.object.mode_set(mode="OBJECT")
    picture("blender_pose_mode.png", owner, solids, (1200, 400))


def a_fault_and_its_repair(path: Path) -> None:
    """Render the frames of the surest fault with its bone in red, and the repaired ones."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    owner = import_bvh(bpy, path, global_scale=0.0564444)
    along(owner)
    source = owner.animation_data.action
    bpy.ops.mocapdb.clean()
    rows = [row for row in bpy.context.scene.mocapdb_clean.faults if row.method != "left"]
    fault = max(rows, key=lambda row: row.confidence)
    repaired = owner.animation_data.action
    frames = np.linspace(fault.start - 4, fault.end + 4, 8)
    wrong = below(owner, fault.name)
    compat = sys.modules["mocapdb_blender"].cleaning.compat
    solids = []
    for action, lower in ((source, 0.0), (repaired, 2.1)):
        compat.assign(owner, action, compat.slot_for(action, owner))
        for i, frame in enumerate(frames):
            set_frame(frame)
            moved = 0.6 * i * np.array(along(owner)) - [0, 0, lower]
            names = {bone.name for bone in owner.data.bones}
            flagged = wrong if fault.start <= frame <= fault.end else set()
            solids.append(body(bpy, owner, GREY, bones=names - flagged, moved=tuple(moved)))
            if flagged:
                colour = RED if action is source else BLUE
                solids.append(body(bpy, owner, colour, bones=flagged, moved=tuple(moved)))
    picture("blender_repair.png", owner, solids, (1200, 560))


def poses(owner, frames, colour, lower):
    """Make solids of an armature at some frames, so much lower."""
    solids = []
    for frame in frames:
        set_frame(frame)
        solids.append(body(bpy, owner, colour, moved=(0.0, 0.0, -lower)))
    return solids


def below(owner, name):
    """Return a bone's name and those of all that hangs on it."""
    bone = owner.data.bones[name]
    return {name, *(child.name for child in bone.children_recursive)}


def along(owner):
    """Return the direction in which bodies are put side by side: where the walk goes, level."""
    if owner.name not in LEVEL:
        LEVEL[owner.name] = way_of(owner)
    return LEVEL[owner.name]


LEVEL: dict[str, tuple[float, float, float]] = {}


def way_of(owner):
    """Return the level direction from the first to the last frame of the imported action."""
    for action in bpy.data.actions:
        if not action.name.startswith(("Periodic", "Cleaned")):
            compat = sys.modules["mocapdb_blender"].cleaning.compat
            now = compat.assigned(owner)
            compat.assign(owner, action, compat.slot_for(action, owner))
            ends = []
            for frame in action.frame_range:
                set_frame(frame)
                ends.append(owner.matrix_world @ owner.pose.bones["lowerback"].head)
            compat.assign(owner, *now)
            way = Vector(ends[1]) - Vector(ends[0])
            way.z = 0.0
            return tuple(way.normalized())
    return (1.0, 0.0, 0.0)


def set_frame(frame):
    """Go to a frame, or between two."""
    bpy.context.scene.frame_set(int(frame), subframe=float(frame % 1))


def picture(name, owner, solids, size):
    """Render solids from the side and keep the picture, on white."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = size
    points = np.array([vertex.co[:] for solid in solids for vertex in solid.data.vertices])
    way = np.array(along(owner))
    side = np.cross(way, [0.0, 0.0, 1.0])
    look_at(bpy, points.min(axis=0), points.max(axis=0), side=(*side[:2], 0.12))
    shoot(bpy, PICTURES / name, SAMPLES)
    on_white(PICTURES / name)
    for solid in solids:
        bpy.data.objects.remove(solid)


def on_white(path):
    """Put a picture on white, and keep it small."""
    from PIL import Image

    with Image.open(path) as image:
        ground = Image.new("RGB", image.size, "white")
        ground.paste(image, mask=image.split()[3])
    ground.quantize(200).save(path, optimize=True)


if __name__ == "__main__":
    main()
