import json

import pytest
from click.testing import CliRunner

from mocapdb.cli import cli
from mocapdb.corpus import synthetic
from mocapdb.io import write_clip


def run(*args, code=0):
    result = CliRunner().invoke(cli, [str(arg) for arg in args])
    assert result.exit_code == code, result.output
    return result


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    path = tmp_path_factory.mktemp("takes") / "take.bvh"
    write_clip(synthetic.make_clip("sequence", seed=4, fps=30.0), path)
    return path


def test_table_and_picture(take, tmp_path):
    told = run("segment", take, "--plot", tmp_path / "segments.png").stdout
    assert "periodic" in told
    assert [line.split()[0] for line in told.splitlines() if " s " in line] == ["A", "B", "C"]
    assert (tmp_path / "segments.png").read_bytes().startswith(b"\x89PNG")


def test_json_counts_frames_of_the_whole_clip(take):
    whole = json.loads(run("segment", take, "--json").stdout)
    part = json.loads(
        run("segment", take, "--json", "--frames", "30:", "--method", "mixture").stdout
    )
    assert [segment["motion"] for segment in whole["segments"]] == ["A", "B", "C"]
    assert part["method"] == "mixture"
    assert part["segments"][0]["start"] == 30
    assert part["segments"][-1]["end"] == whole["segments"][-1]["end"]
    assert len(whole["differences"]) == 3


def test_wrong_usage(take, tmp_path):
    assert "--clip" in run("segment", take, "--clip", "walk", code=2).stderr
    assert "is a folder: name one" in run("segment", take.parent, code=2).stderr
    assert "a .png with --plot" in run("segment", take, "--plot", "s.txt", code=2).stderr
    assert "but got 0:9000" in run("segment", take, "--frames", "0:9000", code=1).stderr
    assert "mocapdb: Expected 0.8 s" in run("segment", take, "--frames", "0:5", code=1).stderr
