"""``mocapdb fill``: a whole body from a few joints."""

from __future__ import annotations

import numpy as np
import pytest
from small_library import run, run_json

from mocapdb.cleaning import measure_filling
from mocapdb.cleaning.repair.missing_joints import fill_with_misfit
from mocapdb.compression import Target
from mocapdb.corpus import synthetic
from mocapdb.io import read_clip, write_clip
from mocapdb.library import BuildSettings, build_library

KNOWN = "lfemur,rfemur,lhumerus,rhumerus,lowerneck"


@pytest.fixture(scope="module")
def walks(tmp_path_factory):
    """Three walks in a folder, one of which is to be filled."""
    folder = tmp_path_factory.mktemp("walks")
    for seed in (1, 2, 3):
        write_clip(synthetic.make_clip("walk", seed=seed, duration_s=2.5), folder / f"w{seed}.bvh")
    return folder


def test_the_contract(walks, tmp_path):
    out = tmp_path / "whole.bvh"
    answer = run_json("fill", walks / "w1.bvh", "--joints", KNOWN, "--context", walks, "-o", out)
    before, after = read_clip(walks / "w1.bvh"), read_clip(out)
    skeleton = before.skeleton
    for name in [*KNOWN.split(","), skeleton.names[0]]:
        joint = skeleton.joint(name)
        own = slice(skeleton.channel_starts[joint], skeleton.channel_starts[joint + 1])
        np.testing.assert_array_equal(before.channels[:, own], after.channels[:, own])
        assert name not in answer["filled"]
    assert answer["known"] == KNOWN.split(",")
    assert answer["context"]["clips"] == 2  # not the clip itself
    assert sorted(answer["held_out"]) == ["w2", "w3"]
    assert set(answer["expected_deg"]) == set(answer["filled"])
    assert max(answer["expected_deg"].values()) < 25
    assert answer["unit_m_source"]


def test_the_expected_error_is_about_the_error(walks):
    clips = [read_clip(walks / f"w{seed}.bvh") for seed in (1, 2, 3)]
    known = KNOWN.split(",")
    expected = measure_filling(known, clips[1:]).overall_deg
    true = measure_filling(known, clips, held_out=clips[:1])
    assert true.clips == ("w1",)
    assert 0.3 < expected / true.overall_deg < 3
    assert "lfemur" not in true.mean_deg
    more = [*known, "lradius", "rradius", "ltibia", "rtibia"]
    assert measure_filling(more, clips, held_out=clips[:1]).mean_deg.keys() < true.mean_deg.keys()


def test_in_words_and_without_an_error(walks, tmp_path):
    said = [walks / "w1.bvh", "--joints", KNOWN, "-o", tmp_path / "whole.npz", "--context"]
    assert "expected error" in run("fill", *said, walks).output
    alone = run("fill", *said, walks / "w2.bvh")
    assert "not known" in alone.output
    assert run_json("fill", *said, walks, "--no-error")["expected_deg"] is None


def below_a_scene(path, target, turn):
    """Write a BVH whose first joint is a scene's that stands, and turn the body about y."""
    head, motion = path.read_text().split("MOTION")
    head = head.replace("ROOT", "JOINT").replace(
        "HIERARCHY",
        "HIERARCHY\nROOT scene\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation",
    )
    lines = motion.strip().splitlines()
    rows = [f"0 0 {turn} {row}" for row in lines[2:]]
    target.write_text("\n".join([head + "}\nMOTION", *lines[:2], *rows]) + "\n")
    return target


