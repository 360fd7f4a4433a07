"""Small TOML files that users write, with errors that name them."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mocapdb.base.files import expect_file

__all__ = ["read_toml"]

MOST_BYTES = 1 << 20


def read_toml(path: Path, error: Callable[[str], Exception]) -> dict[str, Any]:
    """Return the table that a TOML file holds; with or without a byte order mark.

    Raises
    ------
    Exception
        What `error` makes of a message, if the file cannot be read or is no TOML.
    """
    try:
        expect_file(path)
        with path.open("rb") as file:
            data = file.read(MOST_BYTES + 1)
    except OSError as problem:
        raise error(f"Expected a TOML file, but got: {problem.strerror}.") from None
    if len(data) > MOST_BYTES:
        raise error("Expected a TOML file, but it has over 1 MiB.")
    try:
        return tomllib.loads(data.decode("utf-8-sig").replace("\r\n", "\n"))
    except UnicodeDecodeError:
        raise error("Expected UTF-8 text, but got other bytes. Save the file as UTF-8.") from None
    except (tomllib.TOMLDecodeError, RecursionError) as problem:
        raise error(
            f"Expected TOML, but got: {problem}. Texts and patterns of files stand in quotes."
        ) from None
