from __future__ import annotations

import dataclasses
import hashlib
from pathlib import Path

import pytest

from mocapdb.corpus import Labels, manifest
from mocapdb.corpus.manifest import (
    MANIFEST_COLUMNS,
    ManifestEntry,
    manifest_path,
    read_manifest,
    select,
)
from mocapdb.errors import CorpusError

ENTRY = ManifestEntry(
    clip="02_01",
    subject="02",
    trial="01",
    label="walk",
    description="walk",
    fps=120.0,
    skeleton_url="http://example.org/02/02.asf",
    motion_url="http://example.org/02/02_01.amc",
)
HEADER = ",".join(MANIFEST_COLUMNS)
ROW = "02_01,02,01,walk,walk,120,http://example.org/02.asf,http://example.org/02_01.amc,,"
RUN = "02_03,02,03,run,run/jog,120,http://example.org/02.asf,http://example.org/02_03.amc,,"


def write(tmp_path: Path, *lines: str) -> Path:
    path = tmp_path / "manifest.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


class TestShippedManifest:
    def test_covers_the_database(self) -> None:
        entries = read_manifest()
        assert len(entries) == 2435
        assert len({entry.subject for entry in entries}) == 109
        assert {entry.fps for entry in entries} == {60.0, 120.0}

    def test_addresses_follow_the_clip(self) -> None:
        for entry in read_manifest():
            assert entry.clip == f"{entry.subject}_{entry.trial}"
            folder = f"http://mocap.cs.cmu.edu/subjects/{entry.subject}"
            assert entry.motion_url == f"{folder}/{entry.clip}.amc"
            assert entry.skeleton_url == f"{folder}/{entry.subject}.asf"

    def test_is_found_in_a_checkout(self) -> None:
        assert manifest_path() == Path(__file__).parents[2] / "data" / "manifest.csv"

    def test_is_found_in_an_installed_package(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        package = tmp_path / "site-packages" / "mocapdb"
        (package / "data").mkdir(parents=True)
        monkeypatch.setattr(manifest, "__file__", str(package / "corpus" / "manifest.py"))
        with pytest.raises(CorpusError, match="Reinstall mocapdb"):
            manifest_path()
        (package / "data" / "manifest.csv").touch()
        assert manifest_path() == package / "data" / "manifest.csv"

    def test_checksums_are_those_of_the_corpus(self, corpus: Path) -> None:
        checked = 0
        for entry in read_manifest():
            path = corpus / "cmu" / "asfamc" / entry.subject / f"{entry.clip}.amc"
            if entry.sha256 and path.exists():
                assert hashlib.sha256(path.read_bytes()).hexdigest() == entry.sha256
                checked += 1
        assert checked > 0


class TestReading:
    def test_reads_every_field(self, tmp_path: Path) -> None:
        digest = "Ab" * 32
        row = f'1_2,1,2,jump,"jump, balance",59.94,http://a/1.asf,https://a/1_2.amc,{digest},'
        (entry,) = read_manifest(write(tmp_path, HEADER, row))
        assert entry == ManifestEntry(
            "1_2",
            "1",
            "2",
            "jump",
            "jump, balance",
            59.94,
            "http://a/1.asf",
            "https://a/1_2.amc",
            digest.lower(),
            None,
        )

    def test_skeleton_checksum_is_optional_and_other_columns_are_kept(self, tmp_path: Path) -> None:
        header = "note," + HEADER.removesuffix(",skeleton_sha256")
        path = write(tmp_path, header, "hello," + ROW.removesuffix(","))
        (entry,) = read_manifest(path)
        assert (entry.clip, entry.columns) == ("02_01", {"note": "hello"})
        (row,) = Labels.from_manifest([entry])
        assert (row.subject, row.columns) == ("02", {"trial": "01", "note": "hello"})

    def test_reserved_columns(self, tmp_path: Path) -> None:
        path = write(tmp_path, "codec," + HEADER, "x," + ROW)
        with pytest.raises(CorpusError, match=r":2: .*'codec', which is reserved"):
            read_manifest(path)

    def test_byte_order_mark_crlf_and_empty_lines(self, tmp_path: Path) -> None:
        path = tmp_path / "manifest.csv"
        path.write_bytes(b"\xef\xbb\xbf" + f"{HEADER}\r\n{ROW}\r\n\r\n{RUN}\r\n".encode())
        assert [entry.clip for entry in read_manifest(path)] == ["02_01", "02_03"]

    def test_header_alone_is_an_empty_manifest(self, tmp_path: Path) -> None:
        assert read_manifest(write(tmp_path, HEADER)) == []


def swap(column: str, value: str) -> str:
    cells = dict(zip(MANIFEST_COLUMNS, ROW.split(","), strict=True))
    cells[column] = value
    return ",".join(cells.values())


class TestBadManifests:
    @pytest.mark.parametrize(
        ("lines", "where", "what"),
        [
            ([HEADER, ROW, RUN, ROW], ":4:", "02_01 is on line 2 too"),
            ([HEADER, swap("fps", "fast")], ":2:", "positive number, but got 'fast'"),
            ([HEADER, swap("fps", "")], ":2:", "positive number"),
            ([HEADER, swap("fps", "0")], ":2:", "positive number"),
            ([HEADER, swap("fps", "-120")], ":2:", "positive number"),
            ([HEADER, swap("fps", "nan")], ":2:", "positive number"),
            ([HEADER, swap("fps", "inf")], ":2:", "positive number"),
            ([HEADER, swap("clip", "")], ":2:", "clip"),
            ([HEADER, swap("clip", "../../etc/passwd")], ":2:", "clip"),
            ([HEADER, swap("subject", "..")], ":2:", "subject"),
            ([HEADER, swap("subject", "a/b")], ":2:", "subject"),
            ([HEADER, swap("class", "")], ":2:", "class"),
            ([HEADER, swap("motion_url", "ftp://a/b.amc")], ":2:", "motion_url"),
            ([HEADER, swap("skeleton_url", "")], ":2:", "skeleton_url"),
            ([HEADER, swap("sha256", "abc")], ":2:", "sha256"),
            ([HEADER, swap("skeleton_sha256", "g" * 64)], ":2:", "skeleton_sha256"),
            ([HEADER, ROW, RUN.replace("run/jog", "run, jog")], ":3:", "10 cells"),
            ([HEADER, "02_01,02"], ":2:", "but got 2"),
            ([HEADER.replace(",class", "")], ":1:", "class is missing"),
            ([HEADER.replace("clip,", "").replace(",fps", "")], ":1:", "clip, fps are missing"),
            ([HEADER + ",clip"], ":1:", "clip more than once"),
            ([HEADER, '02_01,"02'], ":2:", "CSV"),
            ([HEADER, '02_01,"0"2"'], ":2:", "CSV"),
            (["<html><body>", "404</body></html>"], ":1:", "missing"),
            ([HEADER, '"02\n01",' + ROW[6:], swap("fps", "x")], ":2:", "clip"),
            ([HEADER, swap("description", '"two\nlines"'), swap("fps", "x")], ":4:", "fps"),
        ],
    )
    def test_error_names_the_line(
        self, tmp_path: Path, lines: list[str], where: str, what: str
    ) -> None:
        path = write(tmp_path, *lines)
        with pytest.raises(CorpusError) as caught:
            read_manifest(path)
        assert str(caught.value).startswith(f"{path}{where}")
        assert what in str(caught.value)

    @pytest.mark.parametrize(
        ("data", "what"),
        [
            (b"", "empty"),
            (b"\n\n", "empty"),
            (HEADER.encode() + b"\n" + ROW.encode() + b"\n02_02,caf\xe9\n", ":3: Expected UTF-8"),
            (b"\x89PNG\r\n\x1a\n\x00\x00", "UTF-8"),
            (b"PK\x03\x04\x00\x00", "NUL"),
            (HEADER.encode() + b"\n" + b"x" * (2 << 20), ":2: Expected CSV, but got a line"),
            (HEADER.encode() + b"\n" + b"x" * (200 << 10), ":2: Expected CSV"),
            (HEADER.encode("utf-16"), "UTF-8"),
        ],
    )
    def test_files_that_are_no_table(self, tmp_path: Path, data: bytes, what: str) -> None:
        path = tmp_path / "manifest.csv"
        path.write_bytes(data)
        with pytest.raises(CorpusError, match=what) as caught:
            read_manifest(path)
        assert str(path) in str(caught.value)
        assert len(str(caught.value)) < 600

    def test_missing_file_and_folder(self, tmp_path: Path) -> None:
        with pytest.raises(CorpusError, match="No such file"):
            read_manifest(tmp_path / "none.csv")
        with pytest.raises(CorpusError, match="directory"):
            read_manifest(tmp_path)


class TestSelect:
    ENTRIES = (
        ENTRY,
        dataclasses.replace(ENTRY, clip="02_03", trial="03", label="run"),
        dataclasses.replace(ENTRY, clip="07_01", subject="07", label="walk"),
    )

    @pytest.mark.parametrize(
        ("names", "clips"),
        [
            (["02_03"], ["02_03"]),
            (["02"], ["02_01", "02_03"]),
            (["walk"], ["02_01", "07_01"]),
            (["07", "run"], ["02_03", "07_01"]),
            (["walk", "02_01", "02"], ["02_01", "02_03", "07_01"]),
            ([], []),
        ],
    )
    def test_by_clip_subject_and_class(self, names: list[str], clips: list[str]) -> None:
        assert [entry.clip for entry in select(self.ENTRIES, names)] == clips

    def test_unknown_name_is_told_what_comes_close(self) -> None:
        with pytest.raises(CorpusError, match=r"'wlak'\. Close: walk"):
            select(self.ENTRIES, ["02_01", "wlak"])

    def test_unknown_name_like_nothing_lists_the_classes(self) -> None:
        with pytest.raises(CorpusError, match="classes are: run, walk"):
            select(self.ENTRIES, ["§§§"])
