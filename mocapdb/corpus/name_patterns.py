"""What a file's name says, by a pattern such as ``{dataset}_{label}_{style}_{take}``."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import PurePosixPath

from mocapdb.corpus.columns import check_column
from mocapdb.errors import CorpusError

__all__ = ["NamePattern"]

FIELD = re.compile(r"\{([^{}]*)\}")
OWN = {"label", "subject", "description"}


class NamePattern:
    """A pattern of names: fields in braces, and what stands between them.

    A field is one letter or more, and has nothing in it of what stands beside it: in
    ``{label}_{take}`` neither has ``_``. A pattern with ``/`` is of the last folders too.

    Parameters
    ----------
    text : str
        The pattern. ``label``, ``subject`` and ``description`` are what a label file calls so; any
        other field is a further column.

    Raises
    ------
    CorpusError
        If it has no field, a field twice, two fields with nothing between them, a single brace, or
        a field with a reserved name.

    Examples
    --------
    >>> pattern = NamePattern("{dataset}_{label}_{style}_{take}")
    >>> pattern.fields("takes/dataset-1_walk-left_old_001.bvh")
    {'dataset': 'dataset-1', 'label': 'walk-left', 'style': 'old', 'take': '001'}
    >>> pattern.fields("takes/walk_001.bvh") is None
    True
    """

    def __init__(self, text: str) -> None:
        self.text = text
        literals = FIELD.split(text)[::2]
        names = FIELD.findall(text)
        if any(brace in literal for literal in literals for brace in "{}"):
            raise self._error("a brace alone")
        if not names:
            raise self._error("no field")
        for name in names:
            if names.count(name) > 1:
                raise self._error(f"{{{name}}} twice")
            if name not in OWN:
                try:
                    check_column(name)
                except CorpusError as problem:
                    raise CorpusError(f"{text!r}: {problem}") from None
        if not all(literals[1:-1]):
            at = literals.index("", 1)
            raise self._error(f"{{{names[at - 1]}}}{{{names[at]}}} with nothing between them")
        self._names = names
        self._depth = text.count("/") + 1
        expression = re.escape(literals[0])
        for before, after in pairwise(literals):
            beside = "|".join(re.escape(part) for part in {before, after, "/"} if part)
            expression += f"((?:(?!{beside}).)+){re.escape(after)}"
        self._expression = re.compile(expression, re.DOTALL)

    def _error(self, what: str) -> CorpusError:
        return CorpusError(
            f"Expected a pattern such as {{label}}_{{take}}, but {self.text!r} has {what}."
        )

    def fields(self, relative: str) -> dict[str, str] | None:
        """Return what the name of a file says, by field; None where the pattern does not fit.

        Parameters
        ----------
        relative : str
            Path of the file from the corpus root, with ``/``.
        """
        parts = PurePosixPath(relative).with_suffix("").parts[-self._depth :]
        found = self._expression.fullmatch("/".join(parts))
        if found is None:
            return None
        return dict(zip(self._names, found.groups(), strict=True))

    def __repr__(self) -> str:
        return f"NamePattern({self.text!r})"
