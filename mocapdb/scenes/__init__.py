"""Moving pictures: clips as bodies on a stage, in a file that one can mail.

==============  ==================================================================================
`body`          a skeleton as something to look at: capsules with thickness, sides, error as colour
`stage`         actors on a stage: where each joint is in every frame, in metres, thinned for show
`raster`        frames of a stage as images
`animation`     a stage as GIF, MP4, or a page that plays it
`gltf`          a clip as a skinned, animated body in a ``.glb``
`player`        the page's player: one script, written by hand, that asks for nothing from outside
==============  ==================================================================================
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocapdb.scenes.animation import ANIMATED_SUFFIXES, write_animation
    from mocapdb.scenes.body import Body
    from mocapdb.scenes.stage import Actor, Stage

__all__ = ["ANIMATED_SUFFIXES", "Actor", "Body", "Stage", "write_animation"]

_HOMES = {
    "ANIMATED_SUFFIXES": "animation",
    "Actor": "stage",
    "Body": "body",
    "Stage": "stage",
    "write_animation": "animation",
}


def __getattr__(name: str) -> Any:
    """Load a name from its home on first use."""
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
