"""The fast search gives what a plain one gives, and refuses what makes no sense."""

from dataclasses import replace

import naive
import numpy as np
import pytest

from mocapdb.cleaning.local_rotations import Texture, motion_texture
from mocapdb.cleaning.neighbours import _word_warping as warping
from mocapdb.cleaning.neighbours.nearest_words import Vocabulary, find_neighbours
from mocapdb.cleaning.tuning import SOURCE_FRAMES, TARGET_FRAMES
from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError, SkeletonError
from mocapdb.motion.quaternions import from_rotation_vectors_deg, multiply


def wandering_texture(skeleton, n_frames, seed, fps=24.0):
    """A texture whose joints wander, so that no two words are alike."""
    rng = np.random.default_rng(seed)
    joints = np.flatnonzero([bool(order) for order in skeleton.rotation_orders])
    quats = np.cumsum(0.15 * rng.standard_normal((n_frames, len(joints), 4)), axis=0)
    quats += rng.standard_normal((len(joints), 4))
    quats /= np.linalg.norm(quats, axis=-1, keepdims=True)
    return Texture(skeleton, joints, quats, fps, f"wandering {seed}")


@pytest.fixture(scope="module")
def walk_texture():
    return motion_texture(synthetic.make_clip("walk", seed=3, duration_s=4, tempo_drift=0.2))


def test_frame_distances_are_those_of_equation_1():
    rng = np.random.default_rng(0)
    quats = rng.standard_normal((30, 9, 4))
    quats /= np.linalg.norm(quats, axis=-1, keepdims=True)
    for n_drop in range(4):
        out = np.empty(30, dtype=np.int32)
        warping.frame_distances(
            np.ascontiguousarray(np.moveaxis(quats, 0, 2).astype(np.float32)),
            quats[4].astype(np.float32),
            np.arange(9),
            n_drop,
            0,
            out,
            np.empty((5, warping.TILE), dtype=np.float32),
        )
        expected = [naive.naive_frame_distance(quats[4], other, n_drop) for other in quats]
        np.testing.assert_allclose(out * warping.UNIT, expected, rtol=2e-3, atol=2e-4)


@pytest.mark.parametrize("width", [1, 2, 3, 4, 7, 12, 16, 20])
def test_window_minima(width):
    row = np.random.default_rng(width).integers(0, 1000, 50).astype(np.int32)
    out = np.empty_like(row)
    warping.window_minima(row, width, out, np.empty_like(row))
    np.testing.assert_array_equal(out, [row[s : s + width].min() for s in range(50)])


