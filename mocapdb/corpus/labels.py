"""What is known about the clips of a corpus folder: class, frame rate, description.

A label file is a CSV table with the column ``label``, at least one of ``clip`` (a file's stem) and
``path``, and optionally ``fps``, ``description`` and ``subject``. Any other column, such as a style
or a take, is kept under its name; ``skeleton``, and ``sha256`` with checksums, are left alone.
A path is relative to the folder of the label file, or to the corpus root where the first reading
points to no file of the corpus. A manifest serves as labels too.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import Final

from mocapdb.base.arrays import StrPath
from mocapdb.corpus._table import Row, read_rows
from mocapdb.corpus.columns import check_column
from mocapdb.corpus.manifest import ManifestEntry
from mocapdb.errors import CorpusError

__all__ = ["LABELS_NAME", "LabelRow", "Labels", "find_labels", "read_labels"]

LABELS_NAME: Final = "LABELS.csv"
OWN_COLUMNS = {"clip", "path", "label", "fps", "description", "subject", "skeleton"}
CHECKSUM = re.compile(r"([0-9a-fA-F]{64})?")


@dataclass(frozen=True)
class LabelRow:
    """What a label file says about one clip.

    Parameters
    ----------
    label : str
        Class of the motion; empty where it has none.
    clip : str
        Name of the clip, a file's stem; empty where only `path` is given, which alone matches.
    path : str
        Path from the corpus root with ``/`` between folders; empty where the file names none.
    fps : float, optional, frames per second
        Frame rate, where stated.
    description : str
        Free text.
    subject : str
        Who performs it; empty where it is not said.
    columns : mapping of str to str
        What else is said of it, by the name of the column; only what is not empty.
    """

    label: str
    clip: str = ""
    path: str = ""
    fps: float | None = None
    description: str = ""
    subject: str = ""
    columns: Mapping[str, str] = field(default_factory=dict, compare=False)


class Labels:
    """Labels of a corpus, looked up by path or by name.

    Parameters
    ----------
    rows : iterable of LabelRow
        Every path at most once.
    source : str
        Who says so, ``"labels"`` or ``"manifest"``: what `Clip.fps_source` records.

    Notes
    -----
    A name that several rows share with different paths, such as one motion in two formats, speaks
    of a file of that name elsewhere only if all of them give it one class, and only what they agree
    in.
    """

    def __init__(self, rows: Iterable[LabelRow], source: str = "labels") -> None:
        self.rows = tuple(rows)
        self.source = source
        self._by_path = {row.path: row for row in self.rows if row.path}
        named: dict[str, list[LabelRow]] = {}
        for row in self.rows:
            named.setdefault(row.clip, []).append(row)
        self._by_clip = {
            name: shared for name, same in named.items() if name and (shared := _shared_row(same))
        }

    @classmethod
    def from_manifest(cls, entries: Iterable[ManifestEntry]) -> Labels:
        """Return the labels that a manifest gives, by the names of the clips."""
        rows = (
            LabelRow(
                entry.label,
                entry.clip,
                fps=entry.fps,
                description=entry.description,
                subject=entry.subject,
                columns={"trial": entry.trial, **entry.columns} if entry.trial else entry.columns,
            )
            for entry in entries
        )
        return cls(rows, source="manifest")

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[LabelRow]:
        return iter(self.rows)

    def __repr__(self) -> str:
        classes = len({row.label for row in self.rows} - {""})
        return f"Labels({len(self)} clips, {classes} classes, from {self.source})"

    def lookup(self, relative_path: StrPath, stem: str | None = None) -> LabelRow | None:
        """Return what is known about one file of the corpus.

        Parameters
        ----------
        relative_path : path-like
            Path of the file from the corpus root.
        stem : str, optional
            Name to look for where no path matches; the stem of `relative_path` by default.

        Returns
        -------
        LabelRow or None
            The row of that path, else what all rows of that name say, else None.
        """
        key = os.path.normpath(relative_path).replace(os.sep, "/")
        by_path = self._by_path.get(key)
        if by_path is not None:
            return by_path
        return self._by_clip.get(PurePosixPath(key).stem if stem is None else stem)


def read_labels(path: StrPath, corpus_root: StrPath | None = None) -> Labels:
    """Read a label file.

    Parameters
    ----------
    path : path-like
        The CSV file.
    corpus_root : path-like, optional
        The folder whose files will be looked up; the folder of the label file by default.

    Returns
    -------
    Labels
        With paths from `corpus_root`. A row that points outside it stays, for its name.

    Raises
    ------
    CorpusError
        If the file is no such table, a column has a reserved name, a row has neither
        clip nor path, a frame rate is no positive number, or a path or a name without path occurs
        twice; names file and line.
    """
    path = Path(path)
    folder = path.parent.resolve()
    root = folder if corpus_root is None else Path(corpus_root).resolve()
    rows = [(row, _label_row(row)) for row in read_rows(path, ("label",))]
    _refuse_repeats(rows)
    labels = [label for _, label in rows]
    rebased = [_rebase(label, folder, root) for label in labels]
    if not any(_is_inside(label.path) for label in rebased):
        rebased = [_rebase(label, root, root) for label in labels]
    return Labels(rebased)


def find_labels(corpus_root: StrPath) -> Path | None:
    """Return the label file that speaks of a corpus folder, or None.

    That is the LABELS.csv in the folder itself, else the one in its parent when a path in it
    points into the folder.

    Raises
    ------
    CorpusError
        If the file in the parent folder cannot be read.
    """
    root = Path(corpus_root).resolve()
    path = root / LABELS_NAME
    if path.is_file():
        return path
    path = root.parent / LABELS_NAME
    if path.is_file() and any(
        _is_inside(_rebase(_label_row(row), root.parent, root).path)
        for row in read_rows(path, ("label",))
    ):
        return path
    return None


def _label_row(row: Row) -> LabelRow:
    path = row["path"].replace("\\", "/")
    if not (row["clip"] or path):
        raise row.error("Expected a clip or a path, but got neither. Fill one of the columns.")
    return LabelRow(
        label=row["label"],
        clip=row["clip"],
        path=path,
        fps=row.fps() if row["fps"] else None,
        description=row["description"],
        subject=row["subject"],
        columns=_further_columns(row),
    )


def _further_columns(row: Row) -> dict[str, str]:
    """Return what a row says in columns that have no meaning of their own."""
    further = {}
    for column, text in row.cells.items():
        if column in OWN_COLUMNS or not column:
            continue
        if column == "sha256" and CHECKSUM.fullmatch(text):
            continue  # of the file, which the library measures itself
        try:
            check_column(column)
        except CorpusError as problem:
            raise row.error(str(problem)) from None
        if text:
            further[column] = text
    return further


def _refuse_repeats(rows: Iterable[tuple[Row, LabelRow]]) -> None:
    path_lines: dict[str, int] = {}
    clip_lines: dict[str, int] = {}
    only_named: set[str] = set()
    for row, label in rows:
        path = os.path.normpath(label.path) if label.path else ""
        if path in path_lines:
            raise row.error(
                f"Expected every path once, but {label.path!r} is on line {path_lines[path]} too."
            )
        if label.clip in clip_lines and (not path or label.clip in only_named):
            raise row.error(
                f"Expected a path for each file named {label.clip!r}, because line "
                f"{clip_lines[label.clip]} names it too. Add the paths."
            )
        if path:
            path_lines[path] = row.line
        else:
            only_named.add(label.clip)
        if label.clip:
            clip_lines[label.clip] = row.line


def _rebase(label: LabelRow, folder: Path, root: Path) -> LabelRow:
    """Return the row with its path, which is relative to `folder`, made relative to `root`."""
    if not label.path:
        return label
    return replace(label, path=os.path.relpath(folder / label.path, root).replace(os.sep, "/"))


def _shared_row(rows: Sequence[LabelRow]) -> LabelRow | None:
    """Return what rows of one name say together; None where their classes differ."""
    first = rows[0]
    if len(rows) == 1:
        return first
    if any(row.label != first.label for row in rows):
        return None
    return replace(
        first,
        fps=first.fps if all(row.fps == first.fps for row in rows) else None,
        description=first.description
        if all(row.description == first.description for row in rows)
        else "",
        subject=first.subject if all(row.subject == first.subject for row in rows) else "",
        columns={
            name: text
            for name, text in first.columns.items()
            if all(row.columns.get(name) == text for row in rows)
        },
    )


def _is_inside(relative_path: str) -> bool:
    return PurePosixPath(relative_path).parts[:1] not in {(), ("..",)}
