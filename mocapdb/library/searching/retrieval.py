"""Queries by example and classification over a library."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from shlex import quote
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocapdb.base.arrays import BoolArray, Float32Array
from mocapdb.errors import ClipError, LibraryError, NoClipFitsError
from mocapdb.indexing.canonical.canonical_motion import FPS, CanonicalMotion, canonical_motion
from mocapdb.indexing.search.agreement import Agreement, agreement_of, whole_path
from mocapdb.indexing.search.body_parts import index_of_part, part_joints
from mocapdb.indexing.search.clip_search import search_clips
from mocapdb.indexing.search.example_query import (
    Query,
    liveliest_range,
    mean_speed,
    stillest_range,
)
from mocapdb.indexing.search.features import Weights
from mocapdb.indexing.search.frame_store import MotionIndex, coded_turns, index_of
from mocapdb.indexing.search.probability import (
    LabelledHit,
    distance_of_probability,
    label_shares,
    probability,
)
from mocapdb.indexing.search.stretch_search import Stretch, search
from mocapdb.indexing.tuning import MIN_QUERY_S, NEAR_HITS, POSE_S, STILL_MS, UNTOLD_SHARE
from mocapdb.library.catalogue import Chosen
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.facets import checked_facets
from mocapdb.library.library import Library
from mocapdb.library.naming import UNKNOWN
from mocapdb.library.searching.learned_classes import open_models
from mocapdb.library.searching.saved_queries import SavedQuery
from mocapdb.library.searching.search_index import StoredMotions, make_index, open_index
from mocapdb.motion.clip import Clip
from mocapdb.motion.frame_range import FrameRange

if TYPE_CHECKING:
    from mocapdb.indexing.recognition.class_models import Classification, ClassIndex

__all__ = [
    "Examples",
    "Filter",
    "Growth",
    "Hit",
    "Retrieval",
    "Sought",
    "are_poses",
    "as_poses",
    "column_value",
    "cut_examples",
    "expect_counts",
    "leaves_out_neighbours",
    "notes_on_examples",
    "notes_on_labels",
    "with_label_shares",
]


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
    facets : mapping of str to (low, high)
        Ranges of numbers of the whole clips, such as ``{"root_speed": (1.0, 1.6)}``; None where one
        is open. See `mocapdb.library.FACETS`.
    flagged : bool, optional
        Whether flagged faults were left in them; clips that nobody has searched fit neither way.
    """

    label: str | None = None
    subject: str | None = None
    text: str | None = None
    not_clips: Sequence[str] = ()
    not_subjects: Sequence[str] = ()
    where: Mapping[str, str] = field(default_factory=dict, hash=False)
    facets: Mapping[str, tuple[float | None, float | None]] = field(
        default_factory=dict, hash=False
    )
    flagged: bool | None = None

    @property
    def tells_labels(self) -> bool:
        """Whether what it lets through is of one label, or of few."""
        return self.label is not None or self.text is not None

    def of_any_label(self) -> Filter:
        """Return the same of whatever label."""
        return replace(self, label=None, text=None)

    def __str__(self) -> str:
        """Say what is asked for, for messages."""
        plain = ("label", "subject", "text", "not_subjects")
        asked = [f"{key} {getattr(self, key)!r}" for key in plain if getattr(self, key)]
        asked += [f"{column}={value}" for column, value in self.where.items()]
        ranges = checked_facets(self.facets).items()
        asked += [f"{name.replace('_', '-')} {ends}" for name, ends in ranges]
        if self.flagged is not None:
            asked.append(f"flagged {'yes' if self.flagged else 'no'}")
        if not asked:  # which most often are no more than the query itself
            asked.append(f"not_clips {list(self.not_clips)!r}")
        return ", ".join(asked)


