"""The viewer's chosen numbers that change what is found or exported.

Those of looks stand beside the code that draws.
"""

from __future__ import annotations

# -- queries ---------------------------------------------------------------------------------------

#: Shortest range that can be selected: what is shorter is taken for a click that slipped and
#: selects nothing. [s; about the shortest motion that a query tells from others, chosen by hand]
SHORTEST_SELECTION_S = 0.3

# -- cycles ----------------------------------------------------------------------------------------

#: Frame rate of a cycle that is exported. [frames/s; the rate of the CMU database]
EXPORTED_FPS = 120.0

#: Clips from which the mean cycle of a class is made when the library keeps none; more take
#: longer, and the browser waits. [count; chosen by hand, some seconds of work]
CLASS_CYCLE_CLIPS = 6

# -- filling ---------------------------------------------------------------------------------------

#: Clips of the library that a body is filled from, spread evenly over those with its joints; more
#: take longer, and are left to `mocapdb fill`. [count; chosen by hand, some seconds of decoding]
FILLING_CLIPS = 200

#: Of these, clips that are filled themselves to measure what filling is off. [count; as many as
#: `mocapdb fill` takes]
HELD_OUT_CLIPS = 6
