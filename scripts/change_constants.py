"""Change tuned numbers one at a time, and see whether the tests notice.

Each change multiplies one constant of a table ``mocapdb/*/tuning.py`` by a third or a half more or
less, in a copy of the project, and runs the tests of that package. A test that fails has noticed
the change. Real clips are not used. Kernels are compiled anew each time, since compiled code keeps
the constants that it was made with.

First the tests run once without any change, for each package that is met. One run takes one to
five minutes, the slowest being those of compression.

    python scripts/change_constants.py                             # 60 at random, of all tables
    python scripts/change_constants.py --package cycles --count 0  # all of one table
    python scripts/change_constants.py --only cycles.LEAST_LAPS    # one

The exit code is 0 if five of six changes are noticed, 1 if fewer are, and 2 if tests fail without
any change.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

PROJECT = Path(__file__).resolve().parent.parent
COPIED = ("mocapdb", "tests", "data", "scripts", "benchmarks", "pyproject.toml", "README.md")
FACTORS = (4 / 3, 2 / 3, 3 / 2, 1 / 2)
NOTICED = 5 / 6
SECONDS = 900.0


@dataclass(frozen=True)
class Change:
    """One constant of a table with another value.

    Attributes
    ----------
    package : str
        Whose table it is: ``"cycles"`` for ``mocapdb/cycles/tuning.py``.
    name : str
        Empty for no change.
    factor : float
        What every number of the constant is multiplied by.
    """

    package: str
    name: str
    factor: float

    @property
    def table(self) -> Path:
        """The table's path in the project."""
        return Path("mocapdb", self.package, "tuning.py")

    def apply(self, source: str) -> tuple[str, str]:
        """Return the table's text with the constant changed, and the new value as text."""
        if not self.name:  # the table as it is: what every change is compared with
            return source, "unchanged"
        node = next(node for name, node in constants(source) if name == self.name)
        changed = ast.unparse(_Scaled(self.factor).visit(ast.parse(ast.unparse(node))))
        lines = source.splitlines(keepends=True)
        before = "".join(lines[: node.lineno - 1]) + lines[node.lineno - 1][: node.col_offset]
        assert node.end_lineno is not None
        after = lines[node.end_lineno - 1][node.end_col_offset :] + "".join(
            lines[node.end_lineno :]
        )
        return before + changed + after, changed


