import numpy as np
import pytest

from mocapdb.compression import Target
from mocapdb.errors import CodecError
from mocapdb.library import BuildSettings
from mocapdb.motion.joint_errors import JointErrors, JointMotion
from mocapdb.motion.skin import MotionError, PointError

ERROR = MotionError(skinned=0.5, vertices=PointError(mean=1.0, p95=2.0, max=3.0))


@pytest.mark.parametrize(("kind", "figure"), [("skinned", 0.5), ("mean_mm", 1.0), ("max_mm", 3.0)])
def test_measures_the_figure_that_it_bounds(kind, figure):
    assert Target(kind, 1.0).measure(ERROR) == figure
    assert Target(kind, figure).holds(ERROR)
    assert not Target(kind, figure * 0.999).holds(ERROR)


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf"), float("-inf")])
def test_refuses_bounds_that_are_not_positive(value):
    with pytest.raises(CodecError, match="positive target in mm"):
        Target("mean_mm", value)


def test_refuses_unknown_kinds():
    with pytest.raises(
        CodecError, match="skinned, mean_mm, max_mm, shell_mean_mm, shell_max_mm, but got 'rms'"
    ):
        Target("rms", 1.0)


def test_says_what_it_bounds():
    alone = {"joint_share": 0}
    assert str(Target("skinned", 0.25, **alone)) == "skinned <= 0.25 skeleton units"
    assert str(Target("max_mm", 5.0, **alone)) == "max_mm <= 5 mm"
    assert str(Target("max_mm", 5.0)) == "max_mm <= 5 mm, joints keep 90 %"
    assert str(Target("mean_mm", 0.5)) == "mean_mm <= 0.5 mm, max_mm <= 10 mm, joints keep 90 %"
    assert str(Target("mean_mm", 0.5, max_mm=3, **alone)) == "mean_mm <= 0.5 mm, max_mm <= 3 mm"


@pytest.mark.parametrize("share", [-0.1, 1.1, float("nan"), float("inf")])
def test_refuses_shares_that_are_none(share):
    with pytest.raises(CodecError, match="joint share from 0"):
        Target("mean_mm", 1.0, joint_share=share)


@pytest.mark.parametrize("most", [0.0, -1.0, float("nan"), float("inf")])
def test_refuses_maxima_that_are_not_positive(most):
    with pytest.raises(CodecError, match="positive maximum in mm"):
        Target("mean_mm", 1.0, max_mm=most)


def test_refuses_a_maximum_below_the_mean_or_beside_another():
    with pytest.raises(CodecError, match="at least the mean, 2 mm, but got 1 mm"):
        Target("mean_mm", 2.0, max_mm=1.0)
    with pytest.raises(CodecError, match="one maximum"):
        Target("max_mm", 2.0, max_mm=3.0)
    assert Target("skinned", 2.0, max_mm=1.0).largest_mm == 1.0  # in other units


def test_the_worst_vertex_is_bounded_too():
    """At 20 times a mean by default; not where joints are promised nothing, nor for other kinds."""
    assert Target("mean_mm", 1.0).largest_mm == 20.0
    assert Target("mean_mm", 1.0, joint_share=0).largest_mm == float("inf")
    assert Target("skinned", 1.0).largest_mm == float("inf")
    assert Target("mean_mm", 1.0, max_mm=3.0).holds(ERROR)
    assert not Target("mean_mm", 1.0, max_mm=2.9).holds(ERROR)


def test_what_joints_may_lose():
    """A tenth of the swing, .3 of the deviation; .6 and .3 degrees, .4 and .2 mm at the least."""
    frames = np.zeros((2, 2, 3), dtype=np.int64)
    motion = JointMotion(
        swing=np.array([[60.0, 3.0, 0.0], [0.0, 10.0, 0.1]]),
        spread=np.array([[20.0, 0.5, 0.0], [0.0, 2.0, 0.1]]),
        ends=frames,
        rotations=np.zeros((2, 3, 3, 3)),
        places=np.zeros((2, 3)),
        axes=np.zeros(3, dtype=np.int64),
    )
    target = Target("mean_mm", 1.0)
    np.testing.assert_allclose(target.allowed_loss(motion), [[6.0, 0.6, 0.6], [0.4, 1.0, 0.4]])
    np.testing.assert_allclose(target.allowed_rms(motion), [[6.0, 0.3, 0.3], [0.2, 0.6, 0.2]])
    zero = np.zeros((2, 3))
    missing = motion.swing - np.array([[0, 0, 0], [0, 2.0, 0]])
    lost = JointErrors(motion, zero, zero, zero, zero.astype(np.int64), missing)
    assert target.excess(lost) == pytest.approx(2.0)  # of a millimetre of ten
    blurred = JointErrors(motion, zero, zero + 0.9, zero, zero.astype(np.int64), motion.swing)
    assert target.excess(blurred) == pytest.approx(4.5)  # .2 mm
    assert Target("mean_mm", 1.0, joint_share=0).excess(lost) == 0.0


def test_a_tighter_target_keeps_its_other_bounds():
    assert Target("mean_mm", 2.0).tighter(0.5) == Target("mean_mm", 1.0, max_mm=40.0)
    assert Target("max_mm", 2.0).tighter(0.5) == Target("max_mm", 1.0)


def test_what_a_codec_promises_where_nothing_is_said_of_joints():
    said, unsaid = Target("mean_mm", 1.0, joint_share=0.2), Target("mean_mm", 1.0)
    assert unsaid.share == unsaid.for_codec("pose").joint_share == 0.1
    assert unsaid.for_codec("okane") == Target("mean_mm", 1.0, joint_share=0.0)
    assert unsaid.for_codec("okane").largest_mm == np.inf
    assert said.for_codec("okane") == said.for_codec("pose") == said


def test_settings_say_what_is_promised():
    assert BuildSettings(Target("mean_mm", 1.0)).target.joint_share == 0.1
    okane = BuildSettings(Target("mean_mm", 1.0), {"wavelet": "db4"})
    assert okane.target.joint_share == 0.0


def test_equal_targets_give_equal_text():
    whole, real = Target("mean_mm", 2, joint_share=0, max_mm=9), Target("mean_mm", 2.0, 0.0, 9.0)
    assert BuildSettings(whole).to_json() == BuildSettings(real).to_json()
