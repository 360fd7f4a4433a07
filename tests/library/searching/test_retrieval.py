"""Queries and classes over a library on disk."""

import shutil
from unittest import mock

import numpy as np
import pytest
from small_library import one_commit

import mocapdb
from mocapdb import BuildSettings, Library, Target, build_library
from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError, LibraryError, SkeletonError, UnknownClipError
from mocapdb.indexing import Weights, canonical_motion
from mocapdb.indexing.canonical.canonical_body import LENGTHS_M
from mocapdb.indexing.search.frame_store import code_clip
from mocapdb.indexing.tuning import UNTOLD_SHARE
from mocapdb.io import write_clip
from mocapdb.library import (
    Filter,
    Retrieval,
    SavedQuery,
    apply_labels,
    compact_library,
    forget_query,
    index_library,
    save_query,
    verify_library,
)
from mocapdb.library.index_pieces import PARTS
from mocapdb.library.layout import MODELS_FILE, SEARCH_FOLDER
from mocapdb.library.searching.canonical_shards import BONE_UNITS, pack_motion

SETTINGS = BuildSettings(Target("mean_mm", 4.0), {"representation": "channels", "transform": "dct"})
KINDS = ("walk", "squat", "hop")


def write_person(folder, person, kinds, labels):
    skeleton = synthetic.subject(person)
    for number, kind in enumerate(kinds, start=1):
        name = f"{person:02d}_{number:02d}"
        clip = synthetic.make_clip(
            kind, seed=10 * person + number, skeleton=skeleton, duration_s=3, name=name
        )
        write_clip(clip, folder / f"{name}.bvh")
        labels.append(f"{name},{kind},{kind}s about")


@pytest.fixture(scope="session")
def motion_corpus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("motions")
    labels = ["clip,label,description"]
    for person in (1, 2, 3):
        write_person(folder, person, KINDS, labels)
    (folder / "LABELS.csv").write_text("\n".join(labels) + "\n")
    return folder


@pytest.fixture(scope="session")
def searchable_template(motion_corpus, tmp_path_factory):
    path = tmp_path_factory.mktemp("searchable") / "motions.mocapdb"
    with one_commit():
        build_library(motion_corpus, path, SETTINGS, jobs=1, index=True)
    return path


@pytest.fixture
def searchable(searchable_template, tmp_path):
    return shutil.copytree(searchable_template, tmp_path / "motions.mocapdb")


def found(path, name="01_01", **options):
    with Library(path) as library:
        clip = library.clip(name)
        only = options.pop("only", Filter(not_clips=[name]))
        return Retrieval(library).query(clip[60:240], only=only, **options)


