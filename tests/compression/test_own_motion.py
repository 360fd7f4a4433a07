"""Joints keep their own motion, however few points of the skin they move."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mocapdb.compression import Budgets, Target, decode, encode
from mocapdb.compression.okane.okane_codec import OkaneCoder
from mocapdb.compression.pose import own_motion
from mocapdb.compression.pose.own_motion import OwnErrors, OwnMotion
from mocapdb.corpus import synthetic
from mocapdb.motion.clip import Clip
from mocapdb.motion.joint_errors import joint_errors, joint_motion
from mocapdb.motion.skeleton import Skeleton

WALK = synthetic.make_clip("walk", seed=1, duration_s=1.0)
STANDING = WALK.replace(channels=np.tile(WALK.channels[:1], (120, 1)))


def waving(joint, degrees, turns=3.0):
    """Nothing moves but one joint, about its first axis."""
    column = STANDING.skeleton.rotation_columns(STANDING.skeleton.joint(joint))[0]
    channels = STANDING.channels.copy()
    channels[:, column] += 0.5 * degrees * np.sin(turns * np.linspace(0, 2 * np.pi, 120))
    return STANDING.replace(channels=channels)


def talking(shift_mm=4.0, n_frames=150):
    """A face: the jaw shifts by some millimetres, an eyelid without a child turns."""
    skeleton = Skeleton(
        ["head", "jaw", "lid"],
        [-1, 0, 0],
        [[0, 0, 0], [0, -8, 2], [3, 4, 9]],
        [["tx", "ty", "tz", "rz", "ry", "rx"], ["tx", "ty", "tz"], ["rx"]],
        ["ZYX", "", "X"],
        convention="bvh",
        metres_per_unit=0.01,
    )
    time = np.linspace(0, 20, n_frames)
    channels = np.zeros((n_frames, skeleton.n_channels))
    channels[:, 6:9] = [0, -8, 2]
    channels[:, 7] += 0.05 * shift_mm * np.sin(time)
    channels[:, 9] = 12.0 * (np.sin(3 * time) > 0.9)
    return Clip(skeleton, channels, 30.0)


def losses(clip, payload):
    return joint_errors(clip.skeleton, clip.channels, decode(payload.data, clip.skeleton))


@pytest.mark.parametrize("degrees", [3.0, 10.0, 50.0])
@pytest.mark.parametrize("joint", ["lthumb", "rfingers", "head", "ltoes"])
@pytest.mark.parametrize("target", [Target("mean_mm", 1.0), Target("max_mm", 20.0)], ids=str)
def test_the_only_joint_that_moves_keeps_moving(joint, degrees, target):
    """Of 3 degrees at least 80 % are left, of 10 at least 90."""
    clip = waving(joint, degrees)
    errors = losses(clip, encode(clip, target))
    index = clip.skeleton.joint(joint)
    least = 0.9 if degrees >= 10 else 0.8
    assert errors.kept[0, index] >= least * errors.motion.swing[0, index]
    allowed = max(0.3 * errors.motion.spread[0, index], 0.3)
    assert errors.rms[0, index] <= allowed


def test_without_the_promise_it_may_be_held_still():
    """The mean alone hardly notices a thumb: it keeps less than a third."""
    clip = waving("lthumb", 20.0)
    errors = losses(clip, encode(clip, Target("mean_mm", 1.0, joint_share=0)))
    assert errors.kept[0, clip.skeleton.joint("lthumb")] < 6.5


@pytest.mark.parametrize("target", [Target("mean_mm", 5.0), Target("skinned", 5.0)], ids=str)
def test_a_jaw_that_shifts_and_a_lid_without_children(target):
    clip = talking()
    errors = losses(clip, encode(clip, target))
    assert errors.motion.swing[1, 1] == pytest.approx(4.0, rel=0.01)
    assert errors.kept[1, 1] >= 0.9 * errors.motion.swing[1, 1]
    assert errors.kept[0, 2] >= 0.9 * 12.0


@pytest.mark.parametrize(
    "options",
    [
        {"codec": "okane", "representation": "channels"},
        {"decorrelation": "pca"},
        {"decorrelation": "none"},
    ],
    ids=str,
)
def test_whatever_codes_it(options):
    clip = waving("rhand", 30.0)
    target = Target("mean_mm", 1.0, joint_share=0.1)
    payload = encode(clip, target, **options)
    assert payload.codec != "raw"
    assert target.holds(payload.error, payload.joints)
    assert losses(clip, payload).kept[0, clip.skeleton.joint("rhand")] >= 27.0


@settings(max_examples=15)
@given(
    st.sampled_from(["mean_mm", "max_mm", "skinned", "shell_mean_mm"]),
    st.floats(0.2, 30.0),
    st.sampled_from([0.02, 0.1, 0.5]),
    st.integers(1, 200),
)
def test_what_is_promised_holds(kind, value, share, n_frames):
    clip = synthetic.make_clip("run", seed=n_frames, duration_s=2, sensor_noise_deg=0.3)[:n_frames]
    target = Target(kind, value, joint_share=share)
    payload = encode(clip, target)
    errors = losses(clip, payload)
    assert target.excess(errors) <= 1.0
    missing = errors.motion.swing[0] - errors.kept[0]
    assert (missing <= np.maximum(share * errors.motion.swing[0], 0.6) + 1e-6).all()


def test_the_worst_vertex_beside_the_mean():
    clip = synthetic.make_clip("run", seed=4, duration_s=1.5)
    channels = clip.channels.copy()
    channels[60, clip.skeleton.rotation_columns(clip.skeleton.joint("lhumerus"))] += 3.0
    clip = clip.replace(channels=channels)
    loose = encode(clip, Target("mean_mm", 3.0, joint_share=0)).error.vertices
    both = encode(clip, Target("mean_mm", 3.0, joint_share=0, max_mm=7.0))
    assert loose.max > 7.0
    assert both.error.vertices.max <= 7.0
    assert both.error.vertices.mean <= 3.0
    assert both.codec != "raw"


@pytest.mark.parametrize("representation", ["channels", "aligned"])
@pytest.mark.parametrize("joint", ["lthumb", "rfingers", "head"])
def test_okane_need_not_store_as_it_is_where_only_a_small_joint_moves(joint, representation):
    """What a joint needs may lie far below the target: the steps to it are counted from there."""
    clip = waving(joint, 8.0)
    target = Target("mean_mm", 1.0, joint_share=0.1)
    payload = encode(clip, target, codec="okane", representation=representation, transform="dct")
    assert payload.codec.startswith("okane")
    assert len(payload.data) < 0.1 * clip.channels.nbytes
    index = clip.skeleton.joint(joint)
    errors = losses(clip, payload)
    assert errors.kept[0, index] >= 0.9 * errors.motion.swing[0, index]


def test_okanes_columns_weigh_more_until_joints_keep_moving(monkeypatch):
    """Six times at the most; then the target is tightened, eight times at the most."""
    weighed, values = [], []
    weigh, code = OkaneCoder.weighed, OkaneCoder.code

    def noting_weights(self, excess, threshold):
        weighed.append(excess.max())
        return weigh(self, excess, threshold)

    def noting_targets(self, target, *rest, **options):
        values.append(target.value)
        return code(self, target, *rest, **options)

    monkeypatch.setattr(OkaneCoder, "weighed", noting_weights)
    monkeypatch.setattr(OkaneCoder, "code", noting_targets)
    options = {"codec": "okane", "representation": "aligned", "transform": "dct"}
    options |= {"decorrelation": "none", "shares": Budgets(0.4, 0.0, 0.6)}
    target = Target("mean_mm", 3.0, joint_share=0.1)
    walk = WALK[:60]
    assert encode(walk, target, **options).codec.startswith("okane")
    assert min(weighed) > 1.0
    assert values[: len(weighed[:6])] == [3.0] * len(weighed[:6])
    values.clear()
    monkeypatch.setattr(Target, "excess_by_joint", lambda *asked: np.full((2, 31), 1.1))
    monkeypatch.setattr(Target, "measure", lambda self, error: self.value)
    monkeypatch.setattr(OkaneCoder, "weighed", lambda self, *asked: self)
    assert encode(walk, target, **options).codec == "raw"
    assert len(values) == 8 * 7
    assert len(set(values)) == 8


def test_what_a_joint_shows_weighs_more():
    """By 1.15 times what it broke, by 8 at the most; the root's track has a finer share."""
    coder = OkaneCoder(WALK, "channels")
    excess = np.zeros((2, 31))
    head, root = WALK.skeleton.joint("head"), WALK.skeleton.body_root
    excess[0, head], excess[0, root] = 2.0, 100.0
    weighed = coder.weighed(excess, 0.1)
    own = [name.startswith("head.") for name in WALK.skeleton.channel_names[6:]]
    np.testing.assert_allclose(weighed._weights, np.where(own, 2.3, 1.0))
    assert weighed._root_share == 1 / 8
    assert (coder._weights == 1.0).all()


