import numpy as np

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
