import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mocapdb.cycles.curve.closed_curves import best_phase_shift, interpolate_closed, shift_phase


@given(st.integers(3, 40), st.floats(-2, 2))
def test_trigonometric_interpolation_is_exact_on_waves(n_samples, shift):
    phase = np.arange(n_samples) / n_samples
    curve = np.column_stack([np.sin(2 * np.pi * phase), np.ones(n_samples)])
    moved = interpolate_closed(curve, phase + shift)
    np.testing.assert_allclose(moved[:, 0], np.sin(2 * np.pi * (phase + shift)), atol=1e-9)
    np.testing.assert_allclose(moved[:, 1], 1.0)


@given(st.floats(0, 0.999))
def test_the_best_shift_undoes_a_shift(shift):
    phase = np.arange(64) / 64
    angle = 2 * np.pi * phase
    curve = np.column_stack([np.sin(angle), np.cos(2 * angle), np.sin(3 * angle)])
    found = best_phase_shift(curve, shift_phase(curve, shift))
    assert abs((found - shift + 0.5) % 1 - 0.5) < 1e-3
