"""Feet that slide are held, by the root or by the legs, and nothing else changes."""

import numpy as np
import pytest

from mocapdb.cleaning.repair import foot_skate
from mocapdb.cleaning.repair.foot_skate import remove_foot_skate
from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError
from mocapdb.io.conventions import to_bvh_convention
from mocapdb.motion.clip import Clip
from mocapdb.motion.foot_contacts import find_contacts, find_legs, foot_slide_mm
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.skeleton import Skeleton


@pytest.fixture(scope="module")
def walk():
    return synthetic.make_clip("walk", seed=1, duration_s=4)


def positions_of(clip):
    return forward_kinematics(clip.skeleton, clip.channels).positions


def skating(clip, amount_m=0.03):
    """The clip with its root swaying, so that resting feet slide."""
    channels = clip.channels.copy()
    time = np.arange(len(clip)) / clip.fps
    sway = amount_m / clip.skeleton.metres_per_unit * np.sin(2 * np.pi * 1.3 * time)
    channels[:, clip.skeleton.channel_names.index(f"{clip.skeleton.names[0]}.tx")] += sway
    return clip.replace(channels=channels)


@pytest.mark.parametrize("convention", ["acclaim", "bvh"])
@pytest.mark.parametrize(("way", "left"), [("legs", 0.15), ("root", 0.35)])
def test_skate_goes(walk, convention, way, left):
    clip = to_bvh_convention(walk) if convention == "bvh" else walk
    contacts = find_contacts(clip.skeleton, positions_of(clip), clip.fps)
    skate = remove_foot_skate(skating(clip), way, contacts=contacts)
    assert skate.slide_before_mm > 10
    assert skate.slide_after_mm < left * skate.slide_before_mm
    after = foot_slide_mm(clip.skeleton, positions_of(skate.clip), contacts)
    assert after == pytest.approx(skate.slide_after_mm)
    assert skate.clip.provenance[-1] == f"foot skate removed by the {way}"


def test_the_root_way_touches_the_root_alone(walk):
    skate = remove_foot_skate(skating(walk), "root")
    changed = (skate.clip.channels != skating(walk).channels).any(axis=0)
    assert {walk.skeleton.channel_names[i] for i in np.flatnonzero(changed)} == {
        "root.tx",
        "root.tz",
    }


def test_the_legs_way_touches_legs_alone_and_keeps_the_bones(walk):
    skate = remove_foot_skate(skating(walk), "legs")
    changed = (skate.clip.channels != skating(walk).channels).any(axis=0)
    joints = {walk.skeleton.channel_names[i].split(".")[0] for i in np.flatnonzero(changed)}
    legs = find_legs(walk.skeleton)
    assert joints <= {walk.skeleton.names[j] for leg in legs for j in leg}
    assert not joints & {"root", "head", "lhipjoint"}


def test_the_roots_pace_changes_within_a_twentieth_of_a_second(walk):
    """One foot slides at a steady pace from one frame on: the root makes up for it, smoothly."""
    skate = remove_foot_skate(skating(walk), "root")
    column = walk.skeleton.channel_names.index("root.tx")
    path = (skate.clip.channels - skating(walk).channels)[:, column]
    assert np.abs(np.diff(path, n=2)).sum() == pytest.approx(0.67185, rel=1e-3)


@pytest.mark.parametrize(("share", "n_legs"), [(0.8e-5, 0), (1.2e-5, 2)])
def test_feet_that_are_hardly_pulled_stay_as_they_are(walk, monkeypatch, share, n_legs):
    turned = []

    def remember(skeleton, channels, goals, joints):
        turned.append(joints)
        return channels

    pull = np.tile([share * walk.skeleton.height, 0.0, 0.0], (len(walk), 1))
    monkeypatch.setattr(foot_skate, "pull_to_rest", lambda *_: pull)
    monkeypatch.setattr(foot_skate, "reach", remember)
    remove_foot_skate(skating(walk), "legs")
    assert len(turned) == n_legs


def test_a_clip_without_rests_comes_back_as_it_is(walk):
    contacts = np.zeros((len(walk), 2), dtype=bool)
    skate = remove_foot_skate(walk, contacts=contacts)
    assert skate.clip is walk
    assert skate.slide_after_mm == 0.0


def test_what_makes_no_sense_is_refused(walk):
    with pytest.raises(ClipError, match="contacts of shape"):
        remove_foot_skate(walk, contacts=np.zeros((3, 2), dtype=bool))
    with pytest.raises(ClipError, match="'root' or 'legs'"):
        remove_foot_skate(walk, "feet")
    tail = Skeleton(
        ["a", "b"], [-1, 0], [[0, 0, 0], [0, 1, 0]], [("rx",), ("rx",)], ["X", "X"],
        convention="bvh", name="tail",
    )  # fmt: skip
    with pytest.raises(ClipError, match="to have legs"):
        remove_foot_skate(Clip(tail, np.zeros((20, 2)), 60.0))
