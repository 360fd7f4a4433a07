"""`read_clip`, `write_clip` and `find_skeleton`: the right format, skeleton and unit."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from motion_files import AMC, ASF, BVH
from naive import naive_forward_kinematics

from mocapdb.errors import FormatError, SkeletonError
from mocapdb.io import find_skeleton, read_clip, write_clip
from mocapdb.io.asf import read_asf


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "02.asf").write_text(ASF)
    (tmp_path / "02_01.amc").write_text(AMC)
    (tmp_path / "02_01.bvh").write_text(BVH)
    return tmp_path


def test_suffix_decides(folder):
    assert read_clip(folder / "02_01.amc").skeleton.convention == "acclaim"
    assert read_clip(folder / "02_01.bvh").skeleton.convention == "bvh"
    shutil.copy(folder / "02_01.amc", folder / "02_02.AMC")
    assert read_clip(str(folder / "02_02.AMC")).name == "02_02"


@pytest.mark.parametrize("name", ["clip.c3d", "clip", "clip.asf", "clip.amc.txt"])
def test_unknown_suffix(folder, name):
    with pytest.raises(FormatError, match="suffix"):
        read_clip(folder / name)
    clip = read_clip(folder / "02_01.bvh")
    with pytest.raises(FormatError, match="suffix"):
        write_clip(clip, folder / name)


def test_skeleton_can_be_passed(folder):
    skeleton = read_asf(folder / "02.asf")
    elsewhere = folder / "elsewhere"
    elsewhere.mkdir()
    shutil.move(folder / "02.asf", elsewhere / "my.asf")
    assert read_clip(folder / "02_01.amc", skeleton=skeleton).skeleton is skeleton
    assert read_clip(folder / "02_01.amc", skeleton=elsewhere / "my.asf").skeleton == skeleton
    with pytest.raises(FormatError, match=r"Pass a skeleton"):
        read_clip(folder / "02_01.amc")
    with pytest.raises(FormatError, match="Leave it out"):
        read_clip(folder / "02_01.bvh", skeleton=skeleton)


def test_changed_skeleton_is_read_again(folder):
    assert read_clip(folder / "02_01.amc").skeleton.offsets[5, 1] == 12
    (folder / "02.asf").write_text(ASF.replace("length 12", "length 12.5"))
    assert read_clip(folder / "02_01.amc").skeleton.offsets[5, 1] == 12.5


def test_overrides(folder):
    for name in ("02_01.amc", "02_01.bvh"):
        clip = read_clip(folder / name, fps=60, metres_per_unit=0.5, up="z")
        assert (clip.fps, clip.fps_source) == (60, "caller")
        assert (clip.skeleton.metres_per_unit, clip.skeleton.up) == (0.5, "z")
        assert (clip.unit_source, clip.up_source) == ("caller", "caller")


def test_who_states_unit_and_up(folder):
    assert "length 0.45" in ASF
    clip = read_clip(folder / "02_01.amc")
    assert (clip.unit_source, clip.up_source) == ("file", "default")
    (folder / "02.asf").write_text(ASF.replace("length 0.45", ""))
    assert read_clip(folder / "02_01.amc").unit_source == "default"
    one = read_clip(folder / "02_01.amc", up="z")
    assert (one.unit_source, one.up_source) == ("default", "caller")
    assert one.replace(name="other").up_source == one[1:].up_source == "caller"
    clip = read_clip(folder / "02_01.bvh")
    assert clip.unit_source == "default"  # a leg and a head are nobody's stature
    clip = read_clip(folder / "02_01.bvh", metres_per_unit=clip.skeleton.metres_per_unit)
    assert clip.unit_source == "caller"


@pytest.mark.parametrize(
    ("spelt", "told"),
    [("OFFSET 0 20 0", "in the offset of 'Head_End'"), ("\n0 90 0", "in Hips.tx of frame 0")],
)
def test_numbers_out_of_this_world_are_told(folder, spelt, told):
    assert spelt in BVH
    path = folder / "x.bvh"
    path.write_text(BVH.replace(spelt, spelt.replace("0 ", "1e11 ", 1)))
    assert len(read_clip(path)) == 3
    path.write_text(BVH.replace(spelt, spelt.replace("0 ", "1e13 ", 1)))
    with pytest.raises(FormatError) as raised:
        read_clip(path)
    assert str(raised.value) == f"{path}: Expected numbers up to 1e+12, but got 1e+13 {told}."


def test_a_skeleton_of_another_folder_is_told(folder):
    (folder / "amc").mkdir()
    (folder / "02_01.amc").rename(folder / "amc" / "02_01.amc")
    told = read_clip(folder / "amc" / "02_01.amc").provenance
    assert told[1] == f"skeleton of {folder.name}/02.asf"
    (folder / "02.asf").rename(folder / "amc" / "02.asf")
    assert not any(
        "skeleton" in step for step in read_clip(folder / "amc" / "02_01.amc").provenance
    )


def test_tpose_is_kept_unless_asked(folder):
    still = np.zeros(12)
    rows = [still, *np.linspace(40, 50, 20)[:, None] * np.ones(12)]
    lines = [" ".join(map(str, row)) for row in rows]
    text = BVH[: BVH.index("0 90 0 1")].replace("Frames: 3", "Frames: 21") + "\n".join(lines)
    (folder / "t.bvh").write_text(text)
    assert len(read_clip(folder / "t.bvh")) == 21
    assert len(read_clip(folder / "t.bvh", drop_tpose=True)) == 20


@pytest.mark.parametrize("name", ["x.amc", "x.bvh", "x.npz"])
def test_missing_files(tmp_path, name):
    with pytest.raises(FormatError, match=r"x\..*there is none"):
        read_clip(tmp_path / name)


# -- finding the skeleton ------------------------------------------------------------------------


def found(tmp_path, clip, *skeletons):
    for name in (clip, *skeletons):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    return find_skeleton(tmp_path / clip).relative_to(tmp_path).as_posix()


@pytest.mark.parametrize(
    ("clip", "skeletons", "expected"),
    [
        ("02/02_01.amc", ["02/02.asf"], "02/02.asf"),
        ("02/walk.amc", ["02/body.ASF"], "02/body.ASF"),
        ("cut/HDM_bd_squat_120.amc", ["HDM_bd.asf", "HDM_bk.asf", "HDM_dg.asf"], "HDM_bd.asf"),
        ("cut/hdm_BD_squat.amc", ["HDM_bd.asf", "HDM_bk.asf"], "HDM_bd.asf"),
        ("02_01.amc", ["02.asf", "02_01.asf", "03.asf"], "02_01.asf"),
        ("02_01.amc", ["0.asf", "02.asf"], "02.asf"),
        ("a/x.amc", ["a/one.asf", "x.asf"], "a/one.asf"),
        ("a/x.amc", ["b/x.asf", "y.asf"], "y.asf"),
    ],
)
def test_skeleton_is_found(tmp_path, clip, skeletons, expected):
    assert found(tmp_path, clip, *skeletons) == expected


@pytest.mark.parametrize(
    ("clip", "skeletons", "expected"),
    [
        ("amc/02_01.amc", ["asf/02.asf", "asf/03.asf"], "asf/02.asf"),
        ("amc/02_01.amc", ["asf/02.asf"], "asf/02.asf"),
        ("07_05-walk.amc", ["07-walk.asf", "08-walk.asf"], "07-walk.asf"),
        ("s12-run.amc", ["s1.asf", "s12_body.asf", "s120.asf"], "s12_body.asf"),
    ],
)
def test_skeleton_in_another_folder_or_of_the_same_number(tmp_path, clip, skeletons, expected):
    for name in (clip, *skeletons):
        path = tmp_path / "take" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    assert find_skeleton(tmp_path / "take" / clip) == tmp_path / "take" / expected


@pytest.mark.parametrize(
    ("clip", "skeletons"),
    [
        ("02_01.amc", []),
        ("02_01.amc", ["03.asf", "04.asf"]),
        ("02_01.amc", ["02.asf", "02.ASF"]),
        ("a/b/c/x.amc", ["x.asf"]),
    ],
)
def test_skeleton_is_not_guessed(tmp_path, clip, skeletons):
    with pytest.raises(FormatError, match="Pass a skeleton"):
        found(tmp_path, f"deep/er/{clip}", *[f"deep/er/{name}" for name in skeletons])


def test_skeleton_beside_a_bare_name(folder, monkeypatch):
    monkeypatch.chdir(folder)
    assert find_skeleton("02_01.amc") == Path("02.asf")
    (folder / "sub").mkdir()
    shutil.copy(folder / "02_01.amc", folder / "sub")
    monkeypatch.chdir(folder / "sub")
    assert find_skeleton("02_01.amc") == folder / "02.asf"


# -- writing -------------------------------------------------------------------------------------


@pytest.mark.parametrize("source", ["02_01.amc", "02_01.bvh"])
@pytest.mark.parametrize("suffix", [".amc", ".bvh", ".npz"])
def test_written_clip_moves_the_same(folder, tmp_path, source, suffix):
    clip = read_clip(folder / source)
    out = tmp_path / "out"
    out.mkdir()
    write_clip(clip, out / f"x{suffix}")
    same = Path(source).suffix == suffix
    again = read_clip(out / f"x{suffix}")
    if same:
        assert again.skeleton == clip.skeleton
        assert again.channels.tobytes() == clip.channels.tobytes()
    tips = [name for name in clip.skeleton.names if name in ("foot", "Head_End")]
    (tip,) = tips
    other = {"foot": "foot_End", "Head_End": "Head"}[tip]
    place = naive_forward_kinematics(clip)[0][:, clip.skeleton.joint(tip)]
    names = again.skeleton.names
    joint = names.index(tip if again.skeleton.convention == clip.skeleton.convention else other)
    moved = naive_forward_kinematics(again)[0][:, joint]
    assert np.allclose(moved, place, atol=1e-8)
    expected = {f"x{suffix}", "x.asf"} if suffix == ".amc" else {f"x{suffix}"}
    assert {path.name for path in out.iterdir()} == expected


def test_units_survive(folder):
    clip = read_clip(folder / "02_01.bvh")
    assert clip.skeleton.metres_per_unit == 0.01
    write_clip(clip, folder / "new.amc")
    again = read_clip(folder / "new.amc", skeleton=folder / "new.asf")
    assert again.skeleton.metres_per_unit == 0.01


def test_lying_clip_stands_up_in_an_amc(folder):
    clip = read_clip(folder / "02_01.bvh", up="z")
    write_clip(clip, folder / "new.amc")
    again = read_clip(folder / "new.amc", skeleton=folder / "new.asf")
    head = naive_forward_kinematics(clip)[0][:, clip.skeleton.joint("Head_End")]
    found = naive_forward_kinematics(again)[0][:, again.skeleton.joint("Head")]
    assert np.allclose(found, np.stack([head[:, 0], head[:, 2], -head[:, 1]], 1), atol=1e-9)


def test_pair_is_written_whole_or_not_at_all(folder):
    """The ASF's place is taken by a folder, so neither file may change."""
    clip = read_clip(folder / "02_01.amc")
    (folder / "new.asf").mkdir()
    (folder / "new.asf" / "file").touch()
    before = sorted(folder.rglob("*"))
    with pytest.raises(FormatError):
        write_clip(clip, folder / "new.amc")
    assert sorted(folder.rglob("*")) == before


