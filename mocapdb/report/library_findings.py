"""What a report has to say of a library, each with the effort that it may take.

The whole of a large library is neither recoded nor searched for faults: clips are drawn from it
evenly, and the report says how many.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from mocapdb.errors import LibraryError, MocapdbError, NoPeriodError
from mocapdb.report.tuning import (
    CURVE_SECONDS,
    CYCLE_CLIPS,
    FOLDS,
    LEAST_CYCLE_CLIPS,
    LEAST_PERFORMERS,
    MOST_OVER_FAULT_SECONDS,
    TARGETS_MM,
)

if TYPE_CHECKING:
    from mocapdb.cleaning import MovementDigressionMap
    from mocapdb.cycles import ClassCycle
    from mocapdb.library import Library
    from mocapdb.library.clip_record import ClipRecord

__all__ = [
    "Confusion",
    "Curve",
    "Cycles",
    "Faults",
    "confusion_across_subjects",
    "cycles_of_classes",
    "find_faults",
    "rate_curves",
]

Step = Callable[[str], None]
Item = TypeVar("Item")


def evenly(items: Sequence[Item], most: int) -> list[Item]:
    """Return at most so many items, spread evenly."""
    if len(items) <= most:
        return list(items)
    return [items[(2 * i + 1) * len(items) // (2 * most)] for i in range(most)]


@dataclass(frozen=True)
class Confusion:
    """What clips are, and what they were taken for by classes learned from other people."""

    truth: list[str]
    answers: list[str]

    @property
    def right(self) -> float:
        """Share of the clips that were recognised."""
        pairs = zip(self.truth, self.answers, strict=True)
        return sum(a == b for a, b in pairs) / len(self.truth)


def confusion_across_subjects(library: Library, most_clips: int) -> Confusion | None:
    """Recognise each labelled clip by what others perform; None where that cannot be done.

    It takes an index, and a class performed by two subjects at least. Subjects are dealt to five
    folds at most.
    """
    from mocapdb.indexing.recognition.class_models import ClassIndex
    from mocapdb.library.searching.retrieval import Retrieval

    try:
        retrieval = Retrieval(library)
    except LibraryError:
        return None
    numbers = [i for i, record in enumerate(retrieval.records) if record.label is not None]
    numbers = evenly(numbers, most_clips)
    who = {i: retrieval.records[i].performer for i in numbers}
    label = {i: str(retrieval.records[i].label) for i in numbers}
    performers = defaultdict(set)
    for i in numbers:
        performers[label[i]].add(who[i])
    numbers = [i for i in numbers if len(performers[label[i]]) >= LEAST_PERFORMERS]
    subjects = sorted({who[i] for i in numbers})
    if len(subjects) < 2:
        return None
    fold = {subject: i % FOLDS for i, subject in enumerate(subjects)}
    motions = {i: retrieval.motions[i] for i in numbers}
    truth, answers = [], []
    for left_out in sorted(set(fold.values())):
        others = [i for i in numbers if fold[who[i]] != left_out]
        own = [i for i in numbers if fold[who[i]] == left_out]
        index = ClassIndex().fit(
            [motions[i] for i in others],
            [label[i] for i in others],
            groups=[who[i] for i in others],
        )
        for i in own:
            truth.append(label[i])
            answers.append(index.classify(motions[i]).label or "none")
    return Confusion(truth, answers)


@dataclass(frozen=True)
class Curve:
    """What the error of a clip costs: (bytes a frame, mean mm) at several targets."""

    name: str
    points: list[tuple[float, float]]


def rate_curves(library: Library, most_clips: int, step: Step) -> list[Curve]:
    """Encode a stretch of some clips, of different classes, again at several targets."""
    from mocapdb.compression import Target, encode

    by_class: dict[str, list[ClipRecord]] = defaultdict(list)
    for record in library.records():
        by_class[record.label or "no class"].append(record)
    classes = sorted(by_class, key=lambda label: -len(by_class[label]))[:most_clips]
    curves = []
    for label in classes:
        record = by_class[label][len(by_class[label]) // 2]
        step(record.name)
        frames = min(record.frames, round(CURVE_SECONDS * record.fps))
        start = (record.frames - frames) // 2
        clip = library.clip(record.name, slice(start, start + frames))
        points = []
        for mm in TARGETS_MM:
            payload = encode(clip, Target("mean_mm", mm))
            points.append((len(payload.data) / len(clip), payload.error.vertices.mean))
        curves.append(Curve(f"{record.name} ({label})", points))
    return curves


@dataclass(frozen=True)
class Faults:
    """What was flagged in the clips that were looked at.

    Attributes
    ----------
    clips, seconds : int, float
        How much was looked at.
    by_joint : dict of str to Counter
        Kinds by joint.
    worst : list of (ClipRecord, MovementDigressionMap)
        Clips with flagged spans, those with the most first.
    problems : dict of str to str
        Clips that could not be looked at, and why.
    cleaned : int
        Clips of the library that have a cleaned revision.
    """

    clips: int
    seconds: float
    by_joint: dict[str, Counter[str]]
    worst: list[tuple[ClipRecord, MovementDigressionMap]]
    problems: dict[str, str]
    cleaned: int = 0

    @property
    def spans(self) -> int:
        """How many spans were flagged."""
        return sum(sum(kinds.values()) for kinds in self.by_joint.values())


def find_faults(library: Library, most_seconds: float, step: Step) -> Faults:
    """Look for faults in captures drawn evenly, as many as `most_seconds` hold.

    In clips that were cleaned since, too: what is told is what was captured, as the file holds it
    if it is there, since cleaning looks at that.
    """
    from mocapdb.cleaning import detect_faults
    from mocapdb.library.building.revise_clips import captured_clip

    records = library.records()
    total = sum(record.duration_s for record in records)
    share = min(1.0, most_seconds / max(total, 1e-9))
    chosen = evenly(records, max(1, round(share * len(records))))
    by_joint: dict[str, Counter[str]] = defaultdict(Counter)
    found: list[tuple[ClipRecord, MovementDigressionMap]] = []
    problems: dict[str, str] = {}
    seconds = 0.0
    looked = 0
    for record in chosen:
        if looked and seconds + record.duration_s > MOST_OVER_FAULT_SECONDS * most_seconds:
            continue
        step(record.name)
        try:
            digression = detect_faults(captured_clip(library.stored(record, record)))
        except MocapdbError as problem:  # damaged bytes, or no joint that rotates
            problems[record.name] = str(problem)
            continue
        looked += 1
        seconds += record.duration_s
        for span in digression.spans:
            by_joint[digression.skeleton.names[span.joint]][span.kind] += 1
        if digression.spans:
            found.append((record, digression))
    found.sort(key=lambda pair: -sum(span.confidence for span in pair[1].spans))
    cleaned = sum(revision.changes for revision in library.catalogue.revisions().values())
    return Faults(looked, seconds, dict(by_joint), found, problems, cleaned)


@dataclass(frozen=True)
class Cycles:
    """The cycles of a library's classes.

    Attributes
    ----------
    found : list of ClassCycle
        By class.
    without : dict of str to str
        Classes that have none, and why.
    """

    found: list[ClassCycle]
    without: dict[str, str]


def cycles_of_classes(library: Library, most_clips: int, step: Step) -> Cycles:
    """Return the cycle of every class: the one that a library keeps, or a mean over some clips.

    Parameters
    ----------
    library : Library
    most_clips : int
        Clips that the means of all classes together are made of, but two of each class at least;
        with 0 only what the library keeps is returned.
    step : callable
        Told the class at work.
    """
    from mocapdb.library.cycles_file import list_cycles
    from mocapdb.library.searching.class_cycles import class_cycle

    kept = {str(row["class"]) for row in list_cycles(library.path)}
    to_make = set(library.classes()) - kept if most_clips else set()
    each = min(max(LEAST_CYCLE_CLIPS, most_clips // max(len(to_make), 1)), CYCLE_CLIPS)
    cycles = Cycles([], {})
    for label in sorted(kept | to_make):
        step(label)
        try:
            cycles.found.append(class_cycle(library, label, most_clips=each))
        except NoPeriodError as problem:
            cycles.without[label] = str(problem)
    return cycles


def seconds_by_class(records: Iterable[ClipRecord]) -> tuple[dict[str, float], dict[str, int]]:
    """Return the duration and the number of the clips of each class."""
    seconds: dict[str, float] = defaultdict(float)
    clips: Counter[str] = Counter()
    for record in records:
        label = record.label or "no class"
        seconds[label] += record.duration_s
        clips[label] += 1
    return dict(seconds), dict(clips)
