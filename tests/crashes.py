"""Stop writers at any point, in any way, and see whether every promise is kept.

    python tests/crashes.py --points 500
    python tests/crashes.py --every fail --commands label cycle     # each call of theirs in turn

Each point is a writing command and a moment of it, in one of three ways:

``kill``   SIGKILL in one of its calls to the system
``fail``   one of these calls fails, once, with an error of the disk; SQLite's and HDF5's, too
``power``  the power goes: the command was recorded once and is replayed up to a moment; writes and
           names that it had not flushed by then are lost, torn or kept, each for itself

Then what was committed has to decode to the same bytes, nothing may be lost, and the same command
again has to lead to what it leads to undisturbed: no lock, no half-written file, no worker left. A
command that said it was done has to be, also after a loss of power. After a build the corpus may
also have moved and changed: then it is compared with a fresh build of that. A file that is written
is whole, as it was before or as it is to be.

It needs `strace`.
"""

from __future__ import annotations

import argparse
import io
import os
import random
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from functools import cache
from itertools import cycle, islice
from pathlib import Path
from typing import Any

# only a process of one thread may be forked
os.environ |= dict.fromkeys(["OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "DUCC0_NUM_THREADS"], "1")
from small_library import OPTIONS, leftovers, made_older
from traced_disk import (
    Call,
    Disk,
    Step,
    expect_strace,
    run_traced,
    tree_of,
    write_tree,
)

import mocapdb.library.building.commit_clips as committing
from mocapdb.cli import cli
from mocapdb.corpus import synthetic
from mocapdb.errors import MocapdbError
from mocapdb.io import write_clip
from mocapdb.library import Library, verify_library
from mocapdb.library.cycles_file import list_cycles
from mocapdb.library.writing import pack_shards

FILES = {
    "a.bvh": ("walk", 1), "b/c.bvh": ("run", 2), "d.bvh": ("walk", 3), "e.bvh": ("hop", 9),
    "f.bvh": ("run", 4), "g.bvh": ("walk", 5),
}  # fmt: skip
LABELS = "path,label\na.bvh,walk\nd.bvh,walk\nb/c.bvh,run\nf.bvh,run\n"
WAYS = ("kill", "power", "fail")
ERRORS = {"fcntl": ["ENOLCK"], "write": ["ENOSPC", "EIO"], "pwrite64": ["ENOSPC", "EIO"],
          "mkdir": ["ENOSPC"], "openat": ["EIO", "EMFILE", "ENOSPC"]}  # fmt: skip

State = dict[str, Any]
"""What a library or a folder of written files holds, without times."""


# -- the commands ----------------------------------------------------------------------------------


@dataclass
class Case:
    """A command, what it starts from, and what it leads to undisturbed.

    `{lib}`, `{corpus}` and `{out}` in its arguments are a library, a corpus and a folder.
    """

    name: str
    args: Sequence[object]
    start: Path
    corpus: Path
    writes_library: bool = True
    before: State = field(default_factory=dict)
    after: State = field(default_factory=dict)
    after_changed: State = field(default_factory=dict)
    steps: list[Step] = field(default_factory=list)
    calls: list[Call] = field(default_factory=list)

    def run(self, work: Path, corpus: Path | None = None) -> int:
        """Run the command in a folder that has its library; return its exit status."""
        places = {"{lib}": work / "l.mocapdb", "{corpus}": corpus or self.corpus}
        args = [str(places.get(str(each), each)) for each in self.args]
        return run([each.replace("{out}", str(work)) for each in args])


def run(args: Sequence[object]) -> int:
    """Run the command line; return its exit status."""
    try:
        cli.main([str(each) for each in args], "mocapdb")
    except SystemExit as ended:
        return int(ended.code or 0)
    return 0


@contextmanager
def quiet() -> Iterator[io.StringIO]:
    """Keep what is printed."""
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()) as said:
        yield said


def write_clips(root: Path, files: dict[str, tuple[str, int]]) -> None:
    """Write clips of (class, seed), long enough for cycles and classes."""
    for path, (kind, seed) in files.items():
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        write_clip(synthetic.make_clip(kind, seed=seed, duration_s=3.0, fps=40), root / path)


def make_cases(folder: Path, names: Sequence[str] = ()) -> list[Case]:
    """Prepare a library for every command, and record each once undisturbed."""
    committing.COMMIT_SECONDS = 0.0  # a shard and a commit for every clip
    pack_shards.JOINED_SHARDS = 3  # so that builds and `compact` join some
    os.cpu_count = lambda: 1  # no thread of a search stays behind
    corpus, grown = folder / "corpus", folder / "grown"
    write_clips(corpus, FILES)
    (corpus / "LABELS.csv").write_text(LABELS)
    shutil.copytree(corpus, grown)
    write_clips(grown, {"f.bvh": ("hop", 4), "new.bvh": ("box", 6)})  # one is replaced

    build = ("build", "{corpus}", "-o", "{lib}", *OPTIONS)
    clip, out = corpus / "a.bvh", "{out}/out"
    starts: dict[str, tuple[str, list[Sequence[object]]]] = {  # of which, and by which commands
        "nothing": ("", []),
        "built": ("", [build]),
        "replaced": ("built", [("build", grown, *build[2:])]),
        "bare": ("", [(*build, "--no-index")]),
        "older": ("bare", []),
        "full": (
            "replaced",
            [("cycle", "{lib}", "--class", "walk"), ("query", "{lib}", "a", "--save", "first")],
        ),
        "lost": ("full", []),
        "damaged": ("full", []),
        "labelled": ("built", [("classify", "{lib}", "--grow")]),
        "cleaned": ("built", [("clean", "{lib}", "--apply", "--jobs", 1)]),
    }

    @cache
    def start(name: str) -> Path:
        """Return a folder from which commands start, made when it is needed."""
        made = folder / name
        if name not in starts:  # that of a file which a command will write over
            shutil.copytree(start("built"), made)
            (made / "out").mkdir()
            (made / "out" / name).write_bytes(b"as it was before")
            return made
        of, commands = starts[name]
        shutil.copytree(start(of), made) if of else made.mkdir()
        for args in commands:
            with quiet() as said:
                status = Case("", args, made, corpus).run(made)
            assert status == 0, f"{args}: {said.getvalue()}"
        library = made / "l.mocapdb"
        if name == "older":
            made_older(library, 2)
        elif name == "lost":
            (library / "catalogue.db").unlink()
        elif name == "damaged":
            flip(min((library / "shards").iterdir()))
        return made

    filling = ("--joints", "lhand,rhand,lfoot,rfoot", "--context", "{lib}", "--no-error")
    two_jobs = [2 if each == 1 else each for each in build]
    commands: dict[str, tuple[Sequence[object], str]] = {
        "build": (build, "nothing"),
        "build --jobs 2": (two_jobs, "nothing"),
        "build more": (build, "built"),
        "compact": (("compact", "{lib}"), "replaced"),
        "index": (("index", "{lib}"), "bare"),
        "index, older": (("index", "{lib}"), "older"),
        "classify --apply": (("classify", "{lib}", "--apply"), "built"),
        "classify --grow": (("classify", "{lib}", "--grow"), "built"),
        "classify --undo": (("classify", "{lib}", "--undo"), "labelled"),
        "cycle --class": (("cycle", "{lib}", "--class", "walk"), "built"),
        "query --save": (("query", "{lib}", "a", "--save", "mine"), "full"),
        "clean --apply": (("clean", "{lib}", "--apply", "--jobs", 1), "built"),
        "clean --undo": (("clean", "{lib}", "--undo"), "cleaned"),
        "recover, lost": (("recover", "{lib}", "--jobs", 1), "lost"),
        "recover, damaged": (("recover", "{lib}", "--jobs", 1), "damaged"),
        "edit": (("edit", clip, "--mirror", "-o", f"{out}/edit.bvh"), "edit.bvh"),
        "export": (("export", "{lib}", "a", "-o", f"{out}/export.amc"), "export.amc"),
        "convert": (("convert", clip, f"{out}/convert.npz"), "convert.npz"),
        "fill": (("fill", clip, *filling, "-o", f"{out}/fill.bvh"), "fill.bvh"),
        "gait": (("gait", clip, "-o", f"{out}/gait.csv"), "gait.csv"),
        "clean": (("clean", clip, "-o", f"{out}/clean.bvh"), "clean.bvh"),
        "cycle": (("cycle", clip, "-o", f"{out}/loop.glb"), "loop.glb"),
        "render": (("render", clip, "-o", f"{out}/render.html"), "render.html"),
    }
    cases = []
    for name in names or commands:
        args, of = commands[name]
        own = grown if name == "build more" else corpus
        cases.append(Case(name, args, start(of), own, writes_library=of in starts))
        record(cases[-1], folder)
    return cases


def record(case: Case, folder: Path) -> None:
    """Run a command undisturbed, twice: once as it is and once to see what it does."""
    work = folder / "work"
    case.before = state(case, case.start) if not case.name.startswith("recover") else {}
    for _ in range(2):
        shutil.rmtree(work, ignore_errors=True)
        shutil.copytree(case.start, work)
        trace = run_traced(lambda: case.run(work), work)
        assert trace.status == 0, (case.name, trace.said)
    case.steps, case.calls, case.after = trace.steps, trace.calls, state(case, work)
    disk = Disk(tree_of(case.start))
    for step in case.steps:
        disk.do(step)
    assert disk.tree() == tree_of(work), f"{case.name} was not recorded as it is"
    shutil.rmtree(work)
    if case.name.startswith("build"):
        changed = folder / "changed"
        shutil.copytree(case.corpus, changed)
        change(changed)
        work.mkdir()
        with quiet():
            assert case.run(work, changed) == 0
        case.after_changed = state(case, work)
        shutil.rmtree(work)
        shutil.rmtree(changed)


def change(corpus: Path) -> None:
    """Change a corpus: one file is another, one has moved."""
    write_clips(corpus, {"d.bvh": ("squat", 7)})
    (corpus / "b/c.bvh").rename(corpus / "c.bvh")


def flip(path: Path) -> None:
    """Damage a file in its middle."""
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 4
    path.write_bytes(data)


def state(case: Case, work: Path) -> State:
    """Return what a command's folder holds; nothing where it has no library yet."""
    if not case.writes_library:
        files = (work / "out").iterdir()
        return {path.name: path.read_bytes() for path in files if path.name[0] != "."}
    library = work / "l.mocapdb"
    if not (library / "catalogue.db").is_file():
        return {}
    with Library(library) as cleaned, Library(library, original=True) as captured:
        found: State = {
            f"clip {record.name}": (
                cleaned.clip(record.name).channels.tobytes(),
                captured.clip(record.name).channels.tobytes(),
                record.label,
                record.label_source,
            )
            for record in cleaned.records()
        }
        catalogue = cleaned.catalogue
        for record in cleaned.records():
            revision = catalogue.revision(record.id)
            if revision is not None:
                found[f"revision of {record.name}"] = revision.spans
        for name in catalogue.saved_queries():
            found[f"query {name}"] = "kept"
        found["searchable"] = sorted({*catalogue.unsearchable()})
    for row in list_cycles(library):
        found[f"cycle {row['class']}"] = row["members"]
    return found


# -- stopping them ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Point:
    """A moment of a command: a call to the system, or a number of steps before the power goes."""

    case: Case
    way: str
    call: Call | None = None
    steps: int = 0
    seed: int = 0

    def __str__(self) -> str:
        where = f"{self.call.name} {self.call.number}" if self.call else f"step {self.steps}"
        error = f" ({self.call.error})" if self.call and self.way == "fail" else ""
        return f"{self.case.name}, {self.way} at {where}{error}, seed {self.seed}"


def points(cases: list[Case], count: int, seed: int) -> Iterator[Point]:
    """Yield an even choice of commands, ways, and kinds of calls."""
    chance = random.Random(seed)
    turns = cycle((case, way) for way in WAYS for case in cases)
    for number, (case, way) in enumerate(islice(turns, count)):
        if way == "power":
            # also when all is done: a command that said so has to be
            steps = chance.choice([chance.randrange(len(case.steps) + 1)] * 7 + [len(case.steps)])
            yield Point(case, way, None, steps, number)
            continue
        name = chance.choice(sorted({call.name for call in case.calls}))
        call = chance.choice([each for each in case.calls if each.name == name])
        error = chance.choice(ERRORS.get(name, ["EIO"]))
        yield Point(case, way, Call(name, call.number, error), 0, number)


def every_point(cases: list[Case], way: str) -> Iterator[Point]:
    """Yield each moment of each command in turn."""
    for case in cases:
        if way == "power":
            yield from (Point(case, way, None, i, i) for i in range(len(case.steps) + 1))
            continue
        for number, call in enumerate(case.calls):
            error = random.Random(number).choice(ERRORS.get(call.name, ["EIO"]))
            yield Point(case, way, Call(call.name, call.number, error), 0, number)


def try_point(point: Point, work: Path) -> str:
    """Stop a command at a point; return the promise that is broken, if one is."""
    case, is_done, said = point.case, False, ""
    corpus = work.with_name(f"{work.name}-corpus")
    for each in (work, corpus):
        shutil.rmtree(each, ignore_errors=True)
    if point.call is None:
        disk = Disk(tree_of(case.start))
        for step in case.steps[: point.steps]:
            disk.do(step)
        write_tree(disk.after_power_loss(random.Random(point.seed)), work)
        is_done = point.steps == len(case.steps)
    else:
        shutil.copytree(case.start, work)
        try:
            trace = run_traced(lambda: case.run(work), work, point.call, kill=point.way == "kill")
        except AssertionError as problem:
            return str(problem)
        is_done, said = trace.status == 0, trace.said
        if trace.status not in {0, 1, -9} or "fault of mocapdb" in said or "Traceback" in said:
            return f"status {trace.status}: {said}"
    return in_child(lambda: broken_promise(point, work, corpus, is_done, said))


def in_child(work: Any) -> str:
    """Return the text that a function returns, called in a process of its own."""
    reading, writing = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(reading)
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, 1)
        os.dup2(null, 2)
        try:
            told = work()
        except BaseException as problem:
            told = f"{type(problem).__name__}: {problem}"
        os.write(writing, told.encode()[:60_000])
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as pipe:
        told = pipe.read()
    return told if os.waitpid(pid, 0)[1] == 0 else f"{told} the process died"