def test_nothing_is_left_of_a_clip_that_cannot_be_written(folder):
    text = BVH.replace("3 Yrotation Zrotation Xrotation", "3 Xposition Yposition Zposition")
    (folder / "moving.bvh").write_text(text)
    before = sorted(folder.iterdir())
    with pytest.raises(SkeletonError):
        write_clip(read_clip(folder / "moving.bvh"), folder / "new.amc")
    with pytest.raises(FormatError, match="written to"):
        write_clip(read_clip(folder / "02_01.bvh"), folder / "none" / "new.bvh")
    assert sorted(folder.iterdir()) == before


def test_a_rate_of_the_skeletons_file(folder):
    asf = next(folder.glob("*.asf"))
    asf.write_text(asf.read_text().replace(":units", ":samples-per-second 60\n:units"))
    clip = read_clip(next(folder.glob("*.amc")))
    assert (clip.fps, clip.fps_source) == (60.0, "file")


def test_what_is_mended_of_a_skeleton_is_said_of_the_clip(folder):
    asf = next(folder.glob("*.asf"))
    asf.write_text(asf.read_text().replace("root hip spine", "ROOT hip spine"))
    motion = next(folder.glob("*.amc"))
    assert any("'ROOT' is spelt 'root'" in step for step in read_clip(motion).provenance)
    with pytest.raises(FormatError, match="nothing to mend"):
        read_clip(motion, strict=True)
