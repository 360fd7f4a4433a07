"""Imports only run downwards, never in a circle, and every module stands in its package's table."""

import ast
import re
from importlib import import_module
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
    "gait": ("errors", "motion"),
    **dict.fromkeys(METHODS, ("errors", "motion", "io", "corpus")),
    "cycles": ("errors", "motion", "io", "corpus", "gait"),
    "segmentation": ("errors", "motion", "cycles"),
    "scenes": ("errors", "motion", "io"),
    "library": ("errors", "motion", "io", "corpus", "gait", "scenes", *METHODS),
    "plots": ("errors", "motion", "gait", "segmentation", *METHODS),
    "report": ("errors", "motion", "io", *METHODS, "library", "plots", "scenes"),
    "viewer": ("errors", "motion", "io", *METHODS, "library", "scenes"),
    "reproduce": ("errors", "motion", "io", "corpus", *METHODS, "library", "plots"),
}
BELOW["jobs"] = tuple(BELOW)
BELOW["cli"] = tuple(BELOW)
EVERYWHERE = ("base",)
# A noun that offers a job one step away takes it from above, when the method is called.
LATE = {
    ("mocapdb.motion.clip", "mocapdb.plots.strip_plots"),  # Clip.plot
    ("mocapdb.library.library", "mocapdb.library.searching.retrieval"),  # Library.query
    ("mocapdb.library.library", "mocapdb.library.training.motion_windows"),  # Library.windows
}
MODULES = {
    ".".join(("mocapdb", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(
        ".__init__"
    ): path
    for path in sorted(PACKAGE.rglob("*.py"))
}
PACKAGES = [name for name, path in MODULES.items() if path.name == "__init__.py"]


def imported(path):
    """The modules of mocapdb that a file names, inside functions and for type checkers too."""
    late = {target for source, target in LATE if MODULES[source] == path}
    yield from (name for name in named(ast.walk(parsed(path))) if name not in late)


def parsed(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def named(nodes):
    """The modules of mocapdb that statements import."""
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            for alias in node.names:
                name = f"{node.module}.{alias.name}"
                yield name if name in MODULES else HOMES.get(name, node.module)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def homes():
    """The module of each name that a package takes from its modules."""
    return {
        f"{package}.{alias.asname or alias.name}": node.module
        for package in PACKAGES
        for node in ast.walk(ast.parse(MODULES[package].read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }


HOMES = homes()


def imported_parts(path):
    """The top-level parts of mocapdb that a file names; "" is mocapdb itself."""
    for name in imported(path):
        root, _, rest = name.partition(".")
        if root == "mocapdb":
            yield rest.split(".")[0]


@pytest.mark.parametrize("part", sorted(BELOW))
def test_imports_run_downwards(part):
    paths = [PACKAGE / f"{part}.py"] if (PACKAGE / f"{part}.py").exists() else []
    paths = paths or sorted((PACKAGE / part).rglob("*.py"))
    assert paths
    allowed = {part, *BELOW[part], *EVERYWHERE, ""}
    for path in paths:
        assert set(imported_parts(path)) <= allowed, f"{path} imports upwards"


@pytest.mark.parametrize(("source", "target"), sorted(LATE))
def test_what_is_taken_from_above_is_taken_late(source, target):
    tree = parsed(MODULES[source])
    deep = [
        node
        for function in ast.walk(tree)
        if isinstance(function, ast.FunctionDef)
        for node in ast.walk(function)
    ]
    assert target in named(deep)
    assert target not in named(tree.body)


def test_every_part_has_its_place():
    parts = {path.stem for path in PACKAGE.glob("*.py")} | {
        path.name for path in PACKAGE.iterdir() if path.is_dir() and (path / "__init__.py").exists()
    }
    assert parts - {"__init__", "__main__"} == set(BELOW)


def circles(graph):
    """The groups of modules that reach each other (Tarjan's strongly connected components)."""
    index, low, stack, found = {}, {}, [], []

    def visit(node):
        index[node] = low[node] = len(index)
        stack.append(node)
        for other in graph[node]:
            if other not in index:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], index[other])
        if low[node] == index[node]:
            group = stack[stack.index(node) :]
            del stack[stack.index(node) :]
            if len(group) > 1:
                found.append(sorted(group))

    for node in graph:
        if node not in index:
            visit(node)
    return found


def test_no_modules_import_each_other():
    # what is imported from a package counts as imported from the module that it is taken from
    modules = {name: path for name, path in MODULES.items() if name not in PACKAGES}
    graph = {
        name: [other for other in imported(path) if other in modules]
        for name, path in modules.items()
    }
    assert not circles(graph)


def test_circles_are_seen():
    assert circles({"a": ["b"], "b": ["c"], "c": ["b"], "d": ["d"]}) == [["b", "c"]]


@pytest.mark.parametrize("package", PACKAGES)
def test_every_module_stands_in_its_packages_table(package):
    path = MODULES[package]
    held = {
        name.removeprefix(f"{package}.")
        for name in MODULES
        if name.startswith(f"{package}.") and "." not in name.removeprefix(f"{package}.")
    }
    tree = ast.parse(path.read_text(encoding="utf-8"))
    named = set(re.findall(r"`([\w.]+)`", ast.get_docstring(tree) or ""))
    missing = sorted(held - named - {"__main__"})
    assert not missing, f"the table of {package} does not name {', '.join(missing)}"


@pytest.mark.parametrize("package", PACKAGES)
def test_the_columns_of_a_table_are_aligned(package):
    lines = (ast.get_docstring(ast.parse(MODULES[package].read_text("utf-8"))) or "").splitlines()
    rules = [i for i, line in enumerate(lines) if re.fullmatch("=+  +=+", line)]
    for first, last in zip(rules[::2], rules[1::2], strict=True):
        rule = lines[first]
        column = rule.rindex(" ") + 1
        assert lines[last] == rule
        for row in lines[first + 1 : last]:
            assert len(row) <= len(rule), row
            assert row[column - 2 : column] == "  ", row
            assert row[column] != " ", row


def test_no_two_files_share_a_name_but_mean_different_things():
    # a command, its picture or its report may be called as what it is about; a table is a table
    shared = {"tuning"}
    stems: dict[str, list[str]] = {}
    for name, path in MODULES.items():
        if path.name == "__init__.py" or name.startswith("mocapdb.cli."):
            continue
        stems.setdefault(path.stem.strip("_"), []).append(name)
    twice = {stem: names for stem, names in stems.items() if len(names) > 1 and stem not in shared}
    assert not twice


GUIDE = (PACKAGE.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
GUIDED = sorted(set(re.findall(r"`(mocapdb(?:\.\w+)+)(?::(\w+))?`", GUIDE)))


@pytest.mark.parametrize(("module", "name"), GUIDED, ids=[f"{m}:{n}" for m, n in GUIDED])
def test_the_guide_names_what_is_there(module, name):
    assert module in MODULES
    if name:
        assert hasattr(import_module(module), name)
