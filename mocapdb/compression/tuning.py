"""The tuned numbers of compression: what each does, its unit, and where it comes from.

What the byte format fixes (docs/format.md) stands beside the code that writes it, but for what was
fitted on clips: a change of those needs a new layout version, or old payloads cannot be read.
"""

from __future__ import annotations

# -- What a target promises besides its bound ------------------------------------------------------

#: By how much a joint's swing may shrink at most, as a share of it: half of that at either end.
#: [ratio; chosen so that nine tenths of every motion are left]
JOINT_SHARE = 0.1

#: The root mean square error of a joint's rotation over all frames, as a multiple of that share of
#: its deviation. [ratio; chosen by hand: nine tenths of its variance are left]
JOINT_RMS = 3.0

#: A joint that hardly turns may be off by this much: of 3 degrees at least 80 % are left.
#: [degrees; half of a fifth of 3 degrees]
JOINT_FLOOR_DEG = 0.3

#: The same for translations of joints other than the root.
#: [mm; chosen by hand: a fifth of 2 mm may be missing, half of it at either end]
JOINT_FLOOR_MM = 0.2

#: The bound for every vertex, as a multiple of that for their mean.
#: [ratio; chosen by hand: nine in ten clips stay below it by themselves]
MAX_OF_MEAN = 20.0

#: Looser means than this are searched for as this where joints keep their own motion: their bounds
#: decide then. [mm; measured on CMU's 02_03: at 20 mm 5.8 bytes a frame, at 100 6.2, at 1000 7.8]
LOOSEST_PROMISE_MM = 20.0

#: Where what is decoded breaks a bound, the next target is smaller by what was broken: by these at
#: the most and at the least. [ratio; chosen by hand: bytes against time]
TIGHTENED_BY = (0.75, 0.97)

#: How many targets are tried. [count; chosen by hand: then the clip is stored as it is]
TIGHTENINGS = 8

# -- O'Kane's codec --------------------------------------------------------------------------------

#: Where the search for the shares of a target starts: the root's, and of what is left the PCA's.
#: [ratio; chosen by hand: near what is found for most clips]
SPLIT_START = (0.2, 0.875)

#: Between which bounds the root's share is searched for.
#: [ratio; chosen by hand: beyond them bytes only grow]
SPLIT_ROOT_RANGE = (0.05, 0.65)

#: Between which bounds the PCA's share is searched for, of what the root leaves.
#: [ratio; chosen by hand: beyond them bytes only grow]
SPLIT_PCA_RANGE = (0.1, 0.98)

#: How often each of the two golden-section searches shrinks its interval.
#: [count; chosen by bytes against time: two more save less than 1 %]
SPLIT_ROUNDS = 4

#: The shares and the kind of coding found for a target serve others up to so many times as large
#: or small. [ratio; chosen by hand: bytes against time of a search for a number of bytes]
SPLIT_REACH = 1.4

#: The search for the shares measures the error on about so many frames of the clip.
#: [frames; chosen by bytes against time]
SPLIT_FRAMES = 64

#: The search for the shares counts coefficients to within this share.
#: [ratio; chosen by bytes against time]
SPLIT_SLACK = 0.01

#: How much of the target the axes of a set may use up. Fewer axes leave each clip more to code.
#: [ratio; measured on CMU's walks: less costs axes and hardly saves coefficients]
SET_SHARE = 0.4

#: What the axes of a set may use up where joints keep their own motion, as a part of the above.
#: [ratio; measured on CMU's subject 02: clips are then coded to a quarter to a half of the target]
SET_PROMISE = 0.35

#: What axes of a set keep where no error is asked for but a number of bytes.
#: [share of the variance; chosen by hand: leaves about a millimetre]
SET_VARIANCE = 0.9999

#: On how many frames of each clip the error of a set's axes is measured.
#: [frames; chosen by hand: the mean hardly changes with more]
SET_MEASURED_FRAMES = 64

#: The search for the number of coefficients measures the error on every so many frames; the
#: result is measured on all. [frames; O'Kane 2008 measures at 30 of 120 Hz]
OKANE_STRIDE = 4

#: Clips shorter than this are measured on all frames in the search too.
#: [frames; chosen by hand: below it there are too few frames to leave any out]
OKANE_SHORT_FRAMES = 64

#: The search for the number of coefficients stops when it is known to within this share.
#: [ratio; chosen by hand: bytes against time of the search]
OKANE_SLACK = 0.002

