"""What is said of files, on every command that reads some: options, and mocapdb.toml."""

import json

import pytest
from click.testing import CliRunner

from mocapdb.cli import cli
from mocapdb.corpus import synthetic
from mocapdb.io import read_clip, write_clip
from mocapdb.library import Library

READING = ("--unit-m", "--up", "--fps", "--skeleton", "--joint-map", "--strict")
READERS = ("blend", "build", "classify", "clean", "convert", "cycle", "query", "render")


def run(*arguments, code=0):
    done = CliRunner().invoke(cli, [str(argument) for argument in arguments])
    assert done.exit_code == code, done.output
    assert "Traceback" not in done.output
    return done


@pytest.fixture(scope="module")
def takes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("takes")
    clip = synthetic.make_clip("walk", seed=1, n_cycles=2.5, name="walk")
    for name in ("walk.bvh", "walk.amc"):
        write_clip(clip, folder / name)
    text = (folder / "walk.bvh").read_text()
    (folder / "slip.bvh").write_text(text.replace("MOTION", "# made by hand\nMOTION"))
    return folder


@pytest.fixture(scope="module")
def library(takes, tmp_path_factory):
    corpus = tmp_path_factory.mktemp("corpus")
    for kind in ("walk", "hop"):
        (corpus / kind).mkdir()
        write_clip(synthetic.make_clip(kind, seed=2, duration_s=3), corpus / kind / "a.bvh")
    path = corpus / "some.mocapdb"
    run("build", corpus, "-o", path, "--codec", "raw", "--jobs", 1)
    return path


@pytest.mark.parametrize("command", READERS)
def test_every_command_that_reads_files_has_the_options(command):
    text = run(command, "--help").stdout
    assert all(f"{option} " in text for option in READING)


@pytest.mark.parametrize("command", ["blend", "cycle", "render"])
def test_commands_with_a_rate_of_the_result(command):
    assert "--out-fps " in run(command, "--help").stdout


def converted(takes, tmp_path, *options, name="walk.bvh"):
    done = run("convert", takes / name, tmp_path / "out.npz", *options, "--json")
    return json.loads(done.stdout), read_clip(tmp_path / "out.npz"), done.stderr


def test_convert_says_who_said_what(takes, tmp_path):
    figures, clip, _ = converted(takes, tmp_path)
    assert (figures["unit_m_source"], figures["up_source"]) == ("inferred", "inferred")
    figures, clip, errors = converted(
        takes, tmp_path, "--unit-m", 0.06, "--up", "z", "--fps", 60, "--strict"
    )
    assert (figures["unit_m"], figures["unit_m_source"]) == (0.06, "caller")
    assert (figures["up"], figures["up_source"]) == ("z", "caller")
    assert (figures["fps"], figures["fps_source"]) == (60, "caller")
    assert (clip.skeleton.metres_per_unit, clip.skeleton.up, clip.fps) == (0.06, "z", 60)
    assert errors == ""


def test_a_giant_warns(takes, tmp_path):
    errors = converted(takes, tmp_path, "--unit-m", 1)[2]
    assert errors.startswith(f"warning: {takes / 'walk.bvh'}: the body is ")
    assert errors.count("warning") == 1


def test_the_folder_says_it(takes, tmp_path):
    settings = takes / "mocapdb.toml"
    try:
        settings.write_text('fps = 60\n["*.bvh"]\nup = "z"')
        figures = converted(takes, tmp_path)[0]
        assert (figures["fps_source"], figures["up_source"]) == ("settings", "settings")
        assert converted(takes, tmp_path, "--fps", 30)[0]["fps_source"] == "caller"
        assert converted(takes, tmp_path, name="walk.amc")[0]["up_source"] == "default"
        settings.write_text("fsp = 60")
        done = run("convert", takes / "walk.bvh", tmp_path / "out.npz", code=1)
        assert f"{settings}: Expected one of unit_m" in done.stderr
        assert "Did you mean fps?" in done.stderr
    finally:
        settings.unlink()


def test_joint_maps(takes, tmp_path):
    path = tmp_path / "joints.toml"
    path.write_text('left_knee = "ltibia"\nhead = "head"')
    clip = converted(takes, tmp_path, "--joint-map", path)[1]
    assert clip.skeleton.joint_map == {"left_knee": "ltibia", "head": "head"}
    for text, message in (
        ('left_knee = "Ltibia"', "Did you mean ltibia"),
        ('left_knee = "ltibia"\nleft_ankle = "ltibia"', "both left_knee and left_ankle"),
        ('left_knee = "rtibia"', "left side as left_knee, but got 'rtibia'"),
        ('left_nee = "ltibia"', "Did you mean left_knee"),
    ):
        path.write_text(text)
        done = run("convert", takes / "walk.bvh", tmp_path / "x.npz", "--joint-map", path, code=1)
        assert message in done.stderr


