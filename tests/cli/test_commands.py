"""The commands on a library: what they print, as text and as JSON, and how they fail."""

from __future__ import annotations

import io
import json
import subprocess
import sys
import time
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from small_library import CLIPS, NAMES, OPTIONS, run, run_json

import mocapdb
from mocapdb.cli import COMMANDS, cli
from mocapdb.cli import _console as console
from mocapdb.io import read_clip
from mocapdb.library import Library
from mocapdb.library.database import CATALOGUE_FORMAT
from mocapdb.library.shards import SHARD_FORMAT

BAD_BVH = "HIERARCHY\nROOT Hips\n{\n  OFFSET 0 zero 0\n"
FIGURES = {
    "clips": int,
    "frames": int,
    "payload_bytes": int,
    "bytes_per_frame": float,
    "ratio_float32": float,
    "skinned_error": float,
    "error_mm": dict,
    "classes": dict,
}


def assert_types(answer: dict, contract: dict[str, type]) -> None:
    assert contract.items() <= {key: type(value) for key, value in answer.items()}.items()


class TestHelp:
    @pytest.mark.parametrize("command", sorted(COMMANDS))
    def test_every_command_has_an_example(self, command):
        help_ = run(command, "--help").stdout
        if command != "reproduce":
            assert f"Example:\n    mocapdb {command}" in help_
            assert "--json" in help_

    def test_the_version_says_the_format_too(self):
        said = run("--version").stdout
        assert f"version {mocapdb.__version__}\n" in said
        assert f"catalogue format {CATALOGUE_FORMAT}, shard format {SHARD_FORMAT}" in said

    def test_every_option_is_explained(self):
        for name in COMMANDS:
            command = cli.get_command(click.Context(cli), name)
            several = command.commands.values() if name == "reproduce" else [command]
            for each in several:
                unexplained = [
                    option.name
                    for option in each.params
                    if isinstance(option, click.Option) and not option.help
                ]
                assert not unexplained, f"{name} {each.name}"
                text = each.get_help(click.Context(each))
                assert "\\b" not in text and "\b" not in text

    def test_every_command_is_listed(self):
        listed = run("--help").stdout
        for name, summary in COMMANDS.items():
            assert name in listed
            assert summary.rstrip(".") in listed

    @pytest.mark.parametrize(
        "arguments",
        [
            ["nonsense"],
            ["build"],
            ["build", "here"],
            ["build", "here", "-o", "l", "--error", "1", "--max-mm", "2"],
            ["build", "here", "-o", "l", "--jobs", "0"],
            ["build", "here", "-o", "l", "--error", "much"],
            ["build", "here", "-o", "l", "--transform", "fft"],
            ["export", "l", "clip"],
            ["ls"],
            ["info", "--nonsense"],
        ],
    )
    def test_wrong_usage_exits_with_2(self, arguments):
        answer = run(*arguments)
        assert (answer.exit_code, answer.stdout) == (2, "")
        assert "Error: " in answer.stderr


