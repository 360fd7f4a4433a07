"""Pages of the manual that hold code, run in this process."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib import pyplot
from small_library import run

CELL = re.compile(r"^```\{code-cell\}\n((?:[^`]|`(?!``))*?)^```$", re.M)


def cells(page: Path) -> list[str]:
    """Return the code of a page, cell by cell, without what tells how it is shown."""
    found = CELL.findall(page.read_text(encoding="utf-8"))
    return [re.sub(r"\A(:.*\n)+", "", code) for code in found]


def in_this_process(words: Sequence[str]) -> list[str]:
    """Return a command that does not share out its work: workers are still where they began."""
    alone = words[0] == "build" and "--jobs" not in words
    return [*words, *(("--jobs", "1") if alone else ())]


def run_cells(page: Path) -> dict[str, Any]:
    """Run all cells of a page in one namespace, a shell's by the command line; return it."""
    names: dict[str, Any] = {"__name__": "__main__"}
    matplotlib.use("Agg")
    for number, code in enumerate(cells(page), start=1):
        if code.startswith("!"):
            for line in code.splitlines():
                _, *words = shlex.split(line)
                result = run(*in_this_process(words))
                assert result.exit_code == 0, f"{page.name}: {line}: {result.output}"
        else:
            exec(compile(code, f"{page.name}, cell {number}", "exec"), names)
        pyplot.close("all")
    return names
