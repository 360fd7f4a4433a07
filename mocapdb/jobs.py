"""The jobs, one call each, as ``mocapdb.clean`` and so on.

Each is the shortest way to a package that does the job, and returns what that returns; what the
short way does not set is set there.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mocapdb.base.arrays import StrPath
from mocapdb.base.progress import Progress
from mocapdb.errors import ClipError

if TYPE_CHECKING:
    from mocapdb.cleaning import Cleaned
    from mocapdb.cycles import Extraction
    from mocapdb.indexing import Classification
    from mocapdb.library import Hit, Library
    from mocapdb.motion.clip import Clip
    from mocapdb.segmentation import Segmentation

__all__ = ["classify", "clean", "cycle", "fill", "query", "segment", "write_clip"]


def clean(clip: Clip | StrPath, context: Iterable[Clip] = (), **options: Any) -> Cleaned:
    """Find the faults of a capture and repair only those; see `mocapdb.cleaning.clean_clip`.

    Parameters
    ----------
    clip : Clip or path-like
    context : iterable of Clip
        Other clips of the same joints, to find similar motion in.
    **options
        Those of `mocapdb.cleaning.clean_clip`.

    Returns
    -------
    Cleaned
        ``clip`` is the repaired one, ``repairs`` say what was done, ``digression_map.spans`` what
        was found.

    Examples
    --------
    >>> import mocapdb
    >>> from mocapdb.corpus import synthetic
    >>> take = synthetic.inject_faults(synthetic.make_clip("walk", seed=1), seed=1, n=1).clip
    >>> len(mocapdb.clean(take).repairs)
    1
    """
    from mocapdb.cleaning import clean_clip

    return clean_clip(_clip(clip), context, **options)


def fill(clip: Clip | StrPath, known: Sequence[str], context: Iterable[Clip]) -> Clip:
    """Make a whole body from a few joints, by similar motion; see `mocapdb.cleaning.fill_joints`.

    Parameters
    ----------
    clip : Clip or path-like
    known : sequence of str
        The joints that were captured.
    context : iterable of Clip
        Clips that have all joints.
    """
    from mocapdb.cleaning import fill_joints

    return fill_joints(_clip(clip), known, context)


def cycle(clip: Clip | StrPath, settings: Any = None) -> Extraction:
    """Find the cycle of a clip; see `mocapdb.cycles.extract_cycle`.

    Parameters
    ----------
    clip : Clip or path-like
    settings : mocapdb.cycles.Settings, optional

    Returns
    -------
    Extraction
        ``cycle`` is the closed lap, of which `mocapdb.cycles.make_loop` makes a clip;
        ``confidence`` says how sure it is.

    Examples
    --------
    >>> import mocapdb
    >>> from mocapdb.corpus import synthetic
    >>> found = mocapdb.cycle(synthetic.make_clip("walk", seed=1))
    >>> bool(0.8 < found.cycle.period_s < 1.5)
    True
    """
    from mocapdb.cycles import extract_cycle

    return extract_cycle(_clip(clip), settings)


def segment(clip: Clip | StrPath) -> Segmentation:
    """Cut a long take, or its file, into motions; see `mocapdb.segmentation.segment_clip`."""
    from mocapdb.segmentation import segment_clip

    return segment_clip(_clip(clip))


def write_clip(
    clip: Clip,
    path: StrPath,
    *,
    blender: StrPath | None = None,
    progress: Progress | None = None,
) -> Clip:
    """Write a clip in any format that ``mocapdb convert`` writes, by the path's suffix.

    AMC with its ASF, BVH, NPZ, CSV and FBX are written by `mocapdb.io.write_clip`; ``.glb``, and
    the animated pictures ``.gif``, ``.mp4`` and ``.html``, by `mocapdb.scenes.write_animation`.

    Parameters
    ----------
    clip : Clip
    path : path-like
        The file; its suffix decides, in either case.
    blender : path-like, optional
        What writes an FBX: see `mocapdb.io.blender`.
    progress : callable, optional
        Called with pictures drawn, pictures in all, and the file's name.

    Returns
    -------
    Clip
        As it was written: its provenance says what was converted.

    Raises
    ------
    FormatError
        If the suffix is none of the formats, or the file cannot be written.
    SkeletonError
        If the format cannot hold the skeleton.
    """
    from mocapdb.io import write_clip
    from mocapdb.io.find_files import DRAWN_SUFFIXES

    if Path(path).suffix.lower() not in DRAWN_SUFFIXES:
        return write_clip(clip, path, blender=blender)
    from mocapdb.scenes.animation import write_animation

    write_animation(clip, path, progress=progress)
    return clip


def query(
    library: Library | StrPath, example: Clip | StrPath, *, k: int = 10, **options: Any
) -> list[Hit]:
    """Find the stretches of a library that are like a clip, the nearest first.

    Parameters
    ----------
    library : Library or path-like
    example : Clip, str or path-like
        A clip, a motion file, or the name of a clip of the library.
    k : int
        How many hits.
    **options
        Those of `mocapdb.library.Retrieval.query`.
    """
    with _opened(library) as opened:
        return opened.query(_clip_or_name(example), k=k, **options)


def classify(library: Library | StrPath, example: Clip | StrPath) -> Classification:
    """Say which of a library's classes a clip is, or that it is none of them.

    Parameters
    ----------
    library : Library or path-like
    example : Clip, str or path-like
        A clip, a motion file, or the name of a clip of the library.
    """
    with _opened(library) as opened:
        return opened.classify(_clip_or_name(example))


def _opened(library: Library | StrPath) -> AbstractContextManager[Library]:
    from mocapdb.library import Library

    return nullcontext(library) if isinstance(library, Library) else Library(library)


def _clip_or_name(example: Clip | StrPath) -> Clip | str:
    from mocapdb.io import read_clip
    from mocapdb.motion.clip import Clip

    if isinstance(example, Clip):
        return example
    return read_clip(example) if Path(example).is_file() else str(example)


def _clip(clip: Clip | StrPath) -> Clip:
    from mocapdb.io import read_clip
    from mocapdb.motion.clip import Clip

    if isinstance(clip, Clip):
        return clip
    if isinstance(clip, str | PathLike):
        return read_clip(clip)
    raise ClipError(f"Expected a clip or a motion file, but got a {type(clip).__name__}.")
