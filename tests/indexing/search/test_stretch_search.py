"""Queries over synthetic motion whose truth is known."""

from unittest import mock

import hypothesis
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from naive import naive_hits, naive_stretches

from mocapdb.base.thread_pool import ThreadPool
from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError
from mocapdb.indexing import (
    MotionIndex,
    Query,
    Weights,
    canonical_motion,
    search_clips,
)
from mocapdb.indexing.search import stretch_search as search_module
from mocapdb.indexing.search.example_query import Template
from mocapdb.indexing.search.features import N_FEATURES, FeatureSpace, frame_features
from mocapdb.indexing.search.frame_store import index_of
from mocapdb.indexing.search.stretch_search import _Search, search

CLASSES = synthetic.CLASSES
PEOPLE = 3


@pytest.fixture(scope="module")
def motions():
    """Clips of every class by three people, and what they are."""
    found = []
    for person in range(PEOPLE):
        skeleton = synthetic.subject(person)
        for number, kind in enumerate(CLASSES):
            clip = synthetic.make_clip(
                kind, seed=10 * person + number, skeleton=skeleton, duration_s=4,
                heading_deg=50.0 * person,
            )  # fmt: skip
            found.append((canonical_motion(clip), kind, person))
    return found


@pytest.fixture(scope="module")
def index(motions):
    return MotionIndex.of([motion for motion, _, _ in motions])


def example(kind, **options):
    clip = synthetic.make_clip(kind, seed=99, skeleton=synthetic.subject(77), **options)
    return canonical_motion(clip[120:300])


@pytest.mark.parametrize("kind", CLASSES)
@pytest.mark.parametrize("heading_deg", [0.0, 120.0])
def test_other_people_s_motion_is_found(index, motions, kind, heading_deg):
    hits = search(index, Query([example(kind, heading_deg=heading_deg)]), k=PEOPLE)
    assert {motions[hit.clip][1] for hit in hits} == {kind}
    assert hits[0].distance < 0.6


@pytest.mark.parametrize("speed", [0.6, 1.6])
def test_other_speeds_are_found(index, motions, speed):
    hits = search(index, Query([example("squat").resampled(24.0, speed)]), k=3)
    assert {motions[hit.clip][1] for hit in hits} == {"squat"}
    assert np.median([hit.time_scale for hit in hits]) == pytest.approx(speed, rel=0.35)


def test_a_clip_finds_itself_where_it_is(index, motions):
    motion = motions[1][0]
    part = type(motion)(motion.pose[20:56], motion.root[20:56], motion.yaw[20:56], motion.fps)
    (hit,) = search(index, Query([part]), k=1)
    assert (hit.clip, hit.time_scale) == (1, pytest.approx(1.0, abs=0.1))
    assert abs(hit.start - 20) <= 2
    assert abs(hit.end - 56) <= 2
    assert hit.distance < 0.1


def test_hits_are_sorted_and_do_not_overlap(index):
    hits = search(index, Query([example("walk")]), k=40)
    assert [hit.distance for hit in hits] == sorted(hit.distance for hit in hits)
    for i, a in enumerate(hits):
        for b in hits[:i]:
            if a.clip == b.clip:
                shared = min(a.end, b.end) - max(a.start, b.start)
                assert shared <= 0.5 * min(a.end - a.start, b.end - b.start)


def brute_force(index, query, k):
    """Hits (clip, start, end, distance), every stretch compared."""
    frames = index.frames
    found = []
    for template in query.templates(index.space):
        distances = np.linalg.norm(template.frames[:, None] - frames.values(slice(None)), axis=2)
        costs, starts = naive_stretches(distances, frames.starts)
        found.append((costs / np.median(costs[np.isfinite(costs)]), starts))
    hits = naive_hits(found, frames.starts, k)
    clips = [int(np.searchsorted(frames.starts, first, "right")) - 1 for first, _, _ in hits]
    return [
        (
            clip,
            first - frames.starts[clip],
            end - frames.starts[clip],
            pytest.approx(cost, abs=1e-3),
        )
        for clip, (first, end, cost) in zip(clips, hits, strict=True)
    ]


