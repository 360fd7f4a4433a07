import matplotlib as mpl
import numpy as np
import pytest

mpl.use("agg")

from matplotlib import pyplot

from mocapdb.errors import ClipError
from mocapdb.plots import confusion_matrix, log_density, query_hits, search_growth


@pytest.fixture(autouse=True)
def _close_figures():
    yield
    pyplot.close("all")


def test_confusion_in_percent_of_rows():
    ax = confusion_matrix(["run", "walk", "walk"], ["run", "walk", "none"])
    assert [text.get_text() for text in ax.get_yticklabels()] == ["run (1)", "walk (2)"]
    assert [text.get_text() for text in ax.get_xticklabels()] == ["run", "walk", "none"]
    assert sorted(text.get_text() for text in ax.texts) == ["100", "50", "50"]


def test_confusion_of_nothing():
    for truth, answers in (([], []), (["run"], [])):
        with pytest.raises(ClipError, match="as many answers as clips"):
            confusion_matrix(truth, answers)


def test_log_density_over_seconds():
    ax = log_density({"walk": np.zeros(48), "run": np.ones(48)}, 24.0)
    assert [line.get_label() for line in ax.lines] == ["walk", "run"]
    assert ax.lines[0].get_xdata()[-1] == pytest.approx(47 / 24)


def test_query_above_its_hits(synthetic_walk):
    _, ax = pyplot.subplots()
    assert (
        query_hits(synthetic_walk, [synthetic_walk[:90], synthetic_walk], ["a", "b"], ax=ax) is ax
    )
    titles = [room.get_title(loc="left") for room in ax.child_axes]
    assert titles == ["query", "a", "b"]


def test_hits_stand_in_one_scale_at_their_own_times(synthetic_walk):
    hits = [synthetic_walk[:90], synthetic_walk]
    times = [np.arange(len(clip)) / 10 + start for start, clip in enumerate([hits[0], *hits])]
    ax = query_hits(hits[0], hits, ["a", "b"], times_s=times, query_title="query: a", n_poses=3)
    rooms = ax.child_axes
    assert rooms[0].get_title(loc="left") == "query: a"
    assert len({(room.get_xlim(), room.get_ylim()) for room in rooms}) == 1
    for room, own in zip(rooms, times, strict=True):
        ends = [float(label.get_text()) for label in room.get_xticklabels()][::2]
        assert ends == pytest.approx([own[0], own[-1]])
        hips = [line.get_xdata().mean() for line in room.lines[:3]]
        assert hips == pytest.approx(room.get_xticks(), abs=0.5)


def test_growth_says_the_power_it_fits():
    ax = search_growth([1000, 10_000], {"exact": np.array([1.0, 10.0])})
    assert ax.get_legend().get_texts()[0].get_text() == "exact: frames to the 1.00"
