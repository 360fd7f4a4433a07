"""BVH files: what is read, what is inferred, what is refused, what is written."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from motion_files import BVH, line_of
from naive import naive_forward_kinematics
from scipy.spatial.transform import Rotation

from mocapdb.errors import FormatError, SkeletonError
from mocapdb.io.bvh import read_bvh, write_bvh


@pytest.fixture
def save(tmp_path):
    def save(text, name="clip.bvh"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return save


@pytest.fixture
def clip(save):
    return read_bvh(save(BVH))


def test_hierarchy(clip):
    skeleton = clip.skeleton
    assert skeleton.names == ("Hips", "Left Leg", "Left Leg_End", "Head", "Head_End")
    assert skeleton.parents.tolist() == [-1, 0, 1, 0, 3]
    assert skeleton.offsets.tolist() == [[0, 0, 0], [4, 0, 0], [0, -90, 0], [0, 60, 0], [0, 20, 0]]
    assert skeleton.rotation_orders == ("ZYX", "ZXY", "", "YZX", "")
    assert skeleton.dofs[0] == ("tx", "ty", "tz", "rz", "ry", "rx")
    assert skeleton.dofs[1] == ("rz", "rx", "ry")
    assert skeleton.convention == "bvh"


def test_motion(clip):
    assert clip.channels.shape == (3, 12)
    assert clip.channels[2].tolist() == [2, 90, 0, 3, 4, 5, 6, 7, 8, 9, 10, 11.5]
    assert (clip.fps, clip.fps_source, clip.frame_time_text) == (120.0, "file", ".0083333")


@pytest.mark.parametrize(
    ("text", "fps"),
    [
        (".0083333", 120.0),
        ("0.00833333", 120.0),
        ("0.033333", 30.0),
        ("0.0333667", 30000 / 1001),
        ("0.0417083750417", 24000 / 1001),
        ("0.0167", 60.0),
        ("0.0083", 120.0),
        ("0.00833", 120.0),
        ("0.004167", 240.0),
        ("0.016666", 60.0),  # cut off rather than rounded
        ("0.008333333767950535", 120.0),  # was kept in single precision
        ("1.0", 1.0),
        ("0.0416667", 24.0),
        ("0.04", 25.0),
        ("0.02", 50.0),
        ("0.01", 100.0),
        ("0.0166667", 60.0),
        ("0.0208333", 48.0),
        ("0.05", 20.0),
        ("0.011", 90.0),
        ("0.0111222", 89.910269551),
        ("1e-2", 100.0),
    ],
)
def test_frame_times(save, text, fps):
    assert read_bvh(save(BVH.replace(".0083333", text))).fps == fps


def test_rate_of_the_caller(save):
    clip = read_bvh(save(BVH), fps=60)
    assert (clip.fps, clip.fps_source, clip.frame_time_text) == (60.0, "caller", "")


@pytest.mark.parametrize(
    "edit",
    [
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("OFFSET", "OFFSET\t").replace("{\n", "{\r\n"),
        lambda text: text.replace("Frame Time: ", "Frame Time:\t").replace("Frames: ", "Frames:"),
        lambda text: text.replace("\n\t{\n", " {\n").replace("\n{\n", " {\n"),
        lambda text: text.replace("HIERARCHY", "Hierarchy").replace("MOTION", "Motion"),
        lambda text: text.replace("Xposition", "XPOSITION").replace("End Site", "END SITE"),
        lambda text: text.replace("\n", " \n\n").rstrip(),
        lambda text: "\ufeff" + text,
    ],
)
def test_odd_files_that_are_legal(save, clip, edit):
    again = read_bvh(save(edit(BVH)))
    assert again.skeleton == clip.skeleton
    assert np.array_equal(again.channels, clip.channels)


def test_position_channels_replace_the_offset(save):
    text = BVH.replace("CHANNELS 3 Yrotation Zrotation Xrotation", "CHANNELS 1 Yposition")
    text = re.sub(r"(?m)^(\d.*) \S+ \S+ (\S+)$", r"\1 \2", text)
    clip = read_bvh(save(text))
    assert clip.skeleton.dofs[3] == ("ty",)
    positions, rotations = naive_forward_kinematics(clip)
    head = np.einsum("fji,fj->fi", rotations[:, 0], positions[:, 3] - positions[:, 0])
    assert np.allclose(head, [[0, 9, 0], [0, 10, 0], [0, 11.5, 0]])


def test_several_end_sites_have_names_of_their_own(save):
    site = "\t\tEnd Site\n\t\t{\n\t\t\tOFFSET 0 20 0\n\t\t}\n"
    joint = "\t\tJOINT Head_End2\n\t\t{\n\t\t\tOFFSET 1 1 1\n\t\t}\n"
    names = read_bvh(save(BVH.replace(site, site + joint + site))).skeleton.names
    assert names[3:] == ("Head", "Head_End", "Head_End2", "Head_End3")


# -- what the format does not state --------------------------------------------------------------


@pytest.mark.parametrize(
    ("scale", "metres_per_unit"),
    [(1, 0.01), (0.01, 1.0), (10, 0.001), (1 / 2.54, 0.0254), (0.45 / 2.54, 0.0254 / 0.45)],
)
def test_unit(save, scale, metres_per_unit):
    def scaled(match):
        return "OFFSET " + " ".join(repr(float(word) * scale) for word in match[1].split())

    clip = read_bvh(save(re.sub("OFFSET (.*)", scaled, BVH)))
    assert clip.skeleton.metres_per_unit == metres_per_unit
    assert any("vertical extent is then 1.6" in step for step in clip.provenance)


def test_unit_without_a_height(save):
    text = re.sub("OFFSET .*", "OFFSET 0 0 0", BVH)
    clip = read_bvh(save(text), up="y")
    assert clip.skeleton.metres_per_unit == 1.0
    assert any("assumed" in step for step in clip.provenance)


def z_up(text):
    return re.sub(r"OFFSET (\S+) (\S+) (\S+)", r"OFFSET \1 \3 \2", text)


def test_up_axis_by_the_head(save):
    assert read_bvh(save(BVH)).skeleton.up == "y"
    clip = read_bvh(save(z_up(BVH)))
    assert clip.skeleton.up == "z"
    assert clip.skeleton.metres_per_unit == 0.01
    assert any("the head is above the root" in step for step in clip.provenance)


def test_up_axis_by_the_motion(save):
    """The rest pose lies along x, and the root turns it upright by 90 degrees about y."""
    text = re.sub(r"OFFSET (\S+) (\S+) (\S+)", r"OFFSET \2 \1 \3", BVH)
    text = re.sub(r"(?m)^(\d 90 0) \S+ \S+ \S+", r"\1 0 -90 0", text)
    clip = read_bvh(save(text))
    assert clip.skeleton.up == "z"
    assert any("the head is above the root" in step for step in clip.provenance)


def test_up_axis_without_a_head(save):
    text = BVH.replace("Head", "Top")
    assert read_bvh(save(text)).skeleton.up == "y"
    assert read_bvh(save(z_up(text))).skeleton.up == "z"


def test_the_caller_overrides_both(save):
    skeleton = read_bvh(save(BVH), metres_per_unit=0.5, up="z").skeleton
    assert (skeleton.metres_per_unit, skeleton.up) == (0.5, "z")


# -- bad input -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "blamed", "message"),
    [
        ("HIERARCHY\n", "", "ROOT", "HIERARCHY"),
        ("ROOT Hips", "JOINT Hips", "JOINT Hips", "one ROOT"),
        ("JOINT Head", "ROOT Head", "ROOT Head", "within another"),
        ("JOINT Head", "JOINT", "JOINT\n", "a name"),
        ("JOINT Head", "BONE Head", "BONE Head", "'BONE'"),
        ("Head\n\t{\n", "Head\n", "OFFSET 0 60", "opening brace"),
        ("{\n\tOFFSET", "{\n{\n\tOFFSET", "{\n\tOFFSET", "joint before an opening brace"),
        ("\t}\n}\n", "\t}\n", "MOTION", "1 are open"),
        ("\t}\n}\n", "\t}\n}\n}\n", "}\nMOTION", "closing"),
        ("\t\tOFFSET 4 0 0\n", "", "JOINT Left Leg", "to have an OFFSET"),
        ("OFFSET 4 0 0", "OFFSET 4 0", "OFFSET 4 0", "3 numbers"),
        ("OFFSET 4 0 0", "OFFSET 4 0 x", "OFFSET 4 0", "'x'"),
        ("OFFSET 4 0 0", "OFFSET 4 0 inf", "OFFSET 4 0", "finite"),
        ("OFFSET 4 0 0", "OFFSET 4 0 0\nOFFSET 4 1 0", "OFFSET 4 1 0", "one OFFSET"),
        ("CHANNELS 3 Zrotation", "CHANNELS 4 Zrotation", "CHANNELS 4", "count of names, 3"),
        ("CHANNELS 3 Zrotation", "CHANNELS Zrotation", "CHANNELS Z", "count of names"),
        ("CHANNELS 3 Zrotation", "CHANNELS 3 Zspin", "Zspin", "'Zspin'"),
        ("CHANNELS 3 Zrotation", "CHANNELS 3 Xrotation", "CHANNELS 3 Xr", "different"),
        ("MOTION\n", "MOTION\nMOTION\n", "MOTION\nFrames", "'Frames:'"),
        ("Frames: 3\n", "", "Frame Time", "'Frames:'"),
        ("Frames: 3", "Frames: three", "Frames:", "count of frames"),
        ("Frames: 3", "Frames: -3", "Frames:", "count of frames"),
        ("Frames: 3", "Frames: 0", "Frames:", "at least one frame"),
        ("Frames: 3", "Frames: 1", None, "1 frames (Frames:), but got 3 rows"),
        ("Frames: 3", "Frames: 5", None, "5 frames (Frames:), but got 3 rows"),
        ("Frames: 3", "Frames: 999999999999", None, "but got 3 rows"),
        ("Frame Time: .0083333", "Frame Time: 0", "Frame Time", "positive"),
        ("Frame Time: .0083333", "Frame Time: -1", "Frame Time", "positive"),
        ("Frame Time: .0083333", "Frame Time: nan", "Frame Time", "finite"),
        ("Frame Time: .0083333", "Frame Time:", "Frame Time", "'Frame Time:'"),
        ("10 11.5\n", "10\n", "2 90 0", "12 values in frame 2, but got 11"),
        ("10 11.5\n", "10 11.5 12\n", "2 90 0", "12 values in frame 2, but got 13"),
        ("10 11.5\n", "10 eleven\n", "2 90 0", "'eleven'"),
        ("10 11.5\n", "10 NaN\n", "2 90 0", "finite"),
    ],
)
def test_broken_files(save, old, new, blamed, message):
    assert old in BVH
    text = BVH.replace(old, new, 1)
    with pytest.raises(FormatError, match=re.escape(message)) as error:
        read_bvh(save(text.encode("latin-1")))
    assert error.value.line == line_of(blamed, text), str(error.value)


@pytest.mark.parametrize("words", ["HIERARCHY", "HIERARCHY\nROOT a\n{\n}"])
def test_files_that_end_early(save, words):
    with pytest.raises(FormatError):
        read_bvh(save(words))


def test_file_without_motion(save):
    with pytest.raises(FormatError, match="MOTION"):
        read_bvh(save(BVH[: BVH.index("MOTION")]))


def test_file_without_joints(save):
    with pytest.raises(FormatError, match="ROOT"):
        read_bvh(save("HIERARCHY\nMOTION\nFrames: 1\nFrame Time: 1\n1\n"))


def test_a_joint_behind_the_roots_brace(save):
    body = BVH[BVH.index("ROOT") : BVH.index("MOTION")]
    with pytest.raises(FormatError, match="another ROOT"):
        read_bvh(save(BVH.replace("MOTION", body.replace("ROOT", "JOINT") + "MOTION")))


# -- what is mended ------------------------------------------------------------------------------

END_SITE = "\t\tEnd Site\n\t\t{\n\t\t\tOFFSET 0 20 0\n\t\t}\n"


def in_every_row(text, change):
    return re.sub(r"(?m)^(\d 90 .*)$", lambda row: change(row[1]), text)


MENDED = {
    "comments": lambda text: "# made by hand\n" + text.replace("JOINT Head", "// head\nJOINT Head"),
    "taken as Latin-1": lambda text: text.replace("HIERARCHY", "HIERARCHY # \xe9").encode(
        "latin-1"
    ),
    "end-of-file mark": lambda text: text + "\x1aleft over",
    "UTF-16": lambda text: text.encode("utf-16"),
    "UTF-32": lambda text: text.encode("utf-32"),
    "in one word": lambda text: text.replace("End Site", "EndSite"),
    "has a name": lambda text: text.replace(END_SITE, END_SITE.replace("Site", "Site Head_End")),
    "turn nothing": lambda text: in_every_row(
        text.replace("OFFSET 0 20 0", "OFFSET 0 20 0\n\t\t\tCHANNELS 1 Xrotation"),
        lambda row: row + " 7",
    ),
    "scales, all 1": lambda text: in_every_row(
        text.replace("3 Yrotation Zrotation Xrotation", "4 Yrotation Zrotation Xrotation Xscale"),
        lambda row: row + " 1",
    ),
    "wrapped": lambda text: in_every_row(text, lambda row: row.replace(" 90 ", " 90\n")),
    "commas between": lambda text: in_every_row(text, lambda row: row.replace(" ", ",")),
    "decimal commas": lambda text: text.replace("11.5", "11,5"),
    "before their minus": lambda text: text,
    "zeros too many": lambda text: in_every_row(text, lambda row: row + " 0"),
    "says 4, but there are 3": lambda text: text.replace("Frames: 3", "Frames: 4"),
    "says 2, but there are 3": lambda text: text.replace("Frames: 3", "Frames: 2"),
    "count of frames is spelt": lambda text: text.replace("Frames: 3", "Frames 3.0"),
    "frame time is spelt": lambda text: text.replace("Time: .0083333", "Time .0083333 secs"),
}


@pytest.mark.parametrize("note", MENDED)
def test_what_loses_nothing_is_mended_and_said_once(save, clip, note):
    text = BVH
    if note == "before their minus":
        text = BVH.replace(" 11.5", "-11.5")
        clip = read_bvh(save(BVH.replace(" 11.5", " -11.5"), "plain.bvh"))
    path = save(MENDED[note](text))
    found = read_bvh(path)
    assert found.skeleton == clip.skeleton
    assert np.array_equal(found.channels, clip.channels)
    assert found.fps == clip.fps
    assert sum(note in step for step in found.provenance if step.startswith("mended: ")) == 1
    with pytest.raises(FormatError, match="nothing to mend"):
        read_bvh(path, strict=True)


def test_a_plain_file_has_nothing_to_mend(save):
    assert not any("mended" in step for step in read_bvh(save(BVH), strict=True).provenance)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda text: text.replace("10 11.5", "10"), "12 values in frame 2"),
        (lambda text: text.replace("Frames: 3", "Frames: 5"), "5 frames"),
        (
            lambda text: in_every_row(
                text.replace("3 Yrotation Zrotation", "4 Yrotation Zrotation Xscale"),
                lambda row: row + " 2",
            ),
            "keep its size",
        ),
        (lambda text: in_every_row(text, lambda row: row + " 3"), "12 values in frame 0"),
    ],
)
def test_what_loses_something_is_refused(save, edit, message):
    with pytest.raises(FormatError, match=message):
        read_bvh(save(edit(BVH)))


@pytest.mark.parametrize(
    "edit",
    [
        lambda text: text.replace("\n", "\r"),
        lambda text: text + "\x1a\n",
        lambda text: text + "\x1a\0\0\0",
        lambda text: " ".join(text[: text.index("MOTION")].split()) + text[text.index("MOTION") :],
        lambda text: " ".join(text.split()),
    ],
)
def test_where_lines_break_does_not_matter(save, clip, edit):
    text = edit(BVH.replace("Left Leg", "LeftLeg"))
    again = read_bvh(save(text))
    assert again.skeleton.names[1] == "LeftLeg"
    assert np.array_equal(again.channels, clip.channels)


def test_names_in_japanese_and_with_accents(save):
    for name, encoding in (("左足", "cp932"), ("Fu\xdf", "latin-1"), ("左足", "utf-8")):
        clip = read_bvh(save(BVH.replace("Left Leg", name).encode(encoding)))
        assert clip.skeleton.names[1] == name


def test_names_that_come_twice(save):
    clip = read_bvh(save(BVH.replace("JOINT Head", "JOINT Left Leg")))
    assert clip.skeleton.names == (
        "Hips",
        "Left Leg",
        "Left Leg_End",
        "Left Leg_2",
        "Left Leg_2_End",
    )
    assert any("have a number: Left Leg_2" in step for step in clip.provenance)


def test_many_names_that_come_twice_are_told_in_one_note(save):
    clip = read_bvh(save(made_of("j", 6)))
    assert clip.skeleton.names[:6] == ("j", "j_2", "j_3", "j_4", "j_5", "j_6")
    (note,) = (step for step in clip.provenance if step.startswith("mended: "))
    assert note == "mended: joints whose names come twice have a number: j_2, j_3, j_4 and 2 more"


def made_of(name, count):
    """A BVH of a chain of joints of one name."""
    joint = "{{ OFFSET 0 1 0 CHANNELS 3 Zrotation Xrotation Yrotation {} {} }}"
    inner = "End Site { OFFSET 0 1 0 }"
    for kind in ["JOINT"] * (count - 1) + [""]:
        inner = joint.format(inner, "")
        inner = f"{kind} {name}\n{inner}" if kind else inner
    rows = " ".join(["0"] * 3 * count)
    return f"HIERARCHY\nROOT {name}\n{inner}\nMOTION\nFrames: 1\nFrame Time: 0.01\n{rows}\n"


def test_several_roots(save):
    ball = "ROOT Ball\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n}\n"
    text = in_every_row(BVH.replace("MOTION", ball + "MOTION"), lambda row: row + " 7 8 9")
    clip = read_bvh(save(text))
    assert clip.skeleton.names[0] == "scene"
    assert clip.skeleton.parents[[1, -1]].tolist() == [0, 0]
    positions = naive_forward_kinematics(clip)[0]
    assert positions[1, -1].tolist() == [7, 8, 9]
    assert any("Hips, Ball" in step for step in clip.provenance)


@pytest.mark.parametrize("text", ["30", "30.0", "33.3333", "33.333333"])
def test_a_rate_or_milliseconds_in_place_of_the_frame_time(save, text):
    clip = read_bvh(save(BVH.replace(".0083333", text)))
    assert (clip.fps, clip.frame_time_text) == (30.0, "")
    assert any("taken as a rate of 30" in step for step in clip.provenance)


def test_rotations_twice_about_one_axis(save):
    text = BVH.replace("3 Zrotation Xrotation Yrotation", "3 Zrotation Xrotation Zrotation")
    clip = read_bvh(save(text))
    assert clip.skeleton.rotation_orders[1] == "ZXY"
    for row, channels in zip(((4, 5, 6), (5, 6, 7), (6, 7, 8)), clip.channels, strict=True):
        before = Rotation.from_euler("ZXZ", row, degrees=True)
        after = Rotation.from_euler("ZXY", channels[6:9], degrees=True)
        assert (before.inv() * after).magnitude() < 1e-9


def test_a_leaf_joint_stays_a_joint(save, tmp_path):
    leaf = "\t\tJOINT Toe\n\t\t{\n\t\t\tOFFSET 0 20 0\n\t\t\tCHANNELS 0\n\t\t}\n"
    write_bvh(read_bvh(save(BVH.replace(END_SITE, leaf))), tmp_path / "again.bvh")
    written = (tmp_path / "again.bvh").read_text()
    assert "JOINT Toe" in written
    assert written.count("End Site") == 1


# -- writing -------------------------------------------------------------------------------------


def test_written_file_is_the_same(clip, tmp_path):
    write_bvh(clip, tmp_path / "again.bvh")
    again = read_bvh(tmp_path / "again.bvh")
    assert again.skeleton == clip.skeleton
    assert again.channels.tobytes() == clip.channels.tobytes()
    assert (again.fps, again.frame_time_text) == (clip.fps, clip.frame_time_text)


@pytest.mark.parametrize("fps", [120.0, 30.0, 90.0, 72.5, 1000.0])
def test_written_rate_is_the_same(clip, tmp_path, fps):
    write_bvh(clip.replace(fps=fps), tmp_path / "again.bvh")
    assert read_bvh(tmp_path / "again.bvh").fps == fps


def test_joints_in_another_order(clip, tmp_path):
    """A skeleton may list its joints breadth-first; a BVH cannot."""
    skeleton = clip.skeleton
    order = [0, 3, 1, 2, 4]
    wide = replace(
        skeleton,
        names=tuple(skeleton.names[i] for i in order),
        parents=[-1, 0, 0, 2, 1],
        offsets=skeleton.offsets[order],
        dofs=tuple(skeleton.dofs[i] for i in order),
        rotation_orders=tuple(skeleton.rotation_orders[i] for i in order),
    )
    columns = [*range(6), 9, 10, 11, 6, 7, 8]
    other = replace(clip, skeleton=wide, channels=clip.channels[:, columns])
    write_bvh(other, tmp_path / "other.bvh")
    again = read_bvh(tmp_path / "other.bvh")
    places = dict(zip(wide.names, naive_forward_kinematics(other)[0][2], strict=True))
    for name, place in zip(
        again.skeleton.names, naive_forward_kinematics(again)[0][2], strict=True
    ):
        assert np.allclose(place, places[name], atol=1e-12)


def test_what_a_bvh_cannot_hold(clip, tmp_path):
    for name in ["a\nb", "a  b", "{a", ""]:
        names = ("Hips", name, *clip.skeleton.names[2:])
        with pytest.raises(SkeletonError, match="name"):
            write_bvh(
                replace(clip, skeleton=replace(clip.skeleton, names=names)), tmp_path / "x.bvh"
            )
    with pytest.raises(SkeletonError, match="to_bvh_convention"):
        write_bvh(
            replace(clip, skeleton=replace(clip.skeleton, convention="acclaim")), tmp_path / "x.bvh"
        )
    assert list(tmp_path.glob("*x.bvh*")) == []


@pytest.mark.parametrize(
    ("text", "fps"), [("20", 20.0), ("1.9", 1 / 1.9), ("2.3", 2.3), ("8.3333", 120.0)]
)
def test_long_frame_times(save, text, fps):
    assert read_bvh(save(BVH.replace(".0083333", text))).fps == pytest.approx(fps)


def comb(n_teeth, name="tooth{}"):
    """Return a BVH in which so many joints hang from one."""
    teeth = "".join(
        f"JOINT {name.format(i)}\n{{\nOFFSET 1 0 {i}\nCHANNELS 1 Zrotation\n"
        "End Site\n{\nOFFSET 1 0 0\n}\n}\n"
        for i in range(n_teeth)
    )
    root = "ROOT back\n{\nOFFSET 0 0 0\nCHANNELS 1 Zrotation\n"
    numbers = " ".join(["1"] * (n_teeth + 1))
    return f"HIERARCHY\n{root}{teeth}}}\nMOTION\nFrames: 1\nFrame Time: 0.01\n{numbers}\n"


def test_bodies_of_thousands_of_joints_are_read_or_refused_at_once(save):
    """With all of them compared two and two thousands took minutes."""
    same = read_bvh(save(comb(400, "tooth"))).skeleton.names
    assert same[1:4] == ("tooth", "tooth_End", "tooth_2")
    assert len(set(same)) == 801
    text = "HIERARCHY\n" + "ROOT a\n{\nOFFSET 0 0 0\n}\n" * 10_001 + "MOTION\n"
    with pytest.raises(FormatError, match="at most 10000 joints, but got more"):
        read_bvh(save(text))
    with pytest.raises(FormatError, match="Frames"):  # but for that all is well
        read_bvh(save("HIERARCHY\n" + "ROOT a\n{\nOFFSET 0 0 0\n}\n" * 10 + "MOTION\n"))
