"""Tuned numbers of reading: when the first frames are a T-pose that a conversion put there."""

#: So many steps after the first tell how far the body usually moves from frame to frame.
#: [frames; chosen by hand: a quarter of a second at 120 Hz]
LATER_STEPS = 30
#: The jump out of a T-pose is at least so large. [degrees, mean over all angles; chosen by
#: hand: above the noise of a capture]
LEAST_JUMP_DEG = 0.5
#: It is also so many times the median of the steps after it. [ratio; chosen by hand]
JUMP_RATIO = 5.0
