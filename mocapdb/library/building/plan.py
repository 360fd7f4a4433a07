"""What a build has to do: the files of a corpus compared with what the library holds."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

from mocapdb.base.arrays import StrPath
from mocapdb.errors import FormatError, MocapdbError
from mocapdb.io.find_files import GLTF_SUFFIXES
from mocapdb.io.reading import ReadOptions
from mocapdb.library.building.changed_files import Changed, Looks, SeenClip
from mocapdb.library.building.corpus_listing import CorpusListing
from mocapdb.library.building.file_states import FileStates
from mocapdb.library.building.folder_bodies import FolderBody, bodies_of_folders
from mocapdb.library.building.known_files import KnownFile, KnownFiles
from mocapdb.library.building.settings import BuildSettings
from mocapdb.library.catalogue import Catalogue
from mocapdb.library.naming import (
    UNKNOWN,
    SourceFile,
    clip_names,
    file_and_take,
    source_of,
    stem_of,
    subject_of,
    suffix_of,
)
from mocapdb.motion.skeleton import Skeleton

__all__ = [
    "Failure",
    "Plan",
    "SeenFile",
    "Task",
    "hash_file",
    "make_plan",
    "subject_columns",
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


SHARED = (
    "label", "label_source", "description", "corpus", "settings", "fps_source", "subject",
    "subject_source", "columns", "bones",
)  # fmt: skip
"""Columns whose texts are those of many clips."""

FEW_FILES = 64  # are hashed before threads are running
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
    take : str
        Which take of the file; empty where it holds one motion, and before it is read.
    takes : mapping of str to (int, str)
        Of a file that held several, row and name of the clip of each.
    state, bones : str, optional
        How the file looks from outside, and its skeleton: see `SeenFile`.
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
    take: str = ""
    takes: Mapping[str, tuple[int, str]] = field(default_factory=dict)
    state: str | None = None
    bones: str | None = None


@dataclass(frozen=True)
class Plan:
    """What a build has to do.

    Attributes
    ----------
    tasks : list of Task
        Files to encode.
    n_kept : int
        How many clips stay as they are.
    updates : dict of dict
        Rows of clips that stay, with the columns in which what is known of them has changed.
    seen : dict of SeenFile
        Rows of clips that stay, with how their files look, where that is not known yet.
    failed : list of Failure
        Files that cannot even be looked at.
    n_hashed : int
        How many files were read for their hashes.
    names : frozenset of str
        Of all these clips.
    folders : mapping of str to Looks
        How the files looked that were planned, by folder and name.
    left_out : frozenset of str
        Files that there is no task of because they failed.
    warnings : list of str
        That clips were another folder's, which still has their files.
    part : Changed, optional
        What was planned, if it was not all of the corpus.
    """

    tasks: list[Task]
    n_kept: int
    updates: dict[int, dict[str, Any]]
    seen: dict[int, SeenFile]
    failed: list[Failure]
    n_hashed: int
    names: frozenset[str]
    folders: Mapping[str, Looks]
    left_out: frozenset[str]
    warnings: list[str]
    part: Changed | None = None


class SeenFile(NamedTuple):
    """How a clip's file looked when it was hashed, and a digest of the bones of its BVH.

    Without a state it says nothing: see `FileStates`. Bones are None where nobody looked for them,
    and empty where there are none.
    """

    state: str | None
    bones: str | None


class HeldClip(NamedTuple):
    """What a plan has to know of a clip of the library."""

    id: int
    name: str
    stem: str
    label: str | None
    label_source: str
    description: str
    corpus: str
    source: str
    source_sha256: str
    settings: str
    fps: float
    fps_source: str
    subject: str | None
    subject_source: str
    columns: str
    state: str | None
    bones: str | None

    def differs(self, wanted: Mapping[str, Any]) -> dict[str, Any]:
        """Return those of some columns that are otherwise."""
        return {
            name: value
            for name, value in wanted.items()
            if (json.loads(self.columns) if name == "columns" else getattr(self, name)) != value
        }


def held_clips(catalogue: Catalogue, stems: Collection[str] | None = None) -> Iterator[HeldClip]:
    """Yield the live clips of a library by name, all or those with some stems.

    Texts that many share are held once.
    """
    shared: dict[str | None, str | None] = {}
    in_common = [HeldClip._fields.index(name) for name in SHARED]
    for row in catalogue.columns([*HeldClip._fields], stems):
        values = list(row)
        for i in in_common:
            values[i] = shared.setdefault(values[i], values[i])
        yield HeldClip(*values)


def make_plan(
    catalogue: Catalogue,
    root: Path,
    listing: CorpusListing,
    known: KnownFiles,
    settings: BuildSettings,
    jobs: int | None,
    changed: Changed | None,
    *,
    rehash: bool = False,
    scheduler: str | None = None,
) -> Plan:
    """Compare a corpus folder with a library.

    Parameters
    ----------
    catalogue : Catalogue
    root, listing
        The corpus, and its motion files.
    known : KnownFiles
    settings : BuildSettings
        How clips are to be encoded; a clip that was read or encoded otherwise is done again.
    jobs : int, optional
        Threads that hash files, and processes that read the clips of folders.
    changed : Changed, optional
        Files that look otherwise than the last build left them; by default all are compared.
    rehash : bool
        Whether files are hashed that look as they did when they were hashed last, too.
    scheduler : str, optional
        Of a cluster that reads the clips by which the bodies of folders are known.
    """
    planning = _Planning(catalogue, root, known, settings, jobs, scheduler)
    if changed is not None:
        live = list(held_clips(catalogue, changed.stems))
        plan = planning.plan(live, changed.files, changed.beside)
        if plan is not None:
            n_kept = plan.n_kept + changed.n_same
            return replace(plan, n_kept=n_kept, folders=changed.folders, part=changed)
    plan = planning.plan(list(held_clips(catalogue)), listing.files, rehash=rehash)
    assert plan is not None
    return plan


@dataclass(frozen=True)
class _Planning:
    """What is the same for every plan of a build; see `make_plan`."""

    catalogue: Catalogue
    root: Path
    known: KnownFiles
    settings: BuildSettings
    jobs: int | None
    scheduler: str | None

    def plan(
        self,
        live: Sequence[HeldClip],
        files: Sequence[str],
        beside: Mapping[str, SeenClip] | None = None,
        *,
        rehash: bool = False,
    ) -> Plan | None:
        """Return a plan of some files, given all clips that it may have to do with.

        Parameters
        ----------
        live : sequence of HeldClip
        files : sequence of str
        beside : mapping of str to SeenClip, optional
            The other files of their folders, where these are not all files. The answer is None
            then if other clips than these have to do with them.
        rehash : bool
        """
        root, known, corpus = self.root, self.known, str(self.root.resolve())
        facts, failed = _known(root, files, known)
        looked = {} if rehash else _looked(live, corpus)
        hashed, n_hashed, unreadable = _hash_files(root, facts, looked, self.jobs)
        failed += unreadable
        files_asked = files
        sources_of = _sources(live, hashed)
        files = [source for file in files for source in sources_of.get(file, [file])]
        hashes = {source: hashed[file].sha256 for file, own in sources_of.items() for source in own}
        held = _match_clips(live, corpus, files, hashes)
        held_ids = {record.id for record in held.values()}
        elsewhere = [record for record in live if record.id not in held_ids]
        sources: dict[int | str, SourceFile] = {file: SourceFile(corpus, file) for file in files}
        sources |= {record.id: SourceFile(record.corpus, record.source) for record in elsewhere}
        names = clip_names(sources)
        if beside is not None and not self._is_closed(live, hashes, held, sources, names):
            return None

        updates = {
            record.id: {"name": names[record.id]}
            for record in elsewhere
            if record.name != names[record.id]
        }
        # also of clips that are to be replaced: they stay if their new file turns out to be bad,
        # and a build that goes on where this one was stopped has to know them again if the corpus
        # has moved
        for file, record in held.items():
            place = {"name": names[file], "corpus": corpus, "source": file, "stem": stem_of(file)}
            if changed := record.differs(place):
                updates[record.id] = changed
        n_kept = 0
        tasks = []
        hows: dict[int, str] = {}  # of what is said of files: most are read alike
        seen: dict[int, SeenFile] = {}
        takes_elsewhere = _takes_elsewhere(elsewhere, corpus, names)
        for file, found in hashed.items():
            fact, own = facts[file], sources_of[file]
            if id(fact.reading) not in hows:
                hows[id(fact.reading)] = self.settings.to_json(fact.reading)
            how = hows[id(fact.reading)]
            before = [clip for source in own if (clip := held.get(source)) is not None]
            as_now = [(each.source_sha256, each.settings) == (found.sha256, how) for each in before]
            if len(as_now) == len(own) and all(as_now):
                n_kept += len(before)
                for source, record in zip(own, before, strict=True):
                    told = fact if source == file else known.of(source)
                    rate = _rate(told, record, known.label_source, root / file, found.skeleton)
                    wanted = _columns(told, record) | subject_columns(file, told) | rate
                    if changed := record.differs(wanted):
                        updates[record.id] = updates.get(record.id, {}) | changed
                    if found.state not in (None, record.state):
                        seen[record.id] = SeenFile(found.state, record.bones)
            else:
                takes = {
                    take: (clip.id, names[source])
                    for source in own
                    if (take := file_and_take(source)[1]) and (clip := held.get(source))
                }
                label_fps = ReadOptions(fps=fact.label_fps)
                tasks.append(
                    Task(
                        path=str(root / file),
                        relative=file,
                        reading=replace(fact.reading.over(label_fps), skeleton=found.skeleton),
                        by_settings=fact.by_settings,
                        settings=how,
                        sha256=found.sha256,
                        name=names.get(file) or stem_of(file),
                        label=fact.label,
                        description=fact.description,
                        columns=fact.columns,
                        **subject_columns(file, fact),
                        fps_source=known.label_source if fact.label_fps is not None else "",
                        replaces=held[file].id if file in held else None,
                        takes=takes_elsewhere.get(file, {}) | takes,
                        state=found.state,
                    )
                )
        if tasks:
            tasks = self._with_bodies(tasks, facts, hashed, held, beside or {}, seen)
        return Plan(
            tasks,
            n_kept,
            updates,
            seen,
            failed,
            n_hashed,
            names=frozenset(names.values()),
            folders=_looks(files_asked, hashed),
            left_out=frozenset(files_asked) - hashed.keys(),
            warnings=_taken_over(held.values(), corpus),
        )

    def _is_closed(
        self,
        live: Sequence[HeldClip],
        hashes: Mapping[str, str],
        held: Mapping[str, HeldClip],
        sources: Mapping[int | str, SourceFile],
        names: Mapping[int | str, str],
    ) -> bool:
        """Tell whether no clip but these has the content of a new file, or comes by its name.

        Clips with one stem are named by themselves where stem, or folder and stem, tell them apart.
        """
        new = [sha256 for source, sha256 in hashes.items() if source not in held]
        moved = any(clip.source != source for source, clip in held.items())
        if moved or (new and self.catalogue.with_content(new)):
            return False
        for key, source in sources.items():
            folder, stem = source.path.rpartition("/")[0], stem_of(source.path)
            if names[key] not in (stem, f"{folder}/{stem}"):
                return False
        return self.catalogue.named(names.values()) <= {clip.id for clip in live}

    def _with_bodies(
        self,
        tasks: Sequence[Task],
        facts: Mapping[str, KnownFile],
        hashed: Mapping[str, Hashed],
        held: Mapping[str, HeldClip],
        beside: Mapping[str, SeenClip],
        seen: dict[int, SeenFile],
    ) -> list[Task]:
        """Return tasks with what their folders say of bodies; note the bones of clips that stay."""
        new = {task.relative for task in tasks}
        folders = {file.rpartition("/")[0] for file in new if suffix_of(file) == ".bvh"}
        stay: dict[str, HeldClip | SeenClip] = {
            file: clip for file, clip in held.items() if file not in new
        }
        stay |= {file: clip for file, clip in beside.items() if file.rpartition("/")[0] in folders}
        readings = {file: facts[file].reading for file in hashed}
        readings |= {file: self.known.reading(file) for file in stay if file not in readings}
        known = {file: clip.bones for file, clip in stay.items() if clip.bones is not None}
        in_order = [(file, readings[file]) for file in sorted(readings)]
        bodies, bones = bodies_of_folders(
            self.root, new, in_order, known, jobs=self.jobs, scheduler=self.scheduler
        )
        for file in bones.keys() & stay.keys():
            before = stay[file]
            state = seen[before.id].state if before.id in seen else before.state
            if state is not None:
                seen[before.id] = SeenFile(state, bones[file])
        return [
            replace(task, folder_body=bodies.get(task.relative), bones=bones.get(task.relative))
            for task in tasks
        ]


def _looks(files: Iterable[str], hashed: Mapping[str, Hashed]) -> dict[str, Looks]:
    """Return how files look, by folder and name."""
    found: dict[str, Looks] = {}
    for file in files:
        folder, _, name = file.rpartition("/")
        found.setdefault(folder, {})[name] = hashed[file].state if file in hashed else None
    return found


def _looked(live: Sequence[HeldClip], corpus: str) -> dict[tuple[str, str], str]:
    """Return the hashes of files by their paths and how they looked when they were hashed."""
    return {
        (file_and_take(record.source)[0], record.state): record.source_sha256
        for record in live
        if record.state is not None and record.corpus == corpus
    }


def _sources(live: Sequence[HeldClip], hashed: Mapping[str, Hashed]) -> dict[str, list[str]]:
    """Return the sources of each file: its takes, where clips of just this content tell them."""
    takes: dict[str, dict[str, None]] = {}
    for record in live:
        take = file_and_take(record.source)[1]
        if take:
            takes.setdefault(record.source_sha256, {})[take] = None
    return {
        file: [source_of(file, take) for take in takes.get(found.sha256, {})] or [file]
        for file, found in hashed.items()
    }


def _takes_elsewhere(
    elsewhere: Sequence[HeldClip], corpus: str, names: Mapping[int | str, str]
) -> dict[str, dict[str, tuple[int, str]]]:
    """Return row and name of clips of files as they were before, by file and take."""
    found: dict[str, dict[str, tuple[int, str]]] = {}
    for record in elsewhere:
        file, take = file_and_take(record.source)
        if take and record.corpus == corpus:
            found.setdefault(file, {})[take] = record.id, names[record.id]
    return found


def _match_clips(
    live: Sequence[HeldClip], corpus: str, files: Sequence[str], hashes: Mapping[str, str]
) -> dict[str, HeldClip]:
    """Return for each file the clip that was made of it, if there is one.

    A file that moved is still the same clip, and so is one that changed while its corpus moved:
    a corpus has moved here if a file of it is recognised at its old place within.
    """
    present = set(files)
    held: dict[str, HeldClip] = {}
    moved: dict[str, list[HeldClip]] = {}
    for record in live:
        if record.corpus == corpus and record.source in present:
            held[record.source] = record
        else:
            moved.setdefault(record.source_sha256, []).append(record)
    if not moved:
        return held
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


def _taken_over(held: Iterable[HeldClip], corpus: str) -> list[str]:
    """Tell of clips that were another folder's, where that still has the same files."""
    others = Counter(
        record.corpus
        for record in held
        if record.corpus != corpus
        and Path(record.corpus, file_and_take(record.source)[0]).is_file()
    )
    return [
        f"clips that were of the same files in {other} and are of this folder now: {count}. Build "
        "one of the two"
        for other, count in sorted(others.items())
    ]


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


