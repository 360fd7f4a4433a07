"""Moving pictures: clips as bodies on a stage, in a file that one can mail.

==============  ==================================================================================
`capsule_body`  a skeleton as something to look at: capsules with thickness, sides, error as
                colour
`stage`         actors on a stage: where each joint is in every frame, in metres, at the shown
                rate
`raster`        frames of a stage as images
`pose_strip`    a motion as a small picture: poses in a row, or a loop
`animation`     a stage as GIF, MP4, or a page that plays it
`gltf`          a clip as a skinned, animated body in a ``.glb``
`player`        the page's player: one script, written by hand, that asks for nothing from outside
==============  ==================================================================================

Numbers of looks (thickness, colours, pixels) stand in capitals beside the code that draws.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.scenes.animation import ANIMATED_SUFFIXES as ANIMATED_SUFFIXES
    from mocapdb.scenes.animation import write_animation as write_animation
    from mocapdb.scenes.capsule_body import Body as Body
    from mocapdb.scenes.stage import Actor as Actor
    from mocapdb.scenes.stage import Stage as Stage

__getattr__, __dir__, __all__ = attach(__name__)
