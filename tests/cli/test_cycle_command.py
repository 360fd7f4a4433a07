import json

import made_bodies as made
import numpy as np
import pytest
from click.testing import CliRunner
from small_library import write_clips

from mocapdb.cli import cli
from mocapdb.corpus import synthetic
from mocapdb.cycles import seam_steps
from mocapdb.cycles.synthesis import blending
from mocapdb.io import read_clip, write_clip
from mocapdb.motion.clip import Clip

CONTRACT = {
    "clip",
    "period_frames",
    "period_s",
    "laps",
    "confidence",
    "template_error_rad",
    "seam_steps",
    "method",
    "output",
}


def run(*args):
    result = CliRunner().invoke(cli, [str(arg) for arg in args])
    assert "Traceback" not in result.output
    return result


def figures(*args):
    result = run(*args, "--json")
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


@pytest.fixture(scope="module")
def clips(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clips")
    for kind in ("walk", "run"):
        clip = synthetic.make_clip(kind, seed=1, n_cycles=3.3, sensor_noise_deg=0.15, name=kind)
        write_clip(clip, folder / f"{kind}.bvh")
    still = np.repeat(clip.channels[:1], 300, axis=0)
    write_clip(clip.replace(channels=still), folder / "still.bvh")
    write_clip(synthetic.make_clip("sequence", seed=1, duration_s=18), folder / "many.npz")
    return folder


@pytest.mark.parametrize("suffix", ["bvh", "amc", "npz"])
def test_a_clip_becomes_a_loop(clips, tmp_path, suffix):
    output = tmp_path / f"loop.{suffix}"
    found = figures("cycle", clips / "walk.bvh", "-o", output)
    assert found.keys() >= CONTRACT
    assert found["clip"] == "walk"
    assert found["laps"] == pytest.approx(3.3, abs=0.05)
    assert found["confidence"] > 0.8
    assert found["output"] == str(output)
    assert found["jerk_ratio"] <= 1.0
    loop = read_clip(output, fps=120.0)
    assert len(loop) == round(found["period_frames"])
    rel = 0.06 if suffix == "amc" else 0.001  # an AMC has no end sites, so fewer joints count
    assert seam_steps(loop) == pytest.approx(found["seam_steps"], rel=rel)
    assert found["seam_steps"] < 1.2


def test_a_loop_below_a_scene_is_judged_and_drawn_from_its_body(tmp_path):
    whole = made.under_scene(made.make_walk(150))
    take, loop = tmp_path / "take.bvh", tmp_path / "loop.bvh"
    write_clip(Clip(whole.skeleton, whole.channels, 30.0), take)
    found = figures("cycle", take, "-o", loop, "--report", tmp_path / "pictures")
    assert found["seam_steps"] < 1.5  # the body walks on at the seam; the scene does not
    assert found["jerk_ratio"] < 1.1
    assert set(read_clip(loop).skeleton.names) == set(whole.skeleton.names)
    assert len(found["pictures"]) >= 3


@pytest.fixture(scope="module")
def below_scene(tmp_path_factory):
    """Two walks below a root that stands aside, turned."""
    folder = tmp_path_factory.mktemp("scene") / "walk"
    folder.mkdir()
    for name, amplitude in (("one", 1.0), ("two", 0.9)):
        plain = made.make_walk(150)
        body = made.under_scene(plain)
        channels = body.channels.copy()
        channels[:, 12:] *= amplitude
        channels[:, :6] = (0.5, 0.0, -0.25, 0.0, 0.0, 0.0)
        channels[:, 6:9] -= (0.5, 0.0, -0.25)
        write_clip(Clip(body.skeleton, channels, 30.0), folder / f"{name}.bvh")
    return folder


@pytest.mark.parametrize("how", [("--weight", 0.5), ("--transition", 1)])
def test_a_blend_has_the_scene(below_scene, tmp_path, how):
    sources = [below_scene / "one.bvh", below_scene / "two.bvh"]
    told = figures("blend", *sources, *how, "-o", tmp_path / "out.bvh")
    clip = read_clip(tmp_path / "out.bvh")
    assert clip.skeleton.names[0] == "scene"
    np.testing.assert_allclose(clip.channels[:, :3], [(0.5, 0.0, -0.25)] * len(clip), atol=1e-9)
    assert [each["path"] for each in told["inputs"]] == [str(path) for path in sources]
    assert {each["unit_m"] for each in told["inputs"]} == {1.0}
    assert {each["up_source"] for each in told["inputs"]} == {"inferred"}
    assert told["frames"] == len(clip)


def test_the_cycle_of_a_class_has_the_scene(below_scene, tmp_path):
    library = tmp_path / "l.mocapdb"
    assert run("build", below_scene.parent, "-o", library, "--jobs", 1).exit_code == 0
    told = figures("cycle", library, "--class", "walk", "-o", tmp_path / "walk.bvh")
    assert read_clip(tmp_path / "walk.bvh").skeleton.names[0] == "scene"
    assert (told["fps"], told["fps_source"]) == (30.0, "file")
    assert (told["unit_m"], told["up"]) == (1.0, "y")
    for number in range(2):  # made anew, then as it was kept
        out = tmp_path / f"mix{number}.bvh"
        figures("blend", library, "--class", "walk", "--class", "walk", "--weight", 0.5, "-o", out)
        assert read_clip(out).skeleton.names[0] == "scene"


def test_rate_laps_and_place_can_be_chosen(clips, tmp_path):
    output = tmp_path / "loop.npz"
    found = figures(
        "cycle", clips / "run.bvh", "-o", output, "--out-fps", 30, "--laps", 2, "--in-place"
    )
    loop = read_clip(output)
    assert loop.fps == 30
    assert len(loop) == 2 * round(30 * found["period_s"])
    path = loop.channels[:, [0, 2]] * loop.skeleton.metres_per_unit
    assert np.ptp(path, axis=0).max() < 0.3


def test_a_loop_is_closed_and_of_any_length(clips, tmp_path):
    output = tmp_path / "loop.npz"
    found = figures("cycle", clips / "walk.bvh", "-o", output, "--length", 48, "--closed")
    loop = read_clip(output)
    assert len(loop) == 49
    assert found["lap_frames"] == 48
    assert found["tempo_error"] == pytest.approx(48 / (120 * found["period_s"]) - 1)
    # 48 frames last as long as the motion does at this rate
    advice = f"--out-fps {48 / found['period_s']:.4g} keeps its tempo"
    assert any(warning.endswith(advice) for warning in found["warnings"])
    first, last = loop.channels[0], loop.channels[-1]
    np.testing.assert_allclose(last[3:], first[3:], atol=1e-6)
    way = np.linalg.norm(last[:3] - first[:3]) * loop.skeleton.metres_per_unit
    assert way == pytest.approx(1.2, abs=0.4)


def test_loops_are_written_as_export_writes_clips(clips, tmp_path):
    for name in ("loop.glb", "loop.gif"):
        told = figures("cycle", clips / "walk.bvh", "-o", tmp_path / name, "--out-fps", 25)
        assert told["output"] == str(tmp_path / name)
    assert b"root_motion" in (tmp_path / "loop.glb").read_bytes()
    run("cycle", clips / "walk.bvh", "-o", tmp_path / "still.glb", "--in-place", "--out-fps", 25)
    assert b"root_motion" not in (tmp_path / "still.glb").read_bytes()
    run("cycle", clips / "walk.bvh", "-o", tmp_path / "loop.csv", "--as", "aligned")
    assert (tmp_path / "loop.csv").read_text().startswith("time (s)")


def test_several_clips_at_once(clips, tmp_path):
    sources = [clips / f"{name}.bvh" for name in ("walk", "still", "run")]
    told = figures(
        "cycle", *sources, "-o", tmp_path / "loops", "--format", "npz", "--report", tmp_path / "r"
    )
    assert [each["clip"] for each in told["clips"]] == ["walk", "run"]
    assert list(told["without_cycle"]) == [str(clips / "still.bvh")]
    for each in told["clips"]:
        (own,) = each["cycles"]
        assert own["output"] == str(tmp_path / "loops" / f"{each['clip']}.npz")
        assert len(read_clip(own["output"])) == own["lap_frames"]
        assert {path.name for path in (tmp_path / "r" / each["clip"]).iterdir()} >= {
            "fit.png",
            "jerk.png",
            "excitation.png",
        }
    assert run("cycle", clips / "still.bvh", clips / "still.bvh").exit_code == 1


def test_only_some_joints_are_animated(clips, tmp_path):
    out = tmp_path / "arm.npz"
    figures("cycle", clips / "walk.bvh", "-o", out, "--animate", "lhumerus, lradius")
    loop = read_clip(out)
    still = np.ptp(loop.channels, axis=0) < 1e-9
    moving = {loop.skeleton.channel_names[i].split(".")[0] for i in np.flatnonzero(~still)}
    assert moving == {"lhumerus", "lradius"}


def test_the_most_persistent_loops_are_as_many_motions(clips, tmp_path):
    result = run("cycle", clips / "walk.bvh", "--loops", 2, "-o", tmp_path / "l.npz", "--json")
    assert result.exit_code == 0
    cycles = json.loads(result.stdout)["cycles"]
    assert [each["rank"] for each in cycles] == list(range(len(cycles)))
    assert len(cycles) == 2 or "no cycle: rank 1" in result.stderr
    assert cycles[0]["output"] == str(tmp_path / "l_0.npz")
    many = run("cycle", clips / "walk.bvh", "--loops", 3, "--epsilon", 1e-5)
    assert many.exit_code == 1


def test_a_clip_is_subsampled(clips, tmp_path):
    out = tmp_path / "loop.npz"
    usual = figures("cycle", clips / "walk.bvh")
    told = figures("cycle", clips / "walk.bvh", "--subsample", 3, "-o", out)
    assert told["period_frames"] == pytest.approx(usual["period_frames"], rel=0.01)
    assert told["end"] == pytest.approx(usual["end"], abs=6)
    assert read_clip(out).fps == 120.0
    assert told["lap_frames"] == usual["lap_frames"]


def test_the_root_is_fitted_as_told(clips, tmp_path):
    out = tmp_path / "loop.npz"
    figures(
        "cycle", clips / "walk.bvh", "-o", out, "--loose-feet", "--root-axes", "XY",
        "--root-linear", "y", "--root-harmonics", 3, "--model", "m3", "--no-velocities",
    )  # fmt: skip
    path = read_clip(out).channels[:, :3]
    assert np.ptp(path[:, 2]) < 1e-9
    assert np.ptp(path[:, 0]) < 2.0  # it sways, and does not advance


def test_the_search_can_be_told_how(clips):
    usual = figures("cycle", clips / "walk.bvh")
    told = figures(
        "cycle", clips / "walk.bvh", "--joints", "lfemur, rfemur,ltibia,rtibia", "--model", "m1",
        "--features", "rotations", "--normalise", "--delays", 2, "--lag", 6,
        "--timing", "whole-laps",
    )  # fmt: skip
    assert told["period_frames"] == pytest.approx(usual["period_frames"], rel=0.02)
    assert told["method"] == "cohomology, whole-laps time"
    assert (usual["model"], told["model"]) == ("harmonic", "m1")


def test_the_typical_trajectory_is_a_loop_as_the_regression_is(clips, tmp_path):
    out = tmp_path / "loop.glb"
    options = ("--model", "typical", "--closed", "--start", "left-contact")
    told = figures("cycle", clips / "walk.bvh", *options, "-o", out)
    assert told["model"] == "typical"
    assert told["phase_0"] == "left foot strike"
    assert told["seam_steps"] < 1.5
    assert told["foot_slide_mm"]["after"] < 3
    assert told["jerk_ratio"] <= 1.0
    assert out.is_file()
    assert "typical trajectory" in run("cycle", clips / "walk.bvh", *options).stdout


def test_a_report_has_pictures(clips, tmp_path):
    found = figures("cycle", clips / "walk.bvh", "--report", tmp_path / "report")
    written = sorted(path.name for path in (tmp_path / "report").iterdir())
    names = ("barcode", "excitation", "fit", "jerk", "persistence", "phase", "seam")
    assert written == [f"{name}.png" for name in names]
    assert sorted(found["pictures"]) == [str(tmp_path / "report" / name) for name in written]


def test_the_text_says_how_sure_it_is(clips):
    result = run("cycle", clips / "walk.bvh")
    assert result.exit_code == 0
    assert "confidence" in result.stdout
    assert "median steps" in result.stdout
    assert "pops        none" in result.stdout


def test_a_range_of_frames(clips):
    found = figures("cycle", clips / "walk.bvh", "--frames", "20:300")
    assert found["end"] - found["start"] == 280


def test_every_motion_of_a_clip(clips, tmp_path):
    found = figures(
        "cycle", clips / "many.npz", "--every", "-o", tmp_path / "part.npz", "--report", tmp_path
    )
    assert len(found["cycles"]) == 3
    assert all((tmp_path / number / "persistence.png").is_file() for number in "123")
    assert found["pictures"] == [str(tmp_path / "excitation.png")]
    for number, part in enumerate(found["cycles"], start=1):
        assert part["output"] == str(tmp_path / f"part_{number}.npz")
        assert len(read_clip(part["output"])) == round(part["period_frames"])
    assert all({"pops", "seam_steps"} <= part.keys() for part in found["cycles"])


def test_a_clip_without_a_period_is_an_error(clips, tmp_path):
    result = run("cycle", clips / "still.bvh", "-o", tmp_path / "loop.bvh")
    assert result.exit_code == 1
    assert "Expected a motion" in result.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("args", "code", "text"),
    [
        (("walk.bvh", "--frames", "a:b"), 2, "100:400"),
        (("walk.bvh", "--frames", "900:950"), 1, "range"),
        (("walk.bvh", "--frames", "20:5000"), 1, "but got 20:5000"),
        (("walk.bvh", "--joints", "lfemur,,rfemur"), 2, "single commas"),
        (("walk.bvh", "--every-class"), 2, "walk.bvh is a file"),
        (("walk.bvh", "--prime", "8"), 1, "odd prime"),
        (("walk.bvh", "--model", "m7"), 2, "m7"),
        (("walk.bvh", "--joints", "lfemur,tail"), 1, "tail"),
        (("walk.bvh", "--epsilon", "1e-5"), 1, "--epsilon"),
        (("walk.bvh", "--epsilon", "-1"), 2, "positive distance with --epsilon"),
        (("walk.bvh", "--rank", "900"), 1, "loop of rank 900"),
        (("walk.bvh", "--delays", "3", "--lag", "5000"), 1, "smaller factor or lag"),
        (("walk.bvh", "--clip", "x"), 2, "library"),
        (("walk.bvh", "--fps", "-3"), 1, "frame rate"),
        (("nothing.bvh",), 1, "there is none"),
        ((".", "--class", "walk"), 1, "librar"),
        ((".", "walk.bvh", "--class", "walk"), 2, "one library"),
        (("walk.bvh", "--every", "--class", "walk"), 2, "together"),
        (("walk.bvh", "-o", "loop.dae"), 2, "one of bvh"),
        (("walk.bvh", "-o", "loop.fbx", "--blender", "none"), 1, "no such program"),
        (("walk.bvh", "-o", "loops"), 2, "a file for one loop"),
        (("walk.bvh", "-o", "loop.bvh", "--as", "aligned"), 2, ".csv with --as"),
        (("walk.bvh", "--length", "9"), 1, "10 frames or more"),
        (("walk.bvh", "--loops", "2", "--rank", "1"), 2, "--loops goes with none"),
        (("walk.bvh", "--animate", "tail"), 1, "tail"),
        (("walk.bvh", "--root-axes", "xw"), 1, "letters xyz"),
        (("walk.bvh", "--no-velocities"), 2, "others have neither"),
    ],
)
def test_wrong_input(clips, monkeypatch, args, code, text):
    monkeypatch.chdir(clips)
    result = run("cycle", *args)
    assert result.exit_code == code, result.output
    assert text in result.stderr


