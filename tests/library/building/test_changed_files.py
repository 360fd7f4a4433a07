"""A build plans only what has changed, and comes to what a build that plans everything comes to."""

from __future__ import annotations

import random
import shutil
import sqlite3
from contextlib import closing

import pytest
from small_library import build, sound, write_clips

from mocapdb.corpus import synthetic
from mocapdb.io import write_clip
from mocapdb.library import Library, apply_labels, compact_library
from mocapdb.library.building import build as building
from mocapdb.library.building import file_states

COLUMNS = "name, stem, label, label_source, description, corpus, source, source_sha256, settings, "
COLUMNS += "fps, fps_source, subject, subject_source, columns"


@pytest.fixture(autouse=True)
def settled(monkeypatch):
    """Files that were changed a moment ago are trusted, too."""
    monkeypatch.setattr(file_states, "SETTLED_NS", 0)


@pytest.fixture
def parts(monkeypatch):
    """What builds have planned: None for everything, else the files."""
    planned = []

    def noted(*args, **options):
        plan = make_plan(*args, **options)
        planned.append(None if plan.part is None else plan.part.files)
        return plan

    make_plan = building.make_plan
    monkeypatch.setattr(building, "make_plan", noted)
    return planned


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    folder = tmp_path_factory.mktemp("changed")
    root = folder / "corpus"
    for kind in ("walk", "run"):
        write_clips(root, {f"{kind}/07_0{n}.bvh": (kind, n) for n in (1, 2)})
    write_clips(root, {"top.bvh": ("walk", 5), "walk/more/08_01.bvh": ("hop", 1)})
    build(root, folder / "l.mocapdb")
    return folder


@pytest.fixture
def corpus(template, tmp_path):
    """A corpus whose library knows how its files look."""
    shutil.copytree(template, tmp_path, dirs_exist_ok=True)
    build(tmp_path / "corpus", tmp_path / "l.mocapdb")
    return tmp_path / "corpus"


def library_of(corpus):
    return corpus.parent / "l.mocapdb"


def again(corpus, **options):
    report = build(corpus, library_of(corpus), **options)
    return report.built, report.skipped


def content(library):
    with closing(sqlite3.connect(library / "catalogue.db")) as database:
        return database.execute(
            f"SELECT {COLUMNS} FROM clips WHERE deleted IS NULL ORDER BY name"
        ).fetchall()


def forget_plans(library):
    with closing(sqlite3.connect(library / "catalogue.db")) as database:
        database.execute("DELETE FROM plans")
        database.execute("DELETE FROM checksums WHERE of = 'plans'")
        database.commit()


def test_nothing_is_planned_where_nothing_has_changed(corpus, parts):
    assert [again(corpus), again(corpus)] == [(0, 6), (0, 6)]
    assert parts == [[], []]
    assert sound(library_of(corpus))


def test_only_new_and_changed_files_are_planned(corpus, parts):
    write_clips(corpus, {"run/09_01.bvh": ("run", 9), "walk/07_01.bvh": ("walk", 8)})
    assert again(corpus) == (2, 5)
    assert again(corpus) == (0, 7)
    assert parts == [["run/09_01.bvh", "walk/07_01.bvh"], []]


def test_a_new_file_with_a_stem_that_was_alone_renames_the_clip(corpus, parts):
    write_clips(corpus, {"run/08_01.bvh": ("run", 9)})
    assert again(corpus) == (1, 6)
    assert parts == [["run/08_01.bvh"]]
    with Library(library_of(corpus)) as library:
        assert library.record("run/08_01").source == "run/08_01.bvh"
        assert library.record("walk/more/08_01").source == "walk/more/08_01.bvh"


@pytest.mark.parametrize(
    "change",
    [
        lambda corpus: (corpus / "run/07_01.bvh").rename(corpus / "run/09_09.bvh"),
        lambda corpus: shutil.copy(corpus / "run/07_01.bvh", corpus / "run/09_09.bvh"),
        lambda corpus: shutil.rmtree(corpus / "walk/more"),
        lambda corpus: (corpus / "mocapdb.toml").write_text("up = 'y'"),
        lambda corpus: (corpus / "walk/mocapdb.toml").write_text("unit_m = 0.01"),
        lambda corpus: (corpus / "LABELS.csv").write_text("clip,label\ntop,stroll\n"),
        lambda corpus: write_clips(corpus, {"run/07_01.amc": ("run", 3)}),
    ],
)
def test_all_is_planned_where_more_than_files_has_changed(corpus, parts, change):
    change(corpus)
    twin = shutil.copytree(library_of(corpus), corpus.parent / "twin.mocapdb")
    forget_plans(twin)
    report, expected = build(corpus, library_of(corpus)), build(corpus, twin)
    assert parts == [None, None]
    assert content(library_of(corpus)) == content(twin)
    assert (report.built, report.skipped) == (expected.built, expected.skipped)
    again(corpus)
    assert parts[2] == []


