"""The viewer and the report, in a real browser; every wait is for a condition."""

import io
import re

import numpy as np
import pytest
from PIL import Image

from mocapdb.cycles import cycle_of_loop
from mocapdb.io import read_clip
from mocapdb.scenes import write_animation

pytest.importorskip("viser", reason="viser is not installed")
PATIENCE_MS = 60_000  # software rendering on a busy machine
COARSE = "&fixedDpr=0.4"  # viser draws fewer pixels: there is no graphics card to do it
STAGE = {"x": 226, "y": 0, "width": 380, "height": 200}
TIME = (
    "parseFloat(getComputedStyle(document.querySelector('.mt-clock'), '::after').content.slice(1))"
)


@pytest.fixture(scope="module")
def viewer(seen_library, tmp_path_factory):
    from mocapdb.viewer import Viewer

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MOCAPDB_CACHE", str(tmp_path_factory.mktemp("cache")))
        with Viewer(seen_library, port=0) as opened:
            yield opened


class Watched:
    """A page, and all that it asked for and complained about."""

    def __init__(self, browser, url):
        self.page = browser.new_context(viewport={"width": 1000, "height": 520}).new_page()
        self.page.set_default_timeout(PATIENCE_MS)
        self.requests, self.complaints = [], []
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on(
            "console",
            lambda line: self.complaints.append(line.text) if line.type == "error" else None,
        )
        self.page.goto(url)

    def time(self):
        return self.page.evaluate(TIME)

    def pause(self):
        if self.page.locator(".mt-play[aria-label=pause]").count():
            self.page.click(".mt-play")
            self.page.wait_for_selector(".mt-play[aria-label=play]")

    def play(self):
        if self.page.locator(".mt-play[aria-label=play]").count():
            self.page.click(".mt-play")
        self.page.wait_for_selector(".mt-play[aria-label=pause]")

    def open(self, name):
        if self.page.locator(".mt-title").inner_text() == name:
            return
        self.page.get_by_role("tab", name="Clips").click()
        self.page.click(f"tr[data-send='open {name}']")
        self.page.wait_for_selector(f".mt-title:text-is('{name}')")

    def settled(self, selector):
        """Where an element is when it has stopped moving; panels are laid out a little later."""
        same, box = 0, None
        while same < 5:
            now = self.page.locator(selector).bounding_box()
            same = same + 1 if now == box else 0
            box = now
            self.page.evaluate("new Promise(requestAnimationFrame)")
        return box

    def stage(self):
        """The upper left of the window, where nothing but the stage is, once it stands still."""
        picture = self.page.screenshot(clip=STAGE)
        return np.asarray(Image.open(io.BytesIO(picture)).convert("RGB")).astype(int)

    def stage_other_than(self, before):
        """The stage when it has changed; the browser may draw later than it is told."""
        for _ in range(40):
            now = self.stage()
            if (np.abs(now - before).max(axis=2) > 40).sum() > 200:
                return now
        raise AssertionError("nothing on the stage has moved")

    def close(self):
        self.page.context.close()


@pytest.fixture(scope="module")
def watched(browser, viewer):
    opened = Watched(browser, viewer.url + COARSE)
    opened.page.wait_for_selector(".mt-bar")
    # viser says that there is no graphics card, over the stage
    opened.page.locator(".mantine-Notification-closeButton").first.click()
    yield opened
    opened.close()


def field(page, label):
    """The input of viser's beside a label."""
    return page.locator(f"div:has(> div > p > label:text-is('{label}')) input:visible")


def speed(page):
    """What the panel says about the cycle."""
    return page.locator("text=/s a lap/").inner_text()


def names(page):
    return page.locator(".mt-clips tbody tr b").all_inner_texts()


def test_the_list_filters_and_sorts(watched):
    page = watched.page
    watched.pause()
    assert names(page) == ["01_01", "01_02", "01_03", "01_04"]
    search = page.locator(".mt-search")
    search.fill("run")
    page.wait_for_selector("text=1 clips")
    assert names(page) == ["01_02"]
    search.fill("")
    page.wait_for_selector("text=4 clips")
    page.click("th:text-is('clip▲')")
    page.wait_for_selector("th:text-is('clip▼')")
    assert names(page) == ["01_04", "01_03", "01_02", "01_01"]
    page.get_by_role("button", name="Look for faults in these").click()
    page.wait_for_selector("tr:has-text('01_03') td:last-child:text-matches('[1-9]')")
    page.click("th:text-is('clip▼')")
    page.wait_for_selector("th:text-is('clip▲')")


def drag(page, box, start, end):
    """Drag along a strip or a histogram, from one share of it to another."""
    y = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + start * box["width"], y)
    page.mouse.down()
    page.mouse.move(box["x"] + end * box["width"], y)
    page.mouse.up()


