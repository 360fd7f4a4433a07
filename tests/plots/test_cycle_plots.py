import matplotlib as mpl
import numpy as np
import pytest

mpl.use("agg")

from matplotlib import pyplot

from mocapdb.cycles.phase.excitation import Excitation, LoopsOfClip
from mocapdb.plots import (
    barcode,
    excitation,
    harmonic_fit,
    jerk,
    persistence_diagram,
    phase_path,
    seam,
)


@pytest.fixture(autouse=True)
def _close_figures():
    yield
    pyplot.close("all")


def test_the_chosen_class_is_ringed():
    bars = np.array([[0.2, 2.0], [0.3, 0.5], [0.4, 0.45]])
    ax = persistence_diagram(bars, chosen=1)
    assert {text.get_text() for text in ax.texts} >= {"0", "1"}
    points, ring = ax.collections
    assert len(points.get_offsets()) == 3
    np.testing.assert_allclose(ring.get_offsets(), [[0.3, 0.5]])


def test_bars_go_from_birth_to_death():
    ax = barcode(np.array([[0.2, 2.0], [0.3, 0.5]]), n_loops=1)
    assert [line.get_xdata().tolist() for line in ax.lines] == [[0.2, 2.0], [0.3, 0.5]]
    assert ax.lines[0].get_color() != ax.lines[1].get_color()


def test_each_loop_shows_where_it_is_gone_round():
    laps = np.array([np.linspace(0, 3, 90), np.zeros(90)])
    region = Excitation(0, 60, 0, 2.0)
    ax = excitation(LoopsOfClip(np.ones((2, 2)), np.zeros(2), 2, laps, (region,)), 30.0)
    assert ax.lines[2].get_xdata().tolist() == [0.0, 2.0]
    assert [text.get_text() for text in ax.texts] == ["2.0"]


def test_a_clip_may_begin_later():
    laps = np.array([np.linspace(0, 3, 90)])
    region = Excitation(0, 60, 0, 2.0)
    found = LoopsOfClip(np.ones((1, 2)), np.zeros(1), 1, laps, (region,))
    ax = excitation(found, 30.0, start_s=5.0)
    assert ax.lines[0].get_xdata()[0] == 5.0
    assert ax.lines[1].get_xdata().tolist() == [5.0, 7.0]


def test_jerk_of_laps_lies_under_that_of_the_loop():
    phase = np.arange(-50, 150) / 100
    loop_phase = (np.arange(100) - 0.5) / 100
    ax = jerk(phase, np.ones(200), loop_phase, np.arange(100.0))
    laps = [line for line in ax.lines if line.get_label().startswith("_")]
    assert [len(line.get_xdata()) for line in laps] == [50, 100, 50]
    loop = next(line for line in ax.lines if line.get_label() == "loop")
    assert (np.diff(loop.get_xdata()) > 0).all()
    assert loop.get_ydata()[-1] == 0.0  # half a frame before the lap begins is its end


def test_phase_has_cyclic_colours():
    angle = np.linspace(0, 6, 50)
    path = np.column_stack([np.cos(angle), np.sin(angle)])
    ax = phase_path(path, angle / 6 + 3.2, cycle=path[::5])
    (points,) = ax.collections
    first, last = points.cmap(0.0), points.cmap(1.0)
    np.testing.assert_allclose(first, last, atol=0.02)
    assert points.get_clim() == (0, 1)
    curve = ax.lines[0].get_xydata()
    np.testing.assert_allclose(curve[0], curve[-1])


def test_laps_lie_over_each_other():
    phase = np.arange(250) / 100
    ax = harmonic_fit(phase, np.sin(phase), np.zeros(20), name="lfemur.rx")
    laps = [line for line in ax.lines if line.get_label().startswith("_")]
    assert [len(line.get_xdata()) for line in laps] == [100, 100, 50]
    assert ax.get_ylabel() == "lfemur.rx (degrees)"


def test_the_seam_is_in_the_middle():
    steps = np.ones(11)
    steps[-1] = 3.0
    ax = seam(steps)
    curve = dict(zip(*ax.lines[0].get_data(), strict=True))
    assert curve[0] == 3.0
    assert sum(value == 1.0 for value in curve.values()) == 10
    assert "3.00" in ax.get_legend().get_texts()[0].get_text()
