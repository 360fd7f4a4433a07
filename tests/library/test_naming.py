"""Names of clips: unique, whatever the order, and short where nothing speaks against it."""

from __future__ import annotations

from collections import Counter
from pathlib import PurePosixPath

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mocapdb.errors import LibraryError
from mocapdb.library.naming import SourceFile, clip_names, subject_of

PARTS = st.sampled_from(["a", "b", "01", "01_01", "x.amc", "ä ö"])
FILES = st.builds(
    lambda corpus, folders, stem, suffix: SourceFile(corpus, "/".join([*folders, stem + suffix])),
    st.sampled_from(["/one/cmu", "/one/hdm"]),
    st.lists(PARTS, max_size=2),
    PARTS,
    st.sampled_from([".amc", ".bvh", ".AMC"]),
)


def names_of(*files: SourceFile) -> dict[SourceFile, str]:
    return clip_names({file: file for file in files})


@given(st.sets(FILES, max_size=12))
def test_names_are_unique(files):
    names = names_of(*files)
    assert set(names) == files
    assert len(set(names.values())) == len(files)


@given(st.sets(FILES, max_size=12), st.randoms())
def test_names_do_not_depend_on_the_order(files, random):
    shuffled = sorted(files)
    random.shuffle(shuffled)
    assert names_of(*shuffled) == names_of(*sorted(files))


@given(st.sets(FILES, max_size=12))
def test_a_stem_that_is_alone_is_the_name_and_no_other_is(files):
    names = names_of(*files)
    stems = Counter(PurePosixPath(file.path).stem for file in files)
    for file, name in names.items():
        stem = PurePosixPath(file.path).stem
        assert (name == stem) >= (stems[stem] == 1)
        if stems[stem] > 1 and "/" in file.path:
            assert name != stem


def test_each_spelling_in_turn():
    cmu, hdm = "/data/cmu", "/data/hdm"
    alone = SourceFile(cmu, "02/02_01.amc")
    one, other = SourceFile(cmu, "01/walk.amc"), SourceFile(cmu, "bvh/walk.bvh")
    amc, bvh = SourceFile(cmu, "03/run.amc"), SourceFile(cmu, "03/run.bvh")
    here, there = SourceFile(cmu, "04/hop.amc"), SourceFile(hdm, "04/hop.amc")
    assert names_of(alone, one, other, amc, bvh, here, there) == {
        alone: "02_01",
        one: "01/walk",
        other: "bvh/walk",
        amc: "03/run.amc",
        bvh: "03/run.bvh",
        here: "cmu/04/hop.amc",
        there: "hdm/04/hop.amc",
    }


def test_a_path_that_is_anothers_stem_is_not_taken_twice():
    top, deep = SourceFile("/c", "a.amc"), SourceFile("/c", "b/a.amc")
    assert names_of(top, deep) == {top: "a", deep: "b/a"}


def test_folders_of_one_name_cannot_be_told_apart():
    with pytest.raises(LibraryError, match=r"'01\.amc' is in /old/cmu and /new/cmu"):
        names_of(SourceFile("/old/cmu", "01.amc"), SourceFile("/new/cmu", "01.amc"))


@pytest.mark.parametrize(
    ("stem", "subject"),
    [
        ("07_01", "07"),
        ("144_34", "144"),
        ("07_05-walk", "07"),
        ("HDM_bd_squat1Reps_001_120", "HDM_bd"),
        ("07_01_poses", "07"),
        ("37_10km", ""),
        ("dataset-1_bow", ""),
        ("dataset-2_walk-turn-left_normal_001", ""),
        ("walk_old_1", ""),
        ("walk", ""),
        ("2019_01", ""),
        ("20_2019", ""),
        ("HDM_bdx_squat", ""),
        ("", ""),
    ],
)
def test_nobody_is_guessed_a_person(stem, subject):
    assert subject_of(stem) == subject
