import numpy as np
import pytest

from mocapdb.cycles import (
    cycle_of_loop,
    make_loop,
)
from mocapdb.cycles.cycle import joint_positions
from mocapdb.errors import NoPeriodError
from mocapdb.io import read_clip, write_clip


def test_a_loop_read_back_is_a_cycle_again(walk, tmp_path):
    loop = make_loop(walk, hold_feet=False).clip
    for name in ("loop.bvh", "loop.amc", "loop.npz"):
        write_clip(loop, tmp_path / name)
        again = cycle_of_loop(read_clip(tmp_path / name, fps=120.0))
        assert again.period_s == pytest.approx(walk.period_s, abs=0.01)
        size = np.linalg.norm(walk.advance)
        assert np.linalg.norm(again.advance) == pytest.approx(size, rel=0.02)
        if name == "loop.amc":
            np.testing.assert_allclose(joint_positions(again), joint_positions(walk), atol=0.6)


def test_open_ends_are_no_loop(synthetic_walk):
    with pytest.raises(NoPeriodError, match="steps apart"):
        cycle_of_loop(synthetic_walk[:70])
    with pytest.raises(NoPeriodError, match="steps apart"):
        cycle_of_loop(synthetic_walk[:2])
