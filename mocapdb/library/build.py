"""From a folder of motion files to a library: streaming, in parallel, resumable.

A file is read, encoded and measured by a worker; one writer, this process, gathers what the workers
return and commits it shard by shard. Killed at any moment, a build loses at most the clips since
the last commit, and the next build goes on from there.
"""

from __future__ import annotations

import json
import signal
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mocapdb.base.arrays import StrPath
from mocapdb.compression.targets import Target
from mocapdb.errors import LibraryError, MissingExtraError, MocapdbError
from mocapdb.library.catalogue import CATALOGUE_FILE, FEATURES_FOLDER, Catalogue
from mocapdb.library.lock import writer_lock
from mocapdb.library.plan import Failure, Task, corpus_labels, find_motion_files, make_plan
from mocapdb.library.shards import next_shard_number, remove_strays, write_shard
from mocapdb.motion.skeleton import Skeleton

if TYPE_CHECKING:
    from mocapdb.library.canonical_shards import PackedMotion
    from mocapdb.library.class_bases import ClassBases

__all__ = ["BuildReport", "BuildSettings", "Progress", "build_library", "open_for_writing"]

Progress = Callable[[int, int, str], None]
"""Called with the number of items done, of all items, and the name of the last one."""

SHARDS_FOLDER = "shards"
COMMIT_BYTES = 32 * 2**20
COMMIT_SECONDS = 20.0


@dataclass(frozen=True)
class BuildSettings:
    """How clips are encoded.

    Parameters
    ----------
    target : Target
        The error that no clip may exceed.
    codec : dict
        Keyword arguments of `mocapdb.compression.encode`.
    drop_tpose : bool
        Whether to leave out a T-pose in front of the motion.
    """

    target: Target
    codec: dict[str, Any] = field(default_factory=dict)
    drop_tpose: bool = False

    def to_json(self) -> str:
        """Return the settings as text; equal settings give equal text."""
        return json.dumps(asdict(self), sort_keys=True)


@dataclass
class BuildReport:
    """What a build did.

    Attributes
    ----------
    library : str
        Path of the library.
    built, skipped : int
        Clips encoded by this build, and clips that were there already.
    failed : list of Failure
    frames, payload_bytes : int
        Of the clips that this build encoded.
    seconds : float
    """

    library: str
    built: int = 0
    skipped: int = 0
    failed: list[Failure] = field(default_factory=list)
    frames: int = 0
    payload_bytes: int = 0
    seconds: float = 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers, strings and lists, ready for JSON."""
        return asdict(self)


def build_library(
    corpus: StrPath,
    library: StrPath,
    settings: BuildSettings,
    *,
    labels: StrPath | None = None,
    manifest: StrPath | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    strict: bool = False,
    index: bool | None = None,
    progress: Progress | None = None,
) -> BuildReport:
    """Build a library from a folder, or bring a library up to date with its folder.

    Clips that the library already holds, by the hash of their file and skeleton and with the same
    settings, are skipped. A changed file replaces its clip; a file that is gone keeps its clip.

    Parameters
    ----------
    corpus : path-like
        Folder with AMC (and ASF) and BVH files, at any depth.
    library : path-like
        The library's folder; made if missing.
    settings : BuildSettings
    labels, manifest : path-like, optional
        A CSV that says what the clips are. Else LABELS.csv in the corpus or beside it, else the
        names of the folders are the classes.
    jobs : int, optional
        Worker processes; as many as there are processors by default.
    scheduler : str, optional
        Address of a Dask scheduler whose workers do the work and see the same paths.
    strict : bool
        Whether the first bad file ends the build with its error.
    index : bool, optional
        Whether to make the library ready for queries and learn its classes, which takes about 11
        bytes for each frame of 120 fps; by default unless the library was built without before.
    progress : callable, optional

    Raises
    ------
    CorpusError
        If the folder cannot be read or holds no motion files, or the labels cannot be used.
    LibraryError
        If the library cannot be opened, is locked, or cannot be written.
    FormatError
        With `strict`, for the first bad file.
    """
    started = time.monotonic()
    root = Path(corpus)
    files = find_motion_files(root)
    known = corpus_labels(root, labels, manifest)
    report = BuildReport(str(library))
    with open_for_writing(Path(library), create=True) as catalogue:
        if index is None:
            index = bool(catalogue.feature_files()) or not catalogue.n_clips()
        plan = make_plan(catalogue, root, files, known, settings.to_json(), jobs)
        report.skipped = len(plan.kept)
        with catalogue.transaction():
            catalogue.update_clips(plan.updates)
        bases: ClassBases = {}
        if settings.codec.get("decorrelation") in {"auto", "class"}:
            from mocapdb.library.class_bases import learn_bases

            bases = learn_bases(catalogue, plan.tasks, progress)
        with (
            _Committer(catalogue, root, settings, report) as committer,
            closing(_encoded(plan.tasks, settings, bases, index, jobs, scheduler)) as answers,
        ):
            for failure in plan.failed:
                committer.reject(failure, strict)
            for done, answer in enumerate(answers, start=1):
                if isinstance(answer, Failure):
                    committer.reject(answer, strict)
                else:
                    committer.add(answer)
                if progress:
                    progress(done, len(plan.tasks), plan.tasks[done - 1].name)
        if index:
            from mocapdb.library.library import Library
            from mocapdb.library.retrieval import add_features

            with Library(library) as built:
                add_features(built, catalogue)  # of clips that an earlier build left out
    report.seconds = time.monotonic() - started
    return report


@contextmanager
def open_for_writing(folder: Path, *, create: bool = False) -> Iterator[Catalogue]:
    """Open a library as its only writer, cleared of what a writer that was stopped has left.

    Raises
    ------
    LibraryError
        If the folder is no library and may not be made one, or another process writes to it.
    """
    if not (folder / CATALOGUE_FILE).is_file():
        if not create:
            Catalogue.open(folder)  # says what is wrong
        _make_folder(folder)
    with writer_lock(folder):
        is_library = (folder / CATALOGUE_FILE).is_file()
        opened = Catalogue.open(folder, writable=True) if is_library else Catalogue.create(folder)
        with closing(opened) as catalogue:
            _remove_strays(folder, catalogue)
            try:
                yield catalogue
            finally:
                _remove_strays(folder, catalogue)


def _remove_strays(folder: Path, catalogue: Catalogue) -> None:
    remove_strays(folder / SHARDS_FOLDER, catalogue.shard_files())
    if (folder / FEATURES_FOLDER).is_dir():
        remove_strays(folder / FEATURES_FOLDER, catalogue.feature_files())


def _make_folder(folder: Path) -> None:
    """Make a library's folder, unless something else is in its place."""
    if folder.exists() and not folder.is_dir():
        raise LibraryError(f"{folder}: expected a folder for the library, but it is a file.")
    ours = {SHARDS_FOLDER, "writer.lock", "writer.json", f"{CATALOGUE_FILE}.partial"}
    if folder.is_dir() and {entry.name for entry in folder.iterdir()} - ours:
        raise LibraryError(
            f"{folder}: expected a library or an empty folder, but other files are in it. "
            "Name a new folder."
        )
    try:
        (folder / SHARDS_FOLDER).mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise LibraryError(f"{folder}: cannot make the library ({problem.strerror}).") from None


