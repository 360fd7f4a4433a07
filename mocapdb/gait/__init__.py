"""Gait from motion alone: foot strikes and toe-offs, strides, joint angles over the stride.

===============  ==============================================================================
`gait_analysis`  the gait of a clip: `analyse_gait`, left against right, mean and spread
`feet`           the body in metres; heel, ball and tip of each foot over the ground
`foot_events`    foot strikes and toe-offs, between frames
`strides`        what is measured of each stride
`calibration`    what zero means of the angles
`joint_angles`   flexion, abduction and rotation, in degrees
`gait_tables`    tidy tables: a row a stride, an angle and percent, or an event
`tuning`         every tuned number
===============  ==============================================================================

``docs/gait.md`` states and cites the definitions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.gait.foot_events import FootContact as FootContact
    from mocapdb.gait.gait_analysis import GaitAnalysis as GaitAnalysis
    from mocapdb.gait.gait_analysis import Spread as Spread
    from mocapdb.gait.gait_analysis import analyse_gait as analyse_gait
    from mocapdb.gait.gait_tables import GaitEvent as GaitEvent
    from mocapdb.gait.gait_tables import gait_events as gait_events
    from mocapdb.gait.gait_tables import write_events as write_events
    from mocapdb.gait.strides import Stride as Stride

__getattr__, __dir__, __all__ = attach(__name__)
