"""Queries of several libraries at once: as of one that has all their clips."""

from __future__ import annotations

import gc
import shutil
import sqlite3
from contextlib import closing

import numpy as np
import pytest
from small_library import one_commit, run, run_json

from mocapdb import BuildSettings, Library, Target, build_library
from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError, LibraryError, NoClipFitsError
from mocapdb.indexing import FeatureSpace, MotionIndex, Query, Weights, canonical_motion
from mocapdb.indexing.search.span_scan import reference_of
from mocapdb.io import write_clip
from mocapdb.library import Filter, query_libraries

SETTINGS = BuildSettings(Target("mean_mm", 4.0), {"representation": "channels", "transform": "dct"})
KINDS = ("walk", "squat", "hop")


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    """One library of all clips, and two of the walkers and of the others."""
    folder = tmp_path_factory.mktemp("many")
    corpus = folder / "corpus"
    corpus.mkdir()
    labels = ["clip,label"]
    for person in (1, 2, 3):
        for number, kind in enumerate(KINDS, start=1):
            name = f"{person:02d}_{number:02d}"
            clip = synthetic.make_clip(
                kind, seed=10 * person + number, skeleton=synthetic.subject(person), duration_s=2
            )
            write_clip(clip, corpus / f"{name}.bvh")
            labels.append(f"{name},{kind}")
    (corpus / "LABELS.csv").write_text("\n".join(labels) + "\n")
    places = {}
    for name, only in (
        ("all", None),
        ("walks", lambda file: file[3:5] == "01"),
        ("others", lambda file: file[3:5] != "01"),
    ):
        places[name] = folder / f"{name}.mocapdb"
        with one_commit():
            build_library(corpus, places[name], SETTINGS, jobs=1, index=True, only=only)
    take = synthetic.make_clip("walk", seed=9, skeleton=synthetic.subject(9), duration_s=3)
    write_clip(take, folder / "take.bvh")
    places["take"] = folder / "take.bvh"
    return places


@pytest.fixture(scope="module")
def take():
    return synthetic.make_clip("walk", seed=9, skeleton=synthetic.subject(9), duration_s=3)[60:200]


def near(found):
    return [(each.hit.record.stem, each.hit.start, each.hit.end) for each in found.hits]


def distances(found):
    return np.array([each.hit.distance for each in found.hits])


