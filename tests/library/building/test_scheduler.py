"""A build on a Dask cluster of two processes."""

from __future__ import annotations

import sys

import pytest
from small_library import CLIPS, build, decoded, sound

distributed = pytest.importorskip("distributed")


@pytest.mark.slow
def test_a_cluster_gives_the_same_clips_byte_for_byte(small_corpus, small_library, tmp_path):
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
    )
    with cluster, distributed.Client(cluster) as client:
        client.run(sys.path.extend, sys.path)
        library = tmp_path / "l.mocapdb"
        (small_corpus / "bad.bvh").write_text("no motion\n")
        report = build(small_corpus, library, jobs=None, scheduler=cluster.scheduler_address)
        assert report.built == len(CLIPS)
        (failure,) = report.failed
        assert failure.line == 1
        again = build(small_corpus, library, jobs=None, scheduler=cluster.scheduler_address)
        assert (again.built, again.skipped) == (0, len(CLIPS))
    assert decoded(library) == decoded(small_library)
    assert sound(library)
