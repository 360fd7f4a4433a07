"""What is known of a file before it is read: from the user, labels, its name and its folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from mocapdb.errors import CorpusError, FormatError
from mocapdb.io.folder_settings import (
    NOTHING_SAID,
    FileSettings,
    FolderSettings,
    said_by_settings,
)
from mocapdb.io.reading import ReadOptions
from mocapdb.library.naming import file_and_take, stem_of, suffix_of

if TYPE_CHECKING:
    from mocapdb.corpus.labels import LabelRow, Labels
    from mocapdb.corpus.name_patterns import NamePattern

__all__ = ["KnownFile", "KnownFiles", "Unused"]


@dataclass(frozen=True)
class KnownFile:
    """What is known of one file.

    Attributes
    ----------
    reading : ReadOptions
        What the user and the settings of its folder say.
    by_settings : frozenset of str
        What of it only the settings say.
    label : str, optional
    description, subject : str
        Empty where nothing is said.
    subject_source : str
        Who states the subject: ``"labels"``, ``"manifest"``, or a pattern of names, which the
        ``"caller"`` or ``"settings"`` state.
    columns : mapping of str to str
        What else is said, by name.
    label_fps : float, optional, frames per second
        Rate of an AMC by its label, where nobody else states it.
    """

    reading: ReadOptions
    by_settings: frozenset[str]
    label: str | None
    description: str
    subject: str
    subject_source: str
    columns: Mapping[str, str]
    label_fps: float | None


@dataclass(frozen=True)
class Unused:
    """What is said of files that are not there.

    Attributes
    ----------
    rows : list of str
        Paths, or names, of rows of a label file that fitted no file.
    n_rows : int
        How many rows that file has for this folder.
    patterns : list of str
        Patterns of settings in this folder, each with its file.
    n_unlabelled : int
        How many of the rows have an empty label.
    """

    rows: list[str]
    n_rows: int
    patterns: list[str]
    n_unlabelled: int = 0

    def warnings(self) -> list[str]:
        """Return what is to be told of it."""
        told = [*self.patterns]
        if self.rows:
            told.append(
                f"{len(self.rows)} of {self.n_rows} rows of the labels fit no file, such as "
                f"{self.rows[0]!r}"
            )
        if self.n_unlabelled:
            told.append(
                f"{self.n_unlabelled} of {self.n_rows} rows of the labels have an empty label: "
                "they give their clips no class"
            )
        return told

    def but_for(self, now: Unused) -> Unused:
        """Return what is not used by other files either."""
        rows, patterns = {*now.rows}, {*now.patterns}
        return Unused(
            [row for row in self.rows if row in rows],
            self.n_rows,
            [pattern for pattern in self.patterns if pattern in patterns],
            self.n_unlabelled,
        )

    def to_json(self) -> str:
        """Return it as text."""
        return json.dumps(asdict(self))

    @classmethod
    def of_json(cls, text: str) -> Unused:
        """Read what `to_json` wrote."""
        return cls(**json.loads(text))


class KnownFiles:
    """What is known of the files of a corpus.

    What the command line says wins over labels, labels over names, and names over folders.

    Parameters
    ----------
    root : Path
        The corpus folder.
    reading : ReadOptions
        What the user says of all files.
    names : str, optional
        Pattern of names that wins over those of folders.
    labels : callable, optional
        Gives the labels when they are needed first.

    Raises
    ------
    CorpusError
        If the pattern cannot be used.
    """

    def __init__(
        self,
        root: Path,
        reading: ReadOptions,
        names: str | None,
        labels: Callable[[], Labels | None] = lambda: None,
    ) -> None:
        self._root = root
        self._reading = reading
        self._names = names
        self._read_labels = labels
        self._folders = FolderSettings()
        self._silent: dict[str, bool] = {}
        self._hows: dict[
            tuple[int, bool], tuple[FileSettings, tuple[ReadOptions, frozenset[str]]]
        ] = {}
        self._patterns: dict[str, NamePattern] = {}
        self._used_rows: set[tuple[str, str]] = set()  # path and clip
        if names is not None:
            self._pattern(names, None)

    @cached_property
    def _labels(self) -> Labels | None:
        return self._read_labels()

    def said_in(self, folder: str) -> str:
        """Return what settings say of the files of a folder, as text; empty where nothing."""
        return self._folders.said_in(self._root / folder)

    def reading(self, file: str) -> ReadOptions:
        """Return how a file is to be read; quicker than all that is known of it."""
        folder, _, name = file.rpartition("/")
        return self._how(self._settings(folder, name), suffix_of(name) == ".amc")[0]

    @property
    def label_source(self) -> str:
        """Who states rates by labels."""
        return "" if self._labels is None else self._labels.source

    def of(self, source: str) -> KnownFile:
        """Return what is known of a file, by its path from the root with ``/``, or of a take.

        A take has what is said of its file, unless a label names it (``walk_Run``).

        Raises
        ------
        FormatError
            If the pattern of names does not fit it.
        CorpusError
            If the settings of its folder cannot be used.
        """
        file, take = file_and_take(source)
        folder, _, name = file.rpartition("/")
        settings = self._settings(folder, name)
        is_acclaim = suffix_of(name) == ".amc"
        reading, by_settings = self._how(settings, is_acclaim)
        row = self._labels.lookup(file, stem_of(name)) if self._labels else None
        if take and self._labels:
            row = self._labels.lookup(source, stem_of(source)) or row
        if row is not None:
            self._used_rows.add((row.path, row.clip))
        named = self._named(file, settings)
        own = {"label": None, "description": "", "subject": ""} | named
        if row is not None:
            told = {"label": row.label, "description": row.description, "subject": row.subject}
            own |= {key: text for key, text in told.items() if text} | dict(row.columns)
        elif self._labels is None and "label" not in named:
            own["label"] = folder.rpartition("/")[2] or None
        return KnownFile(
            reading,
            by_settings,
            label=own.pop("label"),
            description=own.pop("description") or "",
            subject=own.pop("subject") or "",
            subject_source=self._subject_source(row),
            columns=({"take": take} if take else {})
            | {key: text for key, text in own.items() if text},
            label_fps=row.fps if row and is_acclaim and reading.fps is None else None,
        )

    def _settings(self, folder: str, name: str) -> FileSettings:
        """Return what the settings of folders say of a file."""
        if folder not in self._silent:
            self._silent[folder] = self._folders.say_nothing_in(self._root / folder)
        if self._silent[folder]:
            return NOTHING_SAID
        return self._folders.of(self._root / folder / name)

    def _how(self, settings: FileSettings, is_acclaim: bool) -> tuple[ReadOptions, frozenset[str]]:
        """Return how files are read, and what of it only the settings say; equal ones are one."""
        key = id(settings), is_acclaim
        if key not in self._hows:
            said, usual = self._reading, settings.options
            if not is_acclaim:  # all others have a skeleton of their own
                said, usual = replace(said, skeleton=None), replace(usual, skeleton=None)
            how = said.over(usual), said_by_settings(said, usual)
            self._hows[key] = settings, how  # kept, since another might get its id
        return self._hows[key][1]

    def _subject_source(self, row: LabelRow | None) -> str:
        """Return who says who performs a clip: its row, else the pattern of its name."""
        if row is not None and row.subject:
            return self.label_source
        return "caller" if self._names else "settings"

    def unused(self) -> Unused:
        """Return what is said of none of the files that were asked for."""
        inside: list[LabelRow] = []
        if self._labels is not None and self._labels.source == "labels":
            inside = [row for row in self._labels if not row.path.startswith("..")]
        rows = [row for row in inside if (row.path, row.clip) not in self._used_rows]
        patterns = self._folders.unused_patterns(self._root)
        return Unused(
            [row.path or row.clip for row in rows],
            len(inside),
            [f'{path}: no file fits ["{pattern}"]' for path, pattern in patterns],
            sum(not row.label for row in inside),
        )

    def _named(self, file: str, folder: FileSettings) -> dict[str, str | None]:
        """Return what the name of a file says."""
        text = self._names or folder.names
        if not text:
            return {}
        pattern = self._pattern(text, None if self._names else folder.source)
        fields = pattern.fields(file)
        if fields is None:
            raise FormatError(
                self._root / file,
                f"Expected a name such as {text!r}, but got {stem_of(file)!r}.",
            )
        return dict(fields)

    def _pattern(self, text: str, source: Path | None) -> NamePattern:
        from mocapdb.corpus.name_patterns import NamePattern

        if text not in self._patterns:
            try:
                self._patterns[text] = NamePattern(text)
            except CorpusError as problem:
                where = "--names" if source is None else f"{source}: names"
                raise CorpusError(f"{where}: {problem}") from None
        return self._patterns[text]