def only_warping(monkeypatch):
    """Let hits be as far away as their warping alone says, at any speed."""
    monkeypatch.setattr(search_module, "TURN_COST", 0.0)
    monkeypatch.setattr(search_module, "ANY_STRETCH", 1.0)
    monkeypatch.setattr(search_module, "course_cost", lambda first, second: 0.0)


def plain(hits):
    return [(hit.clip, hit.start, hit.end, hit.distance) for hit in hits]


@pytest.mark.parametrize("k", [1, 5, 400])
@pytest.mark.parametrize("kind", ["run", "wave"])
def test_the_exact_answer_is_that_of_brute_force(index, kind, k, monkeypatch):
    only_warping(monkeypatch)
    monkeypatch.setattr(search_module, "MOST_SPEED_RATIO", np.inf)
    query = Query([example(kind)])
    expected = brute_force(index, query, k)
    assert plain(search(index, query, k=k, exact=True)) == expected
    monkeypatch.setattr(search_module, "SKETCH_PLACES", 2)  # from which little is known beforehand
    assert plain(search(index, query, k=k, exact=True)) == expected


def test_turning_puts_the_nearest_by_warping_in_order(index):
    query = Query([example("walk")])
    warped = {(hit.clip, hit.end): hit for hit in search(index, query, k=200)}
    turned = search(index, query, k=5)
    costs = [hit.warped for hit in warped.values()]
    assert max(hit.warped for hit in turned) <= sorted(costs)[20]
    assert [hit.distance for hit in turned] == sorted(hit.distance for hit in turned)


@given(st.integers(0, 2**32 - 1), st.integers(1, 12))
@settings(max_examples=30, deadline=None)
@hypothesis.example(seed=366, k=1)
@hypothesis.example(seed=17725, k=10)
def test_limits_miss_nothing_in_any_library(seed, k):
    """Short clips of noise around a few poses, where the nearest hits overlap one another."""
    rng = np.random.default_rng(seed)
    space = FeatureSpace(Weights(), np.zeros(N_FEATURES), np.eye(N_FEATURES)[:, :32], np.ones(32))
    poses = rng.normal(size=(4, 32))
    clips = []
    for length in rng.integers(1, 40, size=rng.integers(1, 12)):
        values = poses[rng.integers(0, 4, length)] + rng.normal(0, 0.2, (length, 32))
        clips.append(values.astype(np.float32))
    index = index_of(space, clips)
    length = int(rng.integers(3, 12))
    wanted = (poses[rng.integers(0, 4, length)] + rng.normal(0, 0.2, (length, 32))).astype("f4")
    everything = np.ones(len(clips), bool)
    try:
        searching = _Search(
            index, [Template(wanted, length)], everything, True, ThreadPool.shared(2)
        )
    except ClipError:
        return
    everywhere = np.array([[0, len(index.frames)]])
    # what is looked at beside the k nearest by warping depends on the sketch
    with mock.patch.multiple(search_module, LOOKED_AT=1, LEAST_LOOKED_AT=1):
        expected = plain(searching._ranked(searching._minima([everywhere], np.inf), k)[0])
        nearer = [hit for hit in expected if hit[3] <= 0.8]
        for places in (1, 120):
            with mock.patch.object(search_module, "SKETCH_PLACES", places):
                assert plain(searching.hits(k, np.inf)) == expected
                assert plain(searching.hits(k, 0.8)) == nearer


@pytest.mark.parametrize("kind", CLASSES)
def test_a_rough_search_finds_the_nearest(index, kind):
    query = Query([example(kind)])
    exact, rough = search(index, query, exact=True), search(index, query, exact=False)
    assert plain(rough)[0] == plain(exact)[0]
    assert len(set(plain(rough)) & set(plain(exact))) >= 9


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_threads_do_not_change_the_answer(index, threads):
    query = Query([example("hop")])
    expected = [(h.clip, h.start, h.end, h.distance) for h in search(index, query, threads=1)]
    found = search(index, query, threads=threads)
    assert [(h.clip, h.start, h.end, h.distance) for h in found] == expected


def test_only_chosen_clips_are_searched_at_the_same_distances(index, motions):
    query = Query([example("walk")])
    chosen = np.array([person != 0 for _, _, person in motions])
    hits = search(index, query, clips=chosen)
    assert all(motions[hit.clip][2] != 0 for hit in hits)
    everywhere = {(h.clip, h.end): h.distance for h in search(index, query, k=100)}
    for hit in hits[:3]:
        assert everywhere[hit.clip, hit.end] == pytest.approx(hit.distance)


