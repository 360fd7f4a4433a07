import numpy as np
import pytest
from scipy.stats import multivariate_normal
from sklearn.decomposition import PCA
from sklearn.utils.estimator_checks import check_estimator

from mocapdb.indexing.recognition.ppca import PPCA


@pytest.fixture
def poses():
    rng = np.random.default_rng(0)
    return rng.normal(size=(300, 8)) @ rng.normal(size=(8, 8)) + rng.normal(size=8)


@pytest.mark.filterwarnings("ignore::sklearn.exceptions.SkipTestWarning")
@pytest.mark.parametrize("model", [PPCA(), PPCA(floor=0.1), PPCA(0.5, noise_variance=2.0)])
def test_it_keeps_scikit_learn_s_contract(model):
    check_estimator(model)


def test_it_is_a_gaussian(poses):
    model = PPCA(0.8).fit(poses)
    axes, noise = model.components_, model.noise_variance_
    covariance = axes.T @ np.diag(model.explained_variance_ - noise) @ axes + noise * np.eye(8)
    expected = multivariate_normal(model.mean_, covariance).logpdf(poses)
    np.testing.assert_allclose(model.score_samples(poses), expected)
    assert model.score(poses) == pytest.approx(expected.mean())


def test_it_is_tipping_and_bishop_s(poses):
    model = PPCA(0.8).fit(poses)
    theirs = PCA(len(model.components_), svd_solver="full").fit(poses)
    ratio = (len(poses) - 1) / len(poses)  # scikit-learn divides by one less
    np.testing.assert_allclose(model.explained_variance_, theirs.explained_variance_ * ratio)
    assert model.noise_variance_ == pytest.approx(theirs.noise_variance_ * ratio)


@pytest.mark.parametrize("variance", [0.3, 0.9, 0.99, 1.0])
def test_the_axes_keep_the_share_of_variance(poses, variance):
    model = PPCA(variance).fit(poses)
    total = poses.var(axis=0).sum()
    kept = (((poses - model.mean_) @ model.components_.T) ** 2).mean(axis=0)
    assert kept.sum() >= variance * total * (1 - 1e-9)
    assert kept[:-1].sum() < variance * total


def test_a_floor_accepts_others(poses):
    someone_else = poses + 0.5
    tight, wide = PPCA(0.9).fit(poses * 0.1), PPCA(0.9, floor=0.5).fit(poses * 0.1)
    assert wide.score(someone_else) > tight.score(someone_else)
    assert wide.noise_variance_ == 0.25
    assert (wide.explained_variance_ >= 0.25).all()


def test_one_pose_many_times_is_still_a_class():
    model = PPCA().fit(np.ones((5, 3)))
    assert np.isfinite(model.score_samples(np.zeros((1, 3)))).all()


def test_moments_are_enough(poses):
    covariance = np.cov(poses.T, bias=True)
    a, b = PPCA().fit(poses), PPCA().fit_moments(poses.mean(axis=0), covariance)
    np.testing.assert_allclose(a.score_samples(poses), b.score_samples(poses))


@pytest.mark.parametrize("settings", [{"variance": 0.0}, {"variance": 1.5}, {"floor": -1.0}])
def test_settings_out_of_range(poses, settings):
    with pytest.raises(ValueError, match="Expected"):
        PPCA(**settings).fit(poses)
