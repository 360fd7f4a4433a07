"""What the manual needs beside Sphinx's own: directives, and formulas that need no network.

``{command} clean``
    A command's usage, words and options, as ``mocapdb clean --help`` has them.
``{public} mocapdb.cleaning``
    Every public name of a package or module, with its docstring.
``{tables} peers``
    The tables ``docs/tables/peers*.md``, or what makes them where there are none.

Formulas become MathML, which browsers draw by themselves.
"""

from __future__ import annotations

import inspect
from importlib import import_module
from pathlib import Path
from typing import Any

import click
from docutils import nodes
from docutils.statemachine import StringList
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.config import Config
from sphinx.pycode import ModuleAnalyzer
from sphinx.util.docutils import SphinxDirective

from mocapdb.cli import cli
from mocapdb.cli._kernels import compile_kernels

DOCS = Path(__file__).parents[1]
REFERENCE = {
    path.stem: path.read_text(encoding="utf-8")
    for path in sorted((DOCS / "reference").glob("*.md"))
}


# -- commands --------------------------------------------------------------------------------------


class CommandHelp(SphinxDirective):
    """A command's help as a part of a page."""

    required_arguments = 1
    optional_arguments = 1  # a command of a group

    def run(self) -> list[nodes.Node]:
        """Return usage, text and options."""
        command, context = _find(self.arguments)
        usage = command.get_usage(context).removeprefix("Usage: ")
        return [
            nodes.literal_block(usage, " ".join(usage.split()), language="text"),
            *_help_text(command.help or ""),
            *_options(command, context),
        ]


def _find(words: list[str]) -> tuple[click.Command, click.Context]:
    """Return a command by its names, and the context of its help."""
    command: click.Command = cli
    context = click.Context(cli, info_name="mocapdb")
    for word in words:
        assert isinstance(command, click.Group)
        found = command.get_command(context, word)
        assert found is not None, f"no command {word}"
        command, context = found, click.Context(found, info_name=word, parent=context)
    return command, context


def _help_text(text: str) -> list[nodes.Node]:
    """Return paragraphs; what click is told to leave as it is becomes a block of code."""
    made: list[nodes.Node] = []
    for part in inspect.cleandoc(text).split("\n\n"):
        if part.startswith("\b"):
            lines = part.splitlines()[1:]
            if lines and not lines[0].startswith(" "):
                made.append(nodes.paragraph(text=lines.pop(0)))
            code = inspect.cleandoc("\n".join(lines))
            made.append(nodes.literal_block(code, code, language="sh"))
        elif part.strip():
            made.append(nodes.paragraph(text=" ".join(part.split())))
    return made


def _options(command: click.Command, context: click.Context) -> list[nodes.Node]:
    """Return a list of the options with what they do."""
    listed = nodes.definition_list(classes=["options"])
    for parameter in command.get_params(context):
        record = parameter.get_help_record(context)
        if record is not None and isinstance(parameter, click.Option):
            name, said = record
            term = nodes.term("", "", nodes.literal(name, name))
            words = nodes.definition("", nodes.paragraph(text=" ".join(said.split())))
            listed += nodes.definition_list_item("", term, words)
    return [nodes.rubric(text="Options"), listed]


# -- the reference ---------------------------------------------------------------------------------


class Public(SphinxDirective):
    """Every public name of a package or a module."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the docstring of the package, and an entry for each of its names."""
        lines = ["````{eval-rst}", *rst_of(self.arguments[0]), "````"]
        made = nodes.container()
        self.state.nested_parse(StringList(lines, self.get_source_info()[0]), 0, made)
        return made.children


