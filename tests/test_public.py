"""The public surface: what there is, and that it costs nothing until it is used."""

import subprocess
import sys

import mocapdb


def test_every_public_name_loads():
    for name in mocapdb.__all__:
        assert getattr(mocapdb, name) is not None
    assert dir(mocapdb) == sorted(mocapdb.__all__)


def test_importing_loads_nothing_heavy():
    code = "import mocapdb, mocapdb.cli, sys; print(' '.join(sys.modules))"
    loaded = set(subprocess.check_output([sys.executable, "-c", code], text=True).split())
    heavy = {"numpy", "scipy", "numba", "h5py", "pywt", "sklearn", "joblib", "httpx", "rich"}
    assert not heavy & loaded