def _columns(fact: KnownFile, before: HeldClip) -> dict[str, Any]:
    """Return what is known of a clip that stays as it is, by the catalogue's columns."""
    columns: dict[str, Any] = {"description": fact.description, "columns": dict(fact.columns)}
    # the corpus overrules a guess, but for where it says that it does not know
    if fact.label not in (None, UNKNOWN) or before.label_source != "classify":
        columns |= {"label": fact.label, "label_source": "corpus"}
    return columns


def subject_columns(file: str, fact: KnownFile) -> dict[str, Any]:
    """Return who performs a clip and who says so, by the catalogue's columns."""
    if fact.subject:
        return {"subject": fact.subject, "subject_source": fact.subject_source}
    guessed = subject_of(stem_of(file))
    return {"subject": guessed or None, "subject_source": "name" if guessed else "nobody"}


def _rate(
    fact: KnownFile,
    before: HeldClip,
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


class Hashed(NamedTuple):
    """A file's hash, its skeleton if it is an AMC, and how it looked before it was read."""

    sha256: str
    skeleton: Skeleton | Path | None
    state: str | None


def _hash_files(
    root: Path,
    facts: Mapping[str, KnownFile],
    looked: Mapping[tuple[str, str], str],
    jobs: int | None,
) -> tuple[dict[str, Hashed], int, list[Failure]]:
    """Return the hash of each file, how many were read for it, and the files that have none.

    Those that look as they did have the hash of their clip. Threads will do: hashing does not hold
    the interpreter.
    """
    states = FileStates(root)
    answers: dict[str, Hashed | Failure | None] = {}
    looks: dict[str, str | None] = {}
    for file, fact in facts.items():
        look = states.of(file, fact.reading.skeleton)
        sha256 = None if look is None else looked.get((file, look[0]))
        if look is not None and sha256 is not None:
            answers[file] = Hashed(sha256, look[1], look[0])
        else:
            answers[file], looks[file] = None, None if look is None else look[0]

    def hashing(file: str) -> Hashed | Failure:
        found = hash_file(root / file, facts[file].reading.skeleton, states)
        return found if isinstance(found, Failure) else Hashed(*found, looks[file])

    if len(looks) < FEW_FILES:
        answers |= {file: hashing(file) for file in looks}
    else:
        from joblib import Parallel, delayed

        run = Parallel(n_jobs=jobs or -1, prefer="threads", return_as="generator")
        answers |= zip(looks, run(delayed(hashing)(file) for file in looks), strict=True)
    failed = [answer for answer in answers.values() if isinstance(answer, Failure)]
    hashed = {file: own for file, own in answers.items() if isinstance(own, Hashed)}
    return hashed, len(looks), failed


def hash_file(
    path: Path, given: Skeleton | StrPath | None, states: FileStates | None = None
) -> tuple[str, Skeleton | Path | None] | Failure:
    """Return the hash of a file with its skeleton, and an AMC's skeleton: given, or found.

    What a glTF keeps in files beside it is part of it.
    """
    from mocapdb.io.gltf_reading import files_beside

    try:
        str(path).encode()
    except UnicodeEncodeError:
        return Failure(str(path), None, "Expected a file name in UTF-8. Rename the file.")
    try:
        skeleton: Skeleton | Path | None = None
        if path.suffix.lower() == ".amc":
            skeleton = (states or FileStates(path.parent)).skeleton(path, given)
        digest = hashlib.sha256()
        beside = files_beside(path) if path.suffix.lower() in GLTF_SUFFIXES else []
        for part in (path, skeleton, *beside):
            if isinstance(part, Skeleton):
                digest.update(bytes.fromhex(part.digest))
            elif part is not None:
                with part.open("rb") as file:
                    digest.update(hashlib.file_digest(file, "sha256").digest())
    except Exception as problem:  # whatever one file does, the others are built
        return Failure.of(path, problem)
    return digest.hexdigest(), skeleton
