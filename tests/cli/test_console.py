"""Tables are printed without rich where that changes nothing: loading it takes a while."""

import subprocess
import sys

import pytest
from click.testing import CliRunner

from mocapdb.cli import _console, cli
from mocapdb.cli._console import print_table

TABLES = {
    "columns": (
        ("clip", "class", "s"),
        [("01_01", "walk, slowly", "1.25"), ("1", "-", ""), ("", "", "")],
        2,
    ),
    "no rows": (("clip", "s"), [], 1),
    "one column": (("clip",), [("01_01",)], 1),
    "just fits": (("clip", "s"), [("x" * 192, "b")], 1),
    "one column folded": (
        ("clip", "description", "s"),
        [("01_01", " ".join(["walks well-known ways"] * n), "1") for n in (1, 9, 12, 25)],
        1,
    ),
    "two columns folded": (("a", "b"), [("walks on " * 15, "and on " * 20)], 1),
    "a long word folded": (("clip", "s"), [("x" * 300, "b")], 1),
    "lines": (("clip", "s"), [("a\nb", "b")], 1),
    "spaces": (("clip", "s"), [(" a ", "b")], 1),
    "markup": (("clip", "s"), [("[red]a[/red]", "b\\")], 1),
    "symbols": (("clip", "s"), [("a :smile: and 走る", "é")], 1),
}


@pytest.mark.parametrize("table", TABLES)
def test_a_table_looks_as_rich_draws_it(table, capsys, monkeypatch):
    columns, rows, left = TABLES[table]
    print_table(columns, rows, left=left)
    ours = capsys.readouterr().out
    monkeypatch.setattr(_console, "_is_plain", lambda lines: False)
    print_table(columns, rows, left=left)
    assert ours == capsys.readouterr().out


@pytest.mark.parametrize(
    "table", ["columns", "no rows", "one column", "just fits", "one column folded"]
)
def test_a_plain_table_needs_no_rich(table):
    columns, rows, left = TABLES[table]
    code = (
        "import sys; from mocapdb.cli._console import print_table; "
        f"print_table({columns}, {rows}, left={left}); sys.exit('rich' in sys.modules)"
    )
    subprocess.run([sys.executable, "-X", "utf8", "-c", code], check=True, capture_output=True)


def test_control_characters_of_names_are_spelt_out(tmp_path):
    name = "take\x1b]0;owned\x07.bvh"
    (tmp_path / name).write_bytes(b"HIERARCHY\n")
    for arguments in (["convert", name, "out.npz"], ["build", ".", "-o", "out.mocapdb"]):
        with pytest.MonkeyPatch.context() as here:
            here.chdir(tmp_path)
            done = CliRunner().invoke(cli, arguments)
        assert done.exit_code == 1
        assert "\x1b" not in done.output
        assert "take\\x1b]0;owned" in done.output