class TestTogether:
    def test_hits_are_those_of_a_library_of_all(self, parts, take):
        one = query_libraries([parts["all"]], take, k=8)
        both = query_libraries([parts["walks"], parts["others"]], take, k=8)
        turned = query_libraries([parts["others"], parts["walks"]], take, k=8)
        assert near(turned) == near(both)
        np.testing.assert_allclose(distances(turned), distances(both), atol=1e-6)
        assert [each[0] for each in near(both)[:3]] == [each[0] for each in near(one)[:3]]
        np.testing.assert_allclose(distances(both)[:6], distances(one)[:6], atol=0.01)
        # the course of a motion that is none of a library's is seen along its axes only
        np.testing.assert_allclose(distances(both)[6:], distances(one)[6:], atol=0.2)
        names = [each.library for each in both.hits]
        assert set(names[:3]) == {str(parts["walks"])}
        assert set(names) == {str(parts["walks"]), str(parts["others"])}

    def test_alone_in_a_library_distances_would_mislead(self, parts, take):
        """In a library of hops and squats the warping of the nearest seems to cost less."""
        alone = query_libraries([parts["others"]], take, k=1).hits[0].hit
        both = query_libraries([parts["walks"], parts["others"]], take, k=30)
        same = [each.hit for each in both.hits if each.hit.record.label != "walk"]
        assert same[0].stretch.warped > 1.05 * alone.stretch.warped

    def test_one_library_alone_is_searched_as_ever(self, parts, take):
        with Library(parts["all"]) as library:
            hits = library.query(take, k=5)
        found = query_libraries([parts["all"]], take, k=5)
        assert [each.hit for each in found.hits] == hits

    def test_names_are_of_the_first_and_it_is_left_out_there(self, parts):
        found = query_libraries([parts["walks"], parts["all"]], "01_01", k=1)
        (nearest,) = found.hits
        assert (nearest.library, nearest.hit.record.name) == (str(parts["all"]), "01_01")
        assert nearest.hit.distance < 0.1

    def test_of_unlike_and_of_joints(self, parts, take):
        other = synthetic.make_clip("hop", seed=3, duration_s=2)
        for more in ({"unlike": other}, {"joints": ["legs"]}, {"mirror": True}):
            one = query_libraries([parts["all"]], take, k=4, **more)
            both = query_libraries([parts["walks"], parts["others"]], take, k=4, **more)
            assert {each.hit.record.label for each in both.hits} == {"walk"}
            np.testing.assert_allclose(distances(both), distances(one), atol=0.1)

    def test_a_long_query_is_cut_to_the_longest_clip_of_all(self, parts):
        long = synthetic.make_clip("walk", seed=9, duration_s=3)
        found = query_libraries([parts["walks"], parts["others"]], long)
        (note,) = found.notes
        assert "longer than every clip that is searched" in note

    def test_of_two_processes(self, parts, take):
        here = query_libraries([parts["walks"], parts["others"]], take, explain=True)
        there = query_libraries([parts["walks"], parts["others"]], take, explain=True, jobs=2)
        assert [each.hit for each in here.hits] == [each.hit for each in there.hits]
        assert [each.why.of_parts() for each in here.hits] == [
            each.why.of_parts() for each in there.hits
        ]

    @pytest.mark.slow
    def test_of_a_cluster(self, parts, take, dask_cluster):
        here = query_libraries([parts["walks"], parts["others"]], take)
        there = query_libraries([parts["walks"], parts["others"]], take, scheduler=dask_cluster)
        assert [each.hit for each in here.hits] == [each.hit for each in there.hits]
        alone = query_libraries([parts["all"]], take, scheduler=dask_cluster)
        assert near(alone) == near(query_libraries([parts["all"]], take))

    def test_of_whole_clips(self, parts):
        walk = synthetic.make_clip("walk", seed=9, skeleton=synthetic.subject(9), duration_s=2)
        one = query_libraries([parts["all"]], walk, k=9, whole=True, expand=0)
        both = query_libraries([parts["walks"], parts["others"]], walk, k=9, whole=True)
        assert [each.hit.record.label for each in both.hits[:3]] == ["walk"] * 3
        assert sorted(near(both)) == sorted(near(one))
        np.testing.assert_allclose(distances(both), distances(one), atol=0.1)
        expanded = query_libraries([parts["all"]], walk, k=9, whole=True)
        with Library(parts["all"]) as library:
            assert [each.hit for each in expanded.hits] == library.query(walk, k=9, whole=True)
        with pytest.raises(ClipError, match="nothing to expand"):
            query_libraries([parts["walks"], parts["others"]], walk, whole=True, expand=2)

    def test_of_one_in_object_storage(self, parts, take, tmp_path, monkeypatch):
        fsspec = pytest.importorskip("fsspec")
        monkeypatch.setenv("MOCAPDB_CACHE", str(tmp_path))
        files = fsspec.filesystem("memory")
        files.put(str(parts["others"]), "/others.mocapdb", recursive=True)
        here = query_libraries([parts["walks"], parts["others"]], take, explain=True)
        there = query_libraries([parts["walks"], "memory://others.mocapdb"], take, explain=True)
        assert [each.hit for each in here.hits] == [each.hit for each in there.hits]
        assert {each.library for each in there.hits} == set(there.libraries)
        files.rm("/others.mocapdb", recursive=True)


class TestRefused:
    def test_a_library_that_is_not_there(self, parts, take, tmp_path):
        with pytest.raises(LibraryError, match=r"nothing\.mocapdb: not a library"):
            query_libraries([parts["all"], tmp_path / "nothing.mocapdb"], take)
        with pytest.raises(LibraryError, match="at least one library"):
            query_libraries([], take)

    def test_one_that_is_newer(self, parts, take, tmp_path):
        newer = shutil.copytree(parts["walks"], tmp_path / "newer.mocapdb")
        with closing(sqlite3.connect(newer / "catalogue.db")) as database:
            database.execute("PRAGMA user_version = 99")
        with pytest.raises(LibraryError, match=r"newer\.mocapdb.*got 99"):
            query_libraries([parts["all"], newer], take)

    def test_one_without_an_index(self, parts, take, tmp_path):
        bare = tmp_path / "bare.mocapdb"
        corpus = parts["take"].parent / "corpus"
        build_library(
            corpus, bare, SETTINGS, jobs=1, index=False, only=lambda file: file == "01_01.bvh"
        )
        with pytest.raises(LibraryError, match=r"bare\.mocapdb: the library was built without"):
            query_libraries([parts["all"], bare], take)

    def test_the_same_library_twice_is_searched_once(self, parts, take):
        twice = query_libraries([parts["all"], parts["all"].parent / "." / "all.mocapdb"], take)
        once = query_libraries([parts["all"]], take)
        assert [each.hit for each in twice.hits] == [each.hit for each in once.hits]
        assert twice.libraries == [str(parts["all"])]
        assert "given twice, searched once" in twice.notes[0]

    def test_a_class_that_one_of_them_has(self, parts, take):
        both = [parts["walks"], parts["others"]]
        found = query_libraries(both, take, only=Filter(label="squat"))
        assert {each.hit.record.label for each in found.hits} == {"squat"}
        assert "walks.mocapdb: no clip has class 'squat'" in found.notes[0]
        with pytest.raises(NoClipFitsError, match="no clip has class 'swim'"):
            query_libraries(both, take, only=Filter(label="swim"))

    def test_a_query_that_is_too_short(self, parts, take):
        with pytest.raises(ClipError, match=r"Expected a query of 0\.3 s or more"):
            query_libraries([parts["walks"], parts["others"]], take[:10])

    def test_other_weights_are_those_of_the_first(self, parts, take):
        found = query_libraries(
            [parts["walks"], parts["others"]], take, weights=Weights(0, 0, 0, 0)
        )
        usual = query_libraries([parts["walks"], parts["others"]], take)
        assert found.hits[0].hit.record.label == "walk"
        assert found.hits[0].hit.distance != usual.hits[0].hit.distance


