"""What a user says of files: options, joint maps, and mocapdb.toml with all that may be wrong."""

from __future__ import annotations

import pytest

from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError, CorpusError, FormatError, SkeletonError
from mocapdb.io import ReadOptions, read_clip, read_joint_map, read_with_settings, write_clip
from mocapdb.io.folder_settings import FolderSettings
from mocapdb.motion.body import understand


@pytest.fixture(scope="module")
def take():
    return synthetic.make_clip("walk", seed=1, duration_s=1.0)


@pytest.fixture
def folder(tmp_path, take):
    for name in ("one.bvh", "takes/a.bvh", "takes/deep/b.bvh", "other/C.BVH"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_clip(take, path)
    return tmp_path


# -- options -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wrong", "error", "message"),
    [
        ({"unit_m": 0}, ClipError, "unit in metres, but got 0"),
        ({"unit_m": -1.0}, ClipError, "unit"),
        ({"unit_m": float("inf")}, ClipError, "unit"),
        ({"fps": float("nan")}, ClipError, "frame rate"),
        ({"up": "w"}, ClipError, "'w'"),
        ({"joint_map": {"left_kne": "a"}}, SkeletonError, "Did you mean left_knee"),
    ],
)
def test_options_that_cannot_be(wrong, error, message):
    with pytest.raises(error, match=message):
        ReadOptions(**wrong)


def test_options_over_each_other():
    said = ReadOptions(unit_m=0.01, strict=True).over(ReadOptions(unit_m=1.0, fps=30.0))
    assert said == ReadOptions(unit_m=0.01, fps=30.0, strict=True)
    assert ReadOptions().over(said) == said
    assert said.to_dict() == {"unit_m": 0.01, "fps": 30.0}
    assert ReadOptions().says_nothing
    assert not said.says_nothing


def test_keywords_win_over_options(folder):
    clip = read_clip(folder / "one.bvh", ReadOptions(unit_m=0.5, up="z"), up="y")
    assert (clip.skeleton.metres_per_unit, clip.skeleton.up) == (0.5, "y")


@pytest.mark.parametrize("suffix", [".bvh", ".amc", ".npz"])
def test_a_giant_is_a_warning(tmp_path, take, suffix):
    path = tmp_path / f"walk{suffix}"
    write_clip(take, path)
    assert not any(step.startswith("warning") for step in read_clip(path).provenance)
    giant = read_clip(path, metres_per_unit=1.0)
    (warning,) = [step for step in giant.provenance if step.startswith("warning")]
    assert "m tall with units of 1 m; people are 0.5 to 2.5 m" in warning
    fine = read_clip(path, metres_per_unit=take.skeleton.metres_per_unit)
    assert not any(step.startswith("warning") for step in fine.provenance)


# -- joint maps ----------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".bvh", ".amc", ".npz"])
def test_a_joint_map_stays_with_the_clip(tmp_path, take, suffix):
    path = tmp_path / f"walk{suffix}"
    write_clip(take, path)
    clip = read_clip(path, joint_map={"left_knee": "ltibia"})
    assert clip.skeleton.joint_map == {"left_knee": "ltibia"}
    write_clip(clip, tmp_path / "again.npz")
    assert read_clip(tmp_path / "again.npz").skeleton.joint_map == {"left_knee": "ltibia"}
    with pytest.raises(FormatError, match=rf"walk\{suffix}.*no 'ltibiaa'. Did you mean ltibia"):
        read_clip(path, joint_map={"left_knee": "ltibiaa"})
    with pytest.raises(FormatError, match="left side as left_knee, but got 'rtibia'"):
        read_clip(path, joint_map={"left_knee": "rtibia"})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "but got none"),
        ("left_knee = ", "Expected TOML"),
        ("left_knee = LeftLeg", "in quotes"),
        ("left_knee = 3", "name of a joint as left_knee, but got 3"),
        ('left_knee = ""', "left_knee"),
        ('left_knee = ["a"]', "left_knee"),
        ('LeftKnee = "a"', "'LeftKnee' is none"),
        ('[joints]\nleft_knee = "a"', "'joints' is none"),
        ('left_knee = "a"\nleft_knee = "b"', "Expected TOML"),
        (b'left_knee = "\xff"', "UTF-8"),
    ],
)
def test_joint_maps_that_cannot_be_read(tmp_path, text, message):
    path = tmp_path / "joints.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(FormatError, match=message) as caught:
        read_joint_map(path)
    assert caught.value.path == str(path)


