"""Files of many exporters: unit, up axis, size and joints as they were written down by hand."""

import numpy as np
import pytest
from zoo_names import CASES, NOT_HUMAN, extent_m, names_of, zoo_rows

from mocapdb.errors import FormatError
from mocapdb.io.bvh import read_bvh
from mocapdb.motion.body import understand
from mocapdb.motion.foot_contacts import find_legs
from mocapdb.motion.kinematics import forward_kinematics


def read(path):
    try:
        return read_bvh(path)
    except FormatError as problem:
        pytest.skip(f"not read yet: {problem}")


def test_units_axes_and_extents(zoo):
    wrong = []
    for row in zoo_rows(zoo):
        clip = read_bvh(zoo / row["file"])
        skeleton = clip.skeleton
        if row["unit_m"] and skeleton.metres_per_unit != pytest.approx(
            float(row["unit_m"]), rel=1e-3
        ):
            wrong.append((row["file"], "unit", skeleton.metres_per_unit))
        if row["up"] and skeleton.up != row["up"]:
            wrong.append((row["file"], "up", skeleton.up))
        if row["extent_m"] and extent_m(clip) != pytest.approx(float(row["extent_m"]), rel=0.03):
            wrong.append((row["file"], "extent", extent_m(clip)))
    assert not wrong


def test_humans_are_mapped_and_others_refused(zoo):
    wrong = []
    for row in zoo_rows(zoo):
        path = zoo / row["file"]
        clip = read_bvh(path)
        body = understand(clip.skeleton, clip.channels)
        if path.name.startswith(NOT_HUMAN):
            assert not body.is_human, row["file"]
            assert body.refusal
        if row["body"] != "human":
            continue
        assert body.is_human, (row["file"], body.refusal)
        found = {joint: clip.skeleton.names[index] for joint, index in body.joints.value.items()}
        for joint, name in names_of(path).items():
            if found[joint] != name:
                wrong.append((row["file"], joint, name, found[joint]))
    assert not wrong


@pytest.mark.parametrize("case", CASES)
def test_cases(zoo, case):
    up, unit_m, extent = CASES[case]
    path = zoo / "cases" / f"{case}.bvh"
    clip = read(path)
    assert (clip.skeleton.up, clip.skeleton.metres_per_unit) == (up, unit_m)
    assert extent_m(clip) == pytest.approx(extent, rel=0.01)
    expected = names_of(path)
    if expected is not None:
        found = understand(clip.skeleton, clip.channels).joints.value
        assert {j: clip.skeleton.names[found[j]] for j in expected} == expected


def test_displacements_pose_the_body_as_places_do(zoo):
    displaced, placed = (
        read(zoo / "cases" / f"{name}.bvh")
        for name in ("K2_positions_are_displacements", "H_toe_tip_zero_end_site")
    )
    at, there = (
        forward_kinematics(clip.skeleton, clip.channels).positions for clip in (displaced, placed)
    )
    np.testing.assert_allclose(at, there, atol=1e-6)


def test_bandai_s_root_and_legs(zoo):
    for path in sorted((zoo / "bandai").glob("*_walk_*.bvh")):
        clip = read(path)
        assert clip.skeleton.names[understand(clip.skeleton, clip.channels).root.value] == "Hips"
        legs = find_legs(clip.skeleton)
        assert [clip.skeleton.names[leg.knee] for leg in legs] == ["LowerLeg_L", "LowerLeg_R"]
