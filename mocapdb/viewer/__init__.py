"""The viewer: a library in a browser.

================  ================================================================================
`server`          the web server; it gives every browser a session of its own
`gate`            who may talk to that server: whoever has its address with the token
`session`         one browser: opens clips, compares them, and tells stage and panels what changed
`event_loop`      what a session is asked for, done in turn by one thread, with frames in between
`bridge`          how clicks in our own HTML reach a session
`view_state`      what a browser shows: clip, comparison, flagged spans, selection
`playback`        the clock: where in time a session is
`comparisons`     a clip alone, beside its original or beside its repair, as a stage
`cleaned_clips`   a cache of the clips that were searched for faults
`scene`           ground, light, camera, and the bodies of the stage that is shown
`bodies`          a body as capsules in the browser's scene
`panel`           what a panel may see of a session and ask of it; what panels share
`pictures`        pictures of clips, made when a browser asks for them, and kept
`clip_choice`     which clips are looked at, and how many each further choice would leave
`facet_panel`     panel: choosing clips by words, labels and measured numbers
`clip_panel`      panel: the list of the chosen clips, with pictures, sorted
`timeline_panel`  panel: playing, the digression map, flagged spans, a range to select
`query_panel`     panel: the range as a query, its hits, and thumbs to search again by
`cycle_panel`     panel: cycles, blended, exported
`fill_panel`      panel: joints that were not captured, filled in from similar motion
`downloads`       a clip as a file that the browser keeps
`tuning`          the numbers that change what is found or exported
================  ================================================================================

It needs viser: ``pip install 'mocapdb[viewer]'``. Nothing is loaded from outside.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.viewer.server import Viewer as Viewer

__getattr__, __dir__, __all__ = attach(__name__)
