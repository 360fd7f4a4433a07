"""How long the Blender add-on takes: bringing a clip in, extracting a loop, listing a library.

Run it with a Python that has bpy: ``make test-blender`` makes one, ``.venv-blender/bin/python
benchmarks/bench_blender.py``. Times are the best of a few, through the operators, and those of the
first time, when the worker has been started with the list of the library.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

from mocapdb import BuildSettings, Target, build_library
from mocapdb.corpus import synthetic
from mocapdb.io import write_clip

ROOT = Path(__file__).resolve().parents[1]
MANY = 3000


def load_addon():
    spec = importlib.util.spec_from_file_location(
        "mocapdb_blender",
        ROOT / "blender" / "__init__.py",
        submodule_search_locations=[str(ROOT / "blender")],
    )
    module = importlib.util.module_from_spec(spec)
    sys.modules["mocapdb_blender"] = module
    spec.loader.exec_module(module)
    module.register()
    return module


def best_of(n, job):
    """Return the least time in seconds of `n` runs, and that of the first."""
    times = []
    for _ in range(n):
        start = time.perf_counter()
        job()
        times.append(time.perf_counter() - start)
    return min(times), times[0]


def main():
    if importlib.util.find_spec("bpy") is None:
        print("no bpy here: .venv-blender/bin/python benchmarks/bench_blender.py")
        return
    import bpy

    folder = Path(tempfile.mkdtemp())
    clips = folder / "clips"
    clips.mkdir()
    walk = synthetic.make_clip("walk", seed=1, duration_s=10.0)  # 1,200 frames
    write_clip(walk, clips / "walk.npz")
    library = folder / "one.mocapdb"
    build_library(clips, library, BuildSettings(Target("mean_mm", 1.0)), jobs=1, index=False)
    addon = load_addon()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    settings = scene.mocapdb_library
    settings.path, settings.rate = str(library), "SCENE"
    start = time.perf_counter()
    addon.WORKER.do("get_ready")
    print(f"worker starts          {time.perf_counter() - start:6.2f} s, while a clip is chosen")
    took, first = best_of(5, lambda: bpy.ops.mocapdb.import_clip(clip="walk"))
    bones, frames = len(bpy.context.object.data.bones), len(walk)
    print(f"import, {frames} x {bones}     {took:6.2f} s, the first {first:.2f} s (limit 0.5)")
    took, first = best_of(5, bpy.ops.mocapdb.extract)
    print(f"extract, {frames} x {bones}    {took:6.2f} s, the first {first:.2f} s (limit 2)")
    many = folder / "many"
    many.mkdir()
    short = walk[:30]
    for i in range(MANY):
        part = short.channels + 1e-3 * i  # no two files are the same
        write_clip(short.replace(channels=part, name=f"c{i:04d}"), many / f"c{i:04d}.npz")
    listed = folder / "many.mocapdb"
    raw = BuildSettings(Target("mean_mm", 1.0), {"codec": "raw"})
    build_library(many, listed, raw, index=False)
    took, first = best_of(5, lambda: bpy.ops.mocapdb.open_library(path=str(listed)))
    n_clips = len(settings.clips)
    print(f"list, {n_clips} clips      {took:6.2f} s, the first {first:.2f} s (limit 0.3)")
    addon.WORKER.close()
    shutil.rmtree(folder)
    sys.stdout.flush()
    os._exit(0)  # bpy may wait for ever for its own threads


if __name__ == "__main__":
    main()
