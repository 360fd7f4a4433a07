"""The figures of search and recognition on synthetic motion, and the limits that it never meets.

A tuned number that changes shows here, without any real clip. The figures are this method's own,
written down: they say that nothing moved, not that they are right, which the other tests do.
"""

from unittest import mock

import numpy as np
import pytest

from mocapdb.base.thread_pool import ThreadPool
from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError
from mocapdb.indexing import ClassIndex, MotionIndex, Query, canonical_motion, search_clips
from mocapdb.indexing.canonical.canonical_motion import CanonicalMotion
from mocapdb.indexing.recognition import class_models
from mocapdb.indexing.search import stretch_search
from mocapdb.indexing.search.clip_search import whole_distances
from mocapdb.indexing.search.example_query import Template
from mocapdb.indexing.search.features import N_FEATURES, FeatureSpace, Weights
from mocapdb.indexing.search.frame_store import Frames, index_of
from mocapdb.indexing.search.span_scan import measured
from mocapdb.indexing.search.stretch_search import search

PEOPLE = 3
LEARNED = ("walk", "run", "hop", "squat")


def motion_of(kind, person, duration_s=4.0):
    clip = synthetic.make_clip(
        kind, seed=person, skeleton=synthetic.subject(person), duration_s=duration_s, fps=60.0
    )
    return canonical_motion(clip)


def example(kind):
    clip = synthetic.make_clip(
        kind, seed=9, skeleton=synthetic.subject(9), duration_s=4.0, fps=60.0
    )
    return canonical_motion(clip[60:150])


def close(value, rel=1e-3):
    return pytest.approx(value, rel=rel)


@pytest.fixture(scope="module")
def clips():
    return [(kind, person) for person in range(PEOPLE) for kind in synthetic.CLASSES]


@pytest.fixture(scope="module")
def index(clips):
    return MotionIndex.of([motion_of(*each) for each in clips])


@pytest.fixture(scope="module")
def classes():
    who = [(kind, person) for kind in LEARNED for person in range(4)]
    return ClassIndex().fit(
        [motion_of(*each) for each in who],
        [kind for kind, _ in who],
        groups=[str(person) for _, person in who],
    )


@pytest.fixture(scope="module")
def many():
    """600 short clips of noise, 48,000 frames in all."""
    rng = np.random.default_rng(3)
    space = FeatureSpace(Weights(), np.zeros(N_FEATURES), np.eye(N_FEATURES)[:, :32], np.ones(32))
    return index_of(space, [rng.normal(size=(80, 32)).astype(np.float32) for _ in range(600)])


class TestStoredFrames:
    def test_how_many_there_are_and_along_how_many_axes(self, index):
        assert index.frames.codes.shape == (PEOPLE * 6 * 96, 32)
        assert index.sketch.codes.shape == (PEOPLE * 6 * 32, 16)
        assert index.outline.codes.shape == (PEOPLE * 6 * 16, 8)

    def test_a_step_is_a_sixteenth_of_a_deviation(self, index):
        np.testing.assert_allclose(16 * index.frames.steps, index.space.deviations, rtol=1e-5)


