"""Read thousands of damaged files and see that none does more harm than to be refused.

    python tests/fuzz.py --inputs 10000            # of every reader
    python tests/fuzz.py --inputs 10000 bvh npz

Readers: motion files, body models, the tables and settings that people write, saved queries, and
every file of a library. Each input is a sound file after a few mutations: numbers made absurd,
lines and pieces cut, doubled, exchanged or taken from elsewhere, bytes and counts overwritten. It
may be read, or refused by an error of mocapdb. Anything else is a fault: another error, over 5 s of
processor time, or more memory than ten times the file and 100 MB.
"""

from __future__ import annotations

import argparse
import io
import random
import re
import resource
import signal
import struct
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

import numpy as np
import smpl_arrays
from small_library import QUICK, write_clips

from mocapdb.corpus import synthetic
from mocapdb.corpus.labels import read_labels
from mocapdb.corpus.manifest import manifest_path, read_manifest
from mocapdb.errors import MocapdbError
from mocapdb.indexing import canonical_motion
from mocapdb.io import read_clip, read_joint_map, read_with_settings, write_clip
from mocapdb.io.asf import read_asf
from mocapdb.scenes.gltf import write_glb

MOST_SECONDS = 5.0
MOST_MEMORY = 100e6
NUMBERS = (
    "0", "-1", "1e308", "-1e308", "1e400", "nan", "inf", "1e-320", "99999999999999999999",
    "4294967296", "-2147483649", "2", "0x10", "1_000", "1e", "1.2.3", "٣", "½",
)  # fmt: skip
WORDS = (
    "ROOT", "JOINT", "End Site", "{", "}", "MOTION", "Frames:", "Frame Time:", "CHANNELS", "OFFSET",
    "Xposition", "Zrotation", ":units", ":root", ":bonedata", ":hierarchy", "begin", "end", "id",
    "name", "dof", "rx", "limits", "axis", "order", "root", "#", "\0", "\ufeff", "é" * 40, "(" * 50,
    ":FULLY-SPECIFIED", ":DEGREES", "\r", "\x1b[2J", "9" * 400, "a" * 5000,
)  # fmt: skip


class TookTooLong(BaseException):
    """Not an `Exception`, so that no reader takes it for one of its own."""


# -- mutations -------------------------------------------------------------------------------------


def mutated_text(data: bytes, chance: random.Random) -> bytes:
    """Return a text after one to four mutations."""
    lines = data.split(b"\n")
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(lines))
        if chance.random() < 0.7:  # where the structure is
            at = chance.randrange(min(len(lines), 120))
        kind = chance.randrange(9)
        if kind <= 2:
            found = list(re.finditer(rb"[^\s]+", lines[at]))
            if found:
                token = chance.choice(found)
                other = chance.choice([*NUMBERS, *WORDS] if kind else NUMBERS).encode()
                lines[at] = lines[at][: token.start()] + other + lines[at][token.end() :]
        elif kind == 3:
            del lines[at : at + chance.choice([1, 1, 2, 20])]
        elif kind == 4:
            lines[at:at] = lines[at : at + chance.choice([1, 1, 5, 60])] * chance.choice([1, 2, 50])
        elif kind == 5:
            other_at = chance.randrange(len(lines))
            lines[at], lines[other_at] = lines[other_at], lines[at]
        elif kind == 6:
            lines.insert(at, chance.choice(WORDS).encode())
        elif kind == 7:
            lines[at] = mutated_bytes(lines[at] or b" ", chance)
        else:
            lines = lines[: at + 1]
        lines = lines or [b""]
    return b"\n".join(lines)


