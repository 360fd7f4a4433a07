"""The manifest: which clips there are, what they show, and where to download them.

A manifest is a CSV file with one row for each clip and the columns of `MANIFEST_COLUMNS`. The one
that is shipped lists the CMU Graphics Lab Motion Capture Database. ``sha256`` and
``skeleton_sha256`` are empty where the checksum of a file is not known.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from mocapdb.base.arrays import StrPath
from mocapdb.corpus._table import Row, read_rows
from mocapdb.corpus.columns import check_column
from mocapdb.errors import CorpusError

__all__ = ["MANIFEST_COLUMNS", "ManifestEntry", "manifest_path", "read_manifest", "select"]

MANIFEST_COLUMNS: Final = (
    "clip",
    "subject",
    "trial",
    "class",
    "description",
    "fps",
    "skeleton_url",
    "motion_url",
    "sha256",
    "skeleton_sha256",
)
_OPTIONAL: Final = {"skeleton_sha256"}
_PLAIN_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")  # becomes the name of a file or folder
_SHA256 = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True)
class ManifestEntry:
    """One clip of a manifest.

    Parameters
    ----------
    clip : str
        Name of the clip, such as ``"02_01"``.
    subject : str
        The person captured, such as ``"02"``; the skeleton is theirs.
    trial : str
        Number of the take, such as ``"01"``.
    label : str
        Class of the motion (column ``class``), such as ``"walk"``.
    description : str
        What the database says of the clip.
    fps : float, frames per second
        Frame rate.
    skeleton_url, motion_url : str
        Where the ASF and the AMC file are.
    sha256, skeleton_sha256 : str, optional
        SHA-256 of the AMC and the ASF file, 64 lower-case hexadecimal digits, where known.
    columns : mapping of str to str
        What else is said of it, by the name of the column; only what is not empty.

    Raises
    ------
    CorpusError
        If a field cannot be used; a clip or subject that is no plain name could lead outside the
        folder that clips are downloaded to.
    """

    clip: str
    subject: str
    trial: str
    label: str
    description: str
    fps: float
    skeleton_url: str
    motion_url: str
    sha256: str | None = None
    skeleton_sha256: str | None = None
    columns: Mapping[str, str] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        for column, value in (("clip", self.clip), ("subject", self.subject)):
            if not _PLAIN_NAME.fullmatch(value):
                raise CorpusError(
                    f"Expected {column} to be a name of letters, digits, '.', '_' and '-', "
                    f"but got {value!r}."
                )
        if not self.label:
            raise CorpusError(f"Expected clip {self.clip} to have a class, but got none.")
        if not (math.isfinite(self.fps) and self.fps > 0):
            raise CorpusError(f"Expected fps to be a positive number, but got {self.fps}.")
        for column, value in (
            ("skeleton_url", self.skeleton_url),
            ("motion_url", self.motion_url),
        ):
            if not value.startswith(("http://", "https://")):
                raise CorpusError(f"Expected {column} to be an http(s) address, but got {value!r}.")
        for column, digest in (
            ("sha256", self.sha256),
            ("skeleton_sha256", self.skeleton_sha256),
        ):
            if digest is not None and not _SHA256.fullmatch(digest):
                raise CorpusError(
                    f"Expected {column} to be 64 lower-case hexadecimal digits or nothing, "
                    f"but got {digest!r}."
                )


def manifest_path() -> Path:
    """Return the path of the manifest that is shipped with mocapdb.

    Raises
    ------
    CorpusError
        If there is none: neither in the installed package nor in a checkout.
    """
    package = Path(__file__).resolve().parents[1]
    for folder in (package, package.parent):  # a wheel carries it inside the package
        path = folder / "data" / "manifest.csv"
        if path.is_file():
            return path
    raise CorpusError(
        f"Expected data/manifest.csv in {package} or {package.parent}, but found none. "
        "Reinstall mocapdb, or name a manifest."
    )


def read_manifest(path: StrPath | None = None) -> list[ManifestEntry]:
    """Read a manifest.

    Parameters
    ----------
    path : path-like, optional
        The CSV file; the manifest of the CMU database by default.

    Returns
    -------
    list of ManifestEntry
        In the order of the file.

    Raises
    ------
    CorpusError
        If the file is no such table, a column has a reserved name, or a clip occurs twice; names
        file and line.
    """
    path = manifest_path() if path is None else Path(path)
    entries: dict[str, ManifestEntry] = {}
    lines: dict[str, int] = {}
    required = [column for column in MANIFEST_COLUMNS if column not in _OPTIONAL]
    for row in read_rows(path, required):
        entry = _entry(row)
        if entry.clip in entries:
            raise row.error(
                f"Expected every clip once, but {entry.clip} is on line {lines[entry.clip]} too."
            )
        entries[entry.clip] = entry
        lines[entry.clip] = row.line
    return list(entries.values())


def _entry(row: Row) -> ManifestEntry:
    fps = row.fps()
    try:
        return ManifestEntry(
            clip=row["clip"],
            subject=row["subject"],
            trial=row["trial"],
            label=row["class"],
            description=row["description"],
            fps=fps,
            skeleton_url=row["skeleton_url"],
            motion_url=row["motion_url"],
            sha256=row["sha256"].lower() or None,
            skeleton_sha256=row["skeleton_sha256"].lower() or None,
            columns=_further_columns(row),
        )
    except CorpusError as error:
        raise row.error(str(error)) from None


def _further_columns(row: Row) -> dict[str, str]:
    """Return what a row says in columns that a manifest has not of its own."""
    further = {key: text for key, text in row.cells.items() if key and key not in MANIFEST_COLUMNS}
    for column in further:
        check_column(column)
    return {column: text for column, text in further.items() if text}


def select(entries: Iterable[ManifestEntry], names: Sequence[str]) -> list[ManifestEntry]:
    """Return the entries that `names` speak of.

    Parameters
    ----------
    entries : iterable of ManifestEntry
        The manifest.
    names : sequence of str
        Clips (``"02_01"``), subjects (``"02"``) and classes (``"walk"``), in any mixture.

    Returns
    -------
    list of ManifestEntry
        In the order of the manifest, each once.

    Raises
    ------
    CorpusError
        If a name is no clip, subject or class of the manifest; says what comes close.
    """
    entries = list(entries)
    known = {name for entry in entries for name in (entry.clip, entry.subject, entry.label)}
    for name in names:
        if name not in known:
            raise CorpusError(_unknown_name(name, known, {entry.label for entry in entries}))
    wanted = set(names)
    return [entry for entry in entries if wanted & {entry.clip, entry.subject, entry.label}]


def _unknown_name(name: str, known: set[str], labels: set[str]) -> str:
    message = f"Expected a clip, a subject or a class of the manifest, but got {name!r}."
    close = difflib.get_close_matches(name, sorted(known), n=5)
    if close:
        return f"{message} Close: {', '.join(close)}."
    return f"{message} The classes are: {', '.join(sorted(labels))}."
