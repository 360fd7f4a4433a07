"""Libraries built, indexed, cleaned and checked by a Dask cluster of two processes.

The same as by one process, though a worker is killed in the middle.
"""

from __future__ import annotations

import os
import shutil
import signal
from functools import partial

import pytest
from small_library import CLIPS, build, decoded, run, sound

from mocapdb import Library
from mocapdb.library import clean_library, index_library, verify_library

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore::ResourceWarning")]


def kill_a_worker(address, done, total, name):
    """Kill one of a cluster's workers, when the first piece of work is done."""
    from distributed import Client

    if done == 1:
        with Client(address, set_as_default=False) as client:
            os.kill(min(client.run(os.getpid).values()), signal.SIGKILL)


def of_queries(library):
    """What a library has for queries, file by file."""
    files = sorted([*(library / "features").iterdir(), *(library / "search").iterdir()])
    return {path.name: path.read_bytes() for path in files}


def test_a_library_by_a_cluster_is_that_of_one_process(
    small_corpus, small_library, dask_cluster, tmp_path
):
    library = tmp_path / "l.mocapdb"
    (small_corpus / "bad.bvh").write_text("no motion\n")
    kill = partial(kill_a_worker, dask_cluster)
    on_cluster = {"jobs": None, "scheduler": dask_cluster}
    report = build(small_corpus, library, progress=kill, **on_cluster)
    assert report.built == len(CLIPS)
    (failure,) = report.failed
    assert failure.line == 1
    again = build(small_corpus, library, **on_cluster)
    assert (again.built, again.skipped) == (0, len(CLIPS))
    assert decoded(library) == decoded(small_library)

    of_cluster = index_library(library, scheduler=dask_cluster)
    assert of_cluster == index_library(small_library)
    assert of_queries(library) == of_queries(small_library)

    assert clean_library(library, scheduler=dask_cluster).searched == len(CLIPS)
    clean_library(small_library, jobs=1)
    with Library(library) as ours, Library(small_library) as theirs:
        found = [
            [(each.spans, each.sha256) for each in opened.catalogue.revisions().values()]
            for opened in (ours, theirs)
        ]
        assert found[0] == found[1]
        assert verify_library(ours, scheduler=dask_cluster) == verify_library(ours)
    assert decoded(library) == decoded(small_library)
    assert sound(library)


def test_what_is_wrong_with_clips_is_found_by_a_cluster_too(small_library, dask_cluster):
    (shard,) = (small_library / "shards").iterdir()
    data = bytearray(shard.read_bytes())
    data[len(data) // 2] ^= 1
    shard.write_bytes(data)
    with Library(small_library) as opened:
        report = verify_library(opened, scheduler=dask_cluster)
        assert report["shards"]
        assert report == verify_library(opened)


def test_a_folder_is_cleaned_by_a_cluster_as_by_one_process(small_corpus, dask_cluster, tmp_path):
    shutil.rmtree(small_corpus / "01")
    outputs = tmp_path / "of_one", tmp_path / "of_cluster"
    for output, more in zip(outputs, ([], ["--scheduler", dask_cluster]), strict=True):
        done = run("clean", small_corpus, "-o", output, *more)
        assert done.exit_code == 0, done.output
    written = [
        {str(path.relative_to(output)): path.read_bytes() for path in output.rglob("*.bvh")}
        for output in outputs
    ]
    assert len(written[0]) == 2
    assert written[0] == written[1]
    assert not list(tmp_path.rglob("*.partial"))
    done = run("clean", small_corpus, "-o", small_corpus, "--scheduler", dask_cluster)
    assert done.exit_code == 1
    assert "Expected outputs that are none of the clips to be read" in done.output
