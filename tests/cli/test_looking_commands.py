"""Commands that draw: animated export, render, view."""

import json
import re
import subprocess
import sys
from urllib.request import urlopen

import pytest
from PIL import Image
from small_library import run, run_json

from mocapdb.io import write_clip


@pytest.fixture
def take(tmp_path, synthetic_walk):
    path = tmp_path / "take.bvh"
    write_clip(synthetic_walk[:60], path)
    return path


@pytest.mark.parametrize("suffix", [".gif", ".html"])
def test_a_clip_of_a_library_is_drawn(small_library_template, tmp_path, suffix):
    path = tmp_path / f"walk{suffix}"
    figures = run_json("export", small_library_template, "01_01", "-o", path)
    assert figures["output"] == str(path)
    assert path.stat().st_size > 10_000


def test_a_file_is_drawn(take, tmp_path):
    path = tmp_path / "take.gif"
    run_json("convert", take, path)
    with Image.open(path) as picture:
        assert picture.is_animated


def test_several_clips_are_drawn_beside_each_other(small_library_template, take, tmp_path):
    path = tmp_path / "both.gif"
    options = ["--library", small_library_template, "--size", "96x64", "--frames", ":24"]
    figures = run_json("render", take, "01_01", *options, "-o", path)
    assert len(figures["clips"]) == 2
    with Image.open(path) as picture:
        assert picture.size == (96, 64)
        assert picture.n_frames == figures["frames"]


def test_error_is_drawn_as_colour(take, tmp_path):
    path = tmp_path / "both.html"
    run_json("render", take, take, "--error", "--over", "-o", path)
    assert "off by 0 to" in path.read_text()


def test_what_cannot_be_drawn(small_library_template, take, tmp_path):
    for arguments, said in (
        (["render", "nobody.bvh", "-o", "x.gif"], "needs --library"),
        (["render", "nobody", "--library", small_library_template, "-o", "x.gif"], "nobody"),
        (["render", take, "-o", tmp_path / "x.mov"], ".gif, .mp4, .html"),
        (["render", take, "-o", tmp_path / "x.gif", "--size", "9x9"], "64 to 4096"),
    ):
        result = run(*arguments)
        assert result.exit_code == 1
        assert said in result.stderr
    assert run("render", take, "-o", "x.gif", "--size", "big").exit_code == 2
    assert [file.name for file in tmp_path.iterdir()] == ["take.bvh"]


@pytest.mark.parametrize("json_option", [[], ["--json"]], ids=["text", "json"])
def test_the_viewer_says_where_it_is_and_who_can_see_it(small_library_template, json_option):
    pytest.importorskip("viser")
    command = [sys.executable, "-u", "-m", "mocapdb", "view", str(small_library_template)]
    options = ["--port", "0", *json_option]
    with subprocess.Popen(
        [*command, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        said = process.stdout.readline()
        while json_option and not said.endswith("}\n"):
            said += process.stdout.readline()
        try:
            url = re.search(r"http://127\.0\.0\.1:\d+/\?token=[\w-]+", said)[0]
            if json_option:
                assert json.loads(said)["local"]
            else:
                assert "only this machine" in said
            with urlopen(url, timeout=120) as page:
                assert b"<html" in page.read(2000).lower()
            process.send_signal(2)
            assert process.communicate(timeout=120) == ("", "closed\n")
        finally:
            process.kill()
    assert process.returncode == 0


def test_what_was_assumed_of_what_is_drawn(take, tmp_path):
    (one,) = run_json("render", take, "-o", tmp_path / "one.gif", "--size", "64x64")["inputs"]
    assert (one["fps"], one["unit_m_source"]) == (120.0, "inferred")
    assert one["up"] == "y"


def test_ctrl_c_ends_the_viewer_at_whatever_moment_it_comes(small_library_template, monkeypatch):
    pytest.importorskip("viser")

    def interrupted(url):
        raise KeyboardInterrupt

    monkeypatch.setattr("webbrowser.open", interrupted)
    result = run("view", small_library_template, "--port", "0", "--browser")
    assert result.exit_code == 0
    assert "closed" in result.stderr
