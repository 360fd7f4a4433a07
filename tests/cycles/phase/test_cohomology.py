import numpy as np
import pytest

from mocapdb.cycles import CircularCoordinates
from mocapdb.cycles.phase.cohomology import _distances, _persistent_cocycles, lift_cocycle
from mocapdb.cycles.phase.laps import forwards, unwrapped
from mocapdb.cycles.phase.pose_cloud import delay_embedding, pose_cloud, principal_axes
from mocapdb.errors import CycleError


def circle(n_points, laps=1.0, noise=0.0, seed=0):
    angle = 2 * np.pi * laps * np.arange(n_points) / n_points
    rng = np.random.default_rng(seed)
    points = np.column_stack([np.cos(angle), np.sin(angle)])
    return points + rng.normal(0, noise, points.shape)


def apart(x, y):
    """Distance on the circle, once the free shift and direction are taken out."""
    best = np.inf
    for sign in (1, -1):
        turn = np.exp(2j * np.pi * (sign * x - y))
        shift = np.angle(turn.mean()) / (2 * np.pi)
        difference = (sign * x - y - shift + 0.5) % 1 - 0.5
        best = min(best, np.abs(difference).max())
    return best


@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize("prime", [3, 11, 47])
def test_coordinates_of_a_circle_are_its_angle(noise, prime):
    points = circle(120, laps=3, noise=noise)
    x = CircularCoordinates(prime=prime).fit_transform(points)
    true = np.arctan2(points[:, 1], points[:, 0]) / (2 * np.pi) % 1
    assert apart(x, true) < 0.01 + noise
    assert abs(unwrapped(forwards(x))[-1] - unwrapped(forwards(x))[0] - 3) < 0.1


def test_the_cocycle_is_one_of_integers_around_every_triangle():
    points = circle(40, noise=0.08)
    found = CircularCoordinates().fit(points)
    values = np.zeros((40, 40))
    for i, j, value in found.cocycle_:
        values[i, j], values[j, i] = value, -value
    distances = np.linalg.norm(points[:, None] - points, axis=-1).astype(np.float32)
    joined = distances < np.float32(found.threshold_)
    for i in range(40):
        for j in range(i):
            for k in range(j):
                if joined[i, j] and joined[j, k] and joined[i, k]:
                    assert values[i, j] + values[j, k] + values[k, i] == 0
    assert np.any(values != 0)


def test_half_a_generator_is_lifted_by_doubling():
    points = circle(12)
    distances = np.linalg.norm(points[:, None] - points, axis=-1).astype(np.float32)
    # one cut of the ring: 1 over the cut; half of it modulo 47 is 24
    cut = np.array([[11, 0, 24]])
    lifted, threshold = lift_cocycle(cut, distances, 0.53, 0.9, 47)
    assert np.abs(lifted[:, 2]).tolist() == [1]
    assert threshold == pytest.approx(0.9)


def test_the_bars_come_longest_first_and_the_second_loop_is_rank_one():
    small = 0.5 * circle(30) + [10, 0]
    found = CircularCoordinates(rank=1, max_epsilon=3.0).fit(np.vstack([circle(60), small]))
    lengths = found.persistence_[:, 1] - found.persistence_[:, 0]
    assert np.all(np.diff(lengths) <= 0)
    laps = unwrapped(found.coordinates_[60:])
    assert abs(laps[-1] - laps[0]) == pytest.approx(29 / 30, abs=0.05)
    assert np.ptp(unwrapped(found.coordinates_[:60])) < 0.05


def test_a_bar_alive_at_epsilon_dies_there():
    found = CircularCoordinates(max_epsilon=0.9).fit(circle(40))
    assert found.persistence_[0, 1] == pytest.approx(0.9)


def test_a_stride_gives_every_row_a_coordinate():
    points = circle(240, laps=2)
    full = CircularCoordinates().fit_transform(points)
    strided = CircularCoordinates(stride=4).fit_transform(points)
    assert strided.shape == (240,)
    assert apart(strided, full) < 0.01


def test_transform_finds_coordinates_of_new_points():
    found = CircularCoordinates().fit(circle(100))
    half_way = circle(100) @ np.array([[1, 0.01], [-0.01, 1]])
    assert apart(found.transform(half_way), found.coordinates_) < 0.01


