"""What was probably meant by a name that there is not."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

__all__ = ["did_you_mean"]


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return a question that ends an error's sentence: the nearest known name; empty for none.

    Capitals do not count, and dashes and underscores are the same.

    Examples
    --------
    >>> "Expected a style, but got 'femnine'." + did_you_mean("femnine", ["feminine", "old"])
    "Expected a style, but got 'femnine'. Did you mean feminine?"
    >>> did_you_mean("run", ["walk"])
    ''
    """
    by_spelling = {_plain(each): each for each in known}
    near = get_close_matches(_plain(name), by_spelling, n=1)
    return f" Did you mean {by_spelling[near[0]]}?" if near else ""


def _plain(name: str) -> str:
    return name.strip().lower().replace("_", "-")
