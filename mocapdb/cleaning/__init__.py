"""Cleaning: find the joints that a capture got wrong, say why, repair only those.

After Aristidou, Cohen-Or, Hodgins and Shamir, *Self-similarity Analysis for Motion Capture
Cleaning* (2018), with a detector and a repair of our own beside the paper's.

==============  ==================================================================================
`texture`       the motion-texture: local rotations over time
`groups`        halves of the body, by the hierarchy
`neighbours`    the K nearest motion-words of every word: exact, or among candidates
`similarity`    what the neighbours say; the paper's two-stage search
`jumps`         discontinuities
`shapes`        what may stand between the edges of a joint
`hypotheses`    stretches of a joint that may be a fault by their edges, with the evidence
`unlike`        the same by self-similarity, where there are no edges
`limits`        joint limits, learnt from the rest of the clip and from its context
`confidence`    how likely a hypothesis is a fault, given all evidence
`detector`      one hypothesis for each fault
`digression`    the movement digression map and its spans; the paper's rule as printed
`contacts`      places where a joint has to be, given or found from feet
`gaps`          the ways to fill one span of one joint
`repair`        new values for flagged stretches, everything else bit for bit
`footskate`     feet that slide where they rest, stopped
`sparse`        joints that were not captured, filled in from similar motion
`baselines`     joint limits, speed limits and another distance, to compare with
`evaluation`    faults in clean clips, recall and precision
==============  ==================================================================================
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
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
