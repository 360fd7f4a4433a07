"""Nine joints of a walk bring the others along."""

import numpy as np
import pytest
from made_bodies import make_dog, make_walk, renamed

from mocapdb.cleaning import fill_joints
from mocapdb.cleaning.local_rotations import local_rotations
from mocapdb.cleaning.repair.missing_joints import nine_joints
from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError, SkeletonError
from mocapdb.motion.clip import Clip
from mocapdb.motion.quaternions import angles_deg

NINE = (
    "upperneck", "lhumerus", "rhumerus", "lradius", "rradius", "lfemur", "rfemur", "ltibia",
    "rtibia",
)  # fmt: skip


@pytest.fixture(scope="module")
def walk():
    return synthetic.make_clip("walk", seed=3, duration_s=4)


def only(clip, names):
    """The clip with every joint but the root and these at zero."""
    channels = clip.channels.copy()
    for joint in range(1, clip.skeleton.n_joints):
        if clip.skeleton.names[joint] not in names:
            first, last = clip.skeleton.channel_starts[[joint, joint + 1]]
            channels[:, first:last] = 0.0
    return clip.replace(channels=channels)


def test_the_others_are_filled_in_and_the_nine_kept(walk):
    context = [synthetic.warp(walk, 0.9)[0], synthetic.make_clip("box", seed=1)]
    sparse = only(walk, NINE)
    filled = fill_joints(sparse, NINE, context)
    known = [walk.skeleton.joint(name) for name in ("root", *NINE)]
    for joint in known:
        first, last = walk.skeleton.channel_starts[[joint, joint + 1]]
        np.testing.assert_array_equal(filled.channels[:, first:last], walk.channels[:, first:last])
    truth, before, after = (local_rotations(clip) for clip in (walk, sparse, filled))
    wrong = angles_deg(truth.quat_xyzw, before.quat_xyzw).mean()
    left = angles_deg(truth.quat_xyzw, after.quat_xyzw).mean()
    assert left < 0.5 * wrong
    assert left < 1.5


def test_nine_joints_are_told_of_any_human_body(walk):
    assert set(nine_joints(walk)) == {"lowerneck", *NINE[1:]}
    made = make_walk()
    assert set(nine_joints(Clip(made.skeleton, made.channels, 30.0))) == {
        "neck",
        *(f"{side}_{part}" for side in ("left", "right")
          for part in ("shoulder", "elbow", "hip", "knee")),
    }  # fmt: skip
    dog = renamed(make_dog())
    assert nine_joints(Clip(dog.skeleton, dog.channels, 30.0)) == ()


def test_what_cannot_be_filled_is_refused(walk):
    with pytest.raises(SkeletonError, match="'tail'"):
        fill_joints(walk, ["tail"], [walk])
    with pytest.raises(ClipError, match="got 'lhipjoint', which cannot"):
        fill_joints(walk, ["lhipjoint"], [walk])
    with pytest.raises(ClipError, match="besides the root 'root'"):
        fill_joints(walk, ["root", "lhipjoint"], [walk])
    with pytest.raises(ClipError, match="to be known, but got 0"):
        fill_joints(walk, [], [walk])
    with pytest.raises(ClipError, match="to be known"):
        fill_joints(walk, walk.skeleton.names, [walk])
    with pytest.raises(ClipError, match="word of 15 frames"):
        fill_joints(walk[:30], NINE, [walk])