class TestHits:
    def test_of_other_people(self, index, clips):
        hits = search(index, Query([example("walk")]), k=12)
        assert [(*clips[hit.clip], hit.start, hit.end) for hit in hits[-4:]] == [
            ("walk", 2, 66, 96), ("walk", 2, 0, 28), ("run", 1, 37, 62), ("run", 2, 64, 90),
        ]  # fmt: skip
        distances = [hit.distance for hit in hits]
        assert distances == close(
            [0.06252, 0.06618, 0.07858, 0.07968, 0.08265, 0.08585, 0.08974, 0.14659, 0.23933,
             0.30215, 0.31964, 0.32001]
        )  # fmt: skip

    def test_at_another_speed(self, index, clips):
        hits = search(index, Query([example("squat").resampled(24.0, 0.6)]), k=6)
        assert [hit.template for hit in hits] == [1, 1, 0, 1, 1, 1]  # 1 is the double speed
        distances = [hit.distance for hit in hits]
        assert distances == close([0.0797, 0.09435, 0.10319, 0.11429, 0.33913, 0.71457])

    def test_overlap_by_half_at_most(self, index, clips):
        hits = search(index, Query([example("wave")]), k=12)
        assert [(*clips[hit.clip], hit.start, hit.end) for hit in hits[-3:]] == [
            ("wave", 1, 67, 96), ("wave", 2, 0, 24), ("wave", 0, 0, 25),
        ]  # fmt: skip

    @pytest.mark.parametrize(
        ("kind", "distances"),
        [
            ("run", [0.15486, 0.15989, 0.18423, 0.46991]),
            ("box", [0.11313, 0.13828, 0.17336, 0.91122]),
        ],
    )
    def test_of_whole_clips(self, index, kind, distances):
        hits = search_clips(index, Query([motion_of(kind, 9, 3.0)]), k=4)
        assert [hit.distance for hit in hits] == close(distances)


class TestLimitsOfASearch:
    def test_a_query_has_seven_frames(self):
        motion = motion_of("walk", 1)
        first = [getattr(motion, name) for name in ("pose", "root", "yaw")]
        assert Query([CanonicalMotion(*(values[:7] for values in first), 24.0)])
        with pytest.raises(ClipError, match=r"0\.3 s or more"):
            Query([CanonicalMotion(*(values[:6] for values in first), 24.0)])

    def test_a_rough_search_looks_around_the_nearest_places(self, many):
        rng = np.random.default_rng(4)
        template = Template(rng.normal(size=(30, 32)).astype(np.float32), 30)
        numbers = []

        def counted(*args, **options):
            found = real(*args, **options)
            numbers.append([len(rows) for rows, _ in found])
            return found

        real = stretch_search.minima
        everything = np.ones(len(many), dtype=bool)
        pool = ThreadPool.shared(1)
        searching = stretch_search._Search(many, [template], everything, False, pool)
        with mock.patch.object(stretch_search, "minima", counted):
            searching._candidates()
        assert numbers == [[1000], [120]]

    @pytest.mark.parametrize(("n_frames", "exact"), [(3_000_000, True), (3_000_001, False)])
    def test_from_three_million_frames_on_a_search_is_rough(self, n_frames, exact):
        frames = Frames(np.zeros((1, 4), np.int8), np.ones(4, np.float32), np.array([0, n_frames]))
        asked = []

        def search_of(index, templates, clips, exact, pool):
            asked.append(exact)
            return mock.Mock()

        index = mock.MagicMock(frames=mock.MagicMock(wraps=frames))
        index.frames.__len__.return_value = n_frames
        query = mock.Mock()
        query.templates.return_value = [mock.Mock(reference=1.0)]
        with (
            mock.patch.object(stretch_search, "measured", lambda index, template: template),
            mock.patch.object(stretch_search, "_Search", search_of),
        ):
            search(index, query)
        assert asked == [exact]

    def test_a_random_stretch_is_the_median_over_eighty_seconds(self, many):
        """80 ranges of 24 frames, evenly over the index."""
        template = Template(many.frames.values(slice(100, 120)), 20)
        spans = []

        def recorded(frames, template, asked):
            spans.append(asked)
            return np.ones(3, dtype=np.float32)

        with mock.patch("mocapdb.indexing.search.span_scan.distances", recorded):
            measured(many, template)
        (asked,) = spans
        assert len(asked) == 80
        assert np.unique(np.diff(asked, axis=1)) == [24]
        assert asked[0, 0] == 0
        assert asked[-1, 1] == len(many.frames)

    def test_of_many_clips_five_hundred_are_compared(self, many):
        everything = np.ones(len(many), dtype=bool)
        motion = motion_of("walk", 1)
        assert np.isfinite(whole_distances(many, motion, everything)).sum() == 500
        every = whole_distances(many, motion, everything, exact=True)
        assert np.isfinite(every).sum() == 600


