"""glTF read: skins that an animation moves."""

from __future__ import annotations

import base64
import json
import struct

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from small_library import run_json

from mocapdb.corpus import synthetic
from mocapdb.errors import FormatError
from mocapdb.io import find_motion_files, read_clip
from mocapdb.io.conventions import to_bvh_convention
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.scenes.gltf import RootTrack, write_glb

TURN = Rotation.from_euler("x", -90, degrees=True)
KEYS = np.array([0.0, 0.5, 1.0])


@pytest.fixture(scope="module")
def walk():
    return synthetic.make_clip("walk", seed=1, duration_s=1.0)


def test_what_mocapdb_writes_comes_back(walk, tmp_path):
    write_glb(walk, tmp_path / "walk.glb")
    clip, expected = read_clip(tmp_path / "walk.glb"), to_bvh_convention(walk)
    assert clip.skeleton.names == expected.skeleton.names
    assert (clip.fps, clip.fps_source, len(clip)) == (120, "file", 120)
    assert np.allclose(clip.positions(), expected.positions(), atol=1e-5)
    assert np.allclose(
        clip.rotations("global", "matrix"), expected.rotations("global", "matrix"), atol=1e-5
    )
    assert np.allclose(
        clip.skeleton.offsets[1:], expected.skeleton.offsets[1:] * 0.0254 / 0.45, atol=1e-6
    )
    assert len(read_clip(tmp_path / "walk.glb", fps=30)) == 30


def test_a_bone_that_carries_the_body_is_kept(walk, tmp_path):
    still = walk.in_place()
    way = walk.positions("file", "file")[:, 0] - still.positions("file", "file")[:, 0]
    write_glb(still, tmp_path / "walk.glb", RootTrack(way, np.zeros(len(walk))))
    clip = read_clip(tmp_path / "walk.glb")
    assert clip.skeleton.names[:2] == ("root_motion", "root")
    assert np.allclose(clip.positions()[:, 1], walk.positions()[:, 0], atol=1e-5)


def document(way="LINEAR", *, outside=False, **change):
    """An arm below an armature in centimetres that is turned, as exporters of games have it."""
    half = Rotation.from_euler("z", [[0], [45], [90]], degrees=True).as_quat()
    values = half
    if way == "CUBICSPLINE":
        values = np.stack([0 * half, half, 0 * half], axis=1).reshape(-1, 4)
    data = KEYS.astype("<f4").tobytes()
    packed = np.round(values * 32767).astype("<i2")  # normalised shorts
    data += packed.tobytes()
    uri = "arm.bin" if outside else "data:;base64," + base64.b64encode(data).decode()
    found = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": uri, "byteLength": len(data)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 12},
            {"buffer": 0, "byteOffset": 12, "byteLength": packed.nbytes},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "SCALAR"},
            {"bufferView": 1, "componentType": 5122, "count": len(values), "type": "VEC4",
             "normalized": True},
        ],
        "nodes": [
            {"name": "Armature", "scale": [0.01] * 3, "rotation": TURN.as_quat().tolist(),
             "children": [1]},
            {"name": "upper", "translation": [0, 0, 100], "children": [2]},
            {"name": "lower", "translation": [30, 0, 0], "children": [3]},
            {"name": "hand", "translation": [25, 0, 0]},
        ],
        "skins": [{"joints": [1, 2, 3]}],
        "animations": [
            {"samplers": [{"input": 0, "output": 1, "interpolation": way}],
             "channels": [{"sampler": 0, "target": {"node": 2, "path": "rotation"}}]}
        ],
    }  # fmt: skip
    return found | change, data


def written(tmp_path, *given, **change):
    text, data = document(*given, **change)
    if change.get("outside"):
        (tmp_path / "arm.bin").write_bytes(data)
        text.pop("outside", None)
    path = tmp_path / "arm.gltf"
    path.write_text(json.dumps(text))
    return path


@pytest.mark.parametrize("outside", [False, True])
def test_what_is_above_the_joints_is_put_into_them(tmp_path, outside):
    clip = read_clip(written(tmp_path, outside=outside), fps=4)
    assert clip.skeleton.names == ("upper", "lower", "hand")
    assert len(clip) == 5
    assert np.allclose(clip.positions()[:, 0], [0, 1, 0], atol=1e-6)  # metres, Y up
    assert np.allclose(clip.positions()[:, 1], [0.3, 1, 0], atol=1e-6)
    angle = np.deg2rad([0, 22.5, 45, 67.5, 90])
    hand = np.stack([0.3 + 0.25 * np.cos(angle), 0 * angle + 1, -0.25 * np.sin(angle)], axis=1)
    assert np.allclose(clip.positions()[:, 2], hand, atol=1e-4)
    rest = forward_kinematics(clip.skeleton, 0 * clip.channels[:1]).positions[0]
    assert np.allclose(rest[2] - rest[0], [0.55, 0, 0], atol=1e-6)


