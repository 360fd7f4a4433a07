"""Motion of another actor or rig, put onto the joints of a clip's."""

from dataclasses import replace

import numpy as np
import pytest
from made_bodies import (
    along_x,
    in_units,
    make_dog,
    make_walk,
    renamed,
    turned_up,
    under_scene,
    with_rest,
)
from scipy.spatial.transform import Rotation

from mocapdb.cleaning.local_rotations import motion_texture
from mocapdb.cleaning.map.detector import detect_faults
from mocapdb.cleaning.neighbours.counterpart_joints import OtherMotion, TargetBody, context_of
from mocapdb.cleaning.neighbours.nearest_words import Neighbours, Vocabulary, find_neighbours
from mocapdb.cleaning.neighbours.similarity import consensus_with_others, find_consensus
from mocapdb.corpus import synthetic
from mocapdb.errors import SkeletonError
from mocapdb.io import read_clip, write_clip
from mocapdb.motion.clip import Clip
from mocapdb.motion.quaternions import angles_deg

SEGMENTS = {"hips", "chest", "head"} | {
    f"{side}_{limb}"
    for side in ("left", "right")
    for limb in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
}


def clip_of(made, name="made"):
    skeleton = replace(made.skeleton, up=made.up, metres_per_unit=made.unit_m)
    return Clip(skeleton, made.channels, 30.0, name=name)


def apart(target, other):
    """How far a motion on the target's body is from the target's own, in the rows that it shows."""
    body = TargetBody(target)
    texture, rows = body.put_on(OtherMotion.of(other, body.texture.fps))
    return rows, angles_deg(texture.quat_xyzw, body.texture.quat_xyzw)[:, list(rows)]


@pytest.fixture(scope="module")
def walk():
    return synthetic.make_clip("walk", seed=1, duration_s=3)


@pytest.fixture(scope="module")
def rewritten(walk, tmp_path_factory):
    """The same walk of an AMC's body as BVH: every joint turns, in other axes."""
    path = tmp_path_factory.mktemp("other") / "walk.bvh"
    write_clip(walk, path)
    return read_clip(path)


@pytest.mark.parametrize("way", [0, 1])
def test_a_bvh_and_the_amc_that_it_was_made_of_agree_in_every_joint(walk, rewritten, way):
    target, other = ((walk, rewritten), (rewritten, walk))[way]
    rows, degrees = apart(target, other)
    assert len(rows) == len(motion_texture(target).joints)
    assert degrees.max() < 0.05


def quarter_turns(made):
    """The same motion on joints whose axes are turned about the bones, which point as they did."""
    bases = np.tile(np.eye(3), (made.skeleton.n_joints, 1, 1))
    for joint, role in enumerate(made.roles):
        if role.endswith(("shoulder", "elbow", "wrist", "hand_end")):
            bases[joint] = Rotation.from_euler("x", 90, degrees=True).as_matrix()
    return with_rest(made, bases)


@pytest.mark.parametrize(
    "changed",
    [
        along_x, quarter_turns, renamed, turned_up, under_scene,
        lambda made: in_units(renamed(made), 0.01),
        lambda made: with_rest(
            made, Rotation.random(made.skeleton.n_joints, random_state=3).as_matrix()
        ),
    ],
    ids=["bones along x", "turned about bones", "renamed", "z up", "scene", "units", "any axes"],
)  # fmt: skip
def test_rigs_with_other_axes_agree(changed):
    made = make_walk(90)
    other = changed(made)
    rows, degrees = apart(clip_of(made), clip_of(other, "other"))
    joints = motion_texture(clip_of(made)).joints[list(rows)]
    off = {made.roles[joint]: degrees[:, n] for n, joint in enumerate(joints.tolist())}
    assert off.keys() >= SEGMENTS
    for role, own in off.items():
        if "_" in role or role == "hips":
            assert own.max() < 1.0, role
        elif role in SEGMENTS:  # what the spine does between two segments is shared out
            assert np.median(own) < 6.0, role


def test_an_animal_and_a_tail_are_refused(walk):
    dog = clip_of(renamed(make_dog()), "rex")
    with pytest.raises(SkeletonError, match="'rex' and 'walk_1' to be two human bodies"):
        context_of(walk, [OtherMotion.of(dog, 24.0)])
    refused = {}
    found = context_of(
        walk, [OtherMotion.of(dog, 24.0), OtherMotion.of(clip_of(make_walk(90)), 24.0)], refused
    )
    assert list(refused) == ["rex"]
    assert [each.clips for each in found] == [("made",)]


def test_a_copy_on_another_rig_is_passed_over(walk, rewritten):
    (own,) = context_of(walk, [OtherMotion.of(rewritten, 24.0)])
    assert own.shown == []


def test_joints_without_counterpart_are_told_by_the_clip_alone(walk):
    texture = motion_texture(walk)
    other = motion_texture(synthetic.make_clip("walk", seed=2, duration_s=3))
    rows = np.array([1, 2, 5, 6, 7, 20])
    hidden = other.quat_xyzw.copy()
    hidden[:, np.setdiff1d(np.arange(len(texture.joints)), rows)] = np.nan
    vocabulary = Vocabulary.of([replace(other, quat_xyzw=hidden)], rows=rows)
    own = find_neighbours(texture, [texture])
    found = find_neighbours(texture, vocabulary)
    consensus = consensus_with_others(texture, own, [(rows, found)])
    alone = find_consensus(texture, own)
    rest = np.setdiff1d(np.arange(len(texture.joints)), rows)
    np.testing.assert_array_equal(consensus.median_quats[:, rest], alone.median_quats[:, rest])
    np.testing.assert_array_equal(consensus.spread_deg[:, rest], alone.spread_deg[:, rest])
    assert np.isfinite(consensus.median_quats).all()
    assert (consensus.median_quats[:, rows] != alone.median_quats[:, rows]).any()
    short = consensus_with_others(texture, None, [(rows, found)])
    assert (short.residual_deg[:, rest] == 0).all()
    assert short.residual_deg[:, rows].max() > 0
    assert isinstance(short.neighbours, Neighbours)


def test_soft_faults_are_found_by_the_motion_of_another_rig(tmp_path):
    """Two seconds of a walk hardly repeat themselves; what another rig has of it does."""
    whole = synthetic.make_clip("walk", seed=5, duration_s=6, sensor_noise_deg=0.02)
    soft = synthetic.inject_faults(
        whole[360:600], seed=5, kinds=["offset"], size_deg=60, length_s=0.6, ease_s=0.25, n=1
    )
    (fault,) = soft.faults
    write_clip(whole[:340], tmp_path / "other.bvh")
    other = read_clip(tmp_path / "other.bvh")

    def found(context):
        mask = detect_faults(soft.clip, context).mask
        return mask[fault.start : fault.end, fault.joint].mean()

    assert found(()) == 0.0
    assert found([other]) > 0.5


def test_strangers_take_nothing_back_of_what_the_clip_alone_tells(walk):
    faulty = synthetic.inject_faults(walk, seed=2, kinds=["offset"], size_deg=12, n=1)
    boxers = [clip_of(make_walk(90)), synthetic.make_clip("box", seed=1, duration_s=3)]
    alone, among_strangers = detect_faults(faulty.clip), detect_faults(faulty.clip, boxers)
    assert alone.spans
    assert (among_strangers.scores >= alone.scores - 1e-9).all()
