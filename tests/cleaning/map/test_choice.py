"""Of hypotheses that explain each other one is kept; and how far the search for neighbours goes."""

from dataclasses import replace

import numpy as np
import pytest

from mocapdb.cleaning.evidence.hypotheses import Hypothesis
from mocapdb.cleaning.local_rotations import motion_texture
from mocapdb.cleaning.map import detector
from mocapdb.cleaning.map.detector import choose_spans, find_clip_consensus
from mocapdb.cleaning.neighbours.nearest_words import Vocabulary
from mocapdb.corpus import synthetic

FPS = 120.0


def likely(*hypotheses):
    """Hypotheses about one joint: (start, end, kind, confidence), and options."""
    return [
        (sure, replace(Hypothesis(start, end, 0, kind, ()), **options))
        for start, end, kind, sure, options in hypotheses
    ]


def chosen(*hypotheses):
    spans = choose_spans(likely(*hypotheses), np.array([7]), FPS)
    assert all(span.joint == 7 for span in spans)
    return [(span.start, span.end, span.kind) for span in spans]


@pytest.mark.parametrize(("start", "end"), [(140, 200), (155, 255)])
def test_what_is_half_explained_says_nothing_new(start, end):
    """Of a second sighting, at half the rate, all frames but one at either end count."""
    fine = (100, 200, "noise", 0.9, {})
    coarse = (start, start + 100, "offset", 0.95, {"halvings": 1})
    ((_, found, _),) = chosen(fine, coarse)  # they overlap, and so are one in any case
    assert found == end


def test_what_only_differs_from_similar_motion_is_explained_by_any_fault():
    fault = (100, 120, "offset", 0.9, {})
    similar = (110, 200, "drift", 0.99, {"cue": "similarity", "halvings": 2})
    assert chosen(fault, similar) == [(100, 120, "offset")]
    assert len(chosen(fault, (130, 200, *similar[2:]))) == 2


@pytest.mark.parametrize(
    ("start", "end", "whole"),
    [(120, 155, True), (120, 156, False), (100, 120, False), (185, 205, False)],
)
def test_a_small_fault_within_a_soft_one_does_not_explain_it(start, end, whole):
    """Within means with both ends, small a third (.35 of it): else the soft one is left out.

    So it is where the small one has both its edges, or is a freeze.
    """
    small = (start, end, "filled", 0.9, {})
    soft = (100, 200, "offset", 0.99, {"cue": "similarity", "halvings": 2})
    assert chosen(small, soft) == [(100, 200, "offset") if whole else (start, end, "filled")]
    sharp = (start, end, "offset", 0.9, {})
    assert chosen(sharp, soft) == [(start, end, "offset")]
    frozen = (start, end, "freeze", 0.9, {"cue": "edges"})
    assert chosen(frozen, soft) == [(start, end, "freeze")]


@pytest.mark.parametrize(("sure", "start"), [(0.9, 300), (0.99, 0)])
def test_what_an_end_cuts_off_has_no_edge_within_a_surer_fault(sure, start):
    fault = (300, 430, "offset", 0.95, {})
    assert chosen(fault, (0, 360, "offset", sure, {"cue": "cut off"}))[0][:2] == (start, 430)


@pytest.mark.parametrize(("apart", "n"), [(8, 1), (9, 2)])
def test_a_drift_that_ends_where_a_surer_fault_begins_is_no_fault(apart, n):
    """The same edge: within 70 ms, which are 8 frames."""
    offset = (300, 400, "offset", 0.95, {})
    drift = (200, 300 - apart, "drift", 0.9, {})
    assert len(chosen(offset, drift)) == n


@pytest.mark.parametrize(("apart", "n"), [(8, 1), (9, 2)])
def test_of_a_slow_drift_and_a_drift_to_one_edge_the_slow_one_counts(apart, n):
    slow = (100, 400, "drift", 0.85, {"cue": "slow drift"})
    drift = (320, 400 + apart, "drift", 0.99, {})
    kept = detector._without_repeats(likely(slow, drift), near=8.4)
    assert len(kept) == n
    assert "slow drift" in {h.cue for _, h in kept}
    assert chosen((100, 400, "drift", 0.85, {}), (320, 400, "drift", 0.99, {})) == [
        (320, 400, "drift")
    ]


def test_a_drift_sets_in_without_an_edge():
    """So it may follow a surer fault at once, but not end where one begins."""
    offset = (200, 300, "offset", 0.95, {})
    assert len(chosen(offset, (305, 400, "drift", 0.9, {}))) == 2
    assert chosen(offset, (100, 195, "drift", 0.9, {})) == [(200, 300, "offset")]


@pytest.mark.parametrize(("pause", "n"), [(12, 1), (13, 2)])
def test_noise_may_pause_for_100_ms(pause, n):
    first = (100, 200, "noise", 0.9, {})
    assert len(chosen(first, (200 + pause, 300, "noise", 0.95, {}))) == n
    assert len(chosen(first, (200 + pause, 300, "offset", 0.95, {}))) == 2


@pytest.mark.parametrize(("pause", "n"), [(2, 1), (3, 2)])
def test_two_frames_between_two_faults_tell_nothing(pause, n):
    first = (100, 200, "filled", 0.9, {})
    assert len(chosen(first, (200 + pause, 300, "filled", 0.95, {}))) == n


@pytest.mark.parametrize(("hours", "n_candidates"), [(0.9, None), (1.1, 150)])
def test_a_context_of_more_than_an_hour_is_searched_among_150_candidates(
    monkeypatch, hours, n_candidates
):
    texture = motion_texture(synthetic.make_clip("walk", seed=1, duration_s=2.0))
    one = Vocabulary.of([texture])
    n_frames = round(hours * 3600 * 24)
    context = replace(one, ends=np.array([n_frames]))
    asked = []

    def remember(source, vocabulary, **options):
        asked.append(options)
        return find(source, one if vocabulary is context else vocabulary, **options)

    find = detector.find_neighbours
    monkeypatch.setattr(detector, "find_neighbours", remember)
    object.__setattr__(context, "valid", one.valid)
    find_clip_consensus(texture, context)
    assert asked[-1] == {"n_candidates": n_candidates}


@pytest.mark.parametrize(("seconds", "n_candidates"), [(590, None), (610, 40)])
def test_a_clip_of_more_than_ten_minutes_is_searched_in_itself_among_40_candidates(
    monkeypatch, seconds, n_candidates
):
    texture = motion_texture(synthetic.make_clip("walk", seed=1, duration_s=2.0))
    n_frames = round(seconds * 24)
    long = replace(
        texture, quat_xyzw=np.resize(texture.quat_xyzw, (n_frames, *texture.quat_xyzw.shape[1:]))
    )
    asked = []

    def remember(source, context, **options):
        asked.append(options)
        return find(texture, [texture])

    find = detector.find_neighbours
    monkeypatch.setattr(detector, "find_neighbours", remember)
    monkeypatch.setattr(detector, "find_consensus", lambda texture, found: found)
    find_clip_consensus(long)
    assert asked == [{"n_candidates": n_candidates}]