def test_warping_and_its_bound_equal_the_naive_twin():
    rng = np.random.default_rng(1)
    for trial in range(6):
        context = rng.integers(1, 5000, (SOURCE_FRAMES, 80)).astype(np.int32)
        if trial % 2:  # smooth ones have longer runs
            context = np.maximum.accumulate(context // 10, axis=1)
        state = np.empty((2, (TARGET_FRAMES + 1) * warping.CELL), dtype=np.int32)
        out = np.empty(warping.LANES, dtype=np.float32)
        warping.align(context, 7, TARGET_FRAMES, state, out)
        minima = np.empty_like(context)
        for i, row in enumerate(context):
            reach = min(TARGET_FRAMES, 4 * (i + 1))
            warping.window_minima(row, reach, minima[i], np.empty_like(row))
        bounds = np.empty(80, dtype=np.float32)
        warping.bound_words(minima, TARGET_FRAMES, bounds)
        for lane in range(warping.LANES):
            pair = context[:, 7 + lane : 7 + lane + TARGET_FRAMES]
            expected = naive.naive_word_distance(pair)
            assert out[lane] == pytest.approx(expected, rel=1e-6)
            assert bounds[7 + lane] <= expected * (1 + 1e-6)


def test_backtracking_finds_a_path_of_that_mean():
    rng = np.random.default_rng(2)
    for _ in range(10):
        pair = rng.integers(1, 2000, (SOURCE_FRAMES, TARGET_FRAMES)).astype(np.int32)
        matched = np.empty(SOURCE_FRAMES)
        work = np.empty((SOURCE_FRAMES, TARGET_FRAMES, 7), dtype=np.int64)
        n_matched = warping.backtrack(pair, SOURCE_FRAMES, TARGET_FRAMES, matched, work)
        assert 11 <= n_matched <= SOURCE_FRAMES
        assert np.all(np.diff(matched) >= 0)
        assert matched[0] >= 0


@pytest.mark.parametrize("seed", range(4))
def test_neighbours_equal_brute_force(seed):
    skeleton = synthetic.make_skeleton()
    source = wandering_texture(skeleton, 40, seed)
    check_against_brute_force(source, [source, wandering_texture(skeleton, 50, seed + 10)], seed)


def test_neighbours_of_a_walk_equal_brute_force(walk_texture):
    check_against_brute_force(walk_texture, [walk_texture], 0)


def check_against_brute_force(source, context, seed):
    rows, k, n_drop = np.arange(seed % 3, 20), 5, seed % 4
    found = find_neighbours(source, context, rows=rows, n_drop=n_drop, k=k)
    quats = np.concatenate([texture.quat_xyzw for texture in context]).astype(np.float32)
    columns = np.ascontiguousarray(np.moveaxis(quats, 0, 2))
    for w in range(0, len(found.starts), 4):
        start = int(found.starts[w])
        distances = np.empty((SOURCE_FRAMES, len(quats)), dtype=np.int32)
        work = np.empty((5, warping.TILE), dtype=np.float32)
        for i in range(SOURCE_FRAMES):
            frame = source.quat_xyzw[start + i].astype(np.float32)
            warping.frame_distances(columns, frame, rows, n_drop, 0, distances[i], work)
        minima, first = [], 0
        for texture in context:  # minima are looked for within each clip
            n = len(texture) - TARGET_FRAMES + 1
            values = [
                np.float32(naive.naive_word_distance(distances[:, first + t : first + t + 20]))
                for t in range(n)
            ]
            own = start if texture is source else -(10**6)
            minima += [
                (value, first + t) for t, value in naive.naive_minima(values, own, len(values))
            ]
            first += len(texture)
        expected = sorted(minima)[:k]
        kept = found.targets[w] >= 0
        assert found.targets[w][kept].tolist() == [t for _, t in expected]
        np.testing.assert_allclose(
            found.distances[w][kept], [value * warping.UNIT for value, _ in expected], rtol=1e-5
        )


def test_a_walk_finds_itself_a_lap_later(walk_texture):
    found = find_neighbours(walk_texture, [walk_texture])
    for starts, targets in zip(found.starts, found.targets, strict=True):
        assert np.all(np.abs(targets[targets >= 0] + 10 - (starts + 7.5)) >= 7.5)
    assert np.median(found.distances[:, 0]) < 0.2
    assert np.nanmax(found.frames) < len(walk_texture)


def test_fewer_minima_than_k_leave_places_empty():
    texture = wandering_texture(synthetic.make_skeleton(), 30, 5)
    found = find_neighbours(texture, [texture], k=50)
    assert (found.targets[:, -1] == -1).all()
    assert np.isinf(found.distances[:, -1]).all()


def test_bad_arguments_are_refused(walk_texture):
    short = wandering_texture(walk_texture.skeleton, 14, 0)
    with pytest.raises(ClipError, match="word of 15 frames"):
        find_neighbours(short, [walk_texture])
    with pytest.raises(ClipError, match="context with a clip of 20 frames"):
        find_neighbours(walk_texture, [short])
    with pytest.raises(ClipError, match="24 Hz"):
        find_neighbours(walk_texture, [wandering_texture(walk_texture.skeleton, 60, 0, fps=30.0)])
    with pytest.raises(ClipError, match="n_drop from 0 to 3"):
        find_neighbours(walk_texture, [walk_texture], n_drop=4)
    with pytest.raises(ClipError, match="at least 1"):
        find_neighbours(walk_texture, [walk_texture], k=0)
    other = Texture(
        walk_texture.skeleton, walk_texture.joints[1:], walk_texture.quat_xyzw[:, 1:], 24.0, "other"
    )
    with pytest.raises(SkeletonError, match="'other' has others"):
        find_neighbours(walk_texture, [other])


# -- vocabularies ------------------------------------------------------------------------------


def test_candidates_find_nearly_what_the_exact_search_finds(walk_texture):
    others = [
        motion_texture(synthetic.make_clip(kind, seed=seed, duration_s=8, phase_noise=0.3))
        for seed, kind in enumerate(["walk", "run", "hop", "box", "wave", "walk"])
    ]
    vocabulary = Vocabulary.of(others)
    exact = find_neighbours(walk_texture, vocabulary)
    some = find_neighbours(walk_texture, vocabulary, n_candidates=12)
    pairs = zip(exact.targets, some.targets, strict=True)
    assert np.mean([len(set(a) & set(b)) / len(a) for a, b in pairs]) > 0.95
    everything = find_neighbours(walk_texture, vocabulary, n_candidates=10**6)
    np.testing.assert_array_equal(everything.targets, exact.targets)
    np.testing.assert_allclose(everything.distances, exact.distances)
    np.testing.assert_allclose(everything.frames, exact.frames)


def test_what_is_found_in_two_contexts_is_what_is_found_in_both_together(walk_texture):
    other = motion_texture(synthetic.make_clip("walk", seed=8, duration_s=5, tempo_drift=0.2))
    together = find_neighbours(walk_texture, [walk_texture, other])
    apart = find_neighbours(walk_texture, [walk_texture]).merged(
        find_neighbours(walk_texture, [other]), len(walk_texture)
    )
    np.testing.assert_array_equal(apart.targets, together.targets)
    np.testing.assert_allclose(apart.frames, together.frames)
    np.testing.assert_array_equal(apart.words, together.words)


def test_a_copy_is_no_context(walk_texture):
    other = motion_texture(synthetic.make_clip("walk", seed=8, duration_s=4, tempo_drift=0.2))
    coded = Texture(
        walk_texture.skeleton, walk_texture.joints, np.round(walk_texture.quat_xyzw, 3), 24.0, "c"
    )
    (vocabulary,) = Vocabulary.families([coded, other]).values()
    without = vocabulary.without_copies(walk_texture)
    assert without.shown == [other.name]
    found = find_neighbours(walk_texture, without)
    assert (found.targets[found.targets >= 0] >= len(coded)).all()
    assert vocabulary.without_copies(other).shown == ["c"]


def test_more_neighbours_than_there_are_leave_places_empty(walk_texture):
    found = find_neighbours(walk_texture, [walk_texture], k=40)
    assert (found.targets[:, -1] == -1).all()
    assert np.isnan(found.words[:, -1]).all()
    assert np.isinf(found.distances[:, -1]).all()


def test_vocabularies_that_make_no_sense_are_refused(walk_texture):
    with pytest.raises(ClipError, match="a clip at least"):
        Vocabulary.of([])
    with pytest.raises(ClipError, match="a candidate at least"):
        find_neighbours(walk_texture, [walk_texture], n_candidates=0)
    slow = Texture(walk_texture.skeleton, walk_texture.joints, walk_texture.quat_xyzw, 12.0, "slow")
    with pytest.raises(ClipError, match="at 24 Hz"):
        find_neighbours(walk_texture, Vocabulary.of([slow]))


@pytest.mark.parametrize(("degrees", "n_frames", "n_shown"), [
    (4.5, 400, 0), (5.5, 400, 1), (90.0, 4, 0), (90.0, 5, 1),
])  # fmt: skip
def test_a_copy_is_within_5_degrees_in_99_frames_of_100(degrees, n_frames, n_shown):
    texture = wandering_texture(synthetic.make_skeleton(), 400, 1)
    turns = np.zeros((400, 1, 3))
    turns[:n_frames] = [degrees, 0.0, 0.0]
    turned = multiply(texture.quat_xyzw, from_rotation_vectors_deg(turns))
    other = replace(texture, quat_xyzw=turned, name="other")
    assert len(Vocabulary.of([other]).without_copies(texture).shown) == n_shown
