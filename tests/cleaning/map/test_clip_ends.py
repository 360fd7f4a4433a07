"""A pose that is cut on to a motion is no fault of its joints."""

import numpy as np
import pytest

from mocapdb.cleaning import clean_clip, detect_faults, repair_spans
from mocapdb.cleaning.joint_roles import BODY_ROLES
from mocapdb.cleaning.local_rotations import local_rotations
from mocapdb.cleaning.map.clip_ends import frames_between_cuts
from mocapdb.cleaning.repair.contact_targets import make_contact
from mocapdb.corpus import synthetic
from mocapdb.motion.frame_range import FrameRange


@pytest.fixture(scope="module")
def walk():
    """A walk whose joints are nowhere near their rest pose."""
    clip = synthetic.make_clip("walk", seed=3, duration_s=3, sensor_noise_deg=0.02)
    channels = clip.channels.copy()
    channels[:, clip.skeleton.rotation_channels] += 35.0
    return clip.replace(channels=channels)


def with_poses(clip, before=0, after=0):
    """The clip with so many T-poses at its ends."""
    pose = clip.channels[0].copy()
    pose[clip.skeleton.rotation_channels] = 0.0
    rows = [np.tile(pose, (before, 1)), clip.channels, np.tile(pose, (after, 1))]
    return clip.replace(channels=np.concatenate(rows))


@pytest.mark.parametrize(
    ("before", "after", "is_cut"),
    [(0, 0, True), (1, 0, True), (3, 0, True), (0, 1, True), (40, 0, True), (2, 20, True),
     (0, 30, False)],
)  # fmt: skip
def test_poses_at_either_end_are_found_and_left_alone(walk, before, after, is_cut):
    clip = with_poses(walk, before, after)
    frames = frames_between_cuts(clip, local_rotations(clip))
    last = len(walk) + before if is_cut else len(clip)
    assert frames == FrameRange(before, last)
    if is_cut:
        assert clean_clip(clip).clip is clip


def test_a_jump_of_a_few_joints_is_no_cut(walk):
    channels = walk.channels.copy()
    for name in ("lhumerus", "rhumerus", "lfemur", "rfemur"):
        channels[:2, walk.skeleton.rotation_columns(walk.skeleton.joint(name))] += 60.0
    clip = walk.replace(channels=channels)
    assert frames_between_cuts(clip, local_rotations(clip)) == FrameRange(0, len(clip))


@pytest.mark.parametrize(("share", "is_cut"), [(0.5, False), (0.75, True)])
def test_more_than_six_joints_in_ten_make_a_cut(walk, share, is_cut):
    native = local_rotations(walk)
    body = [j for j, role in zip(native.joints, native.row_roles, strict=True)
            if role in BODY_ROLES]  # fmt: skip
    channels = walk.channels.copy()
    for joint in body[: round(share * len(body))]:
        channels[:1, walk.skeleton.rotation_columns(int(joint))] += 60.0
    clip = walk.replace(channels=channels)
    assert frames_between_cuts(clip, local_rotations(clip)).start == int(is_cut)


GLIDE = (0.0, 0.38, 0.72, 0.94)


def gliding(clip, at_end=False, n_joints=None):
    """The clip with some of its joints, or all, gliding from a T-pose into it."""
    columns = clip.skeleton.rotation_channels
    if n_joints is not None:
        joints = local_rotations(clip).joints[9 : 9 + n_joints]
        columns = np.concatenate([clip.skeleton.rotation_columns(int(j)) for j in joints])
    channels = clip.channels[::-1].copy() if at_end else clip.channels.copy()
    channels[: len(GLIDE), columns] *= np.array(GLIDE)[:, None]
    return clip.replace(channels=channels[::-1] if at_end else channels)


@pytest.mark.parametrize("at_end", [False, True])
def test_frames_that_glide_out_of_a_pose_are_left_alone(walk, at_end):
    clip = gliding(walk, at_end)
    frames = frames_between_cuts(clip, local_rotations(clip))
    wanted = FrameRange(0, len(clip) - 4) if at_end else FrameRange(4, len(clip))
    assert frames == wanted


def test_a_few_joints_that_glide_are_no_cut(walk):
    clip = gliding(walk, n_joints=8)
    assert frames_between_cuts(clip, local_rotations(clip)) == FrameRange(0, len(clip))


def test_a_clip_that_stops_only_later_does_not_glide(walk):
    """Most joints are fast from its first frame on, but for longer than a glide lasts."""
    channels = walk.channels.copy()
    channels[30:] = channels[30] + np.linspace(0.0, 0.01, len(channels) - 30)[:, None]
    clip = walk.replace(channels=channels)
    assert frames_between_cuts(clip, local_rotations(clip)) == FrameRange(0, len(clip))


def test_too_few_frames_are_no_motion_of_their_own(walk):
    for kept, start in ((8, 1), (7, 0)):
        clip = with_poses(walk[:kept], before=1)
        assert frames_between_cuts(clip, local_rotations(clip)).start == start


def test_faults_behind_a_t_pose_are_where_they_are_in_the_clip(walk):
    faulty, _, (fault,) = synthetic.inject_faults(
        walk, seed=1, kinds=["offset"], n=1, size_deg=50, length_s=(0.3, 0.4)
    )
    clip = with_poses(faulty, before=2)
    contact = make_contact(clip, "lhand", 0.0, 1.0)
    found = detect_faults(clip)
    assert found.searched == FrameRange(2, len(clip))
    assert found.cut_off == (FrameRange(0, 2),)
    assert found.scores.shape == (len(clip), clip.skeleton.n_joints)
    (span,) = found.spans
    assert span.joint == fault.joint
    assert abs(span.start - fault.start - 2) <= 2
    mended, (repair,) = repair_spans(clip, found, contacts=[contact])
    assert repair.span == span
    changed = np.flatnonzero((mended.channels != clip.channels).any(axis=1))
    assert changed.min() >= span.start
    assert changed.max() < span.end
    assert np.abs(mended.channels[2:] - walk.channels).max() < 3.0
