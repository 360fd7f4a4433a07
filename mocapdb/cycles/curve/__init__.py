"""Periodic curves: what is fitted, and by what.

=================  ==================================================================
`flips`            joints that turn over for a few frames are bridged
`unroll_path`      the path of a body that turns becomes straight
`rotation_values`  rotations as numbers that change smoothly
`harmonics`        harmonic regression: a periodic curve through poses of known phase
`lap_noise`        how much laps differ, and how much smoothing that calls for
`typical_curve`    the typical trajectory: centroids of the poses of like phase
`closed_curves`    closed curves at even phases: interpolate, shift, align
=================  ==================================================================
"""
