"""What is understood of bodies in the ways of many exporters, and what is refused."""

from dataclasses import replace

import made_bodies as made
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from names_of_programs import NAMES
from scipy.spatial.transform import Rotation
from strategies import clips, skeletons

from mocapdb.corpus import synthetic
from mocapdb.errors import SkeletonError
from mocapdb.io.conventions import to_acclaim_convention, to_bvh_convention
from mocapdb.motion.body import JOINTS, Given, understand
from mocapdb.motion.body.canonical_joints import other_side
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import channels_from_pose, forward_kinematics
from mocapdb.motion.skeleton import Skeleton

INCH, FOOT, CMU = 0.0254, 0.3048, 0.0254 / 0.45
UNITS = [1.0, 0.1, 0.01, 0.001, INCH, FOOT, CMU]


@pytest.fixture(scope="module")
def walk():
    return made.make_walk()


def understood(body):
    return understand(body.skeleton, body.channels)


def roles_found(body, found):
    return {name: body.roles[joint] for name, joint in found.joints.value.items()}


def check(body, *, by, root="hips", lost=()):
    """Compare all findings with the right answers."""
    found = understood(body)
    assert found.is_human, found.refusal
    assert by in found.joints.evidence
    expected = {name: role for name, role in made.CANONICAL.items() if name not in lost}
    roles = roles_found(body, found)
    assert {name: roles[name] for name in expected} == expected
    assert body.roles[found.root.value] == root
    assert found.up.value == body.up
    assert found.unit_m.value == pytest.approx(body.unit_m)
    assert found.height_m == pytest.approx(1.71, abs=0.12)
    return found


CONVENTIONS = {
    "plain": lambda body: body,
    "bones along x": made.along_x,
    "Z up, rest pose Y up": made.turned_up,
    "positions that repeat OFFSETs": lambda body: made.with_positions(body, "places"),
    "positions that replace OFFSETs": lambda body: made.with_positions(body, "replacing"),
    "displacements": lambda body: made.with_positions(body, "displacements"),
    "under a scene": made.under_scene,
    "under a scene, bones along x": lambda body: made.under_scene(made.along_x(body)),
    "under root motion": lambda body: made.under_scene(body, moving=True),
    "without toes": lambda body: made.without(body, "left_toe", "right_toe"),
}


@pytest.mark.parametrize("names", ["said", "unsaid"])
@pytest.mark.parametrize("convention", CONVENTIONS)
def test_conventions(walk, convention, names):
    body = CONVENTIONS[convention](walk)
    by = "names"
    if names == "unsaid":
        body, by = made.renamed(body), "shape"
    found = check(body, by=by)
    assert found.adds_positions.value == (convention == "displacements")


@pytest.mark.parametrize("unit_m", UNITS)
def test_units(walk, unit_m):
    check(made.in_units(walk, unit_m), by="names")
    check(made.in_units(made.turned_up(made.along_x(made.renamed(walk))), unit_m), by="shape")


@pytest.mark.parametrize("program", NAMES)
def test_names_of_programs(walk, program):
    body = made.renamed(made.along_x(walk), NAMES[program])
    check(body, by="names")
    check(made.under_scene(made.in_units(body, 0.01)), by="names")


def test_a_displaced_body_is_posed_as_one_that_is_not(walk):
    body = made.with_positions(walk, "displacements")
    found = understood(body)
    skeleton = replace(body.skeleton, displaces=found.adds_positions.value)
    positions = forward_kinematics(skeleton, body.channels).positions
    np.testing.assert_allclose(positions, walk.pose.positions, atol=1e-9)


def test_displacements_are_kept_by_kinematics_and_by_dictionaries(walk):
    body = made.with_positions(walk, "displacements")
    skeleton = replace(body.skeleton, displaces=True)
    pose = forward_kinematics(skeleton, body.channels)
    np.testing.assert_allclose(channels_from_pose(skeleton, pose), body.channels, atol=1e-9)
    assert Skeleton.from_dict(skeleton.to_dict()) == skeleton != body.skeleton
    assert "displaces" not in body.skeleton.to_dict()  # as before there were any


def test_where_bones_turn_and_collarbones_start(walk):
    found = understood(walk)
    names = walk.skeleton.names
    assert names[found.turns["left_knee"]] == "left_knee"
    assert {name: names[joint] for name, joint in found.collars.items()} == {
        "left_shoulder": "left_collar",
        "right_shoulder": "right_collar",
    }
    assert names[found.neck] == "neck"
    clip = synthetic.make_clip("walk", seed=1)
    found = understand(clip.skeleton, clip.channels)
    names = clip.skeleton.names
    assert names[found.joints.value["left_knee"]] == "lfemur"  # in Acclaim where the femur ends
    assert names[found.turns["left_knee"]] == "ltibia"


