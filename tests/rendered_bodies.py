"""Armatures as Blender's Cycles renders them: bones as solids, for armatures are not rendered."""

from __future__ import annotations

import numpy as np

THICKNESS = 0.12  # of a bone's length
WIDEST = 0.05  # metres


def render(bpy, owner, frame, path, *, size=(120, 160), samples=4):
    """Render an armature at a frame from its side, alone, and return the picture (H, W, 4)."""
    scene = bpy.context.scene
    scene.frame_set(frame)
    solid = body(bpy, owner, (0.2, 0.45, 0.8))
    others = [each for each in scene.objects if each is not solid and not each.hide_render]
    for each in others:
        each.hide_render = True
    points = np.array([vertex.co[:] for vertex in solid.data.vertices])
    scene.render.resolution_x, scene.render.resolution_y = size
    look_at(bpy, points.min(axis=0), points.max(axis=0), side=(1.0, -1.0, 0.2))
    picture = shoot(bpy, path, samples)
    bpy.data.objects.remove(solid)
    for each in others:
        each.hide_render = False
    return picture


def body(bpy, owner, colour, *, bones=None, moved=(0.0, 0.0, 0.0)):
    """Make a mesh of an armature's bones, or some, as they stand now in the world, and move it."""
    posed = owner.evaluated_get(bpy.context.evaluated_depsgraph_get())
    world = np.array(posed.matrix_world)
    vertices, faces = [], []
    for bone in posed.pose.bones:
        if bones is not None and bone.name not in bones:
            continue
        matrix = world @ np.array(bone.matrix)
        axes = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
        head = matrix[:3, 3] + moved
        tail = world[:3, :3] @ np.array(bone.tail) + world[:3, 3] + moved
        length = float(np.linalg.norm(tail - head))
        wide = min(THICKNESS * length, WIDEST) + 0.01
        middle = head + 0.15 * (tail - head)
        first = len(vertices)
        ring = [middle + wide * (x * axes[:, 0] + z * axes[:, 2])
                for x, z in ((1, 0), (0, 1), (-1, 0), (0, -1))]  # fmt: skip
        vertices += [head - 0.01 * axes[:, 1], *ring, tail]
        for i in range(4):
            a, b = first + 1 + i, first + 1 + (i + 1) % 4
            faces += [(first, b, a), (first + 5, a, b)]
    mesh = bpy.data.meshes.new("Body")
    mesh.from_pydata([vertex.tolist() for vertex in vertices], [], faces)
    material = bpy.data.materials.new("Body")
    material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*colour, 1.0)
    mesh.materials.append(material)
    made = bpy.data.objects.new("Body", mesh)
    bpy.context.scene.collection.objects.link(made)
    return made


def look_at(bpy, low, high, side):
    """Let the camera see a box from a side, without perspective, in light."""
    from mathutils import Vector

    scene = bpy.context.scene
    if scene.camera is None:
        scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        scene.collection.objects.link(scene.camera)
        light = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
        light.rotation_euler = (0.7, 0.3, 0.5)
        light.data.energy = 4.0
        scene.collection.objects.link(light)
        scene.world = scene.world or bpy.data.worlds.new("World")
        scene.world.color = (0.5, 0.5, 0.5)
    centre = (low + high) / 2
    way = Vector(side).normalized()
    reach = float(np.linalg.norm(high - low))
    scene.camera.location = Vector(centre.tolist()) + 3 * reach * way
    scene.camera.rotation_euler = way.to_track_quat("Z", "Y").to_euler()
    scene.camera.data.type = "ORTHO"
    scene.camera.data.clip_end = 10 * reach
    across = np.cross([0, 0, 1], np.array(way))
    across /= np.linalg.norm(across)
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1])
                        for z in (low[2], high[2])])  # fmt: skip
    render = scene.render
    wide, tall = np.ptp(corners @ across), np.ptp(corners[:, 2]) + 0.2
    aspect = render.resolution_x / render.resolution_y
    scene.camera.data.ortho_scale = 1.1 * float(
        max(wide, tall * aspect) if aspect >= 1 else max(wide / aspect, tall)
    )


def shoot(bpy, path, samples):
    """Render the scene into a file on a clear ground, and return the picture (H, W, 4)."""
    scene = bpy.context.scene
    render = scene.render
    render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.device = samples, "CPU"
    scene.cycles.use_denoising = False
    render.resolution_percentage = 100
    render.film_transparent = True
    render.image_settings.file_format = "PNG"
    render.image_settings.color_mode = "RGBA"
    render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    picture = np.array(image.pixels[:]).reshape(image.size[1], image.size[0], 4)[::-1]
    bpy.data.images.remove(image)
    return picture
