"""Searching by some of the joints only."""

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError
from mocapdb.indexing import MotionIndex, Query, canonical_motion
from mocapdb.indexing.canonical.canonical_body import JOINTS
from mocapdb.indexing.canonical.canonical_motion import CanonicalMotion
from mocapdb.indexing.search import stretch_search
from mocapdb.indexing.search.body_parts import PARTS, index_of_part, part_joints
from mocapdb.indexing.search.features import frame_features
from mocapdb.indexing.search.stretch_search import search
from mocapdb.indexing.tuning import PART_AXES

ARM = part_joints(["right-arm"])


def motion(kind, seed):
    return canonical_motion(synthetic.make_clip(kind, seed=seed, duration_s=3))


def with_limb_of(body, other, joints, above):
    """The motion of a body with a limb of another, hung where its own is."""
    pose = body.pose.copy()
    n, top = min(len(pose), len(other.pose)), JOINTS.index(above)
    for joint in joints:
        row = JOINTS.index(joint)
        pose[:n, row] = pose[:n, top] + other.pose[:n, row] - other.pose[:n, top]
    return CanonicalMotion(pose[:n], body.root[:n], body.yaw[:n], body.fps)


@pytest.fixture(scope="module")
def motions():
    return [motion(kind, seed) for kind in ("walk", "squat", "hop") for seed in (1, 2, 3)]


@pytest.fixture(scope="module")
def index(motions):
    return MotionIndex.of(motions)


def test_an_arm_is_found_whatever_the_rest_does(motions):
    walk, squat = motions[0], motions[3]
    mixed = with_limb_of(squat, walk, ARM, "chest")
    index = MotionIndex.of([*motions[1:], mixed])
    hit = search(index_of_part(index, ARM), Query([walk]), k=1)[0]
    assert hit.clip == len(index) - 1
    assert hit.distance < 0.25
    assert search(index, Query([walk]), k=1)[0].clip != hit.clip


def test_a_part_is_itself(index, motions):
    for name in PARTS:
        part = index_of_part(index, part_joints([name]))
        hit = search(part, Query([motions[4]]), k=1)[0]
        assert (hit.clip, round(hit.distance, 1)) == (4, 0.0)
        assert part.space.n_dims == PART_AXES == 16
        assert part.frames.starts.tolist() == index.frames.starts.tolist()


def test_distances_are_those_of_the_joints_themselves(index, motions):
    part = index_of_part(index, ARM)
    seen = np.concatenate([part.space.frames(each) for each in motions[:6]])
    weights = index.space.weights
    pose = [frame_features(each)[:, :51].reshape(len(each), 17, 3) for each in motions[:6]]
    speed = [frame_features(each)[:, 51:102].reshape(len(each), 17, 3) for each in motions[:6]]
    rows, chest = [JOINTS.index(joint) - 1 for joint in ARM], JOINTS.index("chest") - 1
    truth = np.concatenate(
        [
            np.concatenate(
                [
                    (p[:, rows] - p[:, [chest]]).reshape(len(p), -1),
                    weights.velocity_s * (s[:, rows] - s[:, [chest]]).reshape(len(p), -1),
                ],
                axis=1,
            )
            for p, s in zip(pose, speed, strict=True)
        ]
    )
    first, other = np.random.default_rng(0).integers(0, len(truth), (2, 2000))
    before = np.linalg.norm(truth[first] - truth[other], axis=1)
    after = np.linalg.norm(seen[first] - seen[other], axis=1)
    assert np.corrcoef(before, after)[0, 1] > 0.99


def test_where_the_body_is_counts_with_the_hips(index):
    arms = index_of_part(index, part_joints(["arms"]))
    hips = index_of_part(index, part_joints(["hips"]))
    assert np.abs(arms.space.axes[102:]).max() < np.abs(hips.space.axes[102:]).max()


@pytest.mark.parametrize("name", ["right-arm", "RIGHT_ARM", " right-arm "])
def test_names_are_read_kindly(name):
    assert part_joints([name]) == ("right_shoulder", "right_elbow", "right_wrist")


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["right-amr"], "Did you mean right-arm"),
        (["wing"], "left-arm, right-arm"),
        ([""], "but got ''"),
        ([], "got none"),
    ],
)
def test_unknown_parts_are_named(names, words):
    with pytest.raises(ClipError, match=words):
        part_joints(names)


def test_what_is_not_meant_is_left_out(index, motions):
    query = Query([motions[0]])
    kinds = [hit.clip // 3 for hit in search(index, query, k=30, max_distance=5)]
    assert set(kinds) >= {0, 2}
    meant = search(index, query, k=9, max_distance=5, unlike=Query([motions[6]]))
    assert 2 not in {hit.clip // 3 for hit in meant}
    assert {hit.clip for hit in meant} >= {0, 1, 2}
    distances = [hit.distance for hit in meant]
    assert distances == sorted(distances)


def test_what_is_not_meant_is_looked_for_among_sixteen_times_as_many(index, motions, monkeypatch):
    query, asked = Query([motions[0]]), []
    best = search(index, query, k=1)[0]

    def as_many(_, k, max_distance):
        asked.append(k)
        return [best] * k

    monkeypatch.setattr(stretch_search._Search, "hits", as_many)
    monkeypatch.setattr(stretch_search, "_nearest", lambda *_: 0.0)
    assert search(index, query, k=2, unlike=query) == []
    assert asked == [2, 32]
