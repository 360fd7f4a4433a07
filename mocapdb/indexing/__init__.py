"""Searching motion by example, and classes of motion.

==============  ==================================================================================
`body`          the canonical body, and how skeletons map to it
`canonical`     a clip on that body: `canonical_motion`
`features`      what frames are compared by: `Weights`, `FeatureSpace`
`warping`       the kernels of dynamic time warping
`search`        stretches like a query: `MotionIndex`, `Query`, `search`
`whole`         whole clips like a query: `search_clips`
`ppca`          the density of a class: `PPCA`, a scikit-learn estimator
`classes`       `ClassIndex`: fit, classify, reject, segment, assign
`signature`     a clip as a few numbers
==============  ==================================================================================
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocapdb.indexing.canonical import CanonicalMotion, canonical_motion
    from mocapdb.indexing.classes import Classification, ClassIndex
    from mocapdb.indexing.features import FeatureSpace, Weights
    from mocapdb.indexing.frames import MotionIndex
    from mocapdb.indexing.ppca import PPCA
    from mocapdb.indexing.query import Query
    from mocapdb.indexing.search import Stretch
    from mocapdb.indexing.whole import search_clips

_HOMES = {
    "PPCA": "ppca",
    "CanonicalMotion": "canonical",
    "ClassIndex": "classes",
    "Classification": "classes",
    "FeatureSpace": "features",
    "MotionIndex": "frames",
    "Query": "query",
    "Stretch": "search",
    "Weights": "features",
    "canonical_motion": "canonical",
    "search_clips": "whole",
}

__all__ = [
    "PPCA",
    "CanonicalMotion",
    "ClassIndex",
    "Classification",
    "FeatureSpace",
    "MotionIndex",
    "Query",
    "Stretch",
    "Weights",
    "canonical_motion",
    "search_clips",
]


def __getattr__(name: str) -> Any:
    """Load a name from its home on first use."""
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