class TestBuild:
    def test_json(self, small_corpus, tmp_path):
        (small_corpus / "bvh/02_02.bvh").write_text(BAD_BVH)
        library = tmp_path / "l.mocapdb"
        answer = run_json("build", small_corpus, "-o", library, *OPTIONS, exit_code=1)
        assert_types(
            answer,
            {
                "library": str,
                "built": int,
                "skipped": int,
                "failed": list,
                "frames": int,
                "payload_bytes": int,
                "seconds": float,
            },
        )
        (failure,) = answer["failed"]
        assert failure["path"] == str(small_corpus / "bvh/02_02.bvh")
        assert failure["line"] == 4
        assert failure["reason"].startswith("Expected ")
        assert answer["built"] == len(CLIPS) - 1
        again = run_json("build", small_corpus, "-o", library, *OPTIONS, exit_code=1)
        assert (again["built"], again["skipped"]) == (0, len(CLIPS) - 1)
        figures = run_json("info", library)
        assert figures["frames"] == answer["frames"]
        assert figures["payload_bytes"] == answer["payload_bytes"]

    def test_text(self, small_corpus, tmp_path):
        (small_corpus / "bvh/02_02.bvh").write_text(BAD_BVH)
        answer = run("build", small_corpus, "-o", tmp_path / "l.mocapdb", *OPTIONS)
        assert answer.exit_code == 1
        assert "built 5 clips (600 frames, " in answer.stdout
        assert answer.stdout.splitlines()[0].endswith("0 were there already, 1 failed.")
        assert f"skipped {small_corpus / 'bvh/02_02.bvh'}:4: Expected " in answer.stderr

    @pytest.mark.parametrize(
        ("option", "column"),
        [
            ("--error", "skinned_error"),
            ("--mean-mm", "error_mean_mm"),
            ("--max-mm", "error_max_mm"),
        ],
    )
    def test_targets(self, small_corpus_template, tmp_path, option, column):
        library = tmp_path / "l.mocapdb"
        codec = ("--representation", "channels", "--transform", "dct", "--jobs", 1)
        run("build", small_corpus_template, "-o", library, option, 3, *codec)
        with Library(library) as opened:
            errors = [getattr(record, column) for record in opened.records()]
        assert 0.5 < max(errors) <= 3

    def test_representation_and_transform(self, small_corpus_template, tmp_path):
        library = tmp_path / "l.mocapdb"
        options = ("--representation", "aligned", "--transform", "dwt", "--mean-mm", 3)
        run("build", small_corpus_template, "-o", library, "--jobs", 1, *options)
        with Library(library) as opened:
            chosen = {tuple(record.codec.split()[:3]) for record in opened.records()}
        assert chosen == {("okane", "aligned", "dwt")}

    @pytest.mark.parametrize("value", ["0", "-1", "nan", "inf"])
    def test_a_target_that_is_none(self, small_corpus_template, tmp_path, value):
        answer = run("build", small_corpus_template, "-o", tmp_path / "l", "--max-mm", value)
        assert answer.exit_code == 1
        assert "Expected a positive target in mm" in answer.stderr
        assert not (tmp_path / "l").exists()


class TestReading:
    def test_info_json(self, small_library):
        answer = run_json("info", small_library)
        assert_types(answer, FIGURES)
        assert set(answer["error_mm"]) == {"mean", "p95", "max"}
        assert answer["classes"] == {"box": 1, "run": 1, "squat": 1, "walk": 2, "wave": 1}
        assert answer["disk_bytes"] >= answer["payload_bytes"]

    def test_info_json_of_a_clip(self, small_library):
        answer = run_json("info", small_library, "01_02")
        assert_types(answer, FIGURES | {"clip": str, "label": str, "fps": float, "codec": str})
        assert (answer["clips"], answer["clip"], answer["label"], answer["fps"]) == (
            1, "01_02", "run", 60.0
        )  # fmt: skip

    def test_info_text(self, small_library):
        text = run("info", small_library).stdout
        assert "clips           6\n" in text
        assert "walk 2" in text
        assert "frames/s, from the labels" in run("info", small_library, "01_02").stdout

    def test_ls_json(self, small_library):
        clips = run_json("ls", small_library)["clips"]
        assert [clip["clip"] for clip in clips] == list(NAMES)
        assert_types(
            clips[0],
            {
                "clip": str,
                "label": str,
                "frames": int,
                "fps": float,
                "seconds": float,
                "payload_bytes": int,
                "skinned_error": float,
                "error_mm": dict,
                "codec": str,
                "source": str,
            },
        )

    def test_ls_text(self, small_library):
        lines = run("ls", small_library).stdout.splitlines()
        assert lines[-1] == "6 clips"
        for name in NAMES:
            assert any(line.strip().startswith(name) for line in lines)

    def test_ls_narrowed(self, small_library):
        def names(*options: str) -> list[str]:
            return [clip["clip"] for clip in run_json("ls", small_library, *options)["clips"]]

        assert names("--class", "walk") == ["01_01", "02_01"]
        assert names("--search", "ladder") == ["02_01"]
        assert names("--search", "no such word") == []
        assert run("ls", small_library, "--search", "no such word").stdout.endswith("0 clips\n")

    def test_verify_json(self, small_library):
        answer = run_json("verify", small_library)
        assert (answer["clips"], answer["bad"]) == (6, [])
        assert run("verify", small_library).stdout == f"{small_library}: 6 of 6 clips are sound.\n"

    def test_compact(self, small_library):
        answer = run_json("compact", small_library)
        assert_types(answer, {"library": str, "freed_bytes": int})
        assert "freed" in run("compact", small_library).stdout


