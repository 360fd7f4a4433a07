"""FBX, Collada and USD by way of the real Blender, in and out."""

from __future__ import annotations

import os
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ascii_fbx import ascii_of
from small_library import run_json

from mocapdb import BuildSettings, Target, build_library
from mocapdb.corpus import synthetic
from mocapdb.errors import FormatError
from mocapdb.io import ReadOptions, read_clip, write_clip
from mocapdb.io.blender.program import WORKER
from mocapdb.io.blender.scenes import read_scene
from mocapdb.io.conventions import to_bvh_convention
from mocapdb.library import Library
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import Pose, channels_from_pose, forward_kinematics

pytestmark = pytest.mark.blender

MADE = Path(__file__).with_name("made_scenes.py")
NEAR_MM = 1.0


@pytest.fixture
def made(blender_program, tmp_path_factory):
    """A folder of files that Blender has exported in the ways of others."""
    if not FOLDERS:
        folder = tmp_path_factory.mktemp("made")
        command = [str(MADE) if part == str(WORKER) else part for part in blender_program]
        subprocess.run([*command, str(folder)], check=True, capture_output=True, timeout=300)
        FOLDERS.append(folder)
    return FOLDERS[0]


FOLDERS: list[Path] = []


def turns_of(clip: Clip, joint: int) -> np.ndarray:
    """The angle in radians by which a joint is turned against its rest, frame by frame."""
    matrices = clip.rotations("global", "matrix")[:, joint]
    return np.arccos(np.clip((np.trace(matrices, axis1=1, axis2=2) - 1) / 2, -1, 1))


def far_mm(clip: Clip, other: Clip) -> float:
    """The largest distance of any joint in any frame, in millimetres."""
    own = clip.positions("file", "file") * clip.skeleton.metres_per_unit
    order = [other.skeleton.names.index(name) for name in clip.skeleton.names]
    theirs = other.positions("file", "file")[:, order] * other.skeleton.metres_per_unit
    assert own.shape == theirs.shape
    return float(np.linalg.norm(own - theirs, axis=-1).max()) * 1000


def skeleton_height(clip: Clip) -> float:
    """How high the root is in the rest pose, in metres."""
    skeleton = clip.skeleton
    return float(skeleton.offsets[0, skeleton.up_index] * skeleton.metres_per_unit)


def round_trip(clip: Clip, folder: Path) -> Clip:
    """Write a clip and read it; what must come back for any clip is looked at here."""
    written = write_clip(clip, folder / "clip.fbx")
    back = read_clip(folder / "clip.fbx")
    assert set(back.skeleton.names) == set(written.skeleton.names)
    assert back.fps == pytest.approx(clip.fps, rel=1e-6)
    assert back.skeleton.metres_per_unit == pytest.approx(clip.skeleton.metres_per_unit, rel=1e-6)
    assert (back.skeleton.up, back.unit_source, back.up_source) == (
        clip.skeleton.up, "file", "file",
    )  # fmt: skip
    assert far_mm(written, back) < NEAR_MM
    order = [back.skeleton.names.index(name) for name in written.skeleton.names]
    rest = written.skeleton.rest_positions, back.skeleton.rest_positions[order]
    height = skeleton_height(written), skeleton_height(back)
    assert height[0] == pytest.approx(height[1], abs=NEAR_MM / 1000)
    stands = [each - each[0] for each in rest]
    assert np.abs(stands[0] - stands[1]).max() * clip.skeleton.metres_per_unit < NEAR_MM / 1000
    return back


