"""What synthetic clips are like, in figures: a chosen number that changes shows here."""

from unittest import mock

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.corpus.synthetic.faults import _place
from mocapdb.corpus.synthetic.style import draw_style
from mocapdb.errors import ClipError
from mocapdb.io import read_clip


def close(value):
    return pytest.approx(value, rel=1e-4)


def mean_sizes(channels):
    """Return the mean of the channels' sizes, and of their steps."""
    return [float(np.abs(channels).mean()), float(np.abs(np.diff(channels, axis=0)).mean())]


@pytest.mark.parametrize(
    ("seed", "height_m"), [(0, 1.721316), (1, 1.741102), (755, 1.45), (1950, 2.0)]
)
def test_statures(seed, height_m):
    skeleton = synthetic.subject(seed)
    assert skeleton.height * skeleton.metres_per_unit == close(height_m)


@pytest.mark.parametrize(("seed", "leg"), [(13, 0.92), (125, 0.92), (231, 1.08), (0, 0.996036)])
def test_proportions_stay_within_limits(seed, leg):
    with mock.patch("mocapdb.corpus.synthetic.body.make_skeleton") as made:
        synthetic.subject(seed)
    assert made.call_args.kwargs["leg"] == close(leg)


@pytest.mark.parametrize(
    ("seed", "arm_swing", "track", "lean_deg"),
    [
        (0, 0.980184, 1.015735, -0.803504),
        (13, 0.7, 1.010446, 1.977375),
        (63, 1.3, 0.986905, 1.849394),
    ],
)
def test_styles(seed, arm_swing, track, lean_deg):
    style = draw_style(np.random.default_rng(seed))
    assert [style.arm_swing, style.track, style.lean_deg] == close([arm_swing, track, lean_deg])


def test_postures_vary_about_usual_ones():
    styles = [draw_style(np.random.default_rng(seed)) for seed in range(400)]
    postures = np.array([(s.lean_deg, s.elbow_deg, s.abduction_deg, s.toe_out_deg) for s in styles])
    assert postures.mean(axis=0) == pytest.approx([0, 0, 9, 6], abs=0.5)
    assert postures.std(axis=0) == pytest.approx([1.5, 4, 2, 1.5], rel=0.1)
    hands = np.array([list(style.posture.values()) for style in styles])
    assert hands.std() == pytest.approx(2.0, rel=0.05)


@pytest.mark.parametrize(
    ("kind", "n_contacts", "sizes"),
    [
        ("walk", 146, [9.5813232, 0.3297831]),
        ("run", 86, [14.3022241, 0.5858181]),
        ("hop", 132, [11.0902258, 0.5496425]),
        ("box", 240, [13.9401510, 0.2317161]),
        ("wave", 240, [7.7949557, 0.0634411]),
        ("squat", 240, [12.3259012, 0.1824607]),
    ],
)
def test_clips(kind, n_contacts, sizes):
    clip, truth = synthetic.make(kind, seed=7, fps=60.0, duration_s=2.0)
    assert truth.contacts.sum() == n_contacts
    assert mean_sizes(clip.channels) == close(sizes)


def test_a_sequence():
    clip, truth = synthetic.make("sequence", seed=7, fps=60.0)
    assert [(s.start, s.end, s.label) for s in truth.segments] == [
        (0, 185, "box"), (185, 340, "squat"), (340, 499, "wave"),
    ]  # fmt: skip
    assert truth.contacts.sum() == 892
    assert mean_sizes(clip.channels) == close([12.0286112, 0.1956663])


def test_a_clip_has_five_seconds_unless_told_otherwise():
    assert synthetic.make_clip("wave", seed=1).duration_s == 5.0


def test_a_slow_hop_does_not_fly_longer():
    clip, truth = synthetic.make("hop", seed=7, fps=60.0, duration_s=2.0, speed=0.5)
    assert truth.contacts.sum() == 172
    assert float(np.abs(clip.channels).mean()) == close(12.5110478)


def test_a_phase_that_wanders():
    _, truth = synthetic.make("walk", seed=7, fps=60.0, duration_s=8.0, phase_noise=0.3)
    assert truth.phase[[60, 240, 479]].tolist() == close([5.9015618, 24.0433593, 46.8711686])


def test_faults():
    clip = synthetic.make_clip("walk", seed=7, fps=60.0, duration_s=6.0)
    faults = synthetic.inject_faults(clip, seed=3).faults
    assert [fault[:4] for fault in faults] == [
        (10, 55, 72, "noise"), (8, 84, 92, "offset"), (19, 117, 125, "flip"),
        (23, 136, 147, "drift"), (11, 166, 187, "freeze"),
    ]  # fmt: skip
    sizes = [48.056, 51.0574, 180.0, 44.5943, 5.8167]
    assert [fault.size_deg for fault in faults] == close(sizes)


@pytest.mark.parametrize(("moved_deg", "n_tried"), [(4.0, 200), (4.8, 200), (5.2, 1), (6.0, 1)])
def test_a_freeze_is_put_where_five_degrees_are_missed(moved_deg, n_tried):
    clip = synthetic.make_clip("wave", seed=1, duration_s=1.0)
    channels = np.repeat(clip.channels[:1], len(clip), axis=0)
    joint, length = 10, 20
    column = clip.skeleton.rotation_columns(joint)[0]
    channels[:, column] += np.arange(len(clip)) * moved_deg / length
    still = clip.replace(channels=channels)
    rng = mock.Mock(wraps=np.random.default_rng(0))
    mask = np.zeros((len(clip), clip.skeleton.n_joints), dtype=bool)
    _place(rng, still, mask, np.array([joint]), "freeze", length)
    assert rng.choice.call_count == n_tried


def test_where_there_is_no_room_two_hundred_places_are_tried():
    clip = synthetic.make_clip("wave", seed=1, duration_s=1.0)
    rng = mock.Mock(wraps=np.random.default_rng(0))
    mask = np.ones((len(clip), clip.skeleton.n_joints), dtype=bool)
    with pytest.raises(ClipError, match="Expected room"):
        _place(rng, clip, mask, np.array([3]), "offset", 20)
    assert rng.choice.call_count == 200


def test_a_written_corpus(tmp_path):
    paths = synthetic.write_corpus(tmp_path, subjects=1, seed=2, bvh_clips=0)
    figures = []
    for path in (paths[0], paths[1], paths[-1]):
        clip = read_clip(path)
        assert clip.fps == 120.0
        tremble = float(np.abs(np.diff(clip.channels[:, 6:], 2, axis=0)).mean())
        way = float(np.linalg.norm(clip.channels[-1, [0, 2]] - clip.channels[0, [0, 2]]))
        figures.append([len(clip), tremble, clip.channels[0, 4], way])
    assert figures == [
        close([467, 0.3046515, -55.761901, 93.685291]),
        close([622, 0.3153742, -63.618296, 216.815066]),
        close([1362, 0.3121805, -25.405233, 85.965771]),
    ]
