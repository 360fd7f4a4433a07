import numpy as np
import pytest

from mocapdb.cycles import HarmonicRegression
from mocapdb.cycles.curve.harmonics import finite_differences
from mocapdb.errors import CycleError

TURN = 2 * np.pi


def noisy_laps(n_frames=150, period=50.0, noise=0.05, seed=0):
    rng = np.random.default_rng(seed)
    phase = np.arange(n_frames) / period
    waves = [np.sin(TURN * phase), np.cos(TURN * phase) + 0.3 * np.sin(2 * TURN * phase)]
    return phase, np.column_stack(waves) + rng.normal(0, noise, (n_frames, 2))


def naive_basis(phase, n_harmonics, derivative=0):
    columns = [np.full(len(phase), float(derivative == 0))]
    for wave in (np.sin, np.cos):
        for k in range(1, n_harmonics + 1):
            speed = TURN * k
            columns.append(speed**derivative * wave(speed * phase + derivative * np.pi / 2))
    return np.column_stack(columns)


def naive_m1(phase, values, velocities, accelerations, n_harmonics):
    """Equation 3.19, a channel at a time by plain least squares on stacked rows."""
    known = np.isfinite(velocities[:, 0])
    parts = [
        (phase, values),
        (phase[known], velocities[known]),
        (phase[known], accelerations[known]),
    ]
    coefficients = []
    for j in range(values.shape[1]):
        rows, targets = [], []
        for derivative, (x, y) in enumerate(parts):
            basis = naive_basis(x, n_harmonics, derivative)
            own = basis[:, derivative > 0 :]
            fitted = own @ np.linalg.lstsq(own, y[:, j], rcond=None)[0]
            sigma = np.sqrt(((y[:, j] - fitted) ** 2).sum() / (len(x) - own.shape[1]))
            rows.append(basis / sigma)
            targets.append(y[:, j] / sigma)
        stacked = np.vstack(rows)
        scale = np.linalg.norm(stacked, axis=0)
        found = np.linalg.lstsq(stacked / scale, np.concatenate(targets), rcond=None)[0]
        coefficients.append(found / scale)
    return np.column_stack(coefficients)


def test_m1_equals_its_naive_twin():
    phase, values = noisy_laps()
    velocities, accelerations = finite_differences(values, 1 / 50)
    fast = HarmonicRegression(6).fit(phase, values, velocities, accelerations)
    naive = naive_m1(phase, values, velocities, accelerations, 6)
    np.testing.assert_allclose(fast.coefficients_, naive, atol=1e-6)


def test_m2_is_least_squares():
    phase, values = noisy_laps()
    fast = HarmonicRegression(6, model="m2").fit(phase, values)
    naive = np.linalg.lstsq(naive_basis(phase, 6), values, rcond=None)[0]
    np.testing.assert_allclose(fast.coefficients_, naive, atol=1e-8)
    missing = values - fast.predict(phase)
    np.testing.assert_allclose(fast.left_over(phase, values), (missing**2).sum(axis=0), rtol=1e-6)


def test_smoothing_is_a_penalty_of_each_channel_by_itself():
    phase, values = noisy_laps()
    smoothing = np.array([1e-4, 3e-2])
    fast = HarmonicRegression(6, model="m2").fit(phase, values, smoothing=smoothing)
    basis = naive_basis(phase, 6)
    for channel, strength in enumerate(smoothing):
        speeds = np.arange(1, 7.0) ** 3
        penalty = len(phase) * strength * np.concatenate([[0.0], speeds, speeds])
        naive = np.linalg.solve(basis.T @ basis + np.diag(penalty), basis.T @ values[:, channel])
        np.testing.assert_allclose(fast.coefficients_[:, channel], naive, atol=1e-9)
    with pytest.raises(CycleError, match="m2 to be smoothed"):
        HarmonicRegression(6, model="m3").fit(phase, values, values, values, smoothing=smoothing)


def test_weights_balance_the_three_errors():
    phase, values = noisy_laps(600)
    velocities, accelerations = finite_differences(values, 1 / 50)
    fit = HarmonicRegression(6).fit(phase, values, velocities, accelerations)
    known = np.isfinite(velocities[:, 0])
    poses = ((values - fit.predict(phase)) ** 2).mean(axis=0)
    rates = ((velocities - fit.predict(phase, 1))[known] ** 2).mean(axis=0)
    bends = ((accelerations - fit.predict(phase, 2))[known] ** 2).mean(axis=0)
    np.testing.assert_allclose(fit.weights_[0] * rates, poses, rtol=0.3)
    np.testing.assert_allclose(fit.weights_[1] * bends, poses, rtol=0.3)


