"""The parts of the viewer that need no browser."""

import math
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from small_library import run

from mocapdb.cleaning import detect_faults
from mocapdb.corpus import synthetic
from mocapdb.errors import LibraryError, MissingExtraError, UnknownClipError
from mocapdb.library import Library
from mocapdb.viewer.bodies import rotations_from_up
from mocapdb.viewer.clip_choice import ClipChoice
from mocapdb.viewer.clip_panel import COLUMNS, ordered
from mocapdb.viewer.panel import breakable
from mocapdb.viewer.playback import Playback
from mocapdb.viewer.timeline_panel import map_image, map_rows


def test_playing_loops_or_ends():
    clock = Playback()
    clock.restart(2.0, playing=True)
    clock.speed = 2.0
    clock.advance(0.75)
    assert clock.time_s == pytest.approx(1.5)
    clock.advance(0.5)
    assert clock.time_s == pytest.approx(0.5)
    clock.loop = False
    clock.advance(5.0)
    assert (clock.time_s, clock.playing) == (2.0, False)
    clock.toggle()
    assert (clock.time_s, clock.playing) == (0.0, True)


def test_a_time_outside_is_the_nearest_inside():
    clock = Playback()
    clock.restart(1.0, playing=False)
    for asked, got in ((-3.0, 0.0), (0.4, 0.4), (9.0, 1.0)):
        clock.seek(asked)
        assert clock.time_s == got
    clock.advance(0.3)
    assert clock.time_s == 1.0
    clock.restart(0.0, playing=True)  # a single frame
    clock.advance(0.3)
    assert clock.time_s == 0.0


def test_the_list_is_sorted_by_any_column(seen_library):
    with Library(seen_library) as library:
        clips = ClipChoice(library)
    rows = range(len(clips.records))
    speeds = COLUMNS["speed"].value(clips, {})
    fastest, *_ = ordered(speeds, rows, down=True)
    assert (clips.records[fastest].label, speeds[fastest] > 2) == ("run", True)
    for column in COLUMNS.values():
        values = column.value(clips, {"01_03": 2, "01_01": 0})
        known = [row for row in rows if values[row] == values[row]]  # no NaN
        up, down = ([values[row] for row in ordered(values, known, down=d)] for d in (False, True))
        assert up == sorted(up)
        assert down == up[::-1]


def test_what_is_unknown_comes_last_and_what_is_the_same_by_name():
    assert ordered([math.nan, 2.0, 1.0, 2.0], [3, 2, 1, 0], down=False) == [2, 1, 3, 0]
    assert ordered([math.nan, 2.0, 1.0, 2.0], [3, 2, 1, 0], down=True) == [1, 3, 2, 0]
    assert ordered(["", "b", "a"], [0, 1, 2], down=True) == [1, 2, 0]


def test_long_names_may_break():
    assert breakable("a_b<c/d.e") == "a_<wbr>b&lt;c/<wbr>d.<wbr>e"


def test_bones_are_turned_along_their_way():
    rng = np.random.default_rng(0)
    ways = np.vstack([rng.normal(size=(50, 3)), np.eye(3), -np.eye(3)])
    turned = Rotation.from_quat(np.roll(rotations_from_up(ways), -1, axis=1)).apply([0, 1, 0])
    np.testing.assert_allclose(
        turned, ways / np.linalg.norm(ways, axis=1, keepdims=True), atol=1e-7
    )
    np.testing.assert_allclose(rotations_from_up(np.zeros((1, 3))), [[1, 0, 0, 0]])


def test_the_map_shows_flagged_joints(synthetic_walk):
    faulty = synthetic.inject_faults(
        synthetic_walk, seed=3, kinds=("offset",), size_deg=50, length_s=0.3, n=1
    )
    digression = detect_faults(faulty.clip)
    rows = map_rows(digression)
    assert {span.joint for span in digression.spans} <= set(rows)
    assert rows == sorted(rows)
    assert map_image(digression.scores[:, rows]).startswith("data:image/png;base64,")


def test_what_cannot_be_viewed(seen_library, tmp_path):
    pytest.importorskip("viser")
    from mocapdb.viewer import Viewer

    with pytest.raises(LibraryError):
        Viewer(tmp_path, port=0)
    with pytest.raises(UnknownClipError):
        Viewer(seen_library, port=0, clip="nobody")
    with pytest.raises(LibraryError, match="free port"):
        Viewer(seen_library, host="203.0.113.1")


def test_viser_is_asked_for(seen_library, monkeypatch):
    from mocapdb.viewer import Viewer

    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'mocapdb\[viewer\]'"):
        Viewer(seen_library)
    result = run("view", seen_library)
    assert result.exit_code == 1
    assert "mocapdb[viewer]" in result.stderr
