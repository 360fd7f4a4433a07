"""Naive twins: the same results as the fast code, written only to be read."""

import numpy as np
from scipy.spatial.transform import Rotation


def naive_forward_kinematics(clip):
    """World positions (F, J, 3) and rotations (F, J, 3, 3), a joint and a frame at a time."""
    skeleton = clip.skeleton
    positions = np.zeros((len(clip), skeleton.n_joints, 3))
    rotations = np.zeros((len(clip), skeleton.n_joints, 3, 3))
    for frame, channels in enumerate(clip.channels):
        column = 0
        for joint, dofs in enumerate(skeleton.dofs):
            values = dict(zip(dofs, channels[column : column + len(dofs)], strict=True))
            column += len(dofs)

            order = skeleton.rotation_orders[joint]
            turn = np.eye(3)
            for axis in order:
                vector = values[f"r{axis.lower()}"] * np.eye(3)["XYZ".index(axis)]
                turn = turn @ Rotation.from_rotvec(vector, degrees=True).as_matrix()
            axes = Rotation.from_euler("xyz", skeleton.axis_deg[joint], degrees=True).as_matrix()
            local = axes @ turn @ axes.T

            offset = skeleton.offsets[joint].copy()
            shift = np.zeros(3)
            for i, axis in enumerate("xyz"):
                if f"t{axis}" in values:
                    shift[i] = values[f"t{axis}"]
                    if skeleton.convention == "bvh":
                        offset[i] = 0.0

            parent = skeleton.parents[joint]
            above = np.eye(3) if parent < 0 else rotations[frame, parent]
            start = np.zeros(3) if parent < 0 else positions[frame, parent]
            rotations[frame, joint] = above @ local
            carrier = rotations[frame, joint] if skeleton.convention == "acclaim" else above
            positions[frame, joint] = start + above @ shift + carrier @ offset
    return positions, rotations
