"""A changed clip in the text of its source: what is untouched stays, letter by letter."""

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.io import read_clip, write_clip
from mocapdb.io.source_text import write_like_source

JOINT, FRAMES = "lhumerus", slice(10, 13)


def changed(clip):
    channels = clip.channels.copy()
    channels[FRAMES, clip.skeleton.rotation_columns(clip.skeleton.joint(JOINT))] += 0.123456789
    return clip.replace(channels=channels)


def odd(text):
    """The same numbers, spelt as an exporter might, with what only a copy keeps."""
    lines = text.split("\n")
    return "\r\n".join(
        "  " + line.replace(" ", "\t").replace("e-", "E-") if i > len(lines) // 2 else line
        for i, line in enumerate(lines)
    )


@pytest.fixture(params=[".amc", ".bvh"])
def source(request, tmp_path):
    path = tmp_path / f"take{request.param}"
    write_clip(synthetic.make_clip("walk", seed=1, duration_s=0.4), path)
    path.write_bytes(odd(path.read_text()).encode())
    return path


def test_only_changed_numbers_are_spelt_anew(source, tmp_path):
    before = read_clip(source)
    after = changed(before)
    out = tmp_path / f"out{source.suffix}"
    assert write_like_source(before, after, out)
    np.testing.assert_array_equal(read_clip(out).channels, after.channels)
    old, new = source.read_bytes().split(b"\n"), out.read_bytes().split(b"\n")
    rows = [i for i, (a, b) in enumerate(zip(old, new, strict=True)) if a != b]
    assert len(rows) == 3
    for i in rows:
        words = list(zip(old[i].split(), new[i].split(), strict=True))
        assert sum(a != b for a, b in words) == 3  # the joint's angles, in their row
        assert old[i].startswith(b"  ") == new[i].startswith(b"  ")
    if source.suffix == ".amc":
        assert (tmp_path / "out.asf").read_bytes() == source.with_suffix(".asf").read_bytes()


def test_nothing_changed_is_a_copy(source, tmp_path):
    before = read_clip(source)
    out = tmp_path / f"out{source.suffix}"
    assert write_like_source(before, before, out)
    assert out.read_bytes() == source.read_bytes()


def test_where_the_source_does_not_show_it_nothing_is_written(source, tmp_path):
    before = read_clip(source)
    after = changed(before)
    out = tmp_path / f"out{source.suffix}"
    other = ".bvh" if source.suffix == ".amc" else ".amc"
    assert not write_like_source(before, after, out.with_suffix(other))
    assert not write_like_source(before, after[:20], out)
    text = source.read_text()
    word = text.split()[-1]
    source.write_text(
        text[: text.rindex(word)] + "1" + word
    )  # changed since, but in no touched row
    assert write_like_source(before, after, out)
    out.unlink()
    for start in ("11\n", "12\n") if source.suffix == ".amc" else ("Frame Time",):
        text = text.replace(start, start + "# a remark\n", 1)
    source.write_text(text.replace("Frames:", "Frames :"))
    rows = text.split("\n")
    source.write_text("\n".join([*rows[:-40], *rows[-30:]]))  # frames are gone
    assert not write_like_source(before, after, out)
    source.unlink()
    assert not write_like_source(before, after, out)
    assert not out.exists()
