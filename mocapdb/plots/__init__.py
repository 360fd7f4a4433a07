"""Every picture, one function each.

``skeleton_strip``     poses of a clip, or of several to compare, along a strip of time
``persistence_diagram``  births and deaths of loops, the chosen one ringed
``phase_path``         a motion on two axes, coloured by phase, and its cycle
``harmonic_fit``       the laps of a channel over each other, and the harmonics
``seam``               the steps round a loop, its seam in the middle
``confusion_matrix``   which classes are taken for which
``log_density``        how likely each frame is under some classes
``query_hits``         a query and the stretches that were found
``search_growth``      time of a query over the size of a library
``digression_map``     how sure each joint is wrong, over time, flagged spans marked
``before_and_after``   the angles of a joint before and after a repair
``rate_distortion``    bytes a frame against the error that they leave
``precision_recall``   how much is found, and how much of what is found is right
``class_durations``    how much motion of each class a library has
``clip_costs``         bytes a frame and error, a dot for each clip
``flagged_joints``     how often each joint is flagged, and as what

Each takes ``ax=None``, draws there or on new axes, and returns the axes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.plots.cycle_plots import harmonic_fit as harmonic_fit
    from mocapdb.plots.cycle_plots import persistence_diagram as persistence_diagram
    from mocapdb.plots.cycle_plots import phase_path as phase_path
    from mocapdb.plots.cycle_plots import seam as seam
    from mocapdb.plots.fault_plots import before_and_after as before_and_after
    from mocapdb.plots.fault_plots import digression_map as digression_map
    from mocapdb.plots.library_plots import class_durations as class_durations
    from mocapdb.plots.library_plots import clip_costs as clip_costs
    from mocapdb.plots.library_plots import flagged_joints as flagged_joints
    from mocapdb.plots.rate_plots import rate_distortion as rate_distortion
    from mocapdb.plots.retrieval_plots import confusion_matrix as confusion_matrix
    from mocapdb.plots.retrieval_plots import log_density as log_density
    from mocapdb.plots.retrieval_plots import precision_recall as precision_recall
    from mocapdb.plots.retrieval_plots import query_hits as query_hits
    from mocapdb.plots.retrieval_plots import search_growth as search_growth
    from mocapdb.plots.skeleton_strip import skeleton_strip as skeleton_strip

__getattr__, __dir__, __all__ = attach(__name__)
