"""Bodies: the topology is CMU's, and the measures are what they say."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_channels import positions_m

from mocapdb.corpus import synthetic
from mocapdb.errors import SkeletonError


def test_skeleton_has_the_cmu_topology() -> None:
    skeleton = synthetic.make_skeleton()
    assert (skeleton.n_joints, skeleton.n_channels) == (31, 62)
    assert skeleton.convention == "acclaim"
    assert skeleton.names[:6] == ("root", "lhipjoint", "lfemur", "ltibia", "lfoot", "ltoes")
    counts = {joint: len(skeleton.dofs[skeleton.joint(joint)]) for joint in skeleton.names}
    assert counts["root"] == 6
    assert counts["lfemur"] == 3
    assert counts["ltibia"] == 1
    assert counts["lclavicle"] == 2
    assert counts["lhipjoint"] == 0


@given(
    height_m=st.floats(1.2, 2.2),
    leg=st.floats(0.85, 1.15),
    arm=st.floats(0.85, 1.15),
    shoulder=st.floats(0.85, 1.15),
)
@settings(max_examples=15, deadline=None)
def test_height_is_the_stature(height_m: float, leg: float, arm: float, shoulder: float) -> None:
    skeleton = synthetic.make_skeleton(height_m, leg=leg, arm=arm, shoulder=shoulder)
    assert skeleton.height * skeleton.metres_per_unit == pytest.approx(height_m, rel=1e-12)


def test_body_is_symmetric() -> None:
    skeleton = synthetic.subject(3)
    for joint in ("femur", "foot", "humerus", "thumb"):
        left, right = (skeleton.offsets[skeleton.joint(side + joint)] for side in "lr")
        np.testing.assert_allclose(left * [-1, 1, 1], right, atol=1e-12)


def test_average_body_stands_as_high_as_it_measures() -> None:
    clip = synthetic.make_clip("wave", seed=0, skeleton=synthetic.make_skeleton(1.8))
    head = positions_m(clip)[:, clip.skeleton.joint("head"), 1]
    assert head.mean() == pytest.approx(1.8, abs=0.02)


def test_subjects_differ_and_are_repeatable() -> None:
    bodies = [synthetic.subject(seed) for seed in range(6)]
    assert len({body.digest for body in bodies}) == 6
    assert synthetic.subject(4) == bodies[4]
    ratios = bodies[0].bone_lengths / bodies[1].bone_lengths
    assert np.ptp(ratios) > 0.01  # other proportions, not only another size
    heights_m = [body.height * body.metres_per_unit for body in bodies]
    assert all(1.4 < height < 2.05 for height in heights_m)


@pytest.mark.parametrize("bad", [{"height_m": 0.0}, {"leg": -1.0}, {"arm": np.nan}])
def test_impossible_bodies_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(SkeletonError, match="positive"):
        synthetic.make_skeleton(**bad)
