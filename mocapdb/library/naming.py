"""Names of clips: a file's stem, or its path where two files share the stem."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Hashable, Mapping
from pathlib import PurePath, PurePosixPath
from typing import NamedTuple, TypeVar

from mocapdb.errors import LibraryError

__all__ = ["SourceFile", "clip_names", "subject_of"]

NAMED_SUBJECT = re.compile(r"\d{1,3}(?=_\d{1,3}(?![^\W_]))|HDM_[a-z]{2}(?=_)")
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
        spelled = {key: _spellings(file)[length] for key, file in undecided.items()}
        # only the stem may be left for one file and refused to another: paths decide as a group
        groups = Counter(spelled.values())
        taken = set(names.values())
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


def _spellings(file: SourceFile) -> tuple[str, str, str, str]:
    path = PurePosixPath(file.path)
    in_corpus = f"{PurePath(file.corpus).name}/{file.path}"
    return path.stem, str(path.with_suffix("")), file.path, in_corpus


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
