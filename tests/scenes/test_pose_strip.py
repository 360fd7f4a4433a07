"""Small pictures of motions."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import skeletons

from mocapdb.corpus import synthetic
from mocapdb.motion.clip import Clip
from mocapdb.scenes.pose_strip import HEIGHT, LOOP_FPS, WIDTH, loop_svg, strip_svg
from mocapdb.scenes.stage import Actor


def points(svg):
    """All that is drawn, as (n, 2)."""
    text = " ".join(re.findall(r'\b(?:d|values)="([^"]*)"', svg))
    return np.array(re.findall(r"(-?\d+) (-?\d+)", text), dtype=int)


def lines(svg):
    """The lines of each side as (n, 4): left, middle, right."""
    paths = ET.fromstring(svg).findall(".//{*}path")
    return [
        np.array(re.findall(r"M(-?\d+) (-?\d+)L(-?\d+) (-?\d+)", path.get("d")), dtype=int)
        for path in paths
    ]


@pytest.fixture(scope="module")
def walk():
    return Actor.of(synthetic.make_clip("walk", seed=1), fps=LOOP_FPS)


def test_poses_stand_in_a_row_and_fill_the_picture(walk):
    svg = strip_svg(walk)
    x, y = points(svg).T
    assert 0 <= x.min() < 0.1 * WIDTH
    assert 0.9 * WIDTH < x.max() <= WIDTH
    assert 0 <= y.min() < 0.15 * HEIGHT
    assert 0.85 * HEIGHT < y.max() <= HEIGHT
    left, middle, right = lines(svg)
    assert len(left) == len(right) > len(middle) > 5


def test_a_picture_is_small(walk):
    assert len(strip_svg(walk)) < 6000
    assert len(loop_svg(walk)) < 500 * len(walk)


def test_it_does_not_matter_where_the_body_goes(walk):
    """Whichever way it faces, and wherever it is."""
    turned = walk.moved((3.0, 0.5, -2.0), yaw=2.0)
    assert np.abs(points(strip_svg(turned)) - points(strip_svg(walk))).max() <= 1


def test_a_body_faces_to_the_right(walk):
    """So its right limbs are in front, and its toes are to the right of its ankles."""
    _, _, right = lines(strip_svg(walk))
    feet = right[np.maximum(right[:, 1], right[:, 3]) > 0.9 * HEIGHT]
    ahead = feet[:, 2] - feet[:, 0]
    assert ahead[np.abs(ahead) > 2].mean() > 0


def test_a_loop_shows_every_frame(walk):
    root = ET.fromstring(loop_svg(walk))
    for animation in root.findall(".//{*}animate"):
        assert animation.get("values").count(";") == len(walk) - 1
        assert float(animation.get("dur")[:-1]) == pytest.approx(len(walk) / walk.fps, abs=0.01)


@given(skeletons(), st.integers(1, 9))
def test_any_skeleton_has_a_picture(skeleton, n_frames):
    rng = np.random.default_rng(0)
    clip = Clip(skeleton, rng.normal(scale=20, size=(n_frames, skeleton.n_channels)), LOOP_FPS)
    for svg in (strip_svg(Actor.of(clip)), loop_svg(Actor.of(clip))):
        ET.fromstring(svg)
        assert (points(svg)[:, 1] <= HEIGHT).all()
