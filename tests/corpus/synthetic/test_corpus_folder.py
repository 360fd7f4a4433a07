"""A written corpus reads back."""

from __future__ import annotations

import csv

import pytest
from synthetic_channels import positions_m

from mocapdb.corpus import synthetic
from mocapdb.corpus.synthetic import CLASSES, SEQUENCE
from mocapdb.errors import CorpusError
from mocapdb.io import read_clip

KINDS = (*CLASSES, SEQUENCE)


def test_written_corpus_reads_back(tmp_path) -> None:  # type: ignore[no-untyped-def]
    paths = synthetic.write_corpus(tmp_path / "made", subjects=2, bvh_clips=1, seed=3)
    assert len(paths) == 14
    with (tmp_path / "made" / "LABELS.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [tmp_path / "made" / row["path"] for row in rows] == paths
    assert {row["label"] for row in rows} == set(KINDS)
    assert len({row["clip"] for row in rows}) == len(rows)
    bodies = set()
    for row, path in zip(rows, paths, strict=True):
        clip = read_clip(path, fps=float(row["fps"]))
        assert clip.name == row["clip"] == path.stem
        assert path.suffix == f".{row['format']}"
        assert clip.fps == 120.0
        positions = positions_m(clip)
        assert -0.03 < positions[:, :, 1].min() < 0.03
        if row["skeleton"]:
            assert (tmp_path / "made" / row["skeleton"]).is_file()
            bodies.add(clip.skeleton.digest)
    assert len(bodies) == 2
    assert sorted(path.suffix for path in paths).count(".bvh") == 1
    assert not list((tmp_path / "made").rglob("*.partial"))


def test_written_corpus_is_repeatable(tmp_path) -> None:  # type: ignore[no-untyped-def]
    first, again, other = (
        synthetic.write_corpus(tmp_path / name, subjects=1, bvh_clips=0, seed=seed)
        for name, seed in (("a", 1), ("b", 1), ("c", 2))
    )
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in again]
    assert [path.read_bytes() for path in first] != [path.read_bytes() for path in other]


def test_impossible_corpora_are_refused(tmp_path) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(CorpusError, match="subject"):
        synthetic.write_corpus(tmp_path, subjects=0)
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(CorpusError, match="folder"):
        synthetic.write_corpus(tmp_path / "file", subjects=1)