def test_wrong_values(takes, tmp_path):
    out = tmp_path / "x.npz"
    for options, code, message in (
        (("--unit-m", 0), 1, "positive unit in metres, but got 0"),
        (("--unit-m", "cm"), 2, "--unit-m"),
        (("--fps", "nan"), 1, "positive frame rate"),
        (("--up", "w"), 2, "--up"),
        (("--skeleton", takes / "walk.asf"), 1, "Leave it out"),
        (("--joint-map", tmp_path / "none.toml"), 1, "No such file"),
    ):
        assert message in run("convert", takes / "walk.bvh", out, *options, code=code).stderr
    assert not out.exists()


def test_strict_mends_nothing(takes, tmp_path):
    out = tmp_path / "x.npz"
    run("convert", takes / "slip.bvh", out)
    assert "strict" in run("convert", takes / "slip.bvh", out, "--strict", code=1).stderr
    assert "strict" in run("clean", takes / "slip.bvh", "--strict", code=1).stderr


def test_the_rate_of_a_loop(takes, tmp_path):
    loop = tmp_path / "loop.npz"
    done = run("cycle", takes / "walk.amc", "-o", loop, "--fps", 60, "--out-fps", 30)
    assert read_clip(loop).fps == 30
    assert all(line.startswith("warning: feet are held by") for line in done.stderr.splitlines())
    done = run("cycle", takes / "walk.amc", "-o", loop, "--fps", 60)
    assert read_clip(loop).fps == 60
    assert "of the result it is --out-fps" in done.stderr
    both = tmp_path / "both.npz"
    run("blend", loop, loop, "--weight", 0.5, "--out-fps", 50, "-o", both)
    assert read_clip(both).fps == 50


def test_the_rate_of_a_picture(takes, tmp_path):
    args = ("render", takes / "walk.bvh", "-o", tmp_path / "a.html", "--frames", "0:60", "--json")
    assert json.loads(run(*args, "--out-fps", 10).stdout)["fps"] == 10
    half = json.loads(run(*args, "--fps", 60, "--out-fps", 10).stdout)
    assert half["frames"] == 2 * json.loads(run(*args, "--out-fps", 10).stdout)["frames"]


@pytest.mark.parametrize(
    "command",
    [
        ("cycle", "LIB", "--class", "walk"),
        ("cycle", "LIB", "--clip", "walk/a"),
        ("render", "walk/a", "--library", "LIB", "-o", "a.html"),
    ],
)
def test_the_old_spelling_has_a_hint(library, command):
    words = [library if word == "LIB" else word for word in command]
    done = run(*words, "--fps", 30, code=2)
    assert "with a file that is read" in done.stderr
    assert "The rate of the result is --out-fps." in done.stderr


@pytest.mark.parametrize(
    "command",
    [
        ("query", "LIB", "walk/a"),
        ("classify", "LIB", "walk/a"),
        ("classify", "LIB"),
        ("clean", "LIB"),
    ],
)
def test_no_file_is_read(library, command):
    words = [library if word == "LIB" else word for word in command]
    done = run(*words, "--unit-m", 0.01, code=2)
    assert "with a file that is read" in done.stderr
    assert "--out-fps" not in done.stderr


def test_queries_read_as_they_are_told(takes, library):
    hits = [
        json.loads(run("query", library, takes / "walk.bvh", "-k", 1, "--json", *options).stdout)
        for options in ((), ("--fps", 60))
    ]
    ends = [answer["query"]["end"] for answer in hits]
    assert ends[1] == pytest.approx(2 * ends[0])
    folder = json.loads(
        run("classify", library, takes, "--skeleton", takes / "walk.asf", "--json").stdout
    )
    assert len(folder["clips"]) == 3


# -- build ---------------------------------------------------------------------------------------


@pytest.fixture
def corpus(takes, tmp_path):
    folder = tmp_path / "corpus"
    folder.mkdir()
    for name in ("walk_ana_1.bvh", "hop_bob_2.bvh"):
        (folder / name).write_bytes((takes / "walk.bvh").read_bytes())
    return folder


