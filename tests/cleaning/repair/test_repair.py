"""Repairs come near the truth, beat slerp, and touch nothing but what was flagged."""

from dataclasses import replace

import numpy as np
import pytest

from mocapdb.cleaning import Span, clean_clip, detect_faults, repair_spans
from mocapdb.cleaning.evidence.fault_shapes import KINDS
from mocapdb.cleaning.local_rotations import local_rotations
from mocapdb.cleaning.repair.repair import as_repaired, write_rotations
from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError
from mocapdb.motion.quaternions import angles_deg, from_rotation_vectors_deg, multiply, slerp


@pytest.fixture(scope="module")
def walk():
    return synthetic.make_clip("walk", seed=11, duration_s=6, sensor_noise_deg=0.02)


def error_deg(truth, other, fault):
    a, b = local_rotations(truth), local_rotations(other)
    row = a.joints.tolist().index(fault.joint)
    angles = angles_deg(a.quat_xyzw[:, row], b.quat_xyzw[:, row])
    return angles[fault.start : fault.end].mean()


def with_slerp(clip, spans):
    """The texture of a clip with spherical lines across the spans."""
    texture = local_rotations(clip)
    for span in spans:
        row = texture.joints.tolist().index(span.joint)
        quats = texture.quat_xyzw[:, row]
        first, last = max(0, span.start - 1), min(len(clip) - 1, span.end)
        weight = np.arange(1, last - first) / (last - first)
        quats[first + 1 : last] = slerp(quats[first][None], quats[last][None], weight)
    return texture


@pytest.mark.parametrize("kind", KINDS)
def test_repairs_come_near_the_truth(walk, kind):
    errors, slerped = [], []
    truth = local_rotations(walk)
    for seed in range(4):
        faulty, _, (fault,) = synthetic.inject_faults(
            walk, seed=seed, kinds=[kind], n=1, size_deg=(30, 80), length_s=(0.3, 0.8)
        )
        cleaned = clean_clip(faulty)
        errors.append(error_deg(walk, cleaned.clip, fault))
        row = truth.joints.tolist().index(fault.joint)
        line = with_slerp(faulty, cleaned.digression_map.spans).quat_xyzw[:, row]
        apart = angles_deg(truth.quat_xyzw[:, row], line)[fault.start : fault.end]
        slerped.append(apart.mean())
    assert np.mean(errors) < 3.0
    assert np.mean(errors) <= np.mean(slerped) + 0.1


def test_what_is_not_flagged_stays_bit_for_bit(walk):
    faulty = synthetic.inject_faults(walk, seed=5, n=8).clip
    cleaned = clean_clip(faulty)
    assert cleaned.repairs
    changed = cleaned.clip.channels != faulty.channels
    allowed = np.zeros_like(changed)
    for span in cleaned.digression_map.spans:
        first, last = walk.skeleton.channel_starts[[span.joint, span.joint + 1]]
        allowed[span.start : span.end, first:last] = True
    assert changed.any()
    assert not (changed & ~allowed).any()
    assert "repaired" in cleaned.clip.provenance[-1]
    assert cleaned.clip.fps == faulty.fps


def test_a_clean_clip_comes_back_as_it_is(walk):
    assert clean_clip(walk).clip is walk


def test_channels_stay_near_those_of_the_frame_before(walk):
    faulty, _, (fault,) = synthetic.inject_faults(walk, seed=3, kinds=["offset"], n=1, size_deg=60)
    cleaned = clean_clip(faulty).clip
    first, last = walk.skeleton.channel_starts[[fault.joint, fault.joint + 1]]
    steps = np.abs(np.diff(cleaned.channels[:, first:last], axis=0))
    assert steps.max() < 20.0


def test_an_offset_keeps_the_motion_inside_it():
    """A wave within an offset is the body's own, which no filling of the gap could know."""
    clip = synthetic.make_clip("wave", seed=2, duration_s=5)
    joint = clip.skeleton.joint("rradius")
    column = int(clip.skeleton.channel_starts[joint])
    channels = clip.channels.copy()
    channels[200:320, column] += 35.0
    cleaned = clean_clip(clip.replace(channels=channels))
    assert [repair.method for repair in cleaned.repairs] == ["undone"]
    np.testing.assert_allclose(cleaned.clip.channels[:, column], clip.channels[:, column], atol=1.0)