def test_joint_maps_with_a_byte_order_mark(tmp_path):
    path = tmp_path / "joints.toml"
    path.write_bytes(b'\xef\xbb\xbfleft_knee = "LeftLeg"\r\nhead = "Kopf"\r\n')
    assert read_joint_map(path) == {"left_knee": "LeftLeg", "head": "Kopf"}
    with pytest.raises(FormatError, match="No such file"):
        read_joint_map(tmp_path / "none.toml")
    with pytest.raises(FormatError, match="directory"):
        read_joint_map(tmp_path)


# -- mocapdb.toml --------------------------------------------------------------------------------


def settings(folder, text, path="one.bvh"):
    (folder / "mocapdb.toml").write_text(text)
    return FolderSettings().of(folder / path)


def test_of_all_files_and_of_some(folder):
    text = """
        unit_m = 0.01
        up = "z"
        names = "{take}"

        ["takes/*.bvh"]
        unit_m = 1
        fps = 60

        ["*.bvh"]
        fps = 30
        strict = true
    """
    assert settings(folder, text).options == ReadOptions(0.01, "z", 30.0, strict=True)
    assert settings(folder, text).names == "{take}"
    assert settings(folder, text).source == folder / "mocapdb.toml"
    assert settings(folder, text, "takes/a.bvh").options == ReadOptions(1.0, "z", 30, strict=True)
    assert settings(folder, text, "takes/a.npz").options == ReadOptions(0.01, "z")


@pytest.mark.parametrize(
    ("pattern", "fitting"),
    [
        ("*.bvh", ["one.bvh", "takes/a.bvh", "takes/deep/b.bvh", "other/C.BVH"]),
        ("takes/*", ["takes/a.bvh"]),
        ("takes/**", ["takes/a.bvh", "takes/deep/b.bvh"]),
        ("./takes/**/*.bvh", ["takes/a.bvh", "takes/deep/b.bvh"]),
        ("**/b.bvh", ["takes/deep/b.bvh"]),
        ("[ab].bvh", ["takes/a.bvh", "takes/deep/b.bvh"]),
        ("[!ab].bvh", ["other/C.BVH"]),
        ("takes/?.bvh", ["takes/a.bvh"]),
        ("one.bvh", ["one.bvh"]),
        ("takes/one.bvh", []),
        ("o+e.bvh", []),
    ],
)
def test_patterns(folder, pattern, fitting):
    names = ["one.bvh", "takes/a.bvh", "takes/deep/b.bvh", "other/C.BVH"]
    text = f'["{pattern}"]\nfps = 7'
    assert [n for n in names if settings(folder, text, n).options.fps == 7] == fitting


def test_the_nearest_counts(folder):
    (folder / "mocapdb.toml").write_text("fps = 1\nunit_m = 1.0")
    (folder / "takes" / "mocapdb.toml").write_text("fps = 2")
    folders = FolderSettings()
    assert folders.of(folder / "takes" / "deep" / "b.bvh").options == ReadOptions(fps=2)
    assert folders.of(folder / "other" / "C.BVH").options == ReadOptions(fps=1, unit_m=1)


def test_a_relative_path_has_folders_above_it(folder, monkeypatch):
    (folder / "mocapdb.toml").write_text("fps = 1")
    monkeypatch.chdir(folder / "takes")
    assert FolderSettings().of("a.bvh").options.fps == 1


def test_what_the_user_says_wins(folder):
    (folder / "mocapdb.toml").write_text('unit_m = 0.5\nup = "z"\nfps = 60')
    clip = read_with_settings(folder / "takes" / "a.bvh", ReadOptions(unit_m=0.25))
    assert (clip.skeleton.metres_per_unit, clip.unit_source) == (0.25, "caller")
    assert (clip.skeleton.up, clip.up_source) == ("z", "settings")
    assert (clip.fps, clip.fps_source) == (60, "settings")
    (folder / "mocapdb.toml").unlink()
    assert read_with_settings(folder / "one.bvh").fps_source == "file"


def test_skeletons_are_for_amc_only(folder, take):
    write_clip(take, folder / "w.amc")
    (folder / "w.asf").rename(folder / "body.skeleton")
    (folder / "mocapdb.toml").write_text('skeleton = "body.skeleton"')
    assert len(read_with_settings(folder / "w.amc")) == len(take)
    assert len(read_with_settings(folder / "one.bvh")) == len(take)