@pytest.mark.parametrize(
    ("way", "angles"), [("STEP", [0, 0, 45, 45, 90]), ("CUBICSPLINE", [0, 22.5, 45, 67.5, 90])]
)
def test_other_ways_between_keys(tmp_path, way, angles):
    clip = read_clip(written(tmp_path, way), fps=4)
    turned = np.rad2deg(np.linalg.norm(clip.rotations(form="rotvec")[:, 1], axis=1))
    assert np.allclose(turned, angles, atol=0.5)


def test_the_rate_is_that_of_the_keys(tmp_path):
    clip = read_clip(written(tmp_path))
    assert (clip.fps, clip.fps_source, len(clip)) == (2, "file", 3)


BAD_VIEW = [{"buffer": 0, "byteOffset": 0, "byteLength": 12},
            {"buffer": 0, "byteOffset": 5_000, "byteLength": 12}]  # fmt: skip


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"skins": []}, "a skin with joints"),
        ({"animations": []}, "an animation, but the file has none"),
        ({"animations": [{"samplers": [], "channels": []}]}, "moves none"),
        ({"skins": [{"joints": [1, 7]}]}, "whole glTF"),
        ({"bufferViews": BAD_VIEW}, "the arrays end before"),
        ({"bufferViews": []}, "whole glTF"),
        ({"buffers": [{"uri": "missing.bin"}]}, "'missing.bin' beside it"),
        ({"buffers": [{"uri": "http://host/a.bin"}]}, "beside it"),
        ({"extensionsRequired": ["EXT_meshopt_compression"]}, "needs EXT_meshopt_compression"),
        ({"nodes": [{"children": [1]}, {"children": [0]}, {}, {}]}, "a circle"),
        ({"nodes": [{}, {"name": "a"}, {"name": "b"}, {}]}, "hang on several"),
        ({"asset": None, "accessors": 3}, "glTF"),
        (
            {
                "nodes": [
                    {"scale": [1e308] * 3, "children": [1]},
                    {"children": [2]},
                    {"translation": [1e308, 0, 0], "children": [3]},
                    {},
                ]
            },
            "glTF|finite|numbers",
        ),
    ],
)
def test_what_is_no_motion_is_told(tmp_path, change, message):
    with pytest.raises(FormatError, match=message) as error:
        read_clip(written(tmp_path, **change))
    assert str(error.value).startswith(str(tmp_path / "arm.gltf"))


def test_files_that_are_cut_short_are_told(walk, tmp_path):
    path = tmp_path / "walk.glb"
    write_glb(walk, path)
    whole = path.read_bytes()
    for data in (b"", b"glTF", whole[:100], whole[:-50], b"glTF" + struct.pack("<II", 1, 12),
                 b"{}", b"[1]", b"no JSON"):  # fmt: skip
        path.write_bytes(data)
        with pytest.raises(FormatError, match=r"glTF|cut short"):
            read_clip(path)
    path.unlink()
    with pytest.raises(FormatError, match="there is none"):
        read_clip(path)


def test_from_the_command_line(walk, tmp_path):
    write_glb(walk, tmp_path / "walk.glb")
    figures = run_json("convert", tmp_path / "walk.glb", tmp_path / "walk.bvh")
    assert (figures["frames"], figures["fps"]) == (120, 120)


def test_in_a_folder_those_that_say_they_move_are_clips(walk, tmp_path):
    write_glb(walk, tmp_path / "walk.glb")
    (tmp_path / "cut.glb").write_bytes((tmp_path / "walk.glb").read_bytes()[:30])
    written(tmp_path)
    for name, change in {"chair": {"skins": []}, "statue": {"animations": []}}.items():
        (tmp_path / f"{name}.gltf").write_text(json.dumps(document(**change)[0]))
    found = [path.name for path in find_motion_files(tmp_path)]
    assert found == ["arm.gltf", "cut.glb", "walk.glb"]


def test_of_several_animations_the_others_are_named(tmp_path):
    one = document()[0]["animations"][0]
    clip = read_clip(written(tmp_path, animations=[one | {"name": "wave"}, one]))
    assert "warning: animation 'wave' is read, and 'number 1' left out" in clip.provenance


@pytest.mark.parametrize(
    ("data", "message"),
    [(b"", "the file is empty"), (b"no JSON", "JSON, or a \\.glb, but got neither")],
)
def test_what_is_no_document_is_told(tmp_path, data, message):
    path = tmp_path / "walk.glb"
    path.write_bytes(data)
    with pytest.raises(FormatError, match=message) as told:
        read_clip(path)
    assert "JSONDecodeError" not in str(told.value)