#: The same for the coefficients of the root's track, which are few.
#: [ratio; chosen by hand: bytes against time of the search]
OKANE_ROOT_SLACK = 0.01

#: Where the error of all frames breaks the target that every n-th frame kept, the next
#: search aims this much below their ratio. [ratio; chosen by hand, to end after one more search]
OKANE_RETRY = 0.999

#: The search for a count tests a guess that is interpolated between its bounds (in logarithms), and
#: this share of the interval more; it comes no nearer to a bound than that.
#: [ratio; chosen by hand, to close in from both sides]
GUESS_MARGIN = 0.02

#: Where the count is likely to be known, it is looked for within this share of it first.
#: [ratio; chosen by hand: from one share of a target to the next it changes by less]
GUESS_REACH = 0.15

#: How often columns of the poses are weighed anew so that joints keep their own motion.
#: [count; chosen by hand: after six what is missing hardly changes]
OKANE_WEIGHINGS = 6

#: A column weighs more where its joint breaks a bound, as if it did so many times over as much.
#: [ratio; chosen by hand: bytes against rounds]
OKANE_OVERSHOOT = 1.15

#: The most by which a column's weight grows at once.
#: [ratio; chosen by hand: more of one joint's motion than it needs costs bytes]
OKANE_MOST_WEIGHING = 8.0

# -- A number of bytes as target -------------------------------------------------------------------

#: The first mean distance that is tried. [mm; chosen by hand: the default of a build]
BYTES_START_MM = 1.0

#: How often the first one is corrected by rough counts of bytes, where a codec has them.
#: [count; chosen by hand: then it is within a third of what is found]
BYTES_ROUGH_ROUNDS = 4

#: The mean distance falls as bytes grow to this power.
#: [1; measured on a few clips coded by O'Kane's codec]
BYTES_FALL = 1.4

#: The finest mean distance that is tried. [mm; chosen by hand: below what any file resolves]
FINEST_MM = 1e-6

#: The loosest mean distance that is tried. [mm; chosen by hand: no body is left at it]
LOOSEST_MM = 1e4

#: From this share of the bytes on, a payload is as large as it may be.
#: [ratio; chosen by hand: bytes against time of the search]
BYTES_CLOSE = 0.98

#: How many targets are tried. [count; chosen by hand: most clips take five]
BYTES_ROUNDS = 14

#: The most by which the target changes until one too fine and one too coarse are known.
#: [ratio; chosen by hand]
LARGEST_STRIDE = 64.0

# -- Pose codec: smooth channels, blocks and bases -------------------------------------------------

#: A joint keeps its own order of axes unless another is smoother than this part of its roughness:
#: a change costs a byte, and every decoded frame a conversion.
#: [ratio; chosen by hand; scripts/fit_codec.py tries others]
OWN_ORDER_ADVANTAGE = 0.9

#: About how many integers a block has. More take fewer bytes, since models learn longer, and more
#: time to decode one frame: a millisecond or two.
#: [count; chosen by bytes against that time; scripts/fit_codec.py tries others]
BLOCK_VALUES = 6_000

#: A clip of up to this many frames is one block. [frames; chosen by hand: nothing to gain by parts]
ONE_BLOCK_FRAMES = 192

#: How long the stretches are from which the first step for a mean is estimated, and the integers
#: that a frame needs. [frames; chosen by bytes against time: 96 save half a percent of them]
PROBE_FRAMES = 64

#: The same for a maximum. [frames; chosen by hand: most of a second at 120 Hz]
MAXIMUM_PROBE_FRAMES = 96

#: The shortest and the longest block. [frames; chosen by hand; the format allows 4096]
BLOCK_FRAMES_RANGE = (64, 2048)

#: How many times as many integers a maximum needs as the estimate, which weighs all points alike.
#: [ratio; chosen by hand: it sets the length of blocks; scripts/fit_codec.py measures it]
INTEGERS_FOR_MAXIMUM = 1.6

#: A clip as long as this is also tried in axes of its own (decorrelation ``"auto"``); shorter ones
#: do not pay for the 2 to 3 kB of axes. [frames; chosen by hand: even then they seldom pay]
OWN_BASIS_FRAMES = 6_000

#: On how many frames of each clip the metric of a basis is averaged.
#: [frames; chosen by hand: the mean hardly changes with more]
BASIS_METRIC_FRAMES = 64

