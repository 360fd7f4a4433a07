"""Names of clips: a file's stem, or its path where two files share the stem."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Hashable, Mapping
from pathlib import PurePath, PurePosixPath
from typing import NamedTuple, TypeVar

from mocapdb.errors import LibraryError

__all__ = ["SourceFile", "clip_names", "subject_of"]

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
    """Return who performs a clip, as far as its file's stem tells: all but the last part.

    CMU's ``35_17`` is by subject ``35``. HDM05's ``HDM_bd_squat1Reps_001_120`` is by ``HDM_bd``:
    where there are more parts than two, the first two count. A stem of one part is a subject of
    its own.
    """
    parts = stem.split("_")
    return parts[0] if len(parts) <= 2 else "_".join(parts[:2])
