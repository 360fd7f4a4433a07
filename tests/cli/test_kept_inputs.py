"""A command never writes over what it reads, nor over what is said to be read-only."""

import pytest
from click.testing import CliRunner

from mocapdb.cli import cli
from mocapdb.corpus import synthetic
from mocapdb.io import read_clip, write_clip


@pytest.fixture
def walk(tmp_path):
    write_clip(synthetic.make_clip("walk", seed=1, duration_s=3), tmp_path / "walk.amc")
    write_clip(synthetic.make_clip("walk", seed=1, duration_s=3), tmp_path / "walk.bvh")
    return tmp_path


def run(folder, *arguments):
    with pytest.MonkeyPatch.context() as here:
        here.chdir(folder)
        return CliRunner().invoke(cli, list(arguments))


@pytest.mark.parametrize(
    "arguments",
    [
        ("convert", "walk.bvh", "walk.bvh"),
        ("convert", "walk.bvh", "link.bvh"),
        ("clean", "walk.bvh", "-o", "walk.bvh"),
        ("cycle", "walk.amc", "-o", "walk.amc"),
        ("blend", "walk.bvh", "walk.amc", "--weight", "0.5", "-o", "walk.bvh"),
        ("gait", "walk.bvh", "-o", "walk.bvh"),
        ("segment", "walk.bvh", "--plot", "walk.bvh"),
        ("render", "walk.bvh", "-o", "walk.bvh"),
    ],
    ids=" ".join,
)
def test_what_is_read_stays(walk, arguments):
    (walk / "link.bvh").symlink_to("walk.bvh")
    names = ("walk.amc", "walk.asf", "walk.bvh")
    before = {name: (walk / name).read_bytes() for name in names}
    done = run(walk, *arguments)
    assert done.exit_code != 0
    assert "Traceback" not in done.output
    assert {name: (walk / name).read_bytes() for name in names} == before


def test_a_skeleton_that_is_read_stays(walk):
    write_clip(read_clip(walk / "walk.amc"), walk / "take.amc")
    (walk / "take.asf").unlink()
    before = (walk / "walk.asf").read_bytes()
    done = run(walk, "convert", "take.amc", "walk.amc", "--skeleton", "walk.asf")
    assert done.exit_code == 1
    assert "would be lost; name another file" in done.stderr
    assert (walk / "walk.asf").read_bytes() == before


def test_a_read_only_file_stays(walk):
    target = walk / "kept.bvh"
    target.write_text("mine")
    target.chmod(0o444)
    done = run(walk, "convert", "walk.amc", "kept.bvh")
    assert (done.exit_code, target.read_text()) == (1, "mine")
    assert "read-only" in done.stderr


def test_in_python_one_may(walk):
    clip = read_clip(walk / "walk.bvh")
    write_clip(clip[:10], walk / "walk.bvh")
    assert len(read_clip(walk / "walk.bvh")) == 10
