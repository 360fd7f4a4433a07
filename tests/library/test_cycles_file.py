import shutil

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.cycles import average_cycles, extract_cycle
from mocapdb.errors import LibraryError
from mocapdb.library import Library
from mocapdb.library.cycles_file import list_cycles, read_cycle, write_cycle
from mocapdb.library.layout import CYCLES_FILE, LOCK_FILE
from mocapdb.library.searching.class_cycles import class_cycle


@pytest.fixture(scope="module")
def walk():
    cycles = [
        extract_cycle(synthetic.make_clip("walk", seed=seed, n_cycles=2.5)).cycle
        for seed in range(3)
    ]
    return average_cycles(cycles, "walk")


def test_what_is_written_is_read_again(tmp_path, walk):
    assert list_cycles(tmp_path) == []
    path = write_cycle(tmp_path, walk)
    assert path == tmp_path / CYCLES_FILE
    again = read_cycle(tmp_path, "walk")
    assert again.members == walk.members
    assert again.cycle.skeleton == walk.cycle.skeleton
    assert again.cycle.period_s == walk.cycle.period_s
    for name in ("columns", "sway", "advance", "translations"):
        np.testing.assert_array_equal(getattr(again.cycle, name), getattr(walk.cycle, name))
    np.testing.assert_array_equal(again.spread_rad, walk.spread_rad)


def test_a_class_is_replaced_and_others_stay(tmp_path, walk):
    from dataclasses import replace

    write_cycle(tmp_path, walk)
    write_cycle(tmp_path, replace(walk, cycle=replace(walk.cycle, name="run")))
    write_cycle(tmp_path, replace(walk, cycle=replace(walk.cycle, period_s=2.0)))
    rows = {row["class"]: row["period_s"] for row in list_cycles(tmp_path)}
    assert rows == {"run": walk.cycle.period_s, "walk": 2.0}
    assert {path.name for path in tmp_path.iterdir()} == {CYCLES_FILE, LOCK_FILE}


def test_cycles_written_at_once_are_all_kept(tmp_path, walk):
    from concurrent.futures import ThreadPoolExecutor
    from dataclasses import replace

    names = [f"walk {number}" for number in range(12)]
    each = [replace(walk, cycle=replace(walk.cycle, name=name)) for name in names]
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda cycle: write_cycle(tmp_path, cycle), each))
    assert sorted(row["class"] for row in list_cycles(tmp_path)) == sorted(names)


def test_names_that_are_not_kept(tmp_path, walk):
    write_cycle(tmp_path, walk)
    with pytest.raises(LibraryError, match="out of walk"):
        read_cycle(tmp_path, "run")


@pytest.mark.parametrize("spoil", [lambda data: b"no hdf5", lambda data: data[: len(data) // 2]])
def test_a_damaged_file_is_said_to_be_one(tmp_path, walk, spoil):
    path = write_cycle(tmp_path, walk)
    data = path.read_bytes()
    path.write_bytes(spoil(data))
    for act in (
        lambda: list_cycles(tmp_path),
        lambda: read_cycle(tmp_path, "walk"),
        lambda: write_cycle(tmp_path, walk),
    ):
        with pytest.raises(LibraryError, match="Delete the file"):
            act()


def test_a_newer_format_is_left_alone(tmp_path, walk):
    import h5py

    path = write_cycle(tmp_path, walk)
    with h5py.File(path, "r+") as file:
        file.attrs["format"] = 99
    with pytest.raises(LibraryError, match="newer mocapdb"):
        list_cycles(tmp_path)
    with pytest.raises(LibraryError, match="newer mocapdb"):
        write_cycle(tmp_path, walk)


def test_the_cycle_of_a_class_is_the_kept_one_or_made_for_now(seen_library, tmp_path):
    path = shutil.copytree(seen_library, tmp_path / "seen.mocapdb")
    with Library(path) as library:
        made = class_cycle(library, "walk", most_clips=2)
        assert len(made.members) == 2
        assert list_cycles(path) == []
        kept = class_cycle(library, "walk", most_clips=1)
        write_cycle(path, kept)
        assert class_cycle(library, "walk").members == kept.members
        with pytest.raises(LibraryError, match="a class out of"):
            class_cycle(library, "swim")
