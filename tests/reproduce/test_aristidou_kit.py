"""The kit of faults: what is counted, what the rivals do, and what the command prints."""

import json
from collections import Counter

import numpy as np
import pytest
from click.testing import CliRunner

from mocapdb.cleaning import Span
from mocapdb.cleaning.evaluation import Trial, clean_joints
from mocapdb.cleaning.kit_scores import (
    KitScores,
    joint_motion,
    kit_trials,
    line_between_edges,
)
from mocapdb.cleaning.local_rotations import motion_texture
from mocapdb.cleaning.map.digression_map import MovementDigressionMap
from mocapdb.cli import cli
from mocapdb.corpus import synthetic
from mocapdb.corpus.synthetic import RECIPES, inject_recipe
from mocapdb.errors import CorpusError
from mocapdb.io import write_clip
from mocapdb.motion.quaternions import angles_deg
from mocapdb.reproduce import aristidou_kit
from mocapdb.reproduce.aristidou_rivals import RIVALS, TOLD, repaired_by_rivals

BY_NAME = {recipe.name: recipe for recipe in RECIPES}


@pytest.fixture(scope="module")
def walk():
    return synthetic.make_clip("walk", seed=1, duration_s=4, sensor_noise_deg=0.02)


def trial_of(walk, recipe, seed=2):
    joints = clean_joints(walk)
    injection = inject_recipe(walk, BY_NAME[recipe], seed=seed, joints=joints.tolist())
    nowhere = np.zeros_like(injection.mask)
    return Trial(walk, injection.clip, joints, injection.mask, injection.faults, nowhere)


def map_of(clip, spans):
    scores = np.zeros((len(clip), clip.skeleton.n_joints))
    return MovementDigressionMap(
        clip.skeleton, clip.fps, scores, tuple(spans), 0.8, None, motion_texture(clip)
    )


def test_faults_are_put_into_joints_that_move(walk):
    channels = walk.channels.copy()
    skeleton = walk.skeleton
    swing = np.sin(np.linspace(0.0, 6.0, len(walk)))
    for size, name in ((0.0, "head"), (2.5, "ltibia"), (3.5, "rtibia")):
        column = skeleton.rotation_columns(skeleton.joint(name))[0]
        channels[:, skeleton.rotation_columns(skeleton.joint(name))] = 10.0
        channels[:, column] += size * swing / np.ptp(swing) * 2 if size else 0.0
    for joint in skeleton.rotating_joints:
        if skeleton.names[joint] not in ("ltibia", "rtibia", "root"):
            channels[:, skeleton.rotation_columns(joint)] = 10.0
    clip = walk.replace(channels=channels)
    recipes = [BY_NAME["straight line"], BY_NAME["offset 45 to 90"]]
    faults = [f for seed in (1, 2) for _, t in kit_trials([clip], seed=seed, recipes=recipes)
              for f in t.faults]  # fmt: skip
    assert {skeleton.names[fault.joint] for fault in faults} == {"ltibia", "rtibia"} - {"ltibia"}


def test_found_right_and_sure_are_counted(walk):
    trial = trial_of(walk, "offset 45 to 90")
    (fault,) = trial.faults
    other = next(j for j in trial.joints.tolist() if j != fault.joint)
    spans = [
        Span(fault.start, fault.end, fault.joint, 0.95, "offset"),
        Span(fault.start, fault.end, other, 0.85, "offset"),
    ]
    scores, again = KitScores(), KitScores()
    scores.add_trial("offset", trial, map_of(trial.clip, spans), walk)
    again.add_trial("offset", trial, map_of(trial.clip, []), walk)
    scores.add(again)
    tally = scores.tallies["offset"]
    assert (tally.found, tally.missed, tally.flagged, tally.right) == (1, 1, 2, 1)
    assert (tally.recall, tally.precision, scores.precision) == (0.5, 0.5, 0.5)
    assert list(scores.calibration()) == [(0.8, 0.9, 1, 0.0), (0.9, 1.0, 1, 1.0)]
    assert tally.mean_error("before") == pytest.approx(fault.size_deg, rel=0.01)
    assert tally.mean_error("repaired") == pytest.approx(0.0, abs=1e-6)
    assert tally.worse == 0.0


def test_a_repair_that_made_it_worse_is_counted(walk):
    trial = trial_of(walk, "offset 20")
    (fault,) = trial.faults
    span = Span(fault.start, fault.end, fault.joint, 0.95, "offset")
    twice = trial.clip.channels + (trial.clip.channels - walk.channels)
    scores = KitScores()
    scores.add_trial("x", trial, map_of(trial.clip, [span]), trial.clip.replace(channels=twice))
    assert scores.tallies["x"].worse == 1.0


