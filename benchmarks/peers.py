"""mocapdb beside what one would pick instead, task by task, in one run: what `make bench` prints.

    python benchmarks/peers.py [--python .venv-peers/bin/python] [-o FOLDER] [--only TASK ...]

The peers run in an environment of their own, by `peers_worker.py`; mocapdb needs none of them. Ours
and theirs take turns on the same motion, and each ratio is the median over the turns; all seconds
are processor time, of one thread where a library lets us say so. Clips are CMU's and HDM05's where
there are some (MOCAPDB_CORPUS, else ../shared/corpus), else synthetic. A ratio over 1 says that
ours is better, whatever is counted. With -o the table is written as Markdown and CSV.
"""

from __future__ import annotations

import argparse
import csv
import json
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from statistics import median
from typing import Any

import _one_thread  # noqa: F401 - before numpy and numba load
import numpy as np
from _corpus import corpus_folder

from mocapdb import read_clip
from mocapdb.base.machine import measured_on
from mocapdb.cleaning import clean_clip
from mocapdb.cleaning.evaluation import Trial, make_trials
from mocapdb.cleaning.local_rotations import local_rotations, motion_texture
from mocapdb.cleaning.neighbours.nearest_words import find_neighbours
from mocapdb.cleaning.tuning import SOURCE_FRAMES, TARGET_FRAMES
from mocapdb.compression import Target, decode, encode
from mocapdb.corpus import synthetic
from mocapdb.cycles import extract_cycle
from mocapdb.cycles.phase.circular_coordinates import find_coordinates
from mocapdb.cycles.phase.laps import fit_laps, forwards, unwrapped
from mocapdb.cycles.phase.pose_cloud import (
    Embedding,
    aligned_positions,
    delay_embedding,
    principal_axes,
)
from mocapdb.errors import CycleError
from mocapdb.indexing import MotionIndex, Query, canonical_motion
from mocapdb.indexing.canonical.canonical_motion import CanonicalMotion
from mocapdb.indexing.search.clip_search import whole_distances
from mocapdb.indexing.search.stretch_search import search
from mocapdb.io import write_clip
from mocapdb.motion.clip import Clip
from mocapdb.motion.quaternions import angles_deg, continuous
from mocapdb.motion.skin import motion_error

HERE = Path(__file__).parent
WORKER = HERE / "peers_worker.py"
ACL = HERE / "acl_2_1_measured.csv"
PACKAGES = ["pybvh", "bvhio", "stumpy", "dtaidistance", "dreimac", "zstandard", "blosc2", "scipy"]
TURNS, SLOW_TURNS, SLOW_S = 7, 2, 2.0
MEAN_1_MM = Target("mean_mm", 1.0, joint_share=0)
SEARCHED_FRAMES = 60_000
WORD_PAIRS = 2000
QUERY_S = 1.5
WARPED_HZ = 24.0
DEGREES_A_UNIT = 5.0  # of quantised channels: how many degrees weigh as much as a unit of length
KINDS = ("walk", "run", "hop", "box", "wave", "squat")


@dataclass(frozen=True)
class Line:
    """A row of the table; figures with their unit, the ratio over 1 where ours is better."""

    task: str
    unit: str
    ours: str
    peer: str
    theirs: str
    ratio: str
    quality: str