class TestQuery:
    def test_a_name_is_a_clip_of_the_library(self, searchable):
        with Library(searchable) as library:
            retrieval = Retrieval(library)
            hits = retrieval.query("01_01", k=2, joints=["legs"], unlike="01_02")
            assert {hit.record.label for hit in hits} == {"walk"}
            assert not {"01_01", "01_02"} & {hit.record.stem for hit in hits}
            with pytest.raises(UnknownClipError):
                retrieval.query("nobody")

    def test_a_library_and_mocapdb_query_and_classify_in_one_call(self, searchable):
        with Library(searchable) as library:
            hits = Retrieval(library).query("01_01", k=2)
            assert library.query("01_01", k=2) == hits
            assert mocapdb.query(library, "01_01", k=2) == hits
            assert library.classify("01_01").label == "walk"
            with pytest.raises(UnknownClipError):
                library.query("nobody")
        assert [hit.record.name for hit in mocapdb.query(searchable, "01_01", k=2)] == [
            hit.record.name for hit in hits
        ]
        clip = synthetic.make_clip("walk", seed=3, duration_s=2.0)
        assert mocapdb.classify(searchable, clip).label == "walk"

    @pytest.mark.parametrize("whole", [False, True])
    def test_how_likely_a_hit_is_does_not_depend_on_what_is_left_out(self, searchable, whole):
        all_hits = found(searchable, whole=whole)
        assert {hit.record.label for hit in all_hits} > {"walk"}
        best = all_hits[0]
        assert 0.5 < best.label_share < 1.0
        (first,) = found(searchable, k=1, whole=whole)
        walks = found(searchable, whole=whole, only=Filter(label="walk", not_clips=["01_01"]), k=1)
        near = found(searchable, whole=whole, max_distance=best.distance + 1e-6)
        for other in (first, walks[0], near[0]):
            assert other.record.stem == best.record.stem
            assert other.label_share == pytest.approx(best.label_share, abs=0.05)

    def test_what_has_no_label_is_not_said_to_be_sure(self, motion_corpus, tmp_path):
        corpus = shutil.copytree(motion_corpus, tmp_path / "corpus")
        (corpus / "LABELS.csv").unlink()
        library = tmp_path / "untold.mocapdb"
        build_library(corpus, library, SETTINGS, jobs=1)
        with Library(library) as untold:
            retrieval = Retrieval(untold)
            likely = [hit.probability for hit in retrieval.query("01_01", k=3)]
            assert max(likely) <= UNTOLD_SHARE
            assert retrieval.query("01_01", probability=0.8) == []
            assert "without a label are left out" in retrieval.notes[0]

    @pytest.mark.parametrize("distance", [float("nan"), -1.0])
    def test_a_distance_is_a_number_from_zero(self, searchable, distance):
        with pytest.raises(ClipError, match="distance of 0 or more"):
            found(searchable, max_distance=distance)

    @pytest.mark.parametrize("whole", [False, True])
    def test_what_is_not_meant_is_left_out(self, searchable, whole):
        with Library(searchable) as library:
            retrieval = Retrieval(library)
            kinds = {hit.record.label for hit in retrieval.query("01_01", k=30, whole=whole)}
            meant = retrieval.query("01_01", k=8, whole=whole, unlike=["01_02", "02_03"])
            assert kinds > {"walk"}
            assert {hit.record.label for hit in meant} == {"walk"}

    def test_other_people_are_found(self, searchable):
        hits = found(searchable, k=4)
        assert {hit.record.label for hit in hits} == {"walk"}
        assert {hit.record.stem for hit in hits} <= {"02_01", "03_01"}
        for hit in hits:
            assert 0 <= hit.start < hit.end <= hit.record.frames
            assert hit.end_s - hit.start_s == pytest.approx(1.5 * hit.time_scale, abs=0.1)

    def test_restrictions(self, searchable):
        for only, stems in (
            (Filter(label="squat"), {"01_02", "02_02", "03_02"}),
            (Filter(subject="02"), {"02_01", "02_02", "02_03"}),
            (Filter(text="hops"), {"01_03", "02_03", "03_03"}),
            (Filter(label="walk", not_subjects=["01", "02"]), {"03_01"}),
            (Filter(facets={"root_speed": (0.5, None)}), {"01_01", "02_01", "03_01"}),
            (Filter(text="jumping"), {"01_03", "02_03", "03_03"}),
        ):
            hits = found(searchable, only=only, k=30)
            assert {hit.record.stem for hit in hits} == stems

    def test_whole_clips(self, searchable):
        hits = found(searchable, whole=True, k=2)
        assert {hit.record.label for hit in hits} == {"walk"}
        assert [(hit.start, hit.end) for hit in hits] == [(0, h.record.frames) for h in hits]

    def test_other_weights_make_another_index(self, searchable):
        plain, other = found(searchable, k=1), found(searchable, k=1, weights=Weights(0, 0, 0, 0))
        assert plain[0].distance != other[0].distance
        assert other[0].record.label == "walk"

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            ({"k": 0}, "k to be a whole number from 1, but got 0"),
            ({"k": 2.5}, "k to be a whole number from 1, but got 2.5"),
            ({"expand": -1}, "expand to be a whole number from 0, but got -1"),
            ({"threads": 0}, "threads to be a whole number from 1"),
            ({"max_distance": float("nan")}, "distance of 0 or more, but got nan"),
            ({"max_distance": -1}, "distance of 0 or more, but got -1"),
            ({"probability": float("nan")}, "probability from 0 to 1, but got nan"),
            ({"joints": "right-arn"}, "Did you mean right-arm"),
        ],
    )
    def test_numbers_that_are_none(self, searchable, options, message):
        with Library(searchable) as library, pytest.raises(ClipError, match=message):
            library.retrieval.query("01_01", **options)

    def test_examples_by_name_and_what_is_no_example(self, searchable):
        with Library(searchable) as library:
            assert library.retrieval.query("01_01", k=1, joints="left-leg,right-leg")
            assert library.retrieval.classify("01_01").label == "walk"
            for nothing in (None, 3, [None]):
                with pytest.raises(ClipError, match="Expected a clip, the name of a clip"):
                    library.retrieval.query(nothing)

    @pytest.mark.parametrize(
        ("only", "message"),
        [
            (Filter(label="fly"), "no clip has class 'fly'. It has: hop, squat, walk"),
            (Filter(label="wakl"), "no clip has class 'wakl'. Did you mean walk"),
            (Filter(subject="77"), "no clip has subject '77'. It has: 01, 02, 03"),
            (Filter(where={"sbject": "1"}), "but got 'sbject'. Did you mean subject"),
            (Filter(text="nonsense"), "fits text 'nonsense'"),
            (Filter(text="hop", where={"subject": "77"}), "no clip has subject '77'"),
            (Filter(facets={"turn": (360, None)}), "fits turn 360:. See: mocapdb ls"),
            (Filter(flagged=False), "fits flagged no. None was searched for faults: mocapdb clean"),
            (Filter(facets={"root_sped": (1, 2)}), "Did you mean root_speed"),
            (Filter(facets={"height": (2, 1)}), "lower end of height first, but got 2:1. Say 1:2"),
        ],
    )
    def test_nothing_fits(self, searchable, only, message):
        with pytest.raises(LibraryError, match=message):
            found(searchable, only=only)

    def test_unknown_clip_left_out(self, searchable):
        with pytest.raises(UnknownClipError):
            found(searchable, only=Filter(not_clips=["nobody"]))

    def test_longer_than_everything_is_cut_to_where_most_goes_on(self, searchable):
        walk = synthetic.make_clip("walk", seed=1, skeleton=synthetic.subject(9), duration_s=4)
        rest = np.repeat(walk.channels[:1], 3000, axis=0)
        long = walk.replace(channels=np.vstack([rest, walk.channels, walk.channels[-1:]]))
        with Library(searchable) as library:
            retrieval = Retrieval(library)
            hits = retrieval.query(long, k=3)
            (note,) = retrieval.notes
            assert "its liveliest 3.00 s are looked for, from 25." in note
            assert {hit.record.label for hit in hits} == {"walk"}
            retrieval.query(walk[:240], k=1)
            assert retrieval.notes == []

    def test_a_pose_is_told_to_be_one(self, searchable):
        walk = synthetic.make_clip("walk", seed=1, duration_s=2)
        still = walk.replace(channels=np.repeat(walk.channels[:1], 120, axis=0))
        with Library(searchable) as library:
            retrieval = Retrieval(library)
            retrieval.query(still, k=1)
            assert "hardly moves (0.0 cm/s): it is a pose" in retrieval.notes[0]

    @pytest.mark.parametrize("joints", [(), ("legs",)])
    def test_a_pose_is_found_where_it_is_however_it_moves(self, searchable, joints):
        with Library(searchable) as library:
            hop = library.clip("02_03")
            middle = len(hop) // 2
            still = hop.replace(channels=np.repeat(hop.channels[[middle]], 120, axis=0))
            retrieval = Retrieval(library)
            hits = retrieval.query(still, k=5, joints=joints)
            assert (hits[0].record.name, hits[0].time_scale) == ("02_03", 1.0)
            assert hits[0].end_s - hits[0].start_s < 0.5
            sought, clip = canonical_motion(still).pose[0], canonical_motion(hop).pose
            apart = np.linalg.norm(clip - sought, axis=2).mean(axis=1)
            stretch = hits[0].stretch
            assert apart[stretch.start : stretch.end].mean() < np.percentile(apart, 20)
            assert "moments in that pose, however they move" in retrieval.notes[0]
            starts = sorted(hit.start_s for hit in hits if hit.record.name == "02_03")
            assert all(np.diff(starts) > 0.4)  # one hit where the pose is held
            first, last = hits[0].sought_s(still)
            assert last - first == pytest.approx(0.3, abs=0.03)
            retrieval.query(still, k=1, whole=True)
            assert "how it moves counts" in retrieval.notes[0]
        both = mocapdb.library.query_libraries([searchable, searchable], still, joints=joints, k=2)
        assert both.hits[0].hit.record.name == "02_03"

    def test_a_saved_query_finds_what_later_builds_bring(self, motion_corpus, searchable, tmp_path):
        with Library(searchable) as library:
            hop = canonical_motion(library.clip("01_03"))
            before = Retrieval(library).query(hop, k=30, probability=0.5)
        options = {"k": 99, "probability": 0.5, "only": {"label": "hop"}, "weights": None}
        assert not save_query(searchable, "hops", SavedQuery((hop,), (), options))
        assert save_query(searchable, "hops", SavedQuery((hop,), (), options))
        corpus = shutil.copytree(motion_corpus, tmp_path / "corpus")
        labels = (corpus / "LABELS.csv").read_text().splitlines()
        write_person(corpus, 4, ("hop",), labels)
        (corpus / "LABELS.csv").write_text("\n".join(labels) + "\n")
        build_library(corpus, searchable, SETTINGS, jobs=1)
        with Library(searchable) as library:
            found = Retrieval(library).saved("hops")
            assert {hit.record.stem for hit in found} == {"01_03", "02_03", "03_03", "04_01"}
            assert found[0].distance < 0.05 < before[1].distance
            assert all(hit.probability >= 0.5 for hit in found)
            with pytest.raises(LibraryError, match="no query is saved as 'hosp'"):
                Retrieval(library).saved("hosp")
        forget_query(searchable, "hops")
        with Library(searchable) as library, pytest.raises(LibraryError, match="None was saved"):
            Retrieval(library).saved("hops")

    def test_a_skeleton_without_a_body(self, searchable):
        walk = synthetic.make_clip("walk", seed=1)
        rootless = [name for name in walk.skeleton.names if name == "root"]
        from mocapdb.motion.clip import Clip
        from mocapdb.motion.skeleton import Skeleton

        stick = Skeleton(
            rootless, [-1], [[0, 0, 0]], [("tx", "ty", "tz", "rz", "ry", "rx")], ["ZYX"],
            convention="bvh",
        )  # fmt: skip
        clip = Clip(stick, np.zeros((100, 6)), 120.0)
        with Library(searchable) as library, pytest.raises(SkeletonError, match="Cannot map"):
            Retrieval(library).query(clip)


