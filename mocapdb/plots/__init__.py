"""Every picture, one function each.

=================  ==================================================================
`strip_plots`      poses of a clip, or of several to compare, along a strip of time
`cycle_plots`      a cycle: persistence, excitation, phase, harmonics, jerk, seam
`retrieval_plots`  queries and classes: hits, confusion, densities, precision, growth
`fault_plots`      movement digression map, angles before and after a repair
`gait_plots`       joint angles over the stride, feet and their events
`segment_plots`    a take cut into motions
`library_plots`    what a library has and costs, what an error costs, what is flagged
`_axes`            what every picture shares: axes and colours
=================  ==================================================================

Each takes ``ax=None``, draws there or on new axes, and returns the axes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.plots.cycle_plots import barcode as barcode
    from mocapdb.plots.cycle_plots import excitation as excitation
    from mocapdb.plots.cycle_plots import harmonic_fit as harmonic_fit
    from mocapdb.plots.cycle_plots import jerk as jerk
    from mocapdb.plots.cycle_plots import persistence_diagram as persistence_diagram
    from mocapdb.plots.cycle_plots import phase_path as phase_path
    from mocapdb.plots.cycle_plots import seam as seam
    from mocapdb.plots.fault_plots import before_and_after as before_and_after
    from mocapdb.plots.fault_plots import digression_map as digression_map
    from mocapdb.plots.gait_plots import angle_over_stride as angle_over_stride
    from mocapdb.plots.gait_plots import foot_events as foot_events
    from mocapdb.plots.gait_plots import gait_chart as gait_chart
    from mocapdb.plots.library_plots import class_durations as class_durations
    from mocapdb.plots.library_plots import clip_costs as clip_costs
    from mocapdb.plots.library_plots import flagged_joints as flagged_joints
    from mocapdb.plots.library_plots import rate_distortion as rate_distortion
    from mocapdb.plots.library_plots import variance_by_dimension as variance_by_dimension
    from mocapdb.plots.retrieval_plots import confusion_matrix as confusion_matrix
    from mocapdb.plots.retrieval_plots import log_density as log_density
    from mocapdb.plots.retrieval_plots import precision_recall as precision_recall
    from mocapdb.plots.retrieval_plots import query_hits as query_hits
    from mocapdb.plots.retrieval_plots import search_growth as search_growth
    from mocapdb.plots.segment_plots import motion_segments as motion_segments
    from mocapdb.plots.segment_plots import segmentation_chart as segmentation_chart
    from mocapdb.plots.strip_plots import skeleton_strip as skeleton_strip

__getattr__, __dir__, __all__ = attach(__name__)