def test_joining_neighbours_closes_gaps_in_time():
    points = circle(60)
    points = np.delete(points, np.arange(5, 12), axis=0)
    plain = CircularCoordinates().fit(points).persistence_[0, 0]
    joined = CircularCoordinates(join_neighbours=True).fit(points).persistence_[0, 0]
    assert joined < plain


def test_a_walk_has_one_clear_loop(synthetic_walk):
    cloud = principal_axes(pose_cloud(synthetic_walk), 8)
    found = CircularCoordinates(stride=8).fit(delay_embedding(cloud, 2, 15))
    lengths = found.persistence_[:, 1] - found.persistence_[:, 0]
    assert lengths[0] > 5 * lengths[1:].max(initial=0)


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"prime": 2}, "odd prime"),
        ({"prime": 15}, "odd prime"),
        ({"prime": 1}, "odd prime"),
        ({"max_epsilon": 0.0}, "max_epsilon"),
        ({"max_epsilon": np.nan}, "max_epsilon"),
        ({"rank": -1}, "rank"),
        ({"stride": 0}, "stride"),
    ],
)
def test_bad_settings(settings, text):
    with pytest.raises(CycleError, match=text):
        CircularCoordinates(**settings)


@pytest.mark.parametrize(
    ("points", "settings", "text"),
    [
        (circle(3), {}, "points at least"),
        (np.ones((30, 2)), {}, "all the same"),
        (circle(60), {"max_epsilon": 0.05}, "loop of rank 0"),  # too small: nothing is joined
        (circle(60), {"rank": 7}, "loop of rank 7"),
        (np.column_stack([np.arange(30.0), np.zeros(30)]), {}, "loop of rank 0"),
    ],
)
def test_clouds_without_a_loop(points, settings, text):
    with pytest.raises(CycleError, match=text):
        CircularCoordinates(**settings).fit(points)


def test_a_large_epsilon_is_no_harm():
    x = CircularCoordinates(max_epsilon=1e6).fit_transform(circle(60))
    assert apart(x, np.arange(60) / 60) < 1e-3


def test_a_thousand_points_are_taken_and_of_more_some(monkeypatch):
    from mocapdb.cycles.phase import cohomology

    def computed(distances, *_):
        raise RuntimeError(f"computed with {len(distances)}")

    monkeypatch.setattr(cohomology, "_persistent_cocycles", computed)
    with pytest.raises(RuntimeError, match="with 950"):
        CircularCoordinates().fit(circle(950))
    with pytest.raises(RuntimeError, match="with 400"):
        CircularCoordinates().fit(circle(1050))


def test_integers_are_tried_at_six_distances():
    points = circle(12)
    distances = np.linalg.norm(points[:, None] - points, axis=-1).astype(np.float32)
    cut = np.array([[11, 0, 1], [10, 0, 1], [11, 1, 1]])
    _, threshold = lift_cocycle(cut, distances, 0.53, 2.5, 47)
    tried = 2.5 - (2.5 - 0.53) / 6 * np.arange(6)
    assert threshold == pytest.approx(tried[4])  # the first without triangles over the cut


def test_distances_are_those_of_scipy():
    from scipy.spatial.distance import pdist, squareform

    points = np.random.default_rng(0).normal(size=(40, 48))
    np.testing.assert_allclose(_distances(points), squareform(pdist(points)), rtol=1e-7)


def test_classes_are_those_of_ripser():
    from ripser import ripser

    angles = np.linspace(0.0, 4 * np.pi, 40)
    points = np.column_stack([np.cos(angles), np.sin(angles), 0.1 * angles])
    distances = _distances(points + 0.1 * np.random.default_rng(0).normal(size=points.shape))
    limit = float(distances.max(axis=1).min())
    expected = ripser(
        distances, distance_matrix=True, maxdim=1, thresh=limit, coeff=47, do_cocycles=True
    )
    order = np.argsort(expected["dgms"][1] @ [1.0, -1.0], kind="stable")
    bars, cocycles = _persistent_cocycles(distances, limit, 47)
    np.testing.assert_array_equal(bars, np.minimum(expected["dgms"][1][order], np.float32(limit)))
    for cocycle, i in zip(cocycles, order, strict=True):
        np.testing.assert_array_equal(cocycle, expected["cocycles"][1][i])
