"""Training from a library: windows a second, and bytes, beside npz files and HDF5 of raw frames.

The peers hold float32 channels at the clips' own rate, as one would save them: an ``.npz`` for each
clip, and one HDF5 file. Of each the same windows are taken in the same order, 64 frames at 30 Hz as
positions. Times are of the processor, so that what else runs does not count.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
import numpy as np
from _corpus import corpus_or_exit, motion_files

from mocapdb import BuildSettings, Library, Target, build_library
from mocapdb.library import MotionWindows
from mocapdb.motion.joint_tracks import joint_positions

MOST_FRAMES = 60_000
LENGTH, STRIDE, FPS = 64, 16, 30.0
PEER_WINDOWS = 400  # the peers are slow


def main() -> None:
    with TemporaryDirectory() as name:
        measure(corpus_or_exit(), Path(name))


def measure(corpus: Path, folder: Path) -> None:
    """Print a line for each way to store the same clips."""
    clips, frames = folder / "clips", 0
    for path in motion_files(corpus / "cmu" / "asfamc"):
        if path.suffix != ".amc" or frames >= MOST_FRAMES:
            continue
        skeletons = list(path.parent.glob("*.asf"))
        here = clips / path.parent.name
        here.mkdir(parents=True, exist_ok=True)
        for file in (path, *skeletons):
            (here / file.name).unlink(missing_ok=True)
            (here / file.name).symlink_to(file)
        frames += path.stat().st_size // 1200
    settings = BuildSettings(Target("mean_mm", 1.0))
    build_library(clips, folder / "windows.mocapdb", settings, jobs=1, index=False)
    with Library(folder / "windows.mocapdb") as library:
        records = library.records()
        payload = sum(record.payload_bytes for record in records)
        raw = sum(4 * record.frames * record.n_channels for record in records)
        print(f"{len(records)} clips, {sum(record.frames for record in records)} frames")
        print(
            f"payload {payload / 1e6:.2f} MB, float32 {raw / 1e6:.1f} MB: {raw / payload:.0f} times"
        )
        print(f"\n{'':28}{'MB':>8}{'windows/s':>12}{'again':>10}")
        for features in ("positions", "quaternions", "6d", "canonical"):
            windows = library.windows(LENGTH, STRIDE, FPS, features, seed=0, short="skip")
            row(f"mocapdb, {features}", payload, windows.__getitem__, len(windows))
        windows = library.windows(LENGTH, STRIDE, FPS, seed=0, short="skip")
        peers(library, windows, folder)


def row(name: str, size: int, window: Callable[[int], object], count: int) -> None:
    """Print bytes, and windows a second, when nothing is known and once more."""
    window(0)
    speeds = []
    for _ in range(2):
        begun = time.process_time()
        for number in range(count):
            window(number)
        speeds.append(count / (time.process_time() - begun))
    print(f"{name:28}{size / 1e6:8.2f}{speeds[0]:12,.0f}{speeds[1]:10,.0f}")


def peers(library: Library, windows: MotionWindows, folder: Path) -> None:
    """Store the clips as others do, and take the same windows."""
    places = [(sample["clip"], sample["start"]) for sample in windows]
    records = [library.record(name) for name in windows.clips]
    stored = folder / "raw.h5"
    with h5py.File(stored, "w") as file:
        for i, record in enumerate(records):
            channels = library.clip(record.name).channels.astype(np.float32)
            np.savez(folder / f"{i}.npz", channels=channels)
            np.savez_compressed(folder / f"{i}_packed.npz", channels=channels)
            file.create_dataset(str(i), data=channels)

    def positions(clip: int, read: Callable[[slice], np.ndarray], start: int) -> np.ndarray:
        record = records[clip]
        step = round(record.fps / FPS)
        channels = read(slice(start * step, (start + LENGTH) * step, step)).astype(np.float64)
        return joint_positions(library.skeleton(record), channels).astype(np.float32)

    def from_npz(suffix: str) -> Callable[[int], object]:
        def window(number: int) -> object:
            clip, start = places[number]
            with np.load(folder / f"{clip}{suffix}") as archive:
                channels = archive["channels"]
            return positions(clip, channels.__getitem__, start)

        return window

    count = min(PEER_WINDOWS, len(places))
    for name, suffix in (("npz", ".npz"), ("npz, compressed", "_packed.npz")):
        size = sum((folder / f"{i}{suffix}").stat().st_size for i in range(len(records)))
        row(name, size, from_npz(suffix), count)
    with h5py.File(stored, "r") as file:

        def from_hdf5(number: int) -> object:
            clip, start = places[number]
            return positions(clip, file[str(clip)].__getitem__, start)

        row("HDF5, raw frames", stored.stat().st_size, from_hdf5, count)


if __name__ == "__main__":
    main()
