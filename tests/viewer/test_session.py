"""Sessions and panels, without a browser."""

import re
import threading
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest
from fake_browser import FakeClient, FakeGui, wait_until

from mocapdb.cycles import extract_cycle
from mocapdb.io import read_clip
from mocapdb.viewer.cleaned_clips import CleanedClips
from mocapdb.viewer.clip_choice import Choice
from mocapdb.viewer.comparisons import COMPARISONS
from mocapdb.viewer.cycle_panel import CyclePanel
from mocapdb.viewer.event_loop import EventLoop
from mocapdb.viewer.session import Session
from mocapdb.viewer.view_state import ViewState


class Opened:
    """A session in a browser that is not there."""

    def __init__(self, library, name):
        self.client = FakeClient()
        self.session = Session(self.client, library, name)
        self.session.start()
        wait_until(self.listens)
        self.send("stage 800 600 1200")  # as a browser does once it shows the panels
        assert self.session.view.name == name

    def listens(self):
        bridge = getattr(self.session, "_bridge", None)
        return bridge is not None and "stage" in bridge._takers

    def done(self):
        """Wait until everything asked for so far is done."""
        asked = threading.Event()
        self.session.loop.post(asked.set)
        assert asked.wait(300)

    def send(self, message):
        self.client.send(message)
        self.done()

    def click(self, label):
        self.client.gui.controls[label].fire()
        self.done()


@pytest.fixture
def opened(seen_library):
    browser = Opened(seen_library, "01_03")
    yield browser
    browser.session.close()
    browser.session.join(20)


def test_a_clip_is_opened_and_its_faults_follow(opened):
    view, text = opened.session.view, lambda: opened.client.gui.text
    assert view.playback.playing
    assert '<b class="mt-title">01_03</b>' in text()
    wait_until(lambda: view.digression_map is not None)
    opened.done()
    assert "mt-span" in text()
    opened.send("span 0")
    (span, *_) = view.digression_map.spans
    assert view.playback.time_s == pytest.approx(span.start / view.clip.fps)
    assert not view.playback.playing


def test_what_is_compared(opened):
    opened.send(f"compare {COMPARISONS[1]}")
    assert "decoded, off by 0 to" in opened.client.gui.text
    opened.send(f"compare {COMPARISONS[2]}")
    assert "repaired, moved by 0 to" in opened.client.gui.text
    opened.send("compare apples with pears")
    assert opened.client.notices[-1][0] == "That did not work"
    assert opened.session.view.comparison == COMPARISONS[2]


def test_a_range_is_selected_unless_it_is_a_click_that_slipped(opened):
    view = opened.session.view
    opened.send("range 0.5 0.85")
    assert view.selection == (0.5, 0.85)
    assert "01_03, 0.50 to 0.85 s." in opened.client.gui.text
    opened.send("range 0.5 0.75")
    assert view.selection is None
    opened.send("range 1 99")
    assert view.selection == (1.0, view.clip.duration_s)


def test_the_clock_is_set(opened):
    clock = opened.session.view.playback
    opened.send("toggle")
    assert not clock.playing
    opened.send("seek 1.5")
    assert clock.time_s == 1.5
    opened.send("step -1")
    assert clock.time_s == pytest.approx(1.5 - 1 / 30)
    opened.send("speed 0.3")
    assert clock.speed == 0.25
    opened.send("loop")
    opened.send("follow")
    assert (clock.loop, opened.session.view.follow) == (False, False)


def hits(opened):
    return [hit.record.name for hit in opened.session._query._hits]


def test_a_query_and_the_way_back(opened):
    opened.send("find")
    opened.send("hit 0")
    assert not opened.session.view.shows_clip
    assert "<td>left arm</td>" in opened.client.gui.text
    assert "linear-gradient" in opened.client.gui.text
    assert "back to the clip" in opened.client.gui.text
    opened.send("hit 99")  # there is none
    opened.send("back")
    assert opened.session.view.shows_clip
    assert opened.session.view.title == "01_03"