class TestClasses:
    def test_classify(self, searchable):
        clip = synthetic.make_clip("squat", seed=50, skeleton=synthetic.subject(50))
        with Library(searchable) as library:
            retrieval = Retrieval(library)
            answer = retrieval.classify(clip)
            assert retrieval.classes.labels == ("hop", "squat", "walk")
        assert answer.ranking[0].label == "squat"

    def test_unknown_is_no_label(self, motion_corpus, searchable, tmp_path):
        corpus = shutil.copytree(motion_corpus, tmp_path / "corpus")
        labels = (corpus / "LABELS.csv").read_text()
        labels = labels.replace("03_01,walk", "03_01,unknown").replace("03_02,squat", "03_02,")
        (corpus / "LABELS.csv").write_text(labels)
        report = build_library(corpus, searchable, SETTINGS, jobs=1)
        assert any(
            "1 of 9 rows of the labels have an empty label" in w for w in report.assumed.warnings
        )
        with Library(searchable) as library:
            assert (library.record("03_01").label, library.record("03_02").label) == (
                "unknown",
                None,
            )
            assert library.record("03_02").description == "squats about"
            found = Retrieval(library).classify_unlabelled()
            assert [record.name for record, _ in found] == ["03_01", "03_02"]
            growth = Retrieval(library).grow()
            assert growth.labels == {"03_01": "walk", "03_02": "squat"}
        apply_labels(searchable, growth.labels)
        build_library(corpus, searchable, SETTINGS, jobs=1)
        with Library(searchable) as library:  # the corpus still does not know better
            assert library.record("03_01").label == "walk"

    def test_by_subject_people_are_not_left_out(self, searchable):
        with Library(searchable) as library:
            retrieval = Retrieval(library)
            found = retrieval.classify_by("subject")
            (note,) = retrieval.notes
            assert "also by the same people" in note
            seen = {score.label for _, answer in found for score in answer.ranking}
            assert seen == {"01", "02", "03"}
            own = [
                (record.performer, {score.label for score in answer.ranking})
                for record, answer in found
            ]
            assert all(who in others for who, others in own)

    def test_labels_that_are_applied_stay(self, motion_corpus, searchable, tmp_path):
        corpus = shutil.copytree(motion_corpus, tmp_path / "corpus")
        labels = (corpus / "LABELS.csv").read_text().splitlines()
        (corpus / "LABELS.csv").write_text(
            "\n".join(line for line in labels if not line.startswith("03_01")) + "\n"
        )
        build_library(corpus, searchable, SETTINGS, jobs=1)
        with Library(searchable) as library:
            ((record, answer),) = Retrieval(library).classify_unlabelled()
            assert (record.stem, answer.ranking[0].label) == ("03_01", "walk")
        apply_labels(searchable, {"03_01": "walk"})
        for _ in range(2):
            with Library(searchable) as library:
                record = library.record("03_01")
                assert (record.label, record.label_source) == ("walk", "classify")
                assert len(Retrieval(library).classes.example_class) == 9
            build_library(corpus, searchable, SETTINGS, jobs=1)
        (corpus / "LABELS.csv").write_text("\n".join(labels) + "\n")
        build_library(corpus, searchable, SETTINGS, jobs=1)
        with Library(searchable) as library:
            assert library.record("03_01").label_source == "corpus"


