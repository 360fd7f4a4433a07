import numpy as np
import pytest

from mocapdb.cycles.curve.rotation_values import choose_rotation_values


def test_rotation_values_go_there_and_back(synthetic_walk):
    from mocapdb.cycles.curve.rotation_values import local_rotations

    plain = choose_rotation_values(synthetic_walk)
    assert plain.matrix_joints == ()
    local = local_rotations(synthetic_walk.skeleton, synthetic_walk.channels)
    np.testing.assert_allclose(plain.decode(plain.encode(synthetic_walk)), local, atol=1e-9)
    whole = type(plain)(plain.skeleton, (0, plain.skeleton.joint("lhumerus")))
    values = whole.encode(synthetic_walk)
    np.testing.assert_allclose(whole.decode(values), local, atol=1e-9)
    assert len(whole.names()) == values.shape[1] == plain.encode(synthetic_walk).shape[1] + 12


def test_a_joint_that_turns_all_the_way_round_is_written_as_a_matrix(synthetic_walk):
    channels = synthetic_walk.channels.copy()
    first = synthetic_walk.skeleton.channel_starts[synthetic_walk.skeleton.joint("lhumerus")]
    channels[:, first] += 360.0 * np.arange(len(synthetic_walk)) / 130
    spin = synthetic_walk.replace(channels=channels)
    assert choose_rotation_values(spin).matrix_joints == (spin.skeleton.joint("lhumerus"),)


def with_angle(clip, place, angles_deg):
    """A clip whose upper arm has other angles, at a place in its rotation order."""
    channels = clip.channels.copy()
    joint = clip.skeleton.joint("lhumerus")
    channels[:, clip.skeleton.rotation_columns(joint)] = 0.0
    channels[:, clip.skeleton.rotation_columns(joint)[place]] = angles_deg
    return clip.replace(channels=channels)


@pytest.mark.parametrize(
    ("place", "angles_deg", "is_matrix"),
    [
        (0, np.linspace(-128, 128, 600), False),
        (0, np.linspace(-140, 140, 600), True),
        (1, 76.0, False),
        (1, 80.0, True),
    ],
    ids=["wide", "too wide", "near lock", "too near lock"],
)
def test_angles_are_matrices_where_they_would_jump(synthetic_walk, place, angles_deg, is_matrix):
    clip = with_angle(synthetic_walk, place, angles_deg)
    assert (
        clip.skeleton.joint("lhumerus") in choose_rotation_values(clip).matrix_joints
    ) == is_matrix
