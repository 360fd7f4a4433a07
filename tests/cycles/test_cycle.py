import numpy as np
import pytest

from mocapdb.cycles import extract_cycle, make_loop
from mocapdb.cycles.cycle import from_columns, to_columns
from mocapdb.errors import SkeletonError


def test_columns_are_rotations_again():
    from scipy.spatial.transform import Rotation

    rotations = Rotation.random(20, random_state=0).as_matrix()
    np.testing.assert_allclose(from_columns(to_columns(rotations)), rotations, atol=1e-12)
    np.testing.assert_allclose(from_columns(3.0 * to_columns(rotations)), rotations, atol=1e-12)


def test_a_cycle_that_turns_goes_round(walk):
    from dataclasses import replace

    circling = replace(walk, turn_rad=np.pi / 2)
    path, heading = circling.root_path(np.arange(5.0))
    assert heading[-1] == pytest.approx(2 * np.pi)
    np.testing.assert_allclose(path[0], path[4], atol=1e-6)
    loop = make_loop(circling, n_laps=2).clip
    assert np.isfinite(loop.channels).all()
    np.testing.assert_allclose(circling.rephased(0.3).advance, circling.advance)


def test_a_cycle_is_closed_and_goes_as_far_as_the_clip(synthetic_walk):
    cycle = extract_cycle(synthetic_walk).cycle
    ends = cycle.pose(np.array([0.0, 1.0]), "in-place")
    np.testing.assert_allclose(ends.positions[0], ends.positions[1], atol=1e-9)
    path, _ = cycle.root_path(np.array([0.0, 2.0]))
    travelled = synthetic_walk.channels[-1, :3] - synthetic_walk.channels[0, :3]
    laps = len(synthetic_walk) / synthetic_walk.fps / cycle.period_s
    expected = 2 * np.hypot(travelled[0], travelled[2]) / laps
    assert np.hypot(*(path[1] - path[0])[[0, 2]]) == pytest.approx(expected, rel=0.05)


def test_only_some_joints_move_and_the_others_keep_the_first_pose(walk):
    arm = walk.skeleton.joint("lhumerus")
    still = walk.animating(["lhumerus"])
    np.testing.assert_array_equal(still.columns[:, arm], walk.columns[:, arm])
    others = np.delete(np.arange(walk.skeleton.n_joints), arm)
    for sample in (0, 60):
        np.testing.assert_array_equal(still.columns[sample, others], walk.columns[0, others])
    assert not still.advance.any()
    assert np.ptp(still.sway, axis=0).max() == 0
    going = walk.animating(["root"])
    np.testing.assert_array_equal(going.advance, walk.advance)
    np.testing.assert_array_equal(going.sway, walk.sway)
    with pytest.raises(SkeletonError, match="tail"):
        walk.animating(["tail"])
