"""Windows of motion: what they hold, in which order, and what can be done with them."""

from __future__ import annotations

import pickle
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from small_library import QUICK, build, small_corpus_template, small_library_template  # noqa: F401

from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError, LibraryError, MocapdbError
from mocapdb.indexing import canonical_motion
from mocapdb.io import write_clip
from mocapdb.library import Library, MotionWindows
from mocapdb.library.training import motion_windows


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """Clips of three people, each a second or three long, and of 120 and 60 Hz."""
    folder = tmp_path_factory.mktemp("people")
    labels = ["clip,label,subject"]
    for person in (1, 2, 3):
        skeleton = synthetic.subject(person)
        for number, kind in enumerate(("walk", "squat"), start=1):
            clip = synthetic.make_clip(kind, seed=person, skeleton=skeleton, duration_s=number)
            clip = clip.resample(60) if person == 3 else clip
            write_clip(clip, folder / f"p{person}_{number}.bvh")
            labels.append(f"p{person}_{number},{kind},p{person}")
    (folder / "LABELS.csv").write_text("\n".join(labels) + "\n")
    path = folder / "people.mocapdb"
    build(folder, path, QUICK)
    with Library(path) as opened:
        yield opened


def key(sample):
    return sample["clip"], sample["start"]


@pytest.fixture
def windows(library):
    return library.windows(length=10, stride=4, fps=30)


def test_a_window_holds_what_its_clip_holds(library, windows):
    seen = set()
    for sample in windows:
        clip = library.clip(windows.clips[sample["clip"]]).resample(30)
        start = sample["start"]
        expected = clip.positions()[start : start + 10]
        assert sample["motion"].dtype == np.float32
        assert np.allclose(sample["motion"], expected, atol=1e-5)
        assert windows.classes[sample["label"]] == clip.label
        seen.add(key(sample))
    expected = {
        (i, start)
        for i, name in enumerate(windows.clips)
        for start in range(0, len(library.clip(name).resample(30)) - 9, 4)
    }
    assert seen == expected
    assert len(windows) == len(expected)
    assert key(windows[-1]) == key(windows[len(windows) - 1])
    for beyond in (len(windows), -len(windows) - 1):
        with pytest.raises(IndexError):
            windows[beyond]


@pytest.mark.parametrize("features", ["quaternions", "6d", "canonical"])
def test_other_features(library, features):
    windows = library.windows(length=12, stride=12, fps=24, features=features)
    sample = windows[3]
    clip = library.clip(windows.clips[sample["clip"]])
    frames = slice(sample["start"], sample["start"] + 12)
    low = clip.resample(24)
    if features == "canonical":
        motion = canonical_motion(low, fps=None)
        assert np.allclose(sample["motion"], motion.pose[frames], atol=1e-5)
        assert np.allclose(sample["root"][:, :3], motion.root[frames], atol=1e-5)
        turns = (sample["root"][:, 3] - motion.yaw[frames]) / (2 * np.pi)
        assert np.allclose(turns, np.round(turns), atol=1e-5)
        return
    assert np.allclose(sample["root"], low.positions()[frames, 0], atol=1e-5)
    if features == "6d":
        assert np.allclose(sample["motion"], low.rotations(form="6d")[frames], atol=1e-5)
    else:
        alike = np.abs(np.sum(sample["motion"] * low.rotations()[frames], axis=-1))
        assert np.allclose(alike, 1.0, atol=1e-6)


def test_a_seed_fixes_the_order(library, monkeypatch):
    monkeypatch.setattr(motion_windows, "STRETCH_WINDOWS", 3)
    monkeypatch.setattr(motion_windows, "POOLED_STRETCHES", 2)
    said = {"length": 10, "stride": 2, "fps": 30}
    plain, mixed, again, other = (library.windows(**said, seed=seed) for seed in (None, 5, 5, 6))
    keys = [[key(sample) for sample in each] for each in (plain, mixed, again, other)]
    assert keys[0] == sorted(keys[0])
    assert keys[1] == keys[2] != keys[3] != keys[0]
    assert sorted(keys[1]) == sorted(keys[3]) == keys[0]
    mixed.set_epoch(1)
    assert [key(sample) for sample in mixed] != keys[1]
    mixed.set_epoch(0)
    assert [key(sample) for sample in mixed] == keys[1]
    # few stretches are mixed with each other, so that few are decoded at once
    assert furthest_apart(keys[1], 6) < 6


