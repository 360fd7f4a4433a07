"""Compiling ahead: most of what a first run waits for, shared among the processors.

Every job is done once, on a moment of walking, in a process of its own; what is compiled there
is kept for all that come later.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from mocapdb.compression.targets import Target

__all__ = ["compile_kernels"]

TARGET = Target("mean_mm", 1.0)


def compile_kernels(progress: Callable[[int, int, str], None]) -> None:
    """Compile the kernels of compression, queries, cleaning and cycles, those that are not yet."""
    from joblib import Parallel, delayed

    with TemporaryDirectory() as folder:
        run = Parallel(n_jobs=-1, return_as="generator_unordered")
        names = run(delayed(_do)(job, Path(folder, job.__name__)) for job in _JOBS)
        for i, name in enumerate(names):
            progress(i + 1, len(_JOBS), name)


def _do(job: Callable[[Path], None], folder: Path) -> str:
    folder.mkdir()
    job(folder)
    return job.__name__.strip("_")


def _compress(folder: Path) -> None:
    from mocapdb.compression import encode
    from mocapdb.corpus import synthetic
    from mocapdb.library import BuildSettings, Library, build_library, verify_library

    # the longest first: by then another process has compiled what reads files and finds features
    encode(synthetic.make_clip("walk", seed=0, duration_s=0.5), TARGET)
    _write_files(folder, duration_s=0.5)
    path = folder / "library.mocapdb"
    build_library(folder, path, BuildSettings(TARGET), jobs=1)
    with Library(path) as library:
        verify_library(library)


def _query(folder: Path) -> None:
    from mocapdb.library import BuildSettings, Library, Retrieval, build_library

    _write_files(folder)
    path = folder / "library.mocapdb"
    build_library(folder, path, BuildSettings(TARGET, {"codec": "raw"}), jobs=1)
    with Library(path) as library:
        Retrieval(library).query([library.clip("01_01")[30:150]], k=1)


def _clean(folder: Path) -> None:
    from mocapdb.cleaning import clean_clip, remove_foot_skate
    from mocapdb.corpus import synthetic

    clip = synthetic.make_clip("walk", seed=0, duration_s=2.0)
    faulty = synthetic.inject_faults(clip, seed=0, kinds=("offset",), size_deg=40, length_s=0.3)
    remove_foot_skate(clean_clip(faulty.clip).clip)


def _cycle(folder: Path) -> None:
    from mocapdb.corpus import synthetic
    from mocapdb.cycles.extract import extract_cycle
    from mocapdb.cycles.synthesis.loop import jerk, root_relative_positions

    found = extract_cycle(synthetic.make_clip("walk", seed=0, duration_s=4.0))
    jerk(root_relative_positions(found.loop().clip), found.clip.fps, closed=True)


def _write_files(folder: Path, duration_s: float = 2.0) -> None:
    from mocapdb.corpus import synthetic
    from mocapdb.io import write_clip
    from mocapdb.io.acclaim import write_amc, write_asf

    clip = synthetic.make_clip("walk", seed=0, duration_s=duration_s)
    write_asf(clip.skeleton, folder / "01.asf")
    write_amc(clip, folder / "01_01.amc")
    write_clip(clip, folder / "01_02.bvh")


_JOBS = (_compress, _query, _clean, _cycle)
