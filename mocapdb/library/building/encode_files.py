"""Encoding files in worker processes: what a worker does, and how its answers come back."""

from __future__ import annotations

import json
import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mocapdb.base.workers import on_workers
from mocapdb.errors import ClipError
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

__all__ = ["Encoded", "encode_clip", "encode_files"]


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
) -> Generator[list[Encoded] | Failure]:
    """Yield the encoded clips of each file, in the order of the tasks, a few ahead."""
    from mocapdb.library.building.class_bases import of_class

    orders = [(task, settings, of_class(bases, task.label), index) for task in tasks]
    seen = [Path(task.path) for task in tasks[:1]]
    return on_workers(_encode_file, orders, jobs=jobs, scheduler=scheduler, seen=seen)


def _encode_file(
    task: Task, settings: BuildSettings, bases: ClassBases, index: bool
) -> list[Encoded] | Failure:
    """Read, encode and measure one file; runs in a worker process.

    Whatever a file does, the answer is its clips or what is wrong with it: the others are built.
    """
    doing = "read"
    try:
        # clips with absurdly large numbers are refused below; each step would warn of them
        with np.errstate(over="ignore", invalid="ignore"):
            clips, source_bytes = _read(task, settings)
            doing = "encode"
            return [
                _encoded(replace(task, take=take), clip, source_bytes, settings, bases, index)
                for take, clip in clips
            ]
    except Exception as problem:
        return Failure.of(task.path, problem, doing=doing)


def _read(task: Task, settings: BuildSettings) -> tuple[list[tuple[str, Clip]], int]:
    """Return the clips of a file with their takes, and each one's share of the file's size."""
    from mocapdb.io.clip_files import read_takes
    from mocapdb.io.folder_settings import credited
    from mocapdb.io.tpose import without_tpose

    size = Path(task.path).stat().st_size
    clips = read_takes(task.path, task.reading)
    if task.folder_body is not None:
        clips = [(take, as_in_folder(clip, task.folder_body)) for take, clip in clips]
    if settings.drop_tpose:
        clips = [(take, without_tpose(clip)) for take, clip in clips]
    return [(take, credited(clip, task.by_settings)) for take, clip in clips], size // len(clips)


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
