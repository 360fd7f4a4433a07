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

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocapdb.cleaning.contacts import Contact, make_contact
    from mocapdb.cleaning.detector import detect_faults
    from mocapdb.cleaning.digression import MovementDigressionMap, Span
    from mocapdb.cleaning.footskate import remove_foot_skate
    from mocapdb.cleaning.neighbours import Vocabulary
    from mocapdb.cleaning.repair import Cleaned, clean_clip, repair_spans
    from mocapdb.cleaning.sparse import fill_joints

_HOMES = {
    "Cleaned": "repair",
    "Contact": "contacts",
    "MovementDigressionMap": "digression",
    "Span": "digression",
    "Vocabulary": "neighbours",
    "clean_clip": "repair",
    "detect_faults": "detector",
    "fill_joints": "sparse",
    "make_contact": "contacts",
    "remove_foot_skate": "footskate",
    "repair_spans": "repair",
}

__all__ = [
    "Cleaned",
    "Contact",
    "MovementDigressionMap",
    "Span",
    "Vocabulary",
    "clean_clip",
    "detect_faults",
    "fill_joints",
    "make_contact",
    "remove_foot_skate",
    "repair_spans",
]


def __getattr__(name: str) -> Any:
    """Load a name from its home on first use."""
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