def test_left_and_right_are_told_apart_unless_mirrored(index):
    waving = example("wave")
    plain = search(index, Query([waving.mirrored()]), k=1)[0].distance
    mirrored = search(index, Query([waving.mirrored()], mirror=True), k=1)[0].distance
    straight = search(index, Query([waving]), k=1)[0].distance
    assert mirrored == pytest.approx(straight, rel=0.05)
    assert plain > 1.3 * mirrored


def test_several_examples_find_what_each_finds(index, motions):
    both = search(index, Query([example("squat"), example("box")]), k=6)
    assert {motions[hit.clip][1] for hit in both} == {"squat", "box"}


def test_expansion_and_thresholds(index, motions):
    query = Query([example("walk")])
    expanded = search(index, query, k=5, expand=2)
    assert {motions[hit.clip][1] for hit in expanded} == {"walk"}
    assert all(hit.distance <= 0.3 for hit in search(index, query, k=50, max_distance=0.3))
    assert search(index, query, max_distance=1e-6) == []


@pytest.mark.parametrize("kind", CLASSES)
def test_whole_clips(index, motions, kind):
    whole = canonical_motion(
        synthetic.make_clip(kind, seed=5, skeleton=synthetic.subject(50), duration_s=3)
    )
    hits = search_clips(index, Query([whole]), k=2)
    assert motions[hits[0].clip][1] == kind
    assert (hits[0].start, hits[0].end) == (0, len(motions[hits[0].clip][0]))


@pytest.mark.parametrize("expand", [0, 2])
def test_the_same_clip_is_no_distance_away_whatever_is_averaged(index, motions, expand):
    (hit,) = search_clips(index, Query([motions[0][0]]), k=1, expand=expand)
    assert hit.clip == 0
    assert hit.distance == pytest.approx(0.0, abs=0.02)


def test_a_third_of_a_second_may_be_half_a_frame_short(index, motions):
    motion = motions[0][0]
    assert search(index, Query([motion.part(slice(0, 7))]), k=1)[0].distance < 0.1
    with pytest.raises(ClipError, match=r"0\.25 s"):
        Query([motion.part(slice(0, 6))])


class TestBadQueries:
    def test_too_short(self):
        short = canonical_motion(synthetic.make_clip("walk", seed=1)[:30])
        with pytest.raises(ClipError, match=r"0\.3 s or more, but got 0\.\d+ s"):
            Query([short])

    def test_none(self):
        with pytest.raises(ClipError, match="at least one example"):
            Query([])

    def test_longer_than_the_library(self, index):
        long = canonical_motion(synthetic.make_clip("walk", seed=1, duration_s=40))
        with pytest.raises(ClipError, match="longest clip has 4"):
            search(index, Query([long]))

    @pytest.mark.parametrize("value", [-1.0, np.nan, np.inf])
    def test_weights(self, value):
        with pytest.raises(ClipError, match="travel_s to be 0 or more"):
            Weights(travel_s=value)


class TestFeatures:
    def test_velocities_are_those_of_the_world(self):
        clip = synthetic.make_clip("walk", seed=4, duration_s=4, heading_deg=65)
        values = frame_features(canonical_motion(clip))
        assert values.shape == (96, N_FEATURES)
        sideways, _, ahead = np.median(values[10:-10, -4:-1], axis=0)
        assert 0.7 < ahead < 2.0
        assert abs(sideways) < 0.2

    def test_one_frame_has_no_velocity(self):
        motion = canonical_motion(synthetic.make_clip("walk", seed=4)[:1])
        assert np.all(frame_features(motion)[0, 51:102] == 0)

    def test_the_space_keeps_distances_along_its_axes(self, motions):
        space = FeatureSpace.fit([motion for motion, _, _ in motions], dims=N_FEATURES)
        np.testing.assert_allclose(space.axes.T @ space.axes, np.eye(N_FEATURES), atol=1e-9)
        motion = motions[0][0]
        values = frame_features(motion) * space.weights.scales()
        frames = space.frames(motion)
        expected = np.linalg.norm(values[0] - values[40])
        assert np.linalg.norm(frames[0] - frames[40]) == pytest.approx(expected, rel=1e-4)
