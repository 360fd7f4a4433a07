"""Hypothesis strategies: skeletons of both conventions and clips that move them."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import Skeleton


@st.composite
def skeletons(draw, convention=None, max_joints=8, shifts=True):
    """Any tree of joints with any degrees of freedom; bones of no length among them."""
    convention = convention or draw(st.sampled_from(["acclaim", "bvh"]))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n_joints = draw(st.integers(1, max_joints))
    parents = [-1, *(int(rng.integers(0, joint)) for joint in range(1, n_joints))]
    dofs, orders = [], []
    for joint in range(n_joints):
        axes = "".join(rng.permutation(list("xyz")))[: 3 if joint == 0 else int(rng.integers(0, 4))]
        turns = tuple(f"r{axis}" for axis in axes)
        moves = ("tx", "ty", "tz") if joint == 0 else ()
        if shifts and joint and convention == "bvh" and turns and rng.random() < 0.2:
            moves = ("tx", "ty", "tz")
        dofs.append((*moves, *turns))
        orders.append((axes if convention == "bvh" else axes[::-1]).upper())
    offsets = rng.normal(size=(n_joints, 3))
    offsets[rng.random(n_joints) < 0.15] = 0.0
    axis_deg = None
    if convention == "acclaim":
        axis_deg = rng.uniform(-180, 180, (n_joints, 3)) * (rng.random((n_joints, 1)) < 0.6)
    return Skeleton(
        [f"joint{joint}" for joint in range(n_joints)],
        parents,
        offsets,
        dofs,
        orders,
        axis_deg=axis_deg,
        convention=convention,
        metres_per_unit=draw(st.sampled_from([1.0, 0.01, 0.0254 / 0.45])),
        up=draw(st.sampled_from(["y", "z"])),
        name="any",
    )


@st.composite
def clips(draw, convention=None, max_joints=8, max_frames=40, shifts=True):
    """Clips of such skeletons: smooth, wild or still."""
    skeleton = draw(skeletons(convention, max_joints, shifts))
    n_frames = draw(st.integers(1, max_frames))
    kind = draw(st.sampled_from(["smooth", "wild", "still"]))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    shape = (n_frames, skeleton.n_channels)
    if kind == "smooth":
        time = np.linspace(0, 2 * np.pi, n_frames)[:, None]
        channels = rng.uniform(-60, 60, shape[1]) * np.sin(time + rng.uniform(0, 6, shape[1]))
    elif kind == "wild":
        channels = rng.uniform(-360, 360, shape)
    else:
        channels = np.tile(rng.uniform(-90, 90, shape[1]), (n_frames, 1))
    return Clip(skeleton, channels, draw(st.sampled_from([24.0, 30.0, 120.0])), name="any")