def furthest_apart(keys, frames):
    """How far the windows of a stretch of so many frames lie apart in an order."""
    places = {}
    for place, (clip, start) in enumerate(keys):
        places.setdefault((clip, start // frames), []).append(place)
    return max(max(each) - min(each) for each in places.values())


def test_how_much_is_decoded_and_mixed_at_once(library, monkeypatch):
    windows = library.windows(length=10, stride=1, fps=60)
    longest = max(range(len(windows._stretches)), key=lambda i: np.diff(windows._starts)[i])
    assert len(windows._decoded(longest).motion) == 63 + 10
    monkeypatch.setattr(motion_windows, "STRETCH_WINDOWS", 2)
    mixed = library.windows(length=10, stride=1, fps=60, seed=0)
    clips = np.searchsorted(mixed._starts, mixed._order, side="right")
    apart = [np.ptp(np.flatnonzero(clips == each)) for each in np.unique(clips)]
    assert 48 < max(apart) < 64


def test_the_cache_has_the_size_that_is_said(library, monkeypatch):
    decoded = []
    whole = MotionWindows._decode
    monkeypatch.setattr(
        MotionWindows, "_decode", lambda self, *at: decoded.append(at) or whole(self, *at)
    )
    for cache_mb, times in ((100, 1), (0, 2)):
        windows = library.windows(length=10, stride=4, cache_mb=cache_mb)
        decoded.clear()
        before = [sample["motion"] for sample in windows]
        assert all(np.array_equal(a, b["motion"]) for a, b in zip(before, windows, strict=True))
        assert len(decoded) == times * len(windows.clips)
        assert windows._kept == sum(
            f.motion.nbytes + f.root.nbytes for f in windows._cache.values()
        )


def test_samples_are_the_callers_own(windows):
    windows[0]["motion"][:] = 7
    assert not (windows[0]["motion"] == 7).any()


def test_subjects_are_never_parted(windows):
    train, test = windows.split(0.3, seed=1)
    assert len(train) + len(test) == len(windows)
    who = [{part.subjects[sample["clip"]] for sample in part} for part in (train, test)]
    assert not who[0] & who[1]
    assert who[0] | who[1] == {"p1", "p2", "p3"}
    assert 0.2 < len(test) / len(windows) < 0.45
    again = windows.split(0.3, seed=1)[1]
    assert [key(a) for a in again] == [key(b) for b in test]
    of_one = windows.of_subjects(["p2"])
    assert {windows.subjects[sample["clip"]] for sample in of_one} == {"p2"}
    with pytest.raises(LibraryError, match="two or more subjects"):
        of_one.split()
    assert all(len(part) for part in of_one.split(by="clip"))
    with pytest.raises(LibraryError, match="no windows of subjects nobody"):
        windows.of_subjects(["nobody"])
    with pytest.raises(ClipError, match="between 0 and 1"):
        windows.split(1.0)


def first_of(windows):
    return windows[0]["motion"]


def test_workers_open_the_library_by_themselves(windows):
    expected = windows[0]["motion"]
    again = pickle.loads(pickle.dumps(windows))
    assert again._library is None
    assert not again._cache
    assert np.array_equal(again[0]["motion"], expected)
    with ProcessPoolExecutor(1, mp_context=get_context("fork")) as pool:
        assert np.array_equal(pool.submit(first_of, windows).result(), expected)
    windows.close()
    assert np.array_equal(windows[0]["motion"], expected)


def test_a_forked_process_uses_no_open_file_of_its_parent(windows, monkeypatch):
    windows[0]
    opened = windows._library
    monkeypatch.setattr("os.getpid", lambda: -1)
    windows[0]
    assert windows._library is not opened
    windows.close()  # its own, while it is that process
    opened.close()


def test_batches_without_torch(windows):
    batch = windows.batch([0, 5, 2])
    assert batch["motion"].shape == (3, 10, *windows[0]["motion"].shape[1:])
    assert batch["start"].tolist() == [windows[i]["start"] for i in (0, 5, 2)]


def test_clips_can_be_chosen(library):
    walks = library.windows(length=10, label="walk")
    assert walks.classes == ("walk",)
    assert "from 3 clips" in repr(walks)


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"length": 45}, r"45 frames at 30 Hz or more \(1.50 s\), but 3 of 6 are shorter: p1_1"),
        ({"length": 500, "short": "skip"}, "6 of 6 are shorter"),
        ({"length": 0}, "positive length"),
        ({"stride": -1}, "positive stride"),
        ({"fps": 0}, "positive rate"),
        ({"features": "euler"}, "positions, quaternions, 6d, canonical, but got 'euler'"),
        ({"short": "pad"}, "'error' or 'skip'"),
    ],
)
def test_what_cannot_be_is_told(library, said, message):
    with pytest.raises(ClipError, match=message):
        library.windows(**{"length": 10} | said)


def test_short_clips_can_be_left_out(library):
    windows = library.windows(length=45, short="skip")
    assert set(windows.clips) == {"p1_2", "p2_2", "p3_2"}


def test_clips_of_other_joints_are_told(small_library_template):  # noqa: F811
    with Library(small_library_template) as mixed:
        with pytest.raises(ClipError, match=r"01/both has 31 \(acclaim\) and 02_02 has 38 \(bvh\)"):
            mixed.windows(length=10)
        assert mixed.windows(length=10, features="canonical")[0]["motion"].shape == (10, 18, 3)


def test_an_unknown_class_has_no_windows(library):
    with pytest.raises(LibraryError, match="no clip to take windows from"):
        library.windows(label="swim")


def test_what_is_no_window_is_refused(library, windows):
    for ask, said in (
        (lambda: windows[0:3], r"batch\(range\(8\)\)"),
        (lambda: windows[1.5], "the number of one window"),
        (lambda: windows.batch([]), "got none"),
        (lambda: library.windows(length=10, seed="a"), "as seed, but got 'a'"),
        (lambda: library.windows(length="10"), "a positive length"),
        (lambda: library.windows(where="style=old"), "a dict as where"),
        (lambda: library.windows(where={"style": "old"}), "a column out of subject"),
        (lambda: library.windows(length=45), "short='skip'"),
    ):
        with pytest.raises(MocapdbError, match=said):
            ask()
    with pytest.raises(MocapdbError, match=r"Take a shorter window\.$"):
        library.windows(length=10**6, short="skip")
