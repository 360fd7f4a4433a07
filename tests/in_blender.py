"""What tests of the add-on do in Blender: bring in files, and see where bones are."""

from __future__ import annotations

import numpy as np


def import_bvh(bpy, path, **options):
    """Import a BVH with Blender's importer, the scene at its rate and as long."""
    chosen = {"update_scene_fps": True, "update_scene_duration": True, **options}
    assert bpy.ops.import_anim.bvh(filepath=str(path), **chosen) == {"FINISHED"}
    return bpy.context.object


def heads(bpy, owner, times):
    """Where Blender shows the heads of the bones, (F, B, 3) in metres, and their tails."""
    scene = bpy.context.scene
    unit = scene.unit_settings.scale_length
    shown = []
    for time in times:
        scene.frame_set(int(np.floor(time)), subframe=float(time - np.floor(time)))
        posed = owner.evaluated_get(bpy.context.evaluated_depsgraph_get())
        world = np.array(posed.matrix_world)
        ends = np.array([[bone.head, bone.tail] for bone in posed.pose.bones])
        shown.append(unit * (ends @ world[:3, :3].T + world[:3, 3]))
    ends = np.array(shown)
    return ends[:, :, 0], ends[:, :, 1]
