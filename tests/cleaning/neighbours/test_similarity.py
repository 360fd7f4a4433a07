"""Textures, what neighbours say, the paper's map, the baselines."""

import made_bodies as made
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mocapdb.cleaning.local_rotations import local_rotations, motion_texture
from mocapdb.cleaning.map.detector import detect_faults
from mocapdb.cleaning.map.digression_map import literal_map
from mocapdb.cleaning.neighbours.body_halves import body_groups
from mocapdb.cleaning.neighbours.nearest_words import Vocabulary, find_neighbours
from mocapdb.cleaning.neighbours.similarity import (
    find_consensus,
    mean_texture,
    two_stage_consensus,
)
from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError, SkeletonError
from mocapdb.io.conventions import to_bvh_convention
from mocapdb.motion.quaternions import (
    angles_deg,
    conjugate,
    from_rotation_vectors_deg,
    multiply,
    rotation_vectors_deg,
    slerp,
)
from mocapdb.motion.skeleton import Skeleton
from mocapdb.reproduce.aristidou_baselines import (
    DerivativeLimits,
    JointLimits,
    chai_hodgins_neighbours,
)


@pytest.fixture(scope="module")
def run():
    return synthetic.make_clip("run", seed=4, duration_s=6)


@given(st.integers(0, 2**32 - 1))
def test_quaternions_agree_with_scipy(seed):
    rng = np.random.default_rng(seed)
    a, b = Rotation.random(5, random_state=rng), Rotation.random(5, random_state=rng)
    qa, qb = a.as_quat(), b.as_quat()
    product = Rotation.from_quat(multiply(qa, qb))
    np.testing.assert_allclose((product.inv() * (a * b)).magnitude(), 0, atol=1e-7)
    np.testing.assert_allclose(angles_deg(qa, qb), np.rad2deg((a.inv() * b).magnitude()))
    np.testing.assert_allclose(conjugate(qa), a.inv().as_quat() * np.sign(qa[:, 3:] / qa[:, 3:]))
    vectors = rotation_vectors_deg(qa)
    np.testing.assert_allclose(vectors, np.rad2deg(a.as_rotvec()), atol=1e-6)
    np.testing.assert_allclose(angles_deg(from_rotation_vectors_deg(vectors), qa), 0, atol=1e-5)
    half = slerp(qa, qb, np.full(5, 0.5))
    np.testing.assert_allclose(angles_deg(qa, half), angles_deg(half, qb), atol=1e-5)


def test_the_texture_does_not_know_where_the_body_faces(run):
    turned = synthetic.make_clip("run", seed=4, duration_s=6, heading_deg=70)
    a, b = motion_texture(run), motion_texture(turned)
    assert len(a) == 144
    assert a.fps == 24.0
    np.testing.assert_allclose(angles_deg(a.quat_xyzw, b.quat_xyzw), 0, atol=1e-4)


def test_the_texture_shows_the_clip_at_its_times(run):
    native, texture = local_rotations(run), motion_texture(run)
    np.testing.assert_allclose(
        angles_deg(native.quat_xyzw[::5, 1:], texture.quat_xyzw[:, 1:]), 0, atol=1e-5
    )
    slow = motion_texture(run.replace(channels=run.channels[::10], fps=12.0))
    assert slow.fps == 12.0
    assert len(slow) == 72


def test_consensus_knows_the_right_rotation_where_the_motion_repeats(run):
    faulty, mask, (fault,) = synthetic.inject_faults(
        run, seed=2, kinds=["offset"], n=1, size_deg=40, length_s=0.3
    )
    texture = motion_texture(faulty)
    consensus = find_consensus(texture, find_neighbours(texture, [texture]))
    row = texture.joints.tolist().index(fault.joint)
    wrong = mask[::5, fault.joint]
    assert consensus.residual_deg[wrong, row].min() > 25
    right = motion_texture(run).quat_xyzw[wrong, row]
    assert angles_deg(right, consensus.median_quats[wrong, row]).mean() < 8
    assert consensus.known.all()


