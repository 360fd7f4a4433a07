import dataclasses
import json
import struct

import numpy as np
import pytest
from hypothesis import given
from scipy.spatial.transform import Rotation
from strategies import clips

from mocapdb.io.conventions import to_bvh_convention
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics, to_metres
from mocapdb.motion.rotations import elementary
from mocapdb.scenes import write_animation
from mocapdb.scenes.gltf import RootTrack, glb_bytes

NUMBERS = {5126: "<f4", 5123: "<u2", 5125: "<u4"}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Glb:
    """A file read back, by the letter of the specification."""

    def __init__(self, data):
        magic, version, size = struct.unpack_from("<4sII", data)
        assert (magic, version, size) == (b"glTF", 2, len(data))
        length, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON"
        self.document = json.loads(data[20 : 20 + length])
        binary, kind = struct.unpack_from("<I4s", data, 20 + length)
        assert kind == b"BIN\0"
        self.binary = data[28 + length :]
        assert len(self.binary) == binary == self.document["buffers"][0]["byteLength"]

    def array(self, accessor):
        about = self.document["accessors"][accessor]
        view = self.document["bufferViews"][about["bufferView"]]
        assert view["byteOffset"] % 4 == 0
        width = WIDTHS[about["type"]]
        start = view["byteOffset"]
        raw = self.binary[start : start + view["byteLength"]]
        values = np.frombuffer(raw, NUMBERS[about["componentType"]]).reshape(about["count"], width)
        for key, least in (("min", values.min(axis=0)), ("max", values.max(axis=0))):
            if key in about:
                np.testing.assert_array_equal(least, about[key])
        return values

    def world(self, frame):
        """(N, 4, 4) where each node is at a frame."""
        nodes = self.document["nodes"]
        (animation,) = self.document["animations"]
        local = []
        for node in nodes:
            matrix = np.eye(4)
            matrix[:3, 3] = node.get("translation", (0, 0, 0))
            local.append(matrix)
        for channel in animation["channels"]:
            values = self.array(animation["samplers"][channel["sampler"]]["output"])[frame]
            matrix = local[channel["target"]["node"]]
            if channel["target"]["path"] == "rotation":
                matrix[:3, :3] = Rotation.from_quat(values).as_matrix()
            else:
                matrix[:3, 3] = values
        for number, node in enumerate(nodes):
            for child in node.get("children", ()):
                assert child > number
                local[child] = local[number] @ local[child]
        return np.stack(local)


def check(clip, tolerance_m):
    glb = Glb(glb_bytes(clip))
    names = [node["name"] for node in glb.document["nodes"]]
    skeleton = clip.skeleton
    positions = to_metres(skeleton, forward_kinematics(skeleton, clip.channels).positions)
    for frame in (0, len(clip) - 1):
        world = glb.world(frame)
        for joint, own_name in enumerate(skeleton.names):
            name = own_name
            if skeleton.convention == "acclaim":
                # a bone ends in its joint: where its children are, or its End Site
                if joint == 0:
                    continue
                ends = skeleton.children[joint]
                name = skeleton.names[ends[0]] if ends else f"{own_name}_End"
            np.testing.assert_allclose(
                world[names.index(name), :3, 3], positions[frame, joint], atol=tolerance_m
            )
    return glb


def test_joints_are_where_they_were(synthetic_walk):
    glb = check(synthetic_walk[:40], 1e-5)
    times = glb.array(glb.document["animations"][0]["samplers"][0]["input"])
    np.testing.assert_allclose(times[:, 0], np.arange(40) / synthetic_walk.fps, rtol=1e-6)


@given(clips())
def test_joints_of_any_clip_are_where_they_were(clip):
    reach = 1 + np.abs(clip.channels).max() * clip.skeleton.metres_per_unit
    check(clip, 1e-5 * reach)


def test_the_skin_follows_the_joints(synthetic_walk):
    glb = Glb(glb_bytes(synthetic_walk[:10]))
    (skin,) = glb.document["skins"]
    (primitive,) = glb.document["meshes"][0]["primitives"]
    attributes = {name: glb.array(number) for name, number in primitive["attributes"].items()}
    inverse = glb.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
    bound = attributes["JOINTS_0"][:, 0]
    assert bound.max() < len(skin["joints"])
    np.testing.assert_array_equal(attributes["WEIGHTS_0"].sum(axis=1), 1.0)
    np.testing.assert_allclose(np.linalg.norm(attributes["NORMAL"], axis=1), 1.0, atol=1e-6)
    assert glb.array(primitive["indices"]).max() < len(bound)
    world = glb.world(5)[: len(inverse)] @ inverse
    points = np.einsum("vij,vj->vi", world[bound, :3, :3], attributes["POSITION"])
    points += world[bound, :3, 3]
    skeleton = synthetic_walk.skeleton
    joints = to_metres(
        skeleton, forward_kinematics(skeleton, synthetic_walk.channels[5:6]).positions
    )[0]
    nearest = np.linalg.norm(points[:, None] - joints[None], axis=-1).min(axis=1)
    assert nearest.max() < 0.3  # half of the longest bone
    assert points[:, 1].min() > -0.15
    assert points[:, 1].max() < 2.0


def test_rotations_never_jump(synthetic_walk):
    glb = Glb(glb_bytes(synthetic_walk))
    (animation,) = glb.document["animations"]
    for channel in animation["channels"]:
        if channel["target"]["path"] == "rotation":
            quats = glb.array(animation["samplers"][channel["sampler"]]["output"]).astype(float)
            assert (np.einsum("fi,fi->f", quats[1:], quats[:-1]) > 0).all()


@pytest.mark.parametrize("up", ["y", "z"])
def test_root_motion_on_a_bone_of_its_own(synthetic_walk, up):
    clip = to_bvh_convention(synthetic_walk[:20])
    skeleton = dataclasses.replace(clip.skeleton, up=up)
    clip = Clip(skeleton, clip.channels, clip.fps)
    heading = np.linspace(0.2, 0.9, len(clip))
    path = np.outer(np.linspace(0, 1, len(clip)), [30.0, 2.0, -10.0])
    glb = Glb(glb_bytes(clip, RootTrack(path, heading)))
    assert glb.document["nodes"][0]["name"] == "root_motion"
    assert glb.document["skins"][0]["joints"][0] == 0
    inverse = glb.array(glb.document["skins"][0]["inverseBindMatrices"])
    assert len(inverse) == len(glb.document["skins"][0]["joints"])
    positions = forward_kinematics(skeleton, clip.channels).positions
    turned = elementary(skeleton.up_axis, heading)
    carried = to_metres(skeleton, np.einsum("fij,fkj->fki", turned, positions) + path[:, None])
    names = [node["name"] for node in glb.document["nodes"]]
    for frame in (0, 11):
        world = glb.world(frame)
        for joint in (3, 19):
            here = world[names.index(skeleton.names[joint]), :3, 3]
            np.testing.assert_allclose(here, carried[frame, joint], atol=1e-5)


def test_other_readers_understand_it(synthetic_walk, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    path = tmp_path / "walk.glb"
    write_animation(synthetic_walk[:10], path)
    scene = trimesh.load(path)
    (mesh,) = scene.geometry.values()
    assert mesh.faces.max() < len(mesh.vertices)
    assert mesh.volume > 0.01  # triangles face outwards
