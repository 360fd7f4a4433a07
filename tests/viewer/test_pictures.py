"""Pictures of clips are made when they are asked for, kept, and make room for others."""

import re
import xml.etree.ElementTree as ET

import pytest

from mocapdb.library import Library
from mocapdb.viewer import pictures
from mocapdb.viewer.pictures import Pictures, make_room, picture_html


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("MOCAPDB_CACHE", str(tmp_path))
    return tmp_path / "pictures"


@pytest.fixture
def made(seen_library, folder):
    opened = Pictures(seen_library)
    yield opened
    opened.close()


@pytest.fixture
def addresses(seen_library):
    """Where the strip and the loop of a part of a clip are."""
    with Library(seen_library) as library:
        image = picture_html(library, library.record("01_01"), slice(20, 90))
    return ["/" + address for address in re.findall('="(pictures/[^"]+)"', image)]


def test_a_strip_and_a_loop(made, addresses):
    for address in addresses:
        root = ET.fromstring(made.answer(address).result())
        assert len(root.findall(".//{*}path")) == 3  # left, middle, right
    assert len(root.findall(".//{*}animate")) == 3


def test_a_picture_is_made_once(made, addresses, folder, monkeypatch):
    first = made.answer(addresses[0]).result()
    (path,) = folder.iterdir()
    assert path.read_text() == first
    monkeypatch.setattr(pictures, "_actor", None)  # it is not needed
    assert made.answer(addresses[0] + "?anything").result() == first


def test_a_long_stretch_is_drawn_of_the_same_frames(made, addresses, monkeypatch):
    drawn = made.answer(addresses[0]).result()
    monkeypatch.setattr(pictures, "DECODED_WHOLE", 10)
    monkeypatch.setattr(made, "_folder", made._folder / "another")
    assert made.answer(addresses[0]).result() == drawn


def test_nothing_else_is_answered(made, addresses, folder):
    strip = addresses[0]
    for address in ("/", "/pictures/", strip[1:], strip.replace("strip", "film"),
                    strip.replace("pictures/", "pictures/../"), strip + ".svg"):  # fmt: skip
        assert made.answer(address) is None
    another = re.sub("-[0-9a-f]{16}", "-" + 16 * "0", strip)  # of a clip as it is not any more
    assert made.answer(another).result() is None
    gone = re.sub(r"strip/\d+", "strip/999999", strip)
    assert "is missing" in made.answer(gone).result()
    assert not folder.exists()


def test_a_cleaned_clip_has_another_picture(seen_library, monkeypatch):
    with Library(seen_library) as library:
        record = library.record("01_01")
        before = picture_html(library, record)
        monkeypatch.setattr(library, "revision", lambda record: type("R", (), {"sha256": "new"}))
        assert picture_html(library, record) != before


def test_what_was_not_used_makes_room(tmp_path):
    import os

    for age, name in enumerate(("new", "used", "old", "older")):
        (tmp_path / f"{name}.svg").write_bytes(bytes(100))
        os.utime(tmp_path / f"{name}.svg", (1e9 - age, 1e9 - age))
    (tmp_path / "no-picture").write_bytes(bytes(1000))
    make_room(tmp_path, 250)
    assert {path.name for path in tmp_path.iterdir()} == {"new.svg", "used.svg", "no-picture"}


def test_no_cache_is_done_without(seen_library, addresses, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("MOCAPDB_CACHE", str(tmp_path / "file"))
    opened = Pictures(seen_library)
    try:
        assert opened.answer(addresses[0]).result().startswith("<svg")
    finally:
        opened.close()
    assert opened.answer(addresses[0]) is None
