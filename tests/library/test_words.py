"""Clips found by words."""

import pytest
from small_library import build

from mocapdb import Library
from mocapdb.corpus import synthetic
from mocapdb.io import write_clip

TEXTS = {
    "01_01": ("walk", "strolls over to a ladder"),
    "01_02": ("run", "fast, with a leap at the end"),
    "02_01": ("jump", "on one leg"),
    "02_02": ("other", "was jogging; then walked"),
    "squat1Reps_3": ("lieDownFloor", ""),
    "raiseLeftHand": ("", "HDMfile"),
}


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    folder = tmp_path_factory.mktemp("words")
    labels = ["clip,label,description"]
    for number, (name, (label, text)) in enumerate(TEXTS.items()):
        clip = synthetic.make_clip("squat", seed=number, duration_s=0.4)
        write_clip(clip, folder / f"{name}.bvh")
        labels.append(f'{name},{label},"{text}"')
    (folder / "LABELS.csv").write_text("\n".join(labels) + "\n")
    build(folder, folder / "words.mocapdb")
    with Library(folder / "words.mocapdb") as opened:
        yield opened


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("walk", ["01_01", "02_02"]),  # the class before a word of the description
        ("Walking", ["01_01", "02_02"]),  # one stem
        ("stro", ["01_01"]),  # a beginning
        ("running", ["01_02", "02_02"]),  # itself before another word for it
        ("hop", ["02_01", "01_02"]),
        ("climb", ["01_01"]),
        ("walked jog", ["02_02"]),  # every word
        ("floor", ["squat1Reps_3"]),  # words within words
        ("downs rep", ["squat1Reps_3"]),
        ("flo squats", ["squat1Reps_3"]),
        ("lying down", ["squat1Reps_3"]),
        ("left arm", ["raiseLeftHand"]),
        ("squat1", ["squat1Reps_3"]),
        ("01_0", ["01_01", "01_02"]),
        ('leg" OR label:"walk', []),  # no syntax of the index's own
        ("- * ( NEAR", []),
        (" ", sorted(TEXTS)),
    ],
)
def test_words_find_clips_the_best_first(library, text, names):
    assert [record.name for record in library.records(search=text)] == names


def test_a_search_does_not_write(library):
    file = library.path / "catalogue.db"
    before = file.read_bytes()
    library.records(search="jumps")
    assert file.read_bytes() == before
