"""The manual is whole: pages, commands, public names, links; and it asks for nothing from outside.

What runs on its pages is tested in `test_docs`; ``make docs`` builds it with all of that.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from pkgutil import walk_packages

import pytest

import mocapdb
from mocapdb.cli import COMMANDS

ROOT = Path(mocapdb.__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(set(DOCS.rglob("*.md")) - {DOCS / "tables" / "peers.md"})  # a part of a page
BUILDERS = ("sphinx", "furo", "myst_nb", "numpydoc")
# what a browser fetches by itself, from another place than the page's own
FETCHED = re.compile(
    r"""(?:<(?:script|img|iframe|source|video|audio|embed)\b[^>]*?\bsrc="""
    r"""|<link\b(?![^>]*rel="(?:canonical|prev|next|search|index)")[^>]*?\bhref="""
    r"""|url\(|@import|importScripts\(|import\s|fetch\()\s*["']?(https?:)?//""",
    re.I,
)


def toctrees(page: Path) -> list[Path]:
    """Return the pages that a page lists, without their suffixes."""
    text = page.read_text(encoding="utf-8")
    blocks = re.findall(r"^```\{toctree\}\n(.*?)^```", text, re.M | re.S)
    lines = [line for block in blocks for line in block.splitlines()]
    return [(page.parent / line).resolve() for line in lines if line and not line.startswith(":")]


def test_every_page_is_listed_once_and_every_listed_one_is_there():
    listed = [entry for page in PAGES for entry in toctrees(page)]
    assert len(listed) == len(set(listed))
    notebooks = sorted((ROOT / "notebooks").glob("*.ipynb"))
    others = [ROOT / "CONTRIBUTING", ROOT / "CHANGELOG"]
    expected = {page.with_suffix("") for page in [*PAGES, *notebooks]} - {DOCS / "index"}
    assert set(listed) == expected | set(others)


def anchor(heading: str) -> str:
    """Return what a heading is called in a link, on code hosts and in the manual."""
    words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").lower()
    return re.sub(r"[^\w\- ]", "", words).replace(" ", "-")


@pytest.mark.parametrize("page", [ROOT / "README.md", *PAGES], ids=lambda page: page.stem)
def test_links_lead_somewhere(page):
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    for target in re.findall(r"\]\((?!https?:|mailto:)([^)\s]+)\)", text):
        path, _, part = target.partition("#")
        to = (page.parent / path).resolve() if path else page
        assert to.exists(), target
        if part:
            headings = re.findall(r"^#+ (.*)$", to.read_text(encoding="utf-8"), re.M)
            assert part in {anchor(heading) for heading in headings}, target


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_a_page(name):
    text = (DOCS / "commands" / f"{name}.md").read_text(encoding="utf-8")
    assert text.startswith(f"# mocapdb {name}\n")
    assert f"```{{command}} {name}\n```" in text
    assert f"    mocapdb {name} " in f"{text} ".replace("\n", " \n"), "no example"
    every = (DOCS / "commands.md").read_text(encoding="utf-8")
    assert f"| [`{name}`](commands/{name}.md) | {COMMANDS[name]} |" in every


def test_every_public_name_is_in_the_reference():
    pages = sorted((DOCS / "reference").glob("*.md"))
    described = re.findall(
        r"^```\{public\} (\S+)", "\n".join(p.read_text(encoding="utf-8") for p in pages), re.M
    )
    assert len(described) == len(set(described))
    packages = {
        found.name
        for found in walk_packages(mocapdb.__path__, "mocapdb.")
        if found.ispkg and getattr(import_module(found.name), "__all__", None)
    } - {"mocapdb.cli", "mocapdb.library.training"}  # the commands' pages; listed in `library`
    motion = {
        f"mocapdb.motion.{found.name}"
        for found in walk_packages(import_module("mocapdb.motion").__path__)
        if getattr(import_module(f"mocapdb.motion.{found.name}"), "__all__", None)
    } - {"mocapdb.motion.tuning"}
    assert set(described) >= packages | motion | {"mocapdb", "mocapdb.errors"}
    assert not [name for name in described if not import_module(name).__all__]


def test_what_is_fetched_from_outside_is_found():
    for text in (
        '<script async src="https://cdn.example/x.js">',
        '<link rel="stylesheet" href="//x/y.css"/>',
        "src: url('https://fonts.example/a.woff2')",
        '@import "https://x/y.css"',
        'fetch("https://x")',
    ):
        assert FETCHED.search(text), text
    for text in ('<a href="https://x">', '<script src="_static/x.js">', "url(../a.svg)"):
        assert not FETCHED.search(text), text


# -- built -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The manual, built without running its cells."""
    missing = [name for name in BUILDERS if find_spec(name) is None]
    if missing:
        pytest.skip(f"no {', '.join(missing)} here: pip install 'mocapdb[docs]'")
    out = tmp_path_factory.mktemp("manual")
    words = [sys.executable, "-m", "sphinx", "-q", "-W", "-c", str(DOCS), "-d", str(out / "trees")]
    done = subprocess.run(
        [*words, str(ROOT), str(out / "html")], check=False, capture_output=True, text=True,
        env={**os.environ, "MANUAL_EXECUTION": "off", "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return out / "html"


@pytest.mark.slow
def test_it_builds_and_asks_for_nothing_from_outside(built):
    files = [p for p in built.rglob("*") if p.suffix in {".html", ".css", ".js", ".svg"}]
    assert len(files) > 100
    fetched = [
        f"{path.relative_to(built)}: {found[0]}"
        for path in files
        if (found := FETCHED.search(path.read_text(encoding="utf-8")))
    ]
    assert not fetched


@pytest.mark.slow
def test_names_commands_and_formulas_are_on_the_pages(built):
    docs = built / "docs"
    clip = (docs / "reference" / "motion.html").read_text(encoding="utf-8")
    assert 'id="mocapdb.motion.clip.Clip.positions"' in clip
    verbs = (docs / "reference" / "mocapdb.html").read_text(encoding="utf-8")
    assert 'id="mocapdb.clean"' in verbs
    assert "--foot-skate" in (docs / "commands" / "clean.html").read_text(encoding="utf-8")
    assert "<math" in (docs / "methods" / "ppca.html").read_text(encoding="utf-8")
    assert "docs/index.html" in (built / "index.html").read_text(encoding="utf-8")
