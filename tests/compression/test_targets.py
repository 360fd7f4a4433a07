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
    assert str(Target("skinned", 0.25)) == "skinned <= 0.25 skeleton units"
    assert str(Target("max_mm", 5.0)) == "max_mm <= 5 mm"
