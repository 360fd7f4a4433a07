"""The metric of a block: one for each stretch, computed anew where weights change."""

import numpy as np

from mocapdb.compression.pose.block_metric import BlockMetric
from mocapdb.compression.pose.own_motion import Posed
from mocapdb.compression.pose.skin_metric import error_points
from mocapdb.corpus import synthetic
from mocapdb.motion.kinematics import forward_kinematics

WALK = synthetic.make_clip("walk", seed=1, duration_s=0.5)
POINTS = error_points(WALK.skeleton, "skin")


def posed(channels):
    return Posed(channels, forward_kinematics(WALK.skeleton, channels))


def still(n_frames):
    return np.tile(WALK.channels[:1], (n_frames, 1))


def test_one_metric_serves_while_the_body_moves_little():
    """For so many frames at the most, and until an entry of a rotation has changed by 0.3."""
    turn = still(9)
    turn[5:, WALK.skeleton.dofs[0].index("ry")] += 60.0
    metric = BlockMetric(WALK.skeleton, posed(turn), 4)
    assert metric.rows.tolist() == [0, 0, 0, 0, 1, 2, 2, 2, 3]
    assert len(metric.factors) == 4


def test_every_so_many_frames_have_a_metric_where_there_is_memory_for_it():
    """48 MiB: at 62 channels some 1,636 metrics."""
    for n_frames, stride in ((4800, 3), (5100, 6)):
        metric = BlockMetric(WALK.skeleton, posed(still(n_frames)), 3)
        assert len(metric.factors) == -(-n_frames // stride)
        assert (metric.rows == np.arange(n_frames) // stride).all()


def test_only_what_changes_is_computed_anew():
    """And it is what a new metric with these weights is."""
    source = posed(WALK.channels)
    rng = np.random.default_rng(0)
    emphasis = np.ones((len(WALK), len(POINTS.joints)))
    own = np.zeros((2, len(WALK), WALK.skeleton.n_joints))
    metric = BlockMetric(WALK.skeleton, source, 3)
    metric.update(POINTS, emphasis, own)
    before = metric.factors.copy()
    emphasis[20:23, 4] = 7.0
    own[0, 40, 5] = rng.uniform()
    metric.update(POINTS, emphasis, own)
    fresh = BlockMetric(WALK.skeleton, source, 3)
    fresh.update(POINTS, emphasis, own)
    np.testing.assert_array_equal(metric.factors, fresh.factors)
    is_new = (metric.factors != before).any(axis=(1, 2))
    assert set(np.flatnonzero(is_new)) == set(metric.rows[[20, 21, 22, 40]])
