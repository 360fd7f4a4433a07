"""Cycles: from a clip, or a whole class, to a clean loop.

======================  ==========================================================================
`extract_cycle`         the cycle of a clip, and how sure that is
`make_loop`             a cycle as a clip that loops: root motion, feet held where they rest
`blend`, `transition`   between cycles, phases aligned
`average_cycles`        the cycle of a class
`Cycle`                 one closed lap of a motion
`embedding`             clouds of poses, delays
`CircularCoordinates`   persistent cohomology: a coordinate on the circle for every pose
`guess_period`          the period by autocorrelation, the guard of the above
`timing`, `phase`       from the coordinate to time
`HarmonicRegression`    the periodic curve through poses of known phase
`match_template`        how well a cycle matches its clip
`typical_trajectory`    the paper's centroid curve
`periodic_ranges`       where in a clip something repeats
`excitation_regions`    the same by circular coordinates that move
======================  ==========================================================================

After Raunio, *Periodic Motion Extraction Using Harmonic Regression and Structural Parameterization*
(KTH 2014), and Vejdemo-Johansson, Pokorny, Skraba and Kragic, *Cohomological learning of periodic
motion* (AAECC 2015).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocapdb.cycles.blending import aligned, blend, transition
    from mocapdb.cycles.classes import ClassCycle, average_cycles
    from mocapdb.cycles.closing import cycle_of_loop
    from mocapdb.cycles.cohomology import CircularCoordinates
    from mocapdb.cycles.cycle import Cycle
    from mocapdb.cycles.excitation import excitation_regions
    from mocapdb.cycles.extract import Extraction, Settings, extract_cycle
    from mocapdb.cycles.guard import guess_period
    from mocapdb.cycles.harmonics import HarmonicRegression
    from mocapdb.cycles.loop import Loop, make_loop, seam_steps
    from mocapdb.cycles.regions import periodic_ranges
    from mocapdb.cycles.template import match_template
    from mocapdb.cycles.typical import typical_trajectory

__all__ = [
    "CircularCoordinates",
    "ClassCycle",
    "Cycle",
    "Extraction",
    "HarmonicRegression",
    "Loop",
    "Settings",
    "aligned",
    "average_cycles",
    "blend",
    "cycle_of_loop",
    "excitation_regions",
    "extract_cycle",
    "guess_period",
    "make_loop",
    "match_template",
    "periodic_ranges",
    "seam_steps",
    "transition",
    "typical_trajectory",
]

_HOMES = {
    "CircularCoordinates": "cohomology",
    "ClassCycle": "classes",
    "Cycle": "cycle",
    "Extraction": "extract",
    "HarmonicRegression": "harmonics",
    "Loop": "loop",
    "Settings": "extract",
    "aligned": "blending",
    "average_cycles": "classes",
    "blend": "blending",
    "cycle_of_loop": "closing",
    "excitation_regions": "excitation",
    "extract_cycle": "extract",
    "guess_period": "guard",
    "make_loop": "loop",
    "match_template": "template",
    "periodic_ranges": "regions",
    "seam_steps": "loop",
    "transition": "blending",
    "typical_trajectory": "typical",
}


def __getattr__(name: str) -> Any:
    """Load a name from its module on first use."""
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
