import base64
import html
import json
import re
import shutil
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from strategies import skeletons

from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError, FormatError
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics, to_metres
from mocapdb.scenes import Actor, Stage, write_animation
from mocapdb.scenes.animation import write_stage
from mocapdb.scenes.capsule_body import Body, body_of, bone_error_mm, error_colours
from mocapdb.scenes.player import page, stage_element
from mocapdb.scenes.raster import draw_frames


def stage_data(element):
    return json.loads(re.search(r"<script[^>]*>(.*)</script>", element, re.S)[1])


# -- bodies ----------------------------------------------------------------------------------------


def test_a_body_has_two_sides_a_thick_trunk_and_a_head(synthetic_walk):
    skeleton = synthetic_walk.skeleton
    body = body_of(skeleton)
    bones = {skeleton.names[head]: i for i, head in enumerate(body.heads)}
    assert body.sides[bones["lfemur"]] == 1
    assert body.sides[bones["rfemur"]] == -1
    assert body.sides[bones["thorax"]] == 0
    radii = {name: body.radii_m[i] for name, i in bones.items()}
    assert radii["lowerback"] > radii["lfemur"] > radii["lradius"] > radii["lthumb"]
    assert radii["head"] > radii["upperneck"]
    assert radii["lfemur"] == radii["rfemur"]


@given(skeletons(), st.integers(1, 9))
def test_any_skeleton_can_be_shown(skeleton, n_frames):
    rng = np.random.default_rng(0)
    clip = Clip(skeleton, rng.normal(scale=20, size=(n_frames, skeleton.n_channels)), 60.0)
    other = clip.replace(channels=clip.channels + 1.0)
    stage = Stage.side_by_side([Actor.of(clip), Actor.of(other, against=clip)])
    assert len(list(draw_frames(stage, (64, 64)))) == stage.n_frames
    assert len(stage_data(stage_element(stage, "x"))["actors"]) == 2


def test_how_far_a_bone_is_off(synthetic_walk):
    moved = synthetic_walk.channels.copy()
    moved[:, 1] += 1.0  # the root up by one unit, and all with it
    skeleton = synthetic_walk.skeleton
    error = bone_error_mm(
        skeleton,
        forward_kinematics(skeleton, synthetic_walk.channels),
        forward_kinematics(skeleton, moved),
    )
    assert error.shape == (len(synthetic_walk), skeleton.n_joints - 1)
    np.testing.assert_allclose(error, 1000 * skeleton.metres_per_unit, rtol=1e-9)


def test_error_colours_grow_darker():
    lightness = error_colours(np.linspace(0, 1.2, 30), 1.0) @ [0.3, 0.59, 0.11]
    assert (np.diff(lightness) <= 1).all()
    assert lightness[0] > 200
    assert lightness[-1] < 60


# -- stages ----------------------------------------------------------------------------------------


def test_an_actor_is_thinned_to_the_rate_that_is_shown(synthetic_walk):
    actor = Actor.of(synthetic_walk, fps=30.0)
    exact = to_metres(
        synthetic_walk.skeleton,
        forward_kinematics(synthetic_walk.skeleton, synthetic_walk.channels).positions,
    )
    np.testing.assert_allclose(actor.positions, exact[::4])
    slow = Actor.of(synthetic_walk.replace(fps=12.0), fps=30.0)
    assert (slow.fps, len(slow)) == (12.0, len(synthetic_walk))


def test_feet_are_on_the_ground_and_bodies_apart(synthetic_walk, synthetic_tall_walk):
    stage = Stage.side_by_side([Actor.of(synthetic_walk), Actor.of(synthetic_tall_walk)])
    low = min(actor.positions[..., 1].min() for actor in stage.actors)
    assert -0.02 < low < 0.12
    a, b = (actor.positions[0, 0] for actor in stage.actors)
    assert np.linalg.norm((a - b)[[0, 2]]) > 1.0


def test_a_body_is_found_far_from_a_first_joint_that_stands_still():
    walk = Actor.of(synthetic.make_clip("walk", seed=1, duration_s=1))
    far = walk.moved((0, 0, 50.0))
    alone = Stage.together([far]).camera()
    positions = far.positions.copy()
    positions[:, 0] = 0.0
    standing = replace(far, positions=positions, body=_without(far.body, joint=0))
    camera = Stage.together([standing]).camera()
    assert np.abs(camera.targets - alone.targets).max() < 0.1
    assert camera.distance == pytest.approx(alone.distance, rel=0.1)


def _without(body, joint):
    """A body without the bones that begin at a joint."""
    kept = (body.tails != joint) & (body.heads != joint)
    return Body(body.tails[kept], body.heads[kept], body.radii_m[kept], body.sides[kept])


