"""``--csv``: what commands print as JSON, as a table for spreadsheets."""

from __future__ import annotations

import csv
import io
import json

import click
from click.testing import CliRunner
from small_library import NAMES, run

from mocapdb.cli import classify, clean
from mocapdb.cli._console import emit_json
from mocapdb.cli._csv import csv_option, each_of
from mocapdb.cli._options import json_option
from mocapdb.corpus import synthetic
from mocapdb.io import write_clip


def table(*args):
    result = run(*args, "--csv")
    assert result.exit_code == 0, result.output
    return list(csv.DictReader(io.StringIO(result.stdout)))


def command(data, rows):
    @click.command()
    @csv_option(rows)
    @json_option
    def say(as_json):
        assert as_json
        emit_json(data)

    return say


def printed(data, rows, *args):
    return CliRunner().invoke(command(data, rows), list(args))


def test_objects_become_columns_and_lists_of_values_one():
    data = {"clips": [{"clip": "a, b", "mm": {"mean": 1.5, "max": None}, "tags": [1, 2],
                       "spans": [{"x": 1}]}, {"clip": "c", "more": True}]}  # fmt: skip
    assert printed(data, each_of("clips"), "--csv").stdout.splitlines() == [
        "clip,mm.mean,mm.max,tags,more",
        '"a, b",1.5,,1;2,',
        "c,,,,True",
    ]


def test_rows_within_rows_and_a_whole_as_one():
    nested = {"clips": [{"cycles": [{"n": 1}, {"n": 2}]}, {"cycles": [{"n": 3}]}]}
    assert printed(nested, each_of("clips", "cycles"), "--csv").stdout == "n\n1\n2\n3\n"
    assert printed({"n": 1}, each_of("clips"), "--csv").stdout == "n\n1\n"
    assert printed({"clips": []}, each_of("clips"), "--csv").stdout == ""
    less = each_of("clips", without=["why"])
    assert printed({"clips": [{"n": 1, "why": {"x": 2}}]}, less, "--csv").stdout == "n\n1\n"


def test_json_is_as_it_was():
    assert json.loads(printed({"n": 1}, each_of("clips"), "--json").stdout) == {"n": 1}
    both = printed({"n": 1}, each_of("clips"), "--json", "--csv")
    assert both.exit_code == 2
    assert "give one of them" in both.stderr


def test_control_characters_are_spelt_out_and_json_has_them():
    """Those that speak to a terminal, and those that turn the order of letters round."""
    name = "walk\x1b[2J\u202egnp.\x9b\r"
    data = {"clips": [{"clip": name, "tags": ["\x07", "b\u2066"], "two": "a\nb\tc", "na\x1bme": 1}]}
    text = printed(data, each_of("clips"), "--csv").stdout
    assert "\r" not in text.replace("\r\n", "\n")
    assert set("\x1b\u202e\x9b\x07\u2066").isdisjoint(text)
    (row,) = csv.DictReader(io.StringIO(text))
    assert row == {
        "clip": r"walk\x1b[2J\u202egnp.\x9b\r",
        "tags": r"\x07;b\u2066",
        "two": "a\nb\tc",
        r"na\x1bme": "1",
    }
    told = printed(data, each_of("clips"), "--json").stdout
    assert json.loads(told) == data
    assert told.isascii()


def test_of_a_library(small_library):
    rows = table("ls", small_library)
    assert [row["clip"] for row in rows] == list(NAMES)
    assert float(rows[1]["error_mm.max"]) >= float(rows[1]["error_mm.mean"]) > 0
    (whole,) = table("info", small_library)
    assert whole["clips"] == "6"
    (one,) = table("info", small_library, "01_01")
    assert (one["clip"], one["label"]) == ("01_01", "walk")


def test_of_a_gait(tmp_path):
    write_clip(synthetic.make_clip("walk", seed=1, duration_s=3), tmp_path / "walk.bvh")
    feet = table("gait", tmp_path / "walk.bvh")
    assert [row["foot"] for row in feet] == ["left", "right"]
    assert float(feet[0]["stride_length_m.mean"]) > 1.0


def test_a_row_for_each_span_that_was_flagged():
    span = {"joint": "lhand", "start": 1.0, "end": 1.5, "frames": [120, 180]}
    report = {"clip": "take", "spans": [span], "notes": []}
    expected = [{"clip": "take", **span}]
    assert clean._rows(report) == clean._rows({"clips": [report], "failed": []}) == expected
    undone = {"library": "lib", "undone": 2}
    assert clean._rows(undone) == [undone]


def test_a_row_for_each_clip_that_was_classified():
    ranking = [{"class": "walk", "posterior": 0.9, "share": 1.0}]
    answer = {"clip": "take", "rejected": False, "novelty": 0.5, "ranking": ranking}
    (row,) = classify._rows(answer)
    assert (row["class"], row["nearest"], row["posterior"]) == ("walk", "walk", 0.9)
    (row,) = classify._rows({"clips": [answer | {"rejected": True}]})
    assert (row["class"], row["nearest"]) == (None, "walk")
    assert "ranking" not in row
