"""Options of ``mocapdb build`` that concern codecs: what they do, and how bad ones are refused."""

import numpy as np
import pytest
from small_library import run, run_json, sound, write_clips

from mocapdb.io import read_clip
from mocapdb.library import Library
from mocapdb.motion.skin import motion_error

OKANE = (
    "--codec", "okane", "--transform", "dct", "--mean-mm", 3, "--joint-share", 0,
    "--jobs", 1, "--no-index",
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Four walks of half a second, and a hop by itself."""
    root = tmp_path_factory.mktemp("walks")
    walks = {f"walk/w_{seed}.bvh": ("walk", seed) for seed in range(4)}
    write_clips(root, {**walks, "hop/h_1.bvh": ("hop", 1)})
    return root


def codecs(library):
    with Library(library) as opened:
        return {record.name: record.codec for record in opened.records()}


class TestOkane:
    def test_by_default_aligned_positions_with_axes_of_the_class(self, folder, tmp_path):
        library = tmp_path / "l.mocapdb"
        assert run("build", folder, "-o", library, *OKANE, "--joint-share", 0).exit_code == 0
        chosen = codecs(library)
        assert all(chosen[f"w_{seed}"].endswith(" of a set") for seed in range(4))
        assert all(codec.startswith("okane aligned dct") for codec in chosen.values())
        assert "of a set" not in chosen["h_1"]  # one hop is no class
        assert sound(library)
        answer = run_json("info", library)
        assert answer["shared_axes"] == 1
        assert answer["shared_axes_bytes"] > 4 * 183
        assert "okane aligned dct pca of a set 4" in run("info", library).stdout
        assert "shared axes     1 set," in run("info", library).stdout

    def test_a_wavelet_is_kept_with_the_clip(self, folder, tmp_path):
        library = tmp_path / "l.mocapdb"
        options = ("--transform", "dwt", "--wavelet", "sym4", "--decorrelation", "none")
        run("build", folder, "-o", library, *OKANE, *options)
        assert set(codecs(library).values()) == {"okane aligned dwt sym4"}
        assert sound(library)

    def test_budgets_are_kept(self, folder, tmp_path):
        library = tmp_path / "l.mocapdb"
        run("build", folder, "-o", library, *OKANE, "--budgets", "0.4,0,0.6")
        assert set(codecs(library).values()) == {"okane aligned dct"}
        run("build", folder, "-o", library, *OKANE, "--budgets", "0.2,0.6,0.2")
        assert all("pca=" in codec for codec in codecs(library).values())

    def test_a_representation(self, folder, tmp_path):
        library = tmp_path / "l.mocapdb"
        run("build", folder, "-o", library, *OKANE, "--representation", "channels")
        assert all(codec.startswith("okane channels") for codec in codecs(library).values())
        assert any(codec.endswith("of a set") for codec in codecs(library).values())


@pytest.mark.parametrize("codec", [(), ("--codec", "okane", "--transform", "dct")], ids=str)
def test_bytes_a_frame(folder, tmp_path, codec):
    library = tmp_path / "l.mocapdb"
    options = ("--bytes-per-frame", 30, "--jobs", 1, "--no-index", *codec)
    assert run("build", folder, "-o", library, *options).exit_code == 0
    with Library(library) as opened:
        assert all(r.payload_bytes <= 30 * r.frames for r in opened.records())


def test_fewer_bytes_than_a_header_takes_are_an_error_of_each_clip(folder, tmp_path):
    options = ("--bytes-per-frame", 0.1, "--jobs", 1, "--no-index")
    answer = run("build", folder, "-o", tmp_path / "l.mocapdb", *options)
    assert answer.exit_code == 1
    assert answer.stderr.count("of which the coarsest step makes") == 5


def test_a_target_that_no_step_holds_is_told(folder, tmp_path):
    options = ("--max-mm", 1e-11, "--jobs", 1, "--no-index")
    answer = run("build", folder, "-o", tmp_path / "l.mocapdb", *options)
    assert answer.exit_code == 0
    assert "warning: no step of the codec keeps" in answer.stderr
    assert (
        "to max_mm <= 1e-11 mm, joints keep 90 % in fewer bytes than the channels take"
        in answer.stderr
    )
    assert set(codecs(tmp_path / "l.mocapdb").values()) == {"raw"}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--budgets", "0.5,0.5"), "expected three numbers such as 0.2,0.7,0.1"),
        (("--budgets", "a,b,c"), "expected three numbers such as 0.2,0.7,0.1"),
        (("--budgets", "-0.2,0.7,0.5"), "that are not negative and not all zero"),
        (("--budgets", "nan,0.7,0.5"), "that are not negative and not all zero"),
        (("--budgets", "0.2,0.2,0.2"), "sum to 1, the whole target, but 0.2 + 0.2 + 0.2 is 0.6"),
        (("--wavelet", "daubechies4"), "but got 'daubechies4'. Did you mean db4?"),
        (("--wavelet", "morl"), "Expected a discrete wavelet of PyWavelets"),
        (("--wavelet", "db4", "--transform", "dct"), "Expected no --wavelet with --transform dct"),
        (("--wavelet", "db4", "--codec", "pose"), "Expected --wavelet with --codec okane only"),
        (("--budgets", "0,0,1", "--codec", "pose"), "Expected --budgets with --codec okane only"),
        (("--budgets", "0.2,0,0.8", "--decorrelation", "pca"), "Expected a P over 0 in --budgets"),
        (("--budgets", "0.2,0.3,0.5", "--decorrelation", "none"), "Expected a P of 0 in --budgets"),
        (("--codec", "okane", "--decorrelation", "lattice"), "Expected --decorrelation auto"),
        (("--codec", "okane", "--transform", "spline"), "Expected --transform auto, dct or dwt"),
        (("--bytes-per-frame", "9", "--max-mm", "1"), "Expected one of --error, --mean-mm"),
    ],
)  # fmt: skip
def test_options_that_make_no_sense_are_wrong_usage(folder, tmp_path, options, said):
    answer = run("build", folder, "-o", tmp_path / "l.mocapdb", *options)
    assert answer.exit_code == 2
    assert said in " ".join(answer.stderr.split())
    assert not (tmp_path / "l.mocapdb").exists()


def test_no_wavelet_is_suggested_that_is_nothing_like_it(folder, tmp_path):
    answer = run("build", folder, "-o", tmp_path / "l.mocapdb", "--wavelet", "foo")
    assert "but got 'foo'." in answer.stderr
    assert "Did you mean" not in answer.stderr


@pytest.mark.parametrize("value", ["0", "-3", "nan", "inf"])
def test_a_number_of_bytes_that_is_none(folder, tmp_path, value):
    answer = run("build", folder, "-o", tmp_path / "l.mocapdb", "--bytes-per-frame", value)
    assert answer.exit_code == 1
    assert "Expected a positive number of bytes a frame" in answer.stderr


class TestRepresentations:
    def test_export_as(self, folder, tmp_path):
        library, output = tmp_path / "l.mocapdb", tmp_path / "w.npz"
        run("build", folder, "-o", library, "--jobs", 1, "--no-index")
        answer = run_json("export", library, "w_1", "--as", "aligned", "-o", output)
        assert answer["representation"] == "aligned"
        with np.load(output, allow_pickle=False) as archive, Library(library) as opened:
            aligned = opened.clip("w_1").represent("aligned")
            np.testing.assert_array_equal(archive["values"], aligned.values)
            np.testing.assert_array_equal(archive["root"], aligned.root)
        assert "60 frames in scaled" in run(
            "export", library, "w_1", "--as", "scaled", "-o", tmp_path / "w.csv"
        ).stdout  # fmt: skip
        answer = run("export", library, "w_1", "--as", "scaled", "-o", tmp_path / "w.bvh")
        assert answer.exit_code == 2
        assert "Expected a .npz or a .csv with --as, but got 'w.bvh'" in answer.stderr

    def test_convert_as_and_back(self, folder, tmp_path):
        source, kept, again = folder / "walk/w_1.bvh", tmp_path / "x.npz", tmp_path / "y.bvh"
        assert run_json("convert", source, kept, "--as", "normalised")["frames"] == 60
        assert run("convert", kept, again).exit_code == 0
        error = motion_error(read_clip(source), read_clip(again))
        assert error.vertices.max < 1e-3
        assert run("convert", source, tmp_path / "z.amc", "--as", "aligned").exit_code == 2


def test_okanes_options_take_his_codec_and_say_so(folder, tmp_path):
    options = ("--budgets", "0.2,0.7,0.1", "--jobs", 1, "--no-index")
    done = run("build", folder / "hop", "-o", tmp_path / "l.mocapdb", *options)
    assert "--budgets: okane's codec is taken" in done.stderr
    assert "dwt" not in done.stderr
    named = run("build", folder / "hop", "-o", tmp_path / "w.mocapdb", "--wavelet", "haar")
    assert "--wavelet haar is for clips that dwt stores in fewer bytes than dct" in named.stderr


@pytest.mark.parametrize("option", [["--transform", "dct"], ["--decorrelation", "none"]])
def test_raw_channels_take_no_options_of_others(folder, tmp_path, option):
    done = run("build", folder / "hop", "-o", tmp_path / "l.mocapdb", "--codec", "raw", *option)
    assert done.exit_code == 2
    assert "pose or okane only" in done.stderr


@pytest.mark.parametrize("option", [["--mean-mm", "1"], ["--joint-share", "0.1"]])
def test_raw_channels_have_no_target(folder, tmp_path, option):
    done = run("build", folder / "hop", "-o", tmp_path / "l.mocapdb", "--codec", "raw", *option)
    assert done.exit_code == 2
    assert "it loses nothing" in done.stderr
    assert not (tmp_path / "l.mocapdb").exists()


def test_bytes_enough_for_all_are_no_failure(folder, tmp_path):
    options = ("--bytes-per-frame", "1e9", "--jobs", 1, "--no-index")
    done = run("build", folder / "hop", "-o", tmp_path / "l.mocapdb", *options)
    assert "no step" not in done.stderr