class TestClasses:
    def test_what_is_learned(self, classes):
        assert [len(model.components_) for model in classes.models] == [6, 7, 3, 6]
        assert [model.noise_variance_ for model in classes.models] == close([0.15**2] * 4)
        scales = [3.557195, 1.670694, 100.60289, 3.573589, 2.459901]
        assert classes.scales.tolist() == close(scales)
        stricter = [1.107063, 0.929942, 1.101359, 0.953205]
        assert classes.class_strictness.tolist() == close(stricter)

    @pytest.mark.parametrize(
        ("kind", "novelty", "log_density"),
        [("walk", 0.0, 99.78056), ("box", 3.207588, 91.26042), ("wave", 4.450643, 81.57625)],
    )
    def test_what_a_clip_is(self, classes, kind, novelty, log_density):
        answer = classes.classify(motion_of(kind, 20))
        assert answer.novelty == close(novelty)
        assert answer.ranking[0].log_density == close(log_density, rel=1e-4)
        assert answer.rejected == (novelty > 1)

    def test_the_middle_four_fifths_and_the_last_fiftieth(self):
        """Spread and cut of the distances 0, 1, .. 1000 of clips known as well as they can be."""
        assert class_models._middle(np.arange(1001.0)) == (500.0, 800.0)
        classes = ClassIndex()
        classes.labels = tuple(f"class {i}" for i in range(1001))
        classes.example_class = np.repeat(np.arange(1001), 2)
        distances = np.full((1001, 2002), 1e6)
        distances[np.arange(1001), np.arange(1, 2002, 2)] = np.arange(1001.0)
        rows = np.arange(0, 2002, 2)
        with mock.patch.object(class_models, "CLASS_POWER", 0.0):
            classes._calibrate(rows, np.zeros(1001), distances, distances)
        assert classes.scales[:2].tolist() == close([500.0, 800.0])
        one_more = 1000 * 0.98 * 1002 / 1001
        assert classes.scales[4] == close((one_more - 500) / 800, rel=1e-6)

    def test_a_class_lasts_unless_another_is_likelier_by_sixty_nats(self, classes):
        """For ten frames another class is likelier; to go there and back takes 120 nats."""
        for gain, n_segments in ((11.0, 1), (13.0, 3)):
            densities = np.full((50, len(classes.models)), -20.0)
            densities[:, 0] = 0.0
            densities[20:30, 1] = gain
            known = np.array([0.0, 1.0, -1e3, 1.0, 1.0])  # so that nothing is none of the classes
            with (
                mock.patch.object(classes, "log_densities", return_value=densities),
                mock.patch.object(classes, "scales", known),
            ):
                assert len(classes.segment(None)) == n_segments

    def test_a_thousand_clips_say_where_to_cut(self):
        frame = motion_of("walk", 1)
        arrays = (frame.pose[:2], frame.root[:2], frame.yaw[:2])
        motions = [CanonicalMotion(*arrays, 24.0)] * 1100
        classes, asked = ClassIndex(), []

        def log_densities(motion):
            asked.append(motion)
            return np.zeros(1)

        with mock.patch.object(classes, "_log_densities", log_densities):
            classes.fit(motions, ["walk"] * 1100)
        assert len(asked) == 1000

    def test_what_never_settles_is_given_up_after_twenty_rounds(self):
        motions = [motion_of("walk", person, 1.0) for person in (1, 2)]
        rounds = []

        class Restless(ClassIndex):
            def fit(self, *args, **options):
                rounds.append(1)
                return super().fit(*args, **options)

            def _classified(self, motion, known):
                return mock.Mock(label=("walk", "run")[len(rounds) % 2])

        Restless().assign(motions, ["walk", None])
        assert len(rounds) == 20
