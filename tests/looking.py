"""A browser, a small library with a fault in it, and a viewer that serves it."""

from __future__ import annotations

import shutil

import pytest
from small_library import build

from mocapdb.corpus import synthetic
from mocapdb.io import write_clip
from mocapdb.library import Library
from mocapdb.report import Effort, write_report

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)
FAULTY = "01_03"


@pytest.fixture(scope="session")
def browser():
    """A headless browser; a test that needs it is skipped where there is none."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        pytest.skip(f"no browser here: install one of {', '.join(BROWSERS)}")
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=path, args=list(FLAGS))
        yield opened
        opened.close()


@pytest.fixture(scope="session")
def seen_library(tmp_path_factory):
    """Three walks, one of them with faults, and a run, of one body, ready for queries."""
    root = tmp_path_factory.mktemp("seen")
    body = synthetic.make_skeleton()
    for name, kind in (("01_01", "walk"), ("01_02", "run"), (FAULTY, "walk"), ("01_04", "walk")):
        clip = synthetic.make_clip(kind, seed=int(name[-1]), skeleton=body, duration_s=2.5)
        if name == FAULTY:
            clip = synthetic.inject_faults(
                clip, seed=3, kinds=("offset",), size_deg=50, length_s=0.3, n=1
            ).clip
        folder = root / "corpus" / kind
        folder.mkdir(parents=True, exist_ok=True)
        write_clip(clip, folder / f"{name}.bvh")
    library = root / "seen.mocapdb"
    build(root / "corpus", library, index=True)
    return library


@pytest.fixture(scope="session")
def seen_report(seen_library, tmp_path_factory):
    """Its report, and what is said about that."""
    path = tmp_path_factory.mktemp("report") / "report.html"
    with Library(seen_library) as library:
        figures = write_report(library, path, effort=Effort(curves=1, cycle_clips=1))
    return path, figures
