"""A query of several libraries at once, of which any may be searched by another process.

Each library is searched by its own index, along its own axes. So that distances are comparable all
features count, also those that the axes of a library leave out (`FeatureSpace.all_features`). The
stretch taken at random that distances are measured by is one of all libraries, each frame of which
counts the same. The hits are those of one library that has all clips, but for the rounding of two
sets of axes.

It goes in rounds: what the libraries hold, their nearest stretches, why these are near. A library
is an order in each: `mocapdb.base.workers` shares them out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar

import numpy as np

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.base.workers import on_workers
from mocapdb.errors import ClipError, LibraryError, NoClipFitsError
from mocapdb.indexing.canonical.canonical_motion import FPS
from mocapdb.indexing.search.agreement import Agreement
from mocapdb.indexing.search.body_parts import part_joints
from mocapdb.indexing.search.clip_search import search_clips, whole_costs
from mocapdb.indexing.search.example_query import Query
from mocapdb.indexing.search.features import Weights
from mocapdb.indexing.search.probability import distance_of_probability
from mocapdb.indexing.search.span_scan import reference_of, sample_costs
from mocapdb.indexing.search.stretch_search import search
from mocapdb.indexing.tuning import NEAR_HITS
from mocapdb.library.addresses import address_of
from mocapdb.library.layout import CATALOGUE_FILE, is_library
from mocapdb.library.library import Library
from mocapdb.library.searching.retrieval import (
    Examples,
    Filter,
    Hit,
    Retrieval,
    Sought,
    are_poses,
    as_poses,
    cut_examples,
    expect_counts,
    leaves_out_neighbours,
    notes_on_examples,
    notes_on_labels,
    with_label_shares,
)

__all__ = ["FoundHit", "LibraryHits", "query_libraries"]

Given = ParamSpec("Given")
Answer = TypeVar("Answer")


@dataclass(frozen=True)
class FoundHit:
    """A hit, and the library it is of.

    Attributes
    ----------
    library : str
        Its folder or address, as it was given.
    hit : Hit
    why : Agreement, optional
        Why it was found, where that was asked for.
    """

    library: str
    hit: Hit
    why: Agreement | None = None


@dataclass(frozen=True)
class LibraryHits:
    """What several libraries have that is like a query.

    Attributes
    ----------
    hits : list of FoundHit
        The nearest first.
    libraries : list of str
        Those that were asked, each once.
    unsearchable : dict of str to int
        How many clips of each no query looks at.
    cleaned : int
        How many clips of all have a cleaned revision.
    notes : list of str
        What is to be said of the query and of libraries in which nothing fits.
    """

    hits: list[FoundHit]
    libraries: list[str]
    unsearchable: dict[str, int]
    cleaned: int
    notes: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class _Asked:
    """What every library is asked."""

    query: Query
    unlike: Query | None
    only: Filter
    joints: tuple[str, ...]
    whole: bool
    expand: int | None
    weights: Weights
    exact: bool | None
    is_one: bool
    still: bool


@dataclass(frozen=True)
class _Held:
    """What a library holds: how much of what may be searched, and what templates cost there.

    `refused` says why nothing of it is searched; `size` is how many frames it has, or clips, where
    whole clips are compared.
    """

    n_unsearchable: int
    n_cleaned: int
    refused: str | None = None
    longest: int = 0
    size: int = 0
    costs: tuple[FloatArray, ...] = ()


def query_libraries(
    libraries: Sequence[StrPath],
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
    original: bool = False,
    explain: bool = False,
    jobs: int | None = 1,
    scheduler: str | None = None,
) -> LibraryHits:
    """Return the stretches of several libraries nearest to a clip, ranked together.

    Parameters
    ----------
    libraries : sequence of path-like
        Folders and addresses. Names of clips, in `examples`, `unlike` and `only`, are those of the
        first. One that is given twice is searched once.
    examples, k, only, unlike, joints, whole, mirror, weights, max_distance, probability, exact
        As of `Retrieval.query`. Weights are those of the first library by default; where another
        was made with others, its index is made anew in memory.
    expand : int, optional
        As of `Retrieval.query`, for one library. Over several nothing is expanded.
    original : bool
        Whether clips are searched as they were captured.
    explain : bool
        Whether to tell why each hit was found.
    jobs : int, optional
        Processes that search, a library each: this one by default.
    scheduler : str, optional
        Address of a Dask scheduler whose workers search instead and see the same libraries.

    Raises
    ------
    SkeletonError, ClipError
        As of `Retrieval.query`.
    LibraryError
        If a library is not there, is newer than this version, or cannot be searched.
    NoClipFitsError
        If no clip of any library fits the filter.
    WorkerError
        If workers cannot do the work.
    """
    if expand and len(libraries) > 1:
        raise ClipError("Expected nothing to expand over several libraries, but got some hits.")
    if not max_distance >= 0:
        raise ClipError(f"Expected a distance of 0 or more, but got {max_distance}.")
    expect_counts(k=k, expand=expand)
    joints = joints.split(",") if isinstance(joints, str) else joints
    max_distance = min(max_distance, distance_of_probability(probability))
    places, notes = _each_once(libraries)
    counted = part_joints(joints) if joints else ()
    only = only or Filter()
    with ExitStack() as stack:
        first = _searched(stack, places[0], original)
        wanted, names = first.example_motions(examples)
        unwanted, others = first.example_motions(unlike)
        still = not whole and are_poses(wanted)
        notes += notes_on_examples(wanted, unwanted, still=still)
        if still:
            wanted, unwanted = as_poses(wanted), as_poses(unwanted)
        filters = [replace(only, not_clips=[*only.not_clips, *names, *others])]
        filters += [replace(only, not_clips=[])] * (len(places) - 1)
        asked = _Asked(
            Query(wanted, mirror=mirror), Query(unwanted, mirror=mirror) if unwanted else None,
            only, counted, whole, expand, weights or first.index.space.weights, exact,
            len(places) == 1, still,
        )  # fmt: skip
        opened = {places[0]: first}

        def of_each(
            work: Callable[Concatenate[Retrieval, Given], Answer],
            orders: dict[str, tuple[Any, ...]],
        ) -> dict[str, Answer]:
            """Return what some work makes of each of some libraries."""
            if scheduler is None and jobs == 1:
                for place in orders:
                    if place not in opened:
                        opened[place] = _searched(stack, place, original)
                calls: Any = work
                return {place: calls(opened[place], *order) for place, order in orders.items()}
            every = [(work, _shared(place), original, *order) for place, order in orders.items()]
            seen = [Path(place, CATALOGUE_FILE) for place in orders if not address_of(place)]
            answers = on_workers(_elsewhere, every, jobs=jobs, scheduler=scheduler, seen=seen)
            return dict(zip(orders, answers, strict=True))

        own = {
            place: replace(asked, only=each) for place, each in zip(places, filters, strict=True)
        }
        held = of_each(_hold, {place: (each,) for place, each in own.items()})
        fitting = [place for place in places if held[place].refused is None]
        if not fitting:
            raise NoClipFitsError(str(held[places[0]].refused))
        notes += [f"{held[place].refused}" for place in places if place not in fitting]
        longest = max(held[place].longest for place in fitting)
        cut, cut_notes = (wanted, []) if whole or still else cut_examples(wanted, longest)
        notes += cut_notes
        if cut_notes:  # it costs something else now
            query = Query(cut, mirror=mirror)
            own = {place: replace(own[place], query=query) for place in fitting}
            held |= of_each(_hold, {place: (own[place],) for place in fitting})
        references = None if asked.is_one else _references([held[place] for place in fitting])
        if references is not None and not min(references[: len(cut)], default=0) < math.inf:
            raise ClipError(
                "Expected a query that some clip is half as long as, but the longest has "
                f"{longest / FPS:.2f} s. Choose a shorter range."
            )
        found = of_each(
            _search, {place: (own[place], references, k, max_distance) for place in fitting}
        )
        hits = _ranked(found, k)
        if references is not None and hits:
            nearest = hits
            if leaves_out_neighbours([each.hit for each in hits], k, only, max_distance):
                wide = {
                    place: replace(own[place], only=own[place].only.of_any_label())
                    for place in fitting
                }
                near = of_each(
                    _search,
                    {place: (wide[place], references, NEAR_HITS, math.inf) for place in fitting},
                )
                nearest = _ranked(near, NEAR_HITS)
            hits = _told(hits, nearest)
        if probability > 0:
            notes += notes_on_labels([each.hit for each in hits], probability)
            hits = [each for each in hits if each.hit.probability >= probability]
        if explain:
            by_place = {
                place: [each.hit for each in hits if each.library == place] for place in fitting
            }
            reasons = of_each(_explain, {place: (own,) for place, own in by_place.items() if own})
            left = {place: iter(each) for place, each in reasons.items()}
            hits = [replace(each, why=next(left[each.library])) for each in hits]
    return LibraryHits(
        hits,
        places,
        {place: held[place].n_unsearchable for place in places},
        sum(each.n_cleaned for each in held.values()),
        notes,
    )


def _each_once(libraries: Sequence[StrPath]) -> tuple[list[str], list[str]]:
    """Return the places of libraries, each once, and what is to be said of the others."""
    if not libraries:
        raise LibraryError("Expected at least one library to search, but got none.")
    places: dict[str, str] = {}
    notes = []
    for library in libraries:
        address = address_of(library)
        whole = address or str(Path(library).resolve())
        if whole in places:
            notes.append(f"{library}: given twice, searched once")
            continue
        places[whole] = str(library)
        if address is None and not is_library(library):
            Library(library).close()  # raises: no library is there
    return list(places.values()), notes


def _shared(place: str) -> str:
    """Return a library's place for a process that may have another working folder."""
    return place if address_of(place) else str(Path(place).absolute())