@pytest.fixture(scope="module")
def wave():
    """A forearm that waves, as no filling of a gap could know."""
    return synthetic.make_clip("wave", seed=2, duration_s=4)


@pytest.mark.parametrize(("start", "end"), [(0, 60), (420, 480)])
def test_an_offset_that_an_end_cuts_off_is_turned_back_by_its_one_edge(wave, start, end):
    joint = wave.skeleton.joint("rradius")
    column = int(wave.skeleton.channel_starts[joint])
    channels = wave.channels.copy()
    channels[start:end, column] += 70.0
    faulty, span = wave.replace(channels=channels), Span(start, end, joint, 0.9, "offset")
    fixed, (repair,) = repair_spans(faulty, detect_faults(faulty, similarity=False), [span])
    assert repair.method == "undone"
    np.testing.assert_allclose(fixed.channels[:, column], wave.channels[:, column], atol=1.5)


def test_jitter_that_an_end_cuts_off_is_not_turned_back_whatever_it_is_called(wave):
    """Turned back by what it is off at its edge, it would stay as far from what fills the gap."""
    joint = wave.skeleton.joint("rradius")
    columns = wave.skeleton.rotation_columns(joint)
    channels = wave.channels.copy()
    channels[440:, columns[0]] += 40.0 * np.cos(np.arange(40) * 2 * np.pi / 20)
    faulty, span = wave.replace(channels=channels), Span(440, 480, joint, 0.9, "offset")
    _, (repair,) = repair_spans(faulty, detect_faults(faulty, similarity=False), [span])
    assert repair.method != "undone"


def test_what_is_held_from_one_edge_is_expected_to_err_as_it_does_elsewhere(wave):
    """A wave that is held is off by more than one that is bridged from both edges."""
    joint = wave.skeleton.joint("rradius")
    found = detect_faults(wave, similarity=False)
    errors = []
    for start in (100, 440):
        _, (repair,) = repair_spans(wave, found, [Span(start, start + 40, joint, 0.9, "noise")])
        errors.append(repair.expected_deg)
    assert errors[1] > 10.0 * errors[0]


@pytest.mark.parametrize("left", [False, True])
def test_an_offset_is_taken_back_on_its_own_side(left):
    """The turn was in the joint's own frame or in its parent's: the same at both edges in one."""
    right = synthetic.make_clip("box", seed=1, duration_s=4)
    joint = right.skeleton.joint("rhumerus")
    texture = local_rotations(right)
    quats = texture.quat_xyzw[:, texture.joints.tolist().index(joint)]
    turn = from_rotation_vectors_deg(np.array([[25.0, -20.0, 20.0]]))
    span = Span(180, 260, joint, 0.9, "offset")
    inside = quats[span.frames]
    wrong = multiply(turn, inside) if left else multiply(inside, turn)
    channels = right.channels.copy()
    write_rotations(right.skeleton, channels, joint, span.start, wrong)
    faulty = right.replace(channels=channels)
    mended, (repair,) = repair_spans(faulty, detect_faults(faulty, similarity=False), [span])
    assert repair.method == "undone"
    assert error_deg(right, mended, span) < 1.0
    assert error_deg(right, mended, span) < repair.expected_deg + 0.5


@pytest.mark.parametrize(("step_deg", "is_undone"), [(14.0, True), (20.0, False)])
def test_a_fault_is_taken_back_if_that_leaves_a_third_of_its_jump_at_most(
    walk, step_deg, is_undone
):
    """In the middle of an offset of 40 degrees there is a step that taking it back leaves.

    The joint swings so far that no line follows it.
    """
    joint = walk.skeleton.joint("rradius")
    column = int(walk.skeleton.channel_starts[joint])
    channels = np.repeat(walk.channels[:1], len(walk), axis=0)
    channels[:, column] += 50.0 * np.sin(2 * np.pi * np.arange(len(walk)) / 72)
    channels[200:220, column] += 40.0 - step_deg / 2
    channels[220:240, column] += 40.0 + step_deg / 2
    faulty = walk.replace(channels=channels)
    span = Span(200, 240, joint, 0.9, "offset")
    _, (repair,) = repair_spans(faulty, detect_faults(faulty, similarity=False), [span])
    assert (repair.method == "undone") == is_undone


