"""All papers in one run: what is written, what is said of what cannot be computed, the verdicts."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from click.testing import CliRunner
from small_library import run

from mocapdb.cli import cli
from mocapdb.corpus import synthetic
from mocapdb.errors import CorpusError, FormatError
from mocapdb.io import write_clip
from mocapdb.reproduce.side_by_side import aristidou_claims, raunio_claims, vejdemo_claims
from mocapdb.reproduce.side_by_side.all_papers import reproduce_all
from mocapdb.reproduce.side_by_side.paper_tables import PaperTables, SideBySide, files_of
from mocapdb.reproduce.side_by_side.verdict import Verdict

DOCS = Path(__file__).parents[2] / "docs" / "tables"
STEMS = ("okane2008", "raunio2014", "vejdemo2015", "aristidou2018")


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The command on a folder that has none of the papers' clips."""
    corpus, tables = tmp_path_factory.mktemp("corpus"), tmp_path_factory.mktemp("tables")
    write_clip(synthetic.make_clip("walk", seed=1, duration_s=0.5), corpus / "take.bvh")
    told = run("reproduce", "all", "--corpus", corpus, "-o", tables, "--jobs", 1)
    return tables, told.stdout


def rows_of(path):
    return list(csv.DictReader(path.read_text().splitlines()))


def test_every_paper_has_its_files(written):
    tables, said = written
    names = {path.name for path in tables.iterdir()}
    expected = {f"{stem}.{suffix}" for stem in (*STEMS, "papers") for suffix in ("md", "csv")}
    assert names == {*expected, "reproduced.json"}
    assert "PCA pays in positions" in said
    assert "bounded: " in said
    for stem in STEMS:
        text = (tables / f"{stem}.md").read_text()
        assert "Measured 20" in text
        assert "numpy" in text
        assert "## Claims" in text


def test_a_cell_without_a_figure_says_why(written):
    for stem in STEMS:
        rows = rows_of(written[0] / f"{stem}.csv")
        assert len(rows) >= 50
        for row in rows:
            assert row["ours"] or len(row["note"]) > len("not computed"), row
            assert row["date"].startswith("20")
            assert row["cores"].isdigit()


def test_every_claim_has_a_verdict(written):
    rows = rows_of(written[0] / "papers.csv")
    assert {row["paper"] for row in rows} == {
        "O'Kane 2008", "Raunio 2014", "Vejdemo-Johansson et al. 2015", "Aristidou 2018",
    }  # fmt: skip
    words = {"holds", "holds partly", "does not hold", "cannot be told"}
    assert all(row["verdict"] in words and row["figures"] for row in rows)


def test_tables_come_back_from_their_json(written):
    run_again = SideBySide.read(written[0])
    for name, text in files_of(run_again).items():
        assert (written[0] / name).read_text() == text
    with pytest.raises(FormatError, match="reproduce all"):
        SideBySide.read(written[0] / "nowhere")


def test_a_folder_that_is_none(tmp_path):
    (tmp_path / "file").write_text("")
    asked = ["reproduce", "all", "--corpus", str(tmp_path), "-o", str(tmp_path / "file")]
    refused = CliRunner().invoke(cli, asked)
    assert refused.exit_code == 2
    assert "Expected a folder with --output" in refused.stderr
    with pytest.raises(CorpusError, match="expected a folder"):
        reproduce_all(tmp_path / "no")


def test_the_tables_of_the_docs_are_what_it_writes():
    assert {path.stem for path in DOCS.glob("*2*.md")} >= set(STEMS)
    for name, text in files_of(SideBySide.read(DOCS)).items():
        assert (DOCS / name).read_text() == text, name


def row(table, name, column, ours, paper=None, note=""):
    return {"table": table, "row": name, "column": column, "paper": paper, "ours": ours,
            "note": note}  # fmt: skip


def of(verdicts, start):
    (found,) = [each for each in verdicts if each.claim.startswith(start)]
    return found


