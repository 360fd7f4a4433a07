from __future__ import annotations

from pathlib import Path

import pytest

from mocapdb.corpus import Labels, find_labels, read_labels, read_manifest
from mocapdb.corpus.labels import LabelRow
from mocapdb.errors import CorpusError


def write(folder: Path, *lines: str, name: str = "LABELS.csv") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def label_of(labels: Labels, path: str) -> str | None:
    row = labels.lookup(path)
    return None if row is None else row.label


class TestLookup:
    def test_by_name(self, tmp_path: Path) -> None:
        labels = read_labels(write(tmp_path, "clip,label", "a,walk", "b,run"))
        assert label_of(labels, "deep/down/a.amc") == "walk"
        assert label_of(labels, "b.bvh") == "run"
        assert labels.lookup("c.amc") is None

    def test_by_path_alone(self, tmp_path: Path) -> None:
        labels = read_labels(write(tmp_path, "path,label", "amc/a.amc,walk"))
        assert label_of(labels, "amc/a.amc") == "walk"
        assert label_of(labels, "amc/./a.amc") == "walk"
        assert labels.lookup("bvh/a.bvh") is None

    def test_an_empty_label_is_none_and_the_rest_counts(self, tmp_path: Path) -> None:
        labels = read_labels(write(tmp_path, "clip,label,description", "a,walk,", "b,,lies"))
        row = labels.lookup("b.bvh")
        assert row is not None
        assert (row.label, row.description) == ("", "lies")
        assert "2 clips, 1 classes" in repr(labels)

    def test_path_wins_over_name(self, tmp_path: Path) -> None:
        lines = ("clip,path,label", "a,x/a.amc,walk", "b,x/b.amc,run")
        labels = read_labels(write(tmp_path, *lines))
        assert labels.lookup("x/a.amc", stem="b") == LabelRow("walk", "a", "x/a.amc")
        assert labels.lookup("y/other.amc", stem="b") == LabelRow("run", "b", "x/b.amc")

    def test_shared_name_matches_by_path_only(self, tmp_path: Path) -> None:
        lines = ("clip,path,label", "a,amc/a.amc,walk", "a,bvh/a.bvh,stroll")
        labels = read_labels(write(tmp_path, *lines))
        assert label_of(labels, "amc/a.amc") == "walk"
        assert label_of(labels, "bvh/a.bvh") == "stroll"
        assert labels.lookup("elsewhere/a.amc") is None

    def test_shared_name_whose_rows_agree_speaks_of_a_copy(self, tmp_path: Path) -> None:
        lines = ("clip,path,label,take,format,description", "a,amc/a.amc,walk,1,amc,slow",
                 "a,bvh/a.bvh,walk,1,bvh,quick", "b,amc/b.amc,walk,1,amc,",
                 "b,bvh/b.bvh,run,1,bvh,")  # fmt: skip
        labels = read_labels(write(tmp_path, *lines))
        row = labels.lookup("elsewhere/a.bvh")
        assert row is not None
        assert (row.label, row.description, dict(row.columns)) == ("walk", "", {"take": "1"})
        assert labels.lookup("elsewhere/b.bvh") is None

    def test_optional_columns(self, tmp_path: Path) -> None:
        lines = ("clip,label,fps,description,note", "a,walk,60,slow walk,x", "b,run,,,")
        labels = read_labels(write(tmp_path, *lines))
        assert labels.lookup("a.amc") == LabelRow("walk", "a", "", 60.0, "slow walk")
        assert labels.lookup("b.amc") == LabelRow("run", "b")
        assert len(labels) == 2
        assert labels.source == "labels"
        assert "2 clips, 2 classes" in repr(labels)

    def test_backslashes_part_folders(self, tmp_path: Path) -> None:
        labels = read_labels(write(tmp_path, "path,label", r"amc\a.amc,walk"))
        assert label_of(labels, "amc/a.amc") == "walk"