def test_hits_are_judged_and_searched_by_again(opened):
    text = lambda: opened.client.gui.text  # noqa: E731
    opened.send("k 5")
    opened.send("find")
    first, (liked, *_) = hits(opened), opened.session._query._hits
    assert "Search again" not in text()
    disliked = next(i for i, name in enumerate(first) if name == "01_02")
    opened.send("like 0")
    opened.send(f"like {disliked}")
    opened.send(f"unlike {disliked}")  # a second thought
    opened.send("like 99")  # there is none
    assert text().count('aria-label="like" aria-pressed=true') == 1
    opened.send("again")
    assert opened.session._query._hits[0] is liked
    assert "01_02" not in hits(opened)
    assert "unlike: " in text()
    opened.send("pardon 0")
    opened.send("again")
    assert "01_02" in hits(opened)
    opened.send("like 0")  # taken back
    assert "Search again" not in text()


def test_a_query_of_a_part_and_of_the_listed_clips(opened):
    opened.send("part right-leg")
    opened.send("part tail")  # there is none
    opened.send("listed")
    opened.send("search run")
    opened.send("find")
    assert set(hits(opened)) == {"01_02"}
    assert "right leg" in opened.client.gui.text
    assert "left arm</i>" not in opened.client.gui.text
    opened.send("go 0")
    view, (hit, *_) = opened.session.view, opened.session._query._hits
    assert (view.name, view.selection) == ("01_02", pytest.approx((hit.start_s, hit.end_s)))


def listed(opened):
    return re.findall('data-send="open ([^"]+)"', opened.client.gui.text)


def test_the_list_is_searched_and_narrowed(opened):
    every = listed(opened)
    assert len(every) == 4
    for messages, names in (
        (["search walking 01_0"], ["01_01", "01_03", "01_04"]),
        (["search jogs"], ["01_02"]),
        (["search walk run"], []),
        (["from duration 900"], []),
        (["from root_speed 0", "to root_speed 99"], every),
        (["choose 0 1"], ["01_02"]),  # the class of the fewest clips
        (["choose 0 1", "choose 0 1"], every),  # and all again
        (["choose 0 0", "choose 0 1"], ["01_02"]),
        (["within duration 2.4 2.4"], every),  # a click
        (["unfold 0"], every),
    ):
        for message in messages:
            opened.send(message)
        assert sorted(listed(opened)) == names, messages
        opened.send("clear")
        assert listed(opened) == every
    histogram = opened.session._facets._clips.histogram("root_speed", Choice())
    middle = (histogram.low + histogram.high) / 2
    opened.send(f"within root_speed {middle} {histogram.high}")
    assert listed(opened) == ["01_02"]
    assert opened.session.choice.ranges["root_speed"].high == float("inf")
    opened.send("from root_speed nan")
    assert "Expected numbers for root-speed" in opened.client.notices[-1][1]
    assert listed(opened) == ["01_02"]


def test_the_list_keeps_in_step_with_the_clip_that_is_open(opened, monkeypatch):
    row = lambda: f"#clip-{opened.session.view.record.id} "  # noqa: E731
    assert row() in opened.client.gui.text
    opened.send("next 1")
    assert opened.session.view.name == "01_04"
    opened.send("next 1")  # it is the last
    assert opened.session.view.name == "01_04"
    assert row() in opened.client.gui.text
    monkeypatch.setattr("mocapdb.viewer.clip_panel.PAGE_ROWS", 3)
    opened.send("open 01_01")
    opened.send("page 0")
    assert listed(opened) == ["01_01", "01_02", "01_03"]
    opened.send("page 1")
    assert listed(opened) == ["01_04"]
    opened.send("page 9")
    assert "4 to 4 of 4" in opened.client.gui.text
    opened.send("open 01_02")
    assert "01_02" in listed(opened)
    opened.send("search walk")
    opened.send("open 01_02")
    assert "is open, and not among these" in opened.client.gui.text


