"""Tuned numbers of motion: when a foot rests, how limbs are held, how bodies are understood."""

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
#: A leg that is straighter than this bends about the knee's usual axis.
#: [sine of the knee's angle; three degrees, about what a calibration leaves. Results are the same
#: from .02 to .3]
LEAST_BEND = 0.05
#: From here on a leg's reach is soft. [share of its length; chosen on CMU's walks and runs: the
#: peak acceleration of held knees is least from .975 to .985]
SOFT_REACH = 0.98
#: Damping that the search for angles starts with (lambda of Wampler 1986).
#: [share of the skeleton's height for a radian; chosen by hand: it halves or quadruples itself]
DAMPING = 0.05
#: Rounds of that search. [count; chosen by hand]
MOST_STEPS = 30
#: A joint so near its place is there. [share of the skeleton's height; .2 mm of a person]
REACHED = 1e-4

# -- frames that are posed ------------------------------------------------------------------------

#: Channels are posed so many frames at a time. Of more frames, the 95th percentile of the error is
#: that of every second, third ... frame. [frames; chosen by hand: bounds the memory, and many times
#: what a percentile takes]
CHUNK_FRAMES = 4_000

#: Frames of a clip, spread evenly, by which its body is understood; and twice the number of clips
#: that are looked at where there are several. [count; chosen by hand: bounds the time]
POSED_FRAMES = 48

#: The least frames of each of several clips. [count; chosen by hand: some of them show a body that
#: stands]
POSED_FRAMES_OF_EACH = 12

# -- a body's places: `body` ----------------------------------------------------------------------

#: Joints nearer than this share of the body's longest way count as one place.
#: [ratio; 2 cm of an adult, below the shortest bone of a spine and above what exporters put
#: between joints that are one]
SAME_PLACE = 0.012

#: A rest pose stands if it is at least so tall, beside its longest extent.
#: [ratio; 1 of a T-pose, and below .2 of one whose bones all lie along an axis]
STANDING_SHARE = 0.5

#: Length of the longest way along bones, from the toes to the fingers of the other side.
#: [statures; Drillis and Contini: leg .53 and foot .11, half the hips .096, trunk .29, half the
#: shoulders .129, arm .332 and hand .108, less what skeletons cut short]
WAY_OF_STATURE = 1.5

# -- skeletons -------------------------------------------------------------------------------------

#: Joints that a skeleton may have, so that no file takes minutes to be refused.
#: [count; chosen by hand: rigs with faces, hair and clothes have up to some 2,000]
MOST_JOINTS = 10_000

# -- a body's limbs by shape: `body` --------------------------------------------------------------

#: A branch longer than this share of the body's longest way is a limb.
#: [ratio; an arm from the chest is .38 of it, a head with its neck .13]
LONG_LIMB = 0.2

#: Two limbs mirror each other when their bones differ by less than this share of their length.
#: [ratio; people's left and right differ by up to .06 in captured skeletons]
MOST_UNLIKE = 0.12

#: A body with more limbs has no shape that is known: they would be compared two and two.
#: [count; chosen by hand: a human has four, with clothes, hair and what it carries a few dozen]
MOST_LONG_ENDS = 64

#: So many joints of a limb are looked at, from where both limbs meet.
#: [count; a spine's root, hip joint, thigh and shank in two bones each, foot and toes]
MOST_LIMB_JOINTS = 9

#: What branches off no further from where the arms meet than this share of stature may be the head.
#: [ratio; a third of the trunk]
HEAD_REACH = 0.17

#: Beyond the ankle there is no more than this share of stature.
#: [ratio; a foot is .152 long (Drillis and Contini)]
FOOT_SHARE = 0.2

#: Beyond the wrist there is no more than this share of stature.
#: [ratio; a hand is .108 long (Drillis and Contini)]
FINGERS_SHARE = 0.14

#: How much these shares count beside the squared logarithm of the segments' ratio.
#: [1; a place wrong by a hand's width counts as much as segments wrong by a third]
PLACE_WEIGHT = 10.0

#: What it costs if the joint between two segments never bends.
#: [1; about as much as segments of which one is half as long again as it should be]
BEND_WEIGHT = 0.15

#: A joint whose angle changes by less does not bend.
#: [degrees; below any knee or elbow that moves, above the noise of rounded channels]
BENDING_DEG = 4.0

#: Limbs that fit a human worse than this are not a human's.
#: [1; an ape's long arms cost .2, a dog's front legs .5]
MOST_LIMB_COST = 0.45

#: The base of the head is between these shares of stature above the shoulders, along the trunk.
#: [ratio; shoulders are at .818 of stature, the chin at .870, the ears at .92, the top of the head
#: at 1 (Drillis and Contini)]
HEAD_RISE = (0.04, 0.14)

