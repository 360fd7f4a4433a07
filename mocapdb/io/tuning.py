"""Tuned numbers of reading and writing: T-poses, frame times that are rates, fixed bones."""

#: So many steps after the first tell how far the body usually moves from frame to frame.
#: [frames; chosen by hand: a quarter of a second at 120 Hz]
LATER_STEPS = 30
#: The jump out of a T-pose is at least so large. [degrees, mean over all angles; chosen by
#: hand: above the noise of a capture]
LEAST_JUMP_DEG = 0.5
#: It is also so many times the median of the steps after it. [ratio; chosen by hand]
JUMP_RATIO = 5.0
#: What storing a clip may turn a T-pose by. [degrees; by hand: of three that were stored at 1 mm it
#: is .5 at most]
STORED_POSE_DEG = 1.0

#: A "frame time" of so much or more was written as a rate, or in milliseconds.
#: [s; chosen by hand: no capture has one frame in two seconds, while keyframes at 1 Hz are in use]
LEAST_RATE_AS_TIME = 2.0

#: A joint whose position channels vary by less is written at a fixed place in formats that have no
#: others: its bone does not stretch. [m; chosen by hand: less than a marker's noise]
LEAST_STRETCH_M = 1e-4

#: Lengths and angles beyond this are no capture's, but a broken file's.
#: [units or degrees; chosen by hand: 1000 km in micrometres. Squares of squares of single precision
#: end at 1e38]
LARGEST_NUMBER = 1e12

#: How alike an unknown key of `mocapdb.toml` and a known one must be for that to be offered.
#: [ratio of letters in common; chosen by hand: "joints" gets "joint_map"]
KEY_CLOSENESS = 0.4

#: So long Blender may take to import or export any file.
#: [s; chosen by hand: a file of 60 bones and 1,000 frames takes about .1 s]
BLENDER_S = 120.0
#: So much longer it may take for each megabyte. [s/MB; chosen by hand: it takes about .02 s]
BLENDER_S_PER_MB = 2.0

#: A joint of a file that Blender has imported keeps its place if it moves on its bone by no more
#: than this part of the largest coordinate. [ratio; 24 bits, and some sums of them]
SINGLE_PRECISION = 1e-6