@pytest.mark.parametrize("kind", synthetic.CLASSES)
def test_the_camera_keeps_every_body_in_the_picture(kind):
    clip = synthetic.make_clip(kind, seed=3, heading_deg=40.0)
    stage = Stage.side_by_side([Actor.of(clip, fps=10), Actor.of(clip, fps=10)])
    empty = np.asarray(next(draw_frames(Stage.together([Actor.of(clip, fps=10)]), (120, 90))))
    for frame in draw_frames(stage, (120, 90)):
        picture = np.asarray(frame).astype(int)
        coloured = np.ptp(picture, axis=2) > 60  # the bodies; ground and text are grey
        rows, columns = np.nonzero(coloured)
        assert len(rows) > 0.01 * coloured.size
        assert rows.max() < 89
        assert columns.min() > 0
        assert columns.max() < 119
    assert empty.shape == (90, 120, 3)


def test_the_original_must_fit(synthetic_walk, synthetic_tall_walk):
    for other in (synthetic_walk[:50], synthetic_tall_walk):
        with pytest.raises(ClipError, match="original"):
            Actor.of(synthetic_walk, against=other)
    with pytest.raises(ClipError, match="actor"):
        Stage.together([])


# -- files -----------------------------------------------------------------------------------------


def test_a_gif_plays_as_long_as_the_clip(synthetic_walk, tmp_path):
    path = tmp_path / "walk.gif"
    write_animation(synthetic_walk[:120], path, size=(96, 96))
    with Image.open(path) as picture:
        assert picture.size == (96, 96)
        assert picture.n_frames == 25
        assert picture.info["loop"] == 0
        shown = []
        for frame in range(picture.n_frames):
            picture.seek(frame)
            shown.append(np.asarray(picture.convert("RGB")).astype(int))
            assert picture.info["duration"] == 40
    assert all(np.abs(a - b).max() > 30 for a, b in pairwise(shown))


def test_a_page_holds_the_motion_and_asks_for_nothing(synthetic_walk, tmp_path):
    path = tmp_path / "walk.html"
    write_animation(synthetic_walk.replace(name="</script><b>"), path)
    text = path.read_text(encoding="utf-8")
    assert not re.search(r"https?:|\b(src|href)=(?!\"data:)|@import|fetch\(|url\(", text)
    assert "<b>" not in text
    data = stage_data(text[text.index('<script type="application/json"') :].split("<script>")[0])
    (actor,) = data["actors"]
    steps = np.frombuffer(base64.b64decode(actor["positions"]), dtype="<i2")
    points = steps.reshape(actor["frames"], actor["joints"], 3) * actor["scale"] + actor["centre"]
    shown = Stage.together([Actor.of(synthetic_walk)]).actors[0]
    for ends in ("tails", "heads"):
        drawn = shown.positions[:, getattr(shown.body, ends)]
        np.testing.assert_allclose(points[:, actor[ends]], drawn, atol=1e-3)


def test_a_notebook_plays_a_stage(synthetic_walk):
    stage = Stage.together([Actor.of(synthetic_walk[:30])], title='a "walk"')
    frame = stage._repr_html_()
    inside = html.unescape(re.search(r'srcdoc="([^"]*)"', frame)[1])
    assert inside == page(stage)


def test_error_travels_with_the_page(synthetic_walk):
    off = synthetic_walk.replace(channels=synthetic_walk.channels + 0.5)
    stage = Stage.side_by_side([Actor.of(synthetic_walk), Actor.of(off, against=synthetic_walk)])
    plain, coloured = stage_data(stage_element(stage, "x"))["actors"]
    assert "error" not in plain
    error = np.frombuffer(base64.b64decode(coloured["error"]), dtype=np.uint8)
    assert error.size == coloured["frames"] * len(coloured["tails"])
    assert error.max() > 200
    assert "off by" not in page(stage.together(stage.actors[:1])).split("<script>")[0]


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_an_mp4_where_ffmpeg_is(synthetic_walk, tmp_path):
    path = tmp_path / "walk.mp4"
    write_animation(synthetic_walk[:60], path, size=(64, 64))
    assert path.read_bytes()[4:8] == b"ftyp"
    with pytest.raises(ClipError, match="even sides"):
        write_animation(synthetic_walk[:60], tmp_path / "odd.mp4", size=(65, 64))
    assert [file.name for file in tmp_path.iterdir()] == ["walk.mp4"]


def test_no_ffmpeg_is_told(synthetic_walk, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", "")
    with pytest.raises(FormatError, match="ffmpeg, which writes MP4, but it is not installed"):
        write_animation(synthetic_walk[:60], tmp_path / "walk.mp4")
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_drawn(synthetic_walk, tmp_path):
    stage = Stage.together([Actor.of(synthetic_walk)])
    with pytest.raises(FormatError, match=r"\.gif, \.mp4, \.html"):
        write_stage(stage, tmp_path / "walk.webm")
    with pytest.raises(ClipError, match="64 to 4096 pixels"):
        write_stage(stage, tmp_path / "walk.gif", size=(10, 10))
    with pytest.raises(FormatError, match="can be written"):
        write_stage(stage, tmp_path / "missing" / "walk.html")