class TestFiles:
    def test_new_clips_are_searched_and_learned(self, motion_corpus, searchable, tmp_path):
        corpus = shutil.copytree(motion_corpus, tmp_path / "corpus")
        labels = (corpus / "LABELS.csv").read_text().splitlines()
        write_person(corpus, 4, ("box", "walk"), labels)
        (corpus / "LABELS.csv").write_text("\n".join(labels) + "\n")
        before = (searchable / "features" / "000001.h5").read_bytes()
        build_library(corpus, searchable, SETTINGS, jobs=1)
        assert (searchable / "features" / "000001.h5").read_bytes() == before
        with Library(searchable) as library:
            retrieval = Retrieval(library)
            assert "box" in retrieval.classes.labels
            assert len(retrieval.index) == 11
            assert verify_library(library)["stray"] == []

    def test_only_new_clips_are_coded(self, motion_corpus, searchable, tmp_path):
        corpus = shutil.copytree(motion_corpus, tmp_path / "corpus")
        labels = (corpus / "LABELS.csv").read_text().splitlines()
        write_person(corpus, 4, ("box", "walk"), labels)
        (corpus / "LABELS.csv").write_text("\n".join(labels) + "\n")
        other = synthetic.make_clip("walk", seed=77, skeleton=synthetic.subject(1), duration_s=5)
        write_clip(other, corpus / "02_01.bvh")
        place = "mocapdb.library.searching.search_index.code_clip"
        with mock.patch(place, side_effect=code_clip) as coding:
            build_library(corpus, searchable, SETTINGS, jobs=1)
        assert coding.call_count == 3
        with Library(searchable) as library:
            retrieval = Retrieval(library)
            index, motions = retrieval.index, retrieval.motions
            assert len(index) == len(motions) == 11
            for row, motion in enumerate(motions):
                own = code_clip(index.space, index.space.frames(motion))
                np.testing.assert_array_equal(index.frames.of_clips(row, row), own.frames)
                np.testing.assert_array_equal(index.sketch.of_clips(row, row), own.sketch)
                np.testing.assert_array_equal(index.signatures[row], own.signature)

    def test_nothing_changes_when_nothing_is_new(self, motion_corpus, searchable):
        names = {MODELS_FILE, *(f"000001.{part}" for part in PARTS)}
        derived = [path for path in searchable.rglob("*") if path.name in names]
        files = {path: path.stat().st_mtime_ns for path in derived}
        assert len(files) == len(names)
        build_library(motion_corpus, searchable, SETTINGS, jobs=1)
        assert {path: path.stat().st_mtime_ns for path in files} == files

    def test_without_features_it_says_how_to_add_them(self, motion_corpus, searchable, tmp_path):
        path = tmp_path / "bare.mocapdb"
        build_library(motion_corpus, path, SETTINGS, jobs=1, index=False)
        with Library(path) as library, pytest.raises(LibraryError, match="mocapdb index"):
            _ = Retrieval(library)
        build_library(motion_corpus, path, SETTINGS, jobs=1)  # stays without, until told otherwise
        assert not (path / SEARCH_FOLDER).exists()
        again = shutil.copytree(path, tmp_path / "again.mocapdb")
        build_library(motion_corpus, again, SETTINGS, jobs=1, index=True)
        with Library(again) as library:
            assert len(Retrieval(library).index) == 9
        report = {"indexed": 9, "unmapped": 0, "classes": 3, "measured": 0}
        assert index_library(path) == report
        assert index_library(path)["indexed"] == 0
        # from decoded clips, so not to the last digit
        names = [{hit.record.name for hit in found(each, k=4)} for each in (path, searchable)]
        assert names[0] == names[1] == {"02_01", "03_01"}

    def test_an_empty_library(self, searchable_template, tmp_path):
        from mocapdb.library.writing.open_for_writing import open_for_writing

        with open_for_writing(tmp_path / "empty.mocapdb", create=True):
            pass
        with (
            Library(tmp_path / "empty.mocapdb") as library,
            pytest.raises(LibraryError, match="empty"),
        ):
            _ = Retrieval(library)

    @pytest.mark.parametrize("harm", ["missing", "cut", "changed"])
    def test_derived_files_can_be_lost(self, searchable, harm):
        expected = [(hit.record.name, hit.start) for hit in found(searchable, k=3)]
        for path in (searchable / MODELS_FILE, *(searchable / SEARCH_FOLDER).iterdir()):
            if harm == "missing":
                path.unlink()
            elif harm == "cut":
                path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
            else:
                path.write_bytes(bytes(reversed(path.read_bytes())))
        assert [(hit.record.name, hit.start) for hit in found(searchable, k=3)] == expected
        with Library(searchable) as library:
            assert Retrieval(library).classes.labels == ("hop", "squat", "walk")

    def test_a_feature_shard_that_is_damaged_or_lost(self, searchable):
        path = searchable / "features" / "000001.h5"
        data = bytearray(path.read_bytes())
        data[len(data) // 2] ^= 1
        path.write_bytes(data)
        with Library(searchable) as library:
            (bad,) = verify_library(library)["shards"]
        assert bad == {"shard": "features/000001.h5", "reason": "fails its SHA-256"}
        path.unlink()
        shutil.rmtree(searchable / SEARCH_FOLDER)
        with pytest.raises(LibraryError, match="feature shard is missing"):
            found(searchable)

    def test_compacting_drops_the_features_of_replaced_clips(
        self, motion_corpus, searchable, tmp_path
    ):
        corpus = shutil.copytree(motion_corpus, tmp_path / "corpus")
        other = synthetic.make_clip("walk", seed=77, skeleton=synthetic.subject(1), duration_s=3)
        write_clip(other, corpus / "01_01.bvh")
        build_library(corpus, searchable, SETTINGS, jobs=1)
        expected = [(hit.record.name, hit.start) for hit in found(searchable, "02_01", k=3)]
        compact_library(searchable)
        assert {path.name for path in (searchable / "features").iterdir()} >= {"000002.h5"}
        assert not (searchable / "features" / "000001.h5").exists()
        assert [(h.record.name, h.start) for h in found(searchable, "02_01", k=3)] == expected
        with Library(searchable) as library:
            assert len(Retrieval(library).index) == 9
            assert verify_library(library)["stray"] == []

    def test_packing_keeps_directions_and_ways(self):
        motion = canonical_motion(synthetic.make_clip("run", seed=2))
        again = pack_motion(motion).unpack()
        assert np.linalg.norm(again.pose - motion.pose, axis=2).max() < 0.02
        assert np.linalg.norm(again.pose - motion.pose, axis=2).mean() < 0.004
        assert np.abs(again.root - motion.root).max() <= 0.001
        assert np.abs(again.yaw - motion.yaw).max() <= 0.001
        assert LENGTHS_M.max() * BONE_UNITS < 127


def test_classes_are_not_learned_anew_for_every_clip(tmp_path, monkeypatch):
    from small_library import build, run, write_clips

    from mocapdb.library.searching import learned_classes

    def add(names, seed):
        write_clips(tmp_path / "corpus", {f"{name}.bvh": ("walk", seed) for name in names})

    learned = []
    learn = learned_classes._learn
    monkeypatch.setattr(
        learned_classes, "_learn", lambda *a: learned.append(len(a[1])) or learn(*a)
    )
    monkeypatch.setattr(learned_classes, "NEW_SHARE", 0.5)
    library = tmp_path / "l.mocapdb"
    add(["walk/a", "walk/b", "hop/c"], 1)
    assert build(tmp_path / "corpus", library, index=True).not_learned == 0
    add(["walk/d"], 2)
    assert build(tmp_path / "corpus", library, index=True).not_learned == 1
    assert learned == [3]
    add(["walk/e"], 3)  # more than the share
    assert build(tmp_path / "corpus", library, index=True).not_learned == 0
    add(["walk/a"], 4)  # one that it learned from is another
    build(tmp_path / "corpus", library, index=True)
    add(["box/f"], 5)  # a class that it does not know
    build(tmp_path / "corpus", library, index=True)
    assert learned == [3, 5, 5, 6]
    add(["walk/g"], 6)
    build(tmp_path / "corpus", library, index=True)
    assert learned == [3, 5, 5, 6]
    assert run("index", library).exit_code == 0
    assert learned == [3, 5, 5, 6, 7]
    assert learned_classes.NEW_SHARE == 0.5
