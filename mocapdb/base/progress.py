"""How long work says how far it is."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

__all__ = ["Progress", "silent"]

Progress: TypeAlias = Callable[[int, int, str], None]
"""Called with how many are done, how many there are, and the name of the one at hand."""


def silent(done: int, total: int, name: str) -> None:
    """Say nothing: the progress of those who asked for none."""
