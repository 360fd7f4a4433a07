"""Bodies: what is understood of other exporters' files, and how long that takes.

python benchmarks/bench_bodies.py

Units, axes and extents are held against ZOO.csv, joints against the tests' own table of names, laps
against a plot of the feet's heights, search against plain warping with that table of names.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from _corpus import corpus_folder, motion_files

from mocapdb.errors import MocapdbError, NoPeriodError
from mocapdb.motion.body import understand
from mocapdb.motion.foot_contacts import find_contacts, find_legs, foot_slide_mm, runs
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.skeleton import Skeleton

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
import bandai_search
from zoo_names import CASES, LAPS, TOO_SHORT, extent_m, names_of, zoo_rows

from mocapdb import read_clip
from mocapdb.cycles import extract_cycle

SLIDE_M = 0.05


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


def locomotion(bandai: Path) -> None:
    """Hold cycles and resting feet of walks and runs against what a plot of the feet shows."""
    found, refused, feet, slides = [], [], [], []
    for name, laps in (LAPS | TOO_SHORT).items():
        clip = read_clip(bandai / f"{name}.bvh")
        positions = forward_kinematics(clip.skeleton, clip.channels).positions
        contacts = find_contacts(clip.skeleton, positions, clip.fps)
        feet.append(contacts.shape[1] == 2 and bool(contacts.any(axis=0).all()))
        slides.append(abs(seen_slide(clip.skeleton, positions, clip.fps) - 1) < 0.2)
        try:
            cycle = extract_cycle(clip)
        except NoPeriodError:
            refused.append(name in TOO_SHORT)
        else:
            found.append(abs(cycle.laps / laps - 1) < 0.06)
    share("walks and runs of Bandai: laps as plotted", found)
    share("those without a cycle that are one lap", refused)
    share("with two feet that rest", feet)
    share("with 5 cm of slide seen within 20 %", slides)


def seen_slide(skeleton: Skeleton, positions: np.ndarray, fps: float) -> float:
    """Return the slide that is seen over that which is put into every rest of a foot."""
    sliding, away = positions.copy(), []
    contacts = find_contacts(skeleton, positions, fps)
    for leg, rests in zip(find_legs(skeleton, positions), contacts.T, strict=True):
        for rest in runs(rests):
            ramp = np.linspace(0.0, SLIDE_M, len(rest))
            away.append(abs(ramp - ramp.mean()))
            shift = ramp[:, None] / skeleton.metres_per_unit
            sliding[rest[:, None], [leg.ankle, leg.ball], 0] += shift
    seen_mm = foot_slide_mm(skeleton, sliding, find_contacts(skeleton, sliding, fps))
    return float(seen_mm / np.mean(1000 * np.concatenate(away)))


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
    locomotion(zoo / "bandai")
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "bandai.mocapdb"
        bandai_search.build(zoo / "bandai", library)
        bandai_search.across_styles(zoo / "bandai", library)
        if corpus_folder().is_dir():
            bandai_search.from_cmu(corpus_folder(), library)
    cost(zoo, "understanding a body, other exporters")
    if corpus_folder().is_dir():
        cost(corpus_folder(), "understanding a body, CMU and HDM05")


if __name__ == "__main__":
    main()
