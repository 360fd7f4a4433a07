from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocapdb.corpus import synthetic
from mocapdb.cycles import average_cycles, extract_cycle
from mocapdb.cycles.class_cycle import joint_weights, mirror_rotations
from mocapdb.cycles.cycle import from_columns, joint_positions, to_columns
from mocapdb.errors import CycleError
from mocapdb.io.conventions import to_bvh_convention
from mocapdb.motion.skeleton import Skeleton


def amplitude(cycle):
    positions = joint_positions(cycle)
    return np.sqrt(((positions - positions.mean(axis=0)) ** 2).sum())


@pytest.fixture(scope="module")
def crowd():
    cycles = []
    for seed in range(5):
        clip = synthetic.make_clip(
            "walk", seed=seed, skeleton=synthetic.subject(seed), heading_deg=40.0 * seed,
            name=f"w{seed}",
        )  # fmt: skip
        cycles.append(extract_cycle(clip).cycle)
    return cycles


def test_a_class_is_the_mean_of_bodies(crowd):
    found = average_cycles(crowd, "walk")
    assert found.members == tuple(f"w{seed}" for seed in range(5))
    assert found.mirrored == ()
    heights = sorted(cycle.skeleton.height for cycle in crowd)
    assert found.cycle.skeleton.height == heights[2]
    assert found.spread_rad.shape == (len(found.cycle.sway), 31)
    assert np.rad2deg(found.spread_rad).mean() < 8
    ratio = amplitude(found.cycle) / np.median([amplitude(cycle) for cycle in crowd])
    assert 0.85 < ratio < 1.1


def test_an_outlier_is_left_out(crowd):
    squat = extract_cycle(synthetic.make_clip("squat", seed=0, n_cycles=3, name="odd")).cycle
    found = average_cycles([*crowd, squat], "walk")
    assert "odd" not in found.members
    assert "too far" in found.left_out["odd"]


def test_another_kind_of_skeleton_is_left_out(crowd, synthetic_walk):
    bvh = extract_cycle(to_bvh_convention(synthetic_walk.replace(name="bvh"))).cycle
    found = average_cycles([*crowd, bvh], "walk")
    assert "another kind" in found.left_out["bvh"]


def test_sides_are_brought_together_where_that_is_asked_for():
    wave = extract_cycle(synthetic.make_clip("wave", seed=1, name="right")).cycle
    other = replace(wave, columns=mirror_rotations(wave.columns, wave.skeleton), name="left")
    assert average_cycles([wave, other, wave], "wave").mirrored == ()
    found = average_cycles([wave, other, wave], "wave", mirror_members="auto")
    assert found.mirrored == ("left",)
    assert np.rad2deg(found.spread_rad).max() < 1


def test_mirroring_twice_is_nothing(walk):
    twice = mirror_rotations(mirror_rotations(walk.columns, walk.skeleton), walk.skeleton)
    np.testing.assert_allclose(from_columns(twice), from_columns(walk.columns), atol=1e-9)


def test_no_cycles_no_class():
    with pytest.raises(CycleError, match="Expected cycles"):
        average_cycles([], "walk")


def test_a_thumbs_calibration_neither_mirrors_nor_excludes(crowd):
    odd = crowd[0]
    columns = odd.columns.copy()
    for side in "lr":
        for name, angle in (("thumb", 1.2), ("fingers", -0.9), ("toes", 0.7)):
            joint = odd.skeleton.joint(side + name)
            turned = Rotation.from_euler("y", angle).as_matrix() @ from_columns(columns[:, joint])
            columns[:, joint] = to_columns(turned)
    odd = replace(odd, columns=columns, name="odd")
    found = average_cycles([odd, *crowd[1:]], "walk", mirror_members="auto")
    assert found.mirrored == ()
    assert "odd" in found.members


def test_a_joint_weighs_what_it_moves():
    chain = Skeleton(
        ("hip", "knee", "ankle"),
        [-1, 0, 1],
        [[0, 0, 0], [0, 3, 0], [0, 1, 0]],
        [("rx",), ("rx",), ()],
        ["X", "X", ""],
        convention="bvh",
    )
    # rods of lengths 3 and 1 in one line, each about its own end: L^3 / 3 for the whole or a part
    inertia = np.array([4.0**3, 1.0, 0.0]) / 3.0
    np.testing.assert_allclose(joint_weights(chain), inertia / inertia.sum())


def test_members_twice_as_far_as_usual_are_left_out(walk):
    rng = np.random.default_rng(0)
    near = [
        replace(walk, name=f"n{i}", columns=walk.columns + rng.normal(0, 0.01, walk.columns.shape))
        for i in range(6)
    ]
    for times, is_kept in ((1.8, True), (2.4, False)):
        off = rng.normal(0, 0.01 * times, walk.columns.shape)
        far = replace(walk, name="far", columns=walk.columns + off)
        assert ("far" in average_cycles([*near, far], "walk").members) == is_kept


@pytest.mark.parametrize(("share", "is_mirrored"), [(0.44, True), (0.47, False)])
def test_a_mirror_image_must_be_far_nearer(share, is_mirrored):
    wave = extract_cycle(synthetic.make_clip("wave", seed=1, fps=60.0)).cycle
    other = mirror_rotations(wave.columns, wave.skeleton)
    between = replace(wave, name="x", columns=(1 - share) * other + share * wave.columns)
    found = average_cycles([wave, between], "wave", mirror_members="auto")
    assert (found.mirrored == ("x",)) == is_mirrored
