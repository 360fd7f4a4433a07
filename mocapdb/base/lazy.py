"""Names of a package that load on first use, so that importing it costs nothing."""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any

__all__ = ["attach"]


def attach(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Give a package the names that it imports under ``if TYPE_CHECKING:``, on first use.

    The imports are what type checkers read; this reads the same lines, so that no second list of
    names has to agree with them.

    Parameters
    ----------
    package : str
        The package's ``__name__``.

    Returns
    -------
    __getattr__, __dir__, __all__
        For the package to take as its own.

    Examples
    --------
    In an ``__init__.py``::

        if TYPE_CHECKING:
            from mocapdb.compression.targets import Target as Target

        __getattr__, __dir__, __all__ = attach(__name__)
    """
    homes = dict(_deferred(package))

    def load(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        home = homes[name]
        if home == package:
            return import_module(f"{package}.{name}")
        return getattr(import_module(home), name)

    names = sorted(homes)
    return load, lambda: sorted({*vars(sys.modules[package]).get("__all__", ()), *names}), names


def _deferred(package: str) -> list[tuple[str, str]]:
    """Return (name, home) of all that a package imports for type checkers only."""
    spec: Any = sys.modules[package].__spec__
    tree = ast.parse(spec.loader.get_source(package))
    blocks = [
        node
        for node in tree.body
        if isinstance(node, ast.If)
        and isinstance(node.test, ast.Name)
        and node.test.id == "TYPE_CHECKING"
    ]
    return [
        (alias.asname or alias.name, line.module or "")
        for block in blocks
        for line in block.body
        if isinstance(line, ast.ImportFrom)
        for alias in line.names
    ]