def test_a_cell_of_markdown_has_the_paper_beside_ours():
    rows = [
        row("9", "a | b", "x", 1.5, 2.0, "one note"),
        row("9", "a | b", "y", None, 3.0, "clip 86_03 not at hand"),
    ]
    paper = PaperTables("P 1999", "p", rows, [Verdict("C", True, "f")], ["how"], ["less"])
    text = files_of(SideBySide({"date": "2026-01-02", "cores": "2"}, [paper]))["p.md"]
    assert "| a \\| b | 2 / 1.5 | 3 / - | x: one note; y: clip 86_03 not at hand |" in text
    assert "Measured 2026-01-02: cores 2." in text
    assert "**Bounded.** less" in text
    assert "| C | holds | f |" in text
    assert "- how" in text


@pytest.mark.parametrize(("m1", "holds"), [((1.0, 1.0), True), ((1.0, 2.0), "partly")])
def test_raunio_on_clips_that_agree_and_do_not(m1, holds):
    rows = [row("B.2", f"07_0{i}", "M1 pos", value) for i, value in enumerate(m1)]
    rows += [row("B.2", f"07_0{i}", "M2 pos", 1.0) for i in range(2)]
    found = of(raunio_claims.verdicts(rows), "M1 is about as near")
    assert found.holds == holds
    assert of(raunio_claims.verdicts([]), "M1 and M2 match").holds is None


def test_raunio_counts_laps_by_the_autocorrelation():
    rows = [
        row("A.2", "07_01", "period count", 2.4, note="AMC; autocorrelation 2.43"),
        row("A.3", "09_01", "period count", 1.2, note="AMC; autocorrelation 2.40"),
    ]
    found = of(raunio_claims.verdicts(rows), "Walks and runs give")
    assert found.holds == "partly"
    assert "1 of 1 walks, 0 of 1 runs; not 09_01" in found.figures


@pytest.mark.parametrize(("laps", "holds"), [(2.5, True), (1.2, False)])
def test_vejdemo_on_laps(laps, holds):
    rows = [row("walks", "07_01", "laps", laps)]
    rows += [row("walks", "07_01", "laps by autocorrelation", 2.5)]
    assert of(vejdemo_claims.verdicts(rows), "A period is found").holds is holds


def test_aristidou_on_what_is_changed_elsewhere():
    name = "changed where nothing is wrong"
    changed = {"repaired": 0.01, "Butterworth": 0.5, "Hampel": 0.2}
    rows = [row("kit", name, f"{way}, deg", value) for way, value in changed.items()]
    found = of(aristidou_claims.verdicts(rows), "It changes nothing but")
    assert found.holds is True
    assert "Butterworth 0.500" in found.figures


@pytest.mark.parametrize(("faults", "holds"), [(20, True), (3, None)])
def test_aristidou_on_few_faults(faults, holds):
    name = "self-similarity, local"
    rows = [
        row("1", name, f"{motion} recall", 0.95, note=f"{faults} faults")
        for motion in ("locomotion", "dance")
    ]
    found = of(aristidou_claims.verdicts(rows), "Nearly all faulty words")
    assert found.holds is holds
    assert "locomotion 0.950" in found.figures


def test_the_kit_as_rows():
    kit = {
        "recipes": [
            {"recipe": "flip", "faults": 2, "found": 1, "recall": 0.5, "precision": 1.0,
             "unit": "deg", "errors": {"repaired": 3.0, "low rank": None}},
        ],
        "elsewhere_deg": {"repaired": 0.1},
        "false_alarms_a_minute": [{"fps": 120.0, "minutes": 2.0, "body": 0.5}],
    }  # fmt: skip
    cells = {(r["row"], r["column"]): r for r in aristidou_claims.kit_rows(kit)}
    assert cells["flip", "recall"]["ours"] == 0.5
    assert "rotations alone" in cells["flip", "low rank, deg"]["note"]
    assert cells["changed where nothing is wrong", "repaired, deg"]["ours"] == 0.1
    assert cells["false alarms a minute", "120 Hz"]["ours"] == 0.5
