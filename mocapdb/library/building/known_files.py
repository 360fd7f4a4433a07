"""What is known of a file before it is read: from the user, labels, its name and its folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from mocapdb.errors import CorpusError, FormatError
from mocapdb.io.folder_settings import FileSettings, FolderSettings, said_by_settings
from mocapdb.io.reading import ReadOptions

if TYPE_CHECKING:
    from mocapdb.corpus.labels import LabelRow, Labels
    from mocapdb.corpus.name_patterns import NamePattern

__all__ = ["KnownFile", "KnownFiles"]


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
    labels : Labels, optional

    Raises
    ------
    CorpusError
        If the pattern cannot be used.
    """

    def __init__(
        self, root: Path, reading: ReadOptions, names: str | None, labels: Labels | None
    ) -> None:
        self._root = root
        self._reading = reading
        self._names = names
        self._labels = labels
        self._folders = FolderSettings()
        self._patterns: dict[str, NamePattern] = {}
        self._used_rows: set[tuple[str, str]] = set()  # path and clip
        if names is not None:
            self._pattern(names, None)

    @property
    def label_source(self) -> str:
        """Who states rates by labels."""
        return "" if self._labels is None else self._labels.source

    def of(self, file: str) -> KnownFile:
        """Return what is known of a file, by its path from the root with ``/``.

        Raises
        ------
        FormatError
            If the pattern of names does not fit it.
        CorpusError
            If the settings of its folder cannot be used.
        """
        path = self._root / file
        folder = self._folders.of(path)
        said, usual = self._reading, folder.options
        is_acclaim = path.suffix.lower() == ".amc"
        if not is_acclaim:  # all others have a skeleton of their own
            said, usual = replace(said, skeleton=None), replace(usual, skeleton=None)
        reading = said.over(usual)
        row = self._labels.lookup(file) if self._labels else None
        if row is not None:
            self._used_rows.add((row.path, row.clip))
        named = self._named(path, file, folder)
        own = {"label": None, "description": "", "subject": ""} | named
        if row is not None:
            told = {"label": row.label, "description": row.description, "subject": row.subject}
            own |= {key: text for key, text in told.items() if text} | dict(row.columns)
        elif self._labels is None and "label" not in named:
            own["label"] = PurePosixPath(file).parent.name or None
        return KnownFile(
            reading,
            said_by_settings(said, usual),
            label=own.pop("label"),
            description=own.pop("description") or "",
            subject=own.pop("subject") or "",
            subject_source=self._subject_source(row),
            columns={key: text for key, text in own.items() if text},
            label_fps=row.fps if row and is_acclaim and reading.fps is None else None,
        )

    def _subject_source(self, row: LabelRow | None) -> str:
        """Return who says who performs a clip: its row, else the pattern of its name."""
        if row is not None and row.subject:
            return self.label_source
        return "caller" if self._names else "settings"

    def unused_labels(self) -> list[str]:
        """Return a warning if rows of a label file fitted none of the files."""
        if self._labels is None or self._labels.source != "labels":
            return []
        inside = [row for row in self._labels if not row.path.startswith("..")]
        unused = [row for row in inside if (row.path, row.clip) not in self._used_rows]
        if not unused:
            return []
        first = unused[0].path or unused[0].clip
        return [f"{len(unused)} of {len(inside)} rows of the labels fit no file, such as {first!r}"]

    def unused_patterns(self) -> list[str]:
        """Return a warning for each pattern of settings in this folder that no file fitted."""
        return [
            f'{path}: no file fits ["{pattern}"]'
            for path, pattern in self._folders.unused_patterns(self._root)
        ]

    def _named(self, path: Path, file: str, folder: FileSettings) -> dict[str, str | None]:
        """Return what the name of a file says."""
        text = self._names or folder.names
        if not text:
            return {}
        pattern = self._pattern(text, None if self._names else folder.source)
        fields = pattern.fields(file)
        if fields is None:
            raise FormatError(
                path, f"Expected a name such as {text!r}, but got {PurePosixPath(file).stem!r}."
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