def mutated_bytes(data: bytes, chance: random.Random) -> bytes:
    """Return bytes after one to four mutations; counts and offsets are what they like best."""
    changed = bytearray(data)
    for _ in range(chance.randint(1, 4)):
        if not changed:
            break
        at = chance.randrange(len(changed))
        kind = chance.randrange(7)
        if kind == 0:
            changed[at] ^= 1 << chance.randrange(8)
        elif kind == 1:
            changed[at] = chance.choice([0, 1, 0x7F, 0x80, 0xFF])
        elif kind == 2:
            form = chance.choice(["<H", "<I", "<Q", ">I"])
            size = struct.calcsize(form)
            most = 2 ** (8 * size) - 1
            number = chance.choice([0, 1, most, most // 2, most // 2 + 1, len(data), 2**16 - 1])
            changed[at : at + size] = struct.pack(form, min(number, most))
        elif kind == 3:
            del changed[at : at + chance.choice([1, 4, 64, 4096])]
        elif kind == 4:
            changed[at:at] = changed[at : at + chance.choice([1, 8, 512])]
        elif kind == 5:
            other_at = chance.randrange(len(changed))
            size = chance.choice([4, 8, 64])
            changed[at : at + size] = changed[other_at : other_at + size]
        else:
            del changed[at:]
    return bytes(changed)


def mutated_npz(data: bytes, chance: random.Random) -> bytes:
    """Return an archive whose arrays are other than they were, or whose bytes are."""
    if chance.random() < 0.4:
        return mutated_bytes(data, chance)
    with np.load(io.BytesIO(data)) as archive:
        arrays = {name: archive[name] for name in archive.files}
    name = chance.choice(list(arrays))
    array = arrays[name]
    kind = chance.randrange(7)
    if kind == 0:
        del arrays[name]
    elif kind == 1:
        arrays[name] = array.reshape(-1)[: chance.randrange(array.size + 1)]
    elif kind == 2:
        arrays[name] = np.asarray(array)[None]
    elif kind == 3:
        with suppress(ValueError):  # not every text is a number
            arrays[name] = array.astype(chance.choice(["f2", "i1", "U8", "c16", "?"]))
    elif kind == 4 and array.dtype.kind in "fiu" and array.size:
        flat = array.astype(float).ravel()
        flat[chance.randrange(flat.size)] = chance.choice([np.nan, np.inf, 1e300, -1, 0, 2**40])
        arrays[name] = flat.reshape(array.shape)
    elif kind == 5:
        arrays[name] = np.zeros((0, *array.shape[1:]), array.dtype)
    else:
        arrays[name] = arrays[chance.choice(list(arrays))]
    image = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        np.savez(image, **arrays)
    return image.getvalue()


# -- the readers -----------------------------------------------------------------------------------


class Reader:
    """Sound files, how they are damaged, and what reads them."""

    def __init__(
        self,
        folder: Path,
        seeds: list[Path],
        mutate: Callable[[bytes, random.Random], bytes],
        read: Callable[[Path], object],
    ) -> None:
        self.folder = folder
        self.seeds = [(path, path.read_bytes()) for path in seeds]
        self.mutate, self.read = mutate, read

    def inputs(self, count: int, seed: int) -> Iterator[tuple[Path, bytes]]:
        """Yield files, each in its place: damaged now, sound again before the next."""
        chance = random.Random(seed)
        for _ in range(count):
            path, sound = chance.choice(self.seeds)
            content = self.mutate(sound, chance)
            path.write_bytes(content)
            yield path, content
            path.write_bytes(sound)


def make_readers(folder: Path) -> dict[str, Reader]:
    """Write sound files of each kind into a folder."""
    walk = synthetic.make_clip("walk", seed=1, duration_s=0.2)
    for name in ("a.amc", "b.bvh", "c.npz"):
        (folder / name[0]).mkdir()
        write_clip(walk, folder / name[0] / name)
    write_glb(walk, folder / "d.glb")
    (asf,) = (folder / "a").glob("*.asf")
    readers = {
        "asf": Reader(folder, [asf], mutated_text, read_asf),
        "amc": Reader(folder, [folder / "a/a.amc"], mutated_text, read_clip),
        "bvh": Reader(folder, [folder / "b/b.bvh"], mutated_text, read_clip),
        "npz": Reader(folder, [folder / "c/c.npz"], mutated_npz, read_clip),
        "gltf": Reader(folder, [folder / "d.glb"], mutated_bytes, read_clip),
    }
    readers |= body_readers(folder) | written_readers(folder)
    library = make_library(folder)
    files = [path for path in library.rglob("*") if path.is_file() and path.stat().st_size]
    readers["library"] = Reader(folder, files, mutated_bytes, lambda path: ask(library, path))
    readers["query"] = query_reader(library, folder)
    return readers


def body_readers(folder: Path) -> dict[str, Reader]:
    """Return the readers of what AMASS and the makers of body models give out."""
    amass, model, plain = (folder / name for name in ("amass.npz", "model.npz", "plain.npz"))
    motion = smpl_arrays.arrays("smplh")
    np.savez_compressed(amass, **motion)
    smpl_arrays.body_model(model)
    np.savez(
        plain,
        quaternions=np.tile([1.0, 0, 0, 0], (4, 3, 1)),
        names=np.array(["hips", "spine", "head"]),
        parents=np.array([-1, 0, 1]),
        offsets=np.array([[0, 1, 0], [0, 0.5, 0], [0, 0.4, 0]]),
        root=np.zeros((4, 3)),
        fps=np.array(30.0),
    )
    return {
        "amass": Reader(folder, [amass, plain], mutated_npz, read_clip),
        "model": Reader(folder, [model], mutated_npz, lambda path: read_clip(amass, skeleton=path)),
    }


def written_readers(folder: Path) -> dict[str, Reader]:
    """Return the readers of tables and settings that people write."""
    labels, manifest, joints = (
        folder / name for name in ("LABELS.csv", "manifest.csv", "joints.toml")
    )
    labels.write_text(
        "path,clip,label,fps,description,subject,style\n"
        'b/b.bvh,,walk,60,"walks, far",01,plain\n,c,run,,,,\n'
    )
    sound = manifest_path().read_text(encoding="utf-8").splitlines()
    manifest.write_text("\n".join([*sound[:6], *sound[-6:]]) + "\n", encoding="utf-8")
    joints.write_text('left_knee = "LeftLeg"\nright_knee = "RightLeg"\n')
    settings = folder / "b/mocapdb.toml"
    settings.write_text(
        'unit_m = 0.01\nup = "y"\n["*.bvh"]\nfps = 60\n[joint_map]\nleft_knee = "ltibia"\n'
    )
    return {
        "labels": Reader(folder, [labels], mutated_text, lambda path: read_labels(path, folder)),
        "manifest": Reader(folder, [manifest], mutated_text, read_manifest),
        "joints": Reader(folder, [joints], mutated_text, read_joint_map),
        "settings": Reader(
            folder, [settings], mutated_text, lambda _: read_with_settings(folder / "b/b.bvh")
        ),
    }


def query_reader(library: Path, folder: Path) -> Reader:
    """Return the reader of queries that a library keeps, which are text in its catalogue."""
    from mocapdb.library import Filter, Library, Retrieval, SavedQuery

    opened = Library(library)
    retrieval = Retrieval(opened)
    sound = folder / "query.json"
    only = asdict(Filter("walk", not_subjects=["9"], facets={"duration": (0, None)}))
    options = {"k": 2, "only": only, "mirror": True, "joints": ["arms"], "max_distance": 2.0}
    motion = canonical_motion(opened.clip("a"))
    sound.write_text(SavedQuery((motion,), (motion,), options).to_json())

    def ask_again(path: Path) -> None:
        text = path.read_bytes().decode(errors="replace")  # what is no text SQLite refuses itself
        opened.catalogue.saved_query = lambda name: text
        retrieval.saved("sound")

    return Reader(folder, [sound], mutated_text, ask_again)


def make_library(folder: Path) -> Path:
    """Build a library whose files have no checksums in the catalogue: its readers stand alone."""
    import sqlite3
    from contextlib import closing

    from mocapdb.library import build_library

    files = {"walk/a.bvh": ("walk", 1), "walk/b.bvh": ("walk", 2), "run/c.bvh": ("run", 3)}
    write_clips(folder / "corpus", files)
    build_library(folder / "corpus", folder / "l.mocapdb", QUICK, jobs=1, index=True)
    with closing(sqlite3.connect(folder / "l.mocapdb/catalogue.db")) as database, database:
        database.execute("DELETE FROM derived_files")
        database.execute("UPDATE checksums SET crc32 = crc32")
    return folder / "l.mocapdb"


def ask(library: Path, damaged: Path) -> None:
    """Ask a library all that is answered from one of its files."""
    from mocapdb.library import Library, Retrieval, verify_library
    from mocapdb.library.cycles_file import list_cycles, read_cycle
    from mocapdb.library.searching.search_index import StoredMotions
    from mocapdb.library.upkeep.gather import gather

    name = damaged.name if damaged.parent == library else damaged.parent.name
    every = name == "catalogue.db"
    if name == "shards":
        gather(library)
    if name == "cycles.h5":
        for row in list_cycles(library):
            read_cycle(library, row["class"])
        return
    with Library(library) as opened:
        if every or name == "shards":
            opened.info()
            verify_library(opened)
            for record in opened.records():
                with suppress(MocapdbError):
                    opened.decode(record)
        if name == "features":
            list(StoredMotions(library, opened.catalogue.feature_places()))
        if every or name not in {"shards", "features"}:
            retrieval = Retrieval(opened)
            with suppress(MocapdbError):
                retrieval.query(["a"], k=2)
            retrieval.classify(opened.clip("c"))


# -- trying them -----------------------------------------------------------------------------------


def faults(reader: Reader, count: int, seed: int) -> Iterator[tuple[str, bytes]]:
    """Yield what went wrong, and with what content of the file."""

    def stop(*_: object) -> None:
        raise TookTooLong

    before = signal.signal(signal.SIGVTALRM, stop)
    for path, _ in reader.seeds:  # what has to be compiled is compiled before time counts
        reader.read(path)
    try:
        for path, content in reader.inputs(count, seed):
            at_first = peak_memory()
            signal.setitimer(signal.ITIMER_VIRTUAL, MOST_SECONDS)
            try:
                with warnings.catch_warnings(), np.errstate(all="ignore"):
                    warnings.simplefilter("ignore")
                    reader.read(path)
            except MocapdbError:
                pass
            except TookTooLong:
                yield f"{path.name}: over {MOST_SECONDS:g} s", content
            except Exception as problem:
                yield f"{path.name}: {type(problem).__name__}: {problem}", content
            finally:
                signal.setitimer(signal.ITIMER_VIRTUAL, 0)
            grown = peak_memory() - at_first
            if grown > MOST_MEMORY + 10 * len(content):
                yield f"{path.name}: {grown / 1e6:.0f} MB for {len(content)} bytes", content
    finally:
        signal.signal(signal.SIGVTALRM, before)


def peak_memory() -> float:
    """Return the most memory that this process has had so far, in bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("readers", nargs="*")
    parser.add_argument("--inputs", type=int, default=10_000, help="of each reader")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, help="folder for the inputs that do harm")
    asked = parser.parse_args()
    n_faults = 0
    with tempfile.TemporaryDirectory() as name:
        readers = make_readers(Path(name))
        for kind in asked.readers or readers:
            started, found = time.process_time(), 0
            for problem, content in faults(readers[kind], asked.inputs, asked.seed):
                found += 1
                print(f"{kind}: {problem}", flush=True)
                if asked.keep:
                    asked.keep.mkdir(exist_ok=True)
                    (asked.keep / f"{kind}-{found}").write_bytes(content)
            seconds = time.process_time() - started
            print(f"{kind:8} {asked.inputs} inputs, {found} faults ({seconds:.0f} s)", flush=True)
            n_faults += found
    return int(n_faults > 0)


if __name__ == "__main__":
    sys.exit(main())
