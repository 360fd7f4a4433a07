"""Searching motion by example, and classes of motion.

=============  ==========================================================================
`canonical`    the body and the rate that every clip is compared on: `canonical_motion`
`search`       stretches and whole clips that are like an example: `MotionIndex`, `Query`
`recognition`  what a clip is: `ClassIndex` with a density (`PPCA`) for each class
`tuning`       the tuned numbers of all three, each with its unit and origin
=============  ==========================================================================

``canonical`` stands on its own, ``search`` on it, and ``recognition`` on both.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.indexing.canonical.canonical_motion import CanonicalMotion as CanonicalMotion
    from mocapdb.indexing.canonical.canonical_motion import canonical_motion as canonical_motion
    from mocapdb.indexing.recognition.class_models import Classification as Classification
    from mocapdb.indexing.recognition.class_models import ClassIndex as ClassIndex
    from mocapdb.indexing.recognition.ppca import PPCA as PPCA
    from mocapdb.indexing.search.agreement import Agreement as Agreement
    from mocapdb.indexing.search.clip_search import search_clips as search_clips
    from mocapdb.indexing.search.example_query import Query as Query
    from mocapdb.indexing.search.features import FeatureSpace as FeatureSpace
    from mocapdb.indexing.search.features import Weights as Weights
    from mocapdb.indexing.search.frame_store import MotionIndex as MotionIndex
    from mocapdb.indexing.search.stretch_search import Stretch as Stretch

__getattr__, __dir__, __all__ = attach(__name__)
