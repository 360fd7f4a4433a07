"""What is clicked reaches a session once each, in order, however quickly."""

import json

import pytest
from fake_browser import FakeGui

pytest.importorskip("viser", reason="viser is not installed")


class Loop:
    """An event loop that does everything at once."""

    def post(self, action):
        action()

    def post_latest(self, what, action):
        action()


@pytest.fixture
def told():
    """What is done with a value of the field, and what was done."""
    from mocapdb.viewer.bridge import Bridge

    gui, done = FakeGui(), []
    bridge = Bridge(gui, Loop())
    bridge.on("like", done.append)

    def tell(value):
        field = gui.controls["messages"]
        field.value = value
        field.fire()
        return done

    return tell


def test_two_clicks_in_one_value_both_count(told):
    assert told(json.dumps([[1, "like 0"], [2, "like 1"]])) == ["0", "1"]


def test_what_was_seen_is_passed_over(told):
    told(json.dumps([[1, "like 0"]]))
    assert told(json.dumps([[1, "like 0"], [2, "like 0"], [3, "like 2"]])) == ["0", "0", "2"]
    assert told(json.dumps([[2, "like 0"]])) == ["0", "0", "2"]  # it came late


@pytest.mark.parametrize("value", ["", "1 like 0", "[1]", '[["one", "like 0"]]', '[[9, "hate 0"]]'])
def test_what_is_not_ours_does_nothing(told, value):
    assert told(value) == []
