"""Limits and weights of the understanding of bodies, each at the place where it decides."""

from dataclasses import replace

import made_bodies as made
import numpy as np
import pytest

from mocapdb.motion.body import anatomy, head, shaped_joints, unit_and_up
from mocapdb.motion.body.findings import NoBodyError
from mocapdb.motion.body.pose_tree import pose_tree, some_frames
from mocapdb.motion.body.position_channels import positions_are_added
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.skeleton import Skeleton


@pytest.fixture(scope="module")
def walk():
    return made.make_walk(30)


@pytest.mark.parametrize(
    ("n_clips", "n_looked_at", "each"), [(1, 1, 48), (2, 2, 24), (24, 24, 12), (25, 13, 12)]
)
def test_frames_are_spread_over_clips(n_clips, n_looked_at, each):
    some = some_frames([np.arange(4 * 48.0)] * n_clips)
    assert [len(frames) for frames in some] == [each] * n_looked_at


def stretched(body, **sizes):
    """The body with the bones that end in some joints longer, by the end of their roles."""
    offsets = body.skeleton.offsets.copy()
    for ending, size in sizes.items():
        for joint, role in enumerate(body.roles):
            if role.endswith(ending):
                offsets[joint] *= size
    return replace(body, skeleton=replace(body.skeleton, offsets=offsets))


def tree_of(body):
    return pose_tree(body.skeleton, body.pose.positions)


def nodes_of(body):
    return {name: body.roles.index(role) for name, role in made.CANONICAL.items()}


def fault(body, is_posed=True):
    return anatomy.body_fault(tree_of(body), nodes_of(body), is_posed=is_posed)


def chain(lengths, branches=()):
    """A skeleton of bones one after another along x, and branches of a length from joints."""
    names = [f"n{i}" for i in range(len(lengths) + 1 + len(branches))]
    parents = [-1, *range(len(lengths)), *(joint for joint, _ in branches)]
    offsets = [(0, 0, 0), *((length, 0, 0) for length in lengths)]
    offsets += [(0, length, 0) for _, length in branches]
    skeleton = Skeleton(
        names, parents, offsets, [("rx",)] * len(names), ["X"] * len(names), convention="bvh"
    )
    return pose_tree(skeleton, skeleton.rest_positions[None])


def test_places():
    tree = chain([0.4, 0.02, 0.58], [(0, 1.0)])
    assert tree.extent == pytest.approx(2.0)
    assert tree.places_apart([0, 1, 2, 3]) == [0, 1, 3]
    tree = chain([0.4, 0.03, 0.57], [(0, 1.0)])
    assert tree.places_apart([0, 1, 2, 3]) == [0, 1, 2, 3]


@pytest.mark.parametrize(("length", "n_ends"), [(0.18, 2), (0.22, 3)])
def test_long_branches(length, n_ends):
    tree = chain([0.5, 0.5], [(1, 0.5), (1, length)])
    assert tree.extent == pytest.approx(1.0)
    assert len(shaped_joints._long_ends(tree)) == n_ends


@pytest.mark.parametrize(("size", "n_pairs"), [(1.15, 2), (1.22, 1)])
def test_limbs_that_mirror_each_other(walk, size, n_pairs):
    body = stretched(walk, right_elbow=size, right_wrist=size, right_hand_end=size)
    assert len(shaped_joints._pairs(tree_of(body))) == n_pairs


def test_how_badly_limbs_fit(walk):
    def cost(body):
        tree = tree_of(body)
        legs, arms = sorted(
            shaped_joints._pairs(tree),
            key=lambda limb: -tree.distance(limb.meeting, limb.ways[0][-1]),
        )
        return [shaped_joints._fitted(tree, *pair)[2] for pair in ((legs, arms), (arms, legs))]

    big = stretched(walk, toe_end=4.0, hand_end=2.0)
    names = walk.skeleton.channel_names
    still = [name.partition("_")[2].startswith(("knee", "ankle")) for name in names]
    tapping = [name.endswith("toe.rx") for name in names]
    beat = 20 * np.sin(np.arange(len(walk.channels)))[:, None]
    stiff = replace(walk, channels=np.where(still, 0.0, np.where(tapping, beat, walk.channels)))
    found = [each for body in (walk, big, stiff) for each in cost(body)]
    np.testing.assert_allclose(found, FITS, rtol=1e-3)


FITS = [0.085242, 0.441603, 0.05002, 0.586271, 0.235242, 0.440418]