# -- workers ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Encoded:
    """What a worker returns: the payload, and the columns of the catalogue that it knows."""

    task: Task
    skeleton: Skeleton
    data: bytes
    columns: dict[str, Any]
    features: PackedMotion | None
    unmapped: str | None


def _encoded(
    tasks: Sequence[Task],
    settings: BuildSettings,
    bases: ClassBases,
    index: bool,
    jobs: int | None,
    scheduler: str | None,
) -> Generator[_Encoded | Failure]:
    """Yield the encoded clips in the order of the tasks, a few ahead of what is asked for."""
    from concurrent.futures.process import BrokenProcessPool

    from joblib import Parallel, delayed

    if not tasks:
        return
    workers = min(jobs, len(tasks)) if jobs else -1
    with _backend(scheduler):
        run = Parallel(n_jobs=workers, return_as="generator")
        with _children_deaf_to_interrupts():
            answers = run(
                delayed(_encode_file)(task, settings, _of_class(bases, task.label), index)
                for task in tasks
            )
        try:
            for answer in answers:  # noqa: UP028 - to be closed below, and quietly
                yield answer
        except BrokenProcessPool:
            raise LibraryError(
                "A worker process was killed, perhaps for want of memory. Build again with fewer "
                "--jobs: what is committed is safe."
            ) from None
        finally:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # that work is thrown away: so it shall be
                answers.close()


@contextmanager
def _children_deaf_to_interrupts() -> Iterator[None]:
    """Let the processes that are started here ignore Ctrl-C, which the terminal sends to all."""
    in_main_thread = threading.current_thread() is threading.main_thread()
    if not in_main_thread or signal.getsignal(signal.SIGINT) is None:  # not ours to change
        yield
        return
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)


@contextmanager
def _backend(scheduler: str | None) -> Iterator[None]:
    if scheduler is None:
        yield
        return
    try:
        import distributed
    except ImportError:
        raise MissingExtraError("distributed", "distributed") from None
    from joblib import parallel_config

    connect: Any = distributed.Client  # typed in some versions only
    try:
        client = connect(scheduler, timeout="10s")
    except (OSError, ValueError) as problem:
        raise LibraryError(f"{scheduler}: no Dask scheduler answers ({problem}).") from None
    with client, parallel_config("dask"):
        yield


def _of_class(bases: ClassBases, label: str | None) -> ClassBases:
    return {key: data for key, data in bases.items() if key[0] == label}


