"""The viewer: a library in a browser.

============  ====================================================================================
`server`      the web server; it gives every browser a session of its own
`session`     one browser: a thread that plays, and does what the browser asks for, in turn
`playback`    where in time a session is
`bodies`      a body as capsules in the browser's scene
`scene`       ground, light, camera, and the bodies of the stage that is shown
`clips`       panel: the list of clips, searched and sorted
`timeline`    panel: playing, the digression map, flagged spans, a range to select
`query`       panel: the range as a query, its hits
`loops`       panel: cycles, blended, exported
`bridge`      how clicks in our own HTML reach the session
============  ====================================================================================

It needs viser: ``pip install 'mocapdb[viewer]'``. Nothing is loaded from outside.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.viewer.server import Viewer as Viewer

__getattr__, __dir__, __all__ = attach(__name__)
