"""Kernels are compiled late and once, and machine code never outlives what it came from."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

KERNELS = """
from mocapdb.base.kernels import jit, jit_inline
from table import BASE

@jit_inline
def grown(x):
    return x + {step}

@jit
def kernel(x):
    return BASE * grown(x)
"""

MAIN = """
import sys
import mocapdb.base.kernels as kernels
assert "numba" not in sys.modules
import {name} as written
kernels.before_compiling(lambda: print("compiles"))
print(written.kernel(2), written.kernel(3))
"""


@pytest.fixture
def run(tmp_path):
    """Run a program of one kernel that calls another and takes a number from a table."""

    def run(*, base=10, step=1):
        # a file of always the same size and time, as in a wheel whose files carry a fixed time
        for name, text in (("table", f"BASE = {base}\n"), ("written", KERNELS.format(step=step))):
            path = tmp_path / f"{name}.py"
            path.write_text(text)
            os.utime(path, (1_577_836_800, 1_577_836_800))
        environment = dict(
            os.environ,
            PYTHONPATH=os.pathsep.join([str(tmp_path), str(Path(__file__).parents[2])]),
            NUMBA_CACHE_DIR=str(tmp_path / "cache"),
            PYTHONDONTWRITEBYTECODE="1",
        )
        done = subprocess.run(
            [sys.executable, "-c", MAIN.format(name="written")],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        return done.stdout.split("\n")[:-1]

    return run


def test_machine_code_is_kept_for_the_next_process(run):
    assert run() == ["compiles", "30 40"]
    assert run() == ["30 40"]


def test_a_changed_number_of_another_module_reaches_the_kernel(run):
    run()
    assert run(base=20) == ["compiles", "60 80"]


def test_a_changed_kernel_reaches_the_kernels_that_call_it(run):
    run()
    assert run(step=2) == ["compiles", "40 50"]


def test_a_kernel_looks_like_the_function_it_is():
    from mocapdb.base.kernels import jit

    @jit
    def kernel(x: int) -> int:
        """Return x."""
        return x

    assert (kernel.__name__, kernel.__doc__) == ("kernel", "Return x.")


def test_without_numba_a_kernel_is_the_function_itself_and_that_is_said(monkeypatch):
    from mocapdb.base import kernels

    monkeypatch.setattr(kernels, "are_compiled", lambda: False)
    kernels._warn_of_plain_python.cache_clear()

    @kernels.jit
    def doubled(x: int) -> int:
        return 2 * x

    with pytest.warns(RuntimeWarning, match="numba is not installed"):
        assert doubled(3) == 6
    assert doubled.dispatcher is doubled.function