def test_clips_are_chosen_by_what_was_measured(watched):
    page = watched.page
    drag(page, watched.settled("[data-verb='within root_speed']"), 0.5, 1.0)
    page.wait_for_selector("text=1 of 4 clips")
    assert names(page) == ["01_02"]
    page.get_by_label("speed from").fill("0.1")
    page.get_by_label("speed from").press("Enter")
    page.wait_for_selector("text=4 of 4 clips")
    page.click("[data-send=clear]")
    page.click("[data-send='choose 0 1']")
    page.wait_for_selector("text=1 of 4 clips")
    page.click("[data-send=clear]")
    page.wait_for_selector("text=4 of 4 clips")


def test_pictures_are_shown_and_play_under_the_mouse(watched):
    page = watched.page
    page.wait_for_function(
        "[...document.querySelectorAll('.mt-picture')].every(image => image.naturalWidth > 0)"
    )
    picture = page.locator("tr[data-send='open 01_02'] img")
    still = picture.get_attribute("src")
    picture.hover()
    page.wait_for_selector("img[src^='pictures/loop/']")
    page.mouse.move(400, 10)
    page.wait_for_selector(f"img[src='{still}']")
    assert page.locator("img[src^='pictures/loop/']").count() == 0


def test_a_picture_that_does_not_come_is_asked_for_again(watched):
    page = watched.page
    failing = re.compile(r"pictures/loop/")
    page.route(failing, lambda route: route.fulfill(status=503))
    picture = page.locator("tr[data-send='open 01_03'] img")
    picture.hover()
    page.wait_for_function("document.querySelector('img[src*=loop]')?.style.opacity === '0'")
    page.unroute(failing)
    page.wait_for_function(
        "(i => i?.naturalWidth > 0 && i.style.opacity === '')"
        "(document.querySelector('img[src*=loop]'))"
    )
    page.mouse.move(400, 10)
    watched.complaints.clear()  # of the browser's, that it got no picture


def test_a_clip_plays(watched):
    watched.open("01_01")
    watched.play()
    first = watched.stage()
    before = watched.time()
    watched.page.wait_for_function(f"Math.abs({TIME} - {before}) > 0.2")
    watched.stage_other_than(first)
    watched.pause()


def test_two_clicks_at_once_both_count(watched):
    watched.open("01_01")
    watched.pause()
    buttons = "[...document.querySelectorAll('[data-send=loop], [data-send=follow]')]"
    state = f"{buttons}.map(e => e.outerHTML)"
    before = watched.page.evaluate(state)
    assert len(before) == 2
    for wanted in ("!==", "==="):  # and back
        watched.page.evaluate(f"{buttons}.forEach(e => e.click())")
        watched.page.wait_for_function(
            f"before => {state}.length === 2 && {state}.every((e, i) => e {wanted} before[i])",
            arg=before,
        )


def test_a_click_on_a_flagged_span_goes_there(watched):
    watched.open("01_03")
    span = watched.page.locator(".mt-span").first
    span.wait_for()
    title = span.get_attribute("title")
    label = watched.page.locator(".mt-flags button", has_text=title).first.inner_text()
    start = float(re.search(r"([\d.]+) s$", label)[1])
    span.click()
    watched.page.wait_for_function(f"Math.abs({TIME} - {start}) < 0.011")
    watched.page.wait_for_selector(".mt-play[aria-label=play]")


def test_before_and_repaired_beside_each_other(watched):
    watched.open("01_03")
    watched.page.select_option("[data-choose=compare]", "before beside repaired")
    watched.page.wait_for_selector(".mt-key:has-text('repaired, moved by 0 to')")
    watched.page.select_option("[data-choose=compare]", "original beside decoded")
    watched.page.wait_for_selector(".mt-key:has-text('decoded, off by 0 to')")
    watched.pause()


def test_a_selection_becomes_a_query(watched):
    page = watched.page
    watched.open("01_01")
    watched.pause()
    page.get_by_role("tab", name="Query").click()
    drag(page, watched.settled(".mt-strip"), 0.2, 0.6)
    page.wait_for_selector("text=/01_01, 0.[45]\\d to 1.[45]\\d s/")
    page.get_by_role("button", name="Find this").click()
    page.wait_for_selector(".mt-card")
    assert page.locator(".mt-card small").first.inner_text().startswith("walk")
    runs = page.locator(".mt-card", has_text="01_02")
    assert runs.count()
    runs.first.locator("[aria-label=unlike]").click()
    page.get_by_role("button", name="Search again").click()
    page.wait_for_selector("text=/^unlike: 01_02/")
    assert runs.count() == 0
    page.click(".mt-card[data-send='hit 0'] img")
    page.wait_for_selector(".mt-key:has-text('query')")
    page.wait_for_selector(".mt-why")
    assert page.locator(".mt-key").count() == 2
    page.click("[data-send=back]")
    page.wait_for_selector(".mt-title:text-is('01_01')")
    watched.pause()