class TestExport:
    @pytest.mark.parametrize("suffix", ["amc", "bvh", "npz"])
    def test_json(self, small_library, tmp_path, suffix):
        out = tmp_path / f"out.{suffix}"
        answer = run_json("export", small_library, "02_02", "-o", out)
        expected = {
            "library": str(small_library),
            "clip": "02_02",
            "output": str(out),
            "frames": 120,
            "fps": 120.0,
            "up": "y",
            "body": "by names",
        }
        assert answer | expected == answer
        assert answer["unit_m"] == pytest.approx(0.0254 / 0.45)
        assert {"fps_source", "up_source", "unit_m_source", "height_m"} < set(answer)
        assert len(read_clip(out)) == 120

    def test_a_stem_of_two_is_said_to_be_taken_by_the_suffix(self, small_library, tmp_path):
        answer = run("export", small_library, "both", "-o", tmp_path / "o.bvh")
        assert answer.exit_code == 0
        assert answer.stderr == "both is ambiguous: took bvh/both, read from a .bvh.\n"
        answer = run_json("export", small_library, "both", "-o", tmp_path / "o.amc")
        assert answer["clip"] == "01/both"


class TestConvert:
    def test_there_and_back(self, small_corpus_template, tmp_path):
        source = small_corpus_template / "01/01_01.amc"
        answer = run_json("convert", source, tmp_path / "a.bvh")
        assert (answer["frames"], answer["fps"], answer["fps_source"]) == (120, 120.0, "file")
        assert run("convert", tmp_path / "a.bvh", tmp_path / "b.amc").exit_code == 0
        assert len(read_clip(tmp_path / "b.amc")) == 120
        text = run("convert", source, tmp_path / "c.npz", "--fps", 30).stdout
        assert "120 frames at 30 Hz (caller), " in text

    def test_a_bad_file(self, tmp_path):
        (tmp_path / "a.bvh").write_text("no motion\n")
        answer = run("convert", tmp_path / "a.bvh", tmp_path / "b.npz")
        assert answer.exit_code == 1
        assert answer.stderr.startswith(f"mocapdb: {tmp_path / 'a.bvh'}:1: Expected ")
        assert not (tmp_path / "b.npz").exists()


class TestFaults:
    """What goes wrong inside is one line, and a traceback only for who asks."""

    @pytest.fixture
    def breaking(self, monkeypatch):
        monkeypatch.setattr(Library, "info", lambda self, clip: {}["oops"])

    def test_one_line(self, small_library, breaking):
        answer = CliRunner().invoke(cli, ["info", str(small_library)])
        assert (answer.exit_code, answer.stdout) == (1, "")
        assert answer.stderr == (
            "mocapdb: a fault of mocapdb's own (KeyError: 'oops'). "
            "Run 'mocapdb --debug ...' and report what it prints.\n"
        )

    def test_debug(self, small_library, breaking):
        answer = CliRunner().invoke(cli, ["--debug", "info", str(small_library)])
        assert isinstance(answer.exception, KeyError)

    def test_an_interrupt_in_a_destructor_is_not_lost(self, small_library, monkeypatch):
        class Doomed:
            def __del__(self):
                raise KeyboardInterrupt

        def info(self, clip):
            Doomed()
            time.sleep(600)

        monkeypatch.setattr(Library, "info", info)
        begun = time.monotonic()
        answer = CliRunner().invoke(cli, ["info", str(small_library)])
        assert time.monotonic() - begun < 300  # it wakes who sleeps
        assert answer.exit_code == 130
        assert answer.stderr == "Interrupted: nothing is left half written.\n"


