"""What a build has to do: the files of a corpus compared with what the library holds."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from mocapdb.base.arrays import StrPath
from mocapdb.errors import CorpusError, FormatError, MocapdbError
from mocapdb.io.find_files import CLIP_SUFFIXES, find_motion_files
from mocapdb.io.reading import ReadOptions
from mocapdb.library.building.folder_bodies import FolderBody, bodies_of_folders
from mocapdb.library.building.known_files import KnownFile, KnownFiles
from mocapdb.library.building.settings import BuildSettings
from mocapdb.library.catalogue import Catalogue
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.layout import CATALOGUE_FILE
from mocapdb.library.naming import SourceFile, clip_names, subject_of
from mocapdb.motion.skeleton import Skeleton

if TYPE_CHECKING:
    from mocapdb.corpus.labels import Labels

__all__ = [
    "Failure",
    "Plan",
    "Task",
    "corpus_files",
    "corpus_labels",
    "hash_file",
    "make_plan",
    "what_happened",
]


def what_happened(problem: Exception) -> str:
    """Return an error that is none of ours in a few words, for whoever has to mend the file."""
    if isinstance(problem, OSError) and problem.strerror:
        return problem.strerror
    if isinstance(problem, MemoryError):
        return "it takes more memory than there is"
    text = str(problem).partition("\n")[0][:200]
    return f"{type(problem).__name__}: {text}" if text else type(problem).__name__


LABELLED_RATES = {"labels", "manifest"}


@dataclass(frozen=True)
class Failure:
    """A file that could not be built: path, line where one is to blame, and reason."""

    path: str
    line: int | None
    reason: str

    @classmethod
    def of(cls, path: StrPath, problem: Exception, *, doing: str = "read") -> Failure:
        """Return the failure of a file that raised `problem`, whatever it is, while `doing`."""
        if isinstance(problem, FormatError):
            return cls(problem.path, problem.line, problem.message)
        if isinstance(problem, MocapdbError):
            return cls(str(path), None, str(problem))
        return cls(str(path), None, f"cannot {doing} ({what_happened(problem)})")

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
    reading : ReadOptions
        What is said of the file, and the ASF of an AMC.
    by_settings : frozenset of str
        What of it only the settings of its folder say.
    settings : str
        How the clip is encoded, and how its file is read.
    sha256 : str
        Hash of the file's bytes and its skeleton's.
    name, label, description, subject, columns
        Of the clip it becomes.
    fps_source : str
        Who states the rate of `reading`, if a label does.
    subject_source : str
        Who says who performs it.
    replaces : int, optional
        Row of the clip that it takes the place of.
    folder_body : FolderBody, optional
        Unit and axis of the clips of its skeleton in its folder.
    """

    path: str
    relative: str
    reading: ReadOptions
    by_settings: frozenset[str]
    settings: str
    sha256: str
    name: str
    label: str | None
    description: str
    subject: str | None
    subject_source: str
    columns: Mapping[str, str]
    fps_source: str
    replaces: int | None
    folder_body: FolderBody | None = None


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
    found = find_motion_files(root, CLIP_SUFFIXES, pass_over=CATALOGUE_FILE)
    if not found:
        raise CorpusError(
            f"{root}: expected motion files ({', '.join(CLIP_SUFFIXES)}), but found none."
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
    known: KnownFiles,
    settings: BuildSettings,
    jobs: int | None,
) -> Plan:
    """Compare a corpus folder with a library.

    Parameters
    ----------
    catalogue : Catalogue
    root, files
        The corpus, and its motion files as `corpus_files` lists them.
    known : KnownFiles
    settings : BuildSettings
        How clips are to be encoded; a clip that was read or encoded otherwise is done again.
    jobs : int, optional
        Threads that hash files.
    """
    corpus = str(root.resolve())
    live = list(catalogue.records())
    facts, failed = _known(root, files, known)
    hashed, unreadable = _hash_files(root, facts, jobs)
    failed += unreadable
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
        fact, before = facts[file], held.get(file)
        how = settings.to_json(fact.reading)
        if before and (before.source_sha256, before.settings) == (sha256, how):
            kept.append(before)
            place = {"corpus": corpus, "source": file, "stem": PurePosixPath(file).stem}
            rate = _rate(fact, before, known.label_source, root / file, skeleton)
            said = _columns(fact, before) | _subject(file, fact)
            wanted[before.id] = {"name": names[file]} | place | said | rate
        else:
            label_fps = ReadOptions(fps=fact.label_fps)
            tasks.append(
                Task(
                    path=str(root / file),
                    relative=file,
                    reading=replace(fact.reading.over(label_fps), skeleton=skeleton),
                    by_settings=fact.by_settings,
                    settings=how,
                    sha256=sha256,
                    name=names[file],
                    label=fact.label,
                    description=fact.description,
                    columns=fact.columns,
                    **_subject(file, fact),
                    fps_source=known.label_source if fact.label_fps is not None else "",
                    replaces=before.id if before else None,
                )
            )
    readings = [(file, replace(facts[file].reading, skeleton=None)) for file in hashed]
    bodies = bodies_of_folders(root, [task.relative for task in tasks], readings)
    tasks = [replace(task, folder_body=bodies.get(task.relative)) for task in tasks]
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


