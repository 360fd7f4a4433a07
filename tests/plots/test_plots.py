from dataclasses import replace

import made_bodies as made
import matplotlib as mpl
import numpy as np
import pytest

mpl.use("agg")

from matplotlib import pyplot
from numpy.testing import assert_allclose

from mocapdb.errors import ClipError
from mocapdb.motion.clip import Clip
from mocapdb.plots import rate_distortion, skeleton_strip


@pytest.fixture(autouse=True)
def _close_figures():
    yield
    pyplot.close("all")


def test_a_strip_shows_time_from_left_to_right(synthetic_walk):
    ax = skeleton_strip(synthetic_walk, n_poses=5)
    ticks = [float(label.get_text()) for label in ax.get_xticklabels()]
    assert ticks == sorted(ticks)
    assert len(ticks) == 5
    assert ticks[-1] == pytest.approx((len(synthetic_walk) - 1) / synthetic_walk.fps, abs=0.01)
    heights = [y for line in ax.lines for y in line.get_ydata()]
    assert max(heights) == pytest.approx(
        synthetic_walk.skeleton.height * synthetic_walk.skeleton.metres_per_unit, abs=0.15
    )
    assert ax.get_legend() is None


def test_a_strip_compares_clips_by_name(synthetic_walk):
    _, ax = pyplot.subplots()
    both = {"before": synthetic_walk, "after": synthetic_walk}
    assert skeleton_strip(both, n_poses=4, ax=ax) is ax
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["before", "after"]


def test_a_still_root_of_the_scene_is_left_out():
    plain = made.make_walk()
    whole = made.under_scene(plain)
    body = Clip(plain.skeleton, plain.channels, 30.0)
    under = Clip(replace(whole.skeleton, body_root=1), whole.channels, 30.0)
    drawn, plain = skeleton_strip(under, n_poses=4), skeleton_strip(body, n_poses=4)
    assert len(drawn.lines) == len(plain.lines)
    for one, other in zip(drawn.lines, plain.lines, strict=True):
        assert_allclose(one.get_xydata(), other.get_xydata(), atol=1e-6)


def test_time_can_be_told_by_frame(synthetic_walk):
    ax = skeleton_strip(
        synthetic_walk[:3], n_poses=3, times_s=np.array([4.0, 4.5, 6.0]), spacing_m=2.0
    )
    assert [label.get_text() for label in ax.get_xticklabels()] == ["4.00", "4.50", "6.00"]
    assert ax.get_xticks().tolist() == [0.0, 2.0, 4.0]


def test_clips_of_different_lengths_are_not_compared(synthetic_walk):
    with pytest.raises(ClipError, match="one length"):
        skeleton_strip({"a": synthetic_walk, "b": synthetic_walk[:10]})


def test_rate_and_distortion_is_a_curve_for_each_codec():
    ax = rate_distortion({"ours": [(10.0, 1.0), (5.0, 3.0)], "theirs": [(20.0, 1.0)]})
    assert [line.get_label() for line in ax.lines] == ["ours", "theirs"]
    assert list(ax.lines[0].get_xdata()) == [3.0, 1.0]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("mean vertex error (mm)", "bytes a frame")


def test_every_picture_is_there_whatever_was_loaded_before():
    import pkgutil
    from importlib import import_module

    from mocapdb import plots

    for module in pkgutil.iter_modules(plots.__path__):
        import_module(f"{plots.__name__}.{module.name}")
    for name in plots.__all__:
        assert getattr(plots, name).__module__.startswith("mocapdb.plots."), name
