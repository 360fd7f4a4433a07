"""Labelled motion with known truth, for tests, for the demo, and where no data is at hand.

===============  =================================================================================
`known_clips`    a clip of one class or a sequence of several (`make_clip`), with the truth
                 (`make`)
`body`           a body of given height and proportions (`make_skeleton`), or at random
                 (`subject`)
`style`          how somebody moves, and the angles of the upper body by what they mean
`tempo`          how phase runs in time
`gait`           walking and running from normative joint-angle curves
`motions`        the classes of motion, each a function of phase
`sequence`       several classes after each other, each faded into the next
`posing`         from pelvis, feet and joint angles to the channels of a body
`warp`           a clip at another speed, with the mapping of time; `tempo_curve` draws one
`faults`         a clip with faults of a capture at known places, on any skeleton: `inject_faults`
`fault_kit`      every kind of fault that captures have, as recipes: `inject_recipe`
`corpus_folder`  a folder of clips in the layout of the CMU database, with labels: `write_corpus`
===============  =================================================================================

No clip is stored: everything follows from the arguments and a seed.
"""

from __future__ import annotations

from mocapdb.corpus.synthetic.body import make_skeleton, subject
from mocapdb.corpus.synthetic.corpus_folder import write_corpus
from mocapdb.corpus.synthetic.fault_kit import RECIPES, Recipe, inject_recipe
from mocapdb.corpus.synthetic.faults import Fault, Injection, inject_faults, joint_rotations
from mocapdb.corpus.synthetic.known_clips import CLASSES, SEQUENCE, Truth, make, make_clip
from mocapdb.corpus.synthetic.warp import tempo_curve, warp
from mocapdb.motion.frame_range import Segment

__all__ = [
    "CLASSES",
    "RECIPES",
    "SEQUENCE",
    "Fault",
    "Injection",
    "Recipe",
    "Segment",
    "Truth",
    "inject_faults",
    "inject_recipe",
    "joint_rotations",
    "make",
    "make_clip",
    "make_skeleton",
    "subject",
    "tempo_curve",
    "warp",
    "write_corpus",
]