def test_the_literal_map_is_the_papers_formula(run):
    texture = motion_texture(run)
    neighbours = find_neighbours(texture, [texture])
    difference = angles_deg(mean_texture(texture, neighbours), texture.quat_xyzw)
    moving = difference.mean(axis=0) > 1e-3
    scaled = difference[:, moving] / difference[:, moving].mean(axis=0)
    found = literal_map(run, texture, neighbours)
    assert found.scores.min() >= 0
    assert found.scores.max() <= 1
    at_texture = found.scores[::5][:, texture.joints[moving]]
    np.testing.assert_allclose(at_texture, 1 - np.exp(-(scaled**2)), atol=1e-9)
    np.testing.assert_array_equal(found.mask, found.scores > 0.5)
    assert found.mask.any(axis=1).mean() > 0.9  # as it is printed, it flags nearly everything
    softer = literal_map(run, texture, neighbours, row_scale=6.0, floor_deg=1.0)
    assert (softer.scores <= found.scores + 1e-12).all()
    again = detect_faults(run, literal=True)
    np.testing.assert_array_equal(again.scores, found.scores)
    assert again.spans == found.spans
    stricter = detect_faults(run, literal=True, threshold=0.9)
    assert 0 < stricter.mask.sum() < found.mask.sum()


def test_the_literal_map_refuses_what_makes_no_sense(run):
    texture = motion_texture(run)
    neighbours = find_neighbours(texture, [texture])
    for wrong in ({"threshold": 0.0}, {"row_scale": 0.0}, {"floor_deg": -1.0}):
        with pytest.raises(ClipError, match="Expected a threshold in"):
            literal_map(run, texture, neighbours, **wrong)
    with pytest.raises(ClipError, match="too short"):
        detect_faults(run[:60], literal=True)
    with pytest.raises(ClipError, match="similarity is off"):
        detect_faults(run, literal=True, similarity=False)


def test_baselines_flag_what_leaves_their_ranges(run):
    limits, speeds = JointLimits.learn([run, run[:100]]), DerivativeLimits.learn([run])
    assert not limits.flag(run).any()
    assert not speeds.flag(run).any()
    joint = run.skeleton.joint("lradius")
    channels = run.channels.copy()
    channels[300:340, int(run.skeleton.channel_starts[joint])] += 150.0
    faulty = run.replace(channels=channels)
    assert limits.flag(faulty)[300:340, joint].all()
    assert speeds.flag(faulty)[[299, 300, 339, 340], joint].all()
    assert limits.flag(faulty).sum() == 40


def test_baselines_refuse_other_skeletons(run):
    from mocapdb.io.conventions import to_bvh_convention

    other = to_bvh_convention(run)
    with pytest.raises(SkeletonError, match="several families"):
        JointLimits.learn([run, other])
    with pytest.raises(SkeletonError, match="got none"):
        DerivativeLimits.learn([])
    if other.skeleton.names != run.skeleton.names:
        with pytest.raises(SkeletonError, match="learnt from"):
            JointLimits.learn([run]).flag(other)


# -- groups and stages ---------------------------------------------------------------------------


@pytest.mark.parametrize("convention", ["acclaim", "bvh"])
def test_groups_go_by_the_hierarchy(run, convention):
    clip = to_bvh_convention(run) if convention == "bvh" else run
    texture = motion_texture(clip)
    groups = body_groups(clip.skeleton, texture.joints)
    names = {name: {texture.names[row] for row in rows} for name, rows in groups.items()}
    assert {"lfemur", "rtibia", "ltoes"} <= names["bottom"]
    assert {"head", "lhumerus", "rradius"} <= names["top"]
    assert names["top"] & names["bottom"] == {texture.names[0]}
    one, other = ("left", "right") if "lfemur" in names["left"] else ("right", "left")
    assert {"lfemur", "ltoes", "lhumerus", "lhand"} <= names[one] - names[other]
    assert {"rfemur", "rtoes", "rhumerus", "rhand"} <= names[other] - names[one]
    assert {"head", "thorax"} <= names["left"] & names["right"]


