"""Patterns of names, and the names that further columns may have."""

import pytest

from mocapdb.corpus.columns import RESERVED, check_column
from mocapdb.corpus.name_patterns import NamePattern
from mocapdb.errors import CorpusError


@pytest.mark.parametrize(
    ("pattern", "file", "fields"),
    [
        (
            "{dataset}_{label}_{style}_{take}",
            "a/dataset-2_raise-up-both-hands_normal_001.bvh",
            {
                "dataset": "dataset-2",
                "label": "raise-up-both-hands",
                "style": "normal",
                "take": "001",
            },
        ),
        ("{label}", "a b.bvh", {"label": "a b"}),
        ("take-{take}", "take-a-b.bvh", {"take": "a-b"}),
        ("{label}{take}", None, None),
        ("{label}__{take}", "a_b__c.bvh", {"label": "a_b", "take": "c"}),
        ("{a}({b})", "x(y).amc", {"a": "x", "b": "y"}),
        ("{subject}/{label}_{take}", "all/ana/walk_1.bvh",
         {"subject": "ana", "label": "walk", "take": "1"}),
        ("{Größe}_{take}", "groß_ü.bvh", {"Größe": "groß", "take": "ü"}),
        ("{label}.{take}", "walk.1.bvh", {"label": "walk", "take": "1"}),
    ],
)  # fmt: skip
def test_what_names_say(pattern, file, fields):
    if file is None:
        with pytest.raises(CorpusError, match="nothing between"):
            NamePattern(pattern)
        return
    assert NamePattern(pattern).fields(file) == fields


@pytest.mark.parametrize(
    ("pattern", "file"),
    [
        ("{label}_{take}", "walk.bvh"),
        ("{label}_{take}", "walk_old_1.bvh"),
        ("{label}_{take}", "_1.bvh"),
        ("{label}_{take}", "walk_.bvh"),
        ("take{take}", "clip1.bvh"),
        ("{subject}/{label}", "walk.bvh"),
        ("{label}-{take}", "walk_1.bvh"),
    ],
)
def test_names_that_do_not_fit(pattern, file):
    assert NamePattern(pattern).fields(file) is None


@pytest.mark.parametrize(
    ("pattern", "message"),
    [
        ("", "no field"),
        ("walk", "no field"),
        ("{label}_{label}", r"\{label\} twice"),
        ("{label}{take}", r"\{label\}\{take\} with nothing between"),
        ("{label}_{take", "a brace alone"),
        ("label}_{take}", "a brace alone"),
        ("{{label}}", "a brace alone"),
        ("{}_{take}", "but got ''"),
        ("{1st}_{take}", "but got '1st'"),
        ("{path}_{take}", "'path', which is reserved"),
        ("{sha256}", "'sha256', which is reserved"),
        ("{Label}_{take}", "'label' in small letters"),
        ("{Source}", "'Source', which is reserved"),
        ("{a=b}", "but got 'a=b'"),
    ],
)
def test_patterns_that_cannot_be(pattern, message):
    with pytest.raises(CorpusError, match=message):
        NamePattern(pattern)


def test_what_the_catalogue_says_of_a_clip_is_reserved():
    from mocapdb.library.clip_record import ClipRecord

    own = {"label", "description", "subject"}  # what labels may say
    assert set(ClipRecord.__dataclass_fields__) - own <= RESERVED


@pytest.mark.parametrize("name", ["style", "take", "Session 2", "body-mass", "größe", "v1.2"])
def test_columns_of_any_other_name(name):
    check_column(name)


@pytest.mark.parametrize("name", ["fps", "FPS", "deleted", "a\nb", "", " a", "a,b", 65 * "a"])
def test_columns_that_cannot_be(name):
    with pytest.raises(CorpusError):
        check_column(name)
