import matplotlib as mpl
import numpy as np
import pytest

mpl.use("agg")

from matplotlib import pyplot

from mocapdb.errors import ClipError
from mocapdb.plots import class_durations, clip_costs, flagged_joints, precision_recall


@pytest.fixture(autouse=True)
def _close_figures():
    yield
    pyplot.close("all")


def test_the_class_with_the_most_is_first():
    ax = class_durations({"run": 10.0, "walk": 30.0}, {"run": 3, "walk": 2})
    assert [label.get_text() for label in ax.get_yticklabels()] == ["walk", "run"]
    assert [text.get_text() for text in ax.texts] == ["2", "3"]
    assert "(s)" in ax.get_xlabel()
    assert ax.yaxis_inverted()


def test_many_classes_are_summed_up_in_minutes():
    names = [f"class {i}" for i in range(30)]
    ax = class_durations(dict.fromkeys(names, 600.0), dict.fromkeys(names, 2), most=5)
    assert [label.get_text() for label in ax.get_yticklabels()][-1] == "25 others"
    assert ax.patches[-1].get_width() == pytest.approx(25 * 10)
    assert "(min)" in ax.get_xlabel()
    with pytest.raises(ClipError, match="class"):
        class_durations({}, {})


def test_a_dot_for_each_clip():
    ax = clip_costs([10.0, 20.0, 60.0], [1.0, 2.0, 3.0])
    np.testing.assert_allclose(
        ax.collections[0].get_offsets(), [[1.0, 10.0], [2.0, 20.0], [3.0, 60.0]]
    )
    assert ax.lines[0].get_ydata()[0] == 20.0
    assert clip_costs([], []).collections


def test_joints_by_kind():
    ax = flagged_joints({"knee": {"flip": 1}, "wrist": {"noise": 2, "flip": 1}, "head": {}})
    assert [label.get_text() for label in ax.get_yticklabels()] == ["wrist", "knee"]
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["flip", "noise"]
    with pytest.raises(ClipError, match="flagged"):
        flagged_joints({"head": {}})


def test_precision_over_recall():
    recall, precision = np.array([1.0, 0.5]), np.array([0.4, 0.9])
    ax = precision_recall({"ours": (recall, precision)})
    assert list(ax.lines[0].get_xdata()) == [0.5, 1.0]
    assert list(ax.lines[0].get_ydata()) == [0.9, 0.4]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("recall", "precision")
