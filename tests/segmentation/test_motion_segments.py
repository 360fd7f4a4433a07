"""Takes put together of synthetic motions, whose cuts are known."""

from itertools import pairwise

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.cycles.phase.pose_cloud import pose_cloud
from mocapdb.errors import ClipError
from mocapdb.motion.frame_range import FrameRange
from mocapdb.segmentation import segment_clip, segment_poses

FPS = 30.0
FADE = 12
ORDERS = (
    ("walk", "squat", "wave", "walk", "box", "hop"),
    ("hop", "wave", "run", "squat", "box", "wave"),
    ("box", "walk", "hop", "squat", "walk", "wave"),
)


@pytest.fixture(scope="module")
def takes():
    """Poses, true cuts and kinds of three takes of three people, each motion of 4 to 6 s."""
    made = []
    for who, order in enumerate(ORDERS):
        rng = np.random.default_rng(who)
        body = synthetic.subject(who)
        poses = np.empty((0, 0))
        cuts = []
        for kind in order:
            clip = synthetic.make_clip(
                kind, seed=10 + who, skeleton=body, fps=FPS, duration_s=rng.uniform(4, 6),
                sensor_noise_deg=0.2,
            )  # fmt: skip
            part = pose_cloud(clip, by_bone_length=True)
            if len(poses):
                cuts.append(len(poses) - FADE // 2)
                share = np.linspace(0, 1, FADE)[:, None]
                faded = poses[-FADE:] * (1 - share) + part[:FADE] * share
                part = np.vstack([poses[:-FADE], faded, part[FADE:]])
            poses = part
        made.append((poses, cuts, order))
    return made


@pytest.fixture(scope="module")
def found(takes):
    return [segment_poses(poses, FPS) for poses, _, _ in takes]


def hits(cuts, true, within_s=0.5):
    return sum(
        min((abs(cut - each) for cut in cuts), default=999) <= within_s * FPS for each in true
    )


def cuts_of(segmentation):
    return [segment.start for segment in segmentation.segments[1:]]


def test_cuts_are_where_motions_change(takes, found):
    true = sum(len(cuts) for _, cuts, _ in takes)
    right = sum(hits(cuts_of(each), cuts) for each, (_, cuts, _) in zip(found, takes, strict=True))
    assert right >= 0.93 * true
    assert sum(len(cuts_of(each)) for each in found) <= 1.1 * true


def test_segments_cover_the_take(takes, found):
    for each, (poses, _, _) in zip(found, takes, strict=True):
        assert each.segments[0].start == 0
        assert each.segments[-1].end == len(poses)
        assert all(a.end == b.start for a, b in pairwise(each.segments))


def test_the_same_motion_has_the_same_letter(takes, found):
    for each, (poses, cuts, order) in zip(found, takes, strict=True):
        bounds = [0, *cuts, len(poses)]
        letters = {}
        for kind, (start, end) in zip(order, pairwise(bounds), strict=True):
            inside = max(each.segments, key=FrameRange(start, end).overlap)
            letters.setdefault(kind, set()).add(inside.motion)
        assert all(len(own) == 1 for own in letters.values())
        assert len(set.union(*letters.values())) == len(letters)


def test_what_repeats_has_its_period():
    clip, truth = synthetic.make("walk", seed=3, fps=FPS, duration_s=5)
    (segment,) = segment_clip(clip).segments
    assert segment.motion == "A"
    assert segment.period_frames == pytest.approx(truth.period_frames, rel=0.03)


@pytest.mark.parametrize("method", ["pca", "ppca", "mixture"])
def test_published_methods_find_most(takes, method):
    poses, true, _ = takes[0]
    cuts = cuts_of(segment_poses(poses[: true[3]], FPS, method))
    assert hits(cuts, true[:3], within_s=1.5) >= 2
    assert len(cuts) <= 6


def test_a_rate_changes_little(takes, found):
    poses, _, _ = takes[1]
    frames = np.arange(0, len(poses) - 1, 0.25)
    low = frames.astype(int)
    share = (frames - low)[:, None]
    fine = segment_poses(poses[low] * (1 - share) + poses[low + 1] * share, 4 * FPS)
    assert np.array(cuts_of(fine)) / 4 == pytest.approx(np.array(cuts_of(found[1])), abs=6)


def test_standing_still_is_one_motion():
    clip = synthetic.make_clip("walk", seed=1, fps=FPS)
    still = clip.replace(channels=np.repeat(clip.channels[:1], 90, axis=0))
    (segment,) = segment_clip(still).segments
    assert segment.period_frames is None


def test_what_cannot_be_cut_is_said():
    clip = synthetic.make_clip("walk", seed=1, fps=FPS)
    with pytest.raises(ClipError, match=r"Expected 0.8 s of motion at least"):
        segment_clip(clip[:10])
    with pytest.raises(ClipError, match="Expected a method out of partition"):
        segment_clip(clip, "kmeans")
