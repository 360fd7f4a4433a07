"""The movement digression map, and the detector that fills it.

================  ==================================================================
`digression_map`  the map, its flagged spans, and the paper's rule as printed
`clip_ends`       frames at the ends that were cut on to the motion, as a T-pose is
`extents`         where a fault begins and ends
`detector`        from a clip to its map: one hypothesis for each fault
================  ==================================================================
"""
