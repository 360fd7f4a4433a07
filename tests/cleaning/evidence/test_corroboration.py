"""What other hypotheses say, and the spread of a joint and the opposite one."""

import numpy as np
import pytest

from mocapdb.cleaning.evidence.corroboration import (
    SECOND_FEATURES,
    SECOND_MODELS,
    corroborated,
    corroboration,
)
from mocapdb.cleaning.evidence.hypotheses import Hypothesis
from mocapdb.cleaning.evidence.pooled_spread import PooledSpread
from mocapdb.cleaning.local_rotations import motion_texture
from mocapdb.cleaning.tuning import FLOOR, LEAST_OWN
from mocapdb.corpus import synthetic

N_FRAMES, FPS, ROW = 360, 120.0, 7


@pytest.fixture(scope="module")
def walk():
    return synthetic.make_clip("walk", seed=4, duration_s=3.0)


@pytest.fixture(scope="module")
def spread(walk):
    return PooledSpread(motion_texture(walk))


def said(spread, odds, *hypotheses):
    """The evidence on each hypothesis about one joint, by place and name."""
    log_odds = np.array(odds, dtype=float)
    evidence = corroboration(hypotheses, log_odds, spread, N_FRAMES, FPS)
    return {
        place: dict(zip(SECOND_FEATURES[name_of(hypotheses[place])], values, strict=True))
        for place, values in evidence
    }


def name_of(h):
    if h.cue in ("similarity", "excursion", "jitter"):
        return h.cue
    return "cut offset" if h.cue == "cut off" else ("soft " if h.halvings else "") + h.kind


def hypothesis(start, end, kind="offset", cue="edges", row=ROW, halvings=0):
    return Hypothesis(start, end, row, kind, (), cue, halvings)


def test_hypotheses_about_the_same_stretch_speak_for_each_other(spread):
    found = said(
        spread,
        [1.0, 2.0, 3.0, 3.5, -9.0],
        hypothesis(100, 140, cue="excursion"),
        hypothesis(104, 138, cue="similarity"),
        hypothesis(102, 142, cue="similarity", row=3),  # another joint
        hypothesis(138, 180, cue="jitter"),  # hardly the same stretch
        hypothesis(100, 140, cue="jitter"),  # so unlikely that it counts as none
    )
    assert found[0]["own"] == 1.0
    assert found[0]["similarity"] == 2.0
    assert found[0]["jitter"] == FLOOR
    assert found[1]["excursion"] == 1.0
    assert found[1]["edges"] == FLOOR
    assert "excursion" not in found[0]
    assert 4 not in found  # nor is it weighed again


def test_one_edge_has_explanations_on_both_sides(spread):
    drift = hypothesis(200, 330, "drift")
    cut = hypothesis(330, N_FRAMES, cue="cut off")
    elsewhere = hypothesis(100, 140, "drift")
    found = said(spread, [2.0, 1.0, 3.0], drift, cut, elsewhere)
    assert found[0]["rival"] == 1.0
    assert found[1]["rival"] == 2.0
    assert found[2]["rival"] == FLOOR
    assert found[0]["near_end"] == found[1]["near_end"] == pytest.approx(np.log(30 / 120 + 0.1))
    # what the start cuts off lies on the side of the drift
    start = hypothesis(0, 40, cue="cut off")
    found = said(spread, [2.0, 1.0], hypothesis(10, 40, "drift"), start)
    assert (found[0]["shared"], found[0]["rival"]) == (1.0, FLOOR)


def test_what_is_not_weighed_again_keeps_its_odds(spread):
    hypotheses = [
        hypothesis(50, 90, "exchange", "exchange"),
        hypothesis(50, 90, cue="excursion"),
        hypothesis(200, 240),
    ]
    odds = np.array([0.5, LEAST_OWN - 1.0, 1.0])
    again = corroborated(hypotheses, odds, spread, N_FRAMES, FPS)
    assert again[:2].tolist() == odds[:2].tolist()
    assert again[2] != odds[2]


def test_the_order_of_hypotheses_does_not_matter(spread):
    rng = np.random.default_rng(2)
    starts = rng.integers(0, N_FRAMES - 80, 40)
    hypotheses = [
        hypothesis(int(s), int(s) + int(rng.integers(1, 80)), cue=str(cue))
        for s, cue in zip(starts, rng.choice(["edges", "similarity", "excursion"], 40), strict=True)
    ]
    odds = rng.normal(0, 2, 40)
    again = corroborated(hypotheses, odds, spread, N_FRAMES, FPS)
    turned = corroborated(hypotheses[::-1], odds[::-1], spread, N_FRAMES, FPS)[::-1]
    assert again.tolist() == turned.tolist()


def test_second_regressions_have_a_weight_for_each_evidence():
    for name, model in SECOND_MODELS.items():
        assert model.weights.shape == (len(SECOND_FEATURES[name]),)
        assert np.isfinite(model.weights).all()
        weights = dict(zip(SECOND_FEATURES[name], model.weights, strict=True))
        assert weights["own"] > 0


def test_a_fault_is_odd_among_what_the_opposite_joint_does(walk):
    """Half of the clip is wrong: in the joint's own spread that is not odd."""
    joint = walk.skeleton.joint("lfemur")
    columns = walk.skeleton.rotation_columns(joint)
    wrong = walk.channels.copy()
    wrong[180:, columns[2]] += 40.0
    texture = motion_texture(walk.replace(channels=wrong))
    row = texture.joints.tolist().index(joint)
    middle = len(texture) // 2
    spread, clean = PooledSpread(texture), PooledSpread(motion_texture(walk))
    assert spread.pose(row, middle, len(texture)) > clean.pose(row, middle, len(texture)) + 0.5


def test_an_excursion_is_odd_where_the_joint_never_goes_so(walk):
    joint = walk.skeleton.joint("lhumerus")
    columns = walk.skeleton.rotation_columns(joint)
    wrong = walk.channels.copy()
    bump = 50.0 * np.sin(np.linspace(0, np.pi, 60))
    wrong[150:210, columns[0]] += bump
    texture = motion_texture(walk.replace(channels=wrong))
    row = texture.joints.tolist().index(joint)
    spread, clean = PooledSpread(texture), PooledSpread(motion_texture(walk))
    assert spread.move(row, 30, 42) > clean.move(row, 30, 42) + 0.3


def test_a_clip_of_a_few_frames_has_no_spread():
    texture = motion_texture(synthetic.make_clip("walk", seed=1, duration_s=1.0)[:4])
    spread = PooledSpread(texture)
    assert spread.pose(0, 0, len(texture)) == spread.move(0, 0, len(texture)) == 0.0
