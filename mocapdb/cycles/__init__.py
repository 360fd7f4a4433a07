"""Cycles: from a clip, or a whole class, to a clean loop.

==================  ===========================================================================
`extract`           the cycle of a clip, or of each range that repeats, and how sure that is
`cycle`             `Cycle`, one closed lap of a motion
`cycle_confidence`  what speaks for a cycle, and what a user should know
`template_error`    how well a cycle matches its clip
`closing`           a fitted curve, or a loop read from a file, as a cycle
`class_cycle`       the mean cycle of a class
`class_curves`      its curves as a table
`tuning`            every tuned number
`period`            the period, and the ranges of a clip that repeat
`phase`             circular coordinates by persistent cohomology, and the phase of every frame
`curve`             the periodic curve through poses of known phase
`synthesis`         loops that play, blends and transitions
==================  ===========================================================================

After Raunio, *Periodic Motion Extraction Using Harmonic Regression and Structural Parameterization*
(KTH 2014), and Vejdemo-Johansson, Pokorny, Skraba and Kragic, *Cohomological learning of periodic
motion* (AAECC 2015).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.cycles.class_cycle import ClassCycle as ClassCycle
    from mocapdb.cycles.class_cycle import average_cycles as average_cycles
    from mocapdb.cycles.closing import cycle_of_loop as cycle_of_loop
    from mocapdb.cycles.curve.harmonics import HarmonicRegression as HarmonicRegression
    from mocapdb.cycles.cycle import Cycle as Cycle
    from mocapdb.cycles.extract import Extraction as Extraction
    from mocapdb.cycles.extract import Settings as Settings
    from mocapdb.cycles.extract import extract_cycle as extract_cycle
    from mocapdb.cycles.period.autocorrelation import guess_period as guess_period
    from mocapdb.cycles.period.periodic_ranges import periodic_ranges as periodic_ranges
    from mocapdb.cycles.phase.centroid_curve import typical_trajectory as typical_trajectory
    from mocapdb.cycles.phase.cohomology import CircularCoordinates as CircularCoordinates
    from mocapdb.cycles.phase.excitation import excitation_regions as excitation_regions
    from mocapdb.cycles.synthesis.blending import aligned as aligned
    from mocapdb.cycles.synthesis.blending import blend as blend
    from mocapdb.cycles.synthesis.blending import transition as transition
    from mocapdb.cycles.synthesis.loop import Loop as Loop
    from mocapdb.cycles.synthesis.loop import make_loop as make_loop
    from mocapdb.cycles.synthesis.loop import seam_steps as seam_steps
    from mocapdb.cycles.template_error import match_template as match_template

__getattr__, __dir__, __all__ = attach(__name__)
