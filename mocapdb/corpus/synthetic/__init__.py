"""Labelled motion with known truth, for tests, for the demo, and where no data is at hand.

==================  ==============================================================================
`make_clip`         a clip of one class, or a sequence of several
`make`              the same, with the truth: phase, period, segments, contacts, noise-free clip
`make_skeleton`     a body of given height and proportions, on the CMU topology
`subject`           a body drawn at random
`warp`              a clip at another speed, with the mapping of time; `tempo_curve` draws one
`inject_faults`     a clip with faults of a capture at known places, on any skeleton
`write_corpus`      a folder of clips in the layout of the CMU database, with labels
==================  ==============================================================================

It is a generator, not a bag of files: everything follows from the arguments and a seed.
"""

from __future__ import annotations

from mocapdb.corpus.synthetic.body import make_skeleton, subject
from mocapdb.corpus.synthetic.faults import Fault, Injection, inject_faults, joint_rotations
from mocapdb.corpus.synthetic.files import write_corpus
from mocapdb.corpus.synthetic.known_clips import CLASSES, SEQUENCE, Truth, make, make_clip
from mocapdb.corpus.synthetic.warp import tempo_curve, warp
from mocapdb.motion.frame_range import Segment

__all__ = [
    "CLASSES",
    "SEQUENCE",
    "Fault",
    "Injection",
    "Segment",
    "Truth",
    "inject_faults",
    "joint_rotations",
    "make",
    "make_clip",
    "make_skeleton",
    "subject",
    "tempo_curve",
    "warp",
    "write_corpus",
]
