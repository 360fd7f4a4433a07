"""Cleaning: find the joints that a capture got wrong, say why, repair only those.

After Aristidou, Cohen-Or, Hodgins and Shamir, *Self-similarity Analysis for Motion Capture
Cleaning* (2018), with a detector and a repair of our own beside the paper's.

=================  ============================================================================
`local_rotations`  the motion texture: every joint's local rotation over time
`joint_roles`      what a joint is: of the trunk, an arm, a leg, a hand or a toe
`neighbours`       similar motion: the K nearest motion words of every word, and what they show
`evidence`         hypotheses: stretches of a joint that may be a fault, and what speaks for it
`map`              the movement digression map, and the detector that fills it
`repair`           new rotations for what was flagged; contacts, feet, joints that were not
                   captured
`filling_error`    what joints that were not captured are off, on clips held out
`kit_scores`       recall by kind of fault, false alarms, calibration, what repair leaves
`evaluation`       faults in clean clips, recall and precision
`tuning`           the tuned numbers of all of these
=================  ============================================================================

A clip goes from top to bottom: texture, neighbours, hypotheses with their evidence, map, repair.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.cleaning.filling_error import measure_filling as measure_filling
    from mocapdb.cleaning.map.detector import detect_faults as detect_faults
    from mocapdb.cleaning.map.digression_map import MovementDigressionMap as MovementDigressionMap
    from mocapdb.cleaning.map.digression_map import Span as Span
    from mocapdb.cleaning.neighbours.nearest_words import Vocabulary as Vocabulary
    from mocapdb.cleaning.repair.contact_targets import Contact as Contact
    from mocapdb.cleaning.repair.contact_targets import make_contact as make_contact
    from mocapdb.cleaning.repair.foot_skate import remove_foot_skate as remove_foot_skate
    from mocapdb.cleaning.repair.missing_joints import fill_joints as fill_joints
    from mocapdb.cleaning.repair.repair import Cleaned as Cleaned
    from mocapdb.cleaning.repair.repair import clean_clip as clean_clip
    from mocapdb.cleaning.repair.repair import repair_spans as repair_spans

__getattr__, __dir__, __all__ = attach(__name__)
