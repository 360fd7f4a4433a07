"""Threads that share work with the one that asks for it.

The steps of a search take a millisecond or less; to start a thread, to wake it up and to be woken
by it, a tenth of that each. So threads are kept for the next search, and who asks for work takes
part in it and waits for no thread that comes too late.
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
        self._others = ThreadPoolExecutor(max(size - 1, 1))  # which starts them as they are needed

    @classmethod
    @cache
    def shared(cls, size: int) -> ThreadPool:
        """Return the pool of a size that all searches share."""
        return cls(size)

    def map(self, work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
        """Return what comes of some work on each item."""
        results: list[Any] = [None] * len(items)
        left = iter(range(len(items)))  # each number is given to one thread only

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
