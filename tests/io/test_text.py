"""Loading text safely, and writing files whole or not at all."""

from __future__ import annotations

import os
import stat

import pytest

from mocapdb.base.files import replacing
from mocapdb.errors import FormatError
from mocapdb.io import _text
from mocapdb.io._text import load_text
from mocapdb.io.amc import read_amc
from mocapdb.io.asf import read_asf
from mocapdb.io.bvh import read_bvh

READERS = [read_asf, lambda path: read_amc(path, None), read_bvh]


@pytest.fixture(params=READERS, ids=["asf", "amc", "bvh"])
def read(request):
    return request.param


def test_missing_file(read, tmp_path):
    with pytest.raises(FormatError, match="there is none"):
        read(tmp_path / "nothing")


def test_folder(read, tmp_path):
    with pytest.raises(FormatError, match="folder"):
        read(tmp_path)


@pytest.mark.skipif(os.name != "posix", reason="no such files")
@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_what_has_no_end_is_not_waited_for(read, tmp_path, kind):
    path = tmp_path / "endless"
    os.mkfifo(path) if kind == "pipe" else path.symlink_to("/dev/zero")
    with pytest.raises(FormatError, match="a pipe or a device"):
        read(path)


@pytest.mark.parametrize("content", [b"", b"\n", b" \r\n\t\n", b"\xef\xbb\xbf"])
def test_empty_file(read, tmp_path, content):
    (tmp_path / "empty").write_bytes(content)
    with pytest.raises(FormatError):
        read(tmp_path / "empty")


@pytest.mark.parametrize("content", [b"\0", b"HIERARCHY\nROOT a\0", b"\x7fELF\2\1\1\0" * 100_000])
def test_binary_file(read, tmp_path, content):
    (tmp_path / "binary").write_bytes(content)
    with pytest.raises(FormatError, match="binary"):
        read(tmp_path / "binary")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_file_that_may_not_be_read(read, tmp_path):
    (tmp_path / "secret").write_bytes(b"x")
    (tmp_path / "secret").chmod(0)
    with pytest.raises(FormatError, match="can be read"):
        read(tmp_path / "secret")


def test_huge_sparse_file_is_not_loaded(read, tmp_path):
    with (tmp_path / "huge").open("wb") as file:
        file.write(b"HIERARCHY\n")
        file.truncate(2 << 30)
    with pytest.raises(FormatError, match="binary"):
        read(tmp_path / "huge")


@pytest.mark.parametrize("size", [_text.LONGEST_LINE_BYTES + 1, 5 * _text.LONGEST_LINE_BYTES])
@pytest.mark.parametrize("before", [0, 7, 2 * _text.LONGEST_LINE_BYTES])
def test_huge_line(read, tmp_path, size, before):
    (tmp_path / "long").write_bytes(b"#######\n" * (before // 8) + b"1" * size + b"\nmore\n")
    with pytest.raises(FormatError, match="longer one") as error:
        read(tmp_path / "long")
    assert error.value.line == before // 8 + 1


def test_longest_line_may_lie_anywhere(tmp_path):
    line = b"x" * _text.LONGEST_LINE_BYTES
    for before in (0, 1, 2 * _text.LONGEST_LINE_BYTES // 2):
        content = b"y" * before + b"\n" + line + b"\n" + line
        (tmp_path / "long").write_bytes(content)
        assert load_text(tmp_path / "long").data == content + b"\n"


def test_lines_comments_and_numbers(tmp_path):
    (tmp_path / "text").write_bytes(b"a b # c\n\n  \xc3\xa9\r\n#\xff\nd")
    lines = [line for _, line in load_text(tmp_path / "text").lines(comment="#")]
    assert lines == [(1, ["a", "b"]), (3, ["é"]), (5, ["d"])]


# -- writing -------------------------------------------------------------------------------------


def test_all_files_appear(tmp_path):
    targets = tmp_path / "a", tmp_path / "b"
    with replacing(*targets) as temporaries:
        for temporary in temporaries:
            temporary.write_text(temporary.name)
        assert not any(target.exists() for target in targets)
    assert sorted(tmp_path.iterdir()) == list(targets)
    assert stat.S_IMODE(targets[0].stat().st_mode) & 0o600 == 0o600


def test_no_file_changes_when_writing_fails(tmp_path):
    targets = tmp_path / "a", tmp_path / "b"
    targets[0].write_text("old")
    with pytest.raises(KeyboardInterrupt), replacing(*targets) as (first, _):
        first.write_text("half")
        raise KeyboardInterrupt
    assert sorted(tmp_path.iterdir()) == [targets[0]]
    assert targets[0].read_text() == "old"


def test_full_disk_is_told(tmp_path):
    with pytest.raises(FormatError, match="No space left"), replacing(tmp_path / "a"):
        raise OSError(28, "No space left on device")
    assert list(tmp_path.iterdir()) == []


def test_folder_that_does_not_exist(tmp_path):
    with pytest.raises(FormatError, match="written to"), replacing(tmp_path / "none" / "a"):
        pass