# -- a body's position channels: `body` -----------------------------------------------------------

#: Position channels shorter than this share of their OFFSETs (the median over joints) are
#: displacements. [ratio; places are 1 of them, and displacements of joints a few hundredths]
DISPLACEMENT_SHARE = 0.5

# -- a body's anatomy: `body` ---------------------------------------------------------------------

#: The same segment on both sides of the body differs by no more than this share.
#: [ratio; captured skeletons of people reach .2]
MOST_ASYMMETRY = 0.35

#: Least and most of the ratios of a human's lengths, children and cartoons among them.
#: [ratio; Drillis and Contini's are 1.0, 1.27, .68, .59, .35, .39 and .53; what 20 exporters'
#: people have, with as much room again for characters]
PROPORTIONS = {
    "thigh to shank": (0.6, 1.6),
    "upper arm to forearm": (0.5, 2.6),
    "arms to legs": (0.35, 1.1),
    "trunk to legs": (0.25, 1.2),
    "head to trunk": (0.04, 1.0),
    "hips to legs": (0.05, 0.6),
    "shoulders to legs": (0.1, 1.0),
}

#: Legs that point along the trunk, towards the head, by more than this are none.
#: [cosine; 60 degrees, in the median frame: people squat and sit, but do not stay folded up]
FOLDED_COSINE = 0.5

#: A limb hangs down from the trunk if the cosine of their angle is smaller.
#: [cosine; 50 degrees]
ALL_FOURS_COSINE = 0.64

#: A body walks on all fours if it does so in more than this share of frames.
#: [ratio; chosen by hand: an animal never stands up, a person who crawls gets down and up]
ALL_FOURS_SHARE = 0.9

#: On all fours, arms of more than this share of the legs are an animal's.
#: [ratio; .68 of a human, .8 to 1 of dogs and horses]
LONG_ARM = 0.8

#: On all fours, a trunk of more than this share of the legs is an animal's.
#: [ratio; .59 of a human, .9 to 1.8 of cats, dogs and horses]
LONG_TRUNK = 0.85

# -- a body's unit and vertical axis: `body` ------------------------------------------------------

#: The usual stature. [metres; of adults, both sexes]
STATURE_M = 1.68

#: Spread of the logarithm of statures below the usual one and above it. [1; children of two years
#: are half as tall as adults, while few people are a fifth taller; with room for limbs that are
#: placed otherwise than anthropometry has them]
STATURE_SPREADS = (0.3, 0.15)

#: What a unit costs beside others, as minus the logarithm of how seldom it is.
#: [1; chosen by hand: results change only for statures between two units' usual ones]
UNIT_COSTS = {
    "metres": 0.0,
    "centimetres": 0.0,
    "millimetres": 1.0,
    "inches": 1.0,
    "CMU": 1.5,
    "decimetres": 2.5,
    "feet": 3.0,
}

#: What a body's direction at rest counts beside its mean direction over the motion.
#: [ratio; chosen by hand: a motion that stands decides alone, one that only lies does not]
REST_WEIGHT = 0.55

#: What a floor counts beside it.
#: [ratio; chosen by hand: with the rest pose just more than a body that lies along another axis]
FLOOR_WEIGHT = 0.8

#: Lowest points that wander by this share of the body's longest way look e times less like a floor.
#: [ratio; 15 cm of an adult]
FLOOR_SPREAD = 0.1

#: Along another direction than y and z a body may stand if its head is so far above the feet, at
#: rest and in the mean over the motion. [cosine; 37 degrees: who lies or hangs does not at rest]
SURELY_STANDS = 0.8

#: A joint map makes left right if the way to the left hip is so far from where left is by feet and
#: knees. [cosine; chosen by hand: 120 degrees, past what a limp or a crawl does]
SURELY_MIRRORED = -0.5

#: A body of another stature is read, with a warning that its unit may be wrong.
#: [m; a toddler and the tallest people on record, with room]
STATURES_M = (0.5, 2.5)

#: Lead of the vertical over the other axis at which it is as likely as .73.
#: [1; the mean cosine of a body that leans by 45 degrees leads by 0]
AXIS_SPREAD = 0.15

# -- segments of two bodies ------------------------------------------------------------------------

#: An elbow or knee that is hardly bent bends about the axis across the body.
#: [sine of the angle; chosen by hand: six degrees]
LEAST_FOLD = 0.1

#: Frames in which an ankle is so low that its foot is flat. [share of the motion; a foot is flat
#: from a tenth to a third of a step]
FLAT_FOOT_SHARE = 0.2

#: Skeletons of the same joints whose bones at rest point the same ways take each other's rotations.
#: [cosine of the angle; chosen by hand: CMU's subjects differ by up to 12 degrees, a T from an A
#: pose by 30 and more]
SAME_REST_COSINE = 0.94
