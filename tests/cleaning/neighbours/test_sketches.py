"""Sketches: which blocks of a vocabulary are worth comparing with a word."""

from __future__ import annotations

import numpy as np

from mocapdb.cleaning.local_rotations import motion_texture
from mocapdb.cleaning.neighbours.nearest_words import find_neighbours
from mocapdb.cleaning.neighbours.sketches import promising_blocks
from mocapdb.corpus import synthetic
from mocapdb.motion.quaternions import from_rotation_vectors_deg

N_TARGETS = 96


def turned(degrees):
    """Return (1, 4, T) rotations of one joint about x."""
    turns = np.zeros((len(degrees), 3))
    turns[:, 0] = degrees
    return from_rotation_vectors_deg(turns).T[None].astype(np.float32)


def blocks_of(word, context, middles=None, n_blocks=2, valid=None):
    source = np.moveaxis(turned(word), 2, 0)
    valid = np.ones(N_TARGETS, dtype=bool) if valid is None else valid
    found = promising_blocks(turned(context), source, np.array([0]), valid, middles, 16, n_blocks)
    return sorted(found[0].tolist())


def with_motion_at(*places, tempo=1.0):
    rng = np.random.default_rng(1)
    context = rng.normal(0.0, 5.0, N_TARGETS + 36)
    for place in places:
        n = round(15 * tempo)
        context[place : place + n] = np.interp(np.arange(n) / tempo, np.arange(15), WORD)
    return context


WORD = np.linspace(0.0, 90.0, 15)


def test_the_blocks_that_hold_the_motion_are_chosen():
    assert blocks_of(WORD, with_motion_at(20, 70)) == [1, 4]


def test_a_slower_and_a_quicker_repetition_are_found():
    for tempo in (0.8, 1.25):
        assert 2 in blocks_of(WORD, with_motion_at(40, tempo=tempo), n_blocks=1)


def test_the_word_itself_is_passed_over():
    context = with_motion_at(20, 70)
    assert 1 not in blocks_of(WORD, context, middles=np.array([20]), n_blocks=1)


def test_what_is_no_target_is_never_chosen():
    valid = np.zeros(N_TARGETS, dtype=bool)
    valid[70] = True
    assert blocks_of(WORD, with_motion_at(20, 70), valid=valid, n_blocks=3) == [-1, -1, 4]


def test_a_word_goes_on_where_the_word_before_was_found():
    clip = synthetic.make_clip("walk", seed=3, duration_s=12, phase_noise=0.3)
    texture = motion_texture(clip)
    exact = find_neighbours(texture, [texture])
    some = find_neighbours(texture, [texture], n_candidates=3)
    pairs = zip(exact.targets, some.targets, strict=True)
    assert (
        np.mean([len(set(a) & set(b)) / len(a) for a, b in pairs]) > 0.65
    )  # three blocks hold 0.6
