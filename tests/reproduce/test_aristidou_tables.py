import json

import pytest
from click.testing import CliRunner

from mocapdb.cli import cli
from mocapdb.corpus import synthetic
from mocapdb.errors import CorpusError
from mocapdb.io import write_clip
from mocapdb.reproduce import aristidou


@pytest.fixture(scope="module")
def small_corpus(tmp_path_factory):
    """Synthetic clips under the names that the tables ask for."""
    folder = tmp_path_factory.mktemp("cmu")
    for name, kind in {"07_01": "walk", "35_01": "walk", "02_05": "box"}.items():
        subject = folder / name[:2]
        subject.mkdir()
        clip = synthetic.make_clip(kind, seed=1, sensor_noise_deg=0.02)
        write_clip(clip, subject / f"{name}.amc")
    return folder


def test_every_figure_of_the_tables_gets_a_row(small_corpus):
    rows = aristidou.reproduce(small_corpus, tables=["1", "2", "spans"])
    for table, count in {"1": 36 + 4, "2": 20}.items():
        assert sum(row["table"] == table for row in rows) == count
    found = {(row["row"], row["column"]): row for row in rows}
    ours = found["self-similarity, local", "locomotion recall"]
    assert ours["paper"] == 0.985
    assert 0.0 <= ours["ours"] <= 1.0
    printed = found["their rule as printed, local", "locomotion precision"]
    assert printed["paper"] is None
    assert printed["ours"] < 0.6  # it flags nearly everything
    by_pose = found["Chai-Hodgins distance, local", "locomotion recall"]
    assert by_pose["paper"] == 0.934
    assert 0.0 <= by_pose["ours"] <= 1.0
    rival = found["Holden 2015", "artificial errors global average"]
    assert rival["note"].startswith("not computed: its program")
    assert found["spans", "locomotion recall"]["ours"] > 0.5
    assert found["untouched", "locomotion share flagged"]["ours"] < 0.01
    assert found["cut off", "locomotion recall"]["ours"] in (0.0, 1.0)  # a single fault
    assert found["soft edges", "dance recall"]["note"] == ""
    repair, line = (
        found["repair", f"locomotion {column}"]["ours"]
        for column in ("degrees", "degrees, straight line")
    )
    assert 0.0 < repair < line + 1.0
    assert found["self-similarity", "artificial errors global average"]["ours"] >= 0


def test_clips_are_bounded_and_told(small_corpus, tmp_path):
    seen = []
    for name in ("07_01", "07_02", "07_03"):
        (tmp_path / f"{name}.amc").write_bytes((small_corpus / "07" / "07_01.amc").read_bytes())
    for file in (small_corpus / "07").glob("*.asf"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    rows = aristidou.reproduce(
        tmp_path, tables=["1"], clips=2, progress=lambda *step: seen.append(step)
    )
    notes = {row["note"] for row in rows if row["row"] == "self-similarity, local"}
    assert "2 faults in 2 of 3 clips" in notes
    assert seen[0] == (0, 3, "07_01")  # reading is told, too
    assert seen[-1][2] == "done"


def test_the_command(small_corpus):
    arguments = [
        "reproduce",
        "aristidou",
        "--corpus",
        str(small_corpus),
        "--table",
        "2",
        "--jobs",
        "1",
    ]
    answer = CliRunner().invoke(cli, [*arguments, "--json"])
    assert answer.exit_code == 0, answer.output
    report = json.loads(answer.stdout)
    assert report["paper"] == "Aristidou 2018"
    assert set(report["rows"][0]) == {"table", "row", "column", "paper", "ours", "note"}
    answer = CliRunner().invoke(cli, arguments)
    assert "Holden 2015" in answer.stdout
    assert "Conventions" in answer.stdout


def test_a_corpus_without_the_clips(tmp_path):
    with pytest.raises(CorpusError, match="Expected clips of CMU's subjects"):
        aristidou.reproduce(tmp_path)
