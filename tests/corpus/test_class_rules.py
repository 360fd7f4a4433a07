from __future__ import annotations

import csv
import re
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mocapdb.corpus import CLASSES, classify_description, read_manifest
from mocapdb.corpus.class_rules import OTHER, RULES, UNKNOWN, normalise_description

CLASSES_PAGE = Path(__file__).parents[2] / "docs" / "classes.md"


@pytest.mark.parametrize(
    ("description", "expected"),
    [
        ("walk on uneven terrain", "walk"),
        ("Walk With Arms Out,\xa0 balancing", "walk"),
        ("run/jog, sudden stop", "run"),
        ("run, leap", "run"),
        ("jumping jacks, side twists, squats, jog", "run"),
        ("jump, balance", "jump"),
        ("Start Hop Stop", "jump"),
        ("playground - forward jumps, turn around", "playground"),
        ("climb 3 steps", "playground"),
        ("walk forward stepping up stairs", "stairs"),
        ("dance - cartwheel-like start, pirouettes, jete", "dance"),
        ("lindyHop2", "dance"),
        ("salsa dance", "salsa"),
        ("punch/strike", "box"),
        ("closing a box", "everyday"),
        ("Pick box up, bend from waist", "carry"),
        ("Punch and Kick", "martial arts"),
        ("soccer - kick ball", "sport"),
        ("swordplay", "sword"),
        ("Swing", "golf"),
        ("pushing a swing", "everyday"),
        ("Catch And Throw Football", "sport"),
        ("Toss and Catch", "throw"),
        ("walk, shake hands (2 subjects - subject A)", "interaction"),
        ("ghost (human subject)", "imitation"),
        ("Chicken Walk", "walk"),
        ("Chicken Dance", "dance"),
        ("chicken", "imitation"),
        ("Mickey sneaking walk", "sneak"),
        ("MotorCyclePose", "calibration"),
        ("FakeShotBreakRight \xa0 \xa0 CleanedGRs", "basketball"),
        ("Cartwheels001", "acrobatics"),
        ("180", "jump"),
        ("mop floor", "housework"),
        ("Mope", "emotion"),
        ("bend over, scoop up, rise, lift arm", OTHER),
        ("Unknown", UNKNOWN),
        ("clean", UNKNOWN),
        ("cleaning up", "housework"),
        ("106_15.amc", UNKNOWN),
        ("", UNKNOWN),
    ],
)
def test_class_of_a_description(description: str, expected: str) -> None:
    assert classify_description(description) == expected


def test_words_inside_other_words_do_not_count() -> None:
    assert classify_description("trunk, grunt, shopping, catwalkless") == OTHER


def test_rules_name_classes_of_the_vocabulary_and_every_class_has_one() -> None:
    assert {name for name, _ in RULES} | {OTHER} == set(CLASSES)


def test_vocabulary_is_small_and_fetchable_by_name() -> None:
    assert 25 <= len(CLASSES) <= 40
    assert all(re.fullmatch(r"[a-z]+( [a-z]+)?", name) for name in CLASSES)


def test_normalised_text() -> None:
    assert normalise_description("JumpSmallForward") == "jump small forward"
    assert normalise_description("Left_Punch_Sequence001") == "left punch sequence 001"
    assert normalise_description("A\xa0 \t b\n") == "a b"
    assert normalise_description("Pivoting \xa0 CleanedGRS") == "pivoting"


@given(st.text())
def test_any_text_has_a_class(text: str) -> None:
    assert classify_description(text) in CLASSES


def test_manifest_says_what_the_rules_say() -> None:
    wrong = [
        (entry.clip, entry.label)
        for entry in read_manifest()
        if classify_description(entry.description) != entry.label
    ]
    assert wrong == []


def test_documented_counts_are_those_of_the_manifest() -> None:
    rows = re.findall(r"^\| ([a-z ]+) \| (\d+) \| (.+) \|$", CLASSES_PAGE.read_text(), re.MULTILINE)
    counts = Counter(entry.label for entry in read_manifest())
    assert {name: int(count) for name, count, _ in rows} == {n: counts[n] for n in CLASSES}
    assert {name: meaning for name, _, meaning in rows} == dict(CLASSES)


def test_little_of_the_database_is_left_without_a_class() -> None:
    counts = Counter(entry.label for entry in read_manifest())
    assert counts[OTHER] < 0.02 * counts.total()


def test_agrees_with_the_labels_of_the_corpus(corpus: Path) -> None:
    """`other` may be told apart further; nothing else may be called differently."""
    with (corpus / "LABELS.csv").open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["path"].startswith("cmu/")]
    differing = {
        (row["description"], row["label"])
        for row in rows
        if row["label"] not in {classify_description(row["description"]), OTHER}
    }
    # The one exception: kicking a ball is no martial art.
    assert differing == {("soccer - kick ball", "martial arts")}