@pytest.mark.parametrize("kind", ["walk", "run", "hop", "squat", "box", "wave"])
def test_synthetic_motions_in_both_conventions(kind):
    clip = synthetic.make_clip(kind, seed=3)
    as_bvh = to_bvh_convention(clip)
    for each in (clip, as_bvh):
        anonymous = replace(each.skeleton, names=[f"n{i}" for i in range(each.skeleton.n_joints)])
        named, shaped = (understand(body, each.channels) for body in (each.skeleton, anonymous))
        at = forward_kinematics(each.skeleton, each.channels).positions
        for found in (named, shaped):
            assert found.unit_m.value == pytest.approx(CMU)
            assert found.up.value == "y"
            assert found.root.value == 0
        for limb in ("hip", "knee", "ankle", "shoulder", "elbow"):
            for side in made.SIDES:
                a, b = (found.joints.value[f"{side}_{limb}"] for found in (named, shaped))
                np.testing.assert_allclose(at[:, a], at[:, b], atol=0.2)


def test_several_clips_agree_where_one_lies(walk):
    lying = np.zeros_like(walk.channels)
    columns = {name: i for i, name in enumerate(walk.skeleton.channel_names)}
    lying[:, columns["hips.rx"]] = 90.0
    lying[:, columns["hips.ty"]] = 0.1
    lying[:, columns["left_elbow.ry"]] = -20 * np.sin(np.arange(len(lying)))
    bare = made.with_rest(walk, Rotation.random(walk.skeleton.n_joints, rng=5).as_matrix())
    lain = made.with_rest(
        replace(walk, channels=lying), Rotation.random(walk.skeleton.n_joints, rng=5).as_matrix()
    )
    together = understand(bare.skeleton, [bare.channels, bare.channels, lain.channels])
    assert together.up.value == "y"
    assert understand(walk.skeleton, lying).up.value == "y"  # its rest pose and the floor tell


def test_without_motion_the_rest_pose_is_asked(walk):
    found = understand(walk.skeleton)
    assert found.is_human
    assert (found.up.value, found.unit_m.value) == ("y", 1.0)


def test_what_is_given_wins(walk):
    joints = {"left_knee": "left_knee", "head": "neck"}
    found = understand(walk.skeleton, walk.channels, Given(0.01, "z", joints))
    assert (found.unit_m.value, found.unit_m.source) == (0.01, "given")
    assert (found.up.value, found.up.source) == ("z", "given")
    assert walk.roles[found.joints.value["head"]] == "neck"
    everything = {name: role for name, role in made.CANONICAL.items() if name != "chest"}
    found = understand(walk.skeleton, walk.channels, Given(joints=everything))
    assert found.joints.source == "given"


@pytest.mark.parametrize(
    ("joints", "message"),
    [
        ({"left_knee": "nobody"}, "'nobody'"),
        ({"left_claw": "left_knee"}, "'left_claw'"),
        ({"left_knee": "left_knee", "left_ankle": "left_knee"}, "once"),
        ({"left_knee": "right_knee"}, "left side"),
        ({"left_knees": "left_knee"}, "left_knee"),
        ({"left_knee": "Left_Kne"}, "Did you mean left_knee"),
        ({"left_knee": ""}, "It has: hips"),
    ],
)
def test_joint_maps_that_do_not_fit(walk, joints, message):
    with pytest.raises(SkeletonError, match=message):
        understand(walk.skeleton, walk.channels, Given(joints=joints))
    with pytest.raises(SkeletonError, match=message):  # kept by the skeleton, it means the same
        understand(replace(walk.skeleton, joint_map=joints), walk.channels)