# -- what has to be so afterwards ------------------------------------------------------------------


def broken_promise(point: Point, work: Path, corpus: Path, is_done: bool, said: str) -> str:
    """Return what is wrong after a writer was stopped; nothing if all is well."""
    case = point.case
    if not case.writes_library:
        return broken_file(point, work, is_done)
    library, after = work / "l.mocapdb", case.after
    recovers = case.name.startswith("recover")
    # what a recovery cannot read it takes for damaged, and from the corpus again
    takes_again = recovers and point.way == "fail"
    there = (library / "catalogue.db").exists()
    if case.before and not there:
        return "the catalogue is gone"
    try:
        if there and not recovers:
            with Library(library) as opened:
                report = verify_library(opened)
            if report["bad"] or report["shards"]:
                return f"damaged: {report['bad'] or report['shards']}"
            if wrong := unlike(state(case, work), case):
                return wrong
        if is_done and not takes_again and state(case, work) != after:
            return f"said it was done, but {differences(state(case, work), after)}: {said}"
    except MocapdbError as problem:
        return f"stopped, it cannot be read: {problem}"
    source = case.corpus
    if case.after_changed and point.seed % 2:
        shutil.copytree(source, corpus)
        change(corpus)
        source, after = corpus, case.after_changed
    if case.run(work, source) != 0 and state(case, work) != after:  # it may have nothing to do
        return "refused to go on"
    found = state(case, work)
    if takes_again:
        found, after = dict.fromkeys(found), dict.fromkeys(after)
    if found != after:
        return f"resumed, {differences(found, after)}"
    with Library(library) as opened:
        report = verify_library(opened)
    if report["bad"] or report["shards"] or report["stray"]:
        return f"resumed, it is not sound: {report}"
    return f"left behind: {leftovers(work)}" if leftovers(work) else ""


