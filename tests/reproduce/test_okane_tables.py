import json
import shutil

import numpy as np
import pytest
from click.testing import CliRunner

from mocapdb.cli import cli
from mocapdb.compression import Budgets
from mocapdb.corpus import synthetic
from mocapdb.errors import CorpusError
from mocapdb.io import write_clip
from mocapdb.reproduce import okane, okane_clips
from mocapdb.reproduce import okane_open_questions as questions
from mocapdb.reproduce.okane_clips import ThesisSet
from mocapdb.reproduce.side_by_side.okane_claims import verdicts


def test_run_and_walk_of_table_4_1_come_out_within_12_percent(corpus):
    rows = okane.reproduce(corpus, tables=["4.1"], rows=["1 run", "1 walk"])
    assert len(rows) == 8
    assert {row["row"] for row in rows} == {"1 run (173)", "1 walk (316)"}
    for row in rows:
        assert row["ours"] == pytest.approx(row["paper"], rel=0.12), row
        assert "02_03" in row["note"] or "07_01" in row["note"]
        assert row["production"] < (5.5 if row["row"] == "1 run (173)" else 4.5)


def test_the_command_prints_json_and_a_table(corpus, tmp_path):
    for name in ("02_03.amc", "02.asf"):
        shutil.copy(corpus / "cmu" / "asfamc" / "02" / name, tmp_path)
    answer = CliRunner().invoke(
        cli, ["reproduce", "okane", "--corpus", str(tmp_path), "--table", "4.4", "--json"]
    )
    assert answer.exit_code == 0, answer.output
    report = json.loads(answer.stdout)
    assert report["paper"] == "O'Kane 2008"
    rows = {(row["row"], row["column"]): row for row in report["rows"]}
    assert set(rows["1 run (173)", "low_error"]) == {
        "table", "row", "column", "paper", "ours", "production", "note",
    }  # fmt: skip
    assert rows["1 run (173)", "low_error"]["ours"] == pytest.approx(2.04, rel=0.12)
    assert rows["1 run (173)", "high_error"]["production"] > 100
    missing = rows["2 boxing (10434)", "low_error"]
    assert missing["ours"] is None
    assert "needs 2 of CMU's clips of boxing" in missing["note"]

    answer = CliRunner().invoke(
        cli, ["reproduce", "okane", "--corpus", str(tmp_path), "--table", "4.3"]
    )
    assert answer.exit_code == 0, answer.output
    assert "210.84" in answer.stdout
    assert "Conventions" in answer.stdout


def test_every_figure_of_the_four_tables_gets_a_row(tmp_path):
    (tmp_path / "02").mkdir()
    clip = synthetic.make_clip("run", seed=1)[:100]
    write_clip(clip, tmp_path / "02" / "02_03.amc")
    rows = okane.reproduce(tmp_path)
    assert [sum(row["table"] == table for row in rows) for table in okane.TABLES] == [
        20, 20, 12, 14,
    ]  # fmt: skip
    assert all(row["paper"] > 0 for row in rows)
    for row in rows:
        if row["row"] == "1 run (173)":  # 100 frames are not the 173 of the thesis, nor near them
            assert row["ours"] > 0
            assert row["note"].startswith("far stand-in: 02_03, 100 frames")
        else:
            assert row["ours"] is None
            assert row["note"].startswith("cannot be computed")


def test_clips_may_be_bvh(tmp_path):
    for seed, name in enumerate(["35_17", "35_18", "35_20", "35_21"]):
        clip = synthetic.make_clip("run", seed=seed)[: 150 + seed]
        write_clip(clip, tmp_path / f"{name}.bvh")
    rows = okane.reproduce(tmp_path, tables=["4.2"], rows=["4 runs"])
    assert all(row["ours"] > 0 for row in rows)
    assert "35_17 + 35_18 + 35_20 + 35_21 as BVH, 606 frames" in rows[0]["note"]


