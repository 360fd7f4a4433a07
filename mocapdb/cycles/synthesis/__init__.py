"""From a cycle back to motion: loops that play, and blends between them.

==========  =====================================================================================
`blending`  Between cycles: alignment of phase, weighted means, transitions
`loop`      From a cycle to a clip that loops: whole laps, root motion, feet that stay where they
==========  =====================================================================================
"""