@pytest.mark.parametrize(("share", "n_sides"), [(0.025, 2), (0.035, 1)])
def test_joints_near_the_midline_belong_to_both_sides(run, share, n_sides):
    """As near as 3 % of the height; a little joint beside the head is as far as is asked for."""
    skeleton = run.skeleton
    head = skeleton.joint("head")
    offset = np.zeros(3)
    offset[0] = share * skeleton.height - skeleton.rest_positions[head][0]
    wider = Skeleton(
        [*skeleton.names, "ear"], [*skeleton.parents, head], [*skeleton.offsets, offset],
        [*skeleton.dofs, ("rx",)], [*skeleton.rotation_orders, "X"],
        axis_deg=[*skeleton.axis_deg, np.zeros(3)], convention="acclaim", name="ear",
        metres_per_unit=skeleton.metres_per_unit,
    )  # fmt: skip
    groups = body_groups(wider, np.array([0, skeleton.n_joints]))
    assert sum(1 in groups[side] for side in ("left", "right")) == n_sides


def test_sides_where_the_rest_pose_has_none():
    plain = made.make_walk()
    n_joints = plain.skeleton.n_joints
    turns = Rotation.random(n_joints, rng=np.random.default_rng(1)).as_matrix()
    near_the_middle = {"scene", "hips", "left_collar", "right_collar"}
    expected = body_groups(plain.skeleton, np.arange(n_joints))
    for body in (made.with_rest(plain, turns), made.under_scene(made.along_x(plain))):
        groups = body_groups(body.skeleton, np.arange(body.skeleton.n_joints))
        for name, rows in expected.items():
            found = {body.roles[row] for row in groups[name]}
            assert found - near_the_middle == {plain.roles[row] for row in rows} - near_the_middle


def test_a_skeleton_without_legs_has_no_groups():
    tail = Skeleton(
        ["a", "b"], [-1, 0], [[0, 0, 0], [0, 1, 0]], [("rx",), ("rx",)], ["X", "X"],
        convention="bvh", name="tail",
    )  # fmt: skip
    assert body_groups(tail, np.array([0, 1])) == {}


def test_the_second_stage_looks_elsewhere_for_what_is_distinct():
    walk = synthetic.make_clip("walk", seed=3, duration_s=5)
    # a hop in the middle, which the walk itself knows nothing of
    hop = synthetic.make_clip("hop", seed=4, duration_s=3)
    channels = np.concatenate([walk.channels[:300], hop.channels[100:200], walk.channels[300:]])
    texture = motion_texture(walk.replace(channels=channels))
    alone = find_consensus(texture, find_neighbours(texture, [texture]))
    staged = two_stage_consensus(texture, Vocabulary.of([motion_texture(hop)]))
    inside = slice(62, 78)
    assert staged.residual_deg[inside].mean() < 0.6 * alone.residual_deg[inside].mean()
    np.testing.assert_array_equal(staged.residual_deg[10:40], alone.residual_deg[10:40])


def test_neighbours_by_pose_and_velocity_are_the_same_phase(run):
    found = chai_hodgins_neighbours(run)
    texture = motion_texture(run)
    middle = len(found.starts) // 2
    own = texture.quat_xyzw[found.starts[middle]]
    near = texture.quat_xyzw[found.targets[middle, 0]]
    far = texture.quat_xyzw[found.starts[middle] + 4]
    assert angles_deg(own, near)[1:].mean() < 0.5 * angles_deg(own, far)[1:].mean()
    with pytest.raises(ClipError, match="to have a word"):
        chai_hodgins_neighbours(run[:20])
