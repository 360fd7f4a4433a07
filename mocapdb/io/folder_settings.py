"""``mocapdb.toml``: what is said once of the files of a folder, or of those that fit a pattern.

::

    unit_m = 0.01                  # of all files below this folder
    joint_map = "joints.toml"      # from here; or a table [joint_map]
    names = "{label}_{style}_{take}"

    ["takes/*.bvh"]                # of these only; later patterns win over earlier ones
    unit_m = 1.0
    up = "z"

A pattern is a path from the folder of the file: ``*`` and ``?`` stand for anything but ``/``,
``**`` for anything, ``[ab]`` for one letter of these, in either case. A pattern without ``/`` fits
files at any depth. Of several ``mocapdb.toml`` above a file the nearest one counts.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NamedTuple, get_args

from mocapdb.base.arrays import StrPath
from mocapdb.errors import ClipError, CorpusError, MocapdbError
from mocapdb.io._settings_text import read_toml
from mocapdb.io.clip_files import read_clip
from mocapdb.io.reading import ReadOptions, checked_joint_map, read_joint_map
from mocapdb.io.tuning import KEY_CLOSENESS
from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import UpDirection

__all__ = ["SETTINGS_NAME", "FileSettings", "FolderSettings", "read_with_settings"]

SETTINGS_NAME = "mocapdb.toml"
MOST_FOLDERS = 3  # **, each of which may stand for any number of folders
MANY = re.compile(r"\*\*/?|\*|\?|\[!?[^\]/]+\]")


@dataclass(frozen=True)
class FileSettings:
    """What is said of one file.

    Attributes
    ----------
    options : ReadOptions
    names : str
        Pattern of what its name says, such as ``"{label}_{take}"``; empty where there is none.
    source : Path, optional
        The file that says it.
    """

    options: ReadOptions = field(default_factory=ReadOptions)
    names: str = ""
    source: Path | None = None


NOTHING_SAID = FileSettings()


class FolderSettings:
    """What the ``mocapdb.toml`` of folders say, each read once."""

    def __init__(self) -> None:
        self._files: dict[Path, _SettingsFile | None] = {}

    def of(self, path: StrPath) -> FileSettings:
        """Return what is said of a motion file.

        Raises
        ------
        CorpusError
            If the nearest ``mocapdb.toml`` cannot be read, or has a key or a value that cannot be
            used.
        """
        file = Path(path).absolute()
        above = self._above(file.parent)
        return NOTHING_SAID if above is None else above.of(file)

    def say_nothing_in(self, folder: Path) -> bool:
        """Return whether there are none for the files of a folder.

        Raises
        ------
        CorpusError
            As `of` does.
        """
        return self._above(folder.absolute()) is None

    def said_in(self, folder: Path) -> str:
        """Return all that is said of the files of a folder, as text; empty where it is nothing.

        Raises
        ------
        CorpusError
            As `of` does.
        """
        above = self._above(folder.absolute())
        return "" if above is None else above.said()

    def unused_patterns(self, root: Path) -> list[tuple[Path, str]]:
        """Return patterns that fitted none of the files that were asked for.

        Those of a folder and of the ones below it: settings above it are for other files too.
        """
        top = root.absolute()
        files = {file.path: file for file in self._files.values() if file is not None}
        return [
            (path, pattern)
            for path, file in sorted(files.items())
            if path.is_relative_to(top)
            for pattern in file.unused
        ]

    def _above(self, folder: Path) -> _SettingsFile | None:
        """Return the nearest settings, of a folder or of those above it."""
        if folder not in self._files:
            path = folder / SETTINGS_NAME
            if _is_there(path):
                self._files[folder] = _SettingsFile.read(path)
            else:
                top = folder.parent == folder
                self._files[folder] = None if top else self._above(folder.parent)
        return self._files[folder]


def read_with_settings(
    path: StrPath,
    said: ReadOptions | None = None,
    *,
    drop_tpose: bool = False,
    folders: FolderSettings | None = None,
) -> Clip:
    """Read a clip as the user says, else as the ``mocapdb.toml`` above it says.

    Parameters
    ----------
    path : path-like
    said : ReadOptions, optional
        What wins over the settings of the folder.
    drop_tpose : bool
        As in `read_clip`.
    folders : FolderSettings, optional
        Settings that were read before.

    Raises
    ------
    FormatError
        If the file breaks its format, or does not fit what is said of it.
    CorpusError
        If the settings cannot be used.
    """
    said = said or ReadOptions()
    usual = (folders or FolderSettings()).of(path).options
    if Path(path).suffix.lower() != ".amc":
        usual = replace(usual, skeleton=None)  # other formats hold their own skeleton
    clip = read_clip(path, said.over(usual), drop_tpose=drop_tpose)
    return credited(clip, said_by_settings(said, usual))


def said_by_settings(said: ReadOptions, usual: ReadOptions) -> frozenset[str]:
    """Return which of unit, up and fps only the settings of a folder say."""
    return frozenset(
        key
        for key in ("unit_m", "up", "fps")
        if getattr(said, key) is None and getattr(usual, key) is not None
    )


def credited(clip: Clip, by_settings: Collection[str]) -> Clip:
    """Return a clip with the settings of its folder as the source of what they say."""
    return replace(
        clip,
        unit_source="settings" if "unit_m" in by_settings else clip.unit_source,
        up_source="settings" if "up" in by_settings else clip.up_source,
        fps_source="settings" if "fps" in by_settings else clip.fps_source,
    )


def _is_there(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a folder that may not be looked into says nothing
        return False


class _Rule(NamedTuple):
    """Settings of the files that fit a pattern; those of all files have none."""

    pattern: str
    fits: Callable[[str], object]
    options: ReadOptions
    names: str


class _SettingsFile:
    """One ``mocapdb.toml``."""

    def __init__(self, path: Path, rules: list[_Rule]) -> None:
        self.path = path
        self.unused = {rule.pattern: None for rule in rules if rule.pattern}
        self._rules = rules
        self._said: dict[tuple[int, ...], FileSettings] = {}  # by the rules that fit

    def of(self, file: Path) -> FileSettings:
        relative = file.relative_to(self.path.parent).as_posix()
        fitting = tuple(i for i, rule in enumerate(self._rules) if rule.fits(relative))
        if fitting not in self._said:
            options, names = ReadOptions(), ""
            for rule in (self._rules[i] for i in fitting):
                options = rule.options.over(options)
                names = rule.names or names
                self.unused.pop(rule.pattern, None)
            self._said[fitting] = FileSettings(options, names, self.path)
        return self._said[fitting]

    def said(self) -> str:
        return repr((self.path, [(each.pattern, each.options, each.names) for each in self._rules]))

    @classmethod
    def read(cls, path: Path) -> _SettingsFile:
        table = read_toml(path, lambda message: CorpusError(f"{path}: {message}"))
        of_all = {key: value for key, value in table.items() if not _is_pattern(key, value)}
        rules = [_rule(path, "", re.compile("").match, of_all)]
        for pattern, settings in table.items():
            if pattern not in of_all:
                fits = _compiled(path, pattern).fullmatch
                rules.append(_rule(path, pattern, fits, settings))
        return cls(path, rules)


def _is_pattern(key: str, value: object) -> bool:
    return isinstance(value, dict) and any(letter in key for letter in "*?[./")


def _compiled(path: Path, pattern: str) -> re.Pattern[str]:
    parts = pattern.replace("\\", "/").split("/")
    if parts[0] == "" or ".." in parts:
        raise CorpusError(
            f'{path}: Expected patterns of paths below this folder, but got ["{pattern}"].'
        )
    whole = "/".join(part for part in parts if part != ".")
    if whole.count("**") > MOST_FOLDERS:
        raise CorpusError(
            f'{path}: Expected {MOST_FOLDERS} times ** in a pattern at most, but got ["{pattern}"].'
        )
    text, start = "" if len(parts) > 1 else "(?:.*/)?", 0
    star = -1  # where a * stands that what follows it may end
    for found in MANY.finditer(whole):
        text += re.escape(whole[start : found.start()])
        if found[0][0] == "*":
            if star >= 0:  # the nearest place is as good as any, and no other is tried
                text = f"{text[:star]}(?>{text[star:].replace('[^/]*', '[^/]*?', 1)})"
            star = len(text) if found[0] == "*" else -1
        text += _wild(found[0])
        start = found.end()
    try:
        return re.compile(text + re.escape(whole[start:]), re.IGNORECASE | re.DOTALL)
    except re.error:
        raise CorpusError(
            f'{path}: Expected a pattern such as ["takes/*.bvh"], but got ["{pattern}"].'
        ) from None


def _wild(sign: str) -> str:
    """Return a regular expression of what a sign of a pattern stands for."""
    if sign[0] == "[":
        inside = sign[1:-1].replace("\\", r"\\")
        return f"[^/{inside[1:]}]" if inside[0] == "!" else f"[{inside}]"
    return {"**/": "(?:.*/)?", "**": ".*", "*": "[^/]*", "?": "[^/]"}[sign]


def _rule(
    path: Path, pattern: str, fits: Callable[[str], object], table: Mapping[str, Any]
) -> _Rule:
    """Return the settings of a table, checked."""
    where = f' of ["{pattern}"]' if pattern else ""
    said: dict[str, Any] = {}
    for key, value in table.items():
        if key not in KEYS:
            raise CorpusError(f"{path}: {_unknown(key, value, where)}")
        try:
            said[key] = KEYS[key](value, path.parent)
        except MocapdbError as problem:
            raise CorpusError(f"{path}: {key}{where}: {problem}") from None
    names = said.pop("names", "")
    return _Rule(pattern, fits, ReadOptions(**said), names)


def _unknown(key: str, value: object, where: str) -> str:
    close = get_close_matches(key.lower(), KEYS, n=1, cutoff=KEY_CLOSENESS)
    near = f" Did you mean {close[0]}?" if close else ""
    pattern = ' Patterns of files look like ["takes/*.bvh"].' if isinstance(value, dict) else ""
    return f"Expected one of {', '.join(KEYS)}{where}, but got {key!r}.{near}{pattern}"


def _positive(value: object, folder: Path) -> float:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    try:
        size = float(value) if number else math.nan  # type: ignore[arg-type] # it is a number
    except OverflowError:
        size = math.inf
    if not (math.isfinite(size) and size > 0):
        raise ClipError(f"Expected a positive number, but got {value!r}.")
    return size


def _axis(value: object, folder: Path) -> str:
    known = get_args(UpDirection)
    if value not in known:
        raise ClipError(f"Expected one of {', '.join(known)}, but got {value!r}.")
    return str(value)


def _flag(value: object, folder: Path) -> bool:
    if not isinstance(value, bool):
        raise ClipError(f"Expected true or false, but got {value!r}.")
    return value


def _text(value: object, folder: Path) -> str:
    if not isinstance(value, str) or not value:
        raise ClipError(f"Expected a text in quotes, but got {value!r}.")
    return value


def _file(value: object, folder: Path) -> Path:
    path = folder / _text(value, folder)
    if not path.is_file():
        raise ClipError(f"Expected a file from {folder}, but there is no {value!r}.")
    return path


def _joints(value: object, folder: Path) -> dict[str, str]:
    return (
        checked_joint_map(value)
        if isinstance(value, dict)
        else read_joint_map(_file(value, folder))
    )


KEYS: dict[str, Callable[[object, Path], Any]] = {
    "unit_m": _positive,
    "up": _axis,
    "fps": _positive,
    "skeleton": _file,
    "joint_map": _joints,
    "strict": _flag,
    "names": _text,
}
"""What may be said, and what makes a value of it."""