@pytest.fixture(scope="module")
def loops(clips, tmp_path_factory):
    folder = tmp_path_factory.mktemp("loops")
    for kind in ("walk", "run"):
        assert run("cycle", clips / f"{kind}.bvh", "-o", folder / f"{kind}.npz").exit_code == 0
    return folder


def test_loops_are_blended(loops, tmp_path):
    found = figures(
        "blend", loops / "walk.npz", loops / "run.npz", "--weight", 0.3, "-o", tmp_path / "jog.bvh"
    )
    walk, jog, fast = (
        read_clip(path).duration_s
        for path in (loops / "walk.npz", tmp_path / "jog.bvh", loops / "run.npz")
    )
    assert found["weights"] == [0.7, 0.3]
    assert jog == pytest.approx(0.7 * walk + 0.3 * fast, abs=0.01)
    assert found["seam_steps"] < 2
    assert [warning.split(":")[0] for warning in found["warnings"]] == [
        str(loops / "walk.npz"), str(loops / "run.npz"),
    ]  # fmt: skip
    assert all("taken whole as one lap" in warning for warning in found["warnings"])


def test_a_blend_that_jerks_says_so(loops, tmp_path, monkeypatch):
    monkeypatch.setattr(blending, "POP_TIMES", 0.5)
    args = ("blend", loops / "walk.npz", loops / "run.npz", "-o", tmp_path / "x.npz")
    for how in (("--weight", 0.5), ("--transition", 0.5)):
        told = figures(*args, *how)
        joint, times = next(iter(told["peaks_over_parents"].items()))
        assert 0.5 < times < 1.5
        assert f"it jerks: {joint} has" in told["warnings"][-1]
        assert f"over the parents': {joint} {times:.1f} times" in run(*args, *how).stdout