def test_of_few_clips_every_choice_is_looked_at():
    lengths = [(100, "a"), (150, "b"), (300, "c"), (900, "d")]
    wanted = ThesisSet("2 walks", "walk", 2, 1005)
    assert okane_clips._nearest(wanted, lengths) == (["a", "d"], 1000)


def test_a_turn_changes_no_motion_but_the_bytes():
    clip = synthetic.make_clip("walk", seed=1)[:150]
    sizes = {
        (turned, transform): okane.compressed_bytes(
            [clip], "aligned", transform, Budgets(0.0, 0.0, 1.0),
            count_root=False, reading=okane.Reading(turned=turned),
        )
        for turned in (False, True)
        for transform in ("dct", "dwt")
    }  # fmt: skip
    assert sizes[True, "dct"] > 1.2 * sizes[False, "dct"]
    assert sizes[True, "dwt"] < sizes[True, "dct"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("cmu")
    write_clip(synthetic.make_clip("run", seed=1)[:173], root / "02_03.bvh")
    write_clip(synthetic.make_clip("walk", seed=2)[:316], root / "07_01.bvh")
    return root


class TestOpenQuestions:
    def test_every_wavelet_has_a_figure(self, folder):
        rows = questions.wavelets(folder)
        assert {row["column"] for row in rows} == {"dct", *questions.WAVELETS}
        assert {row["row"] for row in rows} == {"1 run", "1 walk, turned"}
        assert all(row["ours"] > 0 for row in rows)

    def test_every_reading_has_a_figure(self, folder):
        rows = questions.readings(folder)
        ours = {(row["row"], row["column"]): row["ours"] for row in rows}
        assert len(ours) == (len(questions.READINGS) + 1) * 4
        usual = ours["as in the tables", "4.1 1 run"]
        assert ours["a unit a fifth larger", "4.1 1 run"] < usual
        assert ours["a unit a fifth smaller", "4.1 1 run"] > usual

    def test_variance_by_dimension(self, folder):
        rows, shares = questions.variance(folder)
        assert {row["column"] for row in rows} == set(questions.FORMATS)
        for held in shares.values():
            assert (np.diff(held) >= -1e-12).all()
            assert held[-1] == pytest.approx(1.0)
        row = next(row for row in rows if row["column"] == "aligned")
        held = shares["run, aligned"]
        assert held[row["ours"] - 1] >= 0.99 > held[row["ours"] - 2]

    def test_the_command_draws_it_and_judges(self, folder, tmp_path):
        picture = tmp_path / "variance.png"
        asked = ["reproduce", "okane", "--corpus", str(folder), "--table", "wavelets"]
        answer = CliRunner().invoke(cli, [*asked, "--picture", str(picture)])
        assert answer.exit_code == 0, answer.output
        assert picture.read_bytes()[:4] == b"\x89PNG"
        assert "DCT beats DWT on walks, runs and boxing: " in answer.stdout
        assert "bior4.4" in answer.stdout
        answer = CliRunner().invoke(cli, [*asked, "--picture", "variance.doc"])
        assert answer.exit_code == 2


def row(table, name, column, ours):
    return {"table": table, "row": name, "column": column, "paper": None, "ours": ours, "note": ""}


class TestVerdicts:
    def of(self, claim, rows):
        (found,) = [each for each in verdicts(rows) if each.claim.startswith(claim)]
        return found

    def test_nothing_tells_nothing(self):
        assert {each.holds for each in verdicts([])} == {None}
        assert all("cannot be told" in str(each) for each in verdicts([]))

    @pytest.mark.parametrize(("several", "holds"), [(80.0, True), (120.0, "partly")])
    def test_pca_pays_from_several_clips_on(self, several, holds):
        rows = [
            row("4.1", "1 run (173)", "positions", 100.0),
            row("4.2", "1 run (173)", "positions", 130.0),
            row("4.1", "3 walks (1127)", "positions", 100.0),
            row("4.2", "3 walks (1127)", "positions", several),
        ]
        verdict = self.of("PCA pays", rows)
        assert verdict.holds == holds
        assert "1 run 1.30" in verdict.figures

    def test_dct_before_dwt_says_with_which_wavelet(self):
        rows = [row("wavelets", "1 run", "dct", 100.0)]
        rows += [row("wavelets", "1 run", "haar", 120.0), row("wavelets", "1 run", "bior4.4", 80.0)]
        verdict = self.of("DCT beats DWT", rows)
        assert verdict.holds == "partly"
        assert "holds partly; so with haar, not with bior4.4" in str(verdict)
        assert self.of("DCT beats DWT", rows[:2]).holds is True

    @pytest.mark.parametrize(
        ("best", "others", "holds"),
        [("4.8", 60.0, True), ("4.8", 89.0, "partly"), ("4.5", 60.0, False)],
    )
    def test_normalised_classify_best(self, best, others, holds):
        rows = [
            row(table, f"{kind} class", f"test {kind + 's' * (kind == 'walk')}", share)
            for table in ("4.5", "4.6", "4.7", "4.8")
            for kind in ("walk", "run", "boxing")
            for share in [90.0 if table == best else others]
        ]
        assert self.of("Normalised positions classify best", rows).holds == holds


def test_a_stand_in_is_marked(tmp_path):
    clip = synthetic.make_clip("run", seed=1)[:170]
    write_clip(clip, tmp_path / "02_03.amc")
    rows = okane.reproduce(tmp_path, tables=["4.1"], rows=["1 run"])
    assert all(row["note"].startswith("stand-in: 02_03, 170 frames") for row in rows)
    assert all(row["ours"] > 0 for row in rows)


def test_a_set_of_twins_costs_what_one_costs_where_nothing_is_shared():
    clip = synthetic.make_clip("walk", seed=1)[:150]
    budgets = Budgets(0.0, 0.0, 1.0)
    one = okane.compressed_bytes([clip], "aligned", "dct", budgets, count_root=False)
    two = okane.compressed_bytes([clip, clip], "aligned", "dct", budgets, count_root=False)
    assert two == pytest.approx(one, rel=0.02)


def test_a_shared_pca_is_paid_once():
    clip = synthetic.make_clip("walk", seed=1)[:150]
    budgets = Budgets(0.0, 0.5, 0.5)
    one = okane.compressed_bytes([clip], "aligned", "dct", budgets, count_root=False)
    two = okane.compressed_bytes([clip, clip], "aligned", "dct", budgets, count_root=False)
    assert two < 0.75 * one


def test_the_root_costs_something_where_it_counts():
    clip = synthetic.make_clip("walk", seed=1)[:150]
    budgets = Budgets(0.1, 0.2, 0.2)
    sizes = [
        okane.compressed_bytes([clip], "aligned", "dct", budgets, count_root=counted)
        for counted in (False, True)
    ]
    assert sizes[0] < sizes[1] < sizes[0] + 40


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"tables": ["4.5"]}, "tables out of 4.1, 4.2, 4.3, 4.4, but got '4.5'"),
        ({"rows": ["5 cartwheels"]}, "rows out of 1 boxing, .*, but got '5 cartwheels'"),
    ],
)
def test_unknown_tables_and_rows_are_refused(tmp_path, options, said):
    with pytest.raises(CorpusError, match=said):
        okane.reproduce(tmp_path, **options)


def test_a_folder_that_is_missing_or_has_other_files_is_named(tmp_path):
    with pytest.raises(CorpusError, match=r"nowhere: expected a folder"):
        okane.reproduce(tmp_path / "nowhere")
    np.savez(tmp_path / "02_03.npz", a=1)
    with pytest.raises(CorpusError, match=r"such as 02_03.amc, but found none"):
        okane.reproduce(tmp_path)
    answer = CliRunner().invoke(cli, ["reproduce", "okane", "--corpus", str(tmp_path)])
    assert answer.exit_code == 1
    assert "Traceback" not in answer.output


def test_help_shows_an_example():
    answer = CliRunner().invoke(cli, ["reproduce", "okane", "--help"])
    assert "Example:\n    mocapdb reproduce okane --corpus cmu/" in answer.output
    assert "\\b" not in answer.output