def broken_file(point: Point, work: Path, is_done: bool) -> str:
    """Return what is wrong with a file whose writer was stopped."""
    case = point.case
    found = state(case, work)
    if missing := {*case.before} - {*found}:
        return f"{missing} is gone"
    if wrong := unlike(found, case):
        return wrong
    if is_done and found != case.after:
        return f"said it was done, but {differences(found, case.after)}"
    is_unlinking = point.call is not None and point.call.name in {"unlink", "unlinkat"}
    if point.way == "fail" and leftovers(work) and not is_unlinking:
        return f"left behind: {leftovers(work)}"
    if case.run(work) != 0:
        return "refused to go on"
    return "" if state(case, work) == case.after else "again, it is unlike what it is undisturbed"


def unlike(found: State, case: Case) -> str:
    """Return what is neither as it was before nor as it is to be, or is lost."""
    for name, value in found.items():
        if value not in (case.before.get(name), case.after.get(name)) and name != "searchable":
            return f"{name} is neither as it was nor as it is to be"
    if lost := {*case.before} & {*case.after} - {*found}:
        return f"lost: {sorted(lost)}"
    return ""


def differences(found: State, expected: State) -> str:
    """Return the names of what is otherwise than expected."""
    names = sorted({*found, *expected})
    return "unlike undisturbed: " + ", ".join(
        name for name in names if found.get(name) != expected.get(name)
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--points", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--every", choices=WAYS, help="each moment in turn, in this way")
    parser.add_argument("--commands", nargs="*", default=[], help="only these")
    asked = parser.parse_args()
    expect_strace()
    started = time.monotonic()
    tried: Counter[tuple[str, str]] = Counter()
    kept: Counter[tuple[str, str]] = Counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cases = make_cases(folder, asked.commands)
        prepared = time.monotonic() - started
        print(f"{len(cases)} commands, prepared in {prepared:.0f} s", flush=True)
        chosen = (
            every_point(cases, asked.every)
            if asked.every
            else points(cases, asked.points, asked.seed)
        )
        for point in chosen:
            problem = try_point(point, folder / "work")
            tried[point.case.name, point.way] += 1
            kept[point.case.name, point.way] += not problem
            if problem:
                print(f"{point}: {problem}", flush=True)
    for case in cases:
        counts = ", ".join(f"{way} {kept[case.name, way]}/{tried[case.name, way]}" for way in WAYS)
        print(f"{case.name:18} {len(case.calls):5} calls {len(case.steps):5} steps   {counts}")
    seconds = time.monotonic() - started
    print(
        f"{kept.total()} of {tried.total()} points kept every promise ({seconds:.0f} s, "
        f"{sum(os.times()[:4]):.0f} s of processor time)"
    )
    return int(kept != tried)


if __name__ == "__main__":
    sys.exit(main())