def test_the_blend_changes_the_pose(watched, tmp_path):
    page = watched.page
    page.get_by_role("tab", name="Cycles").click()
    page.get_by_role("button", name="Play the cycle").click()
    page.wait_for_selector(".mt-title:text-is('cycle of 01_01')")
    watched.pause()
    field(page, "blend with").first.click()
    page.get_by_role("option", name="run", exact=True).click()
    page.wait_for_selector(".mt-title:has-text('run')")
    watched.pause()
    walking = watched.stage()
    period = speed(page)
    field(page, "blend").last.fill("1")
    page.wait_for_function(
        "(was) => [...document.querySelectorAll('.mt-list p')].some("
        "p => p.innerText.includes('s a lap') && p.innerText !== was)",
        arg=period,
    )
    watched.pause()
    watched.stage_other_than(walking)
    with page.expect_download() as download:
        page.get_by_role("button", name="Export").click()
    path = tmp_path / download.value.suggested_filename
    download.value.save_as(path)
    run = cycle_of_loop(read_clip(path))
    assert run.period_s == pytest.approx(float(re.match(r"[\d.]+", speed(page))[0]), abs=0.02)


def test_a_body_is_filled_beside_its_capture(watched, tmp_path):
    page = watched.page
    watched.open("01_01")
    watched.pause()
    page.get_by_role("tab", name="Fill").click()
    page.click("[data-send=captured-nine]")
    page.click("[data-send='captured lfoot']")  # captured, too
    page.wait_for_selector("text=/10 joints were captured/")
    page.click("[data-send=fill]")
    page.wait_for_selector(".mt-key:has-text('filled, apart by 0 to')")
    watched.pause()
    over = watched.stage()
    page.select_option("[data-choose=fill-view]", "beside it")
    watched.stage_other_than(over)
    assert page.locator(".mt-filled td:text-is('rfoot')").count() == 1
    assert page.locator(".mt-filled td:text-is('lfoot')").count() == 0
    with page.expect_download() as download:
        page.click("[data-send=fill-save]")
    path = tmp_path / download.value.suggested_filename
    download.value.save_as(path)
    assert path.name == "01_01-filled.bvh"
    assert read_clip(path).duration_s == pytest.approx(2.5, abs=0.02)
    page.click("[data-send=back]")
    page.wait_for_selector(".mt-title:text-is('01_01')")
    watched.pause()


def test_browsers_do_not_disturb_each_other(watched, browser, viewer):
    watched.open("01_04")
    watched.pause()
    other = Watched(browser, viewer.url + COARSE)
    try:
        other.page.wait_for_selector(".mt-bar")
        other.open("01_02")
        assert watched.page.locator(".mt-title").inner_text() == "01_04"
        assert watched.page.locator(".mt-play").get_attribute("aria-label") == "play"
    finally:
        other.close()


def test_nothing_was_asked_for_from_outside(watched, viewer):
    assert watched.requests
    ours = (viewer.url.partition("?")[0], "data:", "blob:")
    assert [url for url in watched.requests if not url.startswith(ours)] == []
    assert watched.complaints == []


# -- the report and exported pages -----------------------------------------------------------------


def test_the_report_opens_from_a_file(browser, seen_report):
    path, _ = seen_report
    opened = Watched(browser, path.as_uri())
    try:
        page = opened.page
        assert page.locator("section").count() == 6
        page.locator("#clips th button", has_text="speed").click()
        values = [float(v) for v in page.locator("#clips td:nth-child(5)").all_inner_texts()]
        assert values == sorted(values)
        page.locator(".stage").first.scroll_into_view_if_needed()
        page.wait_for_function("Number(document.querySelector('.stage').dataset.frame) > 1")
        assert page.evaluate("[...document.images].every(image => image.naturalWidth > 0)")
        assert [
            url for url in opened.requests if not url.startswith(("data:", path.as_uri()))
        ] == []
        assert opened.complaints == []
    finally:
        opened.close()


def test_an_exported_page_plays(browser, synthetic_walk, tmp_path):
    path = tmp_path / "walk.html"
    write_animation(synthetic_walk, path)
    opened = Watched(browser, path.as_uri())
    try:
        page = opened.page
        page.wait_for_function("Number(document.querySelector('.stage').dataset.frame) > 2")
        page.locator(".stage-bar button").click()
        page.locator("canvas").press("ArrowRight")
        page.locator(".stage-bar input").evaluate(
            "slider => { slider.value = 30; slider.dispatchEvent(new Event('input')); }"
        )
        page.wait_for_function("document.querySelector('.stage').dataset.frame === '30.00'")
        assert opened.requests == [path.as_uri()]
        assert opened.complaints == []
    finally:
        opened.close()
