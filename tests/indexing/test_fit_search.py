"""The script that fits the numbers of search and recognition runs on any labelled clips."""

import sys
from pathlib import Path

import pytest

from mocapdb.corpus import synthetic

SCRIPTS = Path(__file__).parents[2] / "scripts"


@pytest.fixture
def fit_search(monkeypatch):
    monkeypatch.syspath_prepend(SCRIPTS)
    yield __import__("fit_search")
    sys.modules.pop("fit_search", None)


def test_a_floor_is_fitted_to_clips_of_two_people(fit_search, tmp_path, monkeypatch, capsys):
    synthetic.write_corpus(tmp_path, subjects=2, bvh_clips=0)
    monkeypatch.setattr(sys, "argv", ["fit_search.py", str(tmp_path), "--only", "floor"])
    assert fit_search.main() == 0
    first, line = capsys.readouterr().out.splitlines()
    assert first.startswith("12 clips of 6 classes by 2 people")
    assert line.startswith("FLOOR_M         shipped 0.15, fitted ")


def test_clips_without_labels_are_refused(fit_search, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["fit_search.py", str(tmp_path)])
    assert fit_search.main() == 1
    assert "LABELS.csv" in capsys.readouterr().err


@pytest.mark.parametrize(("scores", "fitted"), [((0.9, 0.9, 0.904), 2.0), ((0.9, 0.9, 0.91), 4.0)])
def test_a_shipped_value_that_is_as_good_stays(fit_search, scores, fitted):
    tried = dict(zip((1.0, 2.0, 4.0), scores, strict=True))
    assert fit_search.fit("A", 2.0, list(tried), lambda value: tried[value]) == fitted
