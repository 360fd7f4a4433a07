"""Answers that are kept for as long as what was asked about lives."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Concatenate, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

__all__ = ["kept_with_first"]

First = TypeVar("First")
Answer = TypeVar("Answer")
Others = ParamSpec("Others")


def kept_with_first(
    function: Callable[Concatenate[First, Others], Answer],
) -> Callable[Concatenate[First, Others], Answer]:
    """Return a function that computes once for each first argument, by identity, while it lives.

    The first argument decides the answer: the others only hand on what is known of it already.

    Examples
    --------
    >>> class Clip: pass
    >>> asked = []
    >>> @kept_with_first
    ... def length(clip):
    ...     asked.append(clip)
    ...     return 3
    >>> clip = Clip()
    >>> length(clip), length(clip), len(asked)
    (3, 3, 1)
    """
    kept: WeakKeyDictionary[First, Answer] = WeakKeyDictionary()

    @wraps(function)
    def answer(first: First, /, *others: Others.args, **named: Others.kwargs) -> Answer:
        if first not in kept:
            kept[first] = function(first, *others, **named)
        return kept[first]

    return answer
