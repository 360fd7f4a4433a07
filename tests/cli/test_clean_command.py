"""``mocapdb clean`` on a clip, a folder and a library."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from made_bodies import make_dog, make_walk, renamed

from mocapdb.cli import cli
from mocapdb.corpus import synthetic
from mocapdb.io import read_clip, write_clip
from mocapdb.motion.clip import Clip


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    """A walk with two faults, as a file, and the faults."""
    folder = tmp_path_factory.mktemp("takes")
    walk = synthetic.make_clip("walk", seed=3, sensor_noise_deg=0.02)
    faulty, _, faults = synthetic.inject_faults(
        walk, seed=5, kinds=["offset", "noise"], n=2, size_deg=(30, 60), length_s=(0.2, 0.4)
    )
    write_clip(faulty, folder / "take.amc")
    return folder / "take.amc", faults, faulty


def clip_rotations(clip):
    """1 in the columns of rotations, 0 in others."""
    columns = np.zeros(clip.channels.shape[1])
    columns[clip.skeleton.rotation_channels] = 1.0
    return columns


def run(*arguments):
    return CliRunner().invoke(cli, ["clean", *map(str, arguments)])


def test_the_contract(take, tmp_path):
    path, faults, faulty = take
    out, picture = tmp_path / "clean.amc", tmp_path / "mdm.png"
    answer = run(path, "-o", out, "--map", picture, "--json")
    assert answer.exit_code == 0, answer.output
    report = json.loads(answer.stdout)
    assert report["clip"] == "take"
    assert report["output"] == str(out)
    assert report["text_kept"] is True
    assert all(row["confidence"] < report["threshold"] for row in report["below_threshold"])
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert len(report["spans"]) == 2
    for span, fault in zip(report["spans"], faults, strict=True):
        assert span["joint"] == faulty.skeleton.names[fault.joint]
        assert span["start"] == pytest.approx(fault.start / 120, abs=0.03)
        assert span["end"] == pytest.approx(fault.end / 120, abs=0.03)
        assert span["kind"] == fault.kind
        assert span["repaired"] is True
        assert 0 < span["confidence"] <= 1
        assert span["moved_deg"] > 1
        assert span["expected_deg"] is None or span["expected_deg"] > 0
    before, after = read_clip(path), read_clip(out)
    changed = (before.channels != after.channels).any(axis=1)
    flagged = np.zeros(len(before), dtype=bool)
    for span in report["spans"]:
        flagged[slice(*span["frames"])] = True
    assert not (changed & ~flagged).any()


def test_looking_writes_nothing(take, tmp_path):
    answer = run(take[0], "--detect-only", "--json")
    report = json.loads(answer.stdout)
    assert report["output"] is None
    assert [span["repaired"] for span in report["spans"]] == [False, False]
    assert list(tmp_path.iterdir()) == []


def test_a_library_and_one_clip_of_it(take, tmp_path):
    """Its files are looked at, not what storing has left of them, as long as they are there."""
    from mocapdb.compression import Target
    from mocapdb.library import BuildSettings, build_library

    folder = tmp_path / "corpus"
    folder.mkdir()
    write_clip(take[2], folder / "faulty.amc")
    build_library(folder, tmp_path / "a.mocapdb", BuildSettings(Target("max_mm", 1.0)))
    for extra in ([], ["--clip", "faulty"]):
        answer = run(tmp_path / "a.mocapdb", *extra, "-o", tmp_path / "out", "--json")
        assert answer.exit_code == 0, answer.output
        (report,) = json.loads(answer.stdout)["clips"]
        assert {span["joint"] for span in report["spans"]} >= {
            take[2].skeleton.names[fault.joint] for fault in take[1]
        }
        assert (tmp_path / "out" / "faulty.amc").is_file()
        of_file = json.loads(run(folder / "faulty.amc", "--json").stdout)["spans"]
        told = ("joint", "frames", "kind", "confidence")
        for span, same in zip(report["spans"], of_file, strict=True):
            assert all(span[key] == same[key] for key in told)
        assert report["notes"] == []
    answer = run(tmp_path / "a.mocapdb", "--clip", "nobody")
    assert answer.exit_code == 1
    (folder / "faulty.amc").unlink()
    (report,) = json.loads(run(tmp_path / "a.mocapdb", "--json").stdout)["clips"]
    assert len(report["spans"]) >= 2
    assert "a codec drew some of these curves" in report["notes"][-1]


def test_for_people(take):
    answer = run(take[0])
    assert answer.exit_code == 0
    assert "2 flagged in 5.00 s" in answer.stdout
    assert "offset" in answer.stdout


def test_a_folder_with_a_context_and_a_broken_file(take, tmp_path):
    path, _, _ = take
    takes = tmp_path / "takes"
    (takes / "more").mkdir(parents=True)
    clip = read_clip(path)
    write_clip(clip, takes / "a.npz")
    write_clip(clip[:200], takes / "more" / "b.npz")
    (takes / "broken.bvh").write_text("HIERARCHY\nnothing\n")
    answer = run(takes, "--context", path, "-o", tmp_path / "out", "--json")
    assert answer.exit_code == 1
    report = json.loads(answer.stdout)
    assert [one["clip"] for one in report["clips"]] == ["take", "take"]
    assert len(report["failed"]) == 1
    assert "broken.bvh" in report["failed"][0]["path"]
    assert (tmp_path / "out" / "more" / "b.npz").is_file()


def test_contacts_foot_skate_and_a_picture_of_before_and_after(take, tmp_path):
    path, faults, faulty = take
    joint = faulty.skeleton.names[faults[0].joint]
    out, picture = tmp_path / "clean.amc", tmp_path / "pictures" / "both.png"
    start, end = faults[0].start / 120, faults[0].end / 120 + 0.1
    answer = run(
        path, "-o", out, "--before-after", picture, "--foot-skate", "legs", "--json",
        "--contact", f"{joint}@{start:.3f}-{end:.3f}",
    )  # fmt: skip
    assert answer.exit_code == 0, answer.output
    report = json.loads(answer.stdout)
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert report["foot_slide_mm"]["after"] <= report["foot_slide_mm"]["before"]
    assert any(span["contact_mm"] is not None for span in report["spans"])
    assert out.is_file()


def test_a_library_is_a_context(take, tmp_path):
    """Even the take's own lossy copy in it does not hide the faults."""
    from mocapdb.compression import Target
    from mocapdb.library import BuildSettings, build_library

    folder = tmp_path / "corpus"
    folder.mkdir()
    write_clip(take[2], folder / "take.amc")
    for seed in (5, 6):
        write_clip(synthetic.make_clip("walk", seed=seed), folder / f"walk{seed}.bvh")
    slow = synthetic.make_clip("walk", seed=8)
    write_clip(slow.replace(channels=slow.channels[::2], fps=60.0), folder / "slow.bvh")
    build_library(folder, tmp_path / "a.mocapdb", BuildSettings(Target("max_mm", 1.0)))
    bvh = tmp_path / "take.bvh"
    write_clip(take[2], bvh)
    for extra in ([], ["--two-stage"]):
        answer = run(bvh, "--context", tmp_path / "a.mocapdb", "--json", *extra)
        assert answer.exit_code == 0, answer.output
        report = json.loads(answer.stdout)
        assert report["context"]["clips"] == 3
        assert len(report["spans"]) == 2
        assert "compared at 24 Hz" in answer.stderr


