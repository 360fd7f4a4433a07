"""AMASS and other motions of SMPL's bodies: rotations exactly, bones by the model that is named."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from small_library import run, run_json
from smpl_arrays import F, arrays, body_model

from mocapdb.corpus import synthetic
from mocapdb.errors import FormatError, SkeletonError
from mocapdb.io import read_clip, write_clip, write_representation, write_smpl
from mocapdb.io.conventions import to_bvh_convention
from mocapdb.io.smpl_bodies import BODY_MODELS, joints_of, read_body_model
from mocapdb.motion.body import understand


@pytest.fixture
def path(tmp_path):
    np.savez(tmp_path / "walk_poses.npz", **arrays())
    return tmp_path / "walk_poses.npz"


def turns(first, second):
    a, b = (Rotation.from_rotvec(np.reshape(poses, (-1, 3))) for poses in (first, second))
    return (a.inv() * b).magnitude().max()


@pytest.mark.parametrize("model", BODY_MODELS)
def test_rotations_come_back_exactly(tmp_path, model):
    np.savez(tmp_path / "in.npz", **arrays(model))
    clip = read_clip(tmp_path / "in.npz")
    assert clip.skeleton.names == joints_of(model)[0]
    written = write_smpl(clip, tmp_path / "out.npz", model, like=tmp_path / "in.npz")
    assert written.provenance[-1] == f"written as {model}"
    with np.load(tmp_path / "in.npz") as before, np.load(tmp_path / "out.npz") as after:
        assert turns(before["poses"], after["poses"]) < 1e-12
        assert np.allclose(before["trans"], after["trans"], atol=1e-12)
        assert np.array_equal(before["betas"], after["betas"])
        assert (str(after["gender"]), after["mocap_framerate"]) == ("female", 60)


def test_it_stands_y_up_as_a_human(path):
    clip = read_clip(path)
    assert (clip.fps, clip.fps_source, clip.skeleton.up, clip.name) == (60, "file", "y", path.stem)
    body = understand(clip.skeleton, clip.channels)
    assert body.is_human
    assert 1.6 < body.height_m < 1.9
    head, foot = (clip.positions()[:, clip.skeleton.joint(n), 1] for n in ("head", "left_foot"))
    assert (head - foot > 1.2).all()
    assert "bones of a generic adult of 1.75 m" in clip.provenance
    local = clip.rotations(form="rotvec")[:, 5]
    assert turns(local, arrays()["poses"].reshape(F, -1, 3)[:, 5]) < 1e-12
    assert np.allclose(clip.positions()[:, 0], arrays()["trans"][:, [0, 2, 1]] * [1, 1, -1])


def test_bones_are_those_of_the_model_that_is_named(path, tmp_path):
    model = tmp_path / "SMPLH_FEMALE.npz"
    rest = body_model(model)
    clip = read_clip(path, skeleton=model)
    with np.load(model) as file:
        shaped = rest + file["shapedirs"] @ arrays()["betas"][:10]
    parents = np.array(joints_of("smplh")[1])
    assert np.allclose(clip.skeleton.offsets[1:], (shaped - shaped[parents])[1:])
    at = arrays()["trans"] + shaped[0]
    assert np.allclose(clip.positions()[:, 0], at[:, [0, 2, 1]] * [1, 1, -1])
    assert "bones of SMPLH_FEMALE.npz" in clip.provenance
    write_smpl(clip, tmp_path / "out.npz", like=path, body_model=model)
    with np.load(tmp_path / "out.npz") as after:
        assert np.allclose(after["trans"], arrays()["trans"], atol=1e-12)


def test_parts_of_poses_and_other_names_of_the_rate(tmp_path):
    whole = arrays("smplx")
    poses, rate = whole.pop("poses"), whole.pop("mocap_framerate")
    cuts = np.split(poses, [3, 66, 69, 75], axis=1)
    parts = dict(
        zip(("root_orient", "pose_body", "pose_jaw", "pose_eye", "pose_hand"), cuts, strict=True)
    )
    np.savez(tmp_path / "parts.npz", **whole, **parts, mocap_frame_rate=rate)
    np.savez(tmp_path / "whole.npz", **arrays("smplx"))
    parted, together = (read_clip(tmp_path / f"{n}.npz") for n in ("parts", "whole"))
    assert np.array_equal(parted.channels, together.channels)


def test_a_world_that_is_y_up_is_left(path):
    clip = read_clip(path, up="y")
    assert np.allclose(clip.positions()[:, 0], arrays()["trans"])
    assert clip.up_source == "caller"


def test_the_body_alone_is_enough(tmp_path):
    body = arrays()
    body["poses"] = body["poses"][:, :66]
    np.savez(tmp_path / "body.npz", **body)
    clip = read_clip(tmp_path / "body.npz")
    assert clip.skeleton.n_joints == 22
    written = write_smpl(clip, tmp_path / "out.npz", "smplx")
    assert written.provenance[-1] == "written as smplx, 33 joints at rest"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mocap_framerate": None}, "a frame rate as mocap_framerate.*--fps"),
        ({"mocap_framerate": np.array(0.0)}, "positive mocap_framerate"),
        ({"poses": None}, "Files of shapes have no motion"),
        ({"poses": np.zeros((F, 100))}, r"72 \(smpl\), 156 \(smplh\), 165 \(smplx\)"),
        ({"poses": np.full((F, 156), np.nan)}, "finite poses"),
        ({"trans": np.zeros((F - 1, 3))}, "trans .40, 3."),
        ({"trans": None}, "trans .40, 3., but the archive has none"),
        ({"poses": np.array("x")}, "arrays of a SMPL body"),
        ({"betas": np.array([["a"]])}, "arrays of a SMPL body"),
        ({"mocap_framerate": np.zeros(0)}, "arrays of a SMPL body"),
    ],
)
def test_what_is_no_motion_is_told(tmp_path, change, message):
    kept = {name: value for name, value in (arrays() | change).items() if value is not None}
    np.savez(tmp_path / "bad.npz", **kept)
    with pytest.raises(FormatError, match=message):
        read_clip(tmp_path / "bad.npz")


def test_a_rate_can_be_said(tmp_path):
    kept = arrays()
    del kept["mocap_framerate"]
    np.savez(tmp_path / "silent.npz", **kept)
    assert read_clip(tmp_path / "silent.npz", fps=50).fps == 50


def test_a_body_model_of_another_kind_is_told(path, tmp_path):
    body_model(tmp_path / "smpl.npz", "smpl")
    with pytest.raises(FormatError, match="of smplh, 52 joints, but got one of smpl, 24 joints"):
        read_clip(path, skeleton=tmp_path / "smpl.npz")
    with pytest.raises(FormatError, match="no v_template and no J_regressor"):
        read_clip(path, skeleton=path)
    with pytest.raises(FormatError, match="a pickle, which may run any program"):
        read_clip(path, skeleton=tmp_path / "SMPL_MALE.pkl")
    with pytest.raises(FormatError, match="there is none"):
        read_clip(path, skeleton=tmp_path / "missing.npz")
    (tmp_path / "text.npz").write_text("no archive")
    with pytest.raises(FormatError, match="a body model as"):
        read_clip(path, skeleton=tmp_path / "text.npz")


@pytest.mark.parametrize("convention", ["acclaim", "bvh"])
def test_other_bodies_are_carried_over(tmp_path, convention):
    """Limbs point where the clip's do, knees bend about their axis, and what is guessed is said."""
    walk = synthetic.make_clip("walk", seed=1, duration_s=1)
    if convention == "bvh":
        walk = to_bvh_convention(walk)
    written = write_smpl(walk, tmp_path / "out.npz", "smplx")
    told = [step for step in written.provenance if step.startswith("carried over to smplx: ")]
    assert "spine and neck" in told[0]
    assert "the pelvis' path is scaled" in told[1]
    carried = read_clip(tmp_path / "out.npz")
    assert (carried.fps, len(carried)) == (walk.fps, len(walk))
    joints = understand(walk.skeleton, walk.channels).joints.value
    ours, theirs = walk.positions(), carried.positions()
    for first, second, of_smpl in (
        ("hip", "knee", ("hip", "knee")),
        ("knee", "ankle", ("knee", "ankle")),
        ("shoulder", "elbow", ("shoulder", "elbow")),
        ("elbow", "wrist", ("elbow", "wrist")),
        ("ankle", "toe", ("ankle", "foot")),
    ):
        for side in ("left", "right"):
            ends = [joints[f"{side}_{name}"] for name in (first, second)]
            smpl = [carried.skeleton.joint(f"{side}_{name}") for name in of_smpl]
            way, made = (p[:, e[1]] - p[:, e[0]] for p, e in ((ours, ends), (theirs, smpl)))
            cosines = (way * made).sum(axis=1)
            cosines /= np.linalg.norm(way, axis=1) * np.linalg.norm(made, axis=1)
            assert np.rad2deg(np.arccos(np.clip(cosines, -1, 1))).max() < 0.1, (side, first)
    knees = carried.rotations(form="rotvec")[:, carried.skeleton.joint("left_knee")]
    assert np.abs(knees[:, 1:]).max() < 0.05 * knees[:, 0].max()  # about x, and forwards
    heading = ours[-1, 0] - ours[0, 0], theirs[-1, 0] - theirs[0, 0]
    assert heading[0] @ heading[1] > 0.99 * np.prod([np.linalg.norm(way) for way in heading])
    assert np.abs(theirs[..., 1].min() - ours[..., 1].min()) < 0.05


