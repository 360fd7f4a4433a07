"""Clips that classes were learned from: how far they are, and that the order in time counts."""

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.indexing import ClassIndex, canonical_motion, tuning
from mocapdb.indexing.canonical.canonical_motion import CanonicalMotion
from mocapdb.indexing.recognition.examples import ClipShapes, Examples
from mocapdb.indexing.search.features import FeatureSpace


def motion_of(kind, person, duration_s=2.0):
    skeleton = synthetic.subject(person)
    return canonical_motion(
        synthetic.make_clip(kind, seed=person, skeleton=skeleton, duration_s=duration_s, fps=60.0)
    )


def joined(*parts):
    """Return motions one after the other."""
    arrays = (np.concatenate([getattr(part, name) for part in parts])
              for name in ("pose", "root", "yaw"))  # fmt: skip
    return CanonicalMotion(*arrays, parts[0].fps)


def in_order(kinds, person):
    return joined(*(motion_of(kind, person) for kind in kinds))


ORDERS = {"down first": ("squat", "wave"), "hand first": ("wave", "squat")}


@pytest.fixture(scope="module")
def ordered():
    """Two classes of the same frames in another order, by four people."""
    who = [(label, person) for label in ORDERS for person in range(4)]
    motions = [in_order(ORDERS[label], person) for label, person in who]
    return motions, [label for label, _ in who], [str(person) for _, person in who]


@pytest.fixture(scope="module")
def examples(ordered):
    motions, labels, people = ordered
    space = FeatureSpace.fit(motions)
    classes = np.unique(labels, return_inverse=True)[1]
    shapes = ClipShapes.of(motions, space)
    rows = np.arange(len(motions))
    return Examples.fit(shapes, classes, np.array(people), rows), space, classes


@pytest.mark.parametrize("label", list(ORDERS))
def test_the_order_in_time_decides_between_classes_of_the_same_frames(ordered, label):
    motions, labels, people = ordered
    classes = ClassIndex().fit(motions, labels, groups=people)
    answer = classes.classify(in_order(ORDERS[label], 20))
    assert answer.ranking[0].label == label
    densities = [score.log_density for score in answer.ranking]
    assert abs(densities[0] - densities[1]) < tuning.ALIKE_NATS  # the frames leave it open
    assert not answer.rejected


def test_an_order_that_was_never_learned_is_further(ordered, examples):
    """Each clip is nearer to all that go in its order than to any that does not."""
    known, space, classes = examples
    shapes = ClipShapes.of([in_order(ORDERS[label], 20) for label in ORDERS], space)
    distances = known.distances(shapes)
    for row, label in enumerate(ORDERS):
        own = classes == sorted(ORDERS).index(label)
        assert distances[row, own].max() < distances[row, ~own].min()


def test_a_clip_is_no_way_from_itself(examples):
    known, _, _ = examples
    distances = known.distances(known.shapes)
    np.testing.assert_allclose(np.diag(distances), 0, atol=0.05)
    rows = np.arange(len(known.shapes))
    warped = known.warped_distances(known.shapes[rows[:1]], rows)
    assert warped[0] == pytest.approx(0, abs=0.05)
    assert warped.argmin() == 0
    assert known.usual.min() > 0


def test_spreads_between_people_weigh_what_varies_among_them_less():
    """Along the first axis people of a class differ by ten, along the others by one."""
    rng = np.random.default_rng(0)
    signatures = rng.normal(0, 1, (400, 4)).astype(np.float32)
    signatures[:, 0] *= 10
    shapes = ClipShapes(signatures, np.ones((400, 24, 2), np.float16), np.ones((400, 107)))
    classes, people = np.arange(400) % 2, np.arange(400)
    known = Examples.fit(shapes, classes, people, np.arange(400))
    scaled = np.linalg.norm(known.whitening, axis=1)
    assert scaled[0] < 0.5 * scaled[1:].min()


def test_left_out_distances_are_those_by_others(ordered, examples):
    _, labels, people = ordered
    known, _, classes = examples
    rows = np.array([0, 5])
    found = Examples.left_out_distances(known.shapes, classes, np.array(people), rows)
    same = np.array(people)[rows, None] == np.array(people)
    assert np.isinf(found[same]).all()
    assert np.isfinite(found[~same]).all()
    alone = Examples.left_out_distances(known.shapes, classes, np.zeros(len(labels), int), rows)
    assert np.isinf(alone).all()


def test_the_tables_numbers():
    assert (tuning.EXAMPLE_FRAMES, tuning.EXAMPLE_AXES, tuning.ALIKE_EXAMPLES) == (24, 16, 16)
    assert (tuning.EXAMPLE_COURSE, tuning.OWN_SPREAD, tuning.ALIKE_NATS) == (2.0, 0.5, 2.0)
    assert tuning.LEFT_OUT_PARTS == 10