class TestOutAndInAgain:
    def test_the_height_of_the_root_at_rest(self, blender_program, tmp_path):
        clip = to_bvh_convention(synthetic.make_clip("walk", seed=2, duration_s=0.3))
        offsets = clip.skeleton.offsets.copy()
        offsets[0, clip.skeleton.up_index] = 0.94 / clip.skeleton.metres_per_unit
        raised = clip.replace(skeleton=replace(clip.skeleton, offsets=offsets))
        assert skeleton_height(round_trip(raised, tmp_path)) == pytest.approx(0.94, abs=1e-4)

    @pytest.mark.parametrize("unit_m", [1.0, 0.01, 0.001, 0.0254, 0.0254 / 0.45])
    @pytest.mark.parametrize("up", ["y", "z"])
    def test_units_and_axes(self, blender_program, tmp_path, unit_m, up):
        clip = to_bvh_convention(synthetic.make_clip("walk", seed=2, duration_s=0.5))
        skeleton = clip.skeleton
        scale = skeleton.metres_per_unit / unit_m
        pose = forward_kinematics(skeleton, clip.channels)
        skeleton = replace(skeleton, offsets=skeleton.offsets * scale, metres_per_unit=unit_m)
        places, turns, offsets = pose.positions * scale, pose.rotations, skeleton.offsets
        if up == "z":
            to_z = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
            places, turns, offsets = places @ to_z.T, to_z @ turns @ to_z.T, offsets @ to_z.T
        skeleton = replace(skeleton, offsets=offsets, up=up)
        clip = Clip(skeleton, channels_from_pose(skeleton, Pose(places, turns)), 120)
        back = round_trip(clip, tmp_path)
        assert back.skeleton.n_channels == clip.skeleton.n_channels  # End Sites, too

    @pytest.mark.parametrize("fps", [24000 / 1001, 30000 / 1001, 24, 25, 50, 100, 120, 480, 31.25])
    def test_rates(self, blender_program, tmp_path, fps):
        clip = synthetic.make_clip("run", seed=3, duration_s=1.0)
        clip = Clip(clip.skeleton, clip.channels, fps)
        back = round_trip(clip, tmp_path)
        assert back.fps == pytest.approx(fps, rel=1e-12)
        assert back.fps_source == "file"

    def test_amc(self, blender_program, tmp_path):
        round_trip(synthetic.make_clip("hop", seed=4, duration_s=1.0), tmp_path)

    def test_names_shifts_and_single_frames(self, blender_program, tmp_path):
        clip = to_bvh_convention(synthetic.make_clip("walk", seed=2, duration_s=0.2))
        skeleton = clip.skeleton
        names = [f"関節_{name} é:{i}" for i, name in enumerate(skeleton.names)]
        dofs = [list(each) for each in skeleton.dofs]
        dofs[3] = ["tx", "ty", "tz", *dofs[3]]
        moving = replace(skeleton, names=tuple(names), dofs=tuple(map(tuple, dofs)))
        pose = forward_kinematics(skeleton, clip.channels)
        places = pose.positions.copy()
        places[:, 3, 1] += 0.1 * np.arange(len(clip))
        channels = channels_from_pose(moving, pose._replace(positions=places))
        back = round_trip(Clip(moving, channels, 60), tmp_path)
        assert back.skeleton.dofs[back.skeleton.names.index(names[3])][0] == "tx"
        round_trip(Clip(moving, channels[:1], 60), tmp_path)

    def test_a_clip_that_stands_still_keeps_its_length(self, blender_program, tmp_path):
        clip = synthetic.make_clip("walk", seed=2, duration_s=0.5)
        still = Clip(clip.skeleton, np.repeat(clip.channels[:1], 40, axis=0), 60)
        assert len(round_trip(still, tmp_path)) == 40

    def test_long_names_are_told(self, blender_program, tmp_path):
        clip = to_bvh_convention(synthetic.make_clip("walk", seed=2, duration_s=0.1))
        names = [f"{name}_{'x' * 300}" for name in clip.skeleton.names]
        long = replace(clip.skeleton, names=tuple(names))
        written = write_clip(Clip(long, clip.channels, 60), tmp_path / "long.fbx")
        assert "joints renamed by Blender" in written.provenance[-1]
        assert read_clip(tmp_path / "long.fbx").skeleton.n_joints == long.n_joints

    def test_the_zoo(self, blender_program, zoo, tmp_path):
        for path in sorted((zoo / "exporters").glob("*.bvh")):
            round_trip(read_clip(path)[:20], tmp_path)

    def test_the_corpus(self, blender_program, corpus, tmp_path):
        files = sorted(corpus.rglob("*.amc")) + sorted(corpus.rglob("*.bvh"))
        for path in files[:: max(1, len(files) // 8)]:
            round_trip(read_clip(path)[:20], tmp_path)


class TestOthersFiles:
    def test_takes(self, made):
        clips = dict(read_scene(made / "takes.fbx"))
        assert {key: len(clip) for key, clip in clips.items()} == {"Walk": 10, "Rün": 15}
        assert np.allclose(turns_of(clips["Walk"], 1), 0.1 * np.arange(10), atol=1e-3)
        assert np.allclose(turns_of(clips["Rün"], 2), 0.2 * np.arange(15), atol=1e-3)
        assert len(read_clip(made / "takes.fbx", ReadOptions(take="walk"))) == 10

    def test_actors(self, made):
        (one, ann), (other, bob) = read_scene(made / "actors.fbx")
        assert (one, ann.skeleton.n_joints) == ("Ann", 3)
        assert (other, bob.skeleton.n_joints) == ("Bob", 4)
        own, theirs = (clip.rotations("global", "matrix")[5, 1] for clip in (ann, bob))
        assert np.allclose(own, theirs.T, atol=1e-4)

    def test_motion_of_the_object_is_the_roots(self, made):
        clip = read_clip(made / "walking.fbx")[:12]
        assert np.allclose(clip.positions()[:, 0, 0], 0.1 * np.arange(12), atol=1e-4)
        assert np.allclose(turns_of(clip, 0), 0.05 * np.arange(12), atol=1e-3)
        assert np.allclose(clip.skeleton.offsets[1:] * 0.01, [[0, 1, 0]] * 2, atol=1e-5)

    def test_motion_of_what_carries_it_is_the_roots(self, made):
        clip = read_clip(made / "carried.fbx")[:12]
        assert np.allclose(clip.positions()[:, 0, 2], -0.1 * np.arange(12), atol=1e-4)
        assert np.allclose(clip.positions()[:, 0, 1], 0.5, atol=1e-4)
        assert np.allclose(turns_of(clip, 1), 0.1 * np.arange(12), atol=1e-3)

    def test_keys_that_are_denser_than_frames(self, made):
        clip = read_clip(made / "dense.fbx")
        assert (clip.fps, len(clip)) == (120, 41)
        assert np.allclose(turns_of(clip, 1), 0.05 * np.arange(41), atol=1e-3)
        assert len(read_clip(made / "dense.fbx", ReadOptions(fps=30))) == 11

    def test_units(self, made):
        inches, usual = read_clip(made / "inches.fbx"), read_clip(made / "usual_scale.fbx")
        assert inches.skeleton.metres_per_unit == 0.0254
        assert usual.skeleton.metres_per_unit == 0.01
        for clip in (inches, usual):
            assert np.allclose(clip.positions()[0, 2, 1], 20 * 0.0254, atol=1e-5)

    def test_pictures_are_not_opened(self, made, tmp_path):
        picture = made / "elsewhere" / "picture.png"
        assert picture.name.encode() in (made / "picture.fbx").read_bytes()
        picture.unlink(missing_ok=True)
        if hasattr(os, "mkfifo"):
            os.mkfifo(picture)  # who opens it waits for ever
        assert len(read_clip(made / "picture.fbx")) == 20

    def test_text(self, made, tmp_path):
        path = tmp_path / "text.fbx"
        path.write_text(ascii_of((made / "takes.fbx").read_bytes()), encoding="utf-8")
        binary, text = dict(read_scene(made / "takes.fbx")), dict(read_scene(path))
        assert list(text) == list(binary)
        for key, clip in text.items():
            assert far_mm(clip, binary[key]) < 0.01

    def test_nothing_moves(self, made):
        with pytest.raises(FormatError, match="the skeleton 'Ann' only stands in its pose"):
            read_clip(made / "pose.fbx")
        with pytest.raises(FormatError, match="Expected a skeleton, but the file holds 1 mesh"):
            read_clip(made / "cube.fbx")

    def test_broken_files(self, made, tmp_path):
        data = (made / "takes.fbx").read_bytes()
        cut, noise = tmp_path / "cut.fbx", tmp_path / "noise.fbx"
        cut.write_bytes(data[: len(data) // 2])
        noise.write_bytes(b"no FBX at all")
        for path in (cut, noise):
            with pytest.raises(FormatError, match="Blender says") as told:
                read_clip(path)
            assert told.value.path == str(path)
        assert read_scene(made / "takes.fbx")

    @pytest.mark.parametrize("suffix", [".usda", ".usdc"])
    def test_usd(self, made, suffix):
        clip = read_clip(made / f"walk{suffix}")
        expected = (25, "file") if suffix == ".usda" else (24, "default")
        assert (clip.fps, clip.fps_source) == expected
        assert np.allclose(turns_of(clip, 1), 0.1 * np.arange(10), atol=1e-3)
        assert len(clip) == 10
        told = read_clip(made / f"walk{suffix}", ReadOptions(fps=50))
        assert (len(told), told.fps, told.fps_source) == (10, 50, "caller")

    def test_collada(self, made):
        if not (made / "walk.dae").exists():
            (made / "walk.dae").write_text("<COLLADA/>")
            with pytest.raises(FormatError, match=r"Collada is in versions before 5\.0"):
                read_clip(made / "walk.dae")
            return
        clip = read_clip(made / "walk.dae")
        assert (clip.fps, clip.fps_source, len(clip)) == (25, "file", 10)
        assert np.allclose(turns_of(clip, 1), 0.1 * np.arange(10), atol=1e-3)


def test_a_folder(made, tmp_path):
    corpus = tmp_path / "corpus"
    corpus.mkdir()
    for name in ("takes.fbx", "actors.fbx", "cube.fbx", "pose.fbx", "walk.usda", "walking.fbx"):
        shutil.copy(made / name, corpus / name)
    (corpus / "cut.fbx").write_bytes((made / "takes.fbx").read_bytes()[:30_000])
    settings = BuildSettings(Target("max_mm", 1.0))
    library = tmp_path / "l.mocapdb"
    report = build_library(corpus, library, settings, jobs=1, index=False)
    (failure,) = report.failed
    assert failure.path.endswith("cut.fbx") and "Blender says" in failure.reason
    assert report.assumed is not None
    assert report.assumed.left_alone == {".fbx without a skeleton that moves": 2}
    with Library(library) as opened:
        names = {record.name for record in opened.records()}
        assert names == {"takes_Walk", "takes_Rün", "actors_Ann", "actors_Bob", "walk", "walking"}
        kept = opened.clip("takes_Walk")
        opened.export("takes_Walk", tmp_path / "walk.fbx")
    original = read_clip(made / "takes.fbx", ReadOptions(take="Walk"))
    assert far_mm(kept, original) < 1.0
    assert far_mm(kept, read_clip(tmp_path / "walk.fbx")) < 0.1
    again = build_library(corpus, library, settings, jobs=1, index=False)
    assert (again.built, again.skipped) == (0, 6)


def test_the_commands(blender_program, zoo, tmp_path):
    source = zoo / "exporters" / "facebookresearch-AnimatedDrawings__jesse_dance.bvh"
    dance, back = tmp_path / "dance.fbx", tmp_path / "back.bvh"
    run_json("convert", source, dance)
    run_json("convert", dance, back)
    assert far_mm(read_clip(source), read_clip(back)) < NEAR_MM
