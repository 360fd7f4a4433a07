"""The examples of the docstrings run, and say what they say."""

import doctest
from importlib import import_module
from pathlib import Path

import pytest

import mocapdb

PACKAGE = Path(mocapdb.__file__).parent
TAUGHT = [
    ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")
    for path in sorted(PACKAGE.rglob("*.py"))
    if ">>>" in path.read_text(encoding="utf-8")
]


@pytest.mark.parametrize("name", TAUGHT)
def test_examples(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cases = doctest.DocTestFinder(exclude_empty=True).find(import_module(name))
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    said = []
    for case in cases:
        runner.run(case, out=said.append)
    assert runner.tries > 0
    assert runner.failures == 0, "".join(said)
