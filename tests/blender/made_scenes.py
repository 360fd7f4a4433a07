"""Runs inside Blender: makes files as others export them. Arguments: folder, names of scenes."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import bpy


def armature(name, *, bones=3, along=(0, 0, 1.0)):
    data = bpy.data.armatures.new(name)
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing
    bpy.ops.object.mode_set(mode="EDIT")
    above = None
    for i in range(bones):
        bone = data.edit_bones.new(f"bone{i}")
        bone.head = [i * axis for axis in along]
        bone.tail = [(i + 1) * axis for axis in along]
        bone.parent, above = above, bone
    bpy.ops.object.mode_set(mode="OBJECT")
    return thing


def act(thing, name, frames, *, speed=0.1, walks=False, first=1):
    """Turn the second bone; the object may walk, too."""
    action = bpy.data.actions.new(name)
    thing.animation_data_create().action = action
    bone = thing.pose.bones[1]
    bone.rotation_mode = "QUATERNION"
    for frame in range(frames):
        half = speed * frame / 2
        bone.rotation_quaternion = (math.cos(half), math.sin(half), 0, 0)
        bone.keyframe_insert("rotation_quaternion", frame=frame + first)
        if walks:
            thing.location = (0.1 * frame, 0, 0)
            thing.rotation_euler = (0, 0, 0.05 * frame)
            thing.keyframe_insert("location", frame=frame + first)
            thing.keyframe_insert("rotation_euler", frame=frame + first)
    return action


def on_strips(thing, actions):
    """Put actions on strips, one a track: each becomes a take."""
    thing.animation_data.action = None
    for action in actions:
        track = thing.animation_data.nla_tracks.new()
        track.name = action.name
        track.strips.new(action.name, 1, action).name = action.name


def skin(thing):
    """A triangle that all bones move, with a picture from elsewhere."""
    mesh = bpy.data.meshes.new("skin")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 0, 1)], [], [(0, 1, 2)])
    body = bpy.data.objects.new("body", mesh)
    bpy.context.scene.collection.objects.link(body)
    body.parent = thing
    body.modifiers.new("skin", "ARMATURE").object = thing
    for bone in thing.data.bones:
        body.vertex_groups.new(name=bone.name).add([0, 1, 2], 0.5, "REPLACE")
    return body


def export(path, **told):
    bpy.context.scene.frame_set(1)  # as things stand now is the file's rest
    usual = {"add_leaf_bones": False, "bake_anim_use_all_actions": False,
             "bake_anim_use_nla_strips": False, "bake_anim_simplify_factor": 0.0}  # fmt: skip
    bpy.ops.export_scene.fbx(filepath=str(path), **(usual | told))


def takes(folder):
    thing = armature("Ann")
    actions = [act(thing, "Walk", 10), act(thing, "Rün", 15, speed=0.2)]
    on_strips(thing, actions)
    export(folder / "takes.fbx", bake_anim_use_nla_strips=True)


def actors(folder):
    one, other = armature("Ann"), armature("Bob", bones=4)
    act(one, "Duel", 10)
    act(other, "Duel", 10, speed=-0.1)
    export(folder / "actors.fbx")


def walking_object(folder):
    thing = armature("Ann")
    act(thing, "Walk", 12, walks=True)
    export(folder / "walking.fbx")


def on_a_moving_parent(folder):
    thing = armature("Ann")
    act(thing, "Walk", 12)
    carrier = bpy.data.objects.new("cart", None)
    bpy.context.scene.collection.objects.link(carrier)
    thing.parent = carrier
    thing.location = (0, 0, 0.5)
    for frame in range(12):
        carrier.location = (0, 0.1 * frame, 0)
        carrier.keyframe_insert("location", frame=frame + 1)
    export(folder / "carried.fbx")


def pose_only(folder):
    armature("Ann")
    export(folder / "pose.fbx", bake_anim=False)


def no_skeleton(folder):
    bpy.ops.mesh.primitive_cube_add()
    export(folder / "cube.fbx")


def with_picture(folder):
    thing = armature("Ann")
    act(thing, "Walk", 10)
    body = skin(thing)
    picture = folder / "elsewhere" / "picture.png"
    picture.parent.mkdir()
    image = bpy.data.images.new("picture", 4, 4)
    image.filepath_raw, image.file_format = str(picture), "PNG"
    image.save()
    material = bpy.data.materials.new("cloth")
    material.use_nodes = True
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    surface = material.node_tree.nodes["Principled BSDF"]
    material.node_tree.links.new(texture.outputs["Color"], surface.inputs["Base Color"])
    body.data.materials.append(material)
    export(folder / "picture.fbx")


def dense(folder):
    """Keys at 120 Hz in a scene of 30."""
    thing = armature("Ann")
    action = act(thing, "Walk", 41, speed=0.05)
    for layer in action.layers:
        for strip in layer.strips:
            for curve in strip.channelbag(action.slots[0]).fcurves:
                for key in curve.keyframe_points:
                    key.co[0] = 1 + (key.co[0] - 1) / 4
                    key.interpolation = "LINEAR"
    bpy.context.scene.render.fps = 30
    bpy.context.scene.frame_end = 11
    export(folder / "dense.fbx", bake_anim_step=0.25)


def large_unit(folder):
    thing = armature("Ann", along=(0, 0, 10.0))
    bpy.context.scene.unit_settings.scale_length = 0.0254
    act(thing, "Walk", 10)
    export(folder / "inches.fbx", apply_scale_options="FBX_SCALE_ALL")
    export(folder / "usual_scale.fbx")


def others(folder):
    """USD, and Collada where this Blender writes it."""
    thing = armature("Ann")
    act(thing, "Walk", 10)
    skin(thing)
    bpy.context.scene.render.fps = 25
    bpy.context.scene.frame_end = 10
    bpy.ops.wm.usd_export(filepath=str(folder / "walk.usda"), export_animation=True)
    bpy.ops.wm.usd_export(filepath=str(folder / "walk.usdc"), export_animation=True)
    if "collada_export" in dir(bpy.ops.wm):
        bpy.ops.wm.collada_export(filepath=str(folder / "walk.dae"))


def main():
    folder = Path(sys.argv[-1])
    for make in (takes, actors, walking_object, on_a_moving_parent, pose_only, no_skeleton,
                 with_picture, dense, large_unit, others):  # fmt: skip
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.context.scene.frame_end = 20
        make(folder)


main()
