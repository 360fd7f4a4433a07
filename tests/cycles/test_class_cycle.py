import csv
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocapdb.corpus import synthetic
from mocapdb.cycles import average_cycles, class_cycle, extract_cycle, make_loop
from mocapdb.cycles.class_curves import write_curves
from mocapdb.cycles.class_cycle import joint_weights, mirror_rotations
from mocapdb.cycles.cycle import from_columns, joint_positions, to_columns
from mocapdb.errors import CycleError, NoPeriodError
from mocapdb.io.conventions import to_bvh_convention
from mocapdb.motion.rotations import elementary
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
    heights = [cycle.skeleton.height for cycle in crowd]
    assert found.cycle.skeleton.height == min(heights, key=lambda h: abs(h - np.mean(heights)))
    assert found.spread_rad.shape == (len(found.cycle.sway), 31)
    assert np.rad2deg(found.spread_rad).mean() < 8
    ratio = amplitude(found.cycle) / np.median([amplitude(cycle) for cycle in crowd])
    assert 0.85 < ratio < 1.1


def test_an_outlier_is_left_out(crowd):
    squat = extract_cycle(synthetic.make_clip("squat", seed=0, n_cycles=3, name="odd")).cycle
    found = average_cycles([*crowd, squat], "walk")
    assert "odd" not in found.members
    assert "too far" in found.left_out["odd"]


def stride_m(cycle):
    level = np.delete(cycle.advance, cycle.skeleton.up_index)
    return np.linalg.norm(level) * cycle.skeleton.metres_per_unit


def test_stride_and_cadence_are_the_means_of_the_members(crowd):
    some = crowd[:3]  # their mean height is that of none of them
    found = average_cycles(some, "walk")
    assert found.members == ("w0", "w1", "w2")
    assert stride_m(found.cycle) == pytest.approx(
        np.mean([stride_m(one) for one in some]), rel=0.01
    )
    pace = np.mean([1 / one.period_s for one in some])
    assert 1 / found.cycle.period_s == pytest.approx(pace)


def test_another_kind_of_human_skeleton_joins(crowd, synthetic_walk):
    bvh = extract_cycle(to_bvh_convention(synthetic_walk.replace(name="bvh"))).cycle
    found = average_cycles([bvh, *crowd[:3]], "walk")
    assert set(found.members) == {"bvh", "w0", "w1", "w2"}
    assert found.cycle.skeleton in [one.skeleton for one in crowd]
    members = [stride_m(one) for one in (bvh, *crowd[:3])]
    assert stride_m(found.cycle) == pytest.approx(np.mean(members), rel=0.01)
    assert np.rad2deg(found.spread_rad).mean() < 8


def test_a_skeleton_that_is_no_body_is_left_out(crowd):
    chain = Skeleton(
        ("hip", "knee", "ankle"), [-1, 0, 1], [[0, 0, 0], [0, 3, 0], [0, 1, 0]],
        [("rx",), ("rx",), ()], ["X", "X", ""], convention="bvh",
    )  # fmt: skip
    own = crowd[0]
    odd = replace(own, skeleton=chain, columns=own.columns[:, :3], translations=np.zeros(0),
                  name="odd")  # fmt: skip
    found = average_cycles([*crowd[:3], odd], "walk")
    assert "another kind" in found.left_out["odd"]
    assert len(found.members) == 3


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


def test_members_twice_as_far_as_usual_are_left_out(walk, monkeypatch):
    monkeypatch.setattr(class_cycle, "LEAST_VARIETY", 0.0)  # these are alike but for noise
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


def tilted(cycle, share, name):
    """The cycle with its whole body tilted so that it is a share of its amplitude away."""
    joints = joint_weights(cycle.skeleton)
    moved = cycle.columns - cycle.columns.mean(axis=0)
    amplitude = np.sqrt(((moved**2).sum(axis=2) @ joints).mean())
    angle = share * amplitude / np.sqrt(joints[0] * 4 / 3)  # of six numbers two thirds turn
    for _ in range(8):
        turned = from_columns(cycle.columns)
        turned[:, 0] = elementary("X", np.array(angle)) @ turned[:, 0]
        columns = to_columns(turned)
        away = np.sqrt((((columns - cycle.columns) ** 2).sum(axis=2) @ joints).mean())
        angle *= share * amplitude / away
    return replace(cycle, columns=columns, name=name)


