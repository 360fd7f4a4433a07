"""What a build has to do: the files of a corpus compared with what the library holds."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from mocapdb.base.arrays import StrPath
from mocapdb.errors import CorpusError, FormatError, MocapdbError
from mocapdb.io.find_files import TEXT_SUFFIXES, find_motion_files
from mocapdb.library.catalogue import Catalogue
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.layout import CATALOGUE_FILE
from mocapdb.library.naming import SourceFile, clip_names

if TYPE_CHECKING:
    from mocapdb.corpus.labels import Labels

__all__ = ["Failure", "Plan", "Task", "corpus_files", "corpus_labels", "make_plan"]


@dataclass(frozen=True)
class Failure:
    """A file that could not be built: path, line where one is to blame, and reason."""

    path: str
    line: int | None
    reason: str

    @classmethod
    def of(cls, path: StrPath, problem: MocapdbError | OSError) -> Failure:
        """Return the failure of a file that raised `problem` when it was read."""
        if isinstance(problem, FormatError):
            return cls(problem.path, problem.line, problem.message)
        if isinstance(problem, OSError):
            return cls(str(path), None, f"cannot read ({problem.strerror})")
        return cls(str(path), None, str(problem))

    def to_error(self) -> FormatError:
        """Return the failure as the error that a strict build ends with."""
        return FormatError(self.path, self.reason, self.line)


@dataclass(frozen=True)
class Task:
    """A file to encode, and what is known about it.

    Attributes
    ----------
    path, relative : str
        The file, and its path from the corpus root.
    skeleton_path : str, optional
        For an AMC, the ASF it needs.
    sha256 : str
        Hash of the file's bytes and its skeleton's.
    name, label, description
        Of the clip it becomes.
    fps, fps_source
        Frame rate and who states it; None and empty where the file itself does.
    replaces : int, optional
        Row of the clip that it takes the place of.
    """

    path: str
    relative: str
    skeleton_path: str | None
    sha256: str
    name: str
    label: str | None
    description: str
    fps: float | None
    fps_source: str
    replaces: int | None


@dataclass(frozen=True)
class Plan:
    """What a build has to do.

    Attributes
    ----------
    tasks : list of Task
        Files to encode.
    kept : list of ClipRecord
        Clips that stay as they are.
    updates : dict of dict
        Rows of clips that stay, with the columns in which what is known of them has changed.
    failed : list of Failure
        Files that cannot even be looked at.
    """

    tasks: list[Task]
    kept: list[ClipRecord]
    updates: dict[int, dict[str, Any]]
    failed: list[Failure]


def corpus_files(root: Path) -> list[str]:
    """Return the motion files below a folder, sorted, as paths from it with ``/``.

    Libraries among them are passed over.

    Raises
    ------
    CorpusError
        If the folder is missing, cannot be listed, or holds no motion file.
    """
    found = find_motion_files(root, TEXT_SUFFIXES, pass_over=CATALOGUE_FILE)
    if not found:
        raise CorpusError(
            f"{root}: expected motion files ({', '.join(TEXT_SUFFIXES)}), but found none."
        )
    return sorted(path.relative_to(root).as_posix() for path in found)


def corpus_labels(root: Path, labels: StrPath | None, manifest: StrPath | None) -> Labels | None:
    """Return what is known about a corpus: from a file that is named, else its own LABELS.csv.

    Raises
    ------
    CorpusError
        If a file is named that cannot be used.
    """
    from mocapdb.corpus.labels import Labels, find_labels, read_labels
    from mocapdb.corpus.manifest import read_manifest

    if labels is None and manifest is not None:
        return Labels.from_manifest(read_manifest(manifest))
    found = labels if labels is not None else find_labels(root)
    return None if found is None else read_labels(found, root)


def make_plan(
    catalogue: Catalogue,
    root: Path,
    files: Sequence[str],
    labels: Labels | None,
    settings: str,
    jobs: int | None,
) -> Plan:
    """Compare a corpus folder with a library.

    Parameters
    ----------
    catalogue : Catalogue
    root, files
        The corpus, and its motion files as `corpus_files` lists them.
    labels : Labels, optional
    settings : str
        How clips are to be encoded; a clip encoded otherwise is done again.
    jobs : int, optional
        Threads that hash files.
    """
    corpus = str(root.resolve())
    live = list(catalogue.records())
    hashed, failed = _hash_files(root, files, jobs)
    held = _match_clips(live, corpus, files, {file: sha256 for file, (sha256, _) in hashed.items()})
    held_ids = {record.id for record in held.values()}
    elsewhere = [record for record in live if record.id not in held_ids]
    sources: dict[int | str, SourceFile] = {file: SourceFile(corpus, file) for file in files}
    sources |= {record.id: SourceFile(record.corpus, record.source) for record in elsewhere}
    names = clip_names(sources)

    wanted: dict[int, dict[str, Any]] = {
        record.id: {"name": names[record.id]} for record in elsewhere
    }
    # also of clips that are to be replaced: they stay if their new file turns out to be bad
    wanted |= {record.id: {"name": names[file]} for file, record in held.items()}
    kept = []
    tasks = []
    for file, (sha256, skeleton) in hashed.items():
        known = _known(file, skeleton is not None, labels) | {"name": names[file]}
        before = held.get(file)
        if before and (before.source_sha256, before.settings) == (sha256, settings):
            kept.append(before)
            if known["fps"] is None:  # the file states it
                del known["fps"], known["fps_source"]
            if known["label"] is None and before.label_source == "classify":
                del known["label"]  # the corpus says nothing better
            else:
                known["label_source"] = "corpus"
            place = {"corpus": corpus, "source": file, "stem": PurePosixPath(file).stem}
            wanted[before.id] = known | place
        else:
            tasks.append(
                Task(
                    path=str(root / file),
                    relative=file,
                    skeleton_path=str(skeleton) if skeleton else None,
                    sha256=sha256,
                    replaces=before.id if before else None,
                    **known,
                )
            )
    return Plan(tasks, kept, _updates(live, wanted), failed)


def _match_clips(
    live: Sequence[ClipRecord], corpus: str, files: Sequence[str], hashes: dict[str, str]
) -> dict[str, ClipRecord]:
    """Return for each file the clip that was made of it, if there is one.

    A file that moved is still the same clip, and so is one that changed while its corpus moved:
    a corpus has moved here if a file of it is recognised at its old place within.
    """
    present = set(files)
    held: dict[str, ClipRecord] = {}
    moved: dict[str, list[ClipRecord]] = {}
    for record in live:
        if record.corpus == corpus and record.source in present:
            held[record.source] = record
        else:
            moved.setdefault(record.source_sha256, []).append(record)
    for file, sha256 in hashes.items():
        if file not in held and moved.get(sha256):
            held[file] = moved[sha256].pop(0)
    moved_corpora = {record.corpus for file, record in held.items() if record.source == file}
    held_ids = {record.id for record in held.values()}
    for record in live:
        at_home = record.corpus in moved_corpora and record.source in present
        if at_home and record.id not in held_ids:
            held.setdefault(record.source, record)
    return held


def _updates(
    live: Sequence[ClipRecord], wanted: dict[int, dict[str, Any]]
) -> dict[int, dict[str, Any]]:
    """Return the columns of each clip that differ from what is wanted."""
    updates = {}
    for record in live:
        columns = wanted[record.id].items()
        changed = {column: value for column, value in columns if getattr(record, column) != value}
        if changed:
            updates[record.id] = changed
    return updates


def _known(relative: str, acclaim: bool, labels: Labels | None) -> dict[str, Any]:
    """Return label, description and frame rate of a file; without labels, its folder's name.

    The rate of a BVH is None: the file itself states it.
    """
    from mocapdb.io.amc import DEFAULT_FPS

    row = labels.lookup(relative) if labels else None
    known: dict[str, Any] = {
        "label": row.label if row else None,
        "description": row.description if row else "",
        "fps": DEFAULT_FPS if acclaim else None,
        "fps_source": "default" if acclaim else "",
    }
    if labels is None:
        known["label"] = PurePosixPath(relative).parent.name or None
    elif acclaim and row and row.fps is not None:
        known |= {"fps": row.fps, "fps_source": labels.source}
    return known


def _hash_files(
    root: Path, files: Sequence[str], jobs: int | None
) -> tuple[dict[str, tuple[str, Path | None]], list[Failure]]:
    """Return for each file its hash and its skeleton's path, and the files that have none.

    Threads will do: hashing does not hold the interpreter.
    """
    from joblib import Parallel, delayed

    run = Parallel(n_jobs=jobs or -1, prefer="threads", return_as="generator")
    hashing = run(delayed(_hash_file)(root / file) for file in files)
    answers = dict(zip(files, hashing, strict=True))
    failed = [answer for answer in answers.values() if isinstance(answer, Failure)]
    return {f: own for f, own in answers.items() if not isinstance(own, Failure)}, failed


def _hash_file(path: Path) -> tuple[str, Path | None] | Failure:
    from mocapdb.io import find_skeleton

    try:
        str(path).encode()
    except UnicodeEncodeError:
        return Failure(str(path), None, "Expected a file name in UTF-8. Rename the file.")
    try:
        skeleton = find_skeleton(path) if path.suffix.lower() == ".amc" else None
        digest = hashlib.sha256()
        for part in (path, skeleton):
            if part is not None:
                with part.open("rb") as file:
                    digest.update(hashlib.file_digest(file, "sha256").digest())
    except (MocapdbError, OSError) as problem:
        return Failure.of(path, problem)
    return digest.hexdigest(), skeleton
