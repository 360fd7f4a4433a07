"""How much of a library a report looks at: the numbers of `mocapdb.report.tuning`."""

from types import SimpleNamespace

import pytest

from mocapdb.errors import NoPeriodError
from mocapdb.report import Effort
from mocapdb.report.library_findings import (
    confusion_across_subjects,
    cycles_of_classes,
    find_faults,
    rate_curves,
)


def silent(_):
    pass


def test_what_the_docs_say():
    """Five minutes searched for faults, four clips encoded again; a page of cycles."""
    assert Effort() == Effort(curves=4, recognised=1000, fault_seconds=300.0, cycle_clips=160)


@pytest.mark.parametrize(
    ("n_classes", "most_clips", "clips_each"), [(3, 160, 8), (40, 160, 4), (200, 160, 2), (3, 0, 8)]
)
def test_every_class_has_its_cycle_or_a_reason(monkeypatch, n_classes, most_clips, clips_each):
    """Of many classes fewer clips; what the library keeps comes whatever is asked for."""
    asked = []

    def class_cycle(library, label, *, most_clips):
        asked.append((label, most_clips))
        if label == "c001":
            raise NoPeriodError("nothing repeats")
        return label

    kept = [{"class": "kept"}]
    monkeypatch.setattr("mocapdb.library.cycles_file.list_cycles", lambda path: kept)
    monkeypatch.setattr("mocapdb.library.searching.class_cycles.class_cycle", class_cycle)
    labels = [f"c{i:03}" for i in range(n_classes)] if most_clips else []
    classes = dict.fromkeys(["kept", *labels], 1)
    cycles = cycles_of_classes(
        SimpleNamespace(path="x", classes=lambda: classes), most_clips, silent
    )
    assert cycles.found == [each for each in (*labels, "kept") if each != "c001"]
    assert cycles.without == ({"c001": "nothing repeats"} if labels else {})
    if most_clips:
        assert {each for _, each in asked} == {clips_each}


def test_a_stretch_in_the_middle_of_a_clip_is_encoded_at_each_target(monkeypatch):
    asked = []

    def encode(clip, target):
        asked.append((clip, target.kind, target.value))
        error = SimpleNamespace(vertices=SimpleNamespace(mean=target.value))
        return SimpleNamespace(data=bytes(100), error=error)

    monkeypatch.setattr("mocapdb.compression.encode", encode)
    record = SimpleNamespace(name="long", label="walk", frames=1000, fps=100.0)
    library = SimpleNamespace(
        records=lambda: [record], clip=lambda name, frames: range(1000)[frames]
    )
    (curve,) = rate_curves(library, 1, silent)
    assert asked == [(range(375, 625), "mean_mm", mm) for mm in (0.3, 1.0, 3.0, 10.0)]
    assert curve.points[1] == (100 / 250, 1.0)


@pytest.fixture
def folds(monkeypatch):
    """The subjects that each class index learns from."""
    learned = []

    class ClassIndex:
        def fit(self, motions, labels, groups):
            learned.append(set(groups))
            return self

        def classify(self, motion):
            return SimpleNamespace(label="walk")

    monkeypatch.setattr("mocapdb.indexing.recognition.class_models.ClassIndex", ClassIndex)
    monkeypatch.setattr(
        "mocapdb.library.searching.retrieval.Retrieval", lambda library: library.retrieval
    )
    return learned


def labelled(*clips):
    records = [SimpleNamespace(performer=stem[:2], label=label) for stem, label in clips]
    return SimpleNamespace(retrieval=SimpleNamespace(records=records, motions=list(clips)))


def test_many_subjects_are_dealt_to_five_folds(folds):
    found = confusion_across_subjects(labelled(*((f"{i:02}_01", "walk") for i in range(11))), 99)
    assert len(found.truth) == 11
    assert [len(others) for others in folds] == [8, 9, 9, 9, 9]


def test_two_subjects_are_enough_and_one_is_not(folds):
    clips = (("01_01", "walk"), ("02_01", "walk"), ("02_02", "box"))
    assert confusion_across_subjects(labelled(*clips), 99).truth == ["walk", "walk"]
    assert confusion_across_subjects(labelled(*clips[1:]), 99) is None


def test_a_clip_that_would_take_half_as_long_again_is_passed_over(monkeypatch):
    nothing = SimpleNamespace(spans=())
    monkeypatch.setattr("mocapdb.cleaning.detect_faults", lambda clip: nothing)
    captured = "mocapdb.library.building.revise_clips.captured_clip"
    monkeypatch.setattr(captured, lambda stored: stored)
    durations = (0.0, 8.0, 0.0, 8.4, 0.0, 5.0)  # those at 1, 3 and 5 are drawn
    records = [SimpleNamespace(name=f"{i}", duration_s=d) for i, d in enumerate(durations)]
    library = SimpleNamespace(
        records=lambda: records,
        stored=lambda record, _: record.name,
        catalogue=SimpleNamespace(revisions=dict),
    )
    found = find_faults(library, 11.0, silent)
    assert (found.clips, found.seconds) == (2, pytest.approx(16.4))
