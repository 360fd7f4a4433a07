"""Cleaned revisions: kept beside the clips as captured, taken by all that reads, taken back."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing

import numpy as np
import pytest
from small_library import leftovers, made_older, run, run_json, sound

import mocapdb.library.writing.catalogue_writer as catalogue_writing
from mocapdb.cli._cleaned_library import say_cleaning
from mocapdb.compression import Target
from mocapdb.corpus import synthetic
from mocapdb.errors import LibraryError, NoPeriodError
from mocapdb.io import read_clip, write_clip
from mocapdb.library import (
    BuildSettings,
    Library,
    Retrieval,
    build_library,
    clean_library,
    compact_library,
    undo_cleaning,
)
from mocapdb.library.building.revise_clips import CleaningSettings
from mocapdb.library.searching.class_cycles import make_cycle

SETTINGS = BuildSettings(Target("max_mm", 2.0, joint_share=0), {"codec": "pose"})
LABELS = "path,label\n01_01.bvh,walk\n01_02.bvh,walk\n"


@pytest.fixture(scope="module")
def templates(tmp_path_factory):
    """A corpus of a walk with a fault and a sound one, and its library, searched and not."""
    root = tmp_path_factory.mktemp("revisions")
    corpus = root / "corpus"
    corpus.mkdir()
    walk = synthetic.make_clip("walk", seed=3, duration_s=4, sensor_noise_deg=0.02)
    faulty = synthetic.inject_faults(
        walk, seed=5, kinds=["offset"], n=1, size_deg=(50, 60), length_s=(0.3, 0.4)
    ).clip
    write_clip(faulty, corpus / "01_01.bvh")
    sound = synthetic.make_clip("walk", seed=4, duration_s=4)
    write_clip(sound, corpus / "01_02.bvh")
    (corpus / "LABELS.csv").write_text(LABELS)
    plain = root / "plain.mocapdb"
    build_library(corpus, plain, SETTINGS, jobs=1)
    cleaned = root / "cleaned.mocapdb"
    shutil.copytree(plain, cleaned)
    report = clean_library(cleaned, jobs=2)
    assert report.searched == 2
    return corpus, plain, cleaned, report


@pytest.fixture
def plain(templates, tmp_path):
    return shutil.copytree(templates[1], tmp_path / "plain.mocapdb")


@pytest.fixture
def cleaned(templates, tmp_path):
    return shutil.copytree(templates[2], tmp_path / "cleaned.mocapdb")


@pytest.fixture
def corpus(templates, tmp_path):
    return shutil.copytree(templates[0], tmp_path / "corpus")


def channels(path, name="01_01", *, original=False):
    with Library(path, original=original) as library:
        return library.clip(name).channels


def motion(path, name="01_01"):
    """The canonical motion that queries see."""
    with Library(path) as library:
        retrieval = Retrieval(library)
        names = [record.name for record in retrieval.records]
        return retrieval.motions[names.index(name)].pose


def leave(path, name="01_01"):
    """Have a revision say that its spans were not repaired."""
    with closing(sqlite3.connect(path / "catalogue.db")) as database, database:
        database.execute(
            "UPDATE revisions SET spans = replace(spans, '\"repaired\": true', "
            "'\"repaired\": false') WHERE clip_id = (SELECT id FROM clips WHERE name = ?)",
            [name],
        )


class TestKept:
    def test_the_cleaned_clip_is_taken_and_the_captured_one_stays(self, templates):
        _, plain, cleaned, report = templates
        assert report.cleaned == ["01_01"]
        assert report.repaired == report.spans >= 1
        captured, repaired = channels(plain), channels(cleaned)
        np.testing.assert_array_equal(channels(cleaned, original=True), captured)
        with Library(cleaned) as library:
            record = library.record("01_01")
            revision = library.revision(record)
            np.testing.assert_array_equal(library.captured(record).channels, captured)
            start, end = revision.spans[0]["frames"]
            part = library.clip("01_01", slice(start, end)).channels
            assert "repaired" in library.clip("01_01").provenance[-1]
        np.testing.assert_array_equal(part, repaired[start:end])
        assert np.abs(part - captured[start:end]).max() > 20
        assert revision.spans[0]["moved_deg"] > 20
        assert sound(cleaned)

    def test_a_clip_without_faults_is_searched_and_stays_as_it_is(self, templates):
        _, plain, cleaned, _ = templates
        with Library(cleaned) as library:
            revision = library.revision(library.record("01_02"))
        assert (revision.spans, revision.changes, revision.payload_bytes) == ((), False, 0)
        np.testing.assert_array_equal(channels(cleaned, "01_02"), channels(plain, "01_02"))

    def test_queries_see_the_cleaned_motion(self, templates):
        _, plain, cleaned, _ = templates
        assert np.abs(motion(plain) - motion(cleaned)).max() > 0.05
        np.testing.assert_array_equal(motion(plain, "01_02"), motion(cleaned, "01_02"))

    def test_what_was_searched_alike_is_skipped(self, cleaned):
        report = clean_library(cleaned, jobs=1)
        assert (report.searched, report.skipped) == (0, 2)
        stricter = CleaningSettings(threshold=1.0)
        report = clean_library(cleaned, stricter, names=["01_01"], jobs=1)
        assert (report.searched, report.spans) == (1, 0)
        np.testing.assert_array_equal(channels(cleaned), channels(cleaned, original=True))
        assert sound(cleaned)

    def test_a_build_cleans_too(self, corpus, tmp_path):
        (corpus / "01_02.bvh").unlink()
        library = tmp_path / "built.mocapdb"
        options = ["--max-mm", 2, "--joint-share", 0, "--jobs", 1, "--clean"]
        report = run_json("build", corpus, "-o", library, *options)
        assert report["cleaned"]["cleaned"] == ["01_01"]
        assert np.abs(channels(library) - channels(library, original=True)).max() > 20
        (corpus / "01_01.bvh").write_text((corpus / "01_01.bvh").read_text() + "\n")
        result = run("build", corpus, "-o", library, *options[:-1])
        assert "the cleaned revisions of 01_01 are dropped" in result.stderr
        assert "mocapdb clean" in result.stderr

    def test_without_the_corpus_the_decoded_clip_is_cleaned(self, corpus, tmp_path):
        library = tmp_path / "built.mocapdb"
        build_library(corpus, library, SETTINGS, jobs=1, index=False)
        for text, made_of in (("", "source"), ("\n", "decoded"), (None, "decoded")):
            if text is None:
                (corpus / "01_01.bvh").unlink()
            else:
                (corpus / "01_01.bvh").write_text((corpus / "01_01.bvh").read_text() + text)
            settings = CleaningSettings(threshold=0.5 + 0.01 * len(str(text)))
            clean_library(library, settings, names=["01_01"], jobs=1)
            with Library(library) as opened:
                revision = opened.revision(opened.record("01_01"))
            assert revision.settings["made_of"] == made_of
            assert revision.changes


class TestTakenBack:
    def test_undo_and_compact_lead_back(self, templates, cleaned):
        _, plain, _, _ = templates
        assert undo_cleaning(cleaned) == (["01_01", "01_02"], [])
        np.testing.assert_array_equal(channels(cleaned), channels(plain))
        assert np.abs(motion(cleaned) - motion(plain)).max() < 0.02  # of decoded frames now
        assert sound(cleaned)
        assert compact_library(cleaned) > 0
        assert sound(cleaned)
        with closing(sqlite3.connect(cleaned / "catalogue.db")) as database:
            for table, count in (("revisions", 0), ("shards", 1), ("feature_shards", 2)):
                found = database.execute(f"SELECT count(*) FROM {table}").fetchone()
                assert found == (count,), table

    def test_nothing_to_undo(self, plain):
        result = run("clean", plain, "--undo")
        assert result.exit_code == 1
        assert "nothing to undo" in result.output
        assert "--apply" in result.output

    def test_compacting_keeps_what_is_cleaned(self, cleaned):
        before, seen = channels(cleaned), motion(cleaned)
        clean_library(cleaned, CleaningSettings(hold_feet=False), jobs=1)  # leaves a waste payload
        compact_library(cleaned)
        assert np.abs(channels(cleaned) - before).max() < 5
        assert np.abs(motion(cleaned) - seen).max() < 0.05
        assert sound(cleaned)
        assert not leftovers(cleaned)

    def test_a_changed_source_drops_its_revision_and_says_so(self, corpus, cleaned):
        text = (corpus / "01_01.bvh").read_text().split("\n")
        (corpus / "01_01.bvh").write_text("\n".join(text[:-10] + text[-9:]).replace("480", "479"))
        report = build_library(corpus, cleaned, SETTINGS, jobs=1, index=False)
        assert (report.built, report.dropped_revisions) == (1, ["01_01"])
        with Library(cleaned) as library:
            assert library.revision(library.record("01_01")) is None
            assert library.revision(library.record("01_02")) is not None
        assert sound(cleaned)


class TestKilled:
    def test_before_the_commit_nothing_has_changed(self, plain, monkeypatch):
        def stopped(*_):
            raise KeyboardInterrupt

        monkeypatch.setattr(catalogue_writing.CatalogueWriter, "drop_revisions", stopped)
        before = channels(plain)
        with pytest.raises(KeyboardInterrupt):
            clean_library(plain, jobs=1)
        monkeypatch.undo()
        np.testing.assert_array_equal(channels(plain), before)
        assert sound(plain)
        assert clean_library(plain, names=["01_01"], jobs=1).cleaned == ["01_01"]


class TestOlderLibraries:
    @pytest.fixture
    def older(self, plain):
        made_older(plain, 2)
        return plain

    def test_they_open_and_the_next_writer_brings_them_up_to_date(self, older):
        with Library(older) as library:
            assert library.catalogue.revisions() == {}
            assert library.info("01_01")["revision"] is None
        assert run_json("ls", older)["clips"][0]["revision"] is None
        assert clean_library(older, names=["01_01"], jobs=1).cleaned == ["01_01"]
        assert sound(older)


class TestCyclesOfClasses:
    def test_a_cleaned_member_is_named(self, templates):
        with Library(templates[2]) as library:
            made = make_cycle(library, "walk")
        assert set(made.cleaned) == {"01_01"}
        assert made.unsearched == ()

    def test_a_flagged_one_is_left_out_as_captured_and_where_it_was_not_repaired(self, cleaned):
        with Library(cleaned, original=True) as library:
            made = make_cycle(library, "walk")
        assert "flagged" in made.mean.left_out["01_01"]
        leave(cleaned)
        answer = run_json("cycle", cleaned, "--class", "walk")
        assert answer["members"] == ["01_02"]
        assert "not repaired" in answer["left_out"]["01_01"]
        leave(cleaned, "01_02")
        with Library(cleaned) as library:
            assert make_cycle(library, "walk").mean.members == ("01_02",)

    def test_members_that_nobody_searched_are_counted_or_cleaned(self, plain):
        answer = run_json("cycle", plain, "--class", "walk")
        assert set(answer["unsearched"]) == {"01_01", "01_02"}
        assert any("never searched" in warning for warning in answer["warnings"])
        answer = run_json("cycle", plain, "--class", "walk", "--clean")
        assert answer["cleaned"] == {"01_01": 1}
        assert answer["unsearched"] == []
        report = run_json("clean", plain, "--apply", "--clip", "01_01", "--jobs", 1)
        assert report["stale_cycles"] == ["walk"]

    def test_one_file(self, corpus):
        answer = run_json("cycle", corpus / "01_01.bvh", "--clean")
        assert answer["faults"]["repaired"] >= 1
        assert run_json("cycle", corpus / "01_02.bvh")["faults"] is None

    def test_none_of_use_is_an_error(self, cleaned):
        with closing(sqlite3.connect(cleaned / "catalogue.db")) as database, database:
            database.execute("UPDATE clips SET label = NULL WHERE name = '01_02'")
        with (
            Library(cleaned, original=True) as library,
            pytest.raises(NoPeriodError, match="flagged"),
        ):
            make_cycle(library, "walk")


class TestSeen:
    def test_a_report_tells_what_was_captured_and_how_many_were_cleaned(self, templates):
        from mocapdb.report.library_findings import find_faults

        with Library(templates[2]) as library:
            found = find_faults(library, 1e9, lambda _: None)
        assert (found.cleaned, found.clips) == (1, 2)
        assert {record.name for record, _ in found.worst} == {"01_01"}

    def test_a_viewer_session_compares_the_capture_with_its_revision(self, templates):
        from mocapdb.viewer.session import Session

        client = type("Client", (), {"client_id": 0})()
        session = Session(client, templates[2])
        with Library(templates[2]) as session.library:
            session.view.record = record = session.library.record("01_01")
            session.view.clip = session.library.decode(record)
            before, after = session._repaired()
        np.testing.assert_array_equal(before.channels, channels(templates[1]))
        np.testing.assert_array_equal(after.channels, channels(templates[2]))


class TestCommands:
    def test_info_and_ls_tell(self, cleaned):
        shown = run("info", cleaned, "01_01").output
        assert "revision        cleaned by mocapdb" in shown
        assert "span " in shown
        whole = run_json("info", cleaned)["revisions"]
        assert (whole["searched"], whole["cleaned"], whole["left"]) == (2, 1, 0)
        assert "2 searched for faults, 1 cleaned" in run("info", cleaned).output
        listed = {row["clip"]: row["revision"] for row in run_json("ls", cleaned)["clips"]}
        assert listed["01_01"]["repaired"] >= 1
        assert listed["01_02"]["repaired"] == 0
        assert "1 repaired" in run("ls", cleaned).output

    def test_export_takes_the_cleaned_one_unless_told(self, cleaned, tmp_path):
        now, then = tmp_path / "now.bvh", tmp_path / "then.bvh"
        assert run_json("export", cleaned, "01_01", "-o", now)["cleaned"] is True
        answer = run_json("export", cleaned, "01_01", "-o", then, "--original")
        assert answer["cleaned"] is False
        assert np.abs(read_clip(now).channels - read_clip(then).channels).max() > 20

    def test_query_searches_what_was_captured_when_told_to(self, cleaned):
        assert run_json("query", cleaned, "01_02", "--original")["cleaned"] == 1
        with Library(cleaned) as now, Library(cleaned, original=True) as before:
            captured = before.clip("01_01")
            assert Retrieval(before).query(captured, k=1)[0].distance < 0.05
            assert Retrieval(now).query(captured, k=1)[0].distance > 0.05

    def test_classify_and_render_know_original(self, cleaned, tmp_path):
        assert "as captured" in run("classify", cleaned, "01_02", "--original").stderr
        pages = [tmp_path / "now.html", tmp_path / "then.html"]
        for page, more in zip(pages, ([], ["--original"]), strict=True):
            run_json("render", "01_01", "--library", cleaned, "-o", page, *more)
        assert pages[0].read_bytes() != pages[1].read_bytes()

    @pytest.mark.parametrize("option", ["--apply", "--undo"])
    def test_no_library(self, option, corpus, tmp_path):
        assert run("clean", corpus / "01_01.bvh", option).exit_code == 2
        for folder in (corpus, tmp_path / "nowhere"):
            result = run("clean", folder, option)
            assert result.exit_code == 1
            assert "not a library (no catalogue.db in it)" in result.output

    @pytest.mark.parametrize("more", [["-o", "x"], ["--detect-only"], ["--undo"], ["--literal"]])
    def test_options_that_do_not_go_together(self, plain, more):
        assert run("clean", plain, "--apply", *more).exit_code == 2

    def test_an_unknown_clip(self, plain):
        for option in ("--apply", "--undo"):
            result = run("clean", plain, option, "--clip", "01_0")
            assert result.exit_code == 1
            assert "01_01" in result.output

    def test_a_locked_library(self, plain):
        with closing(sqlite3.connect(plain / "writer.lock", isolation_level=None)) as lock:
            lock.execute("BEGIN EXCLUSIVE")
            for option in ("--apply", "--undo"):
                result = run("clean", plain, option)
                assert result.exit_code == 1
                assert "locked by" in result.output

    def test_a_library_that_cannot_be_written(self, plain):
        (plain / "writer.lock").unlink(missing_ok=True)
        (plain / "writer.lock").mkdir()
        result = run("clean", plain, "--apply")
        assert result.exit_code == 1
        assert "cannot write to the library" in result.output

    def test_a_damaged_revision_is_bad(self, cleaned):
        with closing(sqlite3.connect(cleaned / "catalogue.db")) as database, database:
            database.execute("UPDATE revisions SET sha256 = ? WHERE shard_id > 0", ["ab" * 32])
        report = run_json("verify", cleaned, exit_code=1)
        assert "another clip than the catalogue says" in report["bad"][0]["reason"]
        with Library(cleaned) as library, pytest.raises(LibraryError, match="another clip"):
            library.clip("01_01")


def test_a_t_pose_in_front_is_not_searched_and_said(tmp_path, capsys):
    walk = synthetic.make_clip("walk", seed=4, duration_s=1.5)
    posed = walk.channels.copy()
    posed[:, walk.skeleton.rotation_channels] += 35.0
    posed[0, walk.skeleton.rotation_channels] = 0.0
    (tmp_path / "corpus").mkdir()
    write_clip(walk.replace(channels=posed), tmp_path / "corpus" / "a.bvh")
    build_library(tmp_path / "corpus", tmp_path / "a.mocapdb", SETTINGS, jobs=1)
    report = clean_library(tmp_path / "a.mocapdb", jobs=1)
    assert (report.cut, report.spans) == (["a"], 0)
    say_cleaning(report, to_stdout=False)
    assert "were not searched and are as captured: a\n" in capsys.readouterr().err