@pytest.mark.parametrize(
    ("sizes", "is_fault"),
    [
        ({"left_wrist": 0.70}, False),
        ({"left_wrist": 0.60}, True),
        ({"knee": 0.62}, False),
        ({"knee": 0.57}, True),
        ({"knee": 1.55}, False),
        ({"knee": 1.65}, True),
        ({"elbow": 0.42}, False),
        ({"elbow": 0.38}, True),
        ({"elbow": 2.0, "wrist": 1.0}, False),
        ({"wrist": 0.45}, True),
        ({"elbow": 0.55, "wrist": 0.55}, False),
        ({"elbow": 0.5, "wrist": 0.5}, True),
        ({"elbow": 1.6, "wrist": 1.6}, False),
        ({"elbow": 1.7, "wrist": 1.7}, True),
    ],
)
def test_proportions_of_segments(walk, sizes, is_fault):
    assert bool(fault(stretched(walk, **sizes), is_posed=False)) == is_fault


@pytest.mark.parametrize(
    ("sizes", "what"),
    [
        ({"spine": 0.13, "spine2": 0.13, "chest": 0.13}, "trunk"),
        ({"spine": 0.22, "spine2": 0.22, "chest": 0.22}, ""),
        ({"spine": 2.2, "spine2": 2.2, "chest": 2.2}, ""),
        ({"spine": 2.45, "spine2": 2.45, "chest": 2.45}, "trunk"),
        ({"head": 4.9}, ""),
        ({"head": 5.6}, "head"),
        ({"_hip": 0.2}, "hips"),
        ({"_hip": 0.28}, ""),
        ({"_hip": 2.6}, ""),
        ({"_hip": 2.95}, "hips"),
        ({"shoulder": 2.4}, ""),
        ({"shoulder": 2.65}, "shoulders"),
    ],
)
def test_proportions_over_the_motion(walk, sizes, what):
    assert fault(stretched(walk, **sizes)).startswith(f"its {what}" if what else "")
    assert bool(fault(stretched(walk, **sizes))) == bool(what)


def bent(walk, **degrees):
    channels = np.zeros_like(walk.channels)
    for name, value in degrees.items():
        for i, channel in enumerate(walk.skeleton.channel_names):
            if channel.replace(".", "_").endswith(name):
                channels[:, i] = value
    return replace(walk, channels=channels)


@pytest.mark.parametrize(("angle_deg", "is_fault"), [(115, False), (128, True)])
def test_legs_folded_up_along_the_trunk(walk, angle_deg, is_fault):
    assert bool(fault(bent(walk, hip_rx=-angle_deg))) == is_fault


@pytest.mark.parametrize(
    ("angle_deg", "arms", "trunk", "is_fault"),
    [
        (90, 1.35, 1.0, True),
        (90, 1.15, 1.0, False),
        (90, 1.0, 1.7, True),
        (90, 1.0, 1.35, False),
        (45, 1.35, 1.0, False),
        (55, 1.35, 1.0, True),
    ],
)
def test_animals_on_all_fours(walk, angle_deg, arms, trunk, is_fault):
    body = bent(walk, hip_rx=-angle_deg, shoulder_ry=0.0)
    body = stretched(body, elbow=arms, wrist=arms, spine=trunk, spine2=trunk, chest=trunk)
    channels = body.channels.copy()
    for side, sign in (("left", 1.0), ("right", -1.0)):
        # arms point ahead of the trunk, as the legs do
        columns = list(body.skeleton.channel_names)
        channels[:, columns.index(f"{side}_shoulder.ry")] = -sign * angle_deg
    body = replace(body, channels=channels)
    assert ("four legs" in fault(body)) == is_fault
    some = np.repeat([True, False], [14, 16])
    upright = replace(body, channels=np.where(some[:, None], body.channels, 0.0))
    assert "four legs" not in fault(upright)


@pytest.mark.parametrize(("share", "is_added"), [(0.4, True), (0.6, False)])
def test_how_small_displacements_are(walk, share, is_added):
    body = made.with_positions(walk, "places")
    channels = body.channels.copy()
    shifts = [i for i, name in enumerate(body.skeleton.channel_names) if ".t" in name]
    channels[:, shifts[3:]] *= share
    assert positions_are_added(body.skeleton, channels).value == is_added


UNITS = {
    3.0: 0.917985,
    4.2: 0.999942,
    11.0: 0.970882,
    22.0: 0.889131,
    45.0: 0.969535,
    110.0: 0.996839,
    500.0: 1.000000,
}


@pytest.mark.parametrize("height", UNITS)
def test_how_sure_units_are(height):
    found = unit_and_up.find_unit(height, "it")
    assert found.confidence == pytest.approx(UNITS[height], rel=1e-4)


def test_small_children_and_tall_adults_are_told_apart():
    for height, metres in ((87.0, 0.01), (78.0, 0.0254), (66.0, 0.0254), (29.8, 0.0254 / 0.45)):
        assert unit_and_up.find_unit(height, "it").value == metres


RAISED = np.array([0.0, 0.3, 0.2])


