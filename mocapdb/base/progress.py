"""How work that takes long reports its progress."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

__all__ = ["Progress", "silent"]

Progress: TypeAlias = Callable[[int, int, str], None]
"""Called with the number of items done, the number of all items, and an item's name."""


def silent(done: int, total: int, name: str) -> None:
    """Report nothing: for callers that ask for no progress."""