class Peers:
    """The process that runs the peers, and what it has."""

    def __init__(self, python: str) -> None:
        self._process = subprocess.Popen(
            [python, str(WORKER)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.versions = self.ask("versions", packages=PACKAGES)

    def ask(self, call: str, **request: Any) -> dict[str, Any]:
        """Return the answer to a request."""
        assert self._process.stdin is not None and self._process.stdout is not None
        print(json.dumps({"call": call, **request}), file=self._process.stdin, flush=True)
        answer = self._process.stdout.readline()
        if not answer:
            raise SystemExit("The peers' process ended. Make its environment anew: make peers.")
        return dict(json.loads(answer))

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()


@dataclass(frozen=True)
class Bench:
    """What every task is given."""

    peers: Peers
    folder: Path
    corpus: Path | None

    def saved(self, name: str, values: np.ndarray) -> str:
        """Put an array where the peers find it."""
        path = self.folder / f"{name}.npy"
        np.save(path, values)
        return str(path)

    def turns(
        self, ours: Callable[[], object], call: str, **request: Any
    ) -> tuple[float, float, float, dict[str, Any]] | str:
        """Return seconds of ours and theirs, the median ratio of both, and the last answer.

        The first turn compiles and counts for nothing. A text says what is missing.
        """
        answer = self.peers.ask(call, **request)
        if "missing" in answer:
            return str(answer["missing"])
        ours()
        own: list[float] = []
        other: list[float] = []
        while len(own) < (SLOW_TURNS if sum(own) + sum(other) > SLOW_S else TURNS):
            own.append(processor_time(ours))
            answer = self.peers.ask(call, **request)
            other.append(float(answer["seconds"]))
        ratio = median(b / a for a, b in zip(own, other, strict=True))
        return median(own), median(other), ratio, answer


def processor_time(work: Callable[[], object]) -> float:
    start = time.process_time()
    work()
    return max(time.process_time() - start, 1e-9)


def absent(task: str, peer: str, why: str) -> Line:
    return Line(task, "", "", peer, "", "", f"not measured: {why}")


# -- the clips ----------------------------------------------------------------------------------


def some_clips(corpus: Path | None) -> dict[str, Clip]:
    """Return a walk, a run and a dance of CMU's, or synthetic clips."""
    paths = {
        "walk": "cmu/asfamc/07/07_01.amc", "run": "cmu/asfamc/02/02_03.amc",
        "dance": "cmu/asfamc/05/05_06.amc",
    }  # fmt: skip
    found = {
        kind: read_clip(corpus / path)[:1500]
        for kind, path in paths.items()
        if corpus is not None and (corpus / path).is_file()
    }
    return found or {
        kind: synthetic.make_clip(kind, seed=1, duration_s=8, sensor_noise_deg=0.1)
        for kind in ("walk", "run", "box")
    }


def gaits(corpus: Path | None) -> list[Clip]:
    """Return walks and runs of several people."""
    names = ("02/02_01", "02/02_02", "02/02_03", "07/07_01", "07/07_02", "07/07_04")
    found = [
        read_clip(path)
        for name in names
        if corpus is not None and (path := corpus / f"cmu/asfamc/{name}.amc").is_file()
    ]
    return found or [
        synthetic.make_clip(
            kind, seed=seed, n_cycles=3.4, period_jitter=0.02, sensor_noise_deg=0.3
        )
        for seed, kind in enumerate(("walk", "walk", "walk", "run", "run"))
    ]  # fmt: skip


def labelled(corpus: Path | None) -> tuple[list[Clip], list[str], list[str]]:
    """Return short clips of single actions, what each is, and who performs it."""
    folder = None if corpus is None else corpus / "hdm05" / "cut"
    paths = sorted(folder.glob("HDM_*_*.amc")) if folder else []
    if paths:
        words = [path.stem.split("_") for path in paths]
        clips = [read_clip(path) for path in paths]
        return clips, [word[2] for word in words], [word[1] for word in words]
    made = [
        (
            synthetic.make_clip(
                kind, seed=10 * person + take, duration_s=2.0, phase_noise=0.2,
                sensor_noise_deg=0.5, skeleton=synthetic.make_skeleton(1.6 + 0.1 * person),
            ),
            kind,
            str(person),
        )
        for person in range(4)
        for kind in KINDS
        for take in range(2)
    ]  # fmt: skip
    clips, kinds, people = (list(each) for each in zip(*made, strict=True))
    return clips, kinds, people


# -- the tasks ----------------------------------------------------------------------------------


def reading(bench: Bench) -> Iterator[Line]:
    """BVH files read, and the features that pybvh has too."""
    path = bench.folder / "take.bvh"
    clip = max(some_clips(bench.corpus).values(), key=len)
    write_clip(clip, path)
    size_mb = path.stat().st_size / 1e6
    task = f"read BVH, {size_mb:.1f} MB"
    for peer in ("pybvh", "bvhio"):
        found = bench.turns(lambda: read_clip(path), f"read_{peer}", path=str(path))
        if isinstance(found, str):
            yield absent(task, peer, found)
            continue
        own, other, ratio, _ = found
        quality = ""
        if peer == "pybvh":
            there = str(bench.folder / "places.npy")
            bench.peers.ask("pybvh_features", path=str(path), what="positions", out=there)
            ours = read_clip(path).positions("file", "file")
            theirs = np.load(there)
            if theirs.shape == ours.shape:
                off = np.linalg.norm(ours - theirs, axis=-1).max() / clip.skeleton.height
                quality = f"positions agree to {off:.0e} of the height"
        yield Line(
            task, "MB/s", f"{size_mb / own:.1f}", peer, f"{size_mb / other:.1f}", f"{ratio:.1f}",
            quality,
        )  # fmt: skip
    took = read_clip(path)

    def fresh() -> Clip:
        return took.replace(name=took.name)

    works: dict[str, Callable[[], object]] = {
        "positions": lambda: fresh().positions(),
        "velocities": lambda: fresh().velocities(),
        "contacts": lambda: fresh().contacts(),
        "6d": lambda: fresh().rotations(form="6d"),
    }
    for what, work in works.items():
        task = f"descriptor: {what}"
        found = bench.turns(work, "pybvh_features", path=str(path), what=what)
        if isinstance(found, str):
            yield absent(task, "pybvh", found)
            continue
        own, other, ratio, _ = found
        yield Line(
            task, "frames/s", f"{len(took) / own:,.0f}", "pybvh", f"{len(took) / other:,.0f}",
            f"{ratio:.1f}", "",
        )  # fmt: skip


def searching(bench: Bench) -> Iterator[Line]:
    """A stretch looked for in many frames, and whole clips ordered by likeness."""
    clips, labels, people = labelled(bench.corpus)
    motions = [canonical_motion(clip) for clip in clips]
    index = MotionIndex.of(motions)
    long = max(motions, key=len)
    n_frames = min(round(QUERY_S * long.fps), len(long))
    own = slice((len(long) - n_frames) // 2, (len(long) + n_frames) // 2)
    part = CanonicalMotion(long.pose[own], long.root[own], long.yaw[own], long.fps)
    query = Query([part])
    values = index.frames.values(slice(None)).astype(np.float64)
    repeats = max(1, SEARCHED_FRAMES // len(values))
    many = MotionIndex.of(motions * repeats, index.space)
    series = bench.saved("series", np.tile(values, (repeats, 1)))
    template = bench.saved("query", query.templates(index.space)[0].frames.astype(np.float64))
    task = f"find a stretch of {QUERY_S:g} s in {len(values) * repeats:,} frames"
    for peer, call, said in (
        ("stumpy.mass", "stumpy_mass", "it does not warp"),
        ("dtaidistance", "dtaidistance_search", "warps without limits, in C"),
    ):
        found = bench.turns(
            lambda: search(many, query, exact=True, threads=1), call, query=template, series=series
        )
        if isinstance(found, str):
            yield absent(task, peer, found)
            continue
        mine, other, ratio, _ = found
        yield Line(
            task, "ms", f"{1e3 * mine:.0f}", peer, f"{1e3 * other:.0f}", f"{ratio:.1f}", said
        )
    yield from _orders(bench, clips, motions, labels, people)


def _orders(
    bench: Bench,
    clips: list[Clip],
    motions: list[CanonicalMotion],
    labels: list[str],
    people: list[str],
) -> Iterator[Line]:
    """Whole clips ordered by likeness, one's own left out: mean average precision."""
    index = MotionIndex.of(motions)
    folder = bench.folder / "warped"
    folder.mkdir()
    for i, clip in enumerate(clips):
        step = max(1, round(clip.fps / WARPED_HZ))
        places = aligned_positions(clip)[::step].reshape(-1, 3 * clip.skeleton.n_joints)
        np.save(folder / f"{i}.npy", places * clip.skeleton.metres_per_unit)
    task = f"order {len(clips)} clips by likeness, other people's first"
    out = str(bench.folder / "warped.npy")
    answer = bench.peers.ask("plain_warping", folder=str(folder), count=len(clips), out=out)
    if "missing" in answer:
        yield absent(task, "plain warping", answer["missing"])
        return
    who, what = np.array(people), np.array(labels)
    start = time.process_time()
    ours = np.stack(
        [whole_distances(index, own, who != one) for own, one in zip(motions, who, strict=True)]
    )
    mine = time.process_time() - start
    scores = {}
    for name, distances in {"ours": ours, "theirs": np.load(out)}.items():
        precisions = []
        for i in range(len(clips)):
            others = np.flatnonzero(who != who[i])
            right = what[others[np.argsort(distances[i, others], kind="stable")]] == what[i]
            if right.any():
                at = np.flatnonzero(right)
                precisions.append(float(np.mean(np.arange(1, len(at) + 1) / (at + 1))))
        scores[name] = float(np.mean(precisions))
    peer = "plain warping (dtaidistance)"
    misses = (1 - scores["theirs"]) / max(1 - scores["ours"], 1e-9)
    yield Line(
        task, "mAP", f"{scores['ours']:.3f}", peer, f"{scores['theirs']:.3f}", f"{misses:.1f}",
        "ratio of what is missed (1 - mAP)",
    )  # fmt: skip
    per_query = 1e3 / len(clips)
    yield Line(
        task, "ms a query", f"{per_query * mine:.1f}", peer,
        f"{per_query * 2 * answer['seconds']:.1f}", f"{2 * answer['seconds'] / mine:.1f}",
        "one run of each",
    )  # fmt: skip


def circling(bench: Bench) -> Iterator[Line]:
    """Circular coordinates of walks: how fast, and whether laps are counted right."""
    task = "circular coordinates"
    ratios, own_speed, other_speed, off = [], [], [], {"ours": [], "theirs": []}
    clips = gaits(bench.corpus)[:4]
    for clip in clips:
        poses = Embedding().cloud(clip)
        period = extract_cycle(clip).period_frames
        cloud = delay_embedding(poses, 2, max(1, round(period / 8)))
        out = str(bench.folder / "circle.npy")
        found = bench.turns(
            lambda poses=poses, period=period, clip=clip: find_coordinates(poses, period, clip.fps),
            "dreimac_coordinates",
            cloud=bench.saved("cloud", cloud),
            out=out,
        )
        if isinstance(found, str):
            yield absent(task, "dreimac", found)
            return
        own, other, ratio, _ = found
        ratios.append(ratio)
        own_speed.append(len(cloud) / own)
        other_speed.append(len(cloud) / other)
        laps = len(clip) / period
        topology = find_coordinates(poses, period, clip.fps)
        off["ours"].append(abs(len(clip) / topology.period_frames / laps - 1))
        turns = forwards(np.load(out) / (2 * np.pi) % 1.0)
        off["theirs"].append(
            abs(len(cloud) * fit_laps(unwrapped(turns))[0] / (laps * len(cloud) / len(clip)) - 1)
        )
    worst = {name: 100 * max(values) for name, values in off.items()}
    yield Line(
        task, "frames/s", f"{median(own_speed):,.0f}", "dreimac, 100 landmarks",
        f"{median(other_speed):,.0f}", f"{median(ratios):.0f}",
        f"laps off by {worst['ours']:.1f} % at most, theirs by {worst['theirs']:.1f} %, "
        f"{len(clips)} clips",
    )  # fmt: skip


def packing(bench: Bench) -> Iterator[Line]:
    """Bytes a frame, and how fast frames come back."""
    clips = some_clips(bench.corpus)
    payloads = {kind: encode(clip, MEAN_1_MM).data for kind, clip in clips.items()}
    frames = sum(map(len, clips.values()))
    own = sum(map(len, payloads.values())) / frames

    def unpack() -> None:
        for kind, clip in clips.items():
            decode(payloads[kind], clip.skeleton)

    unpack()
    for how, prepared in (
        ("float32", {kind: clip.channels.astype(np.float32) for kind, clip in clips.items()}),
        ("whole steps, 1 mm", {kind: in_steps(clip) for kind, clip in clips.items()}),
    ):
        for codec in ("zlib", "zstd", "blosc2"):
            size, packed_s, seconds = 0, 0.0, 0.0
            for kind, values in prepared.items():
                where = bench.saved(f"packed_{kind}", values)
                answer = bench.peers.ask("pack", codec=codec, values=where)
                if "missing" in answer:
                    yield absent("store motion, 1 mm", codec, answer["missing"])
                    break
                size += answer["bytes"]
                packed_s += answer["seconds"]
                seconds += answer["unpack_seconds"]
            else:
                theirs = size / frames
                back = median(processor_time(unpack) for _ in range(3))
                yield Line(
                    "store motion, mean error 1 mm", "bytes/frame", f"{own:.2f}",
                    f"{codec} of {how}", f"{theirs:.2f}", f"{theirs / own:.1f}",
                    f"unpacked at {frames / back:,.0f} frames/s, theirs at "
                    f"{frames / max(seconds, 1e-9):,.0f}",
                )  # fmt: skip
    for representation in ("channels", "aligned"):
        options = {"codec": "okane", "representation": representation}
        made = [encode(clip, MEAN_1_MM, **options) for clip in clips.values()]
        size = sum(len(payload.data) for payload in made)
        raw = sum(payload.codec == "raw" for payload in made)
        yield Line(
            "store motion, mean error 1 mm", "bytes/frame", f"{own:.2f}",
            f"O'Kane's, {representation} (in mocapdb)", f"{size / frames:.2f}",
            f"{size / frames / own:.1f}",
            f"{raw} of {len(made)} clips raw: it takes no less" if raw else "",
        )  # fmt: skip
    yield from _beside_acl(bench.corpus)


def in_steps(clip: Clip) -> np.ndarray:
    """Return channels as whole steps, differences from frame to frame, at a mean error of 1 mm."""
    turns = clip.skeleton.rotation_channels
    scale = np.ones(clip.skeleton.n_channels)
    scale[turns] = DEGREES_A_UNIT

    def steps(size: float) -> np.ndarray:
        return np.rint(clip.channels / (size * scale))

    def error_mm(size: float) -> float:
        made = clip.replace(channels=steps(size) * size * scale)
        return float(motion_error(clip, made).vertices.mean)

    low, high = 1e-5, 10.0
    for _ in range(14):
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if error_mm(middle) <= 1.0 else (low, middle)
    whole = steps(low)
    return np.diff(whole, axis=0, prepend=0.0).astype(np.int32).T.copy()


def _beside_acl(corpus: Path | None) -> Iterator[Line]:
    """ACL 2.1 as it was measured on CMU's clips, at its own largest error."""
    ratios: dict[str, list[tuple[float, float]]] = {}
    with ACL.open(encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    for row in rows:
        path = corpus and corpus / f"cmu/asfamc/{row['clip'][:2]}/{row['clip']}.amc"
        if not path or not path.is_file() or row["clip"] not in ("02_01", "02_03"):
            continue
        clip = read_clip(path)
        target = Target("shell_max_mm", 10.0 * float(row["max_cm"]), joint_share=0)
        own = len(encode(clip, target).data) / len(clip)
        ratios.setdefault(row["acl_precision_cm"], []).append(
            (own, float(row["acl_bytes_per_frame"]))
        )
    if not ratios:
        yield absent("store motion, ACL's largest error", "ACL 2.1", "its clips are not at hand")
    for precision, pairs in ratios.items():
        ours, theirs = (float(np.mean(each)) for each in zip(*pairs, strict=True))
        ratio = float(np.exp(np.mean([np.log(b / a) for a, b in pairs])))
        yield Line(
            f"store motion, ACL's largest error at {precision} cm", "bytes/frame", f"{ours:.2f}",
            "ACL 2.1, measured points", f"{theirs:.2f}", f"{ratio:.2f}",
            f"{len(pairs)} clips; ACL ran elsewhere",
        )  # fmt: skip


def cycling(bench: Bench) -> Iterator[Line]:
    """Periods, and laps that a cycle was made without, beside a crossfade."""
    from bench_loops import laps_left_out

    made = [
        synthetic.make(
            kind, seed=seed, n_cycles=2.6, period_jitter=0.02, phase_noise=0.2,
            sensor_noise_deg=0.5,
        )
        for seed in range(4)
        for kind in ("walk", "run")
    ]  # fmt: skip
    ours, theirs, own_s, other_s = [], [], 0.0, 0.0
    for clip, truth in made:
        flat = principal_axes(aligned_positions(clip).reshape(len(clip), -1), 8)
        answer = bench.peers.ask("autocorrelation", cloud=bench.saved("gait", flat), fps=clip.fps)
        start = time.process_time()
        found = extract_cycle(clip)
        own_s += time.process_time() - start
        other_s += answer["seconds"]
        ours.append(abs(found.period_frames / truth.period_frames - 1))
        theirs.append(abs(answer["period"] / truth.period_frames - 1))
    mine, other = 100 * float(np.mean(ours)), 100 * float(np.nanmean(theirs))
    yield Line(
        "period of a gait, synthetic, 2.6 laps", "% off", f"{mine:.2f}",
        "autocorrelation, first high peak", f"{other:.2f}", f"{other / max(mine, 1e-9):.1f}",
        f"mean of {len(made)} clips; ours takes {own_s / max(other_s, 1e-9):.0f} times its time, "
        "and makes the cycle",
    )  # fmt: skip
    errors = []
    for clip in gaits(bench.corpus):
        try:
            errors += list(laps_left_out(extract_cycle(clip)))
        except CycleError:
            continue
    task = "a lap that the cycle was made without"
    if not errors:
        yield absent(task, "crossfade", "no clip has laps enough")
        return
    cycle, _, _, crossfade = np.mean(errors, axis=0)
    yield Line(
        task, "rad off", f"{cycle:.3f}", "the lap beside it, crossfaded", f"{crossfade:.3f}",
        f"{crossfade / cycle:.2f}", f"{len(errors)} laps",
    )  # fmt: skip


class Judged:
    """What each way to repair leaves of faults, and what it changes elsewhere."""

    def __init__(self) -> None:
        self.left: dict[str, list[float]] = {}
        self.elsewhere: dict[str, list[float]] = {}
        self.seconds: dict[str, float] = {}

    def add(self, name: str, trial: Trial, quat_xyzw: np.ndarray, spent: float) -> None:
        """Count rotations (F, K, 4) that a way made of a trial."""
        right = local_rotations(trial.original)
        rows = {joint: row for row, joint in enumerate(right.joints.tolist())}
        apart = angles_deg(right.quat_xyzw, quat_xyzw)
        spans = [
            float(apart[fault.start : fault.end, rows[fault.joint]].mean())
            for fault in trial.faults
        ]
        untouched = ~(trial.mask | trial.ignored)[:, right.joints]
        self.left.setdefault(name, []).extend(spans)
        self.elsewhere.setdefault(name, []).append(float(apart[untouched].mean()))
        self.seconds[name] = self.seconds.get(name, 0.0) + spent


def faulty(corpus: Path | None) -> list[Trial]:
    """Return clips with faults: CMU's of subjects that the detector was not fitted on."""
    names = ("02/02_01", "02/02_02", "02/02_07", "07/07_04", "13/13_29", "13/13_30", "49/49_04")
    clips = [
        read_clip(path)[:1500]
        for name in names
        if corpus is not None and (path := corpus / f"cmu/asfamc/{name}.amc").is_file()
    ] or [
        synthetic.make_clip(kind, seed=seed, duration_s=12, sensor_noise_deg=0.05)
        for seed, kind in enumerate(KINDS)
    ]
    return make_trials(clips, seed=1, seconds_per_fault=2.0)


def cleaning(bench: Bench) -> Iterator[Line]:
    """Faults repaired, and what is changed where nothing is wrong."""
    trials, judged = faulty(bench.corpus), Judged()
    clean_clip(trials[0].clip[:240])  # compiles
    filters = ("Butterworth", "Savitzky-Golay", "Hampel")
    for trial in trials:
        captured = local_rotations(trial.clip).quat_xyzw
        judged.add("as captured", trial, captured, 0.0)
        start = time.process_time()
        cleaned = clean_clip(trial.clip).clip
        spent = time.process_time() - start
        judged.add("ours", trial, local_rotations(cleaned).quat_xyzw, spent)
        quats = continuous(captured)
        columns = bench.saved("faulty", quats.reshape(len(quats), -1))
        for name in filters:
            out = str(bench.folder / "smoothed.npy")
            answer = bench.peers.ask(
                "smooth", name=name, values=columns, fps=trial.clip.fps, out=out
            )
            if "missing" not in answer:
                smooth = np.load(out).reshape(quats.shape)
                smooth /= np.maximum(np.linalg.norm(smooth, axis=-1, keepdims=True), 1e-12)
                judged.add(name, trial, smooth, answer["seconds"])
    yield _words(bench, trials)
    left = {name: float(np.mean(values)) for name, values in judged.left.items()}
    elsewhere = {name: float(np.mean(values)) for name, values in judged.elsewhere.items()}
    n_faults = len(judged.left["ours"])
    for name in filters:
        task = f"repair {n_faults} faults of {left['as captured']:.0f} degrees"
        if name not in left:
            yield absent(task, name, "scipy is missing")
            continue
        yield Line(
            task, "deg left", f"{left['ours']:.1f}", name, f"{left[name]:.1f}",
            f"{left[name] / left['ours']:.1f}",
            f"changed elsewhere {elsewhere['ours']:.2f} deg, theirs {elsewhere[name]:.2f}; ours "
            f"takes {judged.seconds['ours']:.1f} s, theirs {judged.seconds[name]:.2f}",
        )  # fmt: skip


def _words(bench: Bench, trials: list[Trial]) -> Line:
    """Motion-words compared with each other: the search that cleaning stands on."""
    texture = motion_texture(max((trial.original for trial in trials), key=len))
    columns = bench.saved("texture", texture.quat_xyzw.reshape(len(texture), -1))
    rng = np.random.default_rng(0)
    first, second = rng.integers(0, len(texture) - TARGET_FRAMES, (2, WORD_PAIRS)).tolist()
    task = "compare words of motion"
    found = bench.turns(
        lambda: find_neighbours(texture, [texture]), "warp_words", values=columns, first=first,
        second=second, lengths=[SOURCE_FRAMES, TARGET_FRAMES],
    )  # fmt: skip
    if isinstance(found, str):
        return absent(task, "dtaidistance", found)
    own, other, ratio, _ = found
    n_pairs = len(find_neighbours(texture, [texture]).starts) * (len(texture) - TARGET_FRAMES + 1)
    per_pair = n_pairs / WORD_PAIRS
    return Line(
        task, "ns a pair", f"{1e9 * own / n_pairs:.0f}", "dtaidistance, in C",
        f"{1e9 * other / WORD_PAIRS:,.0f}", f"{ratio * per_pair:.0f}",
        "theirs drops no joints and keeps no nearest",
    )  # fmt: skip


TASKS: dict[str, Callable[[Bench], Iterator[Line]]] = {
    "readers": reading,
    "search": searching,
    "circles": circling,
    "codec": packing,
    "cycles": cycling,
    "cleaning": cleaning,
}


# -- the table ----------------------------------------------------------------------------------

TITLES = ("task", "unit", "ours", "peer", "peer's", "times better", "quality, or why not")


def markdown(lines: list[Line], told: dict[str, str]) -> str:
    """Return the table as Markdown, below what it was measured on."""
    about = ", ".join(f"{name} {value}" for name, value in told.items() if name != "date")
    rows = [TITLES, ("---", "---", "---:", "---", "---:", "---:", "---")]
    rows += [astuple(line) for line in lines]
    table = "\n".join("| " + " | ".join(row) + " |" for row in rows)
    return f"Measured {told['date']}: {about}.\n\n{table}\n"


def write(folder: Path, lines: list[Line], told: dict[str, str]) -> None:
    """Write the table as Markdown and CSV."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "peers.md").write_text(markdown(lines, told), encoding="utf-8")
    with (folder / "peers.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*(field.name for field in fields(Line)), *told])
        writer.writerows([*astuple(line), *told.values()] for line in lines)


def main() -> None:
    parser = argparse.ArgumentParser(description="mocapdb beside what one would pick instead.")
    parser.add_argument("--python", default=".venv-peers/bin/python", help="of the peers")
    parser.add_argument("-o", "--output", type=Path, help="folder for peers.md and peers.csv")
    parser.add_argument("--only", nargs="+", choices=list(TASKS), default=list(TASKS))
    parser.add_argument("--synthetic", action="store_true", help="take no real clips")
    options = parser.parse_args()
    if not Path(options.python).is_file():
        sys.exit(f"Expected the peers' Python at {options.python}. Make it with: make peers")
    warnings.simplefilter("ignore")
    corpus = corpus_folder()
    use = None if options.synthetic or not corpus.is_dir() else corpus
    peers = Peers(options.python)
    lines: list[Line] = []
    with tempfile.TemporaryDirectory() as folder:
        for name in options.only:
            own = Path(folder, name)
            own.mkdir()
            start = time.monotonic()
            lines += TASKS[name](Bench(peers, own, use))
            print(f"{name}: {time.monotonic() - start:.0f} s", file=sys.stderr, flush=True)
    versions = {name: text or "not there" for name, text in peers.versions["versions"].items()}
    peers.close()
    clips = "CMU's and HDM05's where named so, else synthetic" if use else "synthetic"
    told = measured_on() | versions | {"peers' python": peers.versions["python"], "clips": clips}
    print(markdown(lines, told))
    if options.output is not None:
        write(options.output, lines, told)


if __name__ == "__main__":
    main()