def test_columns_are_chosen_and_sorted_by(opened):
    heads = lambda: re.findall('data-send="sort ([^"]+)"', opened.client.gui.text)  # noqa: E731
    assert heads() == ["clip", "length", "speed", "turn"]
    for column in ("turn", "steps", "class", "clip", "nonsense"):
        opened.send(f"column {column}")
    assert heads() == ["clip", "length", "speed", "steps", "class"]
    opened.send("sort speed")
    opened.send("sort speed")
    assert listed(opened)[0] == "01_02"
    opened.send("sort turn")  # which is not shown
    opened.send("column speed")
    assert listed(opened) == ["01_01", "01_02", "01_03", "01_04"]


def test_the_left_panel_is_folded_where_there_is_little_room(opened):
    for window, folded in ((700, True), (1200, False)):
        chooser = opened.session._chooser = MagicMock()
        opened.session._stage_px = None
        opened.send(f"stage {window - 300} 600 {window}")
        opened.send(f"stage {window - 300} 600 100")  # only at first
        assert chooser.minimize.called == folded


def test_a_fault_is_told_and_the_session_goes_on(opened, capsys):
    opened.send("open nobody")
    opened.send("page one")  # not a number
    kind, said = opened.client.notices[-1]
    assert kind == "That did not work"
    assert "a fault of mocapdb's own" in said
    assert "ValueError" in capsys.readouterr().err
    opened.send("what no element sends")
    opened.send("open 01_02")
    assert opened.session.view.name == "01_02"


class Host:
    """All that a panel needs: see `PanelHost`."""

    def __init__(self, clip):
        self.library = SimpleNamespace(classes=lambda: {"walk": 3})
        self.view = ViewState(clip=clip)
        self.loop = SimpleNamespace(post=lambda do: do(), post_latest=lambda what, do: do())
        self.files, self.said, self.shown = {}, [], []

    def say(self, text):
        self.said.append(text)

    def download(self, name, content):
        self.files[name] = content

    def show_aside(self, stage, title, *, keep_camera):
        self.shown.append((stage, title))


def test_a_cycle_is_exported_at_the_rate_of_the_cmu_database(synthetic_walk, tmp_path):
    host, gui = Host(synthetic_walk), FakeGui()
    CyclePanel(host, gui)
    gui.controls["Export"].fire()
    ((name, content),) = host.files.items()
    (tmp_path / name).write_bytes(content)
    assert read_clip(tmp_path / name).fps == pytest.approx(120, rel=1e-3)


def test_the_cycle_of_a_class_is_a_mean_of_six_clips(synthetic_walk, monkeypatch):
    asked = []

    def class_cycle(library, label, *, most_clips):
        asked.append((label, most_clips))
        return extract_cycle(synthetic_walk)

    monkeypatch.setattr("mocapdb.library.searching.class_cycles.class_cycle", class_cycle)
    host, gui = Host(None), FakeGui()
    CyclePanel(host, gui)
    gui.controls["cycle"].value = "walk"
    for _ in range(2):  # found once
        gui.controls["Play the cycle"].fire()
    assert asked == [("walk", 6)]
    assert [title for _, title in host.shown] == [f"cycle of {synthetic_walk.name}"] * 2


# -- filling ---------------------------------------------------------------------------------------


def captured(opened):
    return set(re.findall('data-send="captured ([^"]+)" aria-pressed=true', opened.client.gui.text))


def fill(opened):
    """Ask for a clip to be filled, and wait for what comes of it."""
    opened.send("fill")
    panel = opened.session._fill
    wait_until(lambda: panel._reading is None or not panel._state)
    opened.done()