def _searched(stack: ExitStack, place: str, original: bool) -> Retrieval:
    return Retrieval(stack.enter_context(Library(place, original=original)))


def _elsewhere(work: Callable[..., Answer], place: str, original: bool, *order: Any) -> Answer:
    """Open a library and do some work on it; runs in a worker."""
    with Library(place, original=original) as library:
        return work(Retrieval(library), *order)


def _hold(retrieval: Retrieval, asked: _Asked) -> _Held:
    catalogue = retrieval.library.catalogue
    n_unsearchable = len(catalogue.unsearchable())
    n_cleaned = sum(each.changes for each in catalogue.revisions().values())
    try:
        chosen = retrieval.chosen(asked.only)
    except NoClipFitsError as problem:
        return _Held(n_unsearchable, n_cleaned, refused=str(problem))
    longest = retrieval.longest(chosen)
    costs: tuple[FloatArray, ...] = ()
    size = int(chosen.sum()) if asked.whole else len(retrieval.index.frames)
    if not asked.is_one:
        index = retrieval.index_by(asked.weights, asked.joints, still=asked.still)
        costs = tuple(
            each
            for query, exact in ((asked.query, bool(asked.exact)), (asked.unlike, True))
            if query is not None
            for each in (
                (whole_costs(index, own, chosen, exact=exact) for own in query.performances())
                if asked.whole
                else (
                    sample_costs(index, template)
                    for template in query.templates(index.space, all_features=True)
                )
            )
        )
    return _Held(n_unsearchable, n_cleaned, None, longest, size, costs)


