"""Archives of plain arrays: what numpy has changed, or a model has made, comes back as a clip."""

from __future__ import annotations

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.errors import FormatError
from mocapdb.io import read_clip, write_clip
from mocapdb.io.conventions import to_bvh_convention


@pytest.fixture(scope="module")
def walk():
    return synthetic.make_clip("walk", seed=1, duration_s=0.5)


def plain(clip, path):
    """The arrays that others read of a clip, without what mocapdb reads."""
    write_clip(clip, path)
    with np.load(path) as archive:
        return {name: archive[name] for name in archive.files if name not in ("header", "channels")}


@pytest.mark.parametrize("convention", ["acclaim", "bvh"])
def test_they_come_back_as_a_clip(walk, tmp_path, convention):
    clip = walk if convention == "acclaim" else to_bvh_convention(walk)
    path = tmp_path / "again.npz"
    np.savez(path, **plain(clip, tmp_path / "walk.npz"))
    again = read_clip(path)
    assert (again.skeleton.convention, again.fps, again.name) == (convention, 120, "again")
    assert again.skeleton.names == clip.skeleton.names
    assert np.allclose(again.positions(), clip.positions(), atol=1e-5)
    turned = np.abs(np.sum(again.rotations() * clip.rotations(), axis=-1))
    assert np.allclose(turned, 1.0, atol=1e-6)


def test_a_rate_and_a_root_can_be_said_otherwise(walk, tmp_path):
    arrays = plain(walk, tmp_path / "walk.npz")
    root = arrays.pop("positions")[:, 0] + [1, 0, 0]
    del arrays["fps"]
    np.savez(tmp_path / "moved.npz", **arrays, root=root)
    clip = read_clip(tmp_path / "moved.npz", fps=60)
    assert (clip.fps, clip.fps_source) == (60, "caller")
    assert np.allclose(clip.positions(), walk.positions() + np.array([1, 0, 0]), atol=1e-5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"names": None}, "no names"),
        ({"fps": None, "positions": None}, "no fps, no root or positions"),
        ({"quaternions": np.ones((60, 30, 4))}, r"quaternions \(frames, 31, 4\)"),
        ({"quaternions": np.zeros((60, 31, 4))}, "frame 0 for 'root'"),
        ({"parents": np.arange(31)}, "parent of 'root' before it, but got 0"),
        ({"parents": np.arange(30) - 1}, "31 parents for 31 names"),
        ({"convention": np.array("fbx")}, "'bvh' or 'acclaim', but got 'fbx'"),
        ({"fps": np.array(0.0)}, "positive frame rate"),
        ({"offsets": np.zeros(4)}, "arrays of a motion"),
        ({"fps": np.array("fast")}, "arrays of a motion"),
        ({"names": np.array(["a"] * 31)}, "unique joint names"),
    ],
)
def test_what_does_not_fit_together_is_told(walk, tmp_path, change, message):
    arrays = plain(walk, tmp_path / "walk.npz") | change
    path = tmp_path / "bad.npz"
    np.savez(path, **{name: value for name, value in arrays.items() if value is not None})
    with pytest.raises(FormatError, match=message) as error:
        read_clip(path)
    assert str(error.value).startswith(str(path))
