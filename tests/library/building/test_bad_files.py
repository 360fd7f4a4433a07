"""Whatever one file does, the others are built, and are searched as if it were not there."""

from __future__ import annotations

import pytest
from small_library import CLIPS, build, run

from mocapdb.corpus import synthetic
from mocapdb.io import read_clip, write_clip
from mocapdb.library import Library, Retrieval

BODY = """\
HIERARCHY
ROOT hips
{{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT leg
  {{
    OFFSET {offset} -40 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {{
      OFFSET 0 -40 0
    }}
  }}
}}
MOTION
Frames: {frames}
Frame Time: {time}
0 {height} 0 0 0 0 0 0 0
0 {height} 0 0 0 0 0 0 10
"""
USUAL = {"offset": "0", "frames": "2", "time": "0.0333333", "height": "90"}


@pytest.mark.parametrize(
    ("part", "spelt", "line"),
    [("frames", "9" * 5000, 17), ("time", "1e-320", 18), ("time", "1e308", 18)],
)
def test_numbers_that_no_capture_has_are_told_with_their_line(
    small_corpus, tmp_path, part, spelt, line
):
    bad = small_corpus / "bad.bvh"
    bad.write_text(BODY.format(**USUAL | {part: spelt}))
    report = build(small_corpus, tmp_path / "l.mocapdb")
    assert report.built == len(CLIPS)
    assert [(failure.path, failure.line) for failure in report.failed] == [(str(bad), line)]


@pytest.mark.parametrize("part", ["offset", "height"])
def test_numbers_out_of_this_world_stop_nothing(small_corpus, tmp_path, part):
    (small_corpus / "bad.bvh").write_text(BODY.format(**USUAL | {part: "1e200"}))
    library = tmp_path / "l.mocapdb"
    report = build(small_corpus, library, index=True)
    assert report.built + len(report.failed) == len(CLIPS) + 1
    assert build(small_corpus, library).built == 0
    assert run("info", library).exit_code == 0


@pytest.mark.parametrize(
    "problem",
    [MemoryError(), RecursionError("too deep"), OverflowError("too large"), KeyError("x")],
)
def test_any_error_of_one_file_is_reported_and_the_others_are_built(
    small_corpus, tmp_path, monkeypatch, problem
):
    def reads(path, *args, **options):
        if "both.bvh" in str(path):
            raise problem
        return read_clip(path, *args, **options)

    monkeypatch.setattr("mocapdb.io.clip_files.read_clip", reads)
    report = build(small_corpus, tmp_path / "l.mocapdb")
    assert report.built == len(CLIPS) - 1
    (failure,) = report.failed
    assert failure.path.endswith("both.bvh")
    assert failure.reason.startswith("cannot read (")


def test_an_interrupt_is_no_such_error(small_corpus, tmp_path, monkeypatch):
    def reads(path, *args, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr("mocapdb.io.clip_files.read_clip", reads)
    with pytest.raises(KeyboardInterrupt):
        build(small_corpus, tmp_path / "l.mocapdb")


@pytest.fixture(scope="module")
def corpus(tmp_path_factory):
    """Eight clips of five motions, and a library of them beside."""
    root = tmp_path_factory.mktemp("far") / "corpus"
    root.mkdir()
    for seed, kind in enumerate(("walk", "run", "wave", "squat", "box", "walk", "run", "box")):
        clip = synthetic.make_clip(kind, seed=seed, duration_s=1.5)
        write_clip(clip, root / f"{kind}_{seed}.bvh")
    build(root, root.parent / "before.mocapdb", index=True)
    return root


class TestSearchedAsIfItWereNotThere:
    """A clip whose root is at 10 km, or one frame of it, changes no distance between others."""

    @staticmethod
    def distances(library, corpus):
        with Library(library) as opened:
            retrieval = Retrieval(opened)
            found = {}
            for path in sorted(corpus.glob("*_*.bvh")):
                clip = read_clip(path)
                best = retrieval.query(clip, k=1)[0]
                found[path.stem] = best.record.name, best.distance
                assert best.record.name == path.stem
            return found

    @pytest.mark.parametrize("frames", [slice(None), slice(60, 61)], ids=["clip", "frame"])
    @pytest.mark.parametrize("axis", ["x", "y"])
    def test_distances(self, corpus, tmp_path, frames, axis):
        usual = self.distances(corpus.parent / "before.mocapdb", corpus)
        root = tmp_path / "corpus"
        root.mkdir()
        for path in corpus.glob("*.bvh"):
            (root / path.name).write_bytes(path.read_bytes())
        clip = read_clip(corpus / "walk_0.bvh")
        clip = synthetic.make_clip("walk", seed=77, skeleton=clip.skeleton, duration_s=1.5)
        channels = clip.channels.copy()
        channels[frames, "xyz".index(axis)] += 1e4 / clip.skeleton.metres_per_unit
        write_clip(clip.replace(channels=channels), root / "far.bvh")
        build(root, tmp_path / "after.mocapdb", index=True)
        after = self.distances(tmp_path / "after.mocapdb", corpus)
        assert usual.keys() == after.keys()
        for name, (_, distance) in usual.items():
            assert distance < 0.1
            assert abs(after[name][1] - distance) < 1e-3