class TestCorpusRoot:
    LINES = ("path,label", "cmu/02/02_01.amc,walk", "hdm05/x.amc,jog")

    def test_labels_above_the_root(self, tmp_path: Path) -> None:
        labels = read_labels(write(tmp_path, *self.LINES), tmp_path / "cmu")
        assert label_of(labels, "02/02_01.amc") == "walk"
        assert labels.lookup("cmu/02/02_01.amc") is None

    def test_labels_elsewhere_name_paths_from_the_root(self, tmp_path: Path) -> None:
        path = write(tmp_path / "mine", "path,label", "02/02_01.amc,walk", name="my.csv")
        labels = read_labels(path, tmp_path / "corpus" / "cmu")
        assert label_of(labels, "02/02_01.amc") == "walk"

    @pytest.mark.parametrize(("labels", "root"), [("real", "link"), ("link", "real")])
    def test_through_a_symbolic_link(self, tmp_path: Path, labels: str, root: str) -> None:
        write(tmp_path / "real", *self.LINES)
        (tmp_path / "real" / "cmu").mkdir()
        (tmp_path / "link").symlink_to(tmp_path / "real")
        read = read_labels(tmp_path / labels / "LABELS.csv", tmp_path / root / "cmu")
        assert label_of(read, "02/02_01.amc") == "walk"

    def test_relative_paths_are_of_the_working_folder(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        write(tmp_path, *self.LINES)
        monkeypatch.chdir(tmp_path)
        assert label_of(read_labels("LABELS.csv", "cmu"), "02/02_01.amc") == "walk"


class TestFindLabels:
    def test_in_the_root(self, tmp_path: Path) -> None:
        path = write(tmp_path / "cmu", "clip,label", "a,walk")
        write(tmp_path, "path,label", "cmu/a.amc,run")
        assert find_labels(tmp_path / "cmu") == path

    def test_in_the_parent_when_it_points_here(self, tmp_path: Path) -> None:
        path = write(tmp_path, "path,label", "hdm05/b.amc,jog", "cmu/a.amc,run")
        assert find_labels(tmp_path / "cmu") == path

    @pytest.mark.parametrize(
        "lines",
        [
            ("path,label", "hdm05/b.amc,jog", "cmu2/a.amc,run"),
            ("clip,label", "a,walk"),
            ("path,label", ".,walk"),
        ],
    )
    def test_not_in_a_parent_that_speaks_of_others(
        self, tmp_path: Path, lines: tuple[str, ...]
    ) -> None:
        write(tmp_path, *lines)
        assert find_labels(tmp_path / "cmu") is None

    def test_nowhere(self, tmp_path: Path) -> None:
        assert find_labels(tmp_path / "cmu") is None

    def test_the_corpus(self, corpus: Path) -> None:
        path = find_labels(corpus / "cmu")
        assert path == (corpus / "LABELS.csv").resolve()
        labels = read_labels(path, corpus / "cmu")
        assert label_of(labels, "asfamc/02/02_01.amc") == "walk"
        assert label_of(labels, "bvh/02_01.bvh") == "walk"
        for file in (corpus / "cmu").rglob("*.bvh"):
            assert labels.lookup(file.relative_to(corpus / "cmu"), file.stem) is not None


class TestFromManifest:
    def test_gives_labels_and_rates_by_name(self) -> None:
        labels = Labels.from_manifest(read_manifest())
        row = labels.lookup("anywhere/60_01.amc", "60_01")
        assert row is not None
        assert (row.label, row.fps, row.description) == ("salsa", 60.0, "salsa dance")
        assert labels.source == "manifest"
        assert len(list(labels)) == 2435


class TestBadLabels:
    @pytest.mark.parametrize(
        ("lines", "where", "what"),
        [
            (("clip,class", "a,walk"), ":1:", "label is missing"),
            (("label", "walk"), ":2:", "a clip or a path"),
            (("clip,path,label", ",,walk"), ":2:", "a clip or a path"),
            (("clip,label,fps", "a,walk,sixty"), ":2:", "fps"),
            (("clip,label,fps", "a,walk,0"), ":2:", "fps"),
            (("clip,label", "a,walk", "a,run"), ":3:", "line 2 names it too"),
            (("path,label", "x/a.amc,walk", "x/./a.amc,run"), ":3:", "is on line 2 too"),
            (("clip,path,label", "a,,walk", "a,x/a.amc,run"), ":3:", "Add the paths"),
            (("clip,path,label", "a,x/a.amc,walk", "a,,run"), ":3:", "Add the paths"),
            (("clip,label", "a,walk,fast"), ":2:", "Expected 2 cells"),
        ],
    )
    def test_error_names_the_line(
        self, tmp_path: Path, lines: tuple[str, ...], where: str, what: str
    ) -> None:
        path = write(tmp_path, *lines)
        with pytest.raises(CorpusError) as caught:
            read_labels(path)
        assert str(caught.value).startswith(f"{path}{where}")
        assert what in str(caught.value)

    def test_broken_file_in_the_parent_is_reported(self, tmp_path: Path) -> None:
        write(tmp_path, "<html>")
        with pytest.raises(CorpusError, match=r"LABELS\.csv:1"):
            find_labels(tmp_path / "cmu")


class TestFurtherColumns:
    def test_subject_and_others_are_kept(self, tmp_path: Path) -> None:
        lines = ("clip,label,subject,style,take", "a,walk,Ana Größe,old,", "b,run,,,3")
        first, second = read_labels(write(tmp_path, *lines))
        assert (first.subject, first.columns) == ("Ana Größe", {"style": "old"})
        assert (second.subject, second.columns) == ("", {"take": "3"})

    def test_checksums_and_skeletons_are_left_alone(self, tmp_path: Path) -> None:
        lines = ("clip,label,skeleton,sha256,format", f"a,walk,a.asf,{64 * 'f'},amc", "b,run,,,")
        first, _ = read_labels(write(tmp_path, *lines))
        assert first.columns == {"format": "amc"}

    @pytest.mark.parametrize(
        "column", ["source", "frames", "fps_source", "SHA256", "unit_m", "codec", "a=b", "9"]
    )
    def test_reserved_names(self, tmp_path: Path, column: str) -> None:
        with pytest.raises(CorpusError, match=rf"LABELS\.csv:2: .*'{column}'"):
            read_labels(write(tmp_path, f"clip,label,{column}", "a,walk,x"))

    def test_capital_letters_of_what_labels_say(self, tmp_path: Path) -> None:
        with pytest.raises(CorpusError, match="'subject' in small letters, but got 'Subject'"):
            read_labels(write(tmp_path, "clip,label,Subject", "a,walk,Ann"))

    def test_a_column_of_checksums_holds_checksums(self, tmp_path: Path) -> None:
        with pytest.raises(CorpusError, match="'sha256', which is reserved"):
            read_labels(write(tmp_path, "clip,label,sha256", "a,walk,x"))