def _references(held: Sequence[_Held]) -> list[float]:
    """Return what a stretch taken at random from all libraries costs, for each template."""
    found = []
    for own in zip(*(each.costs for each in held), strict=True):
        weights = [
            np.full(len(costs), each.size / max(len(costs), 1))
            for each, costs in zip(held, own, strict=True)
        ]
        found.append(reference_of(np.concatenate(own), np.concatenate(weights)))
    return found


def _search(
    retrieval: Retrieval,
    asked: _Asked,
    references: Sequence[float] | None,
    k: int,
    max_distance: float,
) -> list[Hit]:
    query = asked.query
    if references is None:
        return retrieval.query(
            query.examples, k=k, only=asked.only,
            unlike=asked.unlike.examples if asked.unlike else (), joints=asked.joints,
            whole=asked.whole, mirror=query.mirror, expand=asked.expand, weights=asked.weights,
            max_distance=max_distance, exact=asked.exact,
        )  # fmt: skip
    index, chosen = (
        retrieval.index_by(asked.weights, asked.joints, still=asked.still),
        retrieval.chosen(asked.only),
    )
    shared: dict[str, Any] = {
        "k": k, "clips": chosen, "unlike": asked.unlike, "references": references,
    }  # fmt: skip
    if asked.whole:
        found = search_clips(index, query, exact=bool(asked.exact), **shared)
        found = [each for each in found if each.distance <= max_distance]
    else:
        found = search(index, query, exact=asked.exact, max_distance=max_distance, **shared)
    sought = Sought(query, asked.whole, asked.joints, asked.still)
    return [retrieval.hit(stretch, sought) for stretch in found]


def _ranked(found: Mapping[str, Sequence[Hit]], k: int) -> list[FoundHit]:
    """Return the k nearest of what libraries have."""
    hits = [FoundHit(place, hit) for place, own in found.items() for hit in own]
    return sorted(hits, key=lambda each: each.hit.distance)[:k]


def _told(hits: Sequence[FoundHit], nearest: Sequence[FoundHit]) -> list[FoundHit]:
    """Return hits with the share of their labels among the nearest."""
    told = with_label_shares(
        [each.hit for each in hits],
        [each.hit for each in nearest],
        [each.library for each in hits],
        [each.library for each in nearest],
    )
    return [replace(each, hit=hit) for each, hit in zip(hits, told, strict=True)]


def _explain(retrieval: Retrieval, hits: Sequence[Hit]) -> list[Agreement]:
    return [retrieval.agreement(hit) for hit in hits]
