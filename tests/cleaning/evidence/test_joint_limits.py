"""Joint limits, learnt from the rest of a clip and from its context."""

import numpy as np
import pytest

from mocapdb.cleaning import detect_faults
from mocapdb.cleaning.evidence.joint_limits import RotationLimits
from mocapdb.cleaning.local_rotations import motion_texture
from mocapdb.cleaning.neighbours.nearest_words import Vocabulary
from mocapdb.corpus import synthetic
from mocapdb.errors import SkeletonError
from mocapdb.io.conventions import to_bvh_convention


@pytest.fixture(scope="module")
def walk():
    return synthetic.make_clip("walk", seed=3, duration_s=8, phase_noise=0.2)


def bent(clip, name, start, end, degrees):
    """The clip with a joint bent by so much more, out of its range, in frames at 120 Hz."""
    channels = clip.channels.copy()
    channels[start:end, int(clip.skeleton.channel_starts[clip.skeleton.joint(name)])] -= degrees
    return clip.replace(channels=channels)


def row_of(texture, name):
    return texture.names.index(name)


def test_a_knee_that_bends_forwards_is_beyond_its_limits(walk):
    texture = motion_texture(bent(walk, "ltibia", 400, 460, 50.0))
    row = row_of(texture, "ltibia")
    limits = RotationLimits(texture)
    assert limits.beyond(row, 80, 92, 180.0) > 2.0
    assert abs(limits.beyond(row, 40, 52, 180.0)) < 1.0
    other = row_of(texture, "rtibia")
    assert abs(limits.beyond(other, 80, 92, 180.0)) < 1.0


def test_no_more_counts_than_the_joint_may_be_wrong_by(walk):
    texture = motion_texture(bent(walk, "ltibia", 400, 460, 50.0))
    row = row_of(texture, "ltibia")
    limits = RotationLimits(texture)
    found = [limits.beyond(row, 80, 92, most) for most in (0.0, 3.0, 10.0, 180.0)]
    assert found == sorted(found)
    assert found[0] <= 0.0 < found[2]


def test_limits_do_not_depend_on_the_axes(walk):
    wrong = bent(walk, "ltibia", 400, 460, 50.0)
    first = motion_texture(wrong)
    second = motion_texture(to_bvh_convention(wrong))
    a, b = (RotationLimits(t).beyond(row_of(t, "ltibia"), 80, 92, 180.0) for t in (first, second))
    assert a == pytest.approx(b, abs=0.02)  # angles near 0 are not exact


def test_a_context_widens_them(walk):
    wide = motion_texture(bent(walk, "ltibia", 0, len(walk), 50.0))
    texture = motion_texture(bent(walk, "ltibia", 400, 460, 50.0))
    row = row_of(texture, "ltibia")
    alone, together = RotationLimits(texture), RotationLimits(texture, Vocabulary.of([wide]))
    assert together.beyond(row, 80, 92, 180.0) < 0.5 < alone.beyond(row, 80, 92, 180.0)
    hidden = Vocabulary.of([wide]).without_copies(wide)
    assert hidden.shown == []
    assert RotationLimits(texture, hidden).beyond(row, 80, 92, 180.0) == alone.beyond(
        row, 80, 92, 180.0
    )


def test_where_nothing_else_was_seen_they_say_nothing(walk):
    short = motion_texture(walk[:40])
    assert RotationLimits(short).beyond(1, 0, len(short), 90.0) == 0.0
    assert RotationLimits(short).beyond(1, 3, 3, 90.0) == 0.0


def test_a_context_of_other_joints_is_refused(walk):
    texture = motion_texture(walk)
    from dataclasses import replace

    one_less = replace(texture, joints=texture.joints[1:], quat_xyzw=texture.quat_xyzw[:, 1:])
    with pytest.raises(SkeletonError, match="Leave it out"):
        RotationLimits(texture, Vocabulary.of([one_less]))


def test_long_clips_and_contexts_are_thinned(walk):
    texture = motion_texture(walk)
    from dataclasses import replace

    long = replace(texture, quat_xyzw=np.tile(texture.quat_xyzw, (30, 1, 1)))
    limits = RotationLimits(long, Vocabulary.of([long]))
    assert limits.beyond(4, 100, 120, 90.0) < 0.5


def test_limits_come_from_4000_frames_at_most(walk):
    """A rotation that is seen once is not seen any more where frames are left out."""
    from dataclasses import replace

    texture = motion_texture(walk)
    for n_frames, is_seen in ((3900, True), (4100, False)):
        quats = np.resize(texture.quat_xyzw, (n_frames, *texture.quat_xyzw.shape[1:]))
        rare = np.array([np.sin(1.0), 0.0, 0.0, np.cos(1.0)])
        drawn = np.linspace(0, n_frames - 1, 4000).astype(int)
        once = n_frames // 2 if is_seen else int(np.setdiff1d(np.arange(2000), drawn)[0])
        quats[once, 4] = quats[3000:3010, 4] = rare
        limits = RotationLimits(replace(texture, quat_xyzw=quats))
        far = limits.beyond(4, 3000, 3010, 180.0)
        assert (far < 1.0) == is_seen


def test_detection_with_a_context_that_has_no_words_still_needs_its_joints(walk):
    tiny = walk[:30]
    assert len(detect_faults(walk, [tiny]).scores) == len(walk)
