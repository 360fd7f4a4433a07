"""The viewer: frames a second of a clip of 5,000 frames, as sent and as a headless browser draws.

The browser draws in software, on the processors that also send: a graphics card draws far more.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from mocapdb.compression import Target
from mocapdb.corpus import synthetic
from mocapdb.io import write_clip
from mocapdb.library import BuildSettings, build_library

FRAMES, SECONDS = 5000, 8.0
FLAGS = ["--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader",
         "--enable-unsafe-swiftshader"]  # fmt: skip
DRAWN = """new Promise(done => { let n = 0; const t = performance.now(); const count = () => {
    n++; performance.now() - t > 3000 ? done(n / 3) : requestAnimationFrame(count); };
    requestAnimationFrame(count); })"""


def main() -> None:
    browser = shutil.which("chromium")
    if browser is None or not find_spec("viser") or not find_spec("playwright"):
        print("viewer: needs chromium, viser and playwright")
        return
    from playwright.sync_api import sync_playwright

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
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        (root / "corpus").mkdir()
        clip = synthetic.make_clip("walk", seed=1, duration_s=FRAMES / 120)
        write_clip(clip, root / "corpus" / "01_01.amc")
        settings = BuildSettings(Target("mean_mm", 1.0), {"representation": "channels"})
        build_library(root / "corpus", root / "one.mocapdb", settings, jobs=1)
        with Viewer(root / "one.mocapdb", port=0) as viewer, sync_playwright() as driver:
            chromium = driver.chromium.launch(executable_path=browser, args=FLAGS)
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
            chromium.close()


if __name__ == "__main__":
    main()
