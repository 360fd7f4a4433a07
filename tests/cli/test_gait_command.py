import csv
import json

import numpy as np
import pytest
from click.testing import CliRunner

from mocapdb.cli import cli
from mocapdb.corpus import synthetic
from mocapdb.io import write_clip


def run(*args, code=0):
    result = CliRunner().invoke(cli, [str(arg) for arg in args])
    assert "Traceback" not in result.output
    assert result.exit_code == code, result.output
    return result


@pytest.fixture(scope="module")
def clips(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clips")
    walk = synthetic.make_clip("walk", seed=1, duration_s=3, name="walk")
    write_clip(walk, folder / "walk.bvh")
    write_clip(
        walk.replace(channels=np.repeat(walk.channels[:1], 90, axis=0)), folder / "still.bvh"
    )
    return folder


def test_strides_angles_and_picture_of_a_clip(clips, tmp_path):
    strides, angles, picture = (tmp_path / name for name in ("s.csv", "a.csv", "p.png"))
    events = tmp_path / "e.png"
    told = run(
        "gait", clips / "walk.bvh", "-o", strides, "--angles", angles, "--plot", picture,
        "--events", events, "--json",
    )  # fmt: skip
    figures = json.loads(told.stdout)["clips"][0]
    with strides.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == sum(figures["strides"].values()) >= 3
    for row in rows:
        assert float(row["start_s"]) < float(row["toe_off_s"]) < float(row["end_s"])
        assert pytest.approx(float(row["stance_pct"]) + float(row["swing_pct"]), abs=0.01) == 100
    with angles.open(newline="") as file:
        curve = list(csv.DictReader(file))
    assert {row["percent"] for row in curve} == {str(percent) for percent in range(101)}
    assert len(curve) == 101 * len(rows) * 18
    assert figures["all"]["cadence_steps_min"]["mean"] == pytest.approx(111, rel=0.03)
    assert figures["zero"]
    assert len(figures["events"]["left"]["strike_s"]) >= 2
    for path in (picture, events):
        assert path.read_bytes().startswith(b"\x89PNG")


def test_clips_without_gait_do_not_stop_the_others(clips, tmp_path):
    told = run("gait", clips, "-o", tmp_path / "s.csv")
    assert "walk" in told.stdout
    assert "no gait: " in told.stderr
    assert "still.bvh" in told.stderr
    assert "nothing moves in 'still'" in told.stderr


def test_a_clip_without_gait_is_an_error(clips):
    assert "nothing moves" in run("gait", clips / "still.bvh", code=1).stderr
    walk = clips / "walk.bvh"
    for args, text in (
        (("-o", "same.csv", "--angles", "./same.csv"), "another one for --angles"),
        (("-o", "g.txt"), "a .csv with --output, but got 'g.txt'"),
        (("--plot", "p.xyz"), "a .png with --plot, but got 'p.xyz'"),
    ):
        assert text in run("gait", walk, *args, code=2).stderr


def test_options_of_a_library_need_one(clips):
    assert "of a library" in run("gait", clips, "--class", "walk", code=2).stderr
    assert "--events draws one clip" in run("gait", clips, "--events", "e.png", code=2).stderr


def test_a_loop_starts_at_a_left_strike(clips, tmp_path):
    told = json.loads(run("cycle", clips / "walk.bvh", "-o", tmp_path / "l.bvh", "--json").stdout)
    assert told["phase_0"] == "left foot strike"
    laps = tmp_path / "laps.bvh"
    run("cycle", clips / "walk.bvh", "-o", laps, "--laps", 4, "--start", "left-contact")
    figures = json.loads(run("gait", laps, "--json").stdout)["clips"][0]
    period = figures["left"]["stride_time_s"]["mean"]
    for strike in figures["events"]["left"]["strike_s"]:
        assert abs(strike / period - round(strike / period)) < 0.03


def test_a_loop_may_start_where_it_is_calm(clips):
    told = json.loads(run("cycle", clips / "walk.bvh", "--start", "calmest", "--json").stdout)
    assert told["phase_0"] == "calmest pose"


def test_a_wave_has_no_left_strike(tmp_path):
    write_clip(synthetic.make_clip("wave", seed=1, duration_s=4), tmp_path / "wave.bvh")
    told = run("cycle", tmp_path / "wave.bvh", "--start", "left-contact", code=1)
    assert "left foot strikes" in told.stderr


def test_events_as_a_table(clips, tmp_path):
    """Of `gait`, of `convert`, and of a clip of a library: the same strikes and toe-offs."""
    by_gait, by_convert = tmp_path / "gait.csv", tmp_path / "convert.csv"
    told = run("gait", clips / "walk.bvh", "--events", by_gait, "--json")
    said = run("convert", clips / "walk.bvh", by_convert, "--as", "events").stdout
    n_events = len(by_convert.read_text().splitlines()) - 1
    assert f"{n_events} events of " in said
    assert by_convert.read_text() == by_gait.read_text()
    rows = list(csv.DictReader(by_gait.read_text().splitlines()))
    strikes = json.loads(told.stdout)["clips"][0]["events"]["left"]["strike_s"]
    found = [
        float(row["time_s"])
        for row in rows
        if (row["clip"], row["foot"], row["event"]) == ("walk", "left", "strike")
    ]
    assert found == pytest.approx(strikes, abs=1e-4)
    times = [float(row["time_s"]) for row in rows]
    assert times == sorted(times)
    assert all(float(row["frame"]) == pytest.approx(120 * t, abs=0.01) for row, t in
               zip(rows, times, strict=True))  # fmt: skip
    run("gait", clips, "--events", by_gait)  # of several clips, too
    bad = run("convert", clips / "walk.bvh", tmp_path / "e.npz", "--as", "events", code=2)
    assert "Expected a .csv with --as events" in bad.stderr
