"""The search for a step: where it begins, how many rounds it takes, and when it gives up."""

import numpy as np
import pytest

from mocapdb.compression import Target
from mocapdb.compression.pose import block_encoder, target_search
from mocapdb.compression.pose.modes import TRANSFORM_MODES
from mocapdb.compression.pose.target_search import TargetSearch
from mocapdb.compression.tuning import BEAM_WIDTH, NARROW_BEAM_WIDTH
from mocapdb.corpus import synthetic
from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.skin import MotionError, PointError

SPLINES = TRANSFORM_MODES["spline"]
MEAN = Target("mean_mm", 1.0, joint_share=0)
WALK = synthetic.make_clip("walk", seed=1, duration_s=0.5)


def largest(distance_mm):
    """An error of which only the maximum matters."""
    return MotionError(0.0, PointError(0.0, 0.0, distance_mm))


def coded(blocks, error, own=None, near=None):
    """What encoding all blocks at one step gives."""
    return target_search._CodedMean(blocks, error, own, near or {})


def noisy(n_frames, sensor_noise_deg=0.5):
    return synthetic.make_clip(
        "run", seed=3, duration_s=(n_frames + 1) / 120, sensor_noise_deg=sensor_noise_deg
    )[:n_frames]


def still(n_frames):
    return WALK.replace(channels=np.tile(WALK.channels[:1], (n_frames, 1)))


def block_frames(clip, target):
    return TargetSearch(clip, target, SPLINES).block_frames


# -- blocks ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("n_frames", "expected"), [(190, 190), (230, 58)], ids=["one block", "several"]
)
def test_short_clips_are_one_block(n_frames, expected):
    """Above 192 frames a clip is cut where its integers are enough for more than one block."""
    assert block_frames(noisy(n_frames), Target("max_mm", 0.05, joint_share=0)) == expected


def test_blocks_have_about_as_many_integers_whatever_the_motion():
    """6,000 of them, estimated from twice 96 frames; a maximum needs 1.6 times as many."""
    clip = noisy(900)
    calm_at_last = clip.replace(channels=np.vstack([clip.channels[:240], still(3760).channels]))
    found = {
        "mean": block_frames(clip, Target("mean_mm", 0.5, joint_share=0)),
        "maximum": block_frames(clip, Target("max_mm", 0.5 / 0.15, joint_share=0)),
        "calm at last": block_frames(calm_at_last, Target("mean_mm", 0.5, joint_share=0)),
    }
    assert found == {"mean": 150, "maximum": 100, "calm at last": 2000}


def test_blocks_are_neither_too_short_nor_too_long():
    """At least 64 frames, and at most about 2048 where nothing moves."""
    assert block_frames(noisy(400), Target("max_mm", 0.01, joint_share=0)) == 67
    assert block_frames(still(5200), MEAN) == 1734


# -- steps -----------------------------------------------------------------------------------------


def test_the_first_step_is_near_the_one_that_holds():
    """0.45 steps a mean distance; the maximum is 0.15 times as strict again."""
    skeleton = WALK.skeleton
    unit_mm = 1000.0 * skeleton.metres_per_unit
    mean = TargetSearch(WALK, Target("mean_mm", unit_mm, joint_share=0), SPLINES).qp
    maximum = TargetSearch(WALK, Target("max_mm", unit_mm, joint_share=0), SPLINES).qp
    assert mean == int(64 * np.log2(0.45))
    assert maximum == int(64 * np.log2(0.45 * 0.15))


def test_a_clip_without_error_does_not_make_the_step_endless():
    assert target_search._octaves_to(1.0, 0.0) == round(64 * np.log2(1000))


def rounds_of(monkeypatch, error_of):
    """The steps that the search for a mean tries where the error is what a function says."""
    search = TargetSearch(WALK, MEAN, SPLINES)
    monkeypatch.setattr(search, "_estimate_step_and_weights", lambda: None)
    tried = []

    def encode_all(qp, *, forget_modes=False):
        tried.append((qp, forget_modes))
        return coded([], error_of(qp - tried[0][0]))

    monkeypatch.setattr(search, "_encode_all", encode_all)
    search._hold_mean()
    return tried


def test_a_mean_is_searched_for_in_eight_rounds(monkeypatch):
    """Once one step holds the target, and where none comes close to it."""
    assert len(rounds_of(monkeypatch, lambda qp: 0.9)) == 8


def test_a_mean_that_never_holds_is_given_up_after_forty_rounds(monkeypatch):
    """From the fifth on, modes are searched for as if nothing was known."""
    tried = rounds_of(monkeypatch, lambda qp: 1.5)
    assert len(tried) == 40
    assert [forget for _, forget in tried] == [False] * 4 + [True] * 36


def test_a_mean_aims_a_little_below_its_target(monkeypatch):
    """At 0.998 of it, and 0.995 is close enough. The step changes by more than the mean has to."""
    tried = rounds_of(monkeypatch, lambda qp: 0.7 if qp == 0 else 0.9949 if qp < 40 else 0.9951)
    assert tried[1][0] - tried[0][0] == round(1.35 * 64 * np.log2(0.998 / 0.7))
    assert len(rounds_of(monkeypatch, lambda qp: 0.7 if qp == 0 else 0.9949)) > 2
    assert len(rounds_of(monkeypatch, lambda qp: 0.7 if qp == 0 else 0.9951)) == 2


