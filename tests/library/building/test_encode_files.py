"""Files that cannot be read, and clips that cannot be encoded, are told apart."""

import errno
import os

import pytest
from small_library import CLIPS, build


@pytest.mark.parametrize(
    ("place", "what"),
    [("mocapdb.io.clip_files.read_clip", "read"), ("mocapdb.compression.codec.encode", "encode")],
)
def test_what_the_system_refuses_is_said_of_reading_or_of_encoding(
    small_corpus, tmp_path, monkeypatch, place, what
):
    def refuses(*arguments, **options):
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(place, refuses)
    report = build(small_corpus, tmp_path / "l.mocapdb")
    assert [failure.reason for failure in report.failed] == [
        f"cannot {what} (Input/output error)"
    ] * len(CLIPS)