class TestCommand:
    def test_table_json_csv_and_picture(self, parts, tmp_path):
        asked = ["query", parts["walks"], parts["take"], "--from", 0.5, "--to", 1.5]
        asked += ["--also", parts["others"], "-k", 4]
        done = run(*asked)
        assert done.exit_code == 0, done.output
        assert "library" in done.stdout
        answer = run_json(*asked, "--plot", tmp_path / "p.png", "-o", tmp_path / "hits")
        assert answer["libraries"] == [str(parts["walks"]), str(parts["others"])]
        assert answer["hits"][0]["library"] == str(parts["walks"])
        assert {"parts", "joints", "moments"} == set(answer["hits"][0]["why"])
        assert len(list((tmp_path / "hits").iterdir())) == 4
        assert (tmp_path / "p.png").stat().st_size > 10_000
        lines = run(*asked, "--csv").stdout.splitlines()
        assert lines[0].endswith(",library")
        assert lines[1].endswith(f",{parts['walks']}")
        assert len(lines) == 5

    @pytest.mark.parametrize("more", [["--expand", 2], ["--save", "x"]])
    def test_what_is_for_one_library(self, parts, more):
        done = run("query", parts["walks"], parts["take"], "--also", parts["others"], *more)
        assert done.exit_code == 2
        assert "it is for one library" in done.output

    def test_also_of_nothing(self, parts):
        done = run("query", parts["walks"], parts["take"], "--also", "nothing.mocapdb")
        assert done.exit_code == 1
        assert "nothing.mocapdb: not a library" in done.output

    @pytest.mark.filterwarnings("ignore")  # a client that fails leaves its loop open
    def test_a_scheduler_that_is_none(self, parts):
        done = run("query", parts["walks"], parts["take"], "--scheduler", "nonsense")
        gc.collect()  # here, where nobody minds
        assert done.exit_code == 1
        assert "nonsense: no Dask scheduler answers" in done.output


def test_what_lies_beside_the_axes_counts():
    """A distance in a space with all features is that of the features themselves."""
    motions = [canonical_motion(synthetic.make_clip(kind, seed=1, duration_s=2)) for kind in KINDS]
    narrow = FeatureSpace.fit(motions[:1], dims=4)
    wide = FeatureSpace.fit(motions, dims=107)
    on_axes = np.asarray(narrow.frames(motions[0]))  # as an index of walks knows them
    known = narrow.mean + on_axes @ narrow.axes.T
    query = Query([motions[2]])
    ours = query.templates(narrow, all_features=True)[0].distances(on_axes)
    whole = ((known - wide.mean) @ wide.axes).astype(np.float32)
    theirs = query.templates(wide)[0].distances(whole)
    np.testing.assert_allclose(ours, theirs, rtol=1e-4)
    assert (query.templates(narrow)[0].distances(on_axes) < 0.9 * ours).any()
    index = MotionIndex.of(motions, wide)
    assert len(index) == len(motions)


def test_the_middle_of_samples_of_unlike_libraries():
    costs, weights = np.array([1.0, 2.0, 10.0]), np.array([1.0, 1.0, 5.0])
    assert reference_of(costs) == 2.0
    assert reference_of(costs, weights) == 10.0
    assert reference_of(np.zeros(0)) == np.inf
