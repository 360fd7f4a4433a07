"""The report of a library: one page that can be mailed, and asks for nothing from outside.

==================  ================================================================
`library_report`    the page: what is looked at, in which order, and the file
`library_findings`  what there is to say: figures, confusion, flagged joints, cycles
`sections`          the page's parts, each from its findings
`page`              HTML: tables, pictures, style, scripts
`tuning`            how much of a library is looked at, and at which errors
==================  ================================================================
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.report.library_report import Effort as Effort
    from mocapdb.report.library_report import write_report as write_report

__getattr__, __dir__, __all__ = attach(__name__)
