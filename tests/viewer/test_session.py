"""Sessions and panels, without a browser."""

import threading
from types import SimpleNamespace

import pytest
from fake_browser import FakeClient, FakeGui, wait_until

from mocapdb.cycles import extract_cycle
from mocapdb.io import read_clip
from mocapdb.viewer.cleaned_clips import CleanedClips
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
        wait_until(lambda: self.session.view.name == name)
        self.done()

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


def test_a_query_and_the_way_back(opened):
    opened.click("Find this")
    opened.send("hit 0")
    assert not opened.session.view.shows_clip
    assert "back to the clip" in opened.client.gui.text
    opened.send("hit 99")  # there is none
    opened.send("back")
    assert opened.session.view.shows_clip
    assert opened.session.view.title == "01_03"


def test_a_fault_is_told_and_the_session_goes_on(opened, capsys):
    opened.send("open nobody")
    opened.send("sort clip")  # not a number
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
