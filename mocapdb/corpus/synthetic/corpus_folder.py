"""A synthetic corpus on disk, laid out like the CMU database."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from mocapdb.base.arrays import StrPath
from mocapdb.base.files import make_folder, replacing
from mocapdb.corpus.labels import LABELS_NAME
from mocapdb.corpus.synthetic.body import subject
from mocapdb.corpus.synthetic.known_clips import CLASSES, SEQUENCE, make_clip
from mocapdb.corpus.synthetic.motions import MOTIONS
from mocapdb.corpus.tuning import (
    CORPUS_DURATION_S,
    CORPUS_FPS,
    CORPUS_HEADING_DEG,
    CORPUS_JITTER,
    CORPUS_NOISE_DEG,
    CORPUS_SPEED,
)
from mocapdb.errors import CorpusError

__all__ = ["write_corpus"]

COLUMNS = ("clip", "label", "description", "fps", "format", "path", "skeleton")
DECIMALS = 6  # of the numbers in AMC files, as in CMU's


def write_corpus(
    directory: StrPath,
    *,
    subjects: int = 3,
    clips_per_class: int = 1,
    bvh_clips: int = 2,
    seed: int = 0,
) -> list[Path]:
    """Write a labelled corpus as ASF, AMC and BVH files.

    Parameters
    ----------
    directory : path-like
        Where to; made if need be. Files that are there are replaced.
    subjects : int
        Bodies of different height and proportions.
    clips_per_class : int
        Clips of each class for each subject. There is one sequence for each subject besides.
    bvh_clips : int
        How many of the sequences are written as BVH instead of AMC.
    seed : int

    Returns
    -------
    list of Path
        The motion files, in the order of the label file: ``01/01_01.amc`` with the skeleton
        ``01/01.asf``, and ``bvh/01_07.bvh``. The labels are in ``LABELS.csv``.

    Raises
    ------
    CorpusError
        If there is nothing to write, or the folder cannot be made.
    FormatError
        If a file cannot be written.
    """
    from mocapdb.io import write_clip
    from mocapdb.io.acclaim import write_amc, write_asf

    if subjects < 1 or clips_per_class < 1:
        raise CorpusError(
            f"Expected a subject and a clip of each class at least, but got {subjects} and "
            f"{clips_per_class}."
        )
    root = Path(directory)
    rng = np.random.default_rng(seed)
    kinds = [*(kind for kind in CLASSES for _ in range(clips_per_class)), SEQUENCE]
    rows: list[tuple[str, ...]] = []
    paths: list[Path] = []
    for number in range(1, subjects + 1):
        person = f"{number:02d}"
        skeleton = subject(int(rng.integers(2**31))).renamed(person)
        _make_folder(root / person)
        write_asf(skeleton, root / person / f"{person}.asf")
        for trial, kind in enumerate(kinds, start=1):
            clip = make_clip(
                kind,
                seed=int(rng.integers(2**31)),
                skeleton=skeleton,
                duration_s=float(rng.uniform(*CORPUS_DURATION_S)) * (2 if kind == SEQUENCE else 1),
                speed=float(rng.uniform(*CORPUS_SPEED)),
                heading_deg=float(rng.uniform(-CORPUS_HEADING_DEG, CORPUS_HEADING_DEG)),
                sensor_noise_deg=CORPUS_NOISE_DEG,
                period_jitter=CORPUS_JITTER,
                fps=CORPUS_FPS,
                name=f"{person}_{trial:02d}",
            )
            as_bvh = kind == SEQUENCE and number <= bvh_clips
            suffix = "bvh" if as_bvh else "amc"
            path = root / ("bvh" if as_bvh else person) / f"{clip.name}.{suffix}"
            if as_bvh:
                _make_folder(path.parent)
                write_clip(clip, path)
            else:
                write_amc(clip, path, decimals=DECIMALS)
            paths.append(path)
            rows.append(
                (
                    clip.name,
                    kind,
                    MOTIONS[kind].description if kind in MOTIONS else "several classes in turn",
                    f"{CORPUS_FPS:g}",
                    suffix,
                    path.relative_to(root).as_posix(),
                    "" if as_bvh else f"{person}/{person}.asf",
                )
            )
    _write_table(root / LABELS_NAME, rows)
    return paths


def _make_folder(folder: Path) -> None:
    try:
        make_folder(folder)
    except OSError as problem:
        raise CorpusError(
            f"Expected to make the folder {folder}, but got: {problem.strerror}."
        ) from None


def _write_table(path: Path, rows: list[tuple[str, ...]]) -> None:
    with (
        replacing(path, failed=_cannot_write) as (temporary,),
        temporary.open("w", newline="", encoding="utf-8") as file,
    ):
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows])


def _cannot_write(path: Path, problem: OSError) -> CorpusError:
    return CorpusError(f"Expected to write {path}, but got: {problem.strerror}.")