def test_alarms_of_hands_and_toes_are_none_of_the_body(walk):
    knee, toe = walk.skeleton.joint("ltibia"), walk.skeleton.joint("ltoes")
    scores = KitScores()
    scores.add_untouched(walk, map_of(walk, [Span(5, 9, j, 0.9, "offset") for j in (knee, toe)]))
    assert (scores.body_alarms, scores.all_alarms) == (1, 2)
    assert scores.untouched_min == pytest.approx(4 / 60)


def test_clips_that_cannot_hold_a_recipe_are_told(walk):
    passed_over: Counter[str] = Counter()
    recipes = [BY_NAME["yaw drift"]]
    short = walk[:120]
    trials = list(kit_trials([short, walk], seed=1, recipes=recipes, passed_over=passed_over))
    assert passed_over == {"yaw drift": 1}
    assert [name for name, _ in trials] == ["yaw drift"]


def test_a_jump_of_the_root_is_measured_in_millimetres(walk):
    trial = trial_of(walk, "root jump", seed=3)
    right, wrong = joint_motion(walk), joint_motion(trial.clip)
    (fault,) = trial.faults
    assert right.error(wrong, fault) == pytest.approx(1000 * fault.size_deg, rel=0.02)
    line = line_between_edges(wrong, trial.faults)
    assert right.error(line, fault) < 50.0
    assert right.error(repaired_by_rivals(wrong, trial.faults, walk.fps)["spline"], fault) < 50.0


@pytest.mark.parametrize("name", RIVALS)
def test_rivals_come_nearer_to_the_truth_and_the_told_touch_nothing_else(walk, name):
    trial = trial_of(walk, "spike, 2 frames")
    right, wrong = joint_motion(walk), joint_motion(trial.clip)
    (fault,) = trial.faults
    repaired = repaired_by_rivals(wrong, trial.faults, walk.fps)[name]
    assert right.error(repaired, fault) < right.error(wrong, fault)
    outside = ~trial.mask[:, list(right.joints)]
    changed = angles_deg(wrong.quat_xyzw, repaired.quat_xyzw)[outside].max()
    assert (changed < 1e-5) == (name in TOLD)


def test_a_low_rank_completion_knows_from_the_other_joints(walk):
    """A walk repeats: what a joint does follows from the others, where a line does not know."""
    trial = trial_of(walk, "limb frozen", seed=5)
    right, wrong = joint_motion(walk), joint_motion(trial.clip)
    repaired = repaired_by_rivals(wrong, trial.faults, walk.fps)
    low, line = (
        np.mean([right.error(repaired[name], fault) for fault in trial.faults])
        for name in ("low rank", "slerp")
    )
    assert low < 0.7 * line


@pytest.fixture(scope="module")
def small_corpus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kit")
    for name in ("07_01", "35_01"):
        clip = synthetic.make_clip("walk", seed=1, duration_s=3, sensor_noise_deg=0.02)
        write_clip(clip, folder / f"{name}.amc")
    return folder


def test_the_kit_leaves_out_subjects_of_the_calibration(small_corpus):
    few = [BY_NAME[name] for name in ("offset 45 to 90", "yaw drift", "root jump")]
    seen = []
    kit = aristidou_kit.measure(
        small_corpus, clips=1, recipes=few, progress=lambda *step: seen.append(step)
    )
    assert kit.clips == ("07_01",)
    assert seen[-1] == (5, 5, "done")
    told = kit.as_json()
    rows = {row["recipe"]: row for row in told["recipes"]}
    assert rows["offset 45 to 90"]["faults"] == 1
    assert rows["noise"]["recall"] is None
    assert rows["root jump"]["unit"] == "mm"
    assert "low rank" not in rows["root jump"]["errors"]
    assert [row["fps"] for row in told["false_alarms_a_minute"]] == [120.0, 30.0]


def test_a_corpus_of_calibration_subjects_alone(tmp_path, walk):
    write_clip(walk, tmp_path / "35_01.amc")
    with pytest.raises(CorpusError, match="of subjects other than 01"):
        aristidou_kit.measure(tmp_path)


def test_the_command_prints_the_kit(small_corpus, monkeypatch):
    monkeypatch.setattr(aristidou_kit, "measure", _measured(aristidou_kit.measure))
    arguments = ["reproduce", "aristidou", "--corpus", str(small_corpus), "--table", "kit"]
    arguments += ["--clips", "1", "--jobs", "1"]
    answer = CliRunner().invoke(cli, arguments)
    assert answer.exit_code == 0, answer.output
    for column in ("low rank", "Savitzky-Golay", "recall without", "no room", "said"):
        assert column in answer.stdout
    report = json.loads(CliRunner().invoke(cli, [*arguments, "--json"]).stdout)
    assert report["rows"] == []
    assert report["kit"]["recipes"][0]["errors"].keys() >= {"before", "repaired", *RIVALS}


def _measured(measure):
    few = [BY_NAME["spike, 1 frame"]]
    return lambda corpus, **options: measure(corpus, **(options | {"recipes": few}))
