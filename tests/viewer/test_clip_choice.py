"""Choosing clips in the viewer is what `Library.records` does, and counts are of what is left."""

import math
from collections import Counter

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.errors import LibraryError
from mocapdb.io import write_clip
from mocapdb.library import Library
from mocapdb.library.facets import FacetRange
from mocapdb.viewer.clip_choice import BARS, CLASS, Choice, ClipChoice


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """Clips of two classes, three styles and two subjects; of one of them little is known."""
    from small_library import build

    root = tmp_path_factory.mktemp("chosen")
    rows = ["path,label,description,style"]
    for i, (kind, style) in enumerate(
        [("walk", "old"), ("walk", "young"), ("run", "old"), ("run", ""), ("walk", "proud")]
    ):
        path = f"{1 + i % 2:02}_{i:02}.bvh"
        (root / "corpus").mkdir(exist_ok=True)
        clip = synthetic.make_clip(kind, seed=i, duration_s=0.6 + 0.2 * i)
        write_clip(clip, root / "corpus" / path)
        rows.append(f"{path},{kind},number {i},{style}")
    (root / "corpus" / "LABELS.csv").write_text("\n".join(rows) + "\n")
    build(root / "corpus", root / "chosen.mocapdb", index=True)
    with Library(root / "chosen.mocapdb") as opened:
        yield opened


CHOICES = (
    Choice(),
    Choice(text="jog"),
    Choice(text="number walking"),
    Choice(values={CLASS: "run"}),
    Choice(values={CLASS: "run", "style": "old"}),
    Choice(values={"subject": "02"}),
    Choice(ranges={"root_speed": FacetRange(2.0)}),
    Choice(ranges={"duration": FacetRange(0.7, 1.1), "turn": FacetRange(-90, 90)}),
    Choice(text="walk", values={"style": "proud"}, ranges={"contacts": FacetRange(0)}),
    Choice(flagged=False),
)


@pytest.mark.parametrize("choice", CHOICES, ids=str)
def test_the_same_clips_as_of_the_catalogue(library, choice):
    clips, asked = ClipChoice(library), choice.filter()
    expected = library.records(
        label=asked.label, search=asked.text, where=asked.where, facets=asked.facets,
        flagged=asked.flagged,
    )  # fmt: skip
    assert [clips.records[row].name for row in clips.rows(choice)] == [r.name for r in expected]


@pytest.mark.parametrize("choice", CHOICES, ids=str)
def test_counts_are_of_what_fits_all_else(library, choice):
    clips = ClipChoice(library)
    for column in clips.columns:
        others = {name: value for name, value in choice.values.items() if name != column}
        rows = clips.rows(Choice(choice.text, others, choice.ranges, choice.flagged))
        expected = Counter(clips.columns[column][row] for row in rows)
        expected.pop("", None)
        assert clips.counts(column, choice) == expected


def test_histograms_hold_every_clip_that_is_known(library):
    clips = ClipChoice(library)
    slow = Choice(ranges={"root_speed": FacetRange(high=2.0)})
    histogram = clips.histogram("root_speed", slow)
    assert (len(histogram.counts), histogram.counts.sum()) == (BARS, 5)  # but for its own range
    assert clips.histogram("duration", slow).counts.sum() == len(clips.rows(slow))
    speeds = clips.numbers["root_speed"]
    assert (histogram.low, histogram.high) == (np.nanmin(speeds), np.nanmax(speeds))
    ends = Choice().with_range("root_speed", FacetRange(histogram.low, histogram.high))
    assert len(clips.rows(ends)) == np.isfinite(speeds).sum()  # from end to end drops nobody
    clips.numbers["turn"][:] = math.nan
    assert clips.histogram("turn", Choice()) is None
    clips.numbers["height"][:] = np.linspace(1.7, 1.7 + 1e-15, 5)
    assert clips.histogram("height", Choice()) is None


def test_what_can_be_chosen(library):
    clips = ClipChoice(library)
    assert [*clips.facet_columns()] == ["class", "subject", "style"]
    assert not clips.was_searched
    assert not Choice(text=" ")
    choice = Choice().with_value("style", "old")
    assert choice.values == {"style": "old"}
    assert choice.with_value("style", "young").values == {"style": "young"}
    assert not choice.with_value("style", "old")
    assert not choice.with_value("style", "old").with_range("turn", FacetRange())
    for ends in (FacetRange(2, 1), FacetRange(math.nan), FacetRange(-3, -1)):
        with pytest.raises(LibraryError):
            choice.with_range("root_speed", ends)


def test_a_column_that_no_clip_has_fits_none(library):
    assert not len(ClipChoice(library).rows(Choice(values={"mood": "sad"})))
    assert isinstance(ClipChoice(library).rows(Choice()), np.ndarray)
