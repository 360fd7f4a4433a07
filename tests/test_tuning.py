"""The tables of tuned numbers: each says what it is, its unit, and where it comes from."""

import ast
import functools
import re
import sys
from collections import Counter
from pathlib import Path

import pytest

import mocapdb

PROJECT = Path(__file__).parent.parent
TABLES = sorted(Path(mocapdb.__file__).parent.glob("*/tuning.py"))
BRACKET = re.compile(r"\[[^\[\];]+; [^\[\]]+\]$")


@pytest.fixture
def change_constants(monkeypatch):
    monkeypatch.syspath_prepend(PROJECT / "scripts")
    yield __import__("change_constants")
    sys.modules.pop("change_constants", None)


def targets(node):
    if isinstance(node, ast.Assign):
        return [target.id for target in node.targets]
    return [node.target.id]


def note_above(lines, node):
    """The ``#:`` lines right above a constant, as one text."""
    above = []
    for line in reversed(lines[: node.lineno - 1]):
        if not line.startswith("#:"):
            break
        above.insert(0, line[2:].strip())
    return " ".join(above)


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.parent.name)
def test_a_table_says_of_each_number_what_it_is_its_unit_and_its_origin(path):
    source = path.read_text(encoding="utf-8")
    lines = source.splitlines()
    for node in ast.parse(source).body:
        if isinstance(node, ast.Expr | ast.Import | ast.ImportFrom):
            continue
        assert isinstance(node, ast.Assign | ast.AnnAssign), f"{path}:{node.lineno} is no constant"
        if targets(node) == ["__all__"]:
            continue
        note = note_above(lines, node)
        assert BRACKET.search(note), f"{path}:{node.lineno}: expected '#: What. [unit; origin]'"


@functools.cache
def words_of(folder):
    """Return how often each word stands in the modules of a folder."""
    modules = (path.read_text(encoding="utf-8") for path in folder.rglob("*.py"))
    return Counter(word for module in modules for word in re.findall(r"\w+", module))


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.parent.name)
def test_every_number_of_a_table_is_used(path):
    package = path.parent
    names = [
        name
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.Assign | ast.AnnAssign)
        for name in targets(node)
        if name != "__all__"
    ]
    words = words_of(package.parent)
    assert not [name for name in names if words[name] < 2]


@pytest.mark.parametrize(
    ("source", "changed"),
    [
        ("A = 1\n", "A = 2\n"),
        ("A = 10\n", "A = 15\n"),
        ("A: float = 0.5  # note\nB = 2\n", "A: float = 0.75  # note\nB = 2\n"),
        ("A = (0.5,\n     -2)\n", "A = (0.75, -3)\n"),
        ("A = 1 / 8\n", "A = 1 / 8 * 1.5\n"),
        ("A = math.radians(10.0)\n", "A = math.radians(15.0)\n"),
        ("A = {'a': 2.0, 3: (4, 0)}\n", "A = {'a': 3.0, 3: (6, 0)}\n"),
    ],
)
def test_a_constant_is_changed_and_nothing_else(change_constants, source, changed):
    assert change_constants.Change("cycles", "A", 1.5).apply(source)[0] == changed


def test_texts_and_names_are_no_numbers_to_change(change_constants):
    source = "A = 'b'\nb = 2\nC = True\nD = 3\n"
    assert [name for name, _ in change_constants.constants(source)] == ["D"]
