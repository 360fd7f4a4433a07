"""Acclaim files: what is read, what is refused, and that writing gives the same doubles."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from motion_files import AMC, ASF, line_of
from naive import naive_forward_kinematics
from scipy.spatial.transform import Rotation

from mocapdb.errors import FormatError, SkeletonError
from mocapdb.io import read_clip, write_clip
from mocapdb.io.acclaim import read_amc, read_asf, write_amc, write_asf
from mocapdb.io.asf import read_asf_file


@pytest.fixture
def save(tmp_path):
    def save(text, name="clip.amc"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return save


@pytest.fixture
def skeleton(save):
    return read_asf(save(ASF, "body.asf"))


@pytest.fixture
def clip(save, skeleton):
    return read_amc(save(AMC), skeleton)


# -- skeletons ---------------------------------------------------------------------------------


def test_skeleton(skeleton):
    assert skeleton.names == ("root", "hip", "thigh", "shin", "foot", "spine")
    assert skeleton.parents.tolist() == [-1, 0, 1, 2, 3, 0]
    assert skeleton.dofs[0] == ("tx", "ty", "tz", "rx", "ry", "rz")
    assert skeleton.dofs[1:] == ((), ("rx", "ry", "rz"), ("rx",), ("rx", "rz"), ("rz", "ry", "rx"))
    assert skeleton.rotation_orders == ("ZYX", "", "ZYX", "X", "ZX", "XYZ")
    assert skeleton.offsets[1].tolist() == [2.5 * 0.6, 2.5 * -0.8, 0]
    assert skeleton.axis_deg[4].tolist() == [-90, 10, 20]
    assert skeleton.metres_per_unit == 0.0254 / 0.45
    assert (skeleton.up, skeleton.convention, skeleton.name) == ("y", "acclaim", "body")


def test_hierarchy_in_any_order(save, skeleton):
    family = "    root hip spine\n    hip thigh\n    thigh shin\n    shin foot\n"
    shuffled = "    shin foot\n    thigh shin\n    hip thigh\n    root hip\n    root spine\n"
    assert family in ASF
    assert read_asf(save(ASF.replace(family, shuffled), "body.asf")) == skeleton


def test_angles_in_radians(save, skeleton):
    text = ASF.replace("angle deg", "angle rad")
    for degrees in ("0 0 20", "-90 10 20"):
        radians = " ".join(repr(float(np.deg2rad(float(word)))) for word in degrees.split())
        text = text.replace(f"axis {degrees}", f"axis {radians}")
    assert np.allclose(read_asf(save(text)).axis_deg, skeleton.axis_deg, atol=1e-12)


def test_other_orders_of_an_axis(save):
    read = read_asf(save(ASF.replace("-90 10 20  XYZ", "-90 10 20  ZXY")))
    rx, ry, rz = (
        Rotation.from_euler(axis, angle, degrees=True)
        for axis, angle in zip("xyz", (-90, 10, 20), strict=True)
    )
    found = Rotation.from_euler("xyz", read.axis_deg[4], degrees=True)
    assert (found.inv() * (ry * rx * rz)).magnitude() < 1e-12  # z is applied first


def test_axis_of_the_root_orders_its_rotations(save):
    assert read_asf(save(ASF.replace("axis XYZ", "axis ZXY"))).rotation_orders[0] == "YXZ"


def test_comments_and_documentation_hold_any_bytes(save, skeleton):
    text = ASF.replace("really", "r\xe9ally").replace("of bytes", "\xff").encode("latin-1")
    assert read_asf(save(text.replace(b"\n", b"\r\n"))) == skeleton


@pytest.mark.parametrize(
    ("old", "new", "blamed", "message"),
    [
        (":root\n", ":muscles\n", ":muscles", "section"),
        (":hierarchy\n", ":bonedata\n:hierarchy\n", ":bonedata\n:hierarchy", "twice"),
        (":version", "version", "version", "section"),
        ("length 7\n", "length -7\n", "length -7", "0 or more"),
        ("length 7\n", "length nan\n", "length nan", "finite"),
        ("length 7\n", "length 7 7\n", "length 7 7", "1 numbers"),
        ("     length 7\n", "", "begin\n     id 3", "direction and a length"),
        ("direction 0 0 1", "direction 0 1", "direction 0 1\n", "3 numbers"),
        ("length 0.45", "length 0", "length 0", "positive"),
        ("length 0.45", "length x", "length x", "finite"),
        ("angle deg", "angle turns", "angle turns", "deg or rad"),
        ("mass 1.0", "colour 1.0", "colour", "mass, length or angle"),
        ("dof rx rz", "dof rx l", "dof rx l", "not supported"),
        ("dof rx rz", "dof tx rz", "dof tx", "not supported"),
        ("dof rx rz", "dof rx rx", "dof rx rx", "different"),
        ("axis -90 10 20  XYZ", "axis -90 10 20  XYY", "XYY", "order of axes"),
        ("axis XYZ", "axis", "axis\n", "order of axes"),
        ("order TX", "order QX", None, "degrees of freedom"),
        ("position 0", "place 0", "place", "position or orientation"),
        ("     name foot\n", "", "begin\n     id 4", "name"),
        ("name foot", "name my foot", "name my foot", "one word"),
        ("name foot", "name shin", "begin\n     id 4", "twice"),
        ("name foot", "name root", "begin\n     id 4", "twice"),
        ("     id 4", "     ide 4", "ide 4", "field of a bone"),
        ("    shin foot\n", "    shin foot\n    foot shin\n", "foot shin", "several parents"),
        ("    hip thigh\n", "    foot thigh\n", "begin\n     id 2", "cycle"),
        ("    shin foot\n", "", "begin\n     id 4", "leaves it out"),
        ("    shin foot\n", "    shin feet\n", "shin feet", "bone of :bonedata"),
        ("    shin foot\n  end\n", "    shin foot\n", None, "begin to end"),
        ("     id 4\n", "  begin\n", "begin\n     name foot", "in turn"),
        ("dof rz ry rx\n  end\n", "dof rz ry rx\n", "begin\n     id 5", "Expected end"),
        ("  begin\n     id 1\n", "     id 1\n", "id 1", "Expected begin"),
    ],
)
def test_broken_skeletons(save, old, new, blamed, message):
    assert old in ASF
    text = ASF.replace(old, new, 1)
    path = save(text.encode("latin-1"), "body.asf")
    with pytest.raises(FormatError, match=re.escape(message)) as error:
        read_asf(path)
    line = line_of(blamed, text)
    assert error.value.line == line, str(error.value)
    assert str(error.value).startswith(f"{path}:{line}: " if line else f"{path}: ")


@pytest.mark.parametrize("section", [":root", ":bonedata", ":hierarchy"])
def test_missing_sections(save, section):
    start = ASF.index(section)
    stop = ASF.find("\n:", start) + 1 or len(ASF)
    with pytest.raises(FormatError, match=f"{section} section"):
        read_asf(save(ASF[:start] + ASF[stop:]))


# -- motions -------------------------------------------------------------------------------------


def test_motion(clip, skeleton):
    assert clip.skeleton is skeleton
    assert clip.channels.tolist() == [
        [1, 2, 3, 10, 20, 30, 1.5, -2.5, 3.5, 40, 5, -6, 1, 2, 3],
        [1.25, 2, 3, 11, 21, 31, 2.5, -2.5, 4.5, 41, 6, -6.6742e-14, 0.5, 1, 3],
    ]
    assert (clip.name, clip.fps, clip.fps_source) == ("clip", 120.0, "default")


def test_rate_of_the_caller(save, skeleton):
    clip = read_amc(save(AMC), skeleton, fps=60)
    assert (clip.fps, clip.fps_source) == (60.0, "caller")


@pytest.mark.parametrize(
    "edit",
    [
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\n\n"),
        lambda text: text.replace(" ", "\t ").replace("#!OML:ASF\t", "#!OML:ASF"),
        lambda text: text.rstrip(),
        lambda text: text.replace("shin 40\n", "shin 40 # a comment\n# another\n"),
        lambda text: text.replace(
            "shin 41\nfoot 6 -6.6742e-014\n", "foot 6 -6.6742e-014\nshin 41\n"
        ),
        lambda text: text.replace("\n1\n", "\n00\n").replace("\n2\n", "\n1\n"),
        lambda text: "\ufeff" + text,
        lambda text: text.replace(":DEGREES\n", ""),
        lambda text: text.replace("somewhere", "Universit\xe4t").encode("latin-1"),
    ],
)
def test_odd_motions_that_are_legal(save, skeleton, clip, edit):
    assert np.array_equal(read_amc(save(edit(AMC)), skeleton).channels, clip.channels)


def test_motion_in_radians(save, skeleton, clip):
    turn = read_amc(save(AMC.replace(":DEGREES", ":RADIANS")), skeleton)
    angles = skeleton.rotation_channels
    assert np.array_equal(turn.channels[:, :3], clip.channels[:, :3])
    assert np.allclose(np.deg2rad(turn.channels[:, angles]), clip.channels[:, angles], rtol=1e-15)


def test_unit_of_angle_left_out_is_recorded(save, skeleton):
    clip = read_amc(save(AMC.replace(":DEGREES\n", "")), skeleton)
    assert any("degrees" in step for step in clip.provenance)


@pytest.mark.parametrize(
    ("old", "new", "blamed", "message"),
    [
        ("spine .5 1. +3\n", "", "2\nroot", "cut off"),
        ("foot 6 -6.6742e-014\nspine .5 1. +3\n", "foot 6", "foot 6", "2 values"),
        ("shin 40\n", "", "2\nroot", "missing joint: shin"),
        ("shin 41\n", "", "2\nroot", "missing, such as 'shin'"),
        ("shin 41", "shin 41 42", "shin 41", "1 values for joint 'shin' in frame 2, but got 2"),
        ("shin 41", "shin", "shin\nfoot 6", "1 values for joint 'shin' in frame 2, but got 0"),
        ("shin 41", "shin 4l", "shin 4l", "'4l'"),
        ("shin 41", "shin nan", "shin nan", "finite"),
        ("shin 41", "shin -INF", "shin -INF", "finite"),
        ("shin 41", "shin 1e999", "shin 1e999", "finite"),
        ("shin 41", "shin 1_0", "shin 1_0", "finite"),
        ("shin 41", "shin 41\nshin 42", "shin 42", "twice"),
        ("shin 40", "shin 40\nshin 42", "shin 42", "twice"),
        ("shin 41", "tail 41", "tail 41", "joint of skeleton 'body', but got 'tail'"),
        ("shin 40", "shin 40\ntail 1", "tail 1", "Pass the skeleton"),
        ("shin 40", "shin 40\nhip 1", "hip 1", "no values for joint 'hip'"),
        ("\n2\n", "\n1\n", "1\nroot 1.25", "frame 2, but got frame 1"),
        ("\n2\n", "\n1\n", "1\nroot 1.25", "frame 2, but got frame 1"),
        ("\n2\n", "\n", "root 1.25", "twice"),
        (":DEGREES", ":GRADIANS", ":GRADIANS", "':GRADIANS'"),
        ("\n1\n", "\n", "root 1 2", "number of the first frame"),
    ],
)
def test_broken_motions(save, skeleton, old, new, blamed, message):
    assert old in AMC
    text = AMC.replace(old, new, 1)
    with pytest.raises(FormatError, match=re.escape(message)) as error:
        read_amc(save(text), skeleton)
    assert error.value.line == line_of(blamed, text), str(error.value)


def test_motion_without_frames(save, skeleton):
    with pytest.raises(FormatError, match="at least one frame"):
        read_amc(save(AMC[: AMC.index("1\n")]), skeleton)


def test_joints_that_are_not_utf8(save, skeleton):
    with pytest.raises(FormatError, match="shïn") as error:
        read_amc(save(AMC.replace("shin 41", "sh\xefn 41").encode("latin-1")), skeleton)
    assert error.value.line == line_of("shin 41", AMC)


# -- what is mended ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "note"),
    [
        ("axis 0 0 20  XYZ", "axis 0 0 20", "taken as XYZ"),
        ("root hip spine", "Root Hip spine", "'Root' is spelt 'root'"),
        ("name hip", "name hip # H\xfcfte", "taken as Latin-1"),
    ],
)
def test_skeletons_that_are_mended(save, skeleton, old, new, note):
    path = save(ASF.replace(old, new, 1).encode("latin-1"), "odd.asf")
    found = read_asf_file(path)
    assert found.skeleton == skeleton
    assert any(note in said for said in found.notes)
    with pytest.raises(FormatError, match="nothing to mend"):
        read_asf(path, strict=True)


def test_sections_that_say_nothing_about_the_body(save, skeleton):
    text = ASF.replace(":units", ":namespace ns\n:samples-per-second 60\n:units")
    found = read_asf_file(save(text, "odd.asf"), strict=True)
    assert (found.skeleton, found.fps, found.notes) == (skeleton, 60.0, ())


@pytest.mark.parametrize("value", ["0", "-60", "fast", ""])
def test_rates_that_are_none(save, value):
    with pytest.raises(FormatError, match="samples per second"):
        read_asf(save(ASF.replace(":units", f":samples-per-second {value} x\n:units"), "odd.asf"))


@pytest.mark.parametrize(
    ("old", "new", "note"),
    [
        ("\n2\n", "\n5\n", "frame 5 follows frame 1"),
        ("shin 41", "Shin 41", "'Shin' is spelt 'shin'"),
    ],
)
def test_motions_that_are_mended(save, skeleton, clip, old, new, note):
    path = save(AMC.replace(old, new), "odd.amc")
    found = read_amc(path, skeleton)
    assert np.array_equal(found.channels, clip.channels)
    assert any(note in step for step in found.provenance)
    with pytest.raises(FormatError, match="nothing to mend"):
        read_amc(path, skeleton, strict=True)


def test_where_a_rate_comes_from(save, skeleton):
    stated = save(AMC.replace(":DEGREES", ":DEGREES\n:SAMPLES-PER-SECOND 60"), "stated.amc")
    for path, options, expected in (
        (stated, {}, (60.0, "file")),
        (stated, {"fps": 30.0}, (30.0, "caller")),
        (save(AMC), {}, (120.0, "default")),
        (save(AMC), {"default_fps": 50.0}, (50.0, "default")),
    ):
        clip = read_amc(path, skeleton, **options)
        assert (clip.fps, clip.fps_source) == expected


def test_a_written_motion_says_that_a_codec_drew_some_of_it(clip, tmp_path):
    for step, coded in (("coded by loss", True), ("mirrored", False)):
        path = tmp_path / f"{coded}.amc"
        write_amc(clip.replace(channels=clip.channels, step=step), path)
        again = read_amc(path, clip.skeleton)
        assert again.was_coded is coded
        np.testing.assert_array_equal(again.channels, clip.channels)
        assert again.fps_source == "file"


def test_a_written_motion_keeps_its_rate(clip, tmp_path):
    for fps in (30.0, 24000 / 1001):
        write_amc(clip.replace(fps=fps), tmp_path / "again.amc")
        assert read_amc(tmp_path / "again.amc", clip.skeleton).fps == fps


# -- writing -------------------------------------------------------------------------------------


def test_written_skeleton_is_the_same(save, skeleton, tmp_path):
    write_asf(skeleton, tmp_path / "again.asf")
    assert read_asf(tmp_path / "again.asf") == skeleton


def test_written_motion_is_the_same(clip, tmp_path):
    write_amc(clip, tmp_path / "again.amc")
    again = read_amc(tmp_path / "again.amc", clip.skeleton)
    assert again.channels.tobytes() == clip.channels.tobytes()


def test_exact_offsets_of_any_size(tmp_path, skeleton):
    rng = np.random.default_rng(1)
    for _ in range(50):
        offsets = rng.normal(size=(6, 3)) * 10.0 ** rng.uniform(-6, 6, size=(6, 1))
        offsets[2] = 0.0
        other = replace(skeleton, offsets=offsets)
        write_asf(other, tmp_path / "other.asf")
        assert read_asf(tmp_path / "other.asf") == other


@pytest.mark.parametrize("metres", [1.0, 0.01, 0.001, 0.0254, 0.0254 / 0.45, 0.3048, 0.123456789])
def test_units(tmp_path, skeleton, metres):
    write_asf(replace(skeleton, metres_per_unit=metres), tmp_path / "other.asf")
    assert read_asf(tmp_path / "other.asf").metres_per_unit == metres


def test_columns_in_another_order_move_the_same(tmp_path, clip):
    """A skeleton may list its channels in another order than an ASF can."""
    skeleton = clip.skeleton
    dofs = list(skeleton.dofs)
    dofs[2] = ("rz", "rx", "ry")  # the order of rotation stays ZYX
    columns = np.arange(15)
    columns[[6, 7, 8]] = 8, 6, 7
    other = replace(clip, skeleton=replace(skeleton, dofs=dofs), channels=clip.channels[:, columns])
    write_asf(other.skeleton, tmp_path / "other.asf")
    write_amc(other, tmp_path / "other.amc")
    again = read_amc(tmp_path / "other.amc", read_asf(tmp_path / "other.asf"))
    assert np.allclose(
        naive_forward_kinematics(again)[0], naive_forward_kinematics(clip)[0], atol=1e-12
    )


def test_what_an_asf_cannot_hold(tmp_path, skeleton):
    for change, message in [
        ({"up": "z"}, "y up"),
        ({"convention": "bvh"}, "to_acclaim_convention"),
        ({"names": ("root", "left hip", "thigh", "shin", "foot", "spine")}, "'left hip'"),
        ({"names": ("hips", "root", "thigh", "shin", "foot", "spine")}, "'root'"),
        ({"dofs": (*skeleton.dofs[:5], ("tx", "rz", "ry", "rx"))}, "translations"),
    ]:
        with pytest.raises(SkeletonError, match=message):
            write_asf(replace(skeleton, **change), tmp_path / "other.asf")
    assert list(tmp_path.glob("*other*")) == []


def test_decimals(clip, tmp_path):
    write_amc(clip, tmp_path / "short.amc", decimals=1)
    again = read_amc(tmp_path / "short.amc", clip.skeleton)
    assert np.array_equal(again.channels, np.round(clip.channels, 1))


@pytest.mark.parametrize("number", [2**63, 10**20])
def test_a_first_frame_of_any_number(tmp_path, synthetic_walk, number):
    write_clip(synthetic_walk[:1], tmp_path / "a.amc")
    text = (tmp_path / "a.amc").read_text()
    (tmp_path / "a.amc").write_text(text.replace("\n1\n", f"\n{number}\n"))
    assert len(read_clip(tmp_path / "a.amc")) == 1
