"""Threads that share work with the one that asks for it.

A step of a search takes a millisecond or less. Starting a thread, waking it, and being woken by it
take a tenth of that each. So threads are kept for the next search. The thread that asks for work
does a part of it, and does not wait for a thread that has not begun when the work is done.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any, TypeVar

__all__ = ["ThreadPool"]

Item = TypeVar("Item")
Result = TypeVar("Result")


class ThreadPool:
    """The thread that asks for work, and others that help it.

    Parameters
    ----------
    size : int
        How many threads, the one that asks included.
    """

    def __init__(self, size: int) -> None:
        self._n_others = size - 1
        self._others = ThreadPoolExecutor(max(size - 1, 1))  # starts them when needed

    @classmethod
    @cache
    def shared(cls, size: int) -> ThreadPool:
        """Return the pool of a size that all searches share."""
        return cls(size)

    def map(self, work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
        """Return what comes of some work on each item."""
        results: list[Any] = [None] * len(items)
        left = iter(range(len(items)))  # shared: each thread takes the next number

        def take_part() -> None:
            for i in left:
                results[i] = work(items[i])

        others = [
            self._others.submit(take_part) for _ in range(min(self._n_others, len(items) - 1))
        ]
        take_part()
        for other in others:
            if not other.cancel():
                other.result()
        return results
