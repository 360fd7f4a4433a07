"""The kernels give what their naive twins give, on any library, clip boundaries included."""

from itertools import pairwise
from unittest import mock

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from naive import naive_stretches

from mocapdb.base.thread_pool import ThreadPool
from mocapdb.indexing.search.example_query import Template
from mocapdb.indexing.search.frame_store import Frames
from mocapdb.indexing.search.span_scan import distances, merged, minima
from mocapdb.indexing.search.stretch_search import aligned
from mocapdb.indexing.search.warping import warp_whole

ROUNDING = 6e-3  # of a distance near 0: float32 keeps a square, up to 116 here, to 1e-5


@st.composite
def small_libraries(draw):
    """An index of short clips (of one frame, too), and a template."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    lengths = draw(st.lists(st.integers(1, 14), min_size=1, max_size=7))
    starts = np.concatenate([[0], np.cumsum(lengths)])
    dims = draw(st.sampled_from([4, 8]))
    n_query = draw(st.integers(1, 9))
    codes = rng.integers(-127, 128, (starts[-1], dims)).astype(np.int8)
    frames = Frames(codes, rng.uniform(0.01, 0.03, dims).astype(np.float32), starts)
    if draw(st.booleans()):  # the query is in the library
        first = int(rng.integers(0, max(1, len(frames) - n_query)))
        query = frames.values(slice(first, first + n_query))
    else:
        query = rng.normal(size=(n_query, dims)).astype(np.float32)
    return frames, Template(query, len(query))


def frames_of(values, starts):
    """Whole numbers as frames, along the first of four axes."""
    codes = np.zeros((len(values), 4), np.int8)
    codes[:, 0] = values
    return Frames(codes, np.ones(4, np.float32), np.array(starts))


def distances_of(frames, template):
    return np.linalg.norm(template.frames[:, None] - frames.values(slice(None)), axis=2)


def costs_of(frames, template, first=0, end=None):
    return distances(frames, template, np.array([[first, len(frames) if end is None else end]]))


@given(small_libraries())
def test_fast_equals_naive(library):
    frames, template = library
    naive, _ = naive_stretches(distances_of(frames, template), frames.starts)
    np.testing.assert_allclose(costs_of(frames, template), naive, atol=ROUNDING)


@given(small_libraries(), st.data())
def test_any_range_of_frames_gives_the_same_costs(library, data):
    frames, template = library
    whole = costs_of(frames, template)
    first = data.draw(st.integers(0, len(frames) - 1))
    end = data.draw(st.integers(first + 1, len(frames)))
    np.testing.assert_allclose(
        costs_of(frames, template, first, end), whole[first:end], atol=ROUNDING
    )


@given(small_libraries(), st.integers(1, 5))
def test_tiles_of_any_length_give_the_same_costs(library, tile):
    frames, template = library
    whole = costs_of(frames, template)
    with mock.patch("mocapdb.indexing.search.span_scan.TILE_NUMBERS", tile * len(frames.steps)):
        np.testing.assert_allclose(costs_of(frames, template), whole, atol=ROUNDING)


def minima_of(frames, template, spans, **options):
    ((rows, values),) = minima(frames, [template], [spans], ThreadPool.shared(1), **options)
    return rows.tolist(), values


@given(small_libraries(), st.integers(1, 9), st.floats(0, 1))
def test_up_to_a_limit_the_minima_are_the_same(library, tile, quantile):
    frames, template = library
    spans = np.array([[0, len(frames)]])
    rows, values = minima_of(frames, template, spans)
    limit = float(np.quantile(values, quantile)) if len(values) else 1.0
    with mock.patch("mocapdb.indexing.search.span_scan.TILE_NUMBERS", tile * len(frames.steps)):
        near, near_values = minima_of(frames, template, spans, limit=limit)
    assert (near_values <= limit).all()
    whole = costs_of(frames, template)
    np.testing.assert_allclose(near_values, whole[near], atol=ROUNDING)
    if np.unique(np.round(whole, 2)).size == whole.size:  # ties may fall either way
        assert {row for row in rows if whole[row] < limit - ROUNDING} <= set(near) <= set(rows)


@given(small_libraries(), st.integers(1, 9), st.data())
def test_spans_have_the_minima_of_each_clip(library, tile, data):
    frames, template = library
    cuts = st.lists(st.integers(0, len(frames)), min_size=2, max_size=8, unique=True)
    edges = sorted(data.draw(cuts))
    spans = np.array([edges[i : i + 2] for i in range(0, len(edges) - 1, 2)])
    whole = costs_of(frames, template)
    lowest = []
    for first, end in pairwise(frames.starts):
        fenced = np.concatenate([[np.inf], whole[first:end], [np.inf]])
        is_lowest = (fenced[1:-1] < fenced[:-2]) & (fenced[1:-1] <= fenced[2:])
        lowest += (first + np.flatnonzero(is_lowest)).tolist()
    asked = [row for row in lowest if any(first <= row < end for first, end in spans)]
    k = data.draw(st.integers(1, 4))
    with mock.patch("mocapdb.indexing.search.span_scan.TILE_NUMBERS", tile * len(frames.steps)):
        rows, values = minima_of(frames, template, spans)
        few, few_values = minima_of(frames, template, spans, most=k)
    if np.unique(np.round(whole, 2)).size == whole.size:  # ties may fall either way
        assert rows == asked
        assert few == sorted(sorted(asked, key=lambda row: whole[row])[:k])
    np.testing.assert_allclose(values, whole[rows], atol=ROUNDING)
    np.testing.assert_allclose(few_values, whole[few], atol=ROUNDING)


@given(small_libraries(), small_libraries(), st.integers(1, 6))
def test_each_template_has_its_own_spans_and_shares_of_the_work(library, other, most):
    frames, template = library
    n_axes = min(len(frames.steps), other[1].frames.shape[1])
    narrow = Frames(frames.codes[:, :n_axes].copy(), frames.steps[:n_axes], frames.starts)
    templates = [Template(each.frames[:, :n_axes], 1) for each in (template, other[1])]
    spans = [np.array([[0, len(frames)]]), np.array([[len(frames) // 2, len(frames)]])]
    alone = [minima_of(narrow, *each, most=most) for each in zip(templates, spans, strict=True)]
    with mock.patch.multiple("mocapdb.indexing.search.span_scan", LEAST_SHARED=0, SHARE=8):
        found = minima(narrow, templates, spans, ThreadPool.shared(3), most=most)
    for (rows, values), (own_rows, own_values) in zip(found, alone, strict=True):
        if np.unique(np.round(own_values, 2)).size == most:
            np.testing.assert_allclose(values, own_values, atol=ROUNDING)
            assert rows.tolist() == own_rows


@given(st.lists(st.tuples(st.integers(0, 30), st.integers(1, 6)), min_size=1))
def test_merged_spans_cover_the_same_frames_once(spans):
    spans = np.array([(first, first + length) for first, length in spans])
    joined = merged(spans)
    covered = [row for first, end in joined for row in range(first, end)]
    assert covered == sorted({row for first, end in spans for row in range(first, end)})
    assert (joined[1:, 0] > joined[:-1, 1]).all()


@given(small_libraries())
def test_the_path_is_one_and_has_the_cost(library):
    frames, template = library
    naive, first = naive_stretches(distances_of(frames, template), frames.starts)
    for frame in range(len(frames)):
        clip, path, cost = aligned(frames, template, frame)
        if not np.isfinite(naive[frame]):
            assert cost == np.inf
            continue
        np.testing.assert_allclose(cost, naive[frame], atol=ROUNDING)
        start = frames.starts[clip]
        assert start + path[-1] == frame
        assert path[0] >= 0
        assert (np.diff(path) >= 0).all()
        assert (np.diff(path) <= 2).all()
        # at most two query frames share a library frame: no slower than half
        assert np.bincount(path).max() <= 2
        if np.unique(np.round(naive, 5)).size == naive.size:
            assert start + path[0] == first[frame]


def test_a_stretch_does_not_leave_its_clip():
    joined, split = frames_of(range(10), [0, 10]), frames_of(range(10), [0, 5, 10])
    template = Template(joined.values(slice(3, 7)), 4)
    assert costs_of(joined, template)[6] == 0
    costs = costs_of(split, template)
    assert costs[6] > 0.2
    assert not np.isfinite(costs[5])  # four frames cannot be matched with one


def test_half_and_double_speed_cost_nothing():
    query = 5 * np.arange(12)
    template = Template(query[:, None] * np.eye(1, 4, dtype=np.float32), 12)
    for values, most in ((np.repeat(query, 2), 0.1), (query[::2], 2.6)):
        assert costs_of(frames_of(values, [0, len(values)]), template).min() < most


def test_whole_cost_is_symmetric_and_refuses_a_third_of_the_length():
    rng = np.random.default_rng(0)
    costs = rng.random((12, 17)).astype(np.float32)
    assert np.isclose(warp_whole(costs)[1], warp_whole(costs.T.copy())[1])
    assert warp_whole(np.zeros((9, 9), np.float32))[1] == 0
    assert warp_whole(rng.random((5, 16)).astype(np.float32))[1] == np.inf