def built(corpus, *options, code=0):
    """Build without loss or search, and return each clip's record and skeleton by name."""
    path = corpus.parent / "some.mocapdb"
    raw = ("--codec", "raw", "--jobs", 1, "--no-index", "--json")
    done = run("build", corpus, "-o", path, *raw, *options, code=code)
    with Library(path) as library:
        clips = {record.name: (record, library.skeleton(record)) for record in library.records()}
    return json.loads(done.stdout), clips, done.stderr


def test_build_takes_names_and_settings(corpus):
    (corpus / "mocapdb.toml").write_text('unit_m = 0.06\n["walk*"]\nup = "z"\nfps = 60')
    report, clips, _ = built(corpus, "--names", "{label}_{subject}_{take}")
    assert report["built"] == 2
    record, skeleton = clips["walk_ana_1"]
    assert (record.label, record.fps, record.fps_source) == ("walk", 60, "settings")
    assert (skeleton.metres_per_unit, skeleton.up) == (0.06, "z")
    record, skeleton = clips["hop_bob_2"]
    assert (record.label, record.fps_source, skeleton.up) == ("hop", "file", "y")

    # nothing changed; then what is said of one file has changed, then of both
    assert built(corpus, "--names", "{label}_{subject}_{take}")[0]["built"] == 0
    (corpus / "mocapdb.toml").write_text('unit_m = 0.06\n["walk*"]\nup = "y"\nfps = 60')
    assert built(corpus, "--names", "{label}_{subject}_{take}")[0]["built"] == 1
    report, clips, _ = built(corpus, "--unit-m", 0.05, "--fps", 30)
    assert report["built"] == 2
    for record, skeleton in clips.values():
        assert (skeleton.metres_per_unit, record.fps, record.fps_source) == (0.05, 30, "caller")


def test_build_keeps_joint_maps(corpus, tmp_path):
    path = tmp_path / "joints.toml"
    path.write_text('left_knee = "ltibia"')
    _, clips, _ = built(corpus, "--joint-map", path)
    assert all(skeleton.joint_map == {"left_knee": "ltibia"} for _, skeleton in clips.values())
    path.write_text('left_knee = "shin"')
    report, clips, errors = built(corpus, "--joint-map", path, code=1)
    assert [failure["reason"][-60:] for failure in report["failed"]]
    assert errors.count("has no 'shin'") == 2
    assert len(clips) == 2


def test_build_skips_names_that_do_not_fit(corpus):
    (corpus / "odd.bvh").write_bytes((corpus / "hop_bob_2.bvh").read_bytes())
    (corpus / "mocapdb.toml").write_text('names = "{label}_{subject}_{take}"')
    report, clips, errors = built(corpus, code=1)
    assert report["built"] == 2
    assert set(clips) == {"walk_ana_1", "hop_bob_2"}
    assert f"{corpus / 'odd.bvh'}: Expected a name such as" in errors


@pytest.mark.parametrize(
    ("settings", "options", "message"),
    [
        ("unit = 1", (), "Did you mean unit_m"),
        ('["*.bvh"]\nup = "w"', (), 'up of ["*.bvh"]: Expected one of y, z, x'),
        ('names = "{label}{take}"', (), "mocapdb.toml: names: "),
        ("", ("--names", "{path}_{take}"), "--names: '{path}_{take}': "),
        ("", ("--names", "walk"), "no field"),
        ("", ("--unit-m", -1), "positive unit"),
    ],
)
def test_build_refuses_settings_that_cannot_be(corpus, settings, options, message):
    (corpus / "mocapdb.toml").write_text(settings)
    library = corpus.parent / "some.mocapdb"
    done = run("build", corpus, "-o", library, "--codec", "raw", *options, code=1)
    assert message in done.stderr


def test_build_refuses_reserved_columns(corpus):
    (corpus / "LABELS.csv").write_text("clip,label,codec\nwalk_ana_1,walk,x\n")
    library = corpus.parent / "some.mocapdb"
    done = run("build", corpus, "-o", library, "--codec", "raw", code=1)
    assert f"{corpus / 'LABELS.csv'}:2: " in done.stderr
    assert "'codec', which is reserved" in done.stderr


def test_strict_builds_stop_at_what_would_be_mended(corpus, takes):
    (corpus / "a_slip_1.bvh").write_bytes((takes / "slip.bvh").read_bytes())
    assert built(corpus)[0]["built"] == 3
    library = corpus.parent / "strict.mocapdb"
    raw = ("--codec", "raw", "--jobs", 1)
    assert "strict" in run("build", corpus, "-o", library, *raw, "--strict", code=1).stderr
