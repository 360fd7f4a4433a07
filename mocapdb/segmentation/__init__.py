"""Segmentation: a long take cut into motions, with no labels.

==================  ===========================================================================
`motion_segments`   `segment_clip`: where motions begin and end, which repeat, which are alike
`partition`         the cuts after which each stretch fits a Gaussian of its own best
`published_cuts`    three ways to cut of Barbic et al. (2004): PCA, probabilistic PCA, mixture
`resemblance`       which stretches are the same motion
`tuning`            every tuned number
==================  ===========================================================================

After Barbic, Safonova, Pan, Faloutsos, Hodgins and Pollard, *Segmenting motion capture data into
distinct behaviors* (Graphics Interface 2004), as O'Kane (2008, section 2.5) describes it; periods
are those of `mocapdb.cycles`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.segmentation.motion_segments import MotionSegment as MotionSegment
    from mocapdb.segmentation.motion_segments import Segmentation as Segmentation
    from mocapdb.segmentation.motion_segments import segment_clip as segment_clip
    from mocapdb.segmentation.motion_segments import segment_poses as segment_poses

__getattr__, __dir__, __all__ = attach(__name__)
