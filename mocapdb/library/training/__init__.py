"""Training straight from a library.

=================  ===========================================================================
`motion_windows`   `MotionWindows`: stretches of equal length as a map-style dataset
`window_features`  what a window holds: positions, rotations, or the canonical body
=================  ===========================================================================
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.library.training.motion_windows import MotionWindows as MotionWindows

__getattr__, __dir__, __all__ = attach(__name__)