def test_how_sure_the_vertical_is(walk):
    tree = tree_of(walk)
    rest = pose_tree(walk.skeleton, walk.skeleton.rest_positions[None])
    lying = pose_tree(walk.skeleton, bent(walk, hips_rx=90).pose.positions + RAISED)
    leaning = pose_tree(walk.skeleton, bent(walk, hips_rx=45).pose.positions + RAISED)
    found = [
        unit_and_up.find_up(each, [each.positions], rest, nodes_of(walk)).confidence
        for each in (tree, lying, leaning)
    ]
    np.testing.assert_allclose(found, UPS, rtol=1e-4)


UPS = [0.999998, 0.615827, 0.966206]


@pytest.mark.parametrize(
    ("rise", "expected"), [(0.03, "head"), (0.05, "top"), (0.13, "top"), (0.15, "head")]
)
def test_which_joint_of_a_neck_is_the_head(walk, rise, expected):
    """The last joint between .04 and .14 of stature above the shoulders."""
    skeleton = walk.skeleton
    tree = tree_of(walk)
    stature = 1.71
    nodes = nodes_of(walk)
    hips = (tree.positions[:, nodes["left_hip"]] + tree.positions[:, nodes["right_hip"]]) / 2
    shoulders = (
        tree.positions[:, nodes["left_shoulder"]] + tree.positions[:, nodes["right_shoulder"]]
    ) / 2
    up = shoulders - hips
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    positions = walk.pose.positions.copy()
    positions[:, walk.roles.index("neck")] = shoulders + 0.01 * up
    positions[:, walk.roles.index("head")] = shoulders + 0.09 * stature * up
    dofs = tuple(
        ("rx",) if role == "head_end" else joint
        for role, joint in zip(walk.roles, skeleton.dofs, strict=True)
    )
    orders = tuple(
        "X" if role == "head_end" else order
        for role, order in zip(walk.roles, skeleton.rotation_orders, strict=True)
    )
    positions[:, walk.roles.index("head_end")] = shoulders + rise * stature * up
    tree = pose_tree(replace(skeleton, dofs=dofs, rotation_orders=orders), positions)
    found = walk.roles[head.find_head(tree, nodes, stature)]
    assert found == {"head": "head", "top": "head_end"}[expected]


@pytest.mark.parametrize(("share", "stands"), [(0.45, False), (0.55, True)])
def test_rest_poses_that_stand(share, stands):
    skeleton = Skeleton(
        ["a", "b", "c", "d"],
        [-1, 0, 0, 0],
        [(0, 0, 0), (1, 0, 0), (-1, 0, 0), (0, 2 * share, 0)],
        [()] * 4,
        [""] * 4,
        convention="bvh",
    )
    assert skeleton.height == pytest.approx(2 * share if stands else 2.0 / 1.5)


@pytest.mark.parametrize(
    ("trunk", "is_found"), [("spine2", True), ("spine", True), ("hips", False)]
)
def test_how_far_from_the_arms_a_head_may_branch_off(walk, trunk, is_found):
    parents = walk.skeleton.parents.copy()
    parents[walk.roles.index("neck")] = walk.roles.index(trunk)
    tree = pose_tree(replace(walk.skeleton, parents=parents), walk.pose.positions)
    assert (head.find_head(tree, nodes_of(walk), 1.71) is not None) == is_found


@pytest.mark.parametrize(("size", "is_body"), [(2.2, True), (2.8, False)])
def test_how_badly_limbs_may_fit(walk, size, is_body):
    tree = tree_of(made.renamed(stretched(walk, elbow=size, wrist=size, hand_end=size)))
    if is_body:
        assert "left_elbow" in shaped_joints.shaped_nodes(tree)
    else:
        with pytest.raises(NoBodyError, match="proportions"):
            shaped_joints.shaped_nodes(tree)


@pytest.mark.parametrize(("n_limbs", "says"), [(60, "pairs of long limbs"), (70, "70 long limbs")])
def test_so_many_limbs_are_not_compared(n_limbs, says):
    """Of joints that stand like the teeth of a comb, each with an end."""
    n = 1 + 3 * n_limbs
    parents = np.concatenate([[-1], np.tile([0, 0, 0], n_limbs)])
    parents[2::3], parents[3::3] = np.arange(1, n, 3), np.arange(2, n, 3)
    skeleton = Skeleton(
        names=[str(i) for i in range(n)],
        parents=parents,
        offsets=np.tile([1.0, 0.0, 0.0], (n, 1)),
        dofs=[("rz",)] * n,
        rotation_orders=["Z"] * n,
        convention="bvh",
    )
    tree = pose_tree(skeleton, forward_kinematics(skeleton, np.zeros((1, n))).positions)
    with pytest.raises(NoBodyError, match=says):
        shaped_joints.shaped_nodes(tree)
