"""Figures of the method on synthetic clips with faults: what a tuned number changes shows here.

The limits that these clips do not reach have tests of their own beside this file.
"""

from collections import defaultdict

import numpy as np
import pytest

from mocapdb.cleaning import detect_faults, fill_joints, repair_spans
from mocapdb.cleaning.evidence.fault_confidence import FEATURES, MODELS, Witnesses, model_of
from mocapdb.cleaning.evidence.joint_limits import RotationLimits
from mocapdb.cleaning.local_rotations import local_rotations, motion_texture
from mocapdb.cleaning.map.detector import find_clip_consensus, gather
from mocapdb.cleaning.neighbours.nearest_words import Vocabulary, find_neighbours
from mocapdb.cleaning.neighbours.similarity import two_stage_consensus
from mocapdb.corpus import synthetic


def noisy(kind, seed, **options):
    return synthetic.make_clip(kind, seed=seed, sensor_noise_deg=0.02, phase_noise=0.2, **options)


def inject(clip, seed, **options):
    return synthetic.inject_faults(clip, seed=seed, **options).clip


@pytest.fixture(scope="module")
def clips():
    """Clips with faults: sharp, soft, trembling, at a low rate, cut off by an end."""
    run, walk = noisy("run", 4, duration_s=6), noisy("walk", 5, duration_s=10)
    return {
        "sharp": inject(run, 3, n=7, size_deg=(10.0, 60.0)),
        "soft": inject(
            walk, 4, n=8, size_deg=(20.0, 70.0), length_s=(0.3, 0.9), ease_s=(0.05, 0.3)
        ),
        "trembling": inject(run, 6, n=5, kinds=["freeze", "noise"], tremble_deg=0.3, length_s=0.4),
        "slow": inject(noisy("box", 6, fps=60.0), 5, n=4, size_deg=(20.0, 90.0)),
        "cut": inject(run, 7, n=3, kinds=["offset"], size_deg=50, length_s=0.8)[:230],
    }


@pytest.fixture(scope="module")
def maps(clips):
    return {name: detect_faults(clip) for name, clip in clips.items()}


@pytest.fixture(scope="module")
def walk():
    return noisy("walk", 21, duration_s=8, tempo_drift=0.2)


@pytest.fixture(scope="module")
def context():
    kinds = ("walk", "run", "walk", "hop", "walk")
    others = [noisy(kind, 30 + i, duration_s=8) for i, kind in enumerate(kinds)]
    return Vocabulary.of(motion_texture(other) for other in others)


# -- detection -----------------------------------------------------------------------------------

SPANS = {
    "sharp": [
        ("ltibia", "flip", 59, 89, 1.0),
        ("rtoes", "noise", 108, 147, 0.99936),
        ("rtibia", "offset", 167, 183, 0.99997),
        ("lradius", "flip", 234, 251, 1.0),
        ("rhand", "drift", 393, 446, 0.99995),
        ("lhumerus", "freeze", 632, 680, 0.9947),
        ("rfemur", "offset", 662, 704, 0.99997),
    ],
    "soft": [
        ("rthumb", "noise", 455, 552, 1.0),
        ("rwrist", "offset", 562, 664, 0.99648),
        ("rfoot", "noise", 603, 696, 1.0),
        ("lfoot", "offset", 713, 776, 0.99998),
        ("ltoes", "drift", 790, 826, 0.99911),
    ],
    "trembling": [
        ("upperneck", "noise", 60, 112, 0.99998),
        ("rhand", "noise", 110, 160, 0.99981),
        ("rtibia", "freeze", 425, 474, 0.9949),
        ("rhumerus", "freeze", 526, 577, 0.99997),
        ("rfoot", "freeze", 613, 669, 0.9589),
    ],
    "slow": [
        ("lowerback", "flip", 1, 8, 1.0),
        ("lfemur", "offset", 223, 248, 0.99999),
        ("rtoes", "noise", 276, 294, 0.99998),
    ],
    "cut": [
        ("rfoot", "offset", 178, 230, 0.9989),
    ],
}  # fmt: skip
SCORES = {
    "sharp": 523.0453,
    "soft": 688.6757,
    "trembling": 458.0921,
    "slow": 118.6172,
    "cut": 96.9899,
}


@pytest.mark.parametrize("name", SPANS)
def test_spans_and_scores(maps, name):
    found = maps[name]
    names = found.skeleton.names
    spans = [(names[s.joint], s.kind, s.start, s.end, s.confidence) for s in found.spans]
    assert [span[:4] for span in spans] == [span[:4] for span in SPANS[name]]
    sure = [span[4] for span in SPANS[name]]
    assert [span[4] for span in spans] == pytest.approx(sure, abs=1e-4)
    assert found.scores.sum() == pytest.approx(SCORES[name], rel=1e-4)
    assert found.threshold == 0.8


LOG_ODDS = {
    "offset": (25, 0.73924),
    "noise": (6, 13.03632),
    "freeze": (3, 1.89184),
    "drift": (70, -3.1681),
    "cut offset": (45, -7.02473),
    "held": (5, 1.19668),
    "soft offset": (36, 1.89746),
    "soft noise": (15, 11.96457),
    "soft drift": (60, -5.17241),
    "similarity": (46, 3.67354),
    "excursion": (190, -6.15627),
    "jitter": (15, 1.30245),
    "exchange": (4, -1.49577),
}


