"""Finding a Blender: named, in the environment, on the PATH, or as a module of Python."""

from __future__ import annotations

import os
import shutil
import sys
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from mocapdb.base.arrays import StrPath
from mocapdb.errors import FormatError

__all__ = ["NEEDED", "VARIABLE", "Program", "blender_is_there", "find_blender"]

VARIABLE = "MOCAPDB_BLENDER"
"""The environment variable that names Blender."""

WORKER = Path(__file__).with_name("worker.py")
NEEDED = (
    "Install Blender 4.5 or later, or its module (pip install bpy), or name Blender with --blender "
    f"or in {VARIABLE}."
)
ALONE = ("--background", "--factory-startup", "--disable-autoexec", "--offline-mode", "-noaudio")


@dataclass(frozen=True)
class Program:
    """How Blender is started.

    Attributes
    ----------
    command : tuple of str
        Program and arguments, to which what the worker is told is added.
    """

    command: tuple[str, ...]


def find_blender(path: StrPath, given: StrPath | None = None) -> Program:
    """Return the Blender that is there, for a file.

    Parameters
    ----------
    path : path-like
        The file that asks for it, for the error.
    given : path-like, optional
        A Blender, or a Python that has bpy. Else `VARIABLE` names one, else it is ``blender`` of
        the PATH, else bpy of this Python.

    Raises
    ------
    FormatError
        If there is none.
    """
    program = _found(given)
    if program is not None:
        return program
    named = given or os.environ.get(VARIABLE)
    if named:
        raise FormatError(
            path, f"Expected Blender in {str(named)!r}, but there is no such program."
        )
    suffix = Path(path).suffix.lower()
    raise FormatError(path, f"Expected Blender, by way of which {suffix} goes. {NEEDED}")


def blender_is_there(given: StrPath | None = None) -> bool:
    """Return whether `find_blender` finds one; Blender is not started."""
    return _found(given) is not None


def _found(given: StrPath | None) -> Program | None:
    named = given or os.environ.get(VARIABLE)
    if named:
        program = shutil.which(str(named))
        return None if program is None else _started_by(program)
    program = shutil.which("blender")
    if program is not None:
        return _started_by(program)
    return _started_by(sys.executable) if find_spec("bpy") is not None else None


def _started_by(program: str) -> Program:
    if Path(program).name.lower().startswith("python"):
        return Program((program, "-P", str(WORKER)))
    return Program((program, *ALONE, "--python-exit-code", "1", "--python", str(WORKER), "--"))