# -- weights ---------------------------------------------------------------------------------------


def bounds(clip):
    motion = joint_motion(clip.skeleton, clip.channels)
    return OwnMotion(Target("mean_mm", 1.0), clip.skeleton, motion, clip.fps)


def errors_of(own, rms=0.0, missing=0.0, costs=0.0):
    n_joints = own.skeleton.n_joints
    return OwnErrors(
        120,
        np.full((2, n_joints), rms),
        np.full((2, 2, n_joints), missing / 2),
        np.full((2, n_joints), costs),
    )


def test_weights_grow_by_what_is_missing():
    """By the square of 1.3 times the error, and from at least a step at the bound."""
    own = bounds(waving("head", 20.0))
    raised = own.raised(own.no_weights(), errors_of(own, rms=2.0, costs=1.0), 1e-9)
    np.testing.assert_allclose(raised.always, 2.6**2 - 1.0)
    assert not raised.at_ends.any()
    raised = own.raised(own.no_weights(), errors_of(own, rms=2.0), 0.6)
    np.testing.assert_allclose(raised.always[0], (0.6 / own.allowed_rms[0]) ** 2)
    raised = own.raised(own.no_weights(), errors_of(own, missing=2.0, costs=1.0), 1e-9)
    np.testing.assert_allclose(raised.at_ends, 3.4**2 - 1.0)