def test_a_pose_is_not_blended(clips, loops, tmp_path):
    out = tmp_path / "out.bvh"
    told = run("blend", clips / "still.bvh", loops / "run.npz", "--weight", 0.5, "-o", out)
    assert told.exit_code == 1
    assert "one pose in all of its 300 frames" in told.stderr
    assert not out.exists()


def test_clips_are_blended_too_and_in_more_ways(clips, loops, tmp_path):
    result = run(
        "blend", loops / "walk.npz", loops / "run.npz", loops / "walk.npz",
        "--weight", 0.2, "--weight", 0.3, "--weight", 0.5, "-o", tmp_path / "mix.npz",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    result = run(
        "blend", clips / "walk.bvh", clips / "run.bvh", "--weight", 0.5, "-o", tmp_path / "b.npz"
    )
    assert result.exit_code == 0, result.output


def test_a_transition(loops, tmp_path):
    found = figures(
        "blend",
        loops / "walk.npz",
        loops / "run.npz",
        "--transition",
        1.0,
        "-o",
        tmp_path / "t.bvh",
    )
    assert found["frames"] == len(read_clip(tmp_path / "t.bvh"))
    slide = found["foot_slide_mm"]
    assert slide["after"] < min(1.5, slide["before"])
    assert found["pops"] == found["peaks_over_parents"] == {}
    assert found["held_share"] == 1.0


def test_a_transition_as_glb_has_a_root_bone(loops, tmp_path):
    out = tmp_path / "t.glb"
    run("blend", loops / "walk.npz", loops / "run.npz", "--transition", 0.4, "-o", out)
    data = out.read_bytes()
    size = int.from_bytes(data[12:16], "little")
    names = [node.get("name") for node in json.loads(data[20 : 20 + size])["nodes"]]
    assert "root_motion" in names


@pytest.mark.parametrize(
    ("args", "code", "text"),
    [
        (("--weight", "0.2", "--weight", "0.3"), 1, "sum to one"),
        (("--weight", "1.5"), 1, "sum to one"),
        ((), 2, "--weight or --transition"),
        (("--weight", "0.5", "--transition", "1"), 2, "--weight or --transition"),
        (("--transition", "-1"), 1, "duration"),
        (("--transition", "1", "--closed"), 2, "a transition is none"),
        (("--weight", "0.5", "--body", "C"), 2, "--body out of A, B"),
        (("--weight", "0.5", "--class", "walk"), 2, "two cycles or more"),
        (("--weight", "0.5", "--class", "walk", "--class", "run"), 2, "one library"),
    ],
)
def test_wrong_blends(loops, tmp_path, args, code, text):
    result = run("blend", loops / "walk.npz", loops / "run.npz", *args, "-o", tmp_path / "out.bvh")
    assert result.exit_code == code, result.output
    assert text in result.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def other_body(tmp_path_factory):
    body = made.in_units(made.along_x(made.make_walk(90, legs=1.1)), 0.01)
    path = tmp_path_factory.mktemp("other") / "other.bvh"
    write_clip(Clip(body.skeleton, body.channels, 30.0, name="other"), path)
    return path


def test_bodies_that_differ_are_blended_on_either(loops, other_body, tmp_path):
    for letter, joint in (("A", "lfemur"), ("b", "left_knee")):
        told = figures(
            "blend", loops / "walk.npz", other_body, "--weight", 0.5, "--body", letter,
            "-o", tmp_path / "mix.bvh", "--closed", "--length", 40,
        )  # fmt: skip
        clip = read_clip(tmp_path / "mix.bvh")
        assert joint in clip.skeleton.names
        assert len(clip) == 41
        assert told["body"] == letter.upper()
        assert told["foot_slide_mm"]["after"] < 3.0
        assert told["pops"] == {}
    told = figures(
        "blend", loops / "walk.npz", other_body, "--transition", 0.5, "-o", tmp_path / "mix.glb"
    )
    assert told["foot_slide_mm"]["after"] < 3.0


def test_a_person_and_a_bird_are_not(loops, tmp_path):
    dog = made.make_dog()
    write_clip(Clip(dog.skeleton, dog.channels, 30.0), tmp_path / "dog.bvh")
    out = tmp_path / "out.bvh"
    result = run("blend", loops / "walk.npz", tmp_path / "dog.bvh", "--weight", 0.5, "-o", out)
    assert result.exit_code == 1
    assert "no whole human body" in result.stderr
    assert not out.exists()


def test_one_cycle_is_no_blend(loops, tmp_path):
    result = run("blend", loops / "walk.npz", "--weight", 1, "-o", tmp_path / "out.bvh")
    assert result.exit_code == 2


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    folder = tmp_path_factory.mktemp("library")
    corpus = folder / "corpus"
    write_clips(corpus, {"short.bvh": ("walk", 9)})
    for seed in range(3):
        clip = synthetic.make_clip("walk", seed=seed, n_cycles=2.6)
        write_clip(clip, corpus / f"w{seed}.bvh")
    rows = [f"{path.name},walk" for path in sorted(corpus.glob("*.bvh"))]
    write_clip(clip.replace(name="rest"), corpus / "rest.bvh")
    rows.append("rest.bvh,other")
    (corpus / "LABELS.csv").write_text("\n".join(["path,label", *rows]) + "\n")
    options = ("--representation", "channels", "--transform", "dct", "--jobs", 1)
    path = folder / "small.mocapdb"
    result = run("build", corpus, "-o", path, "--mean-mm", 2, *options)
    assert result.exit_code == 0, result.output
    return path


def test_a_class_of_a_library_is_kept_in_it(library, tmp_path):
    curves = tmp_path / "walk.csv"
    found = figures(
        "cycle", library, "--class", "walk", "-o", tmp_path / "walk.bvh", "--curves", curves
    )
    assert curves.is_file()
    assert found["curves"] == str(curves)
    assert sorted(found["members"]) == ["w0", "w1", "w2"]
    assert "short" in found["left_out"]
    assert len(read_clip(tmp_path / "walk.bvh")) == round(120 * found["period_s"])
    about = figures("info", library)
    assert about["cycles"] == [
        {"class": "walk", "members": 3, "period_s": pytest.approx(found["period_s"])}
    ]
    (line,) = [line for line in run("info", library).stdout.splitlines() if "cycles" in line]
    assert "walk" in line
    assert run("verify", library).exit_code == 0
    assert not list(library.glob("*.partial"))
    assert not list(library.glob(".*.partial"))


def test_every_class_of_a_library(library, tmp_path):
    told = figures("cycle", library, "--every-class", "-o", tmp_path / "all", "--closed")
    (walk,) = told["classes"]
    assert (walk["class"], sorted(walk["members"])) == ("walk", ["w0", "w1", "w2"])
    assert list(told["without_cycle"]) == ["other"]
    assert len(read_clip(tmp_path / "all" / "walk.bvh")) == walk["lap_frames"] + 1
    assert (tmp_path / "all" / "walk.csv").read_text().startswith("class,phase_percent,joint")


def test_classes_of_a_library_are_blended(library, tmp_path):
    told = figures(
        "blend", library, "--class", "walk", "--class", "walk", "--weight", 0.5,
        "-o", tmp_path / "mix.bvh",
    )  # fmt: skip
    assert [each["class"] for each in told["inputs"]] == ["walk", "walk"]
    assert read_clip(tmp_path / "mix.bvh").duration_s == pytest.approx(told["period_s"], abs=0.01)


def test_a_clip_of_a_library(library):
    assert figures("cycle", library, "--clip", "w1")["laps"] == pytest.approx(2.6, abs=0.05)


@pytest.mark.parametrize(
    ("args", "code", "text"),
    [
        (("--class", "dance"), 1, "expected a class out of other, walk"),
        (("--class", "walk", "--clip", "w0"), 2, "none of"),
        (("--class", "walk", "--every-class"), 2, "one of them"),
        (("--class", "other"), 1, "names clips of any kind"),
        (("--clip", "w0", "--curves", "x.csv"), 2, "--curves with --class"),
        (("--clip", "w9"), 1, "w9"),
        ((), 2, "--class or --clip"),
    ],
)
def test_wrong_questions_to_a_library(library, args, code, text):
    result = run("cycle", library, *args)
    assert result.exit_code == code, result.output
    assert text in result.stderr
