"""Kernels that order numbers give what numpy gives."""

from __future__ import annotations

import numpy as np
import pytest

from mocapdb.base.selection import kth_smallest, make_heap, sift_down


@pytest.mark.parametrize("seed", range(20))
def test_the_kth_smallest_is_the_one_that_sorting_puts_there(seed):
    rng = np.random.default_rng(seed)
    values = rng.integers(0, 30, rng.integers(1, 200)).astype(np.float32)  # many are equal
    n = int(rng.integers(1, len(values) + 1))
    expected = np.sort(values[:n])
    for k in range(n):
        assert kth_smallest(values.copy(), n, k) == expected[k]


@pytest.mark.parametrize("seed", range(20))
def test_a_heap_gives_keys_in_order(seed):
    rng = np.random.default_rng(seed)
    keys = rng.integers(0, 30, rng.integers(1, 200)).astype(np.float32)
    heap = np.empty(len(keys), dtype=np.int64)
    make_heap(keys, heap)
    taken = []
    for n in range(len(keys) - 1, -1, -1):
        taken.append(int(heap[0]))
        heap[0] = heap[n]
        sift_down(keys, heap, 0, n)
    assert sorted(taken) == list(range(len(keys)))
    np.testing.assert_array_equal(keys[taken], np.sort(keys))
