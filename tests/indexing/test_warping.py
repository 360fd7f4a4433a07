"""The kernels give what their naive twins give, on any library, clip boundaries included."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from naive import naive_stretches

from mocapdb.indexing.search import MotionIndex, Template, _aligned, _costs
from mocapdb.indexing.warping import whole_cost


@st.composite
def small_libraries(draw):
    """An index of short clips (of one frame, too), and a template."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    lengths = draw(st.lists(st.integers(1, 14), min_size=1, max_size=7))
    starts = np.concatenate([[0], np.cumsum(lengths)])
    dims = draw(st.integers(1, 4))
    n_query = draw(st.integers(1, 9))
    frames = rng.normal(size=(starts[-1], dims)).astype(np.float32)
    if draw(st.booleans()):  # the query is in the library
        first = int(rng.integers(0, max(1, len(frames) - n_query)))
        query = frames[first : first + n_query].copy()
    else:
        query = rng.normal(size=(n_query, dims)).astype(np.float32)
    return MotionIndex(None, frames, starts), Template(query, len(query))


def distances_of(index, template):
    return np.linalg.norm(template.frames[:, None] - index.frames, axis=2)


@given(small_libraries())
def test_fast_equals_naive(library):
    index, template = library
    naive, _ = naive_stretches(distances_of(index, template), index.is_start)
    np.testing.assert_allclose(_costs(index, template, 0, index.n_frames), naive, atol=2e-3)


@given(small_libraries(), st.data())
def test_any_range_of_frames_gives_the_same_costs(library, data):
    index, template = library
    whole = _costs(index, template, 0, index.n_frames)
    first = data.draw(st.integers(0, index.n_frames - 1))
    end = data.draw(st.integers(first + 1, index.n_frames))
    np.testing.assert_allclose(_costs(index, template, first, end), whole[first:end], atol=2e-3)


@given(small_libraries())
def test_the_path_is_one_and_has_the_cost(library):
    index, template = library
    naive, first = naive_stretches(distances_of(index, template), index.is_start)
    for frame in range(index.n_frames):
        clip, path, cost = _aligned(index, template, frame)
        if not np.isfinite(naive[frame]):
            assert cost == np.inf
            continue
        np.testing.assert_allclose(cost, naive[frame], atol=2e-3)
        start = index.starts[clip]
        assert start + path[-1] == frame
        assert path[0] >= 0
        assert (np.diff(path) >= 0).all()
        assert (np.diff(path) <= 2).all()
        # at most two query frames share a library frame: no slower than half
        assert np.bincount(path).max() <= 2
        if np.unique(np.round(naive, 5)).size == naive.size:
            assert start + path[0] == first[frame]


def test_a_stretch_does_not_leave_its_clip():
    frames = np.arange(10, dtype=np.float32)[:, None]
    template = Template(frames[3:7].copy(), 4)
    joined = MotionIndex(None, frames, np.array([0, 10]))
    split = MotionIndex(None, frames, np.array([0, 5, 10]))
    assert _costs(joined, template, 0, 10)[6] == 0
    costs = _costs(split, template, 0, 10)
    assert costs[6] > 0.2
    assert not np.isfinite(costs[5])  # four frames cannot be matched with one


def test_half_and_double_speed_cost_nothing():
    query = np.linspace(0, 5, 12, dtype=np.float32)[:, None]
    slow = np.repeat(query, 2, axis=0)
    fast = query[::2]
    for frames, length in ((slow, 24), (fast, 6)):
        index = MotionIndex(None, frames, np.array([0, length]))
        costs = _costs(index, Template(query, 12), 0, length)
        assert costs.min() < (0.01 if length == 24 else 0.25)


def test_whole_cost_is_symmetric_and_refuses_a_third_of_the_length():
    rng = np.random.default_rng(0)
    distances = rng.random((12, 17)).astype(np.float32)
    assert np.isclose(whole_cost(distances), whole_cost(distances.T.copy()))
    assert whole_cost(np.zeros((9, 9), np.float32)) == 0
    assert whole_cost(rng.random((5, 16)).astype(np.float32)) == np.inf