def test_nine_joints_bring_the_others_along(opened, tmp_path):
    nine = captured(opened)
    assert {"lfemur", "rradius"} < nine
    assert len(nine) == 9
    assert "Save the filled clip" not in opened.client.gui.text
    opened.send("open 01_01")
    fill(opened)
    text = opened.client.gui.text
    assert "filled from 3 clips, 8 s of motion" in text
    assert "Off by" in text
    assert "on 3 of these clips" in text
    assert "filled, apart by 0 to" in text
    rows = dict(re.findall(r"<tr><td>(\w+)</td><td class=mt-number>([\d.]+)°", text))
    assert not nine & set(rows)
    assert 0 < float(rows["lfoot"]) < 40
    opened.send("fill-view beside it")
    assert not opened.session.view.shows_clip
    for suffix in ("doc", "npz"):  # the first is no format
        opened.send(f"fill-format {suffix}")
    opened.send("fill-save")
    (tmp_path / "filled.npz").write_bytes(opened.client.files["01_01-filled.npz"])
    made, before = read_clip(tmp_path / "filled.npz"), opened.session.view.clip
    skeleton = before.skeleton
    changed = {
        name
        for joint, name in enumerate(skeleton.names)
        if not np.array_equal(
            made.channels[:, skeleton.rotation_columns(joint)],
            before.channels[:, skeleton.rotation_columns(joint)],
        )
    }
    assert {"lfoot", "thorax"} < changed
    assert not changed & {"root", *nine}
    opened.send("open 01_04")  # what was filled is forgotten, what was chosen is not
    assert captured(opened) == nine
    assert "Save the filled clip" not in opened.client.gui.text


def test_joints_to_fill_are_chosen_one_by_one_from_clips_that_are_listed(opened):
    opened.send("captured-every")
    assert "0 are to be filled" in opened.client.gui.text
    opened.send("fill")
    assert "others to be filled, but" in opened.client.notices[-1][1]
    opened.send("captured lfoot")
    opened.send("captured tail")  # there is none
    assert "1 are to be filled" in opened.client.gui.text
    opened.send("fill-from listed clips")
    opened.send("fill-from nowhere")
    opened.send("search run")
    fill(opened)
    assert "filled from 1 clips" in opened.client.gui.text
    assert "The error to expect is not known" in opened.client.gui.text
    opened.send("open 01_02")
    opened.send("fill")
    assert "among listed clips, but there is none" in opened.client.notices[-1][1]
    opened.send("captured-none")
    assert captured(opened) == set()


def test_a_body_is_filled_from_two_hundred_clips_at_most(opened, monkeypatch):
    monkeypatch.setattr("mocapdb.viewer.fill_panel.FILLING_CLIPS", 2)
    fill(opened)
    assert "filled from 2 clips, 5 s of motion, of 3 that have these joints" in (
        opened.client.gui.text
    )


def test_another_clip_that_is_opened_ends_the_filling(opened):
    opened.session.loop.post(opened.session._fill._start)
    opened.send("open 01_04")
    opened.done()
    panel = opened.session._fill
    assert panel._reading is None
    assert panel._filled is None
    assert opened.session.view.shows_clip


# -- the parts of a session ------------------------------------------------------------------------


def test_of_what_waits_under_one_name_only_the_last_is_done():
    loop, done = EventLoop("test", lambda problem: done.append(str(problem))), []
    for i in range(3):
        loop.post_latest("seek", lambda i=i: done.append(i))
        loop.post(lambda i=i: done.append(-i))
    loop.post(lambda: 1 / 0)
    loop.background(lambda: "long", done.append)
    wait_until(lambda: loop._queue.qsize() == 6)
    loop.close()
    loop.run(lambda passed: None, lambda: False)
    assert done == [2, 0, -1, -2, "division by zero", "long"]


def test_frames_are_drawn_while_something_plays():
    loop, passed = EventLoop("test", lambda problem: None), []

    def tick(seconds):
        passed.append(seconds)
        if len(passed) == 4:
            loop.close()

    loop.run(tick, lambda: True)
    assert len(passed) == 4
    assert all(seconds > 0 for seconds in passed)


def test_the_last_few_clips_are_kept_and_the_flags_of_all():
    cache, cleaned = CleanedClips(), SimpleNamespace(digression_map=SimpleNamespace(spans=(1, 2)))
    for i in range(9):
        cache.keep(f"{i}", cleaned)
    assert [i for i in range(9) if cache.get(f"{i}") is None] == [0]
    assert cache.flags == {f"{i}": 2 for i in range(9)}