@dataclass(frozen=True)
class Sought:
    """What a hit was found for."""

    query: Query
    whole: bool
    joints: tuple[str, ...]
    still: bool = False


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
    label_share : float
        Share of its label among the nearest hits; see `mocapdb.indexing.search.probability`.
    """

    record: ClipRecord
    distance: float
    time_scale: float
    stretch: Stretch
    _sought: Sought = field(repr=False, compare=False)
    label_share: float = UNTOLD_SHARE

    @property
    def probability(self) -> float:
        """How likely it is the same motion, 0 to 1, calibrated (docs/query.md)."""
        return probability(self.distance, self.label_share)

    def sought_s(self, example: Clip) -> tuple[float, float]:
        """Return from when to when an example was looked for, in its seconds.

        Parameters
        ----------
        example : Clip
            The first that was asked with. All of it, but of a pose, or where it is longer than
            every clip.
        """
        motion, searched = canonical_motion(example), self._sought.query.examples[0]
        if len(searched) >= len(motion):
            return 0.0, example.duration_s
        of_interest = stillest_range if self._sought.still else liveliest_range
        part = of_interest(motion, len(searched))
        return part.start / FPS, part.stop / FPS

    @property
    def start_s(self) -> float:
        """Where it starts, in seconds."""
        return self.start / self.record.fps

    @property
    def end_s(self) -> float:
        """Where it ends, in seconds."""
        return self.end / self.record.fps


@dataclass(frozen=True)
class Growth:
    """What growing the classes of a library comes to.

    Attributes
    ----------
    labels : mapping of str to str
        The class of each clip that had none, by the clip's name.
    before : mapping of str to Classification
        What these clips were by the classes as they were: why a new one was opened.
    known : frozenset of str
        The classes that there were.
    """

    labels: Mapping[str, str]
    before: Mapping[str, Classification]
    known: frozenset[str]

    @property
    def opened(self) -> dict[str, list[str]]:
        """The names of the clips in each class that was opened."""
        found: dict[str, list[str]] = {}
        for name, label in sorted(self.labels.items()):
            if label not in self.known:
                found.setdefault(label, []).append(name)
        return found


Examples: TypeAlias = "Clip | CanonicalMotion | str | Sequence[Clip | CanonicalMotion | str]"
"""Clips, names of clips of the library, and motions on the canonical body."""


N_PARTS = 5
"""Into which the people of a library are shared out, where each is seen by the others' classes."""


def _is_unlabelled(record: ClipRecord) -> bool:
    """Say whether nobody has said what a clip is."""
    return record.label in (None, UNKNOWN)


def column_value(record: ClipRecord, column: str) -> str:
    """Return what a further column, or the subject, says of a clip; empty where nothing."""
    return record.performer if column == "subject" else record.columns.get(column, "")


def notes_on_examples(
    examples: Sequence[CanonicalMotion], unlike: Sequence[CanonicalMotion], *, still: bool
) -> list[str]:
    """Return what is to be said where an example does not move, or is what is not meant."""
    what = (
        "it is a pose, and what is found are moments in that pose, however they move; how "
        "likely they are was not measured for poses"
        if still
        else "it is a pose, but what is found has to hold it as long: how it moves counts"
    )
    notes = [
        f"the query hardly moves ({100 * speed:.1f} cm/s): {what}"
        for speed in map(mean_speed, examples)
        if speed < STILL_MS
    ]
    if any(_is_same(one, other) for one in examples for other in unlike):
        notes.append("what is not meant is the query itself: all that is nearer to it is left out")
    return notes


def are_poses(examples: Sequence[CanonicalMotion]) -> bool:
    """Say whether no example moves, so that a pose is looked for and not a motion."""
    return all(mean_speed(motion) < STILL_MS for motion in examples)


def as_poses(examples: Sequence[CanonicalMotion]) -> list[CanonicalMotion]:
    """Return of each example where it moves least, as long as a moving body is in a pose."""
    n = round(POSE_S * FPS)
    return [
        motion.part(stillest_range(motion, n)) if len(motion) > n else motion for motion in examples
    ]


def _is_same(one: CanonicalMotion, other: CanonicalMotion) -> bool:
    return np.array_equal(one.pose, other.pose) and np.array_equal(one.root, other.root)


def leaves_out_neighbours(hits: Sequence[Hit], k: int, only: Filter, max_distance: float) -> bool:
    """Return whether the hits of a query are not all that are nearest, whatever their label."""
    few = len(hits) < NEAR_HITS and (k < NEAR_HITS or max_distance < math.inf)
    return few or only.tells_labels