def _encode_file(
    task: Task, settings: BuildSettings, bases: ClassBases, index: bool
) -> _Encoded | Failure:
    """Read, encode and measure one file; runs in a worker process."""
    from mocapdb.compression import encode
    from mocapdb.io import read_clip
    from mocapdb.library.canonical_shards import packed_features

    try:
        clip = read_clip(
            task.path,
            skeleton=task.skeleton_path,
            fps=task.fps,
            drop_tpose=settings.drop_tpose,
        )
        options = settings.codec
        if bases:
            from mocapdb.library.class_bases import basis_for

            options = options | {"basis": basis_for(bases, task.label, clip.skeleton)}
        if options.get("decorrelation") == "class" and options.get("basis") is None:
            options = options | {"decorrelation": "lattice"}  # too few clips to learn one from
        payload = encode(clip, settings.target, **options)
    except MocapdbError as problem:
        return Failure.of(task.path, problem)
    except OSError as problem:
        return Failure(task.path, None, f"cannot read ({problem.strerror})")
    vertices = payload.error.vertices
    features, unmapped = packed_features(clip) if index else (None, None)
    return _Encoded(
        task,
        clip.skeleton,
        payload.data,
        {
            "frames": len(clip),
            "fps": clip.fps,
            "fps_source": task.fps_source or clip.fps_source,
            "frame_time_text": clip.frame_time_text,
            "provenance": json.dumps(clip.provenance),
            "source_bytes": Path(task.path).stat().st_size,
            "codec": payload.codec,
            "payload_bytes": len(payload.data),
            "skinned_error": payload.error.skinned,
            "error_mean_mm": vertices.mean,
            "error_p95_mm": vertices.p95,
            "error_max_mm": vertices.max,
        },
        features,
        unmapped,
    )


# -- the writer ------------------------------------------------------------------------------------


class _Committer:
    """Gathers encoded clips and commits them, a shard and a transaction at a time.

    Leaving the block commits what is left, also when it is left by an error or by Ctrl-C: what
    the workers have finished is kept.
    """

    def __init__(
        self, catalogue: Catalogue, root: Path, settings: BuildSettings, report: BuildReport
    ) -> None:
        self._catalogue = catalogue
        self._shards = catalogue.path.parent / SHARDS_FOLDER
        self._corpus = str(root.resolve())
        self._settings = settings.to_json()
        self._report = report
        self._waiting: list[_Encoded] = []
        self._since = time.monotonic()
        self._started = _now()
        self._build_id: int | None = None

    def add(self, clip: _Encoded) -> None:
        """Take a clip, and commit if enough has come together."""
        self._waiting.append(clip)
        size = sum(len(waiting.data) for waiting in self._waiting)
        if size >= COMMIT_BYTES or time.monotonic() - self._since >= COMMIT_SECONDS:
            self.commit()

    def reject(self, failure: Failure, strict: bool) -> None:
        """Note a bad file; with `strict`, end the build with its error."""
        self._report.failed.append(failure)
        if strict:
            raise failure.to_error()

    def commit(self) -> None:
        """Write the waiting clips as one shard and make them visible, all or none."""
        self._since = time.monotonic()
        if not self._waiting:
            return
        catalogue, waiting = self._catalogue, self._waiting
        shard = write_shard(
            self._shards,
            next_shard_number(self._shards),
            [clip.data for clip in waiting],
            [clip.task.sha256 for clip in waiting],
        )
        with catalogue.transaction():
            if self._build_id is None:
                self._build_id = catalogue.add_build(self._corpus, self._settings, self._started)
            shard_id = catalogue.add_shard(shard.file, shard.size, shard.sha256)
            replaced = [clip.task.replaces for clip in waiting if clip.task.replaces is not None]
            catalogue.bury(replaced, _now())
            indexed = []
            for row, clip in enumerate(waiting):
                clip_id = catalogue.add_clip(
                    clip.columns
                    | {
                        "name": clip.task.name,
                        "stem": Path(clip.task.relative).stem,
                        "label": clip.task.label,
                        "description": clip.task.description,
                        "skeleton_id": catalogue.add_skeleton(clip.skeleton),
                        "corpus": self._corpus,
                        "source": clip.task.relative,
                        "source_sha256": clip.task.sha256,
                        "settings": self._settings,
                        "shard_id": shard_id,
                        "shard_row": row,
                        "build_id": self._build_id,
                    }
                )
                if clip.features or clip.unmapped:
                    indexed.append((clip_id, clip.features, clip.unmapped))
            if indexed:
                from mocapdb.library.canonical_shards import commit_features

                commit_features(self._shards.parent, catalogue, indexed)
            self._waiting = []
        self._report.built += len(waiting)
        self._report.frames += sum(clip.columns["frames"] for clip in waiting)
        self._report.payload_bytes += sum(len(clip.data) for clip in waiting)

    def __enter__(self) -> _Committer:
        return self

    def __exit__(self, error: type[BaseException] | None, *_: object) -> None:
        self.commit()
        if self._build_id is not None and error is None:
            with self._catalogue.transaction():
                self._catalogue.finish_build(self._build_id, _now())


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
