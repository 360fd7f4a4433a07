"""A range of frames on the command line: ``A:B``, end-exclusive."""

from __future__ import annotations

import re
from typing import Any

import click

__all__ = ["FRAMES"]


class _Frames(click.ParamType):  # type: ignore[type-arg,unused-ignore] # generic since click 8.3
    """``A:B``, ``A:`` or ``:B`` as a slice."""

    name = "A:B"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> slice:
        if isinstance(value, slice):
            return value
        parts = re.fullmatch(r"(\d*):(\d*)", str(value))
        if not parts:
            self.fail(f"expected frames such as 100:400, but got {value!r}", param, ctx)
        start, stop = (int(part) if part else None for part in parts.groups())
        return slice(start, stop)


FRAMES = _Frames()
