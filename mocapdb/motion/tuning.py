"""Tuned numbers of motion: when a foot rests, and how limbs are held in place."""

# -- feet on the ground: `foot_contacts` --------------------------------------------------------

#: A leaf of the hierarchy so near the lowest one of the rest pose ends a leg.
#: [share of the skeleton's height; a foot's height with its ankle, Drillis and Contini 1966: .039,
#: three times over for rest poses that stand on tiptoe]
SOLE_REACH = 0.12
#: A ball of a foot that is slower than this may rest. [m/s; chosen by hand: a third of the
#: usual walking speed of 1.3 m/s]
SLOW_M_S = 0.45
#: So may one that is slower than this share of its own speed at the 95th percentile: in a run the
#: foot rolls faster. [ratio; chosen by hand]
SLOW_SHARE = 0.15
#: A ball of a foot rests only so near the lowest place that it reaches.
#: [m; chosen by hand: room for the roll of a foot, and for a floor that is not level]
NEAR_GROUND_M = 0.06
#: Rests that are shorter do not count. [s; below the .08 s of a sprinter's foot]
LEAST_CONTACT_S = 0.06

# -- limbs that reach for a place: `ik` ---------------------------------------------------------

#: A foot that is held is drawn to its place from so long before a rest, and let go so long after.
#: [s; chosen by hand: half of a walk's swing of .4 s]
EASE_S = 0.2
#: The pull on a foot is smoothed by a Gaussian of this deviation. [s; chosen by hand: two
#: frames of 120 Hz, to round the corner where easing begins]
SMOOTH_S = 0.02
#: A leg that is straighter than this has no plane to bend in and is left alone.
#: [sine of the knee's angle; numerical: far below any captured knee]
LEAST_BEND = 1e-4
#: How far out a leg may be stretched to reach. [share of its length; just under 1, where the knee's
#: angle changes infinitely fast]
LONGEST_REACH = 0.9999
#: Damping that the search for angles starts with (lambda of Wampler 1986).
#: [share of the skeleton's height for a radian; chosen by hand: it halves or quadruples itself]
DAMPING = 0.05
#: Rounds of that search. [count; chosen by hand]
MOST_STEPS = 30
#: A joint so near its place is there. [share of the skeleton's height; .2 mm of a person]
REACHED = 1e-4
