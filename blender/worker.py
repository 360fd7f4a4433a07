"""The process that does the work of the add-on: it reads a task a line and answers in lines.

Beside Blender, so that its window stays alive, a task can be stopped, and whatever happens here
harms no open scene. It is started as a program, knows nothing of Blender, and ends when its
standard input does. A line is a JSON object: ``{"task", "arguments"}`` in, any number of
``{"progress": [done, total, name]}`` and then ``{"result"}`` or ``{"error", "kind"}`` out.
"""

from __future__ import annotations

import json
import os
import sys
import types
import warnings
from pathlib import Path
from typing import Any

PACKAGE = "mocapdb_blender_worker"


def main() -> None:
    """Do tasks until there are none."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # whatever a library prints must not stand between the answers
    warnings.simplefilter("ignore")
    package = types.ModuleType(PACKAGE)
    package.__path__ = [str(Path(__file__).parent)]
    sys.modules[PACKAGE] = package

    def answer(**line: Any) -> None:
        answers.write(json.dumps(line) + "\n")
        answers.flush()

    def progress(done: int, total: int, name: str) -> None:
        answer(progress=[done, total, name])

    for line in sys.stdin:
        order = json.loads(line)
        try:
            answer(result=_run(order["task"], order["arguments"], progress))
        except ModuleNotFoundError as problem:
            answer(error=problem.name or str(problem), kind="missing")
        except Exception as problem:  # whatever a task does, the next one is done
            from mocapdb.errors import MocapdbError

            kind = "refused" if isinstance(problem, MocapdbError) else "unexpected"
            if kind == "unexpected":
                sys.excepthook(*sys.exc_info())
            answer(error=str(problem) or type(problem).__name__, kind=kind)


def _run(task: str, arguments: dict[str, Any], progress: Any) -> Any:
    from importlib import import_module

    tasks = import_module(f"{PACKAGE}.tasks")
    return tasks.TASKS[task](progress=progress, **arguments)


if __name__ == "__main__":
    main()