def _known(
    root: Path, files: Sequence[str], known: KnownFiles
) -> tuple[dict[str, KnownFile], list[Failure]]:
    """Return what is known of each file, and the files whose names do not fit their pattern."""
    facts: dict[str, KnownFile] = {}
    failed = []
    for file in files:
        try:
            facts[file] = known.of(file)
        except FormatError as problem:
            failed.append(Failure.of(root / file, problem))
    return facts, failed


def _columns(fact: KnownFile, before: ClipRecord) -> dict[str, Any]:
    """Return what is known of a clip that stays as it is, by the catalogue's columns."""
    columns: dict[str, Any] = {"description": fact.description, "columns": dict(fact.columns)}
    if fact.label is not None or before.label_source != "classify":  # the corpus overrules a guess
        columns |= {"label": fact.label, "label_source": "corpus"}
    return columns


def _subject(file: str, fact: KnownFile) -> dict[str, Any]:
    """Return who performs a clip and who says so, by the catalogue's columns."""
    if fact.subject:
        return {"subject": fact.subject, "subject_source": fact.subject_source}
    guessed = subject_of(PurePosixPath(file).stem)
    return {"subject": guessed or None, "subject_source": "name" if guessed else "nobody"}


def _rate(
    fact: KnownFile,
    before: ClipRecord,
    label_source: str,
    path: Path,
    skeleton: Skeleton | Path | None,
) -> dict[str, Any]:
    """Return the rate of a clip that stays, by the catalogue's columns, if it may have changed."""
    from mocapdb.io.clip_files import acclaim_rate

    if fact.label_fps is not None:
        return {"fps": fact.label_fps, "fps_source": label_source}
    if before.fps_source not in LABELLED_RATES:
        return {}
    fps, source = acclaim_rate(path, skeleton)  # the labels no longer give a rate
    return {"fps": fps, "fps_source": source}


def _hash_files(
    root: Path, facts: Mapping[str, KnownFile], jobs: int | None
) -> tuple[dict[str, tuple[str, Skeleton | Path | None]], list[Failure]]:
    """Return for each file its hash and its skeleton, and the files that have none.

    Threads will do: hashing does not hold the interpreter.
    """
    from joblib import Parallel, delayed

    run = Parallel(n_jobs=jobs or -1, prefer="threads", return_as="generator")
    hashing = run(
        delayed(hash_file)(root / file, fact.reading.skeleton) for file, fact in facts.items()
    )
    answers = dict(zip(facts, hashing, strict=True))
    failed = [answer for answer in answers.values() if isinstance(answer, Failure)]
    return {f: own for f, own in answers.items() if not isinstance(own, Failure)}, failed


def hash_file(
    path: Path, given: Skeleton | StrPath | None
) -> tuple[str, Skeleton | Path | None] | Failure:
    """Return the hash of a file with its skeleton, and an AMC's skeleton: given, or found."""
    from mocapdb.io.clip_files import find_skeleton

    try:
        str(path).encode()
    except UnicodeEncodeError:
        return Failure(str(path), None, "Expected a file name in UTF-8. Rename the file.")
    try:
        skeleton: Skeleton | Path | None = None
        if path.suffix.lower() == ".amc":
            if isinstance(given, Skeleton):
                skeleton = given
            else:
                skeleton = find_skeleton(path) if given is None else Path(given)
        digest = hashlib.sha256()
        for part in (path, skeleton):
            if isinstance(part, Skeleton):
                digest.update(bytes.fromhex(part.digest))
            elif part is not None:
                with part.open("rb") as file:
                    digest.update(hashlib.file_digest(file, "sha256").digest())
    except Exception as problem:  # whatever one file does, the others are built
        return Failure.of(path, problem)
    return digest.hexdigest(), skeleton
