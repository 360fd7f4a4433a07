"""Bodies: what is understood of other exporters' files, and how long that takes.

python benchmarks/bench_bodies.py

Units, axes and extents are held against ZOO.csv, joints against the tests' own table of names.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import numpy as np
from _corpus import corpus_folder, motion_files

from mocapdb.errors import MocapdbError, NoPeriodError
from mocapdb.motion.body import understand
from mocapdb.motion.foot_contacts import find_contacts
from mocapdb.motion.kinematics import forward_kinematics

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from zoo_names import CASES, extent_m, names_of, zoo_rows

from mocapdb import read_clip
from mocapdb.cycles import extract_cycle

LOCOMOTION = ("_walk_", "_run_", "_dash_")


def zoo_or_exit() -> Path:
    named = os.environ.get("MOCAPDB_ZOO")
    folder = Path(named) if named else Path(__file__).parents[2] / "shared" / "zoo"
    if not folder.is_dir():
        print(f"no files of other exporters in {folder}: set MOCAPDB_ZOO to a folder of them")
        sys.exit(0)
    return folder


def share(what: str, right: list[bool]) -> None:
    print(f"{what:44} {sum(right):4d} of {len(right)}")


def exporters(zoo: Path) -> None:
    right: dict[str, list[bool]] = {
        key: [] for key in ("unit", "up", "extent", "human", "joints", "refused")
    }
    for row in zoo_rows(zoo):
        path = zoo / row["file"]
        clip = read_clip(path)
        body = understand(clip.skeleton, clip.channels)
        if row["unit_m"]:
            right["unit"].append(
                abs(clip.skeleton.metres_per_unit / float(row["unit_m"]) - 1) < 1e-3
            )
        if row["up"]:
            right["up"].append(clip.skeleton.up == row["up"])
        if row["extent_m"]:
            right["extent"].append(abs(extent_m(clip) / float(row["extent_m"]) - 1) < 0.03)
        if row["body"] == "human":
            right["human"].append(body.is_human)
            found = {j: clip.skeleton.names[i] for j, i in body.joints.value.items()}
            told = names_of(path) or {}
            right["joints"].append(all(found.get(joint) == name for joint, name in told.items()))
        elif row["body"]:
            right["refused"].append(not body.is_human)
    share("unit in metres", right["unit"])
    share("up axis", right["up"])
    share("vertical extent within 3 %", right["extent"])
    share("people mapped", right["human"])
    share("people with every joint as named by hand", right["joints"])
    share("other bodies refused", right["refused"])


def cases(zoo: Path) -> None:
    right = []
    for case, (up, unit_m, extent) in CASES.items():
        clip = read_clip(zoo / "cases" / f"{case}.bvh")
        right.append(
            (clip.skeleton.up, clip.skeleton.metres_per_unit) == (up, unit_m)
            and abs(extent_m(clip) / extent - 1) < 0.01
        )
    share("cases as expected", right)


def locomotion(zoo: Path) -> None:
    found, feet = [], []
    for path in sorted((zoo / "bandai").glob("*.bvh")):
        if not any(word in path.name for word in LOCOMOTION):
            continue
        clip = read_clip(path)
        positions = forward_kinematics(clip.skeleton, clip.channels).positions
        contacts = find_contacts(clip.skeleton, positions, clip.fps)
        feet.append(contacts.shape[1] == 2 and bool(contacts.any(axis=0).all()))
        try:
            extract_cycle(clip)
        except NoPeriodError:
            found.append(False)
        else:
            found.append(True)
    share("walks and runs of Bandai with a cycle", found)
    share("the same with two feet that rest", feet)


def cost(folder: Path, what: str) -> None:
    times = []
    for path in motion_files(folder)[::7]:
        try:
            clip = read_clip(path)
        except MocapdbError:
            continue
        understand(clip.skeleton, clip.channels)  # compiled, and names cut into words
        start = time.perf_counter()
        understand(clip.skeleton, clip.channels)
        times.append(1000 * (time.perf_counter() - start))
    if times:
        print(f"{what:44} {np.median(times):.1f} ms a clip, at most {max(times):.1f}")


def main() -> None:
    zoo = zoo_or_exit()
    exporters(zoo)
    cases(zoo)
    locomotion(zoo)
    cost(zoo, "understanding a body, other exporters")
    if corpus_folder().is_dir():
        cost(corpus_folder(), "understanding a body, CMU and HDM05")


if __name__ == "__main__":
    main()