def rst_of(package: str) -> list[str]:
    """Return what autodoc is told of a package.

    Examples
    --------
    >>> rst_of("mocapdb.gait")[0]
    '.. automodule:: mocapdb.gait'
    """
    module = import_module(package)
    lines = [f".. automodule:: {package}", ""]
    for name in names_of(package):
        thing = getattr(module, name)
        home = home_of(package, name)
        if inspect.ismodule(thing):
            continue
        if home != package:
            lines += [f"``{name}``", f"    See `{home}.{name}`.", ""]
        elif inspect.isclass(thing):
            lines += [f".. autoclass:: {package}.{name}", "    :members:", ""]
        elif inspect.isroutine(thing):
            lines += [f".. autofunction:: {package}.{name}", ""]
        else:
            said = ModuleAnalyzer.for_module(package).find_attr_docs().get(("", name), [])
            lines += [f".. py:data:: {package}.{name}", "", *(f"    {line}" for line in said), ""]
    return lines


def names_of(package: str) -> list[str]:
    """Return the public names of a package or module, without those that are about it."""
    return [name for name in import_module(package).__all__ if not name.startswith("__")]


def home_of(package: str, name: str) -> str:
    """Return the package of the reference that describes a name that several have."""
    thing = getattr(import_module(package), name)
    where = getattr(thing, "__module__", None) or package
    others = [
        other
        for other in packages()
        if getattr(import_module(other), name, None) is thing and name in names_of(other)
    ]
    near = [other for other in others if f"{where}.".startswith(f"{other}.")]
    return max(near or others or [package], key=len)


def packages() -> list[str]:
    """Return the packages and modules that the pages of the reference describe."""
    return [
        line.split()[1]
        for text in REFERENCE.values()
        for line in text.splitlines()
        if line.startswith("```{public}")
    ]


# -- tables of scripts -----------------------------------------------------------------------------


class Tables(SphinxDirective):
    """Tables that a script has written, where they are."""

    required_arguments = 1
    has_content = True

    def run(self) -> list[nodes.Node]:
        """Return the tables, or else the directive's own words."""
        paths = sorted((DOCS / "tables").glob(f"{self.arguments[0]}*.md"))
        made = nodes.container()
        for path in paths:
            self.env.note_dependency(str(path))
            lines = path.read_text(encoding="utf-8").splitlines()
            kept = [
                line if not line.startswith("#") else f"**{line.lstrip('# ')}**" for line in lines
            ]
            self.state.nested_parse(StringList(kept, str(path)), 0, made)
        if not paths:
            self.state.nested_parse(self.content, self.content_offset, made)
        return made.children


# -- formulas --------------------------------------------------------------------------------------


def _inline_formula(writer: Any, node: nodes.math) -> None:
    writer.body.append(tex2mathml(node.astext(), as_block=False))
    raise nodes.SkipNode


def _block_formula(writer: Any, node: nodes.math_block) -> None:
    writer.body.append(f'<div class="math">{tex2mathml(node.astext(), as_block=True)}</div>')
    raise nodes.SkipNode


# -- the start page --------------------------------------------------------------------------------


def _lead_in(app: Sphinx, problem: Exception | None) -> None:
    """Write a page at the top that leads to the first page of the manual."""
    if problem is None and app.builder.format == "html":
        (Path(app.outdir) / "index.html").write_text(
            '<!doctype html><meta charset="utf-8"><title>mocapdb</title>'
            '<meta http-equiv="refresh" content="0; url=docs/index.html">'
            '<a href="docs/index.html">The manual of mocapdb</a>\n',
            encoding="utf-8",
        )


def _compile(app: Sphinx, config: Config) -> None:
    """Compile what the pages run: several pages at once would each do it for itself."""
    if config.nb_execution_mode != "off":
        compile_kernels(lambda done, total, name: None)


def setup(app: Sphinx) -> dict[str, Any]:
    """Make all of it known to Sphinx."""
    app.add_directive("command", CommandHelp)
    app.add_directive("public", Public)
    app.add_directive("tables", Tables)
    app.add_html_math_renderer("mathml", (_inline_formula, None), (_block_formula, None))
    app.connect("config-inited", _compile)
    app.connect("build-finished", _lead_in)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
