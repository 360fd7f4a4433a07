"""Periodic curves: what is fitted, by what, and how it is closed.

=================  ==============================================================================
`centroid_curve`   A typical trajectory from circular coordinates alone (Vejdemo-Johansson et al.
`closed_curves`    Closed curves sampled at even phases: evaluate, differentiate, shift, align
`closing`          Curves made cycles: poses of known phase are fitted, and the root's way is
`flips`            Joints that turn over for a few frames: faults of a capture that no cycle
`harmonics`        Harmonic regression: a periodic curve through poses whose phase is known
`rotation_values`  What the regression fits: numbers in radians that change smoothly whatever a
`unroll_path`      The way a body takes, unrolled: positions seen from a heading that changes
=================  ==============================================================================
"""