class TestGivenToUnknownNames:
    """The names tell nothing: what is said of sides is held against the anatomy."""

    @pytest.fixture
    def plain(self, walk):
        return made.renamed(walk)

    @staticmethod
    def said(body, **joints):
        names = dict(zip(body.roles, body.skeleton.names, strict=True))
        return Given(joints={joint: names[role] for joint, role in joints.items()})

    def test_some_joints(self, plain):
        given = self.said(plain, left_knee="left_knee", head="neck")
        found = understand(plain.skeleton, plain.channels, given)
        assert plain.roles[found.joints.value["left_knee"]] == "left_knee"
        assert plain.roles[found.joints.value["head"]] == "neck"
        assert found.joints.evidence == "joints by shape, some given"

    def test_a_knee_of_the_other_leg(self, plain):
        given = self.said(plain, left_knee="right_knee")
        with pytest.raises(SkeletonError, match="is on the right side"):
            understand(plain.skeleton, plain.channels, given)

    def test_knees_exchanged(self, plain):
        given = self.said(plain, left_knee="right_knee", right_knee="left_knee")
        with pytest.raises(SkeletonError, match=r"left_knee below left_hip.*on the right side"):
            understand(plain.skeleton, plain.channels, given)

    def test_legs_exchanged(self, plain):
        limbs = ("hip", "knee", "ankle", "toe", "shoulder", "elbow", "wrist")
        sides = {"left": "right", "right": "left"}
        exchanged = {
            f"{side}_{limb}": f"{other}_{limb}" for side, other in sides.items() for limb in limbs
        }
        with pytest.raises(SkeletonError, match="Exchange left and right"):
            understand(plain.skeleton, plain.channels, self.said(plain, **exchanged))
        right = {joint: joint for joint in exchanged}
        assert understand(plain.skeleton, plain.channels, self.said(plain, **right)).is_human

    @pytest.mark.parametrize(("facing", "is_refused"), [(-0.45, False), (-0.55, True)])
    def test_hips_that_are_hardly_mirrored_stay(self, plain, monkeypatch, facing, is_refused):
        name = "mocapdb.motion.body.understanding.facing_left"
        monkeypatch.setattr(name, lambda tree, nodes: facing)
        given = self.said(plain, left_hip="left_hip", right_hip="right_hip")
        if is_refused:
            with pytest.raises(SkeletonError, match="Exchange left and right"):
                understand(plain.skeleton, plain.channels, given)
        else:
            assert understand(plain.skeleton, plain.channels, given).is_human

    def test_an_ankle_above_a_knee(self, plain):
        given = self.said(plain, left_knee="left_ankle", left_ankle="left_knee")
        with pytest.raises(SkeletonError, match="left_ankle below left_knee"):
            understand(plain.skeleton, plain.channels, given)


class TestRefused:
    def test_a_dog_whatever_its_names(self):
        dog = made.make_dog()
        for body in (dog, made.renamed(dog), made.renamed(dog, NAMES["3ds Max Biped"])):
            found = understood(body)
            assert not found.is_human
            assert found.refusal
            assert not found.joints.value
            assert found.collars == {}

    def test_a_person_on_all_fours_is_none(self, walk):
        columns = {name: i for i, name in enumerate(walk.skeleton.channel_names)}
        channels = walk.channels.copy()
        channels[:, columns["hips.rx"]] = 90.0
        for side in made.SIDES:
            channels[:, columns[f"{side}_hip.rx"]] -= 90.0
            for axis in "xyz":
                channels[:, columns[f"{side}_shoulder.r{axis}"]] = 0.0
            channels[:, columns[f"{side}_shoulder.ry"]] = -90.0 if side == "left" else 90.0
        crawling = replace(walk, channels=channels)
        assert understood(crawling).is_human

    def test_limbs_missing(self, walk):
        for roles, word in (
            (("left_shoulder", "right_shoulder"), "elbow"),
            (("left_knee", "right_knee"), "ankle"),
        ):
            found = understood(made.without(walk, *roles))
            assert not found.is_human
            assert word in found.refusal

    def test_a_hand_and_a_crab(self, walk):
        hand = made.without(walk, "left_shoulder", "right_shoulder", "neck")
        assert "pair" in understood(made.renamed(hand)).refusal
        twice = made.with_more_limbs(walk, 2)
        assert "4 pairs" in understood(made.renamed(twice)).refusal

    def test_a_bird_has_short_arms_and_a_long_neck(self, walk):
        offsets = walk.skeleton.offsets.copy()
        for joint, role in enumerate(walk.roles):
            if role.endswith(("elbow", "wrist")):
                offsets[joint] *= 0.4
            if role in ("neck", "head"):
                offsets[joint] *= 6.0
        bird = replace(walk, skeleton=replace(walk.skeleton, offsets=offsets))
        for body in (bird, made.renamed(bird)):
            assert not understood(body).is_human

    def test_a_single_joint(self):
        walk = made.make_walk(3)
        point = made.without(walk, *[role for role in walk.roles if role != "hips"])
        found = understood(point)
        assert not found.is_human
        assert found.root.value == 0