def test_what_carries_the_body_is_kept_below_a_scene(walks, tmp_path):
    take = below_a_scene(walks / "w1.bvh", tmp_path / "take.bvh", 0)
    context = below_a_scene(walks / "w2.bvh", tmp_path / "context.bvh", 0)
    out = tmp_path / "whole.bvh"
    answer = run_json("fill", take, "--joints", KNOWN, "--context", context, "-o", out)
    before, after = read_clip(take), read_clip(out)
    skeleton = before.skeleton
    assert skeleton.names[skeleton.body_root] == "root"
    assert set(answer["kept"]) == {"scene", "root"}
    assert not {"scene", "root"} & set(answer["filled"])
    for name in ("scene", "root"):
        joint = skeleton.joint(name)
        own = slice(skeleton.channel_starts[joint], skeleton.channel_starts[joint + 1])
        np.testing.assert_array_equal(before.channels[:, own], after.channels[:, own])


def test_more_is_expected_where_the_context_fits_less_well():
    clips = [synthetic.make_clip("walk", seed=seed, duration_s=2.5) for seed in (2, 3)]
    known = KNOWN.split(",")
    error = measure_filling(known, clips)
    boxing = synthetic.make_clip("box", seed=1, duration_s=2.5)
    misfit = fill_with_misfit(boxing, known, clips).misfit_deg
    assert misfit > error.misfit_deg
    expected = error.expected(misfit)
    times = misfit / error.misfit_deg
    assert expected.mean_deg["rhand"] == pytest.approx(times * error.mean_deg["rhand"])
    true = measure_filling(known, clips, held_out=[boxing]).overall_deg
    assert abs(expected.overall_deg - true) < abs(error.overall_deg - true)
    assert error.expected(0.0).mean_deg == error.mean_deg


def test_a_library_is_a_context(walks, tmp_path):
    library = tmp_path / "walks.mocapdb"
    settings = BuildSettings(Target("max_mm", 2.0, joint_share=0), {"codec": "pose"})
    build_library(walks, library, settings, jobs=1, index=False)
    said = ["--joints", KNOWN, "--context", library, "-o", tmp_path / "whole.bvh", "--no-error"]
    assert run_json("fill", walks / "w1.bvh", *said)["context"]["clips"] >= 2


class TestRefused:
    def fails(self, tmp_path, *arguments):
        result = run("fill", *arguments, "-o", tmp_path / "whole.bvh")
        assert result.exit_code == 1
        assert not (tmp_path / "whole.bvh").exists()
        return result.output

    def test_a_joint_that_does_not_exist(self, walks, tmp_path):
        said = self.fails(
            tmp_path, walks / "w1.bvh", "--joints", "lfemur,LHummerus", "--context", walks
        )
        assert "Did you mean 'lhumerus'" in said
        said = self.fails(tmp_path, walks / "w1.bvh", "--joints", "xyz@!", "--context", walks)
        assert "It has root" in said

    def test_a_context_of_another_body(self, walks, tmp_path):
        clip = synthetic.make_clip("walk", seed=1, duration_s=2)
        names = tuple(f"my_{name}" for name in clip.skeleton.names)
        from dataclasses import replace

        write_clip(replace(clip, skeleton=replace(clip.skeleton, names=names)), tmp_path / "o.bvh")
        said = self.fails(
            tmp_path, walks / "w1.bvh", "--joints", KNOWN, "--context", tmp_path / "o.bvh"
        )
        assert "but none of its 1 clip is one" in said
        said = self.fails(
            tmp_path, walks / "w1.bvh", "--joints", KNOWN, "--context", walks / "w1.bvh"
        )
        assert "it holds w1.bvh itself, and nothing else" in said

    def test_no_joint_or_all_of_them(self, walks, tmp_path):
        everything = ",".join(read_clip(walks / "w1.bvh").skeleton.names)
        said = self.fails(tmp_path, walks / "w1.bvh", "--joints", everything, "--context", walks)
        assert "Expected some of the" in said
        nothing = ["--joints", ",", "--context", walks, "-o", tmp_path / "x.bvh"]
        assert run("fill", walks / "w1.bvh", *nothing).exit_code == 2

    def test_a_context_that_is_not_there(self, walks, tmp_path):
        said = self.fails(
            tmp_path, walks / "w1.bvh", "--joints", KNOWN, "--context", tmp_path / "none.bvh"
        )
        assert "there is none" in said
