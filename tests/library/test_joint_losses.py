"""What joints lost: kept by the catalogue, shown by info, told by build."""

import sqlite3

import numpy as np
import pytest
from small_library import made_older, run, run_json

from mocapdb.corpus import synthetic
from mocapdb.errors import LibraryError
from mocapdb.io import write_clip
from mocapdb.library import Library, compact_library
from mocapdb.library.joint_losses import (
    _RECORD,
    ClipLosses,
    JointLoss,
    lost_most,
    pack_losses,
    unpack_losses,
)
from mocapdb.motion.joint_errors import joint_errors

WALK = synthetic.make_clip("walk", seed=1, duration_s=1.0)


@pytest.fixture
def waving(tmp_path):
    """A folder with a clip in which only a thumb moves, by 20 degrees, and a walk."""
    skeleton = WALK.skeleton
    channels = np.tile(WALK.channels[:1], (120, 1))
    column = skeleton.rotation_columns(skeleton.joint("lthumb"))[0]
    channels[:, column] += 10.0 * np.sin(np.linspace(0, 20, 120))
    folder = tmp_path / "corpus"
    folder.mkdir()
    write_clip(WALK.replace(channels=channels), folder / "wave.bvh")
    write_clip(WALK, folder / "walk.bvh")
    return folder


def build(folder, library, *options):
    return run("build", folder, "-o", library, "--jobs", 1, "--no-index", *options)


def test_records_come_back_with_three_digits():
    other = WALK.channels + np.random.default_rng(0).normal(0, 1, WALK.channels.shape)
    errors = joint_errors(WALK.skeleton, WALK.channels, other)
    losses = unpack_losses(pack_losses(errors), WALK.skeleton.names)
    assert {loss.joint for loss in losses} >= {"lfemur", "rfoot", "head"}
    for loss in losses:
        index = WALK.skeleton.joint(loss.joint)
        assert loss.unit == "deg"
        for name, values in (("mean", errors.mean), ("worst", errors.worst), ("kept", errors.kept)):
            assert getattr(loss, name) == pytest.approx(values[0, index], rel=1e-3)
        assert loss.worst_frame == errors.worst_frame[0, index]
    shares = [loss.share for loss in losses if loss.moves]
    assert shares == sorted(shares, reverse=True)


@pytest.mark.parametrize("data", [b"x", b"\xff" * 15, bytes(15)])
def test_damaged_records_are_refused(data):
    with pytest.raises(LibraryError, match="Expected"):
        unpack_losses(data, WALK.skeleton.names)


def loss(joint, swing, kept, unit="deg"):
    return JointLoss(joint, unit, swing, kept, 0.1, 0.5, 6)


def test_what_moves_and_what_is_held_still():
    """From 3 degrees, or millimetres, on; where over nine tenths are lost."""
    assert not loss("a", 2.9, 0.0).is_held_still
    assert loss("a", 3.1, 0.0).is_held_still
    assert loss("a", 3.1, 0.0, "mm").is_held_still
    assert not loss("a", 10.0, 1.1).is_held_still
    assert loss("a", 10.0, 0.9).is_held_still


def packed(joint, swing, kept, kind=0):
    return np.array([(joint, kind, swing, kept, 0.1, 0.5, 6)], _RECORD).tobytes()


def test_those_that_lost_most_equal_those_found_clip_by_clip():
    chance = np.random.default_rng(3)
    joints = {1: ["hip", "knee", "toe"], 2: ["knee", "hand"]}
    clips = []
    for number in range(40):
        skeleton = int(chance.integers(1, 3))
        records = [
            packed(joint, *chance.uniform(0.1, 9, 2), kind=int(chance.integers(2)))
            for joint in range(len(joints[skeleton]))
        ]
        clips.append(ClipLosses(f"c{number}", 30.0, skeleton, b"".join(records)))
    losses = [
        (clip.clip, each)
        for clip in clips
        for each in unpack_losses(clip.data, joints[clip.skeleton_id])
        if each.moves
    ]
    most = lost_most(clips, joints.__getitem__)
    for what, key in (("joints", lambda own: own[1].joint), ("worst_clips", lambda own: own[0])):
        worst = {}
        for own in sorted(losses, key=lambda own: own[1].share):
            worst[key(own)] = own
        found = sorted(worst.values(), key=lambda own: -own[1].share)[:8]
        assert [(row["clip"], row["joint"], row["kept"]) for row in most[what]] == [
            (clip, each.joint, each.kept) for clip, each in found
        ]


def test_damage_in_one_of_many_clips_is_refused():
    clips = [ClipLosses("a", 30.0, 1, packed(0, 9, 1)), ClipLosses("b", 30.0, 1, packed(1, 9, 1))]
    with pytest.raises(LibraryError, match="Expected errors of 1 joints"):
        lost_most(clips, lambda skeleton: ["hip"])


