"""From a folder of motion files to a library: streaming, in parallel, resumable.

A file is read, encoded and measured by a worker; one writer, this process, gathers what the workers
return and commits it shard by shard. Killed at any moment, a build loses at most the clips since
the last commit, and the next build goes on from there.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mocapdb.base.arrays import StrPath
from mocapdb.base.progress import Progress, silent
from mocapdb.errors import LibraryError
from mocapdb.io.reading import ReadOptions
from mocapdb.library.building.assumptions import assumptions
from mocapdb.library.building.changed_files import Inputs, changed_files, keep_plan
from mocapdb.library.building.commit_clips import BuildReport, Committer
from mocapdb.library.building.corpus_labels import CorpusLabels
from mocapdb.library.building.corpus_listing import CorpusListing
from mocapdb.library.building.encode_files import encode_files
from mocapdb.library.building.known_files import KnownFiles
from mocapdb.library.building.plan import Failure, make_plan
from mocapdb.library.building.settings import BuildSettings
from mocapdb.library.building.takes import placed
from mocapdb.library.layout import is_library
from mocapdb.library.library import Library
from mocapdb.library.writing.open_for_writing import open_for_writing

if TYPE_CHECKING:
    from mocapdb.library.building.class_bases import ClassBases

__all__ = ["build_library"]


def build_library(
    corpus: StrPath,
    library: StrPath,
    settings: BuildSettings,
    *,
    labels: StrPath | None = None,
    manifest: StrPath | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    reading: ReadOptions | None = None,
    names: str | None = None,
    strict: bool = False,
    index: bool | None = None,
    clean: bool = False,
    only: Callable[[str], bool] | None = None,
    rehash: bool = False,
    progress: Progress = silent,
) -> BuildReport:
    """Build a library from a folder, or bring a library up to date with its folder.

    Clips that the library already holds, by the hash of their file and skeleton and with the same
    settings, are skipped. A changed file replaces its clip; a file that is gone keeps its clip.

    Parameters
    ----------
    corpus : path-like
        Folder with AMC (and ASF), BVH, NPZ and glTF files, at any depth, also behind links to
        folders; and FBX, Collada and USD files, where there is a Blender. Each take of a file is
        a clip.
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
    reading : ReadOptions, optional
        What is said of all files; it wins over the ``mocapdb.toml`` of a folder.
    names : str, optional
        What names say, such as ``"{label}_{take}"``: see `mocapdb.corpus.name_patterns`. It wins
        over ``names`` in a ``mocapdb.toml``. A file that it does not fit is a bad file.
    strict : bool
        Whether nothing is mended, and the first bad file ends the build with its error.
    index : bool, optional
        Whether to make the library ready for queries and learn its classes, which takes about 11
        bytes for each frame of 120 fps; by default unless the library was built without before.
    clean : bool
        Whether to search all clips for faults afterwards and to keep what is repaired beside each
        clip as it was captured; see `clean_library`.
    only : callable, optional
        Tells of a file, by its path from the corpus with ``/``, whether it is looked at.
    rehash : bool
        Whether to read also files that look as they did when they were read last: whose size,
        times and number in the file system are the same (docs/scale.md).
    progress : callable, optional

    Raises
    ------
    CorpusError
        If the folder cannot be read or holds no motion files, or the labels, a pattern of names or
        the settings of a folder cannot be used.
    LibraryError
        If the library cannot be opened, is locked, or cannot be written.
    WorkerError
        If a worker is killed, or the cluster cannot do the work.
    FormatError
        With `strict`, for the first bad file.

    Examples
    --------
    >>> from mocapdb import BuildSettings, Target
    >>> from mocapdb.corpus import synthetic
    >>> from mocapdb.io import write_clip
    >>> for seed, name in enumerate(["07_01.bvh", "07_02.bvh"]):
    ...     _ = write_clip(synthetic.make_clip("walk", seed=seed, duration_s=1), name)
    >>> settings = BuildSettings(Target("max_mm", 5.0))
    >>> build_library(".", "small.mocapdb", settings, jobs=1, index=False).built
    2
    >>> again = build_library(".", "small.mocapdb", settings, jobs=1)
    >>> again.built, again.skipped
    (0, 2)
    """
    started = time.monotonic()
    root = Path(corpus)
    reading = reading or ReadOptions()
    listing = CorpusListing(root, only, reading.blender)
    reading = replace(reading, strict=strict or reading.strict)
    said = CorpusLabels(root, labels, manifest)
    known = KnownFiles(root, reading, names, said.read)
    inputs = Inputs(settings, reading, names, said)
    report = BuildReport(str(library))
    if not is_library(library):  # none is made where there is nothing to build
        _ = listing.files, known.label_source
    with open_for_writing(Path(library), create=True) as catalogue:
        if index is None:
            index = catalogue.is_indexed() or not catalogue.n_clips()
        changed = None
        if listing.is_whole and not rehash:
            changed = changed_files(catalogue, root, listing, known, inputs)
        plan = make_plan(
            catalogue,
            root,
            listing,
            known,
            settings,
            jobs,
            changed,
            rehash=rehash,
            scheduler=scheduler,
        )
        report.skipped, report.hashed = plan.n_kept, plan.n_hashed
        if plan.updates or plan.seen:
            with catalogue.transaction():
                catalogue.update_clips(plan.updates)
                catalogue.keep_seen(plan.seen)
        failed = {*plan.left_out}
        bases: ClassBases = {}
        if settings.shares_axes:
            from mocapdb.library.building.class_bases import learn_bases

            bases = learn_bases(catalogue, plan.tasks, settings, progress)
        with (
            Committer(catalogue, root, settings, report) as committer,
            closing(encode_files(plan.tasks, settings, bases, index, jobs, scheduler)) as answers,
        ):
            for failure in plan.failed:
                committer.reject(failure, strict)
            taken = set(plan.names)
            for done, answer in enumerate(answers, start=1):
                if isinstance(answer, Failure):
                    failed.add(plan.tasks[done - 1].relative)
                    committer.reject(answer, strict)
                else:
                    for clip in placed(answer, known, taken):
                        committer.add(clip)
                progress(done, len(plan.tasks), plan.tasks[done - 1].name)
        if listing.is_whole:
            unused = keep_plan(catalogue, root, plan.folders, failed, known, inputs, plan.part)
        else:
            unused = known.unused()
        if clean:
            from mocapdb.library.building.revise_clips import revise_clips

            with Library(library) as built:
                report.cleaned = revise_clips(
                    built, catalogue, jobs=jobs, scheduler=scheduler, progress=progress
                )
        if index:
            from mocapdb.library.searching.learned_classes import clips_not_learned
            from mocapdb.library.upkeep.index import add_features

            with Library(library) as built:
                # also for clips of earlier builds
                add_features(built, catalogue, scheduler=scheduler)
                report.not_learned = clips_not_learned(catalogue)
        if report.built:
            from mocapdb.library.upkeep.compact import join_small_shards

            try:
                report.joined = join_small_shards(catalogue, shortly=True)
            except LibraryError as problem:  # what was built is safe all the same
                report.not_joined = str(problem)
        warnings = [*listing.warnings, *plan.warnings, *unused.warnings()]
        place = str(root.resolve())
        report.assumed = assumptions(catalogue, place, listing.left_alone, warnings)
    report.seconds = time.monotonic() - started
    return report
