"""Kernels that order numbers: numba takes seconds to compile numpy's for other kernels."""

from __future__ import annotations

from mocapdb.base.arrays import Float32Array, IntArray
from mocapdb.base.kernels import jit

__all__ = ["kth_smallest", "make_heap", "sift_down"]


@jit
def kth_smallest(values: Float32Array, n: int, k: int) -> float:
    """Return the number that is the k-th, from 0, when the first n are sorted; reorders them.

    Hoare's *Algorithm 65: Find* (1961).
    """
    first, last = 0, n - 1
    while first < last:
        pivot = values[k]
        i, j = first, last
        while i <= j:
            while values[i] < pivot:
                i += 1
            while pivot < values[j]:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if j < k:
            first = i
        if k < i:
            last = j
    found: float = values[k]
    return found


@jit
def make_heap(keys: Float32Array, heap: IntArray) -> None:
    """Fill `heap` with the indices of keys, the one of the least key first (see `sift_down`)."""
    n = len(heap)
    for i in range(n):
        heap[i] = i
    for i in range(n // 2 - 1, -1, -1):
        sift_down(keys, heap, i, n)


@jit
def sift_down(keys: Float32Array, heap: IntArray, i: int, n: int) -> None:
    """Let the index at place i of a heap of n sink until no key below it is less than its own."""
    moved = heap[i]
    while 2 * i + 1 < n:
        below = 2 * i + 1
        if below + 1 < n and keys[heap[below + 1]] < keys[heap[below]]:
            below += 1
        if keys[moved] <= keys[heap[below]]:
            break
        heap[i] = heap[below]
        i = below
    heap[i] = moved
