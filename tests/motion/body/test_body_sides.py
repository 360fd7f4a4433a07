"""On which side joints are, whatever the rest pose looks like."""

from dataclasses import replace

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.motion.body import joint_sides
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.skeleton import Skeleton
from mocapdb.scenes.stage import Actor


@pytest.fixture(scope="module")
def walk():
    return synthetic.make_clip("walk", seed=1, duration_s=1.0)


def by_name(skeleton, sides):
    return dict(zip(skeleton.names, sides.tolist(), strict=True))


def test_limbs_collarbones_and_fingers(walk):
    sides = by_name(walk.skeleton, joint_sides(walk.skeleton))
    for side, sign in (("l", 1), ("r", -1)):
        for joint in ("hipjoint", "femur", "toes", "clavicle", "humerus", "thumb", "fingers"):
            assert sides[side + joint] == sign
    assert {sides[name] for name in ("root", "lowerback", "thorax", "head")} == {0}


def test_motion_tells_where_names_do_not(walk):
    """The knees bend one way only."""
    pose = forward_kinematics(walk.skeleton, walk.channels)
    expected = joint_sides(walk.skeleton, pose.positions)
    names = tuple(f"joint{i}" for i in range(walk.skeleton.n_joints))
    unnamed = replace(walk.skeleton, names=names)
    np.testing.assert_array_equal(joint_sides(unnamed, pose.positions), expected)


def test_what_is_no_human_body():
    def skeleton(*names):
        offsets = [[0.0, 1, 0], [1, 0, 0], [-1, 0, 0], [0, 0, 1]]
        dofs, orders = (("tx", "ty", "tz"), (), (), ()), ("",) * 4
        return Skeleton(names, [-1, 0, 0, 0], offsets, dofs, orders, convention="bvh")

    named = skeleton("body", "wing_R", "wing_L", "tail")
    assert joint_sides(named).tolist() == [0, -1, 1, 0]
    assert joint_sides(skeleton("a", "b", "c", "d")).tolist() == [0, 1, -1, 0]


def test_bodies_on_a_stage_have_them(walk):
    body = Actor.of(walk).body
    sides = by_name(walk.skeleton, joint_sides(walk.skeleton))
    assert [sides[walk.skeleton.names[head]] for head in body.heads] == body.sides.tolist()