#: What is added to the diagonal of that metric, as a share of each entry, so that directions that
#: move no point stay small. [ratio; chosen by hand]
BASIS_RIDGE = 1e-3

#: A basis whose matrix, rounded to bytes, has a larger condition number is not used.
#: [ratio; chosen by hand: coordinates in it would have no exact meaning]
BASIS_MOST_CONDITION = 1e7

# -- Pose codec: the metric ------------------------------------------------------------------------

#: Weight of the points around each joint (the shell) beside those of the skin, which count 1: it
#: keeps the error finite of what moves no bone, such as a turn of a hand.
#: [ratio; chosen by hand; scripts/fit_codec.py tries others]
SHELL_WEIGHT = 1e-3

#: What is added to each diagonal entry of the metric, as a share of it. It keeps errors that cancel
#: each other so small that the first order holds.
#: [ratio; the best of 0, 1e-4, 1e-3, 3e-3 and 1e-2, which scripts/fit_codec.py tries again]
METRIC_DAMPING = 1e-3

#: What is added to all diagonal entries, as a share of the largest, so that a channel that moves no
#: point has a finite step. [ratio; chosen by hand]
METRIC_RIDGE = 1e-7

#: One metric serves while no entry of a joint's rotation has changed by more than this, added up
#: from frame to frame. [1, of a sine or cosine; chosen by bytes against time]
METRIC_TURN = 0.3

#: And for so many frames at the most. [frames; chosen by bytes against time]
METRIC_MOST_FRAMES = 4

#: The same where a maximum is held, whose weights differ from frame to frame.
#: [frames; chosen by bytes against time: 1 takes a tenth more time for the same bytes]
MAXIMUM_METRIC_FRAMES = 3

#: Memory for the metric of a clip or block. Where all frames would take more, every n-th
#: frame serves for its neighbours. [bytes; chosen by hand: 48 MiB]
METRIC_BYTES = 48 * 2**20

# -- Pose codec: modes, integers and bits of a block -----------------------------------------------

#: What a bit is worth (lambda of rate-distortion), in squared steps. At a high rate it would be
#: 2 ln 2 / 12 = 0.1155 of a uniform quantiser; the trellis halves the step of each of its two
#: quantisers. [squared steps a bit; 0.1155 times the best of 1.2, 2.4, 4
#: and 6, which scripts/fit_codec.py tries again]
BIT_PRICE = 4.0 * 0.1155

#: How many paths the search for integers keeps (the M of the M-algorithm).
#: [count; chosen by bytes against time]
BEAM_WIDTH = 8

#: A path that costs so much more than the best is not kept.
#: [bits; chosen by bytes against time]
BEAM_SLACK = 5.0

#: How many it keeps where modes are only compared. [count; chosen by bytes against time]
NARROW_BEAM_WIDTH = 2

#: The search also tries the integer 0 where it is at most this far from the wanted value.
#: [steps; chosen by hand: farther zeros never pay]
ZERO_REACH = 5.0

#: What the first integer of a track is taken to cost. [bits; chosen by hand, near what it costs]
FIRST_VALUE_BITS = 10.0

#: What the mode of a channel is taken to cost. [bits; log2 of the 16 symbols, as if all were alike]
MODE_BITS = 4.0

#: What a transform costs is estimated: so many bits for its mode, length and first integer.
#: [bits; fitted to what a beam finds, on 7,400 channels of blocks of 15 clips of CMU and HDM05]
TRANSFORM_BITS = 20.1

#: And for each coefficient, besides a bit for each octave of 1 and its magnitude, so many.
#: [bits; fitted to the same]
COEFFICIENT_BITS = 1.4

#: What the sum over the coefficients is multiplied by. [ratio; fitted to the same]
TRANSFORM_SCALE = 1.29

#: Where the estimate is nearer than this to what a spline costs, the transform is coded to see.
#: [ratio; chosen by hand: 1.1 % fewer bytes on 44 clips of 100 frames, for up to a seventh of the
#: time]
TRANSFORM_DOUBT = 1.15

#: What a track of several integers takes at the least: where one value costs no more, with its
#: error, nothing else is tried. [bits; chosen by hand: first value, mode, and a few small ones]
LEAST_BITS = 20.0

#: What a spike is taken to cost. [bits; chosen by hand, near what one costs]
SPIKE_BITS = 14.0