class _Scaled(ast.NodeTransformer):
    """Multiplies every number but 0 by a factor; a whole number stays whole and changes."""

    def __init__(self, factor: float) -> None:
        self.factor = factor

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        """Scale a product or quotient as one number."""
        return ast.BinOp(node, ast.Mult(), ast.Constant(self.factor))

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Scale what a function such as ``math.radians`` is given."""
        node.args = [self.visit(argument) for argument in node.args]
        return node

    def visit_Dict(self, node: ast.Dict) -> ast.AST:
        """Scale the values and leave the keys."""
        node.values = [self.visit(value) for value in node.values]
        return node

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        """Scale one number."""
        value = node.value
        if isinstance(value, bool) or not isinstance(value, int | float) or value == 0:
            return node
        if isinstance(value, float):
            return ast.Constant(value * self.factor)
        scaled = round(value * self.factor)
        return ast.Constant(scaled if scaled != value else value + (1 if self.factor > 1 else -1))


def constants(source: str) -> Iterator[tuple[str, ast.expr]]:
    """Yield name and value of every numeric constant of a table."""
    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign):
            target, value = node.targets[0], node.value
        elif isinstance(node, ast.AnnAssign) and node.value is not None:
            target, value = node.target, node.value
        else:
            continue
        numbers = [
            part
            for part in ast.walk(value)
            if isinstance(part, ast.Constant)
            and isinstance(part.value, int | float)
            and not isinstance(part.value, bool)
        ]
        if isinstance(target, ast.Name) and target.id.isupper() and numbers:
            yield target.id, value


def all_changes(seed: int, packages: Sequence[str]) -> list[Change]:
    """Return a change of every constant of the tables, in random order."""
    rng = random.Random(seed)
    tables = sorted((PROJECT / "mocapdb").glob("*/tuning.py"))
    changes = [
        Change(path.parent.name, name, rng.choice(FACTORS))
        for path in tables
        if not packages or path.parent.name in packages
        for name, _ in constants(path.read_text(encoding="utf-8"))
    ]
    rng.shuffle(changes)
    return changes


def is_noticed(change: Change) -> tuple[bool, str]:
    """Run the package's tests with a constant changed; return whether one fails, and which."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        for part in COPIED:
            source = PROJECT / part
            if source.is_dir():
                ignored = shutil.ignore_patterns("__pycache__")
                shutil.copytree(source, folder / part, ignore=ignored)
            else:
                shutil.copy(source, folder / part)
        table = folder / change.table
        text, value = change.apply(table.read_text(encoding="utf-8"))
        table.write_text(text, encoding="utf-8")
        tests = folder / "tests" / change.package
        figures = sorted(tests.glob("test_*figures.py"))
        nowhere = str(folder / "nowhere")
        environment = {
            **os.environ,
            "PYTHONPATH": str(folder),
            "NUMBA_CACHE_DIR": str(folder / "kernels"),
            "MOCAPDB_CORPUS": nowhere,
            "MOCAPDB_ZOO": nowhere,
        }
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider"]
        command += ["--no-header", *map(str, figures), str(tests)]
        try:
            done = subprocess.run(
                command,
                cwd=folder,
                env=environment,
                capture_output=True,
                text=True,
                timeout=SECONDS,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return True, f"{value}: the tests no longer end"
    if done.returncode not in {0, 1, 2}:
        raise RuntimeError(f"{change}: pytest could not run\n{done.stdout}\n{done.stderr}")
    failed = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return done.returncode != 0, f"{value}  {failed[0][:90] if failed else ''}"


def main() -> int:
    """Run the changes and print what was noticed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--count", type=int, default=60, help="how many constants to change (60); 0 for all"
    )
    parser.add_argument(
        "--seed", type=int, default=0, help="which constants, and by which factors (0)"
    )
    parser.add_argument(
        "--package",
        action="append",
        default=[],
        help="only constants of this package's table, such as cycles; may be repeated",
    )
    parser.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="PACKAGE.NAME",
        help="only this constant, such as cycles.LEAST_LAPS; may be repeated",
    )
    parser.add_argument(
        "--jobs",
        type=int,
        default=os.cpu_count() or 1,
        help="changes that are tested at the same time (as many as there are processors)",
    )
    options = parser.parse_args()
    changes = all_changes(options.seed, options.package)
    if options.only:
        changes = [one for one in changes if f"{one.package}.{one.name}" in options.only]
    changes = changes[: options.count or None]
    if not changes:
        parser.error("no such constant")
    n_noticed = 0
    with ThreadPoolExecutor(options.jobs) as pool:
        unchanged = [Change(package, "", 1.0) for package in sorted({c.package for c in changes})]
        for change, (failed, what) in zip(unchanged, pool.map(is_noticed, unchanged), strict=True):
            if failed:
                print(f"{change.package}: the tests fail without any change: {what}")
                pool.shutdown(cancel_futures=True)
                return 2
            print(f"{change.package}: the tests pass without any change", flush=True)
        for change, (noticed, what) in zip(changes, pool.map(is_noticed, changes), strict=True):
            n_noticed += noticed
            mark = "noticed  " if noticed else "UNNOTICED"
            print(
                f"{mark}  {change.package}.{change.name} x {change.factor:.2f} = {what}", flush=True
            )
    print(f"{n_noticed} of {len(changes)} noticed")
    return 0 if n_noticed >= NOTICED * len(changes) else 1


if __name__ == "__main__":
    sys.exit(main())
