import pytest

from mocapdb.compression import Target
from mocapdb.errors import CodecError
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