@pytest.mark.parametrize(("start", "end"), [(0, 40), (680, 720)])
def test_spans_at_the_ends_of_a_clip(walk, start, end):
    joint = walk.skeleton.joint("lfemur")
    channels = walk.channels.copy()
    column = int(walk.skeleton.channel_starts[joint])
    channels[start:end, column : column + 3] += 45.0
    faulty = walk.replace(channels=channels)
    span = Span(start, end, joint, 0.9, "offset")
    repaired, (repair,) = repair_spans(faulty, detect_faults(faulty), [span])
    assert repair.repaired
    before = np.abs(faulty.channels - walk.channels).max()
    assert np.abs(repaired.channels - walk.channels)[:, column : column + 3].max() < before


def test_a_joint_that_is_wrong_throughout_is_left(walk):
    span = Span(0, len(walk), walk.skeleton.joint("head"), 0.9, "noise")
    same, (repair,) = repair_spans(walk, detect_faults(walk), [span])
    assert same is walk
    assert repair.method == "left"
    assert not repair.repaired


@pytest.mark.parametrize(("size_deg", "method"), [(30.0, "line"), (40.0, "left")])
def test_what_cannot_be_filled_within_30_degrees_is_left(walk, size_deg, method):
    """A joint that swings so fast that no curve from edge to edge follows it."""
    joint = walk.skeleton.joint("lradius")
    channels = walk.channels.copy()
    column = int(walk.skeleton.channel_starts[joint])
    channels[:, column] = size_deg * np.sin(2 * np.pi * np.arange(len(walk)) / 31)
    wild = walk.replace(channels=channels)
    found = detect_faults(wild, similarity=False)
    _, (repair,) = repair_spans(wild, found, [Span(300, 330, joint, 0.9, "freeze")])
    assert repair.method == method


def test_a_clip_without_another_gap_of_the_length_leaves_little_to_go_by(walk):
    joint = walk.skeleton.joint("lradius")
    found = detect_faults(walk, similarity=False)
    _, (repair,) = repair_spans(walk, found, [Span(200, 560, joint, 0.9, "freeze")])
    assert repair.expected_deg == pytest.approx(0.1 * 3.0)


@pytest.mark.parametrize("span", [(5, 5, 0), (-1, 3, 0), (10, 10**6, 0), (0, 5, 99), (0, 5, 1)])
def test_spans_that_make_no_sense_are_refused(walk, span):
    with pytest.raises(ClipError, match="spans of joints that rotate"):
        repair_spans(walk, detect_faults(walk), [Span(*span, 0.5, "offset")])


def repaired(clip, span, *methods):
    found = detect_faults(clip, similarity=False)
    mended, (repair,) = repair_spans(clip, found, [span])
    assert repair.method in methods
    return mended


def test_a_spike_is_bridged_and_not_turned_back(walk):
    """What the frames beside it say of one frame is surer than what they say of its turn."""
    joint = walk.skeleton.joint("rradius")
    columns = walk.skeleton.rotation_columns(joint)
    channels = walk.channels.copy()
    channels[200, columns[0]] += 60.0
    span = Span(200, 201, joint, 0.9, "offset")
    mended = repaired(walk.replace(channels=channels), span, "line", "bridged")
    assert np.abs(mended.channels - walk.channels)[200, columns].max() < 0.3


def test_an_exchange_that_is_called_something_else_is_swapped_back(walk):
    left, right = (walk.skeleton.rotation_columns(walk.skeleton.joint(s + "femur")) for s in "lr")
    channels = walk.channels.copy()
    inside = slice(200, 260)
    channels[inside, left], channels[inside, right] = (
        walk.channels[inside, right], walk.channels[inside, left]
    )  # fmt: skip
    faulty = walk.replace(channels=channels)
    span = Span(200, 260, walk.skeleton.joint("lfemur"), 0.9, "offset")
    mended = repaired(faulty, span, "swapped back")
    found = detect_faults(faulty, similarity=False)
    repairs = repair_spans(faulty, found, [span])[1]
    assert as_repaired(found, repairs).spans == (replace(span, kind="exchange"),)
    np.testing.assert_allclose(mended.channels[:, left], walk.channels[:, left], atol=1e-6)


