"""The tuned numbers of segmentation, each with its meaning, unit and origin.

Those that were chosen on clips were chosen by ``scripts/measure_segments.py`` on takes put together
of single clips: of one actor of HDM05, of one subject of CMU's and of Bandai's first set.
"""

from __future__ import annotations

# -- what is looked at: `motion_segments` --------------------------------------------------------

#: Poses a second that are looked at; clips that have more are thinned.
#: [Hz; what a body does is below 15 Hz, which is half of it]
SEGMENT_HZ = 30.0

#: Principal axes of the poses. [count; chosen by scripts/measure_segments.py, 5 to 12 do nearly as
#: well]
POSE_AXES = 8

#: What a velocity counts beside the pose, as if the motion went on for so long.
#: [s; chosen by scripts/measure_segments.py: 0.1 finds less, 0.3 too much]
VELOCITY_S = 0.2

#: Velocities are means over so long to each side. [s; as long as capture noise needs]
VELOCITY_REACH_S = 0.1

#: A range that repeats may be cut so far within its ends: they may be another motion's.
#: [laps; chosen by scripts/measure_segments.py: 0.2 does nearly as well]
OUTER_LAPS = 0.4

#: And no farther than this. [s; chosen by hand: more than a cut may be off]
OUTER_S = 0.6

#: A range of fewer laps may be alike by chance, and its ends tell nothing.
#: [laps; chosen by scripts/measure_segments.py]
LIKELY_LAPS = 2.0

#: So near to an end of a range that repeats a cut is likely. [s; what a cut may be off]
NEAR_RANGE_END_S = 0.5

# -- the cuts: `partition` -----------------------------------------------------------------------

#: Standard deviation that no direction of a Gaussian falls below: what the same pose differs by
#: when it is taken again. [share of the norm of a posture; chosen by scripts/measure_segments.py:
#: 5 cm of a grown body's]
POSE_FLOOR = 0.027

#: What a cut costs: so many nats a second for each dimension.
#: [nats s; chosen by scripts/measure_segments.py]
CUT_PENALTY = 1.35

#: What it costs where a range that repeats begins or ends.
#: [ratio; chosen by scripts/measure_segments.py]
LIKELY_CUT = 0.6

#: Shortest stretch that is a motion of its own. [s; chosen by hand: a kick takes one]
SHORTEST_S = 0.8

#: Longest stretch that is looked at as one; longer ones are put together afterwards, if alike.
#: [s; a bound on the time that is spent]
LONGEST_S = 60.0

#: Between the places where a cut is tried first. [s; less than half of what a cut may be off]
CUT_STEP_S = 0.2

# -- Barbic et al.: `published_cuts` -------------------------------------------------------------

#: Share of the variance that principal axes keep. [ratio; Barbic et al. 2004, section 3.1]
KEPT_BY_AXES = 0.95

#: First frames that principal axes are fitted to. [s; Barbic et al. 2004, section 3.1: 240 frames]
FIRST_PCA_S = 2.0

#: The error of the projection is compared with that so long before.
#: [s; Barbic et al. 2004, section 3.1: 60 frames]
ERROR_REACH_S = 0.5

#: It has jumped where it rises by so many standard deviations more than it did before.
#: [standard deviations; Barbic et al. 2004, section 3.1]
JUMP_SDS = 3.0

#: Frames of the first Gaussian, and frames that are compared with it.
#: [s; Barbic et al. 2004, section 3.2: 150 frames]
GAUSSIAN_S = 1.25

#: What the Gaussian grows by, step by step. [s; Barbic et al. 2004, section 3.2: 10 frames]
GROWTH_S = 1 / 12

#: A peak of the mean Mahalanobis distance stands out so far from the valley before it.
#: [share of the valley; Barbic et al. 2004, section 3.2, give 15 for their features, whose scale
#: is another]
PEAK_RISE = 1.0

#: Most Gaussians of a mixture; how many there are is decided by Schwarz's criterion.
#: [count; chosen by hand: a take of more motions is rare]
MOST_MIXED = 12

# -- what is alike: `resemblance` ----------------------------------------------------------------

#: Stretches that are less apart are the same motion. [nats a dimension; chosen by
#: scripts/measure_segments.py: of clips of one class 90 % are below 0.2, of two 95 % above 0.3]
SAME_MOTION = 0.22

#: A segment repeats if a range that does is so much of it. [share; chosen by hand]
SHARE_PERIODIC = 0.5
