"""Work that is shared out to processes and to a Dask cluster: the same answers, or an error."""

import gc
import json
import os
import subprocess
import sys
import time
from concurrent.futures import Future
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from unittest import mock

import pytest
from shared_work import double, kill, kill_once, who

from mocapdb.base import workers
from mocapdb.base.workers import marked_folders, on_workers
from mocapdb.errors import WorkerError

pytestmark = pytest.mark.filterwarnings("ignore")  # clients of a cluster that dies leave loops open


@pytest.fixture(autouse=True, scope="module")
def collected():
    """What clients leave open is found here, where nobody minds, and not in another test."""
    yield
    gc.collect()


class TestHere:
    @pytest.mark.parametrize("jobs", [1, 2])
    def test_answers_come_in_the_order_of_the_orders(self, jobs):
        assert list(on_workers(double, [[x] for x in range(5)], jobs=jobs)) == [0, 2, 4, 6, 8]

    def test_one_job_is_this_process(self):
        assert set(on_workers(who, [[1], [2]], jobs=1)) == {os.getpid()}

    def test_work_is_done_where_the_caller_stands(self, tmp_path, monkeypatch):
        for name in ("a", "b"):
            (tmp_path / name).mkdir()
            monkeypatch.chdir(tmp_path / name)
            assert set(on_workers(os.getcwd, [[], []], jobs=2)) == {str(tmp_path / name)}

    def test_nothing_to_do_asks_nobody(self):
        assert list(on_workers(double, [], scheduler="nobody")) == []


@pytest.mark.parametrize("address", ["tcp://x:y", "", "  "])
def test_an_address_that_is_none(address):
    pytest.importorskip("distributed")
    with pytest.raises(WorkerError, match="no Dask scheduler answers"):
        list(on_workers(double, [[1]], scheduler=address))


@contextmanager
def at_most(address, failures):
    """Let a scheduler give work that killed its worker to others only so often."""
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        usual = client.run_on_scheduler(allow, failures)
        yield
        client.run_on_scheduler(allow, usual)


def allow(failures, dask_scheduler):
    usual, dask_scheduler.allowed_failures = dask_scheduler.allowed_failures, failures
    return usual


@pytest.mark.slow
class TestCluster:
    def test_answers_come_in_the_order_of_the_orders(self, dask_cluster):
        answers = on_workers(double, [[x] for x in range(30)], scheduler=dask_cluster)
        assert list(answers) == [2 * x for x in range(30)]
        assert len(set(on_workers(who, [[x] for x in range(30)], scheduler=dask_cluster))) == 2

    def test_a_worker_that_is_killed_is_replaced(self, dask_cluster, tmp_path):
        orders = [[tmp_path / "done", x] for x in range(6)]
        assert list(on_workers(kill_once, orders, scheduler=dask_cluster)) == list(range(6))

    def test_work_that_kills_its_workers_is_an_error(self, dask_cluster):
        with at_most(dask_cluster, 0), pytest.raises(WorkerError, match="has killed its worker"):
            list(on_workers(kill, [[1]], scheduler=dask_cluster))

    @pytest.mark.skipif(sys.platform != "linux", reason="a file that differs by process")
    def test_files_that_workers_see_otherwise(self, dask_cluster):
        own = Path("/proc/self/stat")
        with pytest.raises(WorkerError, match="expected this worker to see /proc/self/stat"):
            list(on_workers(double, [[1]], scheduler=dask_cluster, seen=[own]))

    def test_folders_that_workers_see(self, dask_cluster, tmp_path):
        with marked_folders(tmp_path / "out") as marks:
            assert list(on_workers(double, [[1]], scheduler=dask_cluster, seen=marks)) == [2]
        assert not (tmp_path / "out").exists()

    def test_what_work_raises_is_raised(self, dask_cluster):
        with pytest.raises(ZeroDivisionError):
            list(on_workers(divmod, [[1, 0]], scheduler=dask_cluster))


def test_a_cluster_that_has_lost_its_workers_for_good(monkeypatch):
    pytest.importorskip("distributed")
    cluster = mock.Mock()
    cluster.run.return_value = {}
    cluster.nthreads.side_effect = [{"worker": 1}, {}, {}, {}]
    cluster.get_executor().submit.side_effect = lambda *order: Future()
    monkeypatch.setattr(workers, "_connected", lambda address: nullcontext(cluster))
    monkeypatch.setattr(workers, "LOOK_S", 0.01)
    monkeypatch.setattr(workers, "ALONE_S", 0.02)
    with pytest.raises(WorkerError, match="no worker has been left"):
        list(on_workers(double, [[1]], scheduler="tcp://here:1"))


@contextmanager
def dask_process(kind, *arguments):
    """A scheduler or a worker in a process of its own, killed at the end."""
    command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", "--no-dashboard", *arguments]
    path = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(command, env=path, **quiet) as process:
        try:
            yield process
        finally:
            process.kill()


def told_address(file):
    """Return the address that a scheduler writes to a file, which is not whole at once."""
    until = time.monotonic() + 120
    while True:
        with suppress(FileNotFoundError, json.JSONDecodeError):
            return json.loads(file.read_text())["address"]
        assert time.monotonic() < until
        time.sleep(0.05)


@pytest.mark.slow
def test_a_scheduler_that_has_no_workers_or_dies(monkeypatch, tmp_path):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(workers, "CONNECT_S", 5)
    told = tmp_path / "scheduler.json"
    local = ["--host", "127.0.0.1", "--port", "0", "--scheduler-file", told]
    with dask_process("scheduler", *local) as scheduler:
        address = told_address(told)
        with pytest.raises(WorkerError, match="has no worker"):
            list(on_workers(double, [[1]], scheduler=address))
        with dask_process("worker", address, "--no-nanny"):
            with distributed.Client(address, set_as_default=False) as client:
                client.wait_for_workers(1, timeout=60)
            answers = on_workers(double, [[x] for x in range(100)], scheduler=address)
            assert next(answers) == 0
            scheduler.kill()
            with pytest.raises(WorkerError, match="scheduler is gone"):
                list(answers)