@pytest.mark.parametrize(("near", "expected"), [(0.69, False), (0.71, True)])
def test_joints_near_their_bound_weigh_more_too(near, expected):
    """From 0.7 of it on, so that they do not break it the next time."""
    own = bounds(WALK)
    raised = own.raised(own.no_weights(), errors_of(own, rms=near), 1.0)
    assert raised.are_any == expected


def test_the_ends_of_a_swing_weigh_more_for_a_few_frames():
    """0.02 s to either side: at 120 Hz two frames."""
    clip = waving("head", 20.0, turns=1.0)
    own = bounds(clip)
    weights = own.raised(own.no_weights(), errors_of(own, missing=2.0), 1.0)
    rows = own.rows(weights, slice(0, 120))
    joint = clip.skeleton.joint("head")
    raised = np.flatnonzero(rows[0, :, joint])
    ends = sorted(own.motion.ends[:, 0, joint])
    assert raised.tolist() == [end + i for end in ends for i in range(-2, 3)]
    later = own.rows(weights, slice(ends[1], 120))
    np.testing.assert_array_equal(np.flatnonzero(later[0, :, joint]), [0, 1, 2])


def test_the_search_keeps_a_little_of_what_may_be_missing():
    """3 %, as what the two ends miss adds up to first order only."""
    own = bounds(waving("head", 20.0))
    joint = own.skeleton.joint("head")
    assert own.allowed_loss[0, joint] == pytest.approx(0.97 * 2.0, rel=1e-3)
    assert own_motion._HELD < 1.0


def test_alone_a_block_has_half_of_what_may_be_missing():
    own = bounds(WALK)
    errors = errors_of(own)
    errors.missing[0, 0, 3] = 0.6
    assert errors.highest == pytest.approx(0.6)
    assert errors.alone.highest == pytest.approx(1.2)
    assert errors.times(2.0).highest == pytest.approx(1.2)
