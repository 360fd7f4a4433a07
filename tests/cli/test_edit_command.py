"""``mocapdb edit``: what a clip offers, for those who do not program."""

from __future__ import annotations

import numpy as np
import pytest
from small_library import run, run_json

from mocapdb.corpus import synthetic
from mocapdb.io import read_clip, write_clip


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    path = tmp_path_factory.mktemp("edit") / "walk.bvh"
    write_clip(synthetic.make_clip("walk", seed=1, duration_s=1.0), path)
    return path


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out.bvh"


def test_the_edits_of_a_clip(walk, out):
    figures = run_json(
        "edit", walk, "--cut", "0.25:0.75", "--resample", 30, "--mirror", "-o", out,
        "--drop", "*toes,*thumb", "--rename", "root=Hips,head=Head", "--at", "1,-2", "--face", 90,
    )  # fmt: skip
    clip = read_clip(walk)
    expected = clip.cut(0.25, 0.75).drop_joints("*toes", "*thumb")
    expected = expected.rename_joints({"root": "Hips", "head": "Head"}).mirror()
    expected = expected.place((1, -2), 90).resample(30)
    assert (figures["frames"], figures["fps"], figures["seconds"]) == (15, 30, 0.5)
    assert figures["steps"][-1].startswith("resampled from 120 to 30 Hz")
    written = read_clip(out)
    assert written.skeleton.names == expected.skeleton.names
    assert np.allclose(written.positions(), expected.positions(), atol=1e-6)


def test_what_is_appended_leads_on(walk, out):
    told = run(
        "edit", walk, "--frames", "0:60", "--append", walk, "--align", "--in-place", "-o", out
    )
    assert "followed by walk, aligned in place and heading" in told.stderr
    clip = read_clip(walk)
    expected = clip[:60].concat(clip, align=True).in_place()
    assert np.allclose(read_clip(out).positions(), expected.positions(), atol=1e-6)


@pytest.mark.parametrize("how", [("--speed", 2), ("--duration", 0.5)])
def test_how_fast(walk, out, how):
    result = run("edit", walk, *how, "-o", out)
    assert "60 frames at 120 Hz" in result.stdout
    assert "retimed" in result.stderr


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (("--resample", 0), "a frame rate above 0 for 'walk', but got 0"),
        (("--speed", -1), "a speed above 0"),
        (("--cut", "0.5:9"), "within the 1 s of 'walk', but got 0.5 to 9 s"),
        (("--frames", "10:900"), "within the 120 frames of 'walk'"),
        (("--drop", "lefthand"), "Did you mean 'lhand'"),
        (("--rename", "Head=skull"), "Did you mean 'head'"),
        (("--root", "thorx"), "Did you mean 'thorax'"),
        (("--drop", "root"), "'root' carries all others"),
    ],
)
def test_what_cannot_be_done_is_told(walk, out, wrong, said):
    result = run("edit", walk, *wrong, "-o", out)
    assert result.exit_code == 1
    assert said in result.stderr
    assert not out.exists()


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (("--cut", "1-2"), "seconds such as 1.0:4.5"),
        (("--cut", ":"), "seconds such as 1.0:4.5"),
        (("--cut", "0:1", "--frames", "0:9"), "which stretch"),
        (("--speed", 1, "--duration", 1), "how fast"),
        (("--align",), "--align is of --append"),
        (("--rename", "Hips"), "expected OLD=NEW"),
        (("--at", "1"), "metres such as 0,0"),
    ],
)
def test_wrong_usage_is_told(walk, out, wrong, said):
    result = run("edit", walk, *wrong, "-o", out)
    assert result.exit_code == 2
    assert said in result.stderr


def test_edits_are_written_in_a_format_of_scenes_too(walk, tmp_path):
    run("edit", walk, "--frames", "0:10", "-o", tmp_path / "out.glb")
    assert len(read_clip(tmp_path / "out.glb")) == 10