#: What is left of a frame's weight in the fit of a curve where a spike stores its difference.
#: [ratio; numerical: as good as nothing, but the fit stays regular]
SPIKE_WEIGHT = 1e-6

#: Coefficients of a transform after the last one over this are not coded.
#: [steps; chosen by hand: what rounds to 0, and little more]
LAST_COEFFICIENT = 0.6

#: A transform is taken only where it costs so much less than the best spline: no later track can
#: learn from the activity of its own. [ratio; chosen by hand; scripts/fit_codec.py tries others]
TRANSFORM_HANDICAP = 1.04

#: A channel's mode is chosen anew where its step has changed by so much since it was chosen last.
#: [octaves; chosen by bytes against time]
EXPLORE_AFTER = 0.25

#: The spline that the search for a mode starts from where nothing is known: knots every 8 frames.
#: [index of modes.SPACINGS; chosen by hand: near the middle]
FIRST_MODE = 5

#: What is added to the normal equations of a spline, as a share of their largest entry:
#: coefficients beyond the clip's ends may have next to no samples. [ratio; numerical]
SPLINE_RIDGE = 1e-10

# -- Pose codec: the search for the step -----------------------------------------------------------

#: The step that leaves a mean distance of 1. [ratio; measured on most clips, which
#: scripts/fit_codec.py does again]
STEP_OF_MEAN = 0.45

#: The mean distance where the maximum is 1, as long as all points weigh the same.
#: [ratio; measured on clips, which scripts/fit_codec.py does again]
MEAN_OF_MAXIMUM = 0.15

#: The search for a mean aims here, as a share of the target. [ratio; chosen by hand]
MEAN_AIM = 0.998

#: From here on a mean is near enough to its target. [ratio; chosen by hand]
MEAN_CLOSE = 0.995

#: How many steps are tried for a mean, if one of them holds it.
#: [count; chosen by hand: most clips end before]
MEAN_ROUNDS = 8

#: How many steps are tried for a mean where none holds it.
#: [count; chosen by hand: then the clip is stored as it is]
MEAN_MOST_ROUNDS = 40

#: The step follows the mean with this exponent: where the step shrinks, more channels need knots
#: closer to each other, which leave more noise. [1; measured on clips]
MEAN_EXPONENT = 1.35

#: How many times the mean grows at one step where points weigh the inverse of their distance.
#: [ratio; measured on clips]
MEAN_AFTER_WEIGHTS = 1.08

#: A mean so near to its target is trimmed: only the last channels are encoded anew.
#: [1, of the logarithm of the ratio; chosen by bytes against time]
TRIM_WITHIN = 0.05

#: One in so many channels is encoded anew. [count; chosen by bytes against time]
TRIM_SHARE = 6

#: How often. [count; chosen by bytes against time]
TRIM_ROUNDS = 4

#: Where trimming aims, as a share of the target. [ratio; chosen by hand: between close and held]
TRIM_AIM = 0.997

#: By how many octaves the mean changes where the price of a bit changes by one, in the channels
#: that are encoded anew. [1; measured on a few clips]
TRIM_GAIN = 0.035

#: The most by which that price changes. [octaves; chosen by hand: further off it pays no more]
TRIM_MOST = 1.2

#: How many stretches of a clip are encoded before it, to estimate the first step, the points'
#: weights and the integers of a frame. [count; chosen by hand]
PROBES = 2

#: Points weigh the inverse of their distance, but no more than those at this share of the mean.
#: [ratio; chosen by hand; scripts/fit_codec.py tries others]
LEAST_DISTANCE = 0.2

#: Rounds of the search for a maximum in the first block; later ones, which begin where that ended,
#: take one less. [count; chosen by bytes against time]
MAXIMUM_ROUNDS = 10

#: A maximum that is broken by less than this is trimmed as a mean is.
#: [ratio of error and target; chosen by bytes against time]
TRIM_MAXIMUM_WITHIN = 1.2

#: How often. [count; chosen by bytes against time]
TRIM_MAXIMUM_ROUNDS = 3

#: For so many first rounds weights move both ways, up for points near the maximum and down for
#: others; one less in later blocks. [count; chosen by hand]
LEVELLING_ROUNDS = 3

#: In these rounds the step follows the error with this exponent: the worst point falls mostly by
#: its own weight. [1; chosen by bytes on 14 clips of CMU, HDM05 and others: 0 and 0.5 take more]
LEVELLING_EXPONENT = 0.3

