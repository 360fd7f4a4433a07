"""Sequences: segments tile the clip and do what they say."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mocapdb.corpus import synthetic
from mocapdb.corpus.synthetic import CLASSES, SEQUENCE


@given(seed=st.integers(0, 2**31))
@settings(max_examples=8, deadline=None)
def test_sequence_segments_tile_the_clip(seed: int) -> None:
    clip, truth = synthetic.make(SEQUENCE, seed=seed)
    labels, starts, ends = zip(*((s.label, s.start, s.end) for s in truth.segments), strict=True)
    assert len(set(labels)) == len(labels) >= 3
    assert set(labels) <= set(CLASSES)
    assert starts[0] == 0
    assert ends[-1] == len(clip)
    assert starts[1:] == ends[:-1]
    assert np.isnan(truth.period_s)


def test_sequence_does_what_it_says() -> None:
    """Away from the transitions, a segment repeats with its own phase."""
    clip, truth = synthetic.make(SEQUENCE, seed=11)
    angles = clip.channels[:, clip.skeleton.rotation_channels]
    for segment in truth.segments:
        start, end = segment.start, segment.end
        inner = slice(start + 36, end - 36)
        phase, values = truth.phase[inner], angles[inner]
        later = np.interp(phase + 2 * np.pi, phase, np.arange(len(phase)), right=np.nan)
        repeats = np.flatnonzero(np.isfinite(later))
        if len(repeats) < 5:
            continue
        distance = values[np.rint(later[repeats]).astype(int)] - values[repeats]
        assert np.abs(distance).mean() < 0.6


def test_short_sequence() -> None:
    clip, truth = synthetic.make(SEQUENCE, seed=1, duration_s=3 / 120)
    assert len(clip) == 3
    assert [len(segment) for segment in truth.segments] == [1, 1, 1]
