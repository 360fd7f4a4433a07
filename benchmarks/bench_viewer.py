"""The viewer: frames a second of a clip of 5,000 frames, as sent and as a headless browser draws.

The browser draws in software, on the processors that also send: a graphics card draws far more.
And what the first content of a page costs the processors: of a library of 3,000 clips, until list,
pictures and clock are there, and of a bare page of viser, until it has its stage.

python benchmarks/bench_viewer.py [--only frames first]
"""

from __future__ import annotations

import argparse
import io
import os
import shutil
import tempfile
import time
from contextlib import redirect_stdout
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import bench_growth
import numpy as np

from mocapdb.compression import Target
from mocapdb.corpus import synthetic
from mocapdb.io import write_clip
from mocapdb.library import BuildSettings, build_library

FRAMES, SECONDS = 5000, 8.0
CLIPS, LOADS = 3000, 3
SIZES = ((1000, 620), (1920, 1080))
FLAGS = ["--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader",
         "--enable-unsafe-swiftshader"]  # fmt: skip
DRAWN = """new Promise(done => { let n = 0; const t = performance.now(); const count = () => {
    n++; performance.now() - t > 3000 ? done(n / 3) : requestAnimationFrame(count); };
    requestAnimationFrame(count); })"""


def first_content(chromium: Any, root: Path) -> None:
    """Print what it takes until pages of a large library show something, and a bare page does."""
    import viser

    from mocapdb.viewer import Viewer

    corpus, library = root / "seeds", root / "large.mocapdb"
    seeds = bench_growth.write_seeds(corpus)
    build_library(corpus, library, bench_growth.SETTINGS, jobs=1)
    bench_growth.grow(library, corpus, seeds, CLIPS)
    with redirect_stdout(io.StringIO()):  # it prints its address
        bare = viser.ViserServer(port=0, verbose=False)
    with Viewer(library, port=0) as viewer:
        for what, url, awaited in (
            ("a bare page", f"http://127.0.0.1:{bare.get_port()}/", ["canvas"]),
            (f"{CLIPS} clips", viewer.url, [".mt-clock", "img.mt-picture"]),
        ):
            for width, height in SIZES:
                own, drawn, wall = zip(*(
                    load(chromium, url, awaited, width, height) for _ in range(LOADS)
                ), strict=True)  # fmt: skip
                print(
                    f"first content of {what}, {width}x{height}: {np.median(own):.2f} s of "
                    f"processor time of ours (first {own[0]:.2f}), {np.median(drawn):.1f} s of the "
                    f"browser, {np.median(wall):.1f} s in all"
                )
    bare.stop()


def load(
    chromium: Any, url: str, awaited: list[str], width: int, height: int
) -> tuple[float, float, float]:
    """Load a page until it has some elements; return our seconds, the browser's, and the wall's."""
    page = chromium.new_context(viewport={"width": width, "height": height}).new_page()
    page.set_default_timeout(120_000)
    before = time.process_time(), browsers_s(), time.perf_counter()
    page.goto(url)
    for selector in awaited:
        page.wait_for_selector(selector, state="attached")
    after = time.process_time(), browsers_s(), time.perf_counter()
    page.context.close()
    own, drawn, wall = (end - start for end, start in zip(after, before, strict=True))
    return own, drawn, wall


def browsers_s() -> float:
    """Return the processor time of all that this process has started, on Linux."""
    parents, seconds = {}, {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended meanwhile
            continue
        process = int(path.parent.name)
        parents[process] = int(fields[1])
        seconds[process] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    ours = {os.getpid()}
    while more := {child for child, parent in parents.items() if parent in ours} - ours:
        ours |= more
    return sum(seconds[each] for each in ours - {os.getpid()} if each in seconds)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--only", choices=["frames", "first"])
    only = parser.parse_args().only
    browser = shutil.which("chromium")
    if browser is None or not find_spec("viser") or not find_spec("playwright"):
        print("viewer: needs chromium, viser and playwright")
        return
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver, tempfile.TemporaryDirectory() as folder:
        chromium = driver.chromium.launch(executable_path=browser, args=FLAGS)
        if only != "first":
            frames(chromium, Path(folder))
        if only != "frames":
            first_content(chromium, Path(folder))
        chromium.close()


def frames(chromium: Any, root: Path) -> None:
    """Print how many frames a second of a long clip are sent, and drawn."""
    from mocapdb.viewer import Viewer
    from mocapdb.viewer.scene import StageScene

    at: list[float] = []
    work: list[float] = []
    draw = StageScene.draw

    def timed(scene: StageScene, time_s: float, *, follow: bool) -> None:
        at.append(time.perf_counter())
        before = time.thread_time()
        draw(scene, time_s, follow=follow)
        work.append(time.thread_time() - before)

    StageScene.draw = timed  # type: ignore[method-assign]
    (root / "corpus").mkdir()
    clip = synthetic.make_clip("walk", seed=1, duration_s=FRAMES / 120)
    write_clip(clip, root / "corpus" / "01_01.amc")
    settings = BuildSettings(Target("mean_mm", 1.0), {"representation": "channels"})
    build_library(root / "corpus", root / "one.mocapdb", settings, jobs=1)
    with Viewer(root / "one.mocapdb", port=0) as viewer:
        page = chromium.new_page(viewport={"width": 860, "height": 520})
        page.set_default_timeout(120_000)
        page.goto(f"{viewer.url}&fixedDpr=0.3")
        page.wait_for_selector(".mt-flags button, .mt-flags:has-text('nothing')")
        for mode in ("decoded", "original beside decoded"):
            page.select_option("[data-choose=compare]", mode)
            page.wait_for_timeout(2000)
            at.clear()
            work.clear()
            page.wait_for_timeout(1000 * SECONDS)
            gaps = 1000 * np.diff(at)
            print(
                f"{mode}: {len(at) / SECONDS:.1f} frames/s sent, "
                f"{np.median(gaps):.1f} ms apart (95 %: {np.percentile(gaps, 95):.1f}), "
                f"{1000 * np.mean(work):.2f} ms of CPU each; "
                f"{page.evaluate(DRAWN):.0f} frames/s drawn in software"
            )
        page.close()
    StageScene.draw = draw  # type: ignore[method-assign]


if __name__ == "__main__":
    main()