@pytest.mark.parametrize("derivative", [1, 2])
def test_derivatives_are_analytic(derivative):
    phase, values = noisy_laps()
    fit = HarmonicRegression(4, model="m2", linear=True).fit(phase, values)
    x, h = np.linspace(0, 2, 50), 1e-4
    if derivative == 1:
        numeric = (fit.predict(x + h) - fit.predict(x - h)) / (2 * h)
    else:
        numeric = (fit.predict(x + h) - 2 * fit.predict(x) + fit.predict(x - h)) / h**2
    np.testing.assert_allclose(fit.predict(x, derivative), numeric, atol=1e-3)


def test_the_linear_term_is_the_advance():
    phase = np.arange(200) / 60
    path = (3.0 * phase + 0.2 * np.sin(TURN * phase))[:, None]
    velocities, accelerations = finite_differences(path, 1 / 60)
    for model in ("m1", "m2", "m3"):
        fit = HarmonicRegression(3, model=model, linear=True)
        fit.fit(phase, path, velocities, accelerations)
        assert fit.coefficients_[-1, 0] == pytest.approx(3.0, abs=1e-4)


def test_ridge_shrinks_the_waves_and_not_the_mean():
    phase, values = noisy_laps()
    plain = HarmonicRegression(4, model="m2").fit(phase, values + 5)
    ridged = HarmonicRegression(4, model="m2", ridge=1.0).fit(phase, values + 5)
    waves = np.abs(ridged.coefficients_[1:]).sum()
    assert waves < 0.6 * np.abs(plain.coefficients_[1:]).sum()
    np.testing.assert_allclose(ridged.coefficients_[0], 5, atol=0.1)


def test_constant_channels_are_no_division_by_zero():
    phase, values = noisy_laps()
    values[:, 1] = 2.5
    velocities, accelerations = finite_differences(values, 1 / 50)
    fit = HarmonicRegression(6).fit(phase, values, velocities, accelerations)
    np.testing.assert_allclose(fit.predict(phase)[:, 1], 2.5, atol=1e-9)
    assert np.isfinite(fit.coefficients_).all()


def test_finite_differences_are_of_eighth_order():
    x = np.arange(60) * 0.05
    first, second = finite_differences(np.sin(x)[:, None], 0.05)
    assert np.isnan(first[:4]).all()
    assert np.isnan(second[-4:]).all()
    np.testing.assert_allclose(first[4:-4, 0], np.cos(x[4:-4]), atol=1e-10)
    np.testing.assert_allclose(second[4:-4, 0], -np.sin(x[4:-4]), atol=1e-9)
    assert np.isnan(finite_differences(np.ones((8, 1)), 1.0)[0]).all()


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: HarmonicRegression(-1), "n_harmonics"),
        (lambda: HarmonicRegression(2, ridge=-1.0), "ridge"),
        (lambda: HarmonicRegression(2, model="m4"), "model"),
        (
            lambda: HarmonicRegression(9, model="m2").fit(np.arange(5.0), np.ones((5, 1))),
            "Use fewer",
        ),
        (lambda: HarmonicRegression(1).fit(np.arange(5.0), np.ones((5, 1))), "velocities"),
    ],
)
def test_bad_input(make, text):
    with pytest.raises(CycleError, match=text):
        make()


@pytest.mark.parametrize("model", ["m1", "m3"])
def test_velocities_and_accelerations_can_be_left_out(model):
    rng = np.random.default_rng(0)
    phase = np.arange(200) / 60
    values = np.sin(2 * np.pi * phase)[:, None] + rng.normal(0, 0.05, (200, 1))
    rates = [rng.normal(0, 1, (200, 1)) for _ in range(2)]
    plain = HarmonicRegression(3, model="m2").fit(phase, values).coefficients_
    for used in ((True, False), (False, True), (False, False)):
        fitted = HarmonicRegression(
            3, model=model, use_velocities=used[0], use_accelerations=used[1]
        ).fit(phase, values, *rates)
        assert (fitted.weights_[:, 0] > 0).tolist() == list(used)
        assert np.allclose(fitted.coefficients_, plain, atol=1e-9) == (used == (False, False))