def test_what_labels_and_patterns_fit_no_file_is_told_each_time(corpus, parts):
    (corpus / "LABELS.csv").write_text("clip,label\ntop,stroll\nnobody,walk\nsomebody,walk\n")
    (corpus / "mocapdb.toml").write_text('["nowhere/*.bvh"]\nup = "y"\n')
    told = [build(corpus, library_of(corpus)).assumed.warnings for _ in range(2)]
    assert told[0] == told[1] != []
    assert "2 of 3 rows of the labels fit no file, such as 'nobody'" in told[1]
    write_clips(corpus, {"walk/nobody.bvh": ("walk", 8)})
    told = build(corpus, library_of(corpus)).assumed.warnings
    assert "1 of 3 rows of the labels fit no file, such as 'somebody'" in told
    assert told == build(corpus, library_of(corpus)).assumed.warnings
    assert parts == [None, [], ["walk/nobody.bvh"], []]


def test_a_bad_file_is_tried_each_time_and_alone(corpus, parts):
    (corpus / "run/bad.bvh").write_text("HIERARCHY\nnonsense")
    for _ in range(3):
        report = build(corpus, library_of(corpus))
        assert [failure.path for failure in report.failed] == [str(corpus / "run/bad.bvh")]
        assert report.skipped == 6
    assert parts == [["run/bad.bvh"]] * 3


def test_a_label_of_classify_is_looked_at_once(corpus, parts):
    apply_labels(library_of(corpus), {"top": "stroll"})
    again(corpus)
    again(corpus)
    assert parts == [["top.bvh"], []]
    with Library(library_of(corpus)) as library:
        assert library.record("top").label == "stroll"


def test_some_files_only_or_all_anew(corpus, parts):
    assert again(corpus, only=lambda file: file.startswith("run/")) == (0, 2)
    assert again(corpus, rehash=True) == (0, 6)
    assert again(corpus) == (0, 6)
    assert parts == [None, None, []]


def test_a_library_of_two_corpora(corpus, parts):
    other = corpus.parent / "other"
    write_clips(other, {"walk/07_01.bvh": ("walk", 30), "top.bvh": ("walk", 31)})
    build(other, library_of(corpus))
    assert again(corpus) == (0, 6)
    assert build(other, library_of(corpus)).skipped == 2
    assert parts[0] is None
    assert again(corpus) == (0, 6)
    assert parts[-1] == []


def change_something(corpus, chance, number):
    """Do something at random to a corpus: add, change, copy, move, spoil or remove a file."""
    files = sorted(path for path in corpus.rglob("*.bvh"))
    some = chance.choice(files)
    folder = chance.choice(["", "walk", "run", "walk/more", "new"])
    place = corpus / folder / f"{chance.choice(['07_01', '08_01', 'top', f'n{number}'])}.bvh"
    what = chance.choice(["add", "add", "change", "copy", "move", "remove", "spoil"])
    place.parent.mkdir(exist_ok=True)
    if what == "add" or len(files) < 3:
        write_clip(synthetic.make_clip("walk", seed=number, duration_s=0.2), place)
    elif what == "change":
        write_clip(synthetic.make_clip("run", seed=number, duration_s=0.2), some)
    elif what == "copy" and some != place:
        shutil.copy(some, place)
    elif what == "move":
        some.rename(place)
    elif what == "remove":
        some.unlink()
    else:
        some.write_text("nonsense")


@pytest.mark.parametrize("seed", range(3))
def test_any_changes_come_to_what_planning_all_comes_to(corpus, parts, seed):
    """Of two libraries of one corpus, one forgets before each build what it has planned."""
    chance = random.Random(seed)
    library, twin = library_of(corpus), corpus.parent / "twin.mocapdb"
    shutil.copytree(library, twin)
    for number in range(8):
        for i in range(chance.randrange(1, 3)):
            change_something(corpus, chance, 100 * seed + 10 * number + i)
        forget_plans(twin)
        report, expected = build(corpus, library), build(corpus, twin)
        assert content(library) == content(twin)
        assert (report.built, report.skipped) == (expected.built, expected.skipped)
        assert report.failed == expected.failed
        if chance.random() < 0.2:
            compact_library(library)
    assert any(part is not None for part in parts)
    assert sound(library)


def test_a_corpus_whose_clips_another_one_took_over_is_planned_anew(corpus, parts):
    library, copy = corpus.with_name("l.mocapdb"), corpus.with_name("copy")
    shutil.copytree(corpus, copy)
    taking = build(copy, library)  # the same files: the clips are the copy's now
    assert taking.built == 0
    (told,) = taking.assumed.warnings
    assert told.startswith(f"clips that were of the same files in {corpus} and are of this folder")
    assert "now: 6." in told
    write_clips(copy, {"top.bvh": ("run", 9)})
    assert build(copy, library).built == 1
    parts.clear()
    report = build(corpus, library)
    assert parts == [None]
    assert report.built == 1  # its own top.bvh had been in no clip
    fresh = corpus.with_name("fresh.mocapdb")
    build(corpus, fresh)
    with Library(library) as ours, Library(fresh) as theirs:
        own = {record.source_sha256 for record in ours.records() if record.corpus == str(corpus)}
        assert own == {record.source_sha256 for record in theirs.records()}
    assert sound(library)