class TestInterrupts:
    """Ctrl-C outside of what a command does: before it begins, and when it is done."""

    MAIN = "from mocapdb.__main__ import main; main()"

    def test_while_the_command_is_loaded(self, tmp_path):
        (tmp_path / "click.py").write_text("raise KeyboardInterrupt\n")
        code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {self.MAIN}"
        done = subprocess.run(
            [sys.executable, "-c", code, "ls"], capture_output=True, text=True, check=False
        )
        assert (done.returncode, done.stdout, done.stderr) == (130, "", "")

    def test_while_python_ends(self, small_library_template):
        code = "import atexit, os; atexit.register(os.kill, os.getpid(), 2); " + self.MAIN
        done = subprocess.run(
            [sys.executable, "-c", code, "ls", str(small_library_template)],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout.endswith("6 clips\n")


class TestConsole:
    def test_progress_without_a_terminal_is_a_line_now_and_then(self, monkeypatch, capsys):
        with console.progress_bar("Working") as advance:
            advance(1, 3, "a")
            monkeypatch.setattr(console, "SECONDS_A_LINE", 0.0)
            advance(2, 3, "b")
        assert capsys.readouterr() == ("", "Working 2/3 b\n")

    def test_progress_on_a_terminal_goes_to_stderr(self, monkeypatch, capsys):
        class Terminal(io.StringIO):
            def isatty(self) -> bool:
                return True

        terminal = Terminal()
        monkeypatch.setattr("sys.stderr", terminal)
        with console.progress_bar("Working") as advance:
            advance(1, 2, "clip a")
        assert "Working" in terminal.getvalue()
        assert capsys.readouterr().out == ""

    def test_json_is_ascii_whatever_the_names(self, capsys):
        console.emit_json({"clip": "ä", "path": b"\xff.amc".decode(errors="surrogateescape")})
        out = capsys.readouterr().out
        assert out.isascii()
        assert json.loads(out)["clip"] == "ä"

    @pytest.mark.parametrize(
        ("size", "text"), [(999, "1.0 kB"), (1e6, "1.0 MB"), (2.5e9, "2.50 GB")]
    )
    def test_megabytes(self, size, text):
        assert console.megabytes(size) == text


def test_the_modules_are_where_the_table_says():
    folder = Path(console.__file__).parent
    assert set(COMMANDS) == {path.stem for path in folder.glob("[a-z]*.py")}


class TestImports:
    @pytest.mark.parametrize("arguments", [["--help"], ["ls"], ["info"]])
    def test_looking_at_a_library_imports_nothing_heavy(self, small_library_template, arguments):
        if arguments != ["--help"]:
            arguments = [*arguments, str(small_library_template)]
        code = "import atexit, sys; atexit.register(lambda: print(*sys.modules, file=sys.stderr))"
        code += "; from mocapdb.__main__ import main; main()"
        command = [sys.executable, "-c", code, *arguments]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        loaded = set(done.stderr.split())
        assert "mocapdb.cli" in loaded
        heavy = {"numba", "scipy", "h5py", "pywt", "rich", "sqlite_utils", "sklearn", "joblib"}
        assert not heavy & loaded

    def test_a_cycle_imports_neither_scikit_learn_nor_scipys_larger_parts(self):
        code = (
            "import sys; from mocapdb.corpus import synthetic; "
            "from mocapdb.cycles import extract_cycle; "
            "extract_cycle(synthetic.make_clip('walk', seed=0, duration_s=4.0)).loop(); "
            "print(*sys.modules)"
        )
        loaded = set(subprocess.check_output([sys.executable, "-c", code], text=True).split())
        assert "pyRipser" in loaded
        assert not {"sklearn", "rich", "joblib", "scipy.signal", "scipy.stats"} & loaded
