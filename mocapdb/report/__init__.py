"""The report of a library: one page that can be mailed, and asks for nothing from outside.

=============  ===================================================================================
`write_report` the page
`findings`     what there is to say: figures, confusion, flagged joints, cycles
`sections`     the page's parts, each from its findings
`page`         putting them together: tables, pictures, style
=============  ===================================================================================
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocapdb.report.report import Effort, write_report

__all__ = ["Effort", "write_report"]


def __getattr__(name: str) -> Any:
    """Load a name from its home on first use."""
    if name in __all__:
        from importlib import import_module

        return getattr(import_module(f"{__name__}.report"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