def with_label_shares(
    hits: Sequence[Hit],
    nearest: Sequence[Hit],
    places: Sequence[str] = (),
    near: Sequence[str] = (),
) -> list[Hit]:
    """Return hits with the share of their labels among the nearest hits.

    Where they are of several libraries, `places` and `near` say of which each is.
    """
    seen, known = (
        [
            LabelledHit(
                (place, hit.record.id, hit.start, hit.end),
                hit.distance,
                None if _is_unlabelled(hit.record) else hit.record.label,
            )
            for hit, place in zip(own, of or [""] * len(own), strict=True)
        ]
        for own, of in ((hits, places), (nearest, near))
    )
    shares = label_shares(seen, known)
    return [replace(hit, label_share=share) for hit, share in zip(hits, shares, strict=True)]


def notes_on_labels(hits: Sequence[Hit], likely: float) -> list[str]:
    """Return what is to be said where hits are left out for want of a label."""
    count = sum(_is_unlabelled(hit.record) and hit.probability < likely for hit in hits)
    if likely <= UNTOLD_SHARE or not count:
        return []
    return [
        f"{count} near stretches of clips without a label are left out: none of these is said to "
        f"be more than {UNTOLD_SHARE:.0%} likely. Use --probability {UNTOLD_SHARE - 0.04:.1f} or "
        "--max-distance, or label the clips: mocapdb build --labels FILE"
    ]


def cut_examples(
    examples: Sequence[CanonicalMotion], longest: int
) -> tuple[list[CanonicalMotion], list[str]]:
    """Return examples, those cut that are longer than every clip, and what is to be said of it."""
    cut: list[CanonicalMotion] = []
    notes: list[str] = []
    for motion in examples:
        if len(motion) <= longest or longest < MIN_QUERY_S * FPS:
            cut.append(motion)
            continue
        part = liveliest_range(motion, longest)
        cut.append(motion.part(part))
        notes.append(
            f"the query of {len(motion) / FPS:.2f} s is longer than every clip that is "
            f"searched: its liveliest {longest / FPS:.2f} s are looked for, from "
            f"{part.start / FPS:.2f} to {part.stop / FPS:.2f} s. For another part, choose a range "
            "(--from and --to)"
        )
    return cut, notes


def expect_counts(*, k: int, expand: int | None = None, threads: int | None = None) -> None:
    """Raise a `ClipError` where a number of hits or threads is none."""
    for name, value, least in (("k", k, 1), ("expand", expand, 0), ("threads", threads, 1)):
        if value is not None and (not isinstance(value, int | np.integer) or value < least):
            raise ClipError(f"Expected {name} to be a whole number from {least}, but got {value}.")


