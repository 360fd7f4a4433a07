"""Names of clips: a file's stem, or its path where two files share the stem.

Of a file that holds several takes each is a clip: its source is ``walk.fbx#Run``, and its stem
``walk_Run``.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Hashable, Mapping
from pathlib import PurePath
from typing import NamedTuple, TypeVar

from mocapdb.errors import LibraryError

__all__ = [
    "UNKNOWN",
    "SourceFile",
    "clip_names",
    "file_and_take",
    "source_of",
    "stem_of",
    "subject_of",
    "suffix_of",
]

UNKNOWN = "unknown"
"""The label that says that nobody knows what a clip is."""

NAMED_SUBJECT = re.compile(r"\d{1,3}(?=_\d{1,3}(?![^\W_]))|HDM_[a-z]{2}(?=_)")
TAKE = re.compile(r"(.+\.(?:fbx|dae|usd[acz]?))#([\w-]+)", re.IGNORECASE | re.DOTALL)
Key = TypeVar("Key", bound=Hashable)


class SourceFile(NamedTuple):
    """A motion file: the corpus folder, and the file's path from there with ``/``."""

    corpus: str
    path: str


def clip_names(files: Mapping[Key, SourceFile]) -> dict[Key, str]:
    """Return a unique name for every file.

    The stem where no other file has it; else the path from the corpus root without its suffix;
    where two files differ in nothing else, with the suffix; and where two corpora hold the same
    path, with the corpus folder's name before it.

    Raises
    ------
    LibraryError
        If two files cannot be told apart even so.
    """
    names: dict[Key, str] = {}
    undecided = dict(files)
    for length in range(4):
        spelled = {key: _spelling(file, length) for key, file in undecided.items()}
        # only the stem may be left for one file and refused to another: paths decide as a group
        groups = Counter(spelled.values())
        taken = set(names.values()) if length else ()
        decided = {k: n for k, n in spelled.items() if groups[n] == 1 and n not in taken}
        names |= decided
        undecided = {key: files[key] for key in spelled if key not in decided}
    if undecided:
        clashing = defaultdict(list)
        for file in undecided.values():
            clashing[file.path].append(file.corpus)
        path, corpora = next(iter(clashing.items()))
        raise LibraryError(
            f"Expected different clips to have different paths, but {path!r} is in "
            f"{' and '.join(corpora)}. Rename one of the folders."
        )
    return names


def _spelling(file: SourceFile, length: int) -> str:
    """Return a file's name in one of four lengths."""
    if length < 2:
        folder, stem = file.path.rpartition("/")[0], stem_of(file.path)
        return f"{folder}/{stem}" if folder and length else stem
    return file.path if length == 2 else f"{PurePath(file.corpus).name}/{file.path}"


def file_and_take(source: str) -> tuple[str, str]:
    """Return the file of a clip, and which take of it; empty where the file holds one motion.

    Examples
    --------
    >>> file_and_take("a/walk.fbx#Run"), file_and_take("a/walk#1.bvh")
    (('a/walk.fbx', 'Run'), ('a/walk#1.bvh', ''))
    """
    found = TAKE.fullmatch(source) if "#" in source else None
    return (found[1], found[2]) if found else (source, "")


def source_of(file: str, take: str) -> str:
    """Return the source of a clip: what `file_and_take` makes two of."""
    return f"{file}#{take}" if take else file


def suffix_of(path: str) -> str:
    """Return the suffix of a path with ``/``, in lower case, as `pathlib` has it.

    Examples
    --------
    >>> suffix_of("takes/01.a.BVH"), suffix_of("takes/.bvh"), suffix_of("takes/01.")
    ('.bvh', '', '')
    """
    name = path.rpartition("/")[2]
    dot = name.rfind(".")
    return name[dot:].lower() if 0 < dot < len(name) - 1 else ""


def stem_of(source: str) -> str:
    """Return the stem of a clip's file, as `pathlib` has it, with its take.

    Examples
    --------
    >>> stem_of("a/walk.fbx#Run"), stem_of("a/walk.bvh"), stem_of("a/.bvh")
    ('walk_Run', 'walk', '.bvh')
    """
    file, take = file_and_take(source)
    name = file.rpartition("/")[2]
    stem = name[: len(name) - len(suffix_of(name))]
    return f"{stem}_{take}" if take else stem


def subject_of(stem: str) -> str:
    """Return who performs a clip, where its file's stem tells; empty where nobody knows.

    It tells in CMU's names (``35_17`` is by subject ``35``) and in HDM05's
    (``HDM_bd_squat1Reps_001_120`` is by ``HDM_bd``). Any other name may begin with anything.

    Examples
    --------
    >>> subject_of("35_17"), subject_of("HDM_bd_squat1Reps_001_120"), subject_of("dataset-1_bow")
    ('35', 'HDM_bd', '')
    """
    found = NAMED_SUBJECT.match(stem)
    return found[0] if found else ""
