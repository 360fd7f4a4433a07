"""Writers stopped at a few points; in full size ``python tests/crashes.py --points 500``."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[2]
COMMANDS = ["--commands", "build more", "query --save", "edit"]


@pytest.mark.skipif(shutil.which("strace") is None, reason="strace is not installed")
def test_every_promise_is_kept(tmp_path):
    paths = os.pathsep.join([str(TESTS), str(TESTS.parent)])
    found = subprocess.run(  # of its own, since only a process of one thread may be forked
        [sys.executable, TESTS / "crashes.py", "--points", "12", *COMMANDS],
        env=os.environ | {"PYTHONPATH": paths, "TMPDIR": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
    )
    assert found.returncode == 0, found.stdout + found.stderr
    assert "12 of 12 points kept every promise" in found.stdout
