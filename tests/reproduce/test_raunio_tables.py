import json

import pytest
from click.testing import CliRunner

from mocapdb.cli import cli
from mocapdb.corpus import synthetic
from mocapdb.errors import CorpusError
from mocapdb.io import write_clip
from mocapdb.reproduce import raunio, vejdemo

TOLERANCES = {
    "period count": 0.03,
    "M1 pos": 0.02,
    "M2 pos": 0.02,
    "M1 template": 0.04,
    "M2 template": 0.04,
}


@pytest.mark.slow
def test_the_thesis_comes_out_where_it_did_not_fail(corpus):
    rows = raunio.reproduce(corpus / "cmu" / "asfamc")
    sound = [row for row in rows if row["ours"] is not None and "failed" not in row["note"]]
    assert {row["row"] for row in sound} >= {"02_02", "02_03", "07_01", "07_06"}
    for row in sound:
        if row["column"] in TOLERANCES:
            assert row["ours"] == pytest.approx(row["paper"], abs=TOLERANCES[row["column"]]), row


def test_clips_that_the_thesis_got_wrong_come_out_right(corpus):
    rows = raunio.reproduce(corpus / "cmu" / "asfamc", clips=["02_01"])
    (count,) = [row for row in rows if row["column"] == "period count"]
    assert count["paper"] == 1.0
    assert count["ours"] == pytest.approx(2.59, abs=0.03)
    assert "the thesis failed here" in count["note"]
    assert "autocorrelation 2.5" in count["note"]


def test_the_method_works_on_known_motion():
    clip, truth = synthetic.make("walk", seed=1, n_cycles=2.5, sensor_noise_deg=0.3)
    ours = raunio.thesis_cycle(clip, max_epsilon=2.0)
    assert len(clip) / truth.period_frames == pytest.approx(ours.period_count, abs=0.1)
    assert ours.rmse["m2", 0] <= ours.rmse["m1", 0] <= ours.rmse["m3", 0]
    assert ours.matches["m1"].error < 0.3
    assert ours.rmse["m1", 2] < ours.rmse["m2", 2]  # which M2 does not look at


def test_what_is_not_at_hand_is_said(tmp_path):
    write_clip(synthetic.make_clip("walk", seed=1, n_cycles=2.5), tmp_path / "08_02.bvh")
    rows = raunio.reproduce(tmp_path, clips=["08_02", "12_03"])
    assert {row["note"] for row in rows if row["row"] == "12_03"} == {"clip 12_03 not at hand"}
    (note,) = {row["note"] for row in rows if row["row"] == "08_02"}
    assert note.startswith("BVH only")
    assert {row["table"] for row in rows} == {"A.2", "B.2"}


def test_bad_corpora(tmp_path):
    with pytest.raises(CorpusError, match="none of"):
        raunio.reproduce(tmp_path)
    with pytest.raises(CorpusError, match="folder"):
        raunio.reproduce(tmp_path / "no")
    with pytest.raises(CorpusError, match="99_99"):
        raunio.reproduce(tmp_path, clips=["99_99"])
    with pytest.raises(CorpusError, match="folder"):
        vejdemo.reproduce(tmp_path / "no")


def test_the_commands(tmp_path):
    write_clip(synthetic.make_clip("walk", seed=1, n_cycles=2.5), tmp_path / "08_02.bvh")
    args = ["reproduce", "raunio", "--corpus", str(tmp_path), "--clip", "08_02"]
    report = json.loads(CliRunner().invoke(cli, [*args, "--json"]).stdout)
    assert report["paper"] == "Raunio 2014"
    assert set(report["rows"][0]) == {"table", "row", "column", "paper", "ours", "note"}
    text = CliRunner().invoke(cli, args).stdout
    assert "Table A.2" in text
    assert "Conventions" in text


def test_the_paper_of_2015_has_its_birth_reproduced(corpus):
    rows = vejdemo.reproduce(corpus / "cmu" / "asfamc" / "13")
    births = {row["row"]: row for row in rows if row["column"] == "birth"}
    punching = births["Punching 13_29"]
    assert punching["ours"] == pytest.approx(punching["paper"], rel=0.05)
    assert births["Regular walk 104_19"]["note"] == "clip 104_19 not at hand"


def test_its_whole_road_on_known_motion(tmp_path):
    clip = synthetic.make_clip("walk", seed=1, duration_s=5)
    figure = {"pca_dim": "3", "max_epsilon": "50", "post_s": "1", "first_frame": "0"}
    ours, note = vejdemo._computed(clip, figure)
    assert ours.keys() == {"birth", "simplices", "cohomology_s", "post_s", "overall_fps"}
    assert ours["overall_fps"] > 11.78
    assert note.endswith("laps")
