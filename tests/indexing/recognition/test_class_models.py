import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError
from mocapdb.indexing import ClassIndex, canonical_motion, tuning
from mocapdb.indexing.canonical.canonical_motion import CanonicalMotion
from mocapdb.indexing.recognition.class_models import NONE
from mocapdb.motion.frame_range import FrameRange

LEARNED = ("walk", "run", "hop", "squat")


def motion_of(kind, person):
    skeleton = synthetic.subject(person)
    clip = synthetic.make_clip(kind, seed=person, skeleton=skeleton, duration_s=4)
    return canonical_motion(clip)


@pytest.fixture(scope="module")
def learned():
    who = [(kind, person) for kind in LEARNED for person in range(4)]
    motions = [motion_of(*each) for each in who]
    return motions, [kind for kind, _ in who], [str(person) for _, person in who]


@pytest.fixture(scope="module")
def classes(learned):
    motions, labels, groups = learned
    return ClassIndex().fit(motions, labels, groups=groups)


@pytest.mark.parametrize("kind", LEARNED)
@pytest.mark.parametrize("person", [20, 21])
def test_someone_else_is_recognised(classes, kind, person):
    answer = classes.classify(motion_of(kind, person))
    best = answer.ranking[0]
    assert (best.label, answer.label) == (kind, kind)
    assert best.posterior > 0.9
    assert best.share > 0.5
    assert sum(score.posterior for score in answer.ranking) == pytest.approx(1)
    assert sum(score.share for score in answer.ranking) == pytest.approx(1)


@pytest.mark.parametrize("kind", ["box", "wave"])
def test_what_was_never_learned_is_rejected(classes, kind):
    answer = classes.classify(motion_of(kind, 20))
    assert answer.rejected
    assert answer.label is None


def test_stretches_that_are_no_class_are_none(classes):
    walk, box = motion_of("walk", 20), motion_of("box", 20)
    parts = [walk, box, walk]
    joined = CanonicalMotion(
        *(np.concatenate([getattr(p, name) for p in parts]) for name in ("pose", "root", "yaw")),
        walk.fps,
    )
    segments = classes.segment(joined)
    n = len(walk)
    assert (segments[0].label, segments[-1].label) == ("walk", "walk")
    none = sum(each.overlap(FrameRange(n, 2 * n)) for each in segments if each.label == NONE)
    assert none > 0.8 * n
    assert NONE not in {each.label for each in classes.segment(motion_of("run", 21))}
    assert tuning.NONE_SPREADS == 1.5


@pytest.mark.parametrize("noise", ["shared", "own", "floored"])
def test_noise(learned, noise):
    motions, labels, groups = learned
    classes = ClassIndex(noise=noise).fit(motions, labels, groups=groups)
    rhos = [model.noise_variance_ for model in classes.models]
    if noise == "shared":
        np.testing.assert_allclose(rhos, rhos[0])
    elif noise == "floored":
        np.testing.assert_allclose(rhos, 0.15**2)
    else:
        assert max(rhos) < 0.01
    right = [classes.classify(m).ranking[0].label for m in motions]
    assert right == labels


def test_segments_of_a_sequence():
    kinds = [(kind, person) for kind in synthetic.CLASSES for person in range(3)]
    classes = ClassIndex().fit([motion_of(*each) for each in kinds], [kind for kind, _ in kinds])
    for seed in (5, 8):
        clip, truth = synthetic.make("sequence", seed=seed, skeleton=synthetic.subject(seed))
        motion = canonical_motion(clip)
        segments = classes.segment(motion)
        assert (segments[0].start, segments[-1].end) == (0, len(motion))
        said = np.concatenate([[s.label] * (s.end - s.start) for s in segments])
        labels = np.array([s.label for s in truth.segments])
        ends = np.array([s.end for s in truth.segments])
        frames = np.minimum(np.arange(len(motion)) * 5, ends[-1] - 1)
        expected = labels[np.searchsorted(ends, frames, side="right")]
        assert (said == expected).mean() > 0.9


def test_assign_labels_what_it_knows_and_opens_a_class_for_the_rest(learned):
    motions, labels, groups = learned
    more = [(kind, person) for kind in ("walk", "squat", "box", "box") for person in (30, 31)]
    everything = motions + [motion_of(*each) for each in more]
    found = ClassIndex().assign(
        everything, [*labels, *[None] * len(more)],
        groups=[*groups, *(str(person) for _, person in more)],
    )  # fmt: skip
    assert found[: len(labels)] == labels
    answers = dict(zip(more, found[len(labels) :], strict=True))
    assert answers["walk", 30] == answers["walk", 31] == "walk"
    assert answers["squat", 30] == answers["squat", 31] == "squat"
    assert answers["box", 30] == answers["box", 31]
    assert answers["box", 30].startswith("new")


def test_arrays_hold_all_that_was_learned(classes):
    again = ClassIndex.from_arrays(classes.labels, classes.settings(), classes.to_arrays())
    motion = motion_of("run", 40)
    found, expected = again.classify(motion), classes.classify(motion)
    assert found.novelty == pytest.approx(expected.novelty, rel=1e-4)
    for ours, theirs in zip(found.ranking, expected.ranking, strict=True):
        assert (ours.label, ours.share) == (theirs.label, theirs.share)
        assert ours.log_density == pytest.approx(theirs.log_density, rel=1e-4)
    empty = ClassIndex.from_arrays([], ClassIndex().settings(), ClassIndex().to_arrays())
    assert empty.labels == ()


def test_nothing_to_learn_or_to_ask(learned):
    motions, labels, _ = learned
    with pytest.raises(ClipError, match="one at least"):
        ClassIndex().fit([], [])
    with pytest.raises(ClipError, match="as many labels as clips"):
        ClassIndex().fit(motions, labels[1:])
    with pytest.raises(ClipError, match="Call fit first"):
        ClassIndex().classify(motions[0])
    with pytest.raises(ClipError, match="'floored', 'shared' or 'own'"):
        ClassIndex(noise="loud")
    one = ClassIndex().fit(motions[:1], labels[:1])
    assert one.classify(motions[0]).ranking[0].label == "walk"
