"""Cleaning: find the joints that a capture got wrong, say why, repair only those.

After Aristidou, Cohen-Or, Hodgins and Shamir, *Self-similarity Analysis for Motion Capture
Cleaning* (2018), with a detector and a repair of our own beside the paper's.

==============  ==================================================================================
`texture`       the motion-texture: local rotations over time
`neighbours`    the K nearest motion-words of every word, exact
`similarity`    what the neighbours say; the paper's movement digression map
`jumps`         discontinuities
`hypotheses`    stretches of a joint that may be a fault, with the evidence
`detector`      their confidence, the map, the spans
`repair`        new values for flagged stretches, everything else bit for bit
`sparse`        joints that were not captured, filled in from similar motion
`baselines`     joint limits and speed limits, to compare with
`evaluation`    faults in clean clips, recall and precision
==============  ==================================================================================
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocapdb.cleaning.detector import Detection, Span, detect_faults
    from mocapdb.cleaning.repair import Cleaned, clean_clip, repair_spans
    from mocapdb.cleaning.sparse import fill_joints

_HOMES = {
    "Cleaned": "repair",
    "Detection": "detector",
    "Span": "detector",
    "clean_clip": "repair",
    "detect_faults": "detector",
    "fill_joints": "sparse",
    "repair_spans": "repair",
}

__all__ = [
    "Cleaned",
    "Detection",
    "Span",
    "clean_clip",
    "detect_faults",
    "fill_joints",
    "repair_spans",
]


def __getattr__(name: str) -> Any:
    """Load a name from its home on first use."""
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