def test_every_hypothesis_is_weighed(clips):
    """How many hypotheses each regression judges in all clips, and their mean log-odds."""
    odds = defaultdict(list)
    for clip in clips.values():
        native, texture = local_rotations(clip), motion_texture(clip)
        consensus, limits = find_clip_consensus(texture), RotationLimits(texture)
        witnesses = Witnesses(native, texture, consensus, limits)
        for hypothesis in gather(clip, native, texture, consensus):
            name = model_of(hypothesis)
            evidence = witnesses.features(hypothesis)
            odds[name].append(MODELS[name].constant + MODELS[name].weights @ evidence)
    assert {name: len(several) for name, several in odds.items()} == {
        name: count for name, (count, _) in LOG_ODDS.items()
    }
    for name, (_, mean) in LOG_ODDS.items():
        assert np.mean(odds[name]) == pytest.approx(mean, abs=2e-4), name


def test_regressions_have_a_weight_for_each_evidence():
    for name, model in MODELS.items():
        assert model.weights.shape == (len(FEATURES[name]),)
        assert np.isfinite(model.weights).all()


def test_the_papers_map_as_printed(walk):
    found = detect_faults(walk, literal=True)
    assert found.threshold == 0.5
    assert len(found.spans) == 1170
    assert found.scores.sum() == pytest.approx(13886.77, rel=1e-4)


# -- similar motion ------------------------------------------------------------------------------


def test_neighbours_in_the_clip(walk):
    texture = motion_texture(walk)
    found = find_neighbours(texture, [texture])
    assert found.words.shape == (37, 5, 15, 29, 4)
    assert found.distances.sum() == pytest.approx(0.077104, rel=1e-3)


@pytest.mark.parametrize(("n_candidates", "n", "total"), [
    (1, 169, 1.727220), (2, 177, 1.787066), (4, 183, 1.831843),
])  # fmt: skip
def test_neighbours_among_candidates(walk, context, n_candidates, n, total):
    found = find_neighbours(motion_texture(walk), context, n_candidates=n_candidates)
    known = np.isfinite(found.distances)
    assert known.sum() == n
    assert found.distances[known].sum() == pytest.approx(total, rel=1e-3)


def test_the_papers_two_stages(clips, context):
    staged = two_stage_consensus(motion_texture(clips["soft"]), context)
    assert staged.residual_deg.sum() == pytest.approx(10514.94, rel=1e-4)
    assert staged.spread_deg.sum() == pytest.approx(1258.168, rel=1e-4)


# -- repair --------------------------------------------------------------------------------------

REPAIRS = {
    "sharp": (
        ["undone", "neighbours", "undone", "undone", "line", "neighbours", "undone"],
        [0.32552, 0.66127, 0.30117, 0.05611, 0.03551, 0.96371, 0.30726],
        16084.8209,
    ),
    "soft": (
        ["line", "neighbours, moved", "neighbours, moved", "neighbours", "neighbours, moved"],
        [0.04559, 0.02097, 2.43707, 0.50008, 2.05852],
        25038.0087,
    ),
    "trembling": (
        ["neighbours", "line", "neighbours, moved", "neighbours, moved", "neighbours"],
        [0.12941, 0.03962, 3.27216, 0.99494, 1.47059],
        5721.8986,
    ),
    "slow": (
        ["bridged", "undone", "line"],
        [0.21143, 0.11872, 0.02391],
        4456.2473,
    ),
    "cut": (
        ["undone"],
        [0.63533],
        2747.4429,
    ),
}
BRIDGED = {
    "sharp": (
        ["undone", "line", "undone", "undone", "line", "bridged", "undone"],
        [0.32552, 6.56675, 0.30117, 0.05611, 0.03551, 7.22457, 0.30726],
        16093.2817,
    ),
    "trembling": (
        ["bridged", "line", "left", "bridged", "left"],
        [1.06145, 0.03962, 17.69028, 7.67843, 10.18837],
        3679.2431,
    ),
}


def check_repairs(clip, digression_map, methods, expected_deg, total_deg):
    """Methods, the errors that are expected, and how far all angles change together."""
    repaired, repairs = repair_spans(clip, digression_map)
    assert [repair.method for repair in repairs] == methods
    found = [None if np.isnan(r.expected_deg) else r.expected_deg for r in repairs]
    assert found == [e if e is None else pytest.approx(e, abs=2e-4) for e in expected_deg]
    changes = np.abs(repaired.channels - clip.channels)
    assert changes.sum() == pytest.approx(total_deg, rel=1e-4)


@pytest.mark.parametrize("name", REPAIRS)
def test_repairs(clips, maps, name):
    check_repairs(clips[name], maps[name], *REPAIRS[name])


@pytest.mark.parametrize("name", BRIDGED)
def test_repairs_without_similar_motion(clips, name):
    check_repairs(clips[name], detect_faults(clips[name], similarity=False), *BRIDGED[name])


def test_joints_that_were_not_captured(walk):
    known = ("upperneck", "lhumerus", "rhumerus", "lfemur", "rfemur", "ltibia", "rtibia")
    filled = fill_joints(walk, known, [noisy("walk", 33, duration_s=6)])
    assert np.abs(filled.channels - walk.channels).sum() == pytest.approx(61797.675, rel=1e-4)
    bends = np.abs(np.diff(filled.channels, n=2, axis=0)).sum()
    assert bends == pytest.approx(1719.719, rel=1e-3)