@pytest.mark.parametrize(("share", "kept"), [(0.68, True), (0.8, False)])
def test_another_person_belongs_to_takes_that_are_all_alike(walk, share, kept):
    takes = [replace(walk, name=f"take {i}") for i in range(4)]
    found = average_cycles([*takes, tilted(walk, share, "another")], "walk")
    assert ("another" in found.members) == kept


def test_a_person_of_many_takes_does_not_outvote_the_others(walk):
    people = ["a"] * 4 + ["b", "c"]
    takes = [replace(walk, name=f"take {i}") for i in range(4)]
    cycles = [*takes, tilted(walk, 1.0, "b"), tilted(walk, 1.1, "c")]
    assert len(average_cycles(cycles, "walk", people=people).members) == 6
    alone = average_cycles(cycles, "walk")  # of one skeleton, so one person's
    assert set(alone.left_out) == {"b", "c"}
    reason = alone.left_out["c"]
    assert "times as far from their mean as the median person, over" in reason


@pytest.mark.parametrize(("unlike", "fits"), [(1.1, True), (1.9, False)])
def test_cycles_with_nothing_in_common_make_no_mean(walk, unlike, fits):
    angle = 2 * np.pi * np.arange(len(walk.sway)) / len(walk.sway)
    thigh = walk.skeleton.joint("lfemur")
    still = np.tile(walk.columns.mean(axis=0), (len(angle), 1, 1))
    cycles = []
    for harmonic in (2, 3, 4):  # beside what they share, which leaves 0.6 and 0.72
        swing = 0.1 * (np.sin(angle) + unlike * np.sin(harmonic * angle))
        columns = still.copy()
        columns[:, thigh] = to_columns(elementary("X", swing))
        cycles.append(replace(walk, columns=columns, name=f"{harmonic}"))
    if fits:
        assert len(average_cycles(cycles, "swing").members) == 3
    else:
        with pytest.raises(NoPeriodError, match="nothing in common"):
            average_cycles(cycles, "swing")


def test_stride_cadence_and_body_are_the_members_means(walk):
    members = [
        replace(walk, name=str(i), period_s=period, advance=size * walk.advance)
        for i, (period, size) in enumerate(((1.0, 0.9), (1.1, 1.0), (1.4, 1.2)))
    ]
    found = average_cycles(members, "walk").cycle
    assert 1 / found.period_s == pytest.approx((1 / 1.0 + 1 / 1.1 + 1 / 1.4) / 3)
    np.testing.assert_allclose(found.advance, 3.1 / 3 * walk.advance)


def test_curves_are_written_as_a_table(walk, tmp_path):
    found = average_cycles([walk, replace(walk, name="again")], "walk")
    write_curves(found, tmp_path / "walk.csv", start=0.25)
    with (tmp_path / "walk.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    skeleton = walk.skeleton
    assert len(rows) == 101 * sum(len(skeleton.rotation_columns(j)) for j in range(31))
    knee = [row for row in rows if (row["joint"], row["channel"]) == ("ltibia", "rx")]
    assert [row["phase_percent"] for row in knee] == [str(i) for i in range(101)]
    angles = np.array([float(row["mean_deg"]) for row in knee])
    loop = make_loop(walk.rephased(0.25), root="in-place", hold_feet=False, lap_frames=100).clip
    column = skeleton.channel_names.index("ltibia.rx")
    np.testing.assert_allclose(angles[:100], loop.channels[:, column], atol=0.1)
    assert angles[0] == pytest.approx(angles[100], abs=1e-3)
    assert all(float(row["spread_deg"]) < 1.0 for row in knee)
