"""What the documentation says to type is done, and what it shows in Python runs."""

from __future__ import annotations

import re
import shlex
import shutil
from contextlib import nullcontext, suppress
from pathlib import Path

import click
import numpy as np
import pytest
from desk import make_desk
from matplotlib import pyplot
from page_cells import cells, in_this_process, run_cells
from small_library import run

import mocapdb
from mocapdb.cli import cli

ROOT = Path(mocapdb.__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]

# what is understood and not done here, by the words that it begins with, and why
ELSEWHERE = {
    "view": "it serves a browser until Ctrl-C; tests/viewer looks at it in one",
    "fetch": "it asks CMU's site; tests/cli/test_fetch_command.py has a site of its own",
    "demo": "tests/cli/test_commands.py runs it, which takes its time",
    "reproduce okane": "of a few clips it takes 20 s; tests/reproduce computes its tables",
    "reproduce aristidou": "of a few clips it takes a minute; tests/reproduce computes its tables",
    "reproduce all": "it takes minutes; tests/reproduce/test_side_by_side.py",
}
OTHER_MACHINES = "://"  # such an address: tests/library has stores and clusters of its own
OF_THE_CORPUS = ("reproduce raunio", "reproduce vejdemo")  # done where real clips are

LEFT_OUT = (click.MissingParameter, click.BadOptionUsage)


def commands():
    """Every command that a page says: the page and its words."""
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for line, mention in re.findall(r"^ {4,}(mocapdb .*)$|`(mocapdb [^`]*)`", text, re.M):
            said = re.split(r" #|\s{3,}", line or mention)[0]  # what follows explains it
            words = shlex.split(said)[1:]
            if words and words[0] in cli.list_commands(None) and "..." not in words:
                yield page.relative_to(ROOT).as_posix(), tuple(words), bool(line)


SAID = list(dict.fromkeys(commands()))


def understand(group, words):
    """Parse a command with all its options, without doing it."""
    context = click.Context(group)
    command = group.get_command(context, words[0])
    assert command is not None, f"no command {words[0]}"
    if isinstance(command, click.Group):
        if len(words) == 1 or words[1].startswith("-"):
            raise click.MissingParameter("which one is not said")
        understand(command, words[1:])
    else:
        command.make_context(words[0], list(words[1:]))


def is_whole(words):
    """Whether a mention in a sentence can be done; some of it may be left out there."""
    try:
        understand(cli, words)
    except LEFT_OUT:
        return False
    return True


def begins(words, beginnings):
    return any(words[: len(start.split())] == tuple(start.split()) for start in beginnings)


WHOLE = {
    words: page
    for page, words, is_line in SAID
    if "--help" not in words and (is_line or is_whole(words))
}
DONE = {
    words: page
    for words, page in WHOLE.items()
    if "--dry-run" in words
    or not (begins(words, (*ELSEWHERE, *OF_THE_CORPUS)) or OTHER_MACHINES in " ".join(words))
}


def named(found):
    return [f"{page}:{' '.join(words)}" for words, page in found.items()]


def test_there_are_commands_of_every_sort():
    assert len(DONE) > 100
    asked = {words[0] for words in WHOLE}
    assert asked == set(cli.list_commands(None))
    assert {words[0] for words in DONE} >= asked - {start.split()[0] for start in ELSEWHERE}
    for start in (*ELSEWHERE, *OF_THE_CORPUS):  # nothing is left out that no page says
        assert any(begins(words, [start]) for words in WHOLE), start


LEFT = {words: page for page, words, _ in SAID if words not in DONE and "--help" not in words}


@pytest.mark.parametrize("words", LEFT, ids=named(LEFT))
def test_a_command_that_is_not_done_is_understood(words):
    # in a sentence some of it may be left out; what is there has to be right all the same
    with nullcontext() if words in WHOLE else suppress(*LEFT_OUT):
        understand(cli, words)


@pytest.fixture(scope="module")
def desk_template(tmp_path_factory):
    return make_desk(tmp_path_factory.mktemp("desk"))


@pytest.fixture
def desk(desk_template, tmp_path, monkeypatch):
    """A copy to work in."""
    monkeypatch.chdir(shutil.copytree(desk_template, tmp_path / "desk"))
    monkeypatch.setenv("MOCAPDB_BLENDER", str(desk_template / "blender"))


@pytest.mark.usefixtures("desk")
@pytest.mark.parametrize("words", DONE, ids=named(DONE))
def test_a_command_does_what_it_says(words):
    if any(word.endswith(".mp4") for word in words) and shutil.which("ffmpeg") is None:
        pytest.skip("no ffmpeg here")
    if words[:2] == ("clean", "studio.mocapdb") and "--undo" in words:
        assert run("clean", "studio.mocapdb", "--apply").exit_code == 0
    result = run(*in_this_process(words))
    assert result.exit_code == 0, result.output


@pytest.mark.slow
@pytest.mark.parametrize("start", OF_THE_CORPUS)
def test_a_command_does_what_it_says_of_the_corpus(start, corpus, tmp_path, monkeypatch):
    (words,) = (words for words in WHOLE if begins(words, [start]))
    for name in ("02.asf", "02_01.amc", "02_03.amc"):
        (found,) = (corpus / "cmu").rglob(f"asfamc/**/{name}")
        (tmp_path / "FOLDER").mkdir(exist_ok=True)
        (tmp_path / "FOLDER" / name).symlink_to(found)
    monkeypatch.chdir(tmp_path)
    result = run(*words)
    assert result.exit_code == 0, result.output


# -- what is not mocapdb's -------------------------------------------------------------------------


def test_scripts_and_targets_that_are_named_are_there():
    targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), re.M))
    scripts, made = set(), set()
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        scripts |= set(re.findall(r"python ((?:scripts|benchmarks|tests)/\w+\.py)", text))
        made |= set(re.findall(r"^ {4}make (\w+)|`make (\w+)", text, re.M))
    assert len(scripts) > 10
    assert not [script for script in scripts if not (ROOT / script).is_file()]
    assert {one or other for one, other in made} <= targets


# -- Python ----------------------------------------------------------------------------------------

TEN = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
LINES = re.findall(
    r"^\| [^|]+ \| `([^`]+)`[^|]*\| [^|]*\|$", TEN.partition("What they do")[0], re.M
)


def test_there_are_ten_things():
    assert len(LINES) == 10


@pytest.mark.usefixtures("desk")
@pytest.mark.parametrize("line", LINES)
def test_each_is_one_line_that_runs(line):
    names = {"mocapdb": mocapdb, "numpy": np, "clip": mocapdb.read_clip("take.bvh")}
    assert eval(line, names) is not None
    pyplot.close("all")


RUN_PAGES = [page for page in PAGES if cells(page)]


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("page", RUN_PAGES, ids=lambda page: page.stem)
def test_a_page_that_shows_what_it_computes_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run_cells(page)