class Retrieval:
    """A library to search by example and to classify with (docs/query.md).

    Parameters
    ----------
    library : Library
        It stays open for as long as it is searched.

    Attributes
    ----------
    index : MotionIndex
        The clips that can be searched, as frames. Clips that were cleaned are in it by their
        cleaned motion, or, in a library opened with ``original=True``, as they were captured.
        Classes are always learned from the cleaned motion.
    notes : list of str
        What is to be said of the last query, that it was cut or is a pose; and of what
        `classify_by` left out.

    Raises
    ------
    LibraryError
        If the library is empty, or has no features.
    """

    def __init__(self, library: Library) -> None:
        self._library = library
        catalogue = library.catalogue
        library.copy_derived()
        if not catalogue.n_clips():
            raise LibraryError(f"{library.place}: the library is empty. Build clips into it first.")
        if not catalogue.has_searchable():
            problems = catalogue.feature_problems()
            if problems:
                name, problem = next(iter(problems.items()))
                raise LibraryError(
                    f"{library.place}: no clip can be searched. {name}, for one: {problem}"
                )
            raise LibraryError(
                f"{library.place}: the library was built without features. Add them with: "
                f"mocapdb index {quote(str(library.place))}"
            )
        index, self._rows = open_index(catalogue)
        self.index = self._as_captured(index) if library.original else index
        self.notes: list[str] = []
        self._part: tuple[MotionIndex, tuple[str, ...], MotionIndex] | None = None
        self._weighed: tuple[tuple[Weights, bool], MotionIndex] | None = None

    @property
    def library(self) -> Library:
        """The library that is searched."""
        return self._library

    @cached_property
    def motions(self) -> StoredMotions:
        """The canonical motion of each clip that can be searched."""
        catalogue = self._library.catalogue
        return StoredMotions.of(catalogue, catalogue.feature_places())

    @cached_property
    def records(self) -> list[ClipRecord]:
        """What the catalogue says of each clip of the index; a query reads only those it finds."""
        records = {record.id: record for record in self._library.records()}
        return [records[row] for row in self._rows.tolist()]

    # -- queries ---------------------------------------------------------------------------------

    def query(
        self,
        examples: Examples,
        *,
        k: int = 10,
        only: Filter | None = None,
        unlike: Examples = (),
        joints: str | Sequence[str] = (),
        whole: bool = False,
        mirror: bool = False,
        expand: int | None = None,
        weights: Weights | None = None,
        max_distance: float = math.inf,
        probability: float = 0.0,
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
        joints : str or sequence of str
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
        probability : float
            Leave out what is less likely the same motion, 0 to 1; see `Hit.probability`.
        exact : bool, optional
            Whether nothing may be missed; by default where the library has up to 3 million frames
            of 24 fps, a day and a half. Whole clips: whether all of them are compared.
        threads : int, optional

        Raises
        ------
        SkeletonError
            If an example's skeleton cannot be mapped to the canonical body.
        ClipError
            If an example is shorter than 0.3 s or no clip, a part of the body is unknown, the
            distance is not a number from 0, the probability not one from 0 to 1, or k no count.
        LibraryError
            If no clip fits the filter.

        Notes
        -----
        Of an example that is longer than every clip to be searched, the liveliest part that is as
        long as the longest is looked for. `notes` then says so.

        Where no example moves, a pose is looked for: moments of 0.3 s at most, half a second apart,
        by nothing but the places of the joints and the height of the hips. `notes` says so, too.
        """
        if not max_distance >= 0:
            raise ClipError(f"Expected a distance of 0 or more, but got {max_distance}.")
        expect_counts(k=k, expand=expand, threads=threads)
        max_distance = min(max_distance, distance_of_probability(probability))
        only = only or Filter()
        joints = joints.split(",") if isinstance(joints, str) else joints
        wanted, names = self.example_motions(examples)
        unwanted, other_names = self.example_motions(unlike)
        only = replace(only, not_clips=[*only.not_clips, *names, *other_names])
        chosen = self.chosen(only)
        still = not whole and are_poses(wanted)
        self.notes = notes_on_examples(wanted, unwanted, still=still)
        if still:
            wanted, unwanted = as_poses(wanted), as_poses(unwanted)
        elif not whole:
            wanted, notes = cut_examples(wanted, self.longest(chosen))
            self.notes += notes
        query = Query(wanted, mirror=mirror)
        others = Query(unwanted, mirror=mirror) if unwanted else None
        index = self.index_by(weights, joints, still=still)

        def look(k: int, chosen: BoolArray, within: float) -> list[Hit]:
            """Return the k nearest of some clips within a distance."""
            found: list[Stretch]
            if whole:
                more: dict[str, Any] = {} if expand is None else {"expand": expand}
                found = search_clips(
                    index, query, k=k, clips=chosen, exact=bool(exact), unlike=others, **more
                )
                found = [hit for hit in found if hit.distance <= within]
            else:
                found = search(
                    index,
                    query,
                    k=k,
                    clips=chosen,
                    max_distance=within,
                    expand=expand or 0,
                    exact=exact,
                    unlike=others,
                    threads=threads,
                )
            return [self.hit(stretch, sought) for stretch in found]

        sought = Sought(query, whole, part_joints(joints) if joints else (), still)
        hits = nearest = look(k, chosen, max_distance)
        if hits and leaves_out_neighbours(hits, k, only, max_distance):
            nearest = look(NEAR_HITS, self.chosen(only.of_any_label()), math.inf)
        hits = with_label_shares(hits, nearest)
        if probability > 0:
            self.notes += notes_on_labels(hits, probability)
        return [hit for hit in hits if hit.probability >= probability]

    def index_by(
        self, weights: Weights | None, joints: Sequence[str], *, still: bool = False
    ) -> MotionIndex:
        """Return the index for a query by other weights, by some joints only, or by poses."""
        index = self.index
        if still:
            weights = replace(weights or index.space.weights, velocity_s=0, travel_s=0, turn_ms=0)
        if weights is not None and weights != index.space.weights:
            index = self._index_of_weights(weights, still)
        return self._index_of_part(index, part_joints(joints)) if joints else index

    def _index_of_weights(self, weights: Weights, still: bool) -> MotionIndex:
        """Return an index by other weights; that of the last query is kept."""
        asked = weights, still
        if self._weighed is None or self._weighed[0] != asked:
            index = make_index(self.motions, weights)
            index = self._as_captured(index) if self._library.original else index
            if still:
                index = replace(index, space=replace(index.space, still=True))
            self._weighed = asked, index
        return self._weighed[1]

    def agreement(self, hit: Hit) -> Agreement:
        """Return why a stretch was found: how far it is from the query, by joint and moment.

        Parameters
        ----------
        hit : Hit
            Of a query to this library.

        Examples
        --------
        ``retrieval.agreement(hit).of_parts()`` begins with the part of the body that is most alike.
        """
        sought, stretch = hit._sought, hit.stretch
        clip = self._searched_motion(stretch.clip)
        if sought.whole:
            motion, speed = sought.query.performances()[stretch.template], 1.0
            path = whole_path(motion, clip)
        else:
            motion, speed = sought.query.of_template(stretch.template)
            path = stretch.path
        return agreement_of(motion, clip, path, self.index.space, speed=speed, joints=sought.joints)

    def _searched_motion(self, clip: int) -> CanonicalMotion:
        """Return the motion by which a clip of the index is searched."""
        row = int(self._rows[clip])
        revision = self._library.catalogue.revision(row) if self._library.original else None
        if revision is None or not revision.changes:
            return self.motions[clip]
        return canonical_motion(self._library.captured(self._library.catalogue.record(row)))

    def saved(self, name: str, *, threads: int | None = None) -> list[Hit]:
        """Return the hits of a query that the library keeps, asked anew.

        Raises
        ------
        LibraryError
            If there is none of that name.
        """
        kept = SavedQuery.of_json(name, self._library.catalogue.saved_query(name))
        options = dict(kept.options)
        only = Filter(**options.pop("only", {}))
        weights = options.pop("weights", None)
        return self.query(
            kept.examples,
            only=only,
            unlike=kept.unlike,
            weights=None if weights is None else Weights(*weights),
            threads=threads,
            **options,
        )

    def example_motions(self, examples: Examples) -> tuple[list[CanonicalMotion], list[str]]:
        """Return the motions of examples, and the names of those that are the library's."""
        if isinstance(examples, Clip | CanonicalMotion | str):
            examples = [examples]
        if not isinstance(examples, Sequence) or not all(
            isinstance(one, Clip | CanonicalMotion | str) for one in examples
        ):
            raise ClipError(
                "Expected a clip, the name of a clip of the library, or a sequence of them, but "
                f"got {type(examples).__name__}."
            )
        each: list[Clip | CanonicalMotion | str] = list(examples)
        names = [self._library.record(name).name for name in each if isinstance(name, str)]
        clips = [self._library.clip(one) if isinstance(one, str) else one for one in each]
        return [
            clip if isinstance(clip, CanonicalMotion) else canonical_motion(clip) for clip in clips
        ], names

    def longest(self, chosen: BoolArray) -> int:
        """Return the frames of the longest of some clips."""
        return int(np.diff(self.index.frames.starts)[chosen].max())

    def _as_captured(self, index: MotionIndex) -> MotionIndex:
        """Return an index in which cleaned clips have the motion that was captured."""
        revisions = self._library.catalogue.revisions().values()
        cleaned = np.isin(self._rows, [each.clip_id for each in revisions if each.changes])
        if not cleaned.any():
            return index
        clips: list[Float32Array] = []
        turns: list[NDArray[np.int8] | None] = []
        for i, ends in enumerate(pairwise(index.frames.starts)):
            if cleaned[i]:
                motion = self._searched_motion(i)
                clips.append(index.space.frames(motion))
                turns.append(coded_turns(motion))
            else:
                clips.append(index.frames.values(slice(*ends)))
                turns.append(None if index.turns is None else index.turns[slice(*ends)])
        known = [each for each in turns if each is not None]
        every = np.concatenate(known) if len(known) == len(turns) else None
        return index_of(index.space, clips, index.usual, every)

    def _index_of_part(self, index: MotionIndex, joints: tuple[str, ...]) -> MotionIndex:
        """Return an index by some joints; that of the last query is kept."""
        if self._part is None or self._part[:2] != (index, joints):
            self._part = index, joints, index_of_part(index, joints)
        return self._part[2]

    def chosen(self, only: Filter) -> BoolArray:
        """Return which clips of the index a filter lets through."""
        if only.label is not None:
            self._library.catalogue.expect_class(only.label)
        chosen = np.ones(len(self._rows), dtype=np.bool_)
        asked = Chosen(only.label, only.text, only.where, only.facets, only.flagged)
        if asked != Chosen():
            fitting = list(self._library.catalogue.ids(asked))
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
            self._expect_values(only)
            if only == Filter(not_clips=only.not_clips):
                names = ", ".join(dict.fromkeys(only.not_clips))
                raise NoClipFitsError(
                    f"{self._library.place}: it has no other clip that can be searched than "
                    f"{names}, which is asked with and so left out."
                )
            place = quote(str(self._library.place))
            nobody = only.flagged is not None and not self._library.catalogue.revisions()
            raise NoClipFitsError(
                f"{self._library.place}: no clip that can be searched fits {only}. "
                + (
                    f"None was searched for faults: mocapdb clean {place} --apply"
                    if nobody
                    else f"See: mocapdb ls {place}"
                )
            )
        return chosen

    def _expect_values(self, only: Filter) -> None:
        """Raise a `NoClipFitsError` that names the nearest if no clip at all has a value."""
        asked = dict(only.where)
        if only.subject is not None:
            asked["subject"] = only.subject
        missing = self._library.catalogue.missing_value(asked)
        if missing is not None:
            raise NoClipFitsError(missing)

    def hit(self, stretch: Stretch, sought: Sought) -> Hit:
        """Return a stretch of the index as one of the library's clip."""
        record = self._library.catalogue.record(int(self._rows[stretch.clip]))
        ratio = record.fps / FPS
        end = min(math.ceil(stretch.end * ratio), record.frames)
        start = min(round(stretch.start * ratio), end - 1)
        return Hit(start, end, record, stretch.distance, stretch.time_scale, stretch, sought)

    # -- classes ---------------------------------------------------------------------------------

    @cached_property
    def classes(self) -> ClassIndex:
        """The classes learned from the library's labelled clips.

        Raises
        ------
        LibraryError
            If no clip has a label to learn from.
        """
        learned = open_models(self._library.catalogue)
        if not learned.labels:
            raise LibraryError(
                f"{self._library.place}: no class to compare with, because no clip has a label. "
                "Build with --labels FILE."
            )
        return learned

    def classes_by(self, column: str) -> ClassIndex:
        """Return classes learned, now, from a further column of the labels, or the subjects.

        Raises
        ------
        LibraryError
            If there is no such column, or it says nothing of a clip that can be searched.
        """
        return self._learned_from([row for row, value in enumerate(self._said(column)) if value],
                                  column)  # fmt: skip

    def classify_by(self, column: str) -> list[tuple[ClipRecord, Classification]]:
        """Return what each clip that can be searched is by a further column, or the subject.

        A clip of which the column says something is seen by classes that were learned without it
        and without what the same people perform: the clips are gone through in five parts. Where
        nobody knows who performs a clip, and for subjects themselves, what is left out is the clip
        and others with the same content. `notes` says what was left out.

        Raises
        ------
        LibraryError
            If there is no such column, or it says nothing of a clip that can be searched.
        """
        said = self._said(column)
        known = [row for row, value in enumerate(said) if value]
        groups = [self._left_out_with(row, column) for row in range(len(said))]
        people = sorted({groups[row] for row in known})
        part = {person: number % N_PARTS for number, person in enumerate(people)}
        found: dict[int, Classification] = {}
        for number in range(N_PARTS):
            own = [row for row in known if part[groups[row]] == number]
            others = [row for row in known if part[groups[row]] != number]
            if own:
                classes = self._learned_from(others or known, column)
                found |= {row: classes.classify(self.motions[row]) for row in own}
        if len(known) < len(said):
            classes = self._learned_from(known, column)
            rest = [row for row, value in enumerate(said) if not value]
            found |= {row: classes.classify(self.motions[row]) for row in rest}
        self.notes = self._notes_on_left_out(known, column, len(people))
        return [(record, found[row]) for row, record in enumerate(self.records)]

    def _left_out_with(self, row: int, column: str) -> str:
        """Return what a clip has in common with those that are left out with it."""
        record = self.records[row]
        return (record.performer if column != "subject" else "") or record.source_sha256

    def _notes_on_left_out(self, known: Sequence[int], column: str, n_groups: int) -> list[str]:
        """Return what is to be said of what the classes were learned without."""
        if n_groups < 2:
            return ["nothing could be left out: each clip is seen by classes learned with it, too"]
        if column == "subject":
            return [
                "each clip is seen by classes learned from other clips, also by the same people: "
                "else nobody could be recognised"
            ]
        nobodys = sum(not self.records[row].performer for row in known)
        if not nobodys:
            return []
        who = "nobody knows who performs" + ("" if nobodys == len(known) else f" {nobodys} of")
        return [
            f"{who} the {len(known)} clips, so that these are seen by classes learned from other "
            "clips, which may be takes by the same people: that flatters"
        ]

    def _said(self, column: str) -> list[str]:
        """Return what a column says of each clip of the index."""
        self._library.catalogue.expect_columns([column])
        said = [column_value(record, column) for record in self.records]
        if not any(said):
            raise LibraryError(
                f"{self._library.place}: no clip that can be searched has a value of {column!r}."
            )
        return said

    def _learned_from(self, rows: Sequence[int], column: str) -> ClassIndex:
        """Return the classes that a column makes of some clips."""
        from mocapdb.indexing.recognition.class_models import ClassIndex

        return ClassIndex().fit(
            [self.motions[row] for row in rows],
            [column_value(self.records[row], column) for row in rows],
            groups=[self._left_out_with(row, column) for row in rows],
            space=self.index.space,
        )

    def grow(self) -> Growth:
        """Return a class for each clip without a label, or ``unknown``: a known one, or a new one.

        Classes are learned, clips assigned, and the classes learned again with them until nothing
        moves; what fits none opens a class, with what is near it (see `ClassIndex.assign`).
        Nothing is written: see `mocapdb.library.apply_labels`.

        Raises
        ------
        LibraryError
            If no clip has a label to begin from.
        """
        from mocapdb.indexing.recognition.class_models import ClassIndex

        known = self.classes  # or there is nothing to begin from
        records, motions = self.records, list(self.motions)
        labels = [None if _is_unlabelled(record) else record.label for record in records]
        rows = [i for i, label in enumerate(labels) if label is None or label in known.labels]
        free = [i for i in rows if labels[i] is None]
        given = ClassIndex().assign(
            [motions[i] for i in rows],
            [labels[i] for i in rows],
            groups=[records[i].performer or records[i].name for i in rows],
        )
        found = dict(zip(rows, given, strict=True))
        return Growth(
            {records[i].name: found[i] for i in free},
            {records[i].name: known.classify(motions[i]) for i in free},
            frozenset(known.labels),
        )

    def classify(self, clip: Clip | CanonicalMotion | str) -> Classification:
        """Return what a clip is: the library's classes by likelihood, and whether it is any.

        A name is that of a clip of the library.
        """
        (motion,), _ = self.example_motions(clip)
        return self.classes.classify(motion)

    def classify_unlabelled(
        self, where: Mapping[str, str] | None = None
    ) -> list[tuple[ClipRecord, Classification]]:
        """Return what clips without a label, or ``unknown``, are; of those whose columns fit."""
        chosen = self.chosen(Filter(where=where or {}))
        return [
            (record, self.classes.classify(motion))
            for record, motion, fits in zip(self.records, self.motions, chosen, strict=True)
            if _is_unlabelled(record) and fits
        ]