def test_a_context_of_another_rig_says_what_it_tells_nothing_of(take, tmp_path):
    """An AMC against BVHs: one of its own body, and one of a stranger without toes and thumbs."""
    write_clip(synthetic.make_clip("walk", seed=5), tmp_path / "own.bvh")
    made = renamed(make_walk(120))
    write_clip(Clip(made.skeleton, made.channels, 30.0), tmp_path / "stranger.bvh")
    amc = tmp_path / "take.amc"
    write_clip(take[2], amc)
    contexts = ("--context", tmp_path / "own.bvh", "--context", tmp_path / "stranger.bvh")
    answer = run(amc, *contexts, "--json")
    assert answer.exit_code == 0, answer.output
    report = json.loads(answer.stdout)
    assert report["context"]["clips"] == 2
    own, stranger = report["context"]["other_bodies"]
    assert own["without_counterpart"] == []
    assert stranger["joints"] == 15
    assert {"ltoes", "lthumb", "upperback"} < set(stranger["without_counterpart"])
    assert "lfemur" not in stranger["without_counterpart"]
    note = next(note for note in report["notes"] if "no counterpart" in note)
    assert note.startswith("context: 1 clip of other bodies, compared by 15 of 29 joints")
    assert len(report["spans"]) == 2
    dog = renamed(make_dog())
    write_clip(Clip(dog.skeleton, dog.channels, 30.0), tmp_path / "dog.bvh")
    answer = run(amc, *contexts, "--context", tmp_path / "dog.bvh", "--json")
    assert "context: 1 clip left out, of bodies that do not map to 'take'" in answer.stderr
    assert json.loads(answer.stdout)["context"]["clips"] == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["TAKE", "--detect-only", "-o", "x.bvh"], "leave out -o"),
        (["TAKE", "--clip", "a"], "names a clip of a library"),
        (["TAKE", "--threshold", "7"], "threshold in"),
        (["TAKE", "--foot-skate", "legs"], "with -o"),
        (["TAKE", "--contact", "lhand"], "JOINT@FROM-TO"),
        (["TAKE", "--contact", "paw@0-1"], "paw"),
        (["TAKE", "--contact", "lhand@3-99"], "a contact within"),
        (["nothing.bvh"], "nothing.bvh"),
        (["take.txt"], "Expected a clip"),
        (["EMPTY"], "but found none"),
        (["TAKE", "--context", "EMPTY"], "it has none"),
        (["TAKE", "--context", "nowhere"], "there is none: nowhere"),
        (["TAKE", "--map", "m.txt"], "a .png with --map, but got 'm.txt'"),
        (["EMPTY", "-o", "x.bvh"], "-o is a file, but several clips need a folder"),
        (["EMPTY", "--map", "x.png"], "--map is a file, but several clips need a folder"),
        (["EMPTY", "--apply", "--undo"], "give one of them"),
        (["EMPTY", "--apply", "--foot-skate", "legs"], "library: leave out --foot-skate."),
        (["EMPTY", "--undo", "-o", "x", "--literal"], "back: leave out -o, --literal."),
        (["TAKE", "--context", "OTHER"], "none of its 1 clips"),
    ],
)
def test_wrong_use_is_told(take, tmp_path, arguments, message):
    (tmp_path / "empty").mkdir()
    dog = renamed(make_dog())
    write_clip(Clip(dog.skeleton, dog.channels, 30.0), tmp_path / "other.bvh")
    named = {"TAKE": take[0], "EMPTY": tmp_path / "empty", "OTHER": tmp_path / "other.bvh"}
    answer = run(*(named.get(argument, argument) for argument in arguments))
    assert answer.exit_code in (1, 2)
    assert message in answer.stderr
    assert "Traceback" not in answer.output


