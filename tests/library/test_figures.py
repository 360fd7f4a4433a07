"""What the tuned numbers of a library bound, at their very limits."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from small_library import build, write_clips

from mocapdb.compression import Target
from mocapdb.errors import NoPeriodError, UnknownClipError
from mocapdb.indexing.search.features import FeatureSpace
from mocapdb.io.reading import ReadOptions
from mocapdb.library import BuildSettings, Library
from mocapdb.library.building import class_bases, commit_clips
from mocapdb.library.building.commit_clips import BuildReport, Committer
from mocapdb.library.building.encode_files import Encoded
from mocapdb.library.building.plan import Task
from mocapdb.library.searching import class_cycles, learned_classes, search_index
from mocapdb.library.upkeep import index


def task(number: int, label: str) -> Task:
    return Task(
        path=f"{number}.bvh",
        relative=f"{number}.bvh",
        reading=ReadOptions(),
        by_settings=frozenset(),
        settings="",
        sha256=str(number),
        name=str(number),
        label=label,
        description="",
        subject=None,
        subject_source="nobody",
        columns={},
        fps_source="",
        replaces=None,
    )


class TestCommits:
    @pytest.fixture
    def committer(self, monkeypatch):
        """One that notes how many clips it has when it commits."""
        made = Committer(
            SimpleNamespace(path=Path("l/catalogue.db")),
            Path(),
            SimpleNamespace(to_json=str, codec={}),
            BuildReport("l"),
        )
        made.commits = []
        made.commit = lambda: made.commits.append(len(made._waiting))
        return made

    def test_after_32_mib(self, committer):
        clip = Encoded(task(0, "walk"), None, bytes(8 * 2**20), {}, None, None, None)
        for _ in range(4):
            committer.add(clip)
        assert committer.commits == [4]

    def test_after_20_seconds(self, committer, monkeypatch):
        start = committer._since
        clip = Encoded(task(0, "walk"), None, b"", {}, None, None, None)
        for seconds in (0.0, 19.9, 20.1):
            monkeypatch.setattr(
                commit_clips, "time", SimpleNamespace(monotonic=lambda s=seconds: start + s)
            )
            committer.add(clip)
        assert committer.commits == [3]

    def test_features_of_500_clips_at_a_time(self, monkeypatch):
        sizes = []
        places = (
            ("packed_features", lambda clip: (None, "no body")),
            ("commit_features", lambda catalogue, clips: sizes.append(len(clips))),
            ("refresh_index", lambda catalogue, anew: None),
        )
        for name, instead in places:
            monkeypatch.setattr(index, name, instead)
        records = [SimpleNamespace(id=number, name=str(number)) for number in range(1001)]
        catalogue = mocked_catalogue(without_features=lambda: records)
        stored = SimpleNamespace(shard=Path(), decode=str)
        index.add_features(SimpleNamespace(path=Path(), stored=lambda _: stored), catalogue)
        assert sizes == [500, 500, 1]


def mocked_catalogue(**answers):
    from contextlib import nullcontext

    return SimpleNamespace(
        transaction=nullcontext,
        has_searchable=lambda: False,
        feature_problems=dict,
        **answers,
    )


class TestBases:
    @pytest.fixture
    def looked_at(self, monkeypatch):
        """How many clips each basis was learned from, by `learn_bases` of tasks."""
        sizes, settings = [], BuildSettings(Target("mean_mm", 1.0))

        def fit(clips):
            sizes.append(len(clips))

        monkeypatch.setattr(class_bases, "_read", lambda task: SimpleNamespace(skeleton=None))
        monkeypatch.setattr(class_bases, "_layout", lambda skeleton, *more: "one")
        monkeypatch.setattr(class_bases, "_in_common_orders", list)
        monkeypatch.setattr(class_bases, "fit_basis", fit)

        def learn(*n_clips):
            tasks = [task(i, str(n)) for n in n_clips for i in range(n)]
            class_bases.learn_bases(SimpleNamespace(class_bases=dict), tasks, settings)
            return sizes

        return learn

    def test_of_three_clips_at_least(self, looked_at):
        assert looked_at(1, 2, 3, 4) == [3, 4]

    def test_of_24_clips_at_most(self, looked_at):
        assert looked_at(24, 25, 48) == [24, 13, 24]


class TestIndex:
    def test_axes_of_a_large_library_are_found_from_some_of_its_clips(self, monkeypatch):
        monkeypatch.setattr(FeatureSpace, "fit", lambda motions, weights: len(motions))
        sizes = [
            search_index._space_of(search_index.StoredMotions(Path(), [(0, "", 0)] * n))
            for n in (2000, 3999, 4000, 6000)
        ]
        assert sizes == [2000, 3999, 2000, 2000]

    def test_axes_are_found_anew_once_a_library_has_more_than_doubled(self, tmp_path, monkeypatch):
        fitted = []
        find = FeatureSpace.fit
        monkeypatch.setattr(
            FeatureSpace, "fit", lambda motions, *_: fitted.append(len(motions)) or find(motions)
        )
        for n_clips, found in ((4, [4]), (8, [4]), (9, [4, 9])):
            write_clips(tmp_path / "corpus", {f"{n}.bvh": ("walk", n) for n in range(n_clips)})
            build(tmp_path / "corpus", tmp_path / "l.mocapdb", index=True)
            assert fitted == found


class TestReading:
    def test_256_clips_are_kept_open_for_ranges_of_frames(self, small_library):
        with Library(small_library) as library:
            record = library.record("01_01")
            for number in range(300):
                library.channels(replace(record, id=number), slice(3, 5))
            assert [number for number, _ in library._readers] == list(range(44, 300))

    def test_a_cycle_for_now_looks_at_eight_clips(self, monkeypatch):
        seen = []

        def repeats_nowhere(name, settings):
            seen.append(int(name))
            raise NoPeriodError("nothing repeats")

        monkeypatch.setattr(class_cycles, "extract_cycle", repeats_nowhere)
        monkeypatch.setattr(class_cycles, "list_cycles", lambda path: [])
        records = [SimpleNamespace(name=str(number)) for number in range(32)]
        library = SimpleNamespace(
            path=Path(),
            original=False,
            records=lambda label, where=None: records,
            revision=lambda record: None,
            decode=lambda record: record.name,
        )
        with pytest.raises(NoPeriodError, match="none of 8 is of use"):
            class_cycles.class_cycle(library, "walk")
        assert seen == [0, 4, 8, 12, 16, 20, 24, 28]

    def test_names_that_are_half_alike_are_offered(self, small_library):
        with Library(small_library) as library:
            with pytest.raises(UnknownClipError, match="Did you mean: 01_01"):
                library.record("walking_01_01")
            with pytest.raises(UnknownClipError, match="See: mocapdb ls"):
                library.record("walking_slowly_01_01")

    def test_three_names_are_offered(self, small_library):
        with Library(small_library) as library, pytest.raises(UnknownClipError) as caught:
            library.record("0_0")  # close to all four
        assert len(caught.value.candidates) == 3


def test_one_clip_in_fifty_need_not_be_learned():
    assert round(1 / learned_classes.NEW_SHARE) == 50