def test_those_that_lost_most():
    """Each joint and each clip once, eight at the most, and none that hardly moves."""
    names = [*(f"joint{i}" for i in range(10)), "calm"]
    rows = [
        ClipLosses(f"clip{i}", 60.0, 1, packed(i % 10, 10.0, 10.0 - 0.1 * i) + packed(10, 1.0, 0.0))
        for i in range(20)
    ]
    most = lost_most(rows, lambda skeleton: names)
    assert [row["joint"] for row in most["joints"]] == [f"joint{i}" for i in range(9, 1, -1)]
    assert [row["clip"] for row in most["worst_clips"]] == [f"clip{i}" for i in range(19, 11, -1)]
    assert most["joints"][0]["worst_s"] == pytest.approx(0.1)


def test_info_shows_them(waving, tmp_path):
    library = tmp_path / "l.mocapdb"
    assert build(waving, library).stderr == ""
    figures = run_json("info", library, "wave")
    assert figures["unmeasured"] == 0
    (row,) = figures["joints"]
    assert (row["joint"], row["unit"]) == ("lthumb", "deg")
    assert row["kept"] >= 0.9 * row["swing"] > 17
    assert row["mean"] <= row["worst"]
    assert row["worst_s"] == pytest.approx(row["worst_frame"] / 120)
    assert "lthumb: keeps " in run("info", library, "wave").stdout
    whole = run_json("info", library)
    assert {row["clip"] for row in whole["worst_clips"]} == {"wave", "walk"}
    assert len(whole["joints"]) == 8
    assert "worst clip" in run("info", library).stdout


def test_build_tells_what_is_held_still(waving, tmp_path):
    answer = build(waving, tmp_path / "l.mocapdb", "--joint-share", 0, "--mean-mm", 3)
    assert answer.exit_code == 0
    assert "warning: joints that move are held still by mean_mm <= 3 mm" in answer.stderr
    assert "wave: lthumb (20 deg)" in answer.stderr
    told = run_json(
        "build", waving, "-o", tmp_path / "m.mocapdb", "--joint-share", 0, "--mean-mm", 3
    )
    assert any("wave: lthumb" in line for line in told["held_still"])


def test_what_is_advised_fits_the_options(waving, tmp_path):
    library = tmp_path / "l.mocapdb"
    assert "--joint-share 0.1 keeps" in build(waving, library, "--joint-share", 0).stderr
    within_bytes = build(waving, library, "--bytes-per-frame", 2).stderr
    assert "--joint-share 0.1, with an error in place of --bytes-per-frame, keeps" in within_bytes


def test_a_clip_that_is_held_still_names_its_first_joints(waving, tmp_path):
    (waving / "wave.bvh").unlink()
    told = build(waving, tmp_path / "l.mocapdb", "--joint-share", 0, "--mean-mm", 1000).stderr
    assert "root" in told or "femur" in told
    assert told.count(" deg)") == 8
    assert ", and " in told


def test_libraries_of_before_say_that_it_was_not_measured(waving, tmp_path):
    library = tmp_path / "l.mocapdb"
    build(waving, library)
    with sqlite3.connect(library / "catalogue.db") as catalogue:
        catalogue.execute("DROP TABLE joint_errors")
    catalogue.close()
    made_older(library, 3)
    figures = run_json("info", library, "wave")
    assert (figures["joints"], figures["unmeasured"]) == ([], 1)
    assert "not measured" in run("info", library, "wave").stdout
    assert "of 2 clips not measured" in run("info", library).stdout
    assert run_json("compact", library)["freed_bytes"] >= 0
    assert run_json("info", library)["unmeasured"] == 2
    assert run("verify", library).exit_code == 0
    (waving / "walk.bvh").write_text((waving / "wave.bvh").read_text())
    assert build(waving, library).exit_code == 0  # a new clip of it
    assert run_json("info", library)["unmeasured"] == 1


def test_what_deleted_clips_lost_is_forgotten(waving, tmp_path):
    library = tmp_path / "l.mocapdb"
    build(waving, library)
    (waving / "walk.bvh").write_text((waving / "wave.bvh").read_text())
    build(waving, library)
    with Library(library) as opened:
        assert len(opened.catalogue.joint_errors()) == 3
    compact_library(library)
    with Library(library) as opened:
        assert len(opened.catalogue.joint_errors()) == 2


@pytest.mark.parametrize(
    "options",
    [
        ("--joint-share", "-0.1"),
        ("--joint-share", "nan"),
        ("--joint-share", "1.5"),
        ("--joint-share", "much"),
        ("--mean-mm", "2", "--max-mm", "1"),
        ("--mean-mm", "2", "--max-mm", "nan"),
        ("--mean-mm", "2", "--max-mm", "0"),
        ("--mean-mm", "2", "--error", "1"),
        ("--bytes-per-frame", "9", "--joint-share", "0.1"),
    ],
    ids=" ".join,
)
def test_promises_that_are_none(waving, tmp_path, options):
    answer = build(waving, tmp_path / "l.mocapdb", *options)
    assert answer.exit_code == 2
    assert "Error: " in answer.stderr
    assert not (tmp_path / "l.mocapdb").exists()


def test_a_maximum_beside_a_mean(waving, tmp_path):
    library = tmp_path / "l.mocapdb"
    assert build(waving, library, "--mean-mm", 3, "--max-mm", 6).exit_code == 0
    with Library(library) as opened:
        errors = [(record.error_mean_mm, record.error_max_mm) for record in opened.records()]
    assert all(mean <= 3 and most <= 6 for mean, most in errors)
