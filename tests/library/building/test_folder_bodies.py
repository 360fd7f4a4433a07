"""Clips of one skeleton in one folder agree on unit and vertical axis."""

from dataclasses import replace

import pytest
from made_bodies import Made, along_x, in_units, make_walk, turned_up, under_scene, with_positions
from small_library import build

from mocapdb.io import ReadOptions, read_clip, write_clip
from mocapdb.library import Library
from mocapdb.library.building.folder_bodies import FolderBody, as_in_folder, bodies_of_folders
from mocapdb.library.tuning import SAMPLED_OF_A_SKELETON
from mocapdb.motion.clip import Clip

METRES = 0.01


def bodies(corpus, wanted, own):
    found, _ = bodies_of_folders(corpus, wanted, own)
    return found


def exported(made: Made) -> Clip:
    """Return a body in centimetres, with bones along x at rest, under a root that stands still."""
    made = under_scene(with_positions(in_units(along_x(made), METRES), "places"))
    return Clip(replace(made.skeleton, up="y", metres_per_unit=METRES), made.channels, 30.0)


@pytest.fixture
def corpus(tmp_path):
    """Three walks with y up, and beside them a body that kicks its legs on its back."""
    for number, n_frames in enumerate((40, 50, 60)):
        write_clip(exported(make_walk(n_frames)), tmp_path / f"walk{number}.bvh")
    walk = make_walk(40)
    channels = walk.channels.copy()
    at = list(walk.skeleton.channel_names).index("hips.tz")
    channels[:, at] = -0.1  # above the floor, once it lies
    write_clip(exported(turned_up(replace(walk, channels=channels))), tmp_path / "lying.bvh")
    return tmp_path


def files(corpus, **said):
    return [(path.name, ReadOptions(**said)) for path in sorted(corpus.glob("*.bvh"))]


def test_who_lies_has_the_axis_of_those_who_walk(corpus):
    alone = read_clip(corpus / "lying.bvh")
    assert alone.skeleton.up == "z"  # there is nothing else to tell
    build(corpus, corpus / "l.mocapdb")
    with Library(corpus / "l.mocapdb") as library:
        ups = {(record.up, record.up_source, record.unit_m) for record in library.records()}
        assert ups == {("y", "inferred", METRES)}
        lying = library.clip("lying")
        assert (
            lying.provenance.count("up axis y instead, as of 4 clips of its skeleton in its folder")
            == 1
        )
        assert not any("instead" in step for step in library.clip("walk0").provenance)


def test_a_later_clip_agrees_with_those_that_are_there(corpus):
    aside = (corpus / "lying.bvh").rename(corpus / "lying.txt")
    build(corpus, corpus / "l.mocapdb")
    aside.rename(corpus / "lying.bvh")
    assert build(corpus, corpus / "l.mocapdb").built == 1
    with Library(corpus / "l.mocapdb") as library:
        assert library.record("lying").up == "y"


def test_what_is_said_wins(corpus):
    build(corpus, corpus / "l.mocapdb", reading=ReadOptions(up="z"))
    with Library(corpus / "l.mocapdb") as library:
        assert {(record.up, record.up_source) for record in library.records()} == {("z", "caller")}
    assert bodies(corpus, ["lying.bvh"], files(corpus, up="z", unit_m=1.0)) == {}


def test_another_folder_and_another_skeleton_say_nothing(corpus):
    own = files(corpus)
    expected = {"lying.bvh": FolderBody(METRES, "y", "hips", 4)}
    assert bodies(corpus, ["lying.bvh"], own) == expected
    other = exported(make_walk(40, legs=1.1))
    write_clip(other, corpus / "lying.bvh")  # of another person
    assert bodies(corpus, ["lying.bvh"], own) == {}
    (corpus / "sub").mkdir()
    (corpus / "walk0.bvh").rename(corpus / "sub" / "walk0.bvh")
    moved = [("sub/walk0.bvh", ReadOptions()), *(pair for pair in own if pair[0] != "walk0.bvh")]
    assert bodies(corpus, ["sub/walk0.bvh"], moved) == {}
    asked = bodies(corpus, ["walk1.bvh"], moved)
    assert asked == {"walk1.bvh": FolderBody(METRES, "y", "hips", 2)}


def test_bad_files_and_other_formats_say_nothing(corpus):
    (corpus / "walk1.bvh").write_text("HIERARCHY\nno more")
    text = (corpus / "walk2.bvh").read_text()
    (corpus / "walk2.bvh").write_text(text[: text.index("MOTION")] + "MOTION\nFrames: 1\n")
    found = bodies(corpus, ["lying.bvh", "walk0.npz"], files(corpus))
    assert found["lying.bvh"].n_clips == 2
    (corpus / "walk0.bvh").write_text("")
    assert bodies(corpus, ["lying.bvh"], files(corpus)) == {}


def test_only_some_of_many_clips_are_read(corpus):
    text = (corpus / "walk0.bvh").read_text()
    for number in range(2 * SAMPLED_OF_A_SKELETON - 4):
        (corpus / f"more{number:02d}.bvh").write_text(text)
    found = bodies(corpus, ["lying.bvh"], files(corpus))
    assert found["lying.bvh"].n_clips == 16


def test_the_unit_is_the_folder_s_too_where_none_is_stated(corpus):
    clip = read_clip(corpus / "walk0.bvh")
    changed = as_in_folder(clip, FolderBody(0.0254, "y", "hips", 5))
    assert (changed.skeleton.metres_per_unit, changed.unit_source) == (0.0254, "inferred")
    assert changed.provenance[-1].startswith("unit of 0.0254 m instead, as of 5 clips")
    stated = replace(clip, unit_source="caller", up_source="caller")
    assert as_in_folder(stated, FolderBody(0.0254, "z", "hips", 5)) is stated


def test_one_who_stands_outweighs_many_who_lie(corpus):
    for number in (1, 2):
        (corpus / f"walk{number}.bvh").unlink()
    walk = make_walk(40)
    columns = {name: i for i, name in enumerate(walk.skeleton.channel_names)}
    for number in range(6):
        channels = 0.2 * walk.channels  # hardly moving, on the back, each at another place
        channels[:, columns["hips.tz"]] = -0.1
        channels[:, columns["hips.ty"]] = 0.5 * number - 1.0
        lying = turned_up(replace(walk, channels=channels))
        write_clip(exported(lying), corpus / f"floor{number}.bvh")
    found = bodies(corpus, ["lying.bvh"], files(corpus))
    assert found == {"lying.bvh": FolderBody(METRES, "y", "hips", 8)}


def test_bones_are_told_apart_in_any_unit(corpus):
    for path in corpus.glob("*.bvh"):
        path.unlink()
    for unit_m in (0.01, 1.0, 1000.0):
        for name, legs in (("a", 1.0), ("b", 1.0), ("c", 1.004)):
            walk = in_units(make_walk(40, legs=legs), unit_m)
            write_clip(Clip(walk.skeleton, walk.channels, 30.0), corpus / f"{name}.bvh")
        asked = bodies(corpus, ["a.bvh", "b.bvh", "c.bvh"], files(corpus))
        assert set(asked) == {"a.bvh", "b.bvh"}