def test_joint_maps_as_a_file_or_a_table(folder):
    (folder / "joints.toml").write_text('left_knee = "ltibia"')
    text = 'joint_map = "joints.toml"\n["takes/*"]\njoint_map = {head = "head"}'
    assert settings(folder, text).options.joint_map == {"left_knee": "ltibia"}
    assert settings(folder, text, "takes/a.bvh").options.joint_map == {"head": "head"}
    text = '[joint_map]\nleft_knee = "ltibia"'
    assert settings(folder, text).options.joint_map == {"left_knee": "ltibia"}
    clip = read_with_settings(folder / "one.bvh")
    assert clip.skeleton.joint_map == {"left_knee": "ltibia"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("unit = 0.01", "but got 'unit'. Did you mean unit_m"),
        ("unit_n = 0.01", "Did you mean unit_m"),
        ("UP = 'y'", "Did you mean up"),
        ("joints = 'a.toml'", "Did you mean joint_map"),
        ("upwards = 'y'", "Did you mean up"),
        ("mapping = 'a.toml'", "but got 'mapping'.$"),
        ("qqq = 1", "but got 'qqq'.$"),
        ("[takes]\nfps = 3", r'but got .takes.\..* look like \["takes/\*\.bvh"\]'),
        ('["takes/*"]\nfsp = 3', r'of \["takes/\*"\], but got .fsp.\. Did you mean fps'),
        ('["takes/*"]\nfps = "fast"', r'fps of \["takes/\*"\]: .*positive number, but got .fast'),
        ("fps = 0", "fps: Expected a positive number, but got 0"),
        ("fps = true", "fps: .*True"),
        ("fps = nan", "fps: .*nan"),
        ("unit_m = inf", "unit_m: .*inf"),
        ("unit_m = -0.01", "unit_m: .*-0.01"),
        ("unit_m = 1" + 400 * "0", "unit_m: Expected a positive number"),
        ('unit_m = "cm"', "unit_m: .*'cm'"),
        ('up = "w"', "up: Expected one of y, z, x, -x, -y, -z, but got 'w'"),
        ("up = ['y']", "up: .*\\['y'\\]"),
        ('strict = "yes"', "strict: Expected true or false, but got 'yes'"),
        ("names = 3", "names: Expected a text in quotes, but got 3"),
        ('names = ""', "names: "),
        ('skeleton = "none.asf"', "skeleton: .* there is no 'none.asf'"),
        ('joint_map = "none.toml"', "joint_map: .* there is no 'none.toml'"),
        ('joint_map = {left_kne = "a"}', "joint_map: .*Did you mean left_knee"),
        ("joint_map = {left_knee = 1}", "joint_map: .*left_knee, but got 1"),
        ("joint_map = 3", "joint_map: Expected a text in quotes"),
        ("unit_m 0.01", "Expected TOML"),
        ("[takes/*.bvh]\nfps = 3", "in quotes"),
        ('["../*"]\nfps = 3', r'below this folder, but got \["../\*"\]'),
        ('["/abs/*"]\nfps = 3', "below this folder"),
        ('["[z-a].bvh"]\nfps = 3', "Expected a pattern such as"),
        (b"names = '\xff'", "UTF-8"),
        (b"a" * (1 << 21), "over 1 MiB"),
        ("a = " + 3000 * "[", "Expected TOML"),
    ],
)
def test_settings_that_cannot_be(folder, text, message):
    path = folder / "mocapdb.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(CorpusError, match=message) as caught:
        FolderSettings().of(folder / "takes" / "a.bvh")
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize(
    ("height_m", "warned"), [(0.45, True), (0.55, False), (2.4, False), (2.6, True)]
)
def test_where_giants_and_dwarfs_begin(folder, take, height_m, warned):
    body = understand(take.skeleton, take.channels)
    unit_m = height_m / body.height_m * body.unit_m.value
    clip = read_clip(folder / "one.bvh", ReadOptions(unit_m=unit_m))
    assert any(step.startswith("warning") for step in clip.provenance) == warned


@pytest.mark.parametrize(
    "pattern",
    [
        "*?" * 40 + "b.bvh",
        "*a" * 40 + "*b.bvh",
        "**/" * 3 + "*a" * 40 + "b.bvh",
        "/".join(["*a*a*a*"] * 8) + "/*b.bvh",
        "?*" * 40 + "b.bvh",
        "[ab]*" * 40 + "c.bvh",
        "*[!b]" * 40 + "b.bvh",
    ],
)
def test_patterns_of_many_stars_take_no_time(tmp_path, pattern):
    """As a regular expression each would take longer than anybody lives to fit no such name."""
    (tmp_path / "mocapdb.toml").write_text(f'["{pattern}"]\nfps = 7\n')
    long = "a" * 200
    for name in (f"{long}.bvh", f"{'/'.join([long] * 9)}.bvh"):
        options = FolderSettings().of(tmp_path / name).options
        assert options.fps is None


def test_patterns_of_many_stars_fit_what_they_should(tmp_path):
    (tmp_path / "mocapdb.toml").write_text('["*a*a*b*a.bvh"]\nfps = 7\n')
    for name, fps in (("aaba.bvh", 7), ("xaxaxbxba.bvh", 7), ("aaab.bvh", None), ("ba.bvh", None)):
        assert FolderSettings().of(tmp_path / name).options.fps == fps