def jittery(walk, size_deg):
    """A walk whose elbow swings slowly and jitters for half a second."""
    joint = walk.skeleton.joint("rradius")
    column = int(walk.skeleton.channel_starts[joint])
    channels = walk.channels.copy()
    channels[:, column] = 40.0 + 30.0 * np.sin(2 * np.pi * np.arange(len(walk)) / 90)
    right = walk.replace(channels=channels)
    channels = channels.copy()
    channels[200:260, column] += np.random.default_rng(1).normal(0, size_deg, 60)
    return right, right.replace(channels=channels), Span(200, 260, joint, 0.9, "noise"), column


def test_jitter_is_calmed_and_the_slow_motion_kept(walk):
    right, faulty, span, column = jittery(walk, 5.0)
    mended = repaired(faulty, span, "smoothed")
    left = np.abs(mended.channels - right.channels)[span.frames, column].mean()
    line = with_slerp(faulty, [span])
    row = line.joints.tolist().index(span.joint)
    beside = angles_deg(line.quat_xyzw[:, row], local_rotations(right).quat_xyzw[:, row])
    assert left < 0.7 * np.abs(faulty.channels - right.channels)[span.frames, column].mean()
    assert left < 0.5 * beside[span.frames].mean()


def test_similar_motion_that_does_not_beat_interpolation_is_left_alone(walk):
    """A joint that turns evenly: similar motion stands elsewhere."""
    joint = walk.skeleton.joint("head")
    columns = walk.skeleton.rotation_columns(joint)
    channels = walk.channels.copy()
    channels[:, columns] = np.linspace(0.0, 30.0, len(walk))[:, None]
    even = walk.replace(channels=channels)
    channels = channels.copy()
    channels[201:240, columns] = channels[200, columns]
    still = walk.replace(channels=channels)
    span = Span(201, 240, joint, 0.9, "freeze")
    mended, (repair,) = repair_spans(still, detect_faults(still), [span])
    assert repair.method in ("line", "bridged")
    assert np.abs(mended.channels - even.channels)[span.frames, columns].max() < 1.0


def test_a_gap_that_a_program_has_filled_as_well_as_we_could_is_left(walk):
    joint = walk.skeleton.joint("lradius")
    columns = walk.skeleton.rotation_columns(joint)
    channels = walk.channels.copy()
    # swings that no curve from edge to edge knows
    channels[:, columns[0]] += 15.0 * np.sin(2 * np.pi * np.arange(len(walk)) / 13)
    share, (first, last) = np.linspace(0.0, 1.0, 41)[:, None], channels[[200, 240]]
    channels[200:241, columns] = ((1 - share) * first + share * last)[:, columns]
    filled = walk.replace(channels=channels)
    span = Span(201, 240, joint, 0.9, "filled")
    _, (repair,) = repair_spans(filled, detect_faults(filled, similarity=False), [span])
    assert repair.method == "left"
    bent = filled.channels.copy()
    corner = 60.0 * (1.0 - np.abs(np.linspace(-1.0, 1.0, 41)))  # two lines that meet
    bent[200:241, columns[0]] += corner
    bent = walk.replace(channels=bent)
    _, (repair,) = repair_spans(bent, detect_faults(bent, similarity=False), [span])
    assert repair.method != "left"


def test_a_gap_that_would_move_less_than_the_fill_may_err_is_left(walk):
    """A straight line whose swings no fill knows, with a corner that is smaller than they are."""
    joint = walk.skeleton.joint("lradius")
    column = walk.skeleton.rotation_columns(joint)[0]
    channels = walk.channels.copy()
    channels[:, column] += 15.0 * np.sin(2 * np.pi * np.arange(len(walk)) / 13)
    line = np.linspace(*channels[[200, 240], column], 41)
    channels[200:241, column] = line + 20.0 * (1.0 - np.abs(np.linspace(-1.0, 1.0, 41)))
    clip = walk.replace(channels=channels)
    span = Span(201, 240, joint, 0.9, "filled")
    mended, (repair,) = repair_spans(clip, detect_faults(clip, similarity=False), [span])
    assert (repair.method, mended) == ("left", clip)
    assert repair.expected_deg > 10.0


def test_what_was_repaired_is_not_found_again(walk):
    """A line across a gap would be what a program fills it by."""
    faulty = synthetic.inject_faults(walk, seed=9, n=4, size_deg=60, length_s=(0.3, 0.6)).clip
    once = clean_clip(faulty)
    assert len(once.repairs) >= 3
    again = clean_clip(once.clip)
    assert [r for r in again.repairs if r.repaired] == []
