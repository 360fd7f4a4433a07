"""The verbs of `mocapdb`: each job one call away, and named where one looks first."""

import pytest

import mocapdb
from mocapdb.corpus import synthetic
from mocapdb.io.find_files import DRAWN_SUFFIXES
from mocapdb.scenes.animation import is_animation


@pytest.mark.parametrize("name", ["classify", "clean", "cycle", "fill", "query", "segment"])
def test_help_names_every_job(name):
    assert f"mocapdb.{name}(" in mocapdb.__doc__
    assert getattr(mocapdb, name).__doc__


def test_help_calls_what_there_is():
    for name in ("read_clip", "write_clip", "build_library", "BuildSettings", "Library"):
        assert f"mocapdb.{name}(" in mocapdb.__doc__
        assert hasattr(mocapdb, name)
    assert hasattr(mocapdb.gait, "analyse_gait")
    for word in ("retime", "concat", "place", "in_place", "with_root", "drop_joints"):
        assert f"``{word}``" in mocapdb.__doc__
        assert hasattr(mocapdb.Clip, word)


def test_jobs_take_files_and_every_suffix_is_written(tmp_path):
    clip = synthetic.make_clip("walk", seed=1, duration_s=3.0)
    path = tmp_path / "walk.npz"
    mocapdb.write_clip(clip, path)
    assert mocapdb.cycle(path).cycle.period_s == mocapdb.cycle(clip).cycle.period_s
    assert len(mocapdb.segment(str(path)).segments) == len(mocapdb.segment(clip).segments)
    with pytest.raises(mocapdb.MocapdbError, match="a clip or a motion file, but got a list"):
        mocapdb.clean([clip])
    assert mocapdb.write_clip(clip[:10], tmp_path / "walk.glb") == clip[:10]
    assert len(mocapdb.read_clip(tmp_path / "walk.glb")) == 10
    assert all(is_animation(f"x{suffix}") for suffix in DRAWN_SUFFIXES)
    with pytest.raises(mocapdb.MocapdbError, match=r"\.fbx, \.glb, \.gif, \.mp4, \.html, but"):
        mocapdb.write_clip(clip, tmp_path / "walk.foo")
    with pytest.raises(mocapdb.MocapdbError, match=r"written by mocapdb\.write_clip"):
        mocapdb.io.write_clip(clip, tmp_path / "walk.glb")
    with pytest.raises(mocapdb.MocapdbError, match=r"A \.csv is written only"):
        mocapdb.read_clip(tmp_path / "walk.csv")