def test_what_is_no_human_body_is_not_carried_over(tmp_path):
    hand = synthetic.make_clip("walk", seed=1, duration_s=0.2).drop_joints("lfemur", "lowerback")
    with pytest.raises(SkeletonError, match=r"whole human body .*joint map"):
        write_smpl(hand, tmp_path / "out.npz")
    walk = synthetic.make_clip("walk", seed=1, duration_s=0.2)
    with pytest.raises(FormatError, match="out of smpl, smplh, smplx, but got 'smplq'"):
        write_smpl(walk, tmp_path / "out.npz", "smplq")
    with pytest.raises(FormatError, match="archive that the clip is from"):
        write_smpl(walk, tmp_path / "out.npz", like=tmp_path / "none.npz")
    (tmp_path / "text.npz").write_text("no archive\n")
    with pytest.raises(FormatError, match="archive that the clip is from, but got"):
        write_smpl(walk, tmp_path / "out.npz", like=tmp_path / "text.npz")
    assert not (tmp_path / "out.npz").exists()
    with pytest.raises(FormatError, match=r"Expected an .npz for smplh, but got '.csv'"):
        write_representation(hand, "smplh", tmp_path / "out.csv")


def test_from_the_command_line(path, tmp_path):
    out = tmp_path / "out.npz"
    figures = run_json("convert", path, tmp_path / "walk.bvh")
    assert (figures["frames"], figures["fps"]) == (F, 60)
    run("convert", path, out, "--as", "smplh")
    with np.load(out) as after:
        assert turns(after["poses"], arrays()["poses"]) < 1e-12
        assert str(after["gender"]) == "female"
    clip = read_clip(path)
    write_clip(clip, tmp_path / "own.npz")
    assert read_clip(tmp_path / "own.npz") == clip


def test_a_skeleton_of_another_kind_is_no_body_model(tmp_path):
    asf = tmp_path / "07.asf"
    asf.write_text(":version 1.10")
    with pytest.raises(FormatError, match=r"Expected a body model as \.npz .* generic adult"):
        read_body_model(asf, "smplh", np.zeros(10))
