"""From a cycle back to motion.

==============  ================================================================================
`loop`          whole laps as a clip that loops: root motion, resting feet that stay, jerk
`loop_start`    where a loop starts: at a strike of the left foot, or where the body is calmest
`lowpass`       what is slower than a limit, for the jerk
`other_bodies`  cycles on another body
`blending`      cycles aligned in phase and mixed, and transitions between them
==============  ================================================================================
"""