#: Later the step follows the error with this exponent; below 1, so as not to overshoot.
#: [1; chosen by hand; scripts/fit_codec.py tries others]
STEP_EXPONENT = 0.8

#: An error below this share of the target counts as this share when the next step is found.
#: [ratio; numerical: a clip may have no error at all]
LEAST_ERROR_RATIO = 1e-3

#: A point that comes near the maximum in one frame weighs more in all frames of this window.
#: [s; chosen by hand, about the reach of a spline's knot; scripts/fit_codec.py tries others]
EMPHASIS_WINDOW_S = 0.1

#: While weights are levelled: a point far from the maximum keeps this part of its weight.
#: [ratio; chosen by hand; scripts/fit_codec.py tries others]
LEAST_EMPHASIS = 0.3

#: The most by which weights may differ from each other. [ratio; chosen by hand]
MOST_EMPHASIS = 256.0

#: A point that breaks the maximum r times over gets more weight, as if it were this much further
#: off. [ratio; chosen by hand, so that it does not come back just over the maximum]
EMPHASIS_OVERSHOOT = 1.05

#: The largest r that counts. [ratio; chosen by hand: weights grow 16 times a round at the most]
EMPHASIS_MOST_RATIO = 2.0

#: The weight grows by r to this power. [1; chosen by hand: an error falls more slowly than the root
#: of its weight grows; scripts/fit_codec.py tries others]
EMPHASIS_POWER = 4.0

#: How much the step changes at the least where a search knows a step that is too fine, or one that
#: is too coarse, but not both. [1/64 octave; chosen by hand: three sixteenths of an octave]
LEAST_STEP_CHANGE = 12

#: Where all of that did not hold a maximum, the step shrinks at most so many times.
#: [count; chosen by hand: with `REFINEMENT` 15 octaves in all]
REFINEMENT_ROUNDS = 40

#: How much the step then shrinks each time. [1/64 octave; chosen by hand: by a quarter]
REFINEMENT = 24

#: After so many times every channel is coded frame by frame, without curves.
#: [count; chosen by hand: 2 octaves]
REFINEMENT_CURVE_ROUNDS = 6

#: What `MEAN_CLOSE` is for a clip in which some joint's own motion has come to weigh more: each
#: round may break the bound of another joint. [ratio; chosen by hand: bytes against time]
OWN_CLOSE = 0.97

#: A joint whose own motion is off weighs more, as if the error were so many times as large.
#: [ratio; chosen by hand: bytes against rounds]
OWN_OVERSHOOT = 1.3

#: When some joint breaks its bound, those that come as near to theirs weigh more too.
#: [ratio; chosen by hand: 1 takes more rounds for the same bytes]
OWN_NEAR = 0.7

#: What `OWN_OVERSHOOT` is, for a joint whose swing is too small, around the ends of the swing.
#: [ratio; chosen by hand: bytes against rounds]
ENDS_OVERSHOOT = 1.7

#: The frames around the end of a swing that then weigh more.
#: [s; chosen by hand: more cost bytes, fewer leave a peak to be cut off]
ENDS_WINDOW_S = 0.04

#: The search lets swings miss this part of what they may: what the two ends miss adds up to first
#: order only. [ratio; chosen by hand]
SWING_HELD = 0.97

# -- Pose codec: prediction, as the format fixes it ------------------------------------------------

#: The filters that predict a track, one a column. Rows: what level, trend and bend take of a
#: residual, and what the trend keeps of itself. They are steady-state Kalman filters of bodies that
#: keep their velocity (or lose it) or their acceleration, under more or less noise.
#: [1/65536; chosen one by one out of 46 such filters, each as the one that saved most on CMU's
#: subjects 13, 49 and 131 and HDM05's actor bk, as scripts/fit_codec.py does]
FILTER_GAINS = (
    (47919, 63892, 55907, 27520, 64420, 61824, 64975, 58475),
    (30391, 92840, 48087, 5933, 96793, 58973, 59405, 58998),
    (0, 0, 0, 0, 76503, 0, 0, 30422),
    (65536, 65536, 60948, 39322, 65536, 39322, 22938, 65536),
)

#: The usual sizes of a track's first indices, before its filters have settled.
#: [1/256; medians of the same clips at the targets of then; scripts/fit_codec.py takes them at one]
FIRST_SIZES = (3600, 2560, 1060, 990)
