"""Imports only run downwards, and the methods do not know each other."""

import ast
from pathlib import Path

import pytest

import mocapdb

PACKAGE = Path(mocapdb.__file__).parent
METHODS = ("compression", "indexing", "cleaning", "cycles")
BELOW = {
    "errors": (),
    "base": ("errors",),
    "motion": ("errors",),
    "io": ("errors", "motion"),
    "corpus": ("errors", "motion", "io"),
    **dict.fromkeys(METHODS, ("errors", "motion", "io", "corpus")),
    "library": ("errors", "motion", "io", "corpus", *METHODS),
    "scenes": ("errors", "motion", "io"),
    "plots": ("errors", "motion", *METHODS),
    "report": ("errors", "motion", "io", *METHODS, "library", "plots", "scenes"),
    "viewer": ("errors", "motion", "io", *METHODS, "library", "scenes"),
    "reproduce": ("errors", "motion", "io", "corpus", *METHODS, "library", "plots"),
}
BELOW["cli"] = tuple(BELOW)
EVERYWHERE = ("base",)


def imported_parts(path):
    """The parts of mocapdb that a module names, inside functions too; "" is mocapdb itself."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = []
        if isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            names = [node.module]
            if node.module == "mocapdb":
                names = [f"mocapdb.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        for name in names:
            root, _, rest = name.partition(".")
            if root == "mocapdb":
                yield rest.split(".")[0]


@pytest.mark.parametrize("part", sorted(BELOW))
def test_imports_run_downwards(part):
    paths = [PACKAGE / f"{part}.py"] if (PACKAGE / f"{part}.py").exists() else []
    paths = paths or sorted((PACKAGE / part).rglob("*.py"))
    assert paths
    allowed = {part, *BELOW[part], *EVERYWHERE, "__version__"}
    for path in paths:
        assert set(imported_parts(path)) <= allowed, f"{path} imports upwards"


def test_every_part_has_its_place():
    parts = {path.stem for path in PACKAGE.glob("*.py")} | {
        path.name for path in PACKAGE.iterdir() if path.is_dir() and (path / "__init__.py").exists()
    }
    assert parts - {"__init__", "__main__"} == set(BELOW)