@pytest.mark.parametrize(("ratio", "rounds"), [(0.971, 1), (0.969, 8)])
def test_where_joints_weigh_more_a_mean_may_stay_farther_away(monkeypatch, ratio, rounds):
    """At 0.97 of it: each further round might break the bound of another joint."""
    search = TargetSearch(WALK, Target("mean_mm", 1.0), SPLINES)
    monkeypatch.setattr(search, "_estimate_step_and_weights", lambda: None)
    search.own_weights.always[0] = 1.0
    tried = []

    def encode_all(qp, *, forget_modes=False):
        tried.append(qp)
        return coded([], ratio)

    monkeypatch.setattr(search, "_encode_all", encode_all)
    search._hold_mean()
    assert len(tried) == rounds


def trimmed(monkeypatch, ratio, ratios):
    """What trimming asks for, from a ratio, where the next ratios are some; and what it returns."""
    search = TargetSearch(WALK, MEAN, SPLINES)
    asked = []

    def encode_all(qp, *, explore, price, n_anew):
        asked.append((price, n_anew))
        return coded([len(asked)], ratios[len(asked) - 1])

    monkeypatch.setattr(search, "_encode_all", encode_all)
    return asked, search._trim(0, ratio)


def test_a_mean_is_trimmed_in_four_rounds(monkeypatch):
    """A sixth of the channels; the nearest that holds is taken."""
    asked, best = trimmed(monkeypatch, 1.01, [1.002, 0.991, 0.992, 1.001])
    assert len(asked) == 4
    assert best == [3]
    assert {n_anew for _, n_anew in asked} == {-(-WALK.skeleton.n_channels // 6)}
    assert asked[0][0] == pytest.approx((0.997 / 1.01) ** (1 / 0.035))


def test_trimming_ends_near_the_target_or_far_from_the_price(monkeypatch):
    """From 0.995 on, and beyond 1.2 octaves."""
    assert trimmed(monkeypatch, 1.01, [0.9951])[1] == [1]
    assert trimmed(monkeypatch, 1.026, [0.9951])[1] == [1]
    assert trimmed(monkeypatch, 1.027, [])[1] is None


def test_a_guess_beyond_what_is_known_moves_by_three_sixteenths_of_an_octave():
    free = target_search._UNBOUNDED
    assert target_search._next_qp(0, 0.9999, 0, free) == 12
    assert target_search._next_qp(0, 0.9, -free, 0) == -12
    assert target_search._next_qp(0, 2.0, -100, -20) == -87
    assert target_search._next_qp(0, 2.0, -40, -20) == -30


@pytest.mark.parametrize("n_frames", [1, 2, 5, 40])
@pytest.mark.parametrize("reach", [0, 1, 3, 6, 13])
def test_the_largest_within_some_frames(n_frames, reach):
    values = np.random.default_rng(n_frames).random((n_frames, 3))
    expected = [values[max(t - reach, 0) : t + reach + 1].max(axis=0) for t in range(n_frames)]
    np.testing.assert_array_equal(target_search._largest_within(values, reach), expected)


class Recorder:
    """An encoder that only notes what it is asked for."""

    def __init__(self):
        self.profile = np.zeros(4, dtype=np.int64)
        self.asked = []
        self.previous_modes = None

    def encode(self, qp, *, explore=True):
        self.asked.append((qp, explore))


def test_a_maximum_that_never_holds_is_given_up_after_fifteen_octaves(monkeypatch):
    """By 3/8 of an octave each; from the seventh time on frame by frame."""
    search = TargetSearch(WALK, Target("max_mm", 1.0, joint_share=0), SPLINES)
    monkeypatch.setattr(search, "_decoded", lambda block: None)
    monkeypatch.setattr(search, "_squares", lambda source, decoded: None)
    monkeypatch.setattr(search, "_error", lambda squares: largest(2.0))
    encoder = Recorder()
    assert search._refine_until_held(encoder, search.ranges[0], None, 0) is None
    assert encoder.asked == [(-24 * (i + 1), i < 6) for i in range(40)]


def encoded_blocks(monkeypatch, search, ratios):
    """The rounds of the search for a maximum in its first block, where errors are what is said.

    Of each its step, whether modes may be sought, how many channels are encoded, and the beam.
    """
    asked, ratios = [], iter(ratios)
    encode = target_search.BlockEncoder.encode

    def noting(self, qp, *, explore=True, n_anew=None, beam_width=BEAM_WIDTH):
        asked.append((qp, explore, n_anew, beam_width))
        return encode(self, qp, explore=explore, n_anew=n_anew, beam_width=beam_width)

    monkeypatch.setattr(target_search.BlockEncoder, "encode", noting)
    monkeypatch.setattr(search, "_error", lambda squares: largest(next(ratios)))
    assert search._hold_maximum_in(search.ranges[0]) is not None
    return asked


def test_a_maximum_is_searched_for_in_ten_rounds(monkeypatch):
    """Three of them level weights. The next block begins where one ends, and takes a round less."""
    search = TargetSearch(WALK, Target("max_mm", 1.0, joint_share=0), SPLINES)
    asked = encoded_blocks(monkeypatch, search, [0.9] * 10)
    first, last = asked[0][0], asked[-1][0]
    levelled = 3 * round(0.3 * 64 * np.log2(1 / 0.9))
    assert last - first == levelled + 6 * 12
    assert [width for *_, width in asked] == [NARROW_BEAM_WIDTH] * 3 + [BEAM_WIDTH] * 7
    again = encoded_blocks(monkeypatch, search, [0.9] * 9)
    assert abs(again[0][0] - last) <= 6 * 12
    assert len(again) == 9


def test_a_maximum_that_is_hardly_broken_is_trimmed(monkeypatch):
    """Up to three times, a sixth of the channels at the same step; from 1.2 times over on not."""
    search = TargetSearch(WALK, Target("max_mm", 1.0, joint_share=0), SPLINES)
    ratios = [1.0] * 3 + [1.19, 1.1, 1.05, 1.01] + [1.21] + [1.1, 0.99] + [0.9] * 4
    asked = encoded_blocks(monkeypatch, search, ratios)
    n_anew = -(-WALK.skeleton.n_channels // 6)
    trims = [each is not None for *_, each, _ in asked]
    assert trims == [False] * 4 + [True] * 3 + [False] * 2 + [True] + [False] * 4
    assert all(each == (asked[3][0], False, n_anew, BEAM_WIDTH) for each in asked[4:7])


def test_modes_are_sought_where_steps_change_by_a_quarter_of_an_octave(monkeypatch):
    """And for the channels that are named."""
    search = TargetSearch(WALK, MEAN, SPLINES)
    frames = search.ranges[0]
    encoder = search._encoder(frames, search._source(frames))
    counts = []
    code = block_encoder._code_curves

    def counting(*asked):
        counts.append(int(asked[5].sum()))
        return code(*asked)

    monkeypatch.setattr(block_encoder, "_code_curves", counting)
    for qp in (0, 15, 17, 32, 34):
        encoder.encode(qp)
    encoder.seek_modes(np.arange(WALK.skeleton.n_channels) < 5)
    encoder.encode(34)
    n = WALK.skeleton.n_channels
    assert counts == [n, 0, n, 0, n, 5]


def test_the_first_step_is_estimated_from_two_stretches(monkeypatch):
    """Of 64 frames, for a maximum of 96, in the middle of each half; of a short clip from one."""
    asked = []
    make = TargetSearch._encoder

    def noting(self, frames, source):
        asked.append((frames.start, frames.stop))
        return make(self, frames, source)

    monkeypatch.setattr(TargetSearch, "_encoder", noting)
    TargetSearch(noisy(400), Target("mean_mm", 0.05, joint_share=0), SPLINES)
    assert asked == [(84, 148), (252, 316)]
    asked.clear()
    TargetSearch(noisy(400), Target("max_mm", 0.05, joint_share=0), SPLINES)
    assert asked == [(76, 172), (228, 324)]
    asked.clear()
    TargetSearch(noisy(120), Target("mean_mm", 0.05, joint_share=0), SPLINES)
    assert asked == [(28, 92)]
    asked.clear()
    # one block whatever it needs
    TargetSearch(noisy(192), Target("max_mm", 0.05, joint_share=0), SPLINES)
    assert asked == []


# -- weights ---------------------------------------------------------------------------------------


def test_a_point_that_hardly_moves_gets_at_most_five_times_the_weight():
    """Where distances are averaged, points weigh the inverse of theirs, with a bound."""
    skeleton = Skeleton(
        ["root", "arm", "hand"],
        [-1, 0, 1],
        [[0, 0, 0], [1, 0, 0], [9, 0, 0]],
        [["tx"], ["rz"], []],
        ["", "Z", ""],
        convention="bvh",
    )
    time = np.linspace(0, 20, 120)
    clip = Clip(skeleton, np.stack([np.zeros(120), 30 * np.sin(time)], axis=1), 60.0)
    search = TargetSearch(clip, Target("mean_mm", 50.0, joint_share=0), SPLINES)
    before = search.points.weights
    search._estimate_step_and_weights()
    growth = (search.points.weights / before)[search.points.is_measured]
    assert growth.max() == pytest.approx(5.0)
    assert growth.min() < 1.0


def test_no_weight_grows_by_more_than_256_times(monkeypatch):
    """However often the maximum is broken after it was held."""
    search = TargetSearch(WALK, Target("max_mm", 1.0, joint_share=0), SPLINES)
    ratios = iter([0.9] * 4 + [2.0] * 20)
    monkeypatch.setattr(search, "_error", lambda squares: largest(next(ratios)))
    used = []
    weigh = search._weigh

    def noting(encoder, frames, emphasis, own_weights):
        used.append(emphasis.max())
        weigh(encoder, frames, emphasis, own_weights)

    monkeypatch.setattr(search, "_weigh", noting)
    search._hold_maximum_in(search.ranges[0])
    assert max(used) == 256.0