class TestProperties:
    @settings(max_examples=15)
    @given(st.integers(0, 2**32 - 1), st.sampled_from(UNITS), st.booleans(), st.booleans())
    def test_rest_pose_unit_up_order_and_names_change_nothing(self, seed, unit_m, is_z, is_named):
        rng = np.random.default_rng(seed)
        body = made.make_walk(40, legs=rng.uniform(0.94, 1.06))
        bases = Rotation.random(body.skeleton.n_joints, rng=rng).as_matrix()
        body = made.permuted(made.with_rest(body, bases), rng)
        if is_z:
            body = made.turned_up(body)
        if not is_named:
            body = made.renamed(body)
        check(made.in_units(body, unit_m), by="names" if is_named else "shape")

    @settings(max_examples=15)
    @given(st.floats(0.7, 1.25), st.integers(0, 2**32 - 1))
    def test_stature_scales_with_the_body(self, size, seed):
        rng = np.random.default_rng(seed)
        body = made.renamed(made.permuted(made.make_walk(40), rng))
        tall = made.in_units(body, 1 / size)
        found = understood(tall)
        assert found.unit_m.value == 1.0
        assert found.height_m == pytest.approx(size * understood(body).height_m)

    @given(clips(max_joints=12))
    def test_anything_is_understood_or_refused(self, clip):
        found = understand(clip.skeleton, clip.channels)
        assert set(found.joints.value) <= set(JOINTS)
        assert found.is_human == (not found.refusal)
        assert 0 <= found.root.value < clip.skeleton.n_joints

    @given(skeletons())
    def test_a_skeleton_without_motion_too(self, skeleton):
        found = understand(skeleton)
        assert found.unit_m.value > 0
        assert 0 <= found.unit_m.confidence <= 1

    def test_lengths_out_of_this_world_raise_nothing(self, walk):
        offsets = walk.skeleton.offsets * 1e200
        assert understand(replace(walk.skeleton, offsets=offsets), walk.channels).unit_m.value > 0


def test_sides_of_a_mirrored_export_are_those_of_the_body():
    plain = made.make_walk()
    sided = {role: f"{role[0].upper()}_x{i}" for i, role in enumerate(plain.roles) if "_" in role}
    right = made.renamed(plain, sided)
    swapped = {role: f"{'RL'['lr'.index(role[0])]}_x{i}"
               for i, role in enumerate(plain.roles) if role[:4] in ("left", "righ")}  # fmt: skip
    wrong = made.renamed(plain, swapped)
    for body in (right, wrong):
        found = understand(body.skeleton, body.channels)
        assert found.by == "shape"
        assert body.roles[found.joints.value["left_knee"]] == "left_knee"
        assert body.roles[found.joints.value["right_wrist"]] == "right_wrist"


def test_named_sides_of_a_mirrored_export_too():
    plain = made.make_walk()
    named = dict(zip(plain.roles, plain.skeleton.names, strict=True))
    mirrored = made.renamed(plain, {role: named[other_side(role)] for role in named})
    found = understood(mirrored)
    assert found.by == "names"
    assert found.is_mirrored
    assert "left and right exchanged" in found.joints.evidence
    assert roles_found(mirrored, found) == roles_found(plain, understood(plain))
    assert not understood(plain).is_mirrored


TURNED = [("-y", (180, 0, 0)), ("x", (0, 0, -90)), ("-z", (-90, 0, 0))]


@pytest.mark.parametrize(("up", "turn"), TURNED)
def test_a_direction_that_only_the_motion_stands_along_is_told(walk, up, turn):
    body = made.under_scene(walk)
    channels = body.channels.copy()
    names = list(body.skeleton.channel_names)
    scene = body.skeleton.names[0]
    for axis, angle in zip("xyz", turn, strict=True):
        channels[:, names.index(f"{scene}.r{axis}")] = angle
    found = understand(body.skeleton, channels)
    assert found.up.source == "assumed"
    assert found.up.evidence.endswith(f"--up {up}")


def test_the_unit_of_what_is_no_human_is_assumed(walk):
    dog = made.make_dog()
    found = understood(dog)
    assert found.unit_m.source == "assumed"
    assert " assumed: " in found.unit_m.evidence
    assert found.odd_stature == ""
    assert understood(walk).unit_m.source == "found"


@pytest.mark.parametrize(("size", "is_odd"), [(1.0, False), (4.0, True), (0.1, True)])
def test_odd_statures(walk, size, is_odd):
    offsets = walk.skeleton.offsets * size
    body = understand(replace(walk.skeleton, offsets=offsets), walk.channels, Given(unit_m=1.0))
    assert bool(body.odd_stature) == is_odd


def test_an_amc_of_any_body_is_understood_and_its_way_back():
    made_walk = made.with_positions(made.under_scene(made.along_x(made.make_walk(30))), "places")
    clip = Clip(made_walk.skeleton, made_walk.channels, 30.0)
    before = understood(made_walk)
    assert before.is_human
    for step in (to_acclaim_convention, to_bvh_convention):
        clip = step(clip)
        found = understand(clip.skeleton, clip.channels)
        assert found.is_human, found.refusal
        assert found.by == before.by
        assert found.height_m == pytest.approx(before.height_m, rel=0.01)
