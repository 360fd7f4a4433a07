import json
import re
from dataclasses import replace

import numpy as np
import pytest
from small_library import run, run_json

from mocapdb.corpus import synthetic
from mocapdb.errors import LibraryError
from mocapdb.library import Library
from mocapdb.report import Effort, write_report
from mocapdb.report.library_findings import (
    confusion_across_subjects,
    cycles_of_classes,
    evenly,
    find_faults,
    rate_curves,
)
from mocapdb.report.page import table

LITTLE = Effort(curves=0, recognised=0, fault_seconds=1.0, cycle_clips=0)


def silent(_):
    pass


@pytest.fixture(scope="module")
def library(small_library_template):
    with Library(small_library_template) as opened:
        yield opened


def test_a_page_with_every_part(seen_library, seen_report):
    path, figures = seen_report
    text = path.read_text(encoding="utf-8")
    parts = re.findall(r'<section id="(\w+)">', text)
    assert parts == ["contents", "size", "classes", "faults", "cycles", "clips"]
    assert figures["clips"] == 4
    assert figures["flagged"] >= 1
    assert figures["cycles"] == ["run", "walk"]
    assert figures["bytes"] == path.stat().st_size
    assert not re.search(r"https?:|\bsrc=\"(?!data:)|@import|fetch\(|url\(", text)
    assert "sure (%)" in text
    with Library(seen_library) as opened:
        assert all(record.name in text for record in opened.records())
    assert [file.name for file in path.parent.iterdir()] == ["report.html"]


def test_joints_that_lost_most_are_listed(library):
    """Once each, though a joint may be the worst of its clip too."""
    from mocapdb.report import sections

    info = library.info()
    made = sections._joint_losses(info)
    assert info["joints"][0]["joint"] in made
    assert made.count("<tr>") <= 1 + len(info["joints"]) + len(info["worst_clips"])
    old = info | {"joints": [], "worst_clips": [], "unmeasured": 3}
    assert sections._joint_losses(old) == (
        '<p class="soft">Not measured of 3 clips: rebuild them.</p>'
    )


def test_an_interrupted_report_leaves_the_old_one(library, tmp_path):
    path = tmp_path / "report.html"
    path.write_text("as it was")

    def stop(done, total, name):
        if done == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_report(library, path, effort=LITTLE, progress=stop)
    assert path.read_text() == "as it was"
    assert len(list(tmp_path.iterdir())) == 1


def test_names_cannot_break_the_page():
    assert "<script>" not in table(["<script>"], [["<script>alert(1)</script>", 2.0]])


def test_clips_are_drawn_evenly():
    assert evenly(range(5), 9) == [0, 1, 2, 3, 4]
    drawn = evenly(range(100), 7)
    assert len(drawn) == 7
    assert np.ptp(np.diff(drawn)) <= 1


def test_more_error_costs_less(library):
    (curve,) = rate_curves(library, 1, silent)
    rates = [rate for rate, _ in curve.points]
    errors = [error for _, error in curve.points]
    assert rates == sorted(rates, reverse=True)
    assert errors == sorted(errors)


def test_classes_need_two_subjects(seen_library):
    with Library(seen_library) as opened:  # one subject
        assert confusion_across_subjects(opened, 100) is None


def test_classes_need_features(library):
    assert confusion_across_subjects(library, 100) is None


def test_classes_are_recognised_by_what_others_do(tmp_path):
    from small_library import build

    from mocapdb.io import write_clip

    for person in ("01", "02"):
        body = synthetic.subject(int(person))
        for trial, kind in enumerate(("walk", "squat"), start=1):
            (tmp_path / "corpus" / kind).mkdir(parents=True, exist_ok=True)
            clip = synthetic.make_clip(kind, seed=trial, skeleton=body, duration_s=1.5)
            write_clip(clip, tmp_path / "corpus" / kind / f"{person}_0{trial}.bvh")
    build(tmp_path / "corpus", tmp_path / "two.mocapdb", index=True)
    with Library(tmp_path / "two.mocapdb") as opened:
        found = confusion_across_subjects(opened, 100)
    assert sorted(found.truth) == ["squat", "squat", "walk", "walk"]
    assert found.right == np.mean([a == b for a, b in zip(found.truth, found.answers, strict=True)])
    assert found.right >= 0.75


def test_faults_are_found(seen_library):
    with Library(seen_library) as opened:
        found = find_faults(opened, 60.0, silent)
        assert found.clips == 4
        assert found.worst[0][0].name == "01_03"
    assert found.spans == sum(len(digression.spans) for _, digression in found.worst)


def test_little_time_looks_at_few_clips(seen_library):
    with Library(seen_library) as opened:
        assert find_faults(opened, 1.0, silent).clips == 1


def test_a_class_in_which_nothing_repeats_has_no_cycle(library):
    cycles = cycles_of_classes(library, 2, silent)
    labels = {each.cycle.name for each in cycles.found}
    assert labels | set(cycles.without) == set(library.classes())
    assert cycles.without  # clips of half a second: few hold two laps


def test_every_class_is_shown(library, monkeypatch):
    """However many there are, and not the first of them with the others summed up."""
    from mocapdb.report import sections

    shown = {}

    def class_durations(seconds, clips, *, most, ax):
        shown.update(seconds=seconds, most=most)

    monkeypatch.setattr(sections.plots, "class_durations", class_durations)
    record, *_ = library.records()
    sections.overview(library.info(), [replace(record, label=f"c{i}") for i in range(40)])
    assert len(shown["seconds"]) == 40 <= shown["most"]


def test_of_what_was_not_measured_nothing_is_said(library):
    from mocapdb.report import sections

    records = library.records()
    assert sections.clips(records, {}).count('data-value="-1e999">–<') == 2 * len(records)


def test_an_empty_library(tmp_path):
    from mocapdb.library.writing.open_for_writing import open_for_writing

    with open_for_writing(tmp_path / "empty.mocapdb", create=True):
        pass
    result = run("report", tmp_path / "empty.mocapdb", "-o", tmp_path / "r.html")
    assert result.exit_code == 1
    assert "the library is empty" in result.stderr
    with Library(tmp_path / "empty.mocapdb") as opened, pytest.raises(LibraryError, match="empty"):
        write_report(opened, tmp_path / "r.html")


def test_the_command(small_library_template, tmp_path, monkeypatch):
    monkeypatch.setattr("mocapdb.report.Effort", lambda fault_seconds: LITTLE)
    path = tmp_path / "r.html"
    figures = run_json("report", small_library_template, "-o", path)
    assert figures["output"] == str(path)
    assert json.dumps(figures["cycles"])
    result = run("report", small_library_template, "-o", tmp_path / "missing" / "r.html")
    assert result.exit_code == 1
    assert "can be written" in result.stderr
