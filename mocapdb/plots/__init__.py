"""Every picture, one function each.

``skeleton_strip``     poses of a clip, or of several to compare, along a strip of time
``persistence_diagram``  births and deaths of loops, the chosen one ringed
``phase_path``         a motion on two axes, coloured by phase, and its cycle
``harmonic_fit``       the laps of a channel over each other, and the harmonics
``seam``               the steps round a loop, its seam in the middle
``confusion_matrix``   which classes are taken for which
``log_density``        how likely each frame is under some classes
``query_hits``         a query and the stretches that were found
``search_growth``      time of a query over the size of a library
``digression_map``     how sure each joint is wrong, over time, flagged spans marked
``before_and_after``   the angles of a joint before and after a repair
``rate_distortion``    bytes a frame against the error that they leave
``precision_recall``   how much is found, and how much of what is found is right
``class_durations``    how much motion of each class a library has
``clip_costs``         bytes a frame and error, a dot for each clip
``flagged_joints``     how often each joint is flagged, and as what

Each takes ``ax=None``, draws there or on new axes, and returns the axes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocapdb.plots.cleaning import before_and_after, digression_map
    from mocapdb.plots.cycles import harmonic_fit, persistence_diagram, phase_path, seam
    from mocapdb.plots.library import class_durations, clip_costs, flagged_joints
    from mocapdb.plots.rate import rate_distortion
    from mocapdb.plots.retrieval import (
        confusion_matrix,
        log_density,
        precision_recall,
        query_hits,
        search_growth,
    )
    from mocapdb.plots.strip import skeleton_strip

__all__ = [
    "before_and_after",
    "class_durations",
    "clip_costs",
    "confusion_matrix",
    "digression_map",
    "flagged_joints",
    "harmonic_fit",
    "log_density",
    "persistence_diagram",
    "phase_path",
    "precision_recall",
    "query_hits",
    "rate_distortion",
    "seam",
    "search_growth",
    "skeleton_strip",
]

_HOMES = {
    "before_and_after": "cleaning",
    "class_durations": "library",
    "clip_costs": "library",
    "confusion_matrix": "retrieval",
    "digression_map": "cleaning",
    "flagged_joints": "library",
    "harmonic_fit": "cycles",
    "log_density": "retrieval",
    "persistence_diagram": "cycles",
    "phase_path": "cycles",
    "precision_recall": "retrieval",
    "query_hits": "retrieval",
    "rate_distortion": "rate",
    "seam": "cycles",
    "search_growth": "retrieval",
    "skeleton_strip": "strip",
}


def __getattr__(name: str) -> Any:
    """Load a picture on first use."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