def test_the_papers_map_flags_far_more(take):
    ours, theirs = (
        json.loads(run(take[0], "--json", *more).stdout) for more in ((), ("--literal",))
    )
    assert theirs["threshold"] == 0.5
    assert len(theirs["spans"]) > 20 * len(ours["spans"])


def test_notes_of_short_clips_and_of_a_t_pose(take, tmp_path):
    clip = read_clip(take[0])
    for n_frames, said in ((3, "3 frames: too short to be looked at"), (40, "similar motion")):
        write_clip(clip[:n_frames], tmp_path / "short.bvh")
        assert said in run(tmp_path / "short.bvh").stdout
    turns = clip_rotations(clip)
    pose, posed = clip.channels[0] * (1.0 - turns), clip.channels + 35.0 * turns
    write_clip(clip.replace(channels=np.vstack([pose, posed])), tmp_path / "posed.bvh")
    (note,) = json.loads(run(tmp_path / "posed.bvh", "--json").stdout)["notes"]
    assert note.startswith("frame 0 of 601, in front of a jump of the whole body")


def test_what_is_not_drawn_is_said(take, tmp_path, monkeypatch):
    monkeypatch.setattr("mocapdb.cli.clean.MOST_DRAWN", 1)
    answer = run(take[0], "--before-after", tmp_path / "a.png")
    assert "1 of 2 spans drawn, those that moved the most" in answer.stdout
