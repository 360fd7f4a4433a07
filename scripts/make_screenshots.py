"""Take the pictures of viewer and report for the docs, of synthetic motion, in a headless browser.

python scripts/make_screenshots.py
"""

from __future__ import annotations

import argparse
import io
import shutil
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

from mocapdb.compression import Target
from mocapdb.corpus import synthetic
from mocapdb.io import read_clip, write_clip
from mocapdb.library import BuildSettings, Library, build_library
from mocapdb.report import write_report
from mocapdb.scenes import write_animation
from mocapdb.viewer import Viewer

PICTURES = Path(__file__).parents[1] / "docs" / "pictures"
FLAGS = ["--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader",
         "--enable-unsafe-swiftshader"]  # fmt: skip
SIZE = {"width": 1280, "height": 760}
FAULTY, SHOWN = "02_01", "01_01"
COLOURS = 240


def main() -> None:
    """Make a library, look at it, and keep what is seen."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        root = Path(folder)
        library = make_library(root)
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        page = browser.new_page(viewport=SIZE)
        page.set_default_timeout(120_000)
        look_at_viewer(library, page)
        with Library(library) as opened:
            write_report(opened, root / "report.html")
            write_animation(
                opened.clip(SHOWN)[:240], PICTURES / "walk.gif", size=(240, 200), fps=12.5
            )
        page.goto((root / "report.html").as_uri())
        page.evaluate("document.getElementById('cycles').scrollIntoView()")
        page.wait_for_function("Number(document.querySelector('.stage').dataset.frame) > 8")
        keep(page, "report")
        browser.close()


def make_library(root: Path) -> Path:
    """Build a library in which one clip has faults."""
    synthetic.write_corpus(root / "corpus")
    path = root / "corpus" / FAULTY[:2] / f"{FAULTY}.amc"
    faulty = synthetic.inject_faults(
        read_clip(path), seed=5, kinds=("offset", "noise", "flip"), size_deg=45, length_s=0.3, n=4
    )
    write_clip(faulty.clip, path)
    path.with_suffix(".asf").unlink()  # the subject's is there
    library = root / "demo.mocapdb"
    build_library(root / "corpus", library, BuildSettings(Target("mean_mm", 1.0), {}), index=True)
    return library


def look_at_viewer(library: Path, page: Page) -> None:
    """Take the viewer's pictures."""
    with Viewer(library, port=0, clip=FAULTY) as viewer:
        page.goto(viewer.url)
        page.wait_for_selector(".mt-span")
        page.locator(".mantine-Notification-closeButton").first.click()
        page.select_option("[data-choose=compare]", "before beside repaired")
        page.wait_for_selector(".mt-key >> nth=1")
        page.locator(".mt-span").last.click()
        settle(page)
        keep(page, "viewer")
        page.get_by_role("tab", name="Clips").click()
        page.click(f"tr[data-send='open {SHOWN}']")
        page.wait_for_selector(f".mt-title:text-is('{SHOWN}')")
        page.get_by_role("tab", name="Query").click()
        page.get_by_role("button", name="other subjects only").click()
        settle(page)
        strip = page.locator(".mt-strip").bounding_box()
        assert strip is not None
        y = strip["y"] + strip["height"] / 2
        page.mouse.move(strip["x"] + 0.2 * strip["width"], y)
        page.mouse.down()
        page.mouse.move(strip["x"] + 0.7 * strip["width"], y)
        page.mouse.up()
        page.get_by_role("button", name="Find this").click()
        page.wait_for_selector(".mt-card")
        page.click("[data-send='like 0']")
        page.click("[data-send='hit 1'] img")
        page.wait_for_selector(".mt-key >> nth=1")
        settle(page)
        keep(page, "viewer-query")


def settle(page: Page) -> None:
    """Let the browser draw what it was told, which takes software a while."""
    page.wait_for_timeout(4000)


def keep(page: Page, name: str) -> None:
    """Keep what a page shows as a small PNG."""
    image = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    image.quantize(COLOURS, dither=Image.Dither.NONE).save(PICTURES / f"{name}.png", optimize=True)


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__.partition("\n")[0]).parse_args()
    main()
