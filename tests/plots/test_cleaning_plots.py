import matplotlib as mpl
import pytest

from mocapdb.cleaning import clean_clip
from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError
from mocapdb.plots import before_and_after, digression_map

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
