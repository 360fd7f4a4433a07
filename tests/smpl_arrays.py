"""Arrays as AMASS has them, and body models as SMPL's family is given out, made up."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from mocapdb.io.smpl_bodies import generic_body, joints_of

F = 40


def arrays(model="smplh", seed=0):
    """A body that stands in AMASS's world, Z up, and turns and bends a little."""
    rng = np.random.default_rng(seed)
    n_joints = len(joints_of(model)[0])
    poses = np.cumsum(rng.normal(size=(F, n_joints, 3)) * 0.01, axis=0)
    stand = Rotation.from_euler("x", 90, degrees=True)
    poses[:, 0] = (Rotation.from_rotvec(poses[:, 0] + [0, 0, 0.3]) * stand).as_rotvec()
    return {
        "poses": poses.reshape(F, -1),
        "trans": np.cumsum(rng.normal(size=(F, 3)) * 0.01, axis=0) + np.array([0, 0, 0.95]),
        "betas": rng.normal(size=16),
        "gender": np.array("female"),
        "mocap_framerate": np.array(60.0),
        "dmpls": np.zeros((F, 8)),
    }


def body_model(path, model="smplh", seed=1):
    """A body model with the arrays of the real ones, of another size: a joint is a vertex."""
    rng = np.random.default_rng(seed)
    rest = 1.1 * generic_body(model).rest_m + [0.0, -0.3, 0.02]
    np.savez(
        path,
        v_template=rest,
        J_regressor=np.eye(len(rest)),
        shapedirs=rng.normal(size=(len(rest), 3, 10)) * 0.001,
        kintree_table=np.zeros((2, len(rest))),
    )
    return rest
