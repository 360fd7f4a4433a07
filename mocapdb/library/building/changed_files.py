"""Which files of a corpus have to be planned: those that look otherwise than at the last build.

The catalogue keeps what that build went by (its settings, what folders and labels say), a digest of
each folder in which every file has its clip, and the clips that something else has changed since. A
folder with the same digest is passed over; of any other the files are compared with their clips.
What a build holds in memory for that is one folder, and those that differ.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from mocapdb import __version__
from mocapdb.base.arrays import StrPath
from mocapdb.io.find_files import SCENE_SUFFIXES
from mocapdb.io.reading import ReadOptions
from mocapdb.library.building.corpus_labels import CorpusLabels
from mocapdb.library.building.corpus_listing import CorpusListing, path_in
from mocapdb.library.building.file_states import FileStates
from mocapdb.library.building.known_files import KnownFiles, Unused
from mocapdb.library.building.settings import BuildSettings
from mocapdb.library.catalogue import Catalogue
from mocapdb.library.naming import file_and_take, stem_of, suffix_of
from mocapdb.library.writing.catalogue_writer import CatalogueWriter
from mocapdb.motion.skeleton import Skeleton

__all__ = ["Changed", "Inputs", "Looks", "SeenClip", "changed_files", "keep_plan"]

Looks = dict[str, str | None]
"""How the files of a folder look, by name; see `FileStates`."""


class SeenClip(NamedTuple):
    """A clip whose file looks as it did."""

    id: int
    state: str | None
    bones: str | None


@dataclass(frozen=True)
class Inputs:
    """What a build goes by beside the files and clips: a plan holds as long as it is the same.

    Parameters
    ----------
    settings : BuildSettings
    reading : ReadOptions
    names : str, optional
    labels : CorpusLabels
    """

    settings: BuildSettings
    reading: ReadOptions
    names: str | None
    labels: CorpusLabels

    def digest(self, said: Collection[str]) -> str | None:
        """Return what tells them from all others, with what the settings of folders say.

        None where that cannot be known.
        """
        labels = self.labels.digest()
        if labels is None:
            return None
        how = self.settings.to_json(self.reading)
        skeleton = self.reading.skeleton
        skeleton = getattr(skeleton, "digest", skeleton)  # a path, or what it holds
        told = [__version__, how, str(skeleton), self.reading.strict, self.names, labels]
        return _digest([json.dumps(told), *sorted(said)])


@dataclass(frozen=True)
class Changed:
    """What has to be planned.

    Attributes
    ----------
    files : list of str
        Files to plan, by their path from the root.
    stems : set of str
        Stems of all clips whose names may change.
    n_same : int
        How many clips stay as they are without.
    beside : mapping of str to SeenClip
        The other files of the folders of `files`.
    folders : mapping of str to Looks
        Folders that do not look as they did.
    inputs : str
    unused : Unused
        Of what the build went by, before these files.
    """

    files: list[str]
    stems: set[str]
    n_same: int
    beside: Mapping[str, SeenClip]
    folders: Mapping[str, Looks]
    inputs: str
    unused: Unused


@dataclass
class _Walk:
    """What a walk through a corpus has come across."""

    said: set[str] = field(default_factory=set)
    n_planned: int = 0
    n_same: int = 0
    folders: dict[str, Looks] = field(default_factory=dict)


def changed_files(
    catalogue: Catalogue,
    root: Path,
    listing: CorpusListing,
    known: KnownFiles,
    inputs: Inputs,
) -> Changed | None:
    """Compare a corpus with what the last build has left; None where all has to be planned.

    That is so at first; if what a build goes by has changed, a folder has gone, a file of several
    takes is new or changed, or a file has gone while labels or patterns speak of files.
    """
    corpus = str(root.resolve())
    before = catalogue.plan(corpus)
    unplanned = catalogue.unplanned()
    if before is None or (None, None, None) in unplanned:
        return None
    again = {
        file_and_take(source)[0]
        for place, source, _ in unplanned
        if place == corpus and source is not None
    }
    walk = _walk(catalogue, root, listing, known, {file.rpartition("/")[0] for file in again})
    digest = inputs.digest(walk.said)
    if digest != before[0] or walk.n_planned != catalogue.n_planned_folders(corpus):
        return None
    unused = Unused.of_json(before[1])
    files: list[str] = []
    beside: dict[str, SeenClip] = {}
    n_same = walk.n_same
    for folder, looks in walk.folders.items():
        clips = _clips_of(catalogue, corpus, folder)
        for name, state in looks.items():
            file = path_in(folder, name)
            own = clips.pop(file, [])
            if file in again or state is None or not own or any(c.state != state for c in own):
                files.append(file)
            else:
                beside[file] = own[0]
                n_same += len(own)
        if clips and (unused.n_rows or any(walk.said)):
            return None
    if any(suffix_of(file) in SCENE_SUFFIXES for file in files):
        return None
    stems = {stem for _, _, stem in unplanned if stem is not None} | set(map(stem_of, files))
    return Changed(sorted(files), stems, n_same, beside, walk.folders, digest, unused)


def _walk(
    catalogue: Catalogue,
    root: Path,
    listing: CorpusListing,
    known: KnownFiles,
    again: Collection[str],
) -> _Walk:
    """Look at every file; keep what differs, and the folders in `again`."""
    corpus = str(root.resolve())
    states = FileStates(root)
    walk = _Walk()

    def skeleton_of(file: str) -> Skeleton | StrPath | None:
        return known.reading(file).skeleton

    for folder, names in listing.folders():
        walk.said.add(known.said_in(folder))
        looks = states.of_folder(folder, names, skeleton_of)
        planned = catalogue.planned_folder(corpus, folder)
        walk.n_planned += planned is not None
        if planned is None or folder in again or planned[0] != _digest_of(looks):
            walk.folders[folder] = looks
        else:
            walk.n_same += planned[1]
    return walk


def keep_plan(
    catalogue: CatalogueWriter,
    root: Path,
    folders: Mapping[str, Looks],
    failed: Collection[str],
    known: KnownFiles,
    inputs: Inputs,
    part: Changed | None,
) -> Unused:
    """Keep what a build went by, and the digests of the folders that are as it planned them.

    Parameters
    ----------
    catalogue : CatalogueWriter
    root : Path
        The corpus.
    folders : mapping of str to Looks
        What was planned.
    failed : collection of str
        Files that no clip could be made of, by their path from the root.
    known : KnownFiles
    inputs : Inputs
    part : Changed, optional
        What was planned, if it was not all of the corpus.

    Returns
    -------
    Unused
        What was said of files that are not there.
    """
    corpus = str(root.resolve())
    digest = inputs.digest({*map(known.said_in, folders)}) if part is None else part.inputs
    unused = known.unused() if part is None or part.files else part.unused
    if part is not None:
        unused = part.unused.but_for(unused)
    if digest is None or (part is not None and not (part.folders or part.stems)):
        return unused
    failing = {file.rpartition("/")[0] for file in failed}
    every = _by_folder(catalogue, corpus) if part is None else {}
    planned: dict[str, tuple[str, int] | None] = {}
    for folder, looks in folders.items():
        clips = every.get(folder, {}) if part is None else _clips_of(catalogue, corpus, folder)
        own = [(clips.get(path_in(folder, name), []), state) for name, state in looks.items()]
        as_planned = folder not in failing and all(
            state is not None and here and all(clip.state == state for clip in here)
            for here, state in own
        )
        n_clips = sum(len(here) for here, _ in own)
        planned[folder] = (_digest_of(looks), n_clips) if as_planned else None
    with catalogue.transaction():
        catalogue.keep_plan(corpus, digest, unused.to_json(), planned, only_these=part is None)
    return unused


def _clips_of(catalogue: Catalogue, corpus: str, folder: str) -> dict[str, list[SeenClip]]:
    """Return the clips of the files of a folder."""
    found: dict[str, list[SeenClip]] = {}
    for source, clip_id, state, bones in catalogue.clips_of_files(corpus, folder):
        own = found.setdefault(file_and_take(source)[0], [])
        own.append(SeenClip(clip_id, state, bones))
    return found


def _by_folder(catalogue: Catalogue, corpus: str) -> dict[str, dict[str, list[SeenClip]]]:
    """Return the clips of all files of a corpus."""
    found: dict[str, dict[str, list[SeenClip]]] = {}
    for source, clip_id, state, bones in catalogue.clips_of_files(corpus):
        file = file_and_take(source)[0]
        here = found.setdefault(file.rpartition("/")[0], {})
        here.setdefault(file, []).append(SeenClip(clip_id, state, bones))
    return found


def _digest_of(looks: Looks) -> str:
    """Return a digest of how a folder looks; one that fits nothing where a file does not tell."""
    if None in looks.values():
        return ""
    return _digest(f"{name}\0{state}" for name, state in looks.items())


def _digest(lines: Iterable[str]) -> str:
    text = "\n".join(lines).encode("utf-8", "surrogateescape")
    return hashlib.sha256(text).hexdigest()[:32]
