from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest

from mocapdb.cleaning import clean_clip
from mocapdb.cleaning.map.digression_map import Span
from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError
from mocapdb.plots import before_and_after, digression_map
from mocapdb.plots.fault_plots import _unwrapped

mpl.use("Agg")


@pytest.fixture(scope="module")
def cleaned():
    walk = synthetic.make_clip("walk", seed=1)
    faulty = synthetic.inject_faults(walk, seed=1, kinds=["offset"], n=1, size_deg=50).clip
    return faulty, clean_clip(faulty)


def test_the_map_has_joint_names_seconds_and_spans(cleaned):
    from matplotlib import pyplot

    _, result = cleaned
    ax = digression_map(result.digression_map)
    labels = [label.get_text() for label in ax.get_yticklabels()]
    assert "lfemur" in labels
    assert "lhipjoint" not in labels  # it cannot turn
    assert ax.get_xlim() == (0.0, 5.0)
    assert len(ax.patches) == 1
    assert "offset" in ax.texts[0].get_text()
    pyplot.close("all")


def test_before_and_after(cleaned):
    from matplotlib import pyplot

    faulty, result = cleaned
    joint = result.digression_map.spans[0].joint
    ax = before_and_after(faulty, result.clip, joint, spans=result.digression_map.spans)
    assert faulty.skeleton.names[joint] in ax.get_title(loc="left")
    pyplot.close("all")
    with pytest.raises(ClipError, match="differ"):
        before_and_after(faulty, result.clip[:10], joint)
    with pytest.raises(ClipError, match="does not"):
        before_and_after(faulty, result.clip, faulty.skeleton.joint("lhipjoint"))


def test_joints_that_never_move_are_left_out_unless_flagged(cleaned):
    from matplotlib import pyplot

    found = cleaned[1].digression_map
    quats = found.texture.quat_xyzw.copy()
    row = found.texture.names.index("lradius")
    quats[:, row] = quats[0, row]
    still = replace(found, texture=replace(found.texture, quat_xyzw=quats))

    def labels(drawn):
        return [label.get_text() for label in digression_map(drawn).get_yticklabels()]

    assert "lradius" in labels(found)
    assert "lradius" not in labels(still)
    joint = found.skeleton.joint("lradius")
    assert "lradius" in labels(replace(still, spans=(Span(3, 4, joint, 0.9, "offset"),)))
    pyplot.close("all")


def test_a_fault_of_one_frame_is_seen_in_a_long_clip(cleaned):
    from matplotlib import pyplot

    found = cleaned[1].digression_map
    joint, frame = found.skeleton.joint("lfemur"), 31_111
    scores = np.zeros((72_000, found.skeleton.n_joints))
    scores[frame, joint] = 0.9
    span = Span(frame, frame + 1, joint, 0.9, "offset")
    drawn = []
    for spans in ((), (span,)):
        ax = digression_map(replace(found, scores=scores, spans=spans))
        shown = ax.images[0].get_array()
        assert shown.max() == 0.9  # not lost between the pixels
        assert shown.shape[1] <= 700
        ax.figure.canvas.draw()
        drawn.append(np.asarray(ax.figure.canvas.buffer_rgba())[..., :3].astype(int))
    assert (np.abs(drawn[1] - drawn[0]).sum(axis=2) > 100).sum() > 20  # pixels of its frame
    frame_s = ax.patches[0].get_x() + ax.patches[0].get_width() / 2
    assert frame_s == pytest.approx(frame / 120, abs=1.5)
    pyplot.close("all")


def test_before_and_after_zooms_and_unwraps(cleaned):
    from matplotlib import pyplot

    faulty, _ = cleaned
    joint = faulty.skeleton.joint("lfemur")
    column = faulty.skeleton.rotation_columns(joint)[0]
    before = faulty.channels.copy()
    before[:, column] = (170.0 + 0.1 * np.arange(len(faulty)) + 180.0) % 360.0 - 180.0
    after = before.copy()
    after[200:210, column] += 1.0
    after[:, column] += 360.0
    span = Span(200, 210, joint, 0.9, "offset")
    ax = before_and_after(
        faulty.replace(channels=before), faulty.replace(channels=after), joint, spans=[span],
        around=span,
    )  # fmt: skip
    low, high = ax.get_xlim()
    assert high - low < 1.5
    assert low < 200 / 120 < 210 / 120 < high
    lines = [line.get_ydata() for line in ax.lines if len(line.get_ydata()) > 2]
    assert all(np.abs(np.diff(line)).max() < 90 for line in lines)
    apart = [np.abs(a - b).max() for a, b in zip(lines[::2], lines[1::2], strict=True)]
    assert max(apart) == pytest.approx(1.0)
    pyplot.close("all")


def test_what_a_fault_took_round_is_drawn_together_outside_of_it():
    """A faulty angle that goes round once comes out a whole turn off, the repair does not."""
    right = np.linspace(0.0, 20.0, 40)
    wrong = right.copy()
    wrong[10:20] += np.linspace(30.0, 360.0, 10)
    wrong[10:20] = (wrong[10:20] + 180.0) % 360.0 - 180.0
    old, new = _unwrapped(wrong, right)
    outside = np.r_[0:10, 20:40]
    np.testing.assert_array_equal(old[outside], new[outside])
    np.testing.assert_allclose(new, right)
    assert np.abs(np.diff(old[:19])).max() < 90


def test_a_translation_that_was_repaired_is_drawn(cleaned):
    from matplotlib import pyplot

    faulty, _ = cleaned
    channels = faulty.channels.copy()
    channels[50, 0] += 1.0
    ax = before_and_after(faulty, faulty.replace(channels=channels), 0)
    assert "translation" in ax.get_ylabel()
    pyplot.close("all")
