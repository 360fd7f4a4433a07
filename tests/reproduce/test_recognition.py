import csv
from importlib.resources import files

import numpy as np
import pytest

from mocapdb.errors import CorpusError
from mocapdb.reproduce.recognition import TABLES, _threshold, _transposed, reproduce


def figures():
    table = files("mocapdb.reproduce").joinpath("data", "okane2008_tables.csv")
    with table.open(encoding="utf-8") as file:
        return [row for row in csv.DictReader(file) if row["table"] in TABLES]


def test_the_run_row_counts_560_frames():
    shares = [float(row["value"]) for row in figures() if row["row"] == "run class"]
    assert len(shares) == 12
    for share in shares:
        assert round(100 * round(share * 5.6) / 560, 2) == share
    columns = [float(row["value"]) for row in figures() if row["column"] == "test boxing"]
    assert any(round(100 * round(share * 5.6) / 560, 2) != share for share in columns)


def test_so_rows_are_test_sets():
    assert _transposed("run class", "test boxing") == ("boxing class", "test run")
    assert _transposed("walk class", "test walks") == ("walk class", "test walks")


def test_shares_over_the_threshold_add_up_to_three():
    rng = np.random.default_rng(0)
    cells = [rng.normal(mean, 1, 500) for mean in range(9)]
    threshold = _threshold(cells, 3.0)
    assert sum((cell > threshold).mean() for cell in cells) == pytest.approx(3, abs=0.01)


def test_what_is_missing_is_named(tmp_path):
    (row, *_) = reproduce(tmp_path, tables=["4.5"])
    assert row["ours"] is None
    assert "02_01" in row["note"]
    with pytest.raises(CorpusError, match="tables out of"):
        reproduce(tmp_path, tables=["4.1"])
    with pytest.raises(CorpusError, match="expected a folder"):
        reproduce(tmp_path / "none")


@pytest.mark.slow
def test_the_floor_recognises_other_actors(corpus):
    rows = reproduce(corpus, tables=["4.8"])
    ours = {(row["row"], row["column"]): row["ours"] for row in rows}
    assert ours["HDM05, one actor left out", "clips right, floored rho"] > 95
    assert ours["HDM05, one actor left out", "clips right, own rho"] < 70
    assert ours["walk class", "test walks"] > 95
    assert sum(row["ours"] for row in rows[:9]) == pytest.approx(300, abs=1)
