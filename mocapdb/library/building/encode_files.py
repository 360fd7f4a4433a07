"""Encoding files in worker processes: what a worker does, and how its answers come back."""

from __future__ import annotations

import json
import math
import signal
import threading
import warnings
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mocapdb.errors import ClipError, LibraryError, MissingExtraError
from mocapdb.library.building.folder_bodies import as_in_folder
from mocapdb.library.building.plan import Failure, Task
from mocapdb.library.building.settings import BuildSettings
from mocapdb.motion.body import Given, understand
from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import Skeleton

if TYPE_CHECKING:
    from mocapdb.compression.payload import Payload
    from mocapdb.library.building.class_bases import ClassBases
    from mocapdb.library.searching.canonical_shards import PackedMotion

__all__ = ["Encoded", "children_ignore_interrupts", "encode_clip", "encode_files"]


@dataclass(frozen=True)
class Encoded:
    """What a worker returns: the payload, and the columns of the catalogue that it knows."""

    task: Task
    skeleton: Skeleton
    data: bytes
    columns: dict[str, Any]
    features: PackedMotion | None
    unmapped: str | None
    joint_errors: bytes


def encode_files(
    tasks: Sequence[Task],
    settings: BuildSettings,
    bases: ClassBases,
    index: bool,
    jobs: int | None,
    scheduler: str | None,
) -> Generator[Encoded | Failure]:
    """Yield the encoded clips in the order of the tasks, a few ahead of what is asked for."""
    if not tasks:
        return
    from concurrent.futures.process import BrokenProcessPool

    from joblib import Parallel, delayed

    from mocapdb.library.building.class_bases import of_class

    workers = min(jobs, len(tasks)) if jobs else -1
    with _backend(scheduler):
        run = Parallel(n_jobs=workers, return_as="generator")
        work = delayed(_encode_file)
        with children_ignore_interrupts():
            answers = run(
                work(task, settings, of_class(bases, task.label), index) for task in tasks
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
def children_ignore_interrupts() -> Iterator[None]:
    """Start processes that ignore Ctrl-C, which the terminal sends to all of them."""
    in_main_thread = threading.current_thread() is threading.main_thread()
    if not in_main_thread or signal.getsignal(signal.SIGINT) is None:  # it cannot be set
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


def _encode_file(
    task: Task, settings: BuildSettings, bases: ClassBases, index: bool
) -> Encoded | Failure:
    """Read, encode and measure one file; runs in a worker process.

    Whatever a file does, the answer is its clip or what is wrong with it: the others are built.
    """
    doing = "read"
    try:
        # clips with absurdly large numbers are refused below; each step would warn of them
        with np.errstate(over="ignore", invalid="ignore"):
            clip, source_bytes = _read(task, settings)
            doing = "encode"
            return _encoded(task, clip, source_bytes, settings, bases, index)
    except Exception as problem:
        return Failure.of(task.path, problem, doing=doing)


def _read(task: Task, settings: BuildSettings) -> tuple[Clip, int]:
    """Return the clip of a file, and the file's size."""
    from mocapdb.io import read_clip
    from mocapdb.io.folder_settings import credited
    from mocapdb.io.tpose import without_tpose

    size = Path(task.path).stat().st_size
    clip = read_clip(task.path, task.reading)
    if task.folder_body is not None:
        clip = as_in_folder(clip, task.folder_body)
    if settings.drop_tpose:
        clip = without_tpose(clip)
    return credited(clip, task.by_settings), size


def _encoded(
    task: Task,
    clip: Clip,
    source_bytes: int,
    settings: BuildSettings,
    bases: ClassBases,
    index: bool,
) -> Encoded:
    """Return a clip encoded and measured.

    Raises
    ------
    Exception
        Of any kind: what a clip's numbers can do to a codec is not foreseen.
    """
    from mocapdb.library.joint_losses import pack_losses
    from mocapdb.library.searching.canonical_shards import packed_features

    payload = encode_clip(clip, task.label, settings, bases)
    vertices = payload.error.vertices
    features, unmapped = packed_features(clip) if index else (None, None)
    body = understand(
        clip.skeleton, clip.channels, Given(clip.skeleton.metres_per_unit, clip.skeleton.up)
    )
    return Encoded(
        task,
        clip.skeleton,
        payload.data,
        {
            "frames": len(clip),
            "unit_m": clip.skeleton.metres_per_unit,
            "unit_source": clip.unit_source,
            "up": clip.skeleton.up,
            "up_source": clip.up_source,
            "body": "by " + body.by if body.is_human else "none",
            "height_m": body.height_m if math.isfinite(body.height_m) else None,
            "fps": clip.fps,
            "fps_source": task.fps_source or clip.fps_source,
            "frame_time_text": clip.frame_time_text,
            "provenance": json.dumps(clip.provenance),
            "source_bytes": source_bytes,
            "codec": payload.codec,
            "payload_bytes": len(payload.data),
            "skinned_error": payload.error.skinned,
            "error_mean_mm": vertices.mean,
            "error_p95_mm": vertices.p95,
            "error_max_mm": vertices.max,
        },
        features,
        unmapped,
        pack_losses(payload.joints),
    )


def encode_clip(
    clip: Clip, label: str | None, settings: BuildSettings, bases: ClassBases
) -> Payload:
    """Encode a clip of a class as a library's settings say, with what the class shares.

    Raises
    ------
    ClipError
        If no error can be measured.
    CodecError
        If the codec cannot take the clip.
    """
    from mocapdb.compression import encode

    options = settings.codec
    if bases:
        from mocapdb.library.building.class_bases import basis_for

        options = options | {"basis": basis_for(bases, label, clip.skeleton, settings)}
    if options.get("decorrelation") == "class" and not options.get("basis"):
        options = options | {"decorrelation": None}  # too few clips to learn one from
    payload = encode(clip, settings.target, **options)
    if not math.isfinite(payload.error.skinned + payload.error.vertices.max):
        raise ClipError(
            "Expected lengths of a body's size, but got some so large that no error can be "
            "measured. Look at its OFFSETs and positions."
        )
    return payload
