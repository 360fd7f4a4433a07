"""Queries by example and classification over a library."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from mocapdb.base.arrays import BoolArray
from mocapdb.errors import ClipError, LibraryError
from mocapdb.indexing.canonical.canonical_motion import FPS, CanonicalMotion, canonical_motion
from mocapdb.indexing.search.body_parts import index_of_part, part_joints
from mocapdb.indexing.search.clip_search import search_clips
from mocapdb.indexing.search.example_query import Query
from mocapdb.indexing.search.features import Weights
from mocapdb.indexing.search.frame_store import MotionIndex, index_of
from mocapdb.indexing.search.stretch_search import Stretch, search
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.library import Library
from mocapdb.library.searching.search_index import (
    StoredMotions,
    make_index,
    open_index,
    open_models,
)
from mocapdb.motion.clip import Clip
from mocapdb.motion.frame_range import FrameRange

if TYPE_CHECKING:
    from mocapdb.indexing.recognition.class_models import Classification, ClassIndex

__all__ = ["Filter", "Hit", "Retrieval"]


@dataclass(frozen=True)
class Filter:
    """Which clips to search; every part that is given must fit.

    Attributes
    ----------
    label, subject, text : str, optional
        The clip's class, who performs it (see `subject_of`), words as in ``mocapdb ls --search``.
    not_clips, not_subjects : sequence of str
        Names of clips, and subjects, to leave out.
    where : mapping of str to str
        Values of further columns of the labels.
    """

    label: str | None = None
    subject: str | None = None
    text: str | None = None
    not_clips: Sequence[str] = ()
    not_subjects: Sequence[str] = ()
    where: Mapping[str, str] = field(default_factory=dict, hash=False)


@dataclass(frozen=True)
class Hit(FrameRange):
    """A stretch of a library's clip: frames ``start:end`` at the clip's own rate.

    Attributes
    ----------
    start, end : int
    record : ClipRecord
    distance : float
        0 for the same motion, about 1 for any.
    time_scale : float
        Duration over that of the example: 2 is half as fast.
    stretch : Stretch
        The same at the rate of the index, with the frames matched.
    """

    record: ClipRecord
    distance: float
    time_scale: float
    stretch: Stretch

    @property
    def start_s(self) -> float:
        """Where it starts, in seconds."""
        return self.start / self.record.fps

    @property
    def end_s(self) -> float:
        """Where it ends, in seconds."""
        return self.end / self.record.fps


class Retrieval:
    """A library to search by example and to classify with (docs/query.md).

    Parameters
    ----------
    library : Library
        It stays open for as long as it is searched.

    Attributes
    ----------
    motions : StoredMotions
        The canonical motion of each clip that can be searched.
    index : MotionIndex
        The same as frames of the search. Clips that were cleaned are in it by their cleaned motion,
        or, in a library opened with ``original=True``, as they were captured. Classes are always
        learned from the cleaned motion.

    Raises
    ------
    LibraryError
        If the library is empty, or has no features.
    """

    def __init__(self, library: Library) -> None:
        self._library = library
        catalogue = library.catalogue
        if not catalogue.n_clips():
            raise LibraryError(f"{library.path}: the library is empty. Build clips into it first.")
        places = catalogue.feature_places()
        if not places:
            problems = catalogue.feature_problems()
            if problems:
                name, problem = next(iter(problems.items()))
                raise LibraryError(
                    f"{library.path}: no clip can be searched. {name}, for one: {problem}"
                )
            raise LibraryError(
                f"{library.path}: the library was built without features. Add them with: "
                f"mocapdb index {library.path}"
            )
        self.motions = StoredMotions(library.path, places)
        index, self._rows = open_index(library.path, places)
        self.index = self._as_captured(index) if library.original else index
        self._part: tuple[MotionIndex, tuple[str, ...], MotionIndex] | None = None

    @cached_property
    def records(self) -> list[ClipRecord]:
        """What the catalogue says of each clip of the index; a query reads only those it finds."""
        records = {record.id: record for record in self._library.records()}
        return [records[row] for row in self._rows.tolist()]

    # -- queries ---------------------------------------------------------------------------------

    def query(
        self,
        examples: Clip | str | Sequence[Clip | str],
        *,
        k: int = 10,
        only: Filter | None = None,
        unlike: Clip | str | Sequence[Clip | str] = (),
        joints: Sequence[str] = (),
        whole: bool = False,
        mirror: bool = False,
        expand: int | None = None,
        weights: Weights | None = None,
        max_distance: float = math.inf,
        exact: bool | None = None,
        threads: int | None = None,
    ) -> list[Hit]:
        """Return the stretches of the library nearest to a clip, or to the nearest of several.

        Parameters
        ----------
        examples : Clip, str, or sequence of them
            What to look for; take a range of frames with ``clip[a:b]``. A name is that of a clip
            of the library, which is then not searched itself.
        k : int
            Hits to return, the nearest first; fewer if there are no more.
        only : Filter, optional
            Which clips to search.
        unlike : Clip, str, or sequence of them
            What is not meant: stretches that are nearer to one of these are left out.
        joints : sequence of str
            Only these joints count, and parts of the body such as ``"right-arm"``; see
            `mocapdb.indexing.search.body_parts`. All by default.
        whole : bool
            Compare whole clips from beginning to end, and return whole clips.
        mirror : bool
            Whether left and right may have changed places.
        expand : int, optional
            Search again with the query averaged with this many of its best hits. By default 2
            with `whole`, else 0.
        weights : Weights, optional
            Other weights than the library's index has; the index is then made anew in memory.
        max_distance : float
            Leave out what is further away; 0 is the same motion, 1 any motion.
        exact : bool, optional
            Whether nothing may be missed; by default where the library has up to 3 million frames
            of 24 fps, a day and a half. Whole clips: whether all of them are compared.
        threads : int, optional

        Raises
        ------
        SkeletonError
            If an example's skeleton cannot be mapped to the canonical body.
        ClipError
            If an example is shorter than 0.3 s, or longer than anything in the library, a part of
            the body is unknown, or the distance is not a number from 0.
        LibraryError
            If no clip fits the filter.
        """
        if not max_distance >= 0:
            raise ClipError(f"Expected a distance of 0 or more, but got {max_distance}.")
        only = only or Filter()
        wanted, names = self._motions(examples)
        unwanted, other_names = self._motions(unlike)
        query = Query(wanted, mirror=mirror)
        others = Query(unwanted, mirror=mirror) if unwanted else None
        index = self.index
        if weights is not None and weights != index.space.weights:
            index = make_index(self.motions, weights)
            index = self._as_captured(index) if self._library.original else index
        if joints:
            index = self._index_of_part(index, part_joints(joints))
        chosen = self.chosen(replace(only, not_clips=[*only.not_clips, *names, *other_names]))
        if whole:
            more = {} if expand is None else {"expand": expand}
            found = search_clips(
                index, query, k=k, clips=chosen, exact=bool(exact), unlike=others, **more
            )
            found = [hit for hit in found if hit.distance <= max_distance]
        else:
            found = search(
                index,
                query,
                k=k,
                clips=chosen,
                max_distance=max_distance,
                expand=expand or 0,
                exact=exact,
                unlike=others,
                threads=threads,
            )
        return [self._hit(stretch) for stretch in found]

    def _motions(
        self, examples: Clip | str | Sequence[Clip | str]
    ) -> tuple[list[CanonicalMotion], list[str]]:
        """Return the motions of examples, and the names of those that are the library's."""
        each = [examples] if isinstance(examples, Clip | str) else list(examples)
        names = [self._library.record(name).name for name in each if isinstance(name, str)]
        clips = [self._library.clip(one) if isinstance(one, str) else one for one in each]
        return [canonical_motion(clip) for clip in clips], names

    def _as_captured(self, index: MotionIndex) -> MotionIndex:
        """Return an index in which cleaned clips have the motion that was captured."""
        revisions = self._library.catalogue.revisions().values()
        cleaned = np.isin(self._rows, [each.clip_id for each in revisions if each.changes])
        if not cleaned.any():
            return index
        clips = []
        for i, ends in enumerate(pairwise(index.frames.starts)):
            if cleaned[i]:
                record = self._library.catalogue.record(int(self._rows[i]))
                motion = canonical_motion(self._library.captured(record))
                clips.append(index.space.frames(motion))
            else:
                clips.append(index.frames.values(slice(*ends)))
        return index_of(index.space, clips, index.usual)

    def _index_of_part(self, index: MotionIndex, joints: tuple[str, ...]) -> MotionIndex:
        """Return an index by some joints; that of the last query is kept."""
        if self._part is None or self._part[:2] != (index, joints):
            self._part = index, joints, index_of_part(index, joints)
        return self._part[2]

    def chosen(self, only: Filter) -> BoolArray:
        """Return which clips of the index a filter lets through."""
        if only.label is not None and only.label not in self._library.classes():
            classes = ", ".join(self._library.classes()) or "none"
            raise LibraryError(
                f"{self._library.path}: no clip has class {only.label!r}. It has: {classes}."
            )
        chosen = np.ones(len(self._rows), dtype=np.bool_)
        if only.label is not None or only.text is not None or only.where:
            catalogue = self._library.catalogue
            fitting = list(catalogue.ids(label=only.label, search=only.text, where=only.where))
            chosen &= np.isin(self._rows, fitting)
        if only.subject is not None or only.not_subjects:
            subjects = self._library.catalogue.subjects()
            who = [subjects[int(row)] for row in self._rows]
            chosen &= [
                only.subject in (None, each) and each not in only.not_subjects for each in who
            ]
        left_out = [self._library.record(name).id for name in only.not_clips]
        chosen &= ~np.isin(self._rows, left_out)
        if not chosen.any():
            said = {key: value for key, value in vars(only).items() if value and key != "where"}
            asked = ", ".join(
                [f"{key} {value!r}" for key, value in said.items()]
                + [f"{column}={value}" for column, value in only.where.items()]
            )
            raise LibraryError(
                f"{self._library.path}: no clip that can be searched fits {asked}. "
                f"See: mocapdb ls {self._library.path}"
            )
        return chosen

    def _hit(self, stretch: Stretch) -> Hit:
        record = self._library.catalogue.record(int(self._rows[stretch.clip]))
        ratio = record.fps / FPS
        end = min(math.ceil(stretch.end * ratio), record.frames)
        start = min(round(stretch.start * ratio), end - 1)
        return Hit(start, end, record, stretch.distance, stretch.time_scale, stretch)

    # -- classes ---------------------------------------------------------------------------------

    @cached_property
    def classes(self) -> ClassIndex:
        """The classes learned from the library's labelled clips.

        Raises
        ------
        LibraryError
            If no clip has a label to learn from.
        """
        learned = open_models(self._library.path, self._library.catalogue)
        if not learned.labels:
            raise LibraryError(
                f"{self._library.path}: no class to compare with, because no clip has a label. "
                "Build with --labels FILE."
            )
        return learned

    def classify(self, clip: Clip) -> Classification:
        """Return what a clip is: the library's classes by likelihood, and whether it is any."""
        return self.classes.classify(canonical_motion(clip))

    def classify_unlabelled(
        self, where: Mapping[str, str] | None = None
    ) -> list[tuple[ClipRecord, Classification]]:
        """Return what the library's clips without a label are; of those whose columns fit."""
        chosen = self.chosen(Filter(where=where or {}))
        return [
            (record, self.classes.classify(motion))
            for record, motion, fits in zip(self.records, self.motions, chosen, strict=True)
            if record.label is None and fits
        ]
