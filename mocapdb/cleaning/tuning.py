"""The tuned numbers of cleaning: what was taken from the paper, chosen, or fitted.

"The paper" is Aristidou, Cohen-Or, Hodgins and Shamir, *Self-similarity Analysis for Motion Capture
Cleaning* (2018). "By hand" means: set while looking at the calibration clips that docs/cleaning.md
names, with faults injected; no search over values was run. Angles are of a joint's local rotation;
the natural logarithm is meant throughout.
"""

# -- motion texture and motion words -------------------------------------------------------------

#: Rate of the motion texture, at which words are compared. [frames/s; the paper, section 5]
TEXTURE_FPS = 24.0

#: Length of a source word. [frames; the paper, section 5]
SOURCE_FRAMES = 15

#: Length of a target word, longer so that a slower repetition fits in. [frames; the paper, section
#: 5]
TARGET_FRAMES = 20

#: From the start of a source word to that of the next. [frames; the paper, section 5]
STRIDE = 5

#: Neighbours of each word, K in the paper. [count; the paper, section 5]
N_NEIGHBOURS = 5

#: How many of the largest joint distances are left out of the distance of two frames, so that a
#: faulty joint does not hide the neighbours of the others. [count; the paper, section 5]
DROPPED_JOINTS = 3

#: The same where only a group of joints is compared. [count; the paper, section 5]
DROPPED_JOINTS_OF_GROUP = 1

# -- search of large contexts --------------------------------------------------------------------

#: Context up to which every target is compared; beyond it, candidates only. [s; by hand, by the
#: times that benchmarks/bench_cleaning.py prints]
EXACT_SEARCH_S = 3600.0

#: Clip up to which every target in itself is compared; beyond it, candidates only. [s; by hand, by
#: the times that benchmarks/bench_cleaning.py prints]
EXACT_OWN_S = 600.0

#: Blocks of 16 targets that are compared exactly in a search among candidates. [count; by
#: benchmarks/bench_cleaning.py: 0.998 of the neighbours in 10 hours are found]
N_CANDIDATES = 150

#: The same in a long clip itself, whose words are as many as its targets. [count; by
#: benchmarks/bench_cleaning.py: 0.92 of the neighbours in 600 s are found]
N_OWN_CANDIDATES = 40

#: Frames of a word that stand for all of it when candidates are chosen. [frames; by hand: evenly]
SKETCH_FRAMES = (0, 5, 10, 14)

#: Tempos of a target against the word at which these are compared. [ratio; by hand]
SKETCH_TEMPOS = (0.8, 1.0, 1.25)

#: Axes that stand for all joints in a frame of a sketch. [count; by hand: twice as many find no
#: more]
SKETCH_AXES = 32

#: A clip of the context is a copy if its joints are nearer than this in all but a few frames.
#: [degrees; by hand: a clip that was coded with a loss is a copy, another performance is none]
COPY_DEG = 5.0

#: The share of frames that may be further apart in a copy: a moment, not more. [ratio; by hand]
COPY_SHARE = 0.01

# -- groups of joints and the paper's two-stage search -------------------------------------------

#: Joints so near the body's middle belong to its left and its right half, in heights of the body.
#: [ratio; by hand]
MIDLINE_SHARE = 0.03

#: A word is searched again in the context if a joint is so many times further from the median of
#: its neighbours than these spread. [ratio; by hand, the paper gives no number]
DISTINCT_RATIO = 1.5

#: Added to the spread, so that close agreement of the neighbours alone makes no word distinct.
#: [degrees; by hand]
LEAST_SPREAD_DEG = 3.0

# -- context of other bodies -----------------------------------------------------------------------

#: Joints of the same names that two bodies must have for these to be taken by their names.
#: [count; chosen by hand: fewer are found in any two skeletons]
LEAST_COUNTERPARTS = 8

#: Limbs of such bodies must also bend about the same axes at rest, as their motion shows them.
#: [cosine of the angle between two frames; chosen by hand: 45 degrees, for rigs differ by quarter
#: turns, and how a hardly bent limb bends is found to some ten degrees]
SAME_TWIST_COSINE = 0.7

# -- edges: boundaries between two frames where a joint jumps ------------------------------------

#: Rate at which the limits of jumps below hold; at lower rates they grow in proportion. [frames/s;
#: the rate of CMU's and HDM05's clips]
REFERENCE_FPS = 120.0

#: A joint's usual jumps stay below so many medians of its jumps. [ratio; by hand: of a clean
#: joint's jumps the 95th percentile is some 4 medians]
JUMP_OVER_MEDIAN = 4.0

#: The same in first quartiles, which faults in most of a clip do not raise. [ratio; by hand]
JUMP_OVER_QUARTILE = 12.0

#: Stretches in which the large jumps of hands and toes are looked at one by one. [s; by hand: about
#: a step]
RESTLESS_S = 1.0

#: A large jump is this quantile of the jumps in such a stretch. [ratio; by hand]
LARGE_JUMP_QUANTILE = 0.9

#: A hand or toe is as restless as it is in all but this share of the stretches: faults may be in
#: others. [ratio; by hand, on clips stored at 1 mm]
RESTLESS_SHARE = 0.35

#: Its usual jumps are no less than so many of these large ones. [ratio; by hand, on clips stored at
#: 1 mm: storing makes quiet frames exactly quiet, and the quantiles above collapse]
JUMP_OVER_LARGE = 2.0

#: The least that a joint's usual jumps are taken for, at `REFERENCE_FPS`. [degrees; by hand: so
#: much goes unnoticed]
LEAST_SCALE_DEG = 0.4

#: The most that they are taken for, at `REFERENCE_FPS`. [degrees; by hand: no joint jumps so far
#: all the time]
LARGEST_SCALE_DEG = 2.5

#: A boundary is an edge where the joint jumps so many times its usual jumps ... [ratio; by hand]
EDGE_RATIO = 4.0

#: ... and so far. [degrees; by hand]
LEAST_EDGE_DEG = 2.5

#: Edges are looked for at the clip's rate and halves of it, down to this one, where soft edges are
#: sharp. [frames/s; as the texture's]
LOWEST_EDGE_FPS = 24.0

#: A step of more is no pace that a joint goes on at. [degrees; a third of a turn from frame to
#: frame is faster than any body]
LARGEST_PACE_DEG = 120.0

#: Another joint jumps alike if it jumps by this share of the jump. [ratio; by hand]
ALIKE_SHARE = 0.5

#: So many joints that jump alike may be one fault, of a limb or of both legs; more are a cut.
#: [count; an arm or a leg has four, an exchange turns two of them]
FEW_JOINTS = 8

#: Where a larger share of the body's moving joints jumps, the take was cut. [ratio; by hand: of 13
#: T-poses that a conversion put in front, 14 of 19 joints and more jump; within motion 8 at most]
CUT_SHARE = 0.6

#: A cut so near an end parts frames from the motion that are not searched. [s; by hand: a pose or
#: two that were put there]
CUT_REACH_S = 0.2

#: Joints that move so many times as fast, from the clip's end on, as in the 0.2 s after that glide
#: out of a pose that was put there. [ratio; by hand: of 40 clips of a conversion that does so 39
#: are told, and none of 80 others, at 120, 60 and 30 Hz]
GLIDE_RATIO = 3.0

#: Fewer frames between cuts are no motion of their own. [frames; by hand]
LEAST_FRAMES_LEFT = 8

# -- quieting: noise that is not seen decides nothing --------------------------------------------

#: Rotations so far away in time are averaged: a standard deviation. [s; by hand, on clips before
#: and after storing]
QUIET_S = 0.025

#: Rotations so far away in angle are averaged: a standard deviation. [degrees; by hand, as above: a
#: viewer sees a jump of more]
QUIET_DEG = 2.0

#: How often. [count; by hand, as above]
QUIET_ROUNDS = 2

# -- shapes: what may stand between edges --------------------------------------------------------

#: The longest fault. [s; by hand]
LONGEST_S = 2.5

#: The shortest and the longest slow drift of the root, as of a sensor's heading. [s; by hand]
SLOW_DRIFT_S = (1.5, 6.0)

#: The longest fault with soft edges. [s; by hand]
LONGEST_SOFT_S = 1.25

#: The largest share of a clip that its end may have cut off a fault from: what is wrong is the
#: lesser part. [ratio; a half by definition of the lesser part]
LARGEST_CUT_SHARE = 0.5

#: Edges no further apart are of one stretch of noise. [s; by hand]
NOISE_GAP_S = 0.03

#: So many edges together are noise. [count; by hand]
NOISE_EDGES = 4

#: Noise reaches so far beyond its first and last edge, where it may be small. [s; by hand]
NOISE_MARGIN_S = 0.012

#: An offset larger than this is a flip. [degrees; by hand]
FLIP_DEG = 150.0

#: Two edges are those of an offset if their turns differ by less, relative to the larger. [ratio;
#: by hand]
OFFSET_MISFIT = 0.5

#: Pairs that fit better than this fit alike: noise must not decide which of several half turns
#: belong together. [ratio; by hand, on clips before and after storing]
ALIKE_MISFIT = 0.15

#: Of pairs that fit alike the shorter is taken: what a second between the edges adds to the misfit.
#: [1/s; by hand]
MISFIT_PER_S = 0.02

#: A joint is frozen if it has exactly one rotation for so many frames. [frames; by hand]
FROZEN_FRAMES = 4

#: A joint that stood still and then goes on with a smaller jump was not frozen. [degrees; what a
#: viewer sees is larger; of joints whose noise storing took away it is .2 at most]
LEAST_RELEASE_DEG = 1.0

#: Steps below this share of the joint's median step are none. [ratio; by hand]
STILL_RATIO = 0.01

#: A joint that stands in a larger share of its frames is not frozen: it never moves. [ratio; by
#: hand]
MOST_STILL = 0.7

#: Nor is one whose other steps are smaller. [degrees; by hand]
LEAST_STEP_DEG = 1e-3

#: A joint is held, trembling, if it stays near one rotation for so long before an edge ... [s; by
#: hand]
HELD_S = 0.1

#: ... so near. [degrees; by hand]
HELD_DEG = 2.0

#: So much on either side of a stretch tells how restless the joint is around it. [s; by hand]
BACKGROUND_S = 0.3

#: Pace over which the onset of a drift is looked for: half the length of the filter. [s; by hand]
ONSET_S = 0.05

#: The same for a slow drift: its length over this ... [ratio; by hand]
ONSET_PARTS = 4

#: ... and no more than this. [s; by hand]
ONSET_OF_LONG_S = 0.5

# -- excursions: faults with soft edges -----------------------------------------------------------

#: Rate at which excursions are looked for; higher ones are thinned. [frames/s; by hand]
EXCURSION_FPS = 30.0

#: Half the times over which a joint may leave its course and return. [s; by hand: faults of .1 to
#: 2 s]
EXCURSION_HALF_S = (0.067, 0.1, 0.167, 0.267, 0.4, 0.6, 0.9, 1.2)

#: Smaller excursions are none. [degrees; by hand]
LEAST_EXCURSION_DEG = 8.0

#: An excursion is a hypothesis if it is so odd: a Mahalanobis distance. [1; by hand]
LEAST_ODDNESS = 2.7

#: Frames belong to an excursion that are off its chord by this share of its size. [ratio; by hand]
EXCURSION_BASE = 0.15

#: The share of a joint's vectors that its spread is measured by: the rest may be faults. [ratio; by
#: hand]
SPREAD_QUANTILE = 0.95

#: Added to the spread of a joint, so that one that hardly moves does not find everything odd.
#: [degrees; by hand]
SPREAD_FLOOR_DEG = 2.0

# -- jitter ---------------------------------------------------------------------------------------

#: Rate at which jitter is looked for; higher ones are thinned. [frames/s; by hand]
JITTER_FPS = 60.0

#: Standard deviation of the filter that takes the slow part of the motion. [s; by hand: what is
#: slower than some 3 Hz is motion]
JITTER_SMOOTHING_S = 0.05

#: The same of the filter that takes the noise of single frames. [s; by hand]
JITTER_FINE_S = 0.015

#: Window over which a tremble is measured. [s; by hand]
JITTER_WINDOW_S = 0.2

#: A joint trembles where it does so many times the usual. [ratio; by hand]
LEAST_CONTRAST = 2.0

#: The least that the usual tremble is taken for. [degrees; by hand]
LEAST_TREMBLE_DEG = 0.4

#: What trembles for less is a single jump. [s; by hand]
LEAST_JITTER_S = 0.12

#: Frames belong to it that have this share of its largest contrast. [ratio; by hand]
JITTER_BASE = 0.4

# -- straight lines -------------------------------------------------------------------------------

#: The least straight line. [frames; by hand: rounding makes shorter ones]
LINE_FRAMES = 5

#: What is straight may bend by so many of the file's last digits. [ratio; a second difference of
#: rounded numbers is off by 2, and a rotation's by somewhat more]
ROUNDING_OF_LINE = 4.0

#: The joint's usual bends are so many times what rounding explains, or nothing can be told.
#: [ratio; by hand]
LEAST_CONTRAST_OF_LINE = 5.0

#: A joint that is straight in a larger share of its frames was sampled so. [ratio; by hand]
MOST_STRAIGHT = 0.4

#: A line over which the joint turns less is rest, ... [degrees; by hand]
LEAST_LINE_TURN_DEG = 0.03

#: ... or less than so many times what rounding explains. [ratio; by hand]
TURN_OVER_ROUNDING = 12.0

# -- exchanges of left and right ------------------------------------------------------------------

#: Both joints together jump so far at an edge. [degrees; by hand]
LEAST_EXCHANGE_DEG = 5.0

#: Swapped back, less than this share of the jump is left. [ratio; by hand]
LARGEST_LEFT_OVER = 0.5

#: The longest exchange. [s; by hand]
LONGEST_EXCHANGE_S = 5.0

# -- jumps of the root ----------------------------------------------------------------------------

#: The root's translation has an edge where it jumps so many times its usual jumps ... [ratio; by
#: hand]
ROOT_EDGE_RATIO = 3.0

#: ... and so far. [m; by hand]
LEAST_ROOT_JUMP_M = 0.015

#: The least that its usual jumps are taken for. [m; by hand]
LEAST_ROOT_SCALE_M = 0.001

# -- evidence on a hypothesis --------------------------------------------------------------------

#: Quantile of the jumps around a stretch that tells how restless the joint is. [ratio; by hand]
BACKGROUND_QUANTILE = 0.9

#: The joint stands if the median of its steps is smaller. [degrees; by hand]
STANDING_DEG = 0.02

#: The joint is at the end of its range if it hardly ever turns further than this to one side of
#: where it stands. [degrees; by hand; `HELD_DEG` where it trembles]
LIMIT_DEG = 0.05

#: What "hardly ever" is: the share of frames in which it does. [ratio; by hand: where the joint is
#: wrong elsewhere, it may turn anywhere]
LIMIT_SHARE = 0.05

#: Steps after a freeze that the first one is compared with. [frames; by hand]
RELEASE_FRAMES = 3

#: Added to angles whose ratio is evidence, so that the noise of the last digits makes none.
#: [degrees; by hand]
LEAST_ANGLE_DEG = 0.1

#: Added before a logarithm is taken of a jump, or of its ratio to the usual ones, which may be 0.
#: [degrees, ratio; by hand]
LEAST_JUMP = 1e-3

#: Shorter stretches count as this long. [s; by hand: they tell no less]
LEAST_LENGTH_S = 0.1

#: So much on either side of a stretch tells how far the joint usually is from its neighbours. [s;
#: by hand]
BESIDE_S = 0.5

#: Added to angles to similar motion whose ratio is evidence. [degrees; by hand]
LEAST_APART_DEG = 1.0

#: Quantile of how far a repair moves a joint in a stretch that counts as how far it does. [ratio;
#: by hand: frames near the edges move little]
MOVED_QUANTILE = 0.8

#: A hypothesis whose repairs move the joint less, both by a line and by similar motion, is no
#: fault. [degrees; what a viewer sees]
LEAST_MOVED_DEG = 3.0

#: What a hand or a toe takes off the log-odds of a fault: they are restless in most captures, ...
#: [log-odds; by hand]
RESTLESS_LOG_ODDS = 1.0

#: ... and more so at low rates: the same for each halving of `REFERENCE_FPS`, times the logarithm
#: of 2. [log-odds; by hand]
RESTLESS_RATE_LOG_ODDS = 1.5

# -- corroboration: what other hypotheses say -----------------------------------------------------

#: The least log-odds that a hypothesis counts with beside another; where there is none it counts as
#: this. [log-odds; by hand]
FLOOR = -6.0

#: The most that it counts with. [log-odds; by hand: one sign alone must not decide]
CEILING = 4.0

#: The most that a hypothesis itself counts with. [log-odds; by hand]
OWN_CEILING = 8.0

#: The most that is taken from a hypothesis that nothing else speaks for. [log-odds; by hand: what
#: is .98 sure by itself is flagged]
MOST_DOUBT = 2.4

#: Less likely hypotheses are not weighed again. [log-odds; by hand: for the sake of time]
LEAST_OWN = -5.0

#: Two hypotheses are about the same stretch if they share more than this, of all that either
#: covers. [ratio; by hand]
SAME_STRETCH_SHARE = 0.3

#: Shorter stretches count as this long. [s; by hand: a frame or two]
LEAST_SPIKE_S = 0.02

#: Frames that tell how a joint's rotations and excursions spread. [count; by hand, for the sake of
#: time]
MOST_POOLED = 400

#: Added to Mahalanobis distances whose ratio is evidence. [1; by hand]
LEAST_ODD = 0.5

# -- joint limits, learnt from clean motion ------------------------------------------------------

#: Rotations nearer in time show the same moment and set no limit. [s; by hand]
OTHER_TIME_S = 0.5

#: Quantile of a joint's angles to its nearest other rotation that is usual. [ratio; by hand]
LIMIT_QUANTILE = 0.8

#: Frames of a stretch that are tested. [count; by hand]
MOST_TESTED = 16

#: Frames of a clip that are tested for what is usual. [count; by hand]
MOST_TESTED_OF_CLIP = 200

#: Frames of a clip, or of a context, that set the limits. [count; by hand, for the sake of time]
MOST_SEEN = 4000

# -- hypotheses by self-similarity ---------------------------------------------------------------

#: Window of the running median that is taken off a joint's turns away from its neighbours: what
#: lasts longer is style or body, not a fault. [s; by hand: over `LONGEST_S`]
HIGH_PASS_S = 3.0

#: A joint's usual distance to its neighbours is this quantile of it ... [ratio; by hand]
USUAL_QUANTILE = 0.75

#: ... times this, [ratio; by hand]
USUAL_FACTOR = 2.0

#: and this at least. [degrees; by hand]
LEAST_USUAL_DEG = 3.0

#: A peak is a hypothesis if it is so many times the usual. [ratio; by hand]
LEAST_PEAK = 1.5

#: Frames around a peak belong to it that have this share of its height. [ratio; by hand]
PEAK_BASE = 0.2

#: Added to how far the rest of the body is from its neighbours, before the logarithm is taken.
#: [ratio; by hand]
LEAST_REST = 0.1

#: How exact its ends are, as if it had been seen at the clip's rate halved so often. [count; by
#: hand: of 120 Hz that is 30, near the texture's rate]
SIMILARITY_HALVINGS = 2

#: Quantile of a joint's changes of pace that its sharpest one is compared with. [ratio; by hand]
SHARPNESS_QUANTILE = 0.9

#: The least that this is taken for. [degrees; by hand]
LEAST_SHARPNESS_DEG = 1.0

#: What turns one way by this share of its size is no noise. [ratio; by hand]
ONE_WAY_SHARE = 0.7

#: It is an offset, not a drift, if its median is over this share of its largest turn. [ratio; by
#: hand: of a ramp it is a half]
STEADY_SHARE = 0.6

# -- one hypothesis for each fault ---------------------------------------------------------------

#: A hypothesis of which others explain more than this share says nothing new. [ratio; by hand]
COVERED_SHARE = 0.5

#: What lies within a soft stretch and is no more of it than this does not explain it. [ratio; by
#: hand: a gap that a program has filled, or a tremble, in the middle of a longer fault]
SMALL_PART = 0.35

#: Ends no further apart are the same edge. [s; by hand]
SAME_EDGE_S = 0.07

#: Two stretches of noise no further apart are one. [s; by hand]
NOISE_PAUSE_S = 0.1

#: Two other stretches of one joint with no more between them are one. [frames; by hand: a program
#: that fills a gap in two halves leaves the frame where they meet]
PAUSE_FRAMES = 2

# -- where a fault begins and ends ---------------------------------------------------------------

#: A span grows while the joint jumps beside it by this share of what it does within: jitter of its
#: median, other faults of their largest jump; or by `LEAST_MOVED_DEG` if that is less ... [ratio;
#: by hand]
GROWN_JUMP_SHARE = 0.25

#: ... and by so many times what it usually does; ... [ratio; by hand]
GROWN_JUMP_RATIO = 4.0

#: ... the same of jitter, which goes on all the time. [ratio; by hand]
GROWN_NOISE_RATIO = 2.5

#: By how much jitter may grow at either edge. [s; as the longest in the kit of faults]
LONGEST_NOISE_S = 1.0

#: A soft edge is carried on while the joint goes at this share of its pace there. [ratio; by hand:
#: faults ease in from rest]
GROWN_PACE_SHARE = 0.25

#: By how much a span may grow at either edge. [s; half the longest easing, which is seen from its
#: middle on]
MOST_GROWN_S = 0.3

#: For how long what jumps may pause. [s; by hand: smoothed jitter turns round as often]
CALM_PAUSE_S = 0.1

#: A drift that begins no later in a clip has been cut off by its start. [s; by hand]
CUT_DRIFT_S = 0.15

#: Score of the paper's own map over which a joint's frame is flagged. [1; the paper, section 4]
LITERAL_THRESHOLD = 0.5

# -- repair --------------------------------------------------------------------------------------

#: An offset, flip or drift is taken back if its largest jump falls below this share. [ratio; by
#: hand]
LARGEST_JUMP_LEFT = 0.35

#: Spans of two joints are from when to when the same if they share so much of what either covers.
#: [ratio; by hand: their ends are found one by one, to a frame or two]
SAME_SPAN_SHARE = 0.8

#: A span that no way is expected to fill better is left as it is. [degrees; by hand]
LARGEST_ERROR_DEG = 30.0

#: Other gaps that each way to fill is tried on. [count; by hand]
N_TRIALS = 12

#: They are looked for within so much of the span. [s; by hand: so long clips take no longer]
TRIAL_REACH_S = 60.0

#: Similar motion is taken if its error on those gaps is below this share of interpolation's.
#: [ratio; by hand: of a dozen gaps a lesser gain is chance]
NEIGHBOURS_MUST_BEAT = 0.9

#: A line that fills a gap is bent by this share of what would keep the paces at its edges. [ratio;
#: by hand: exactly straight, it would look like a program's]
LINE_BEND = 0.25

#: A gap that a program has filled is filled anew if that errs by less than this share of what a
#: line does. [ratio; by hand: what is there may be right]
FILLED_MUST_BEAT = 0.6

#: The ramp of a drift may be off by this share of its turn, for its onset is never sure. [ratio; by
#: hand]
ONSET_MISFIT = 0.1

#: What an end of the clip cuts off is turned back by its one edge if that leaves so much of how far
#: it is from what fills the gap. [ratio; by hand]
MUST_COME_NEARER = 0.5

#: Standard deviations of the filters that calm a joint that jitters, of which the best is taken;
#: what the second one takes is how much it jitters. [s; by hand]
CALM_WIDTHS_S = (0.04, 0.08, 0.16, 0.32)

#: Places that these are looked for at, for each trial. [count; by hand: some fall into faults and
#: do not count]
PLACES_PER_TRIAL = 4

#: Error to expect where a clip has no other gap of the length. [degrees/s; by hand]
UNTRIED_ERROR_DEG_S = 0.1

#: Over how much a repaired span is smoothed at either edge: half the length of the filter. [s; by
#: hand; the paper, section 4, names the filter only]
BLEND_S = 0.1

#: Frames beside a gap that tell the pace at its edge. [frames; by hand]
PACE_FRAMES = 3

#: The paces at the edges bend the curve across gaps up to this length; on longer ones less and
#: less. [s; by hand]
BEND_S = 0.3

#: The pace at an edge is no more than this quantile of the joint's steps. [ratio; by hand: a wrong
#: frame that was not flagged must not throw the joint about]
PACE_QUANTILE = 0.9

#: Over how much joints that were filled in are smoothed: the length of the filter. [s; by hand; the
#: paper, section 4, names the filter only]
SMOOTHING_S = 0.2

# -- foot faults: `foot_faults` ------------------------------------------------------------------

#: A foot that slides keeps the heights of its ball and ankle so nearly. [m; by hand: the roll of a
#: foot]
SOLE_DOWN_M = 0.03

#: A foot that is higher than this over where it hardly ever comes below does not stand. [m; by
#: hand: captured floors are level to some centimetres]
MOST_UNEVEN_M = 0.1

#: Speeds of feet are taken over so long. [s; by hand: noise of single frames must not count]
FOOT_SPEED_S = 0.05

#: A foot that is slower, at its ball or its ankle, stands. [m/s; by hand]
STANDING_M_S = 0.1

#: One that never stands for so long in all has no floor; a shorter stance is none. [s; by hand]
LEAST_STAND_S = 0.15

#: A foot glides from this speed on, of ball and ankle alike. [m/s; by hand]
LEAST_GLIDE_M_S = 0.06

#: A foot that is quicker swings. [m/s; by hand: a walking foot swings at twice that]
MOST_GLIDE_M_S = 2.0

#: So does one that rises or falls more quickly. [m/s; by hand]
MOST_RISE_M_S = 0.3

#: Ball and ankle move alike where their velocities differ by less than this share of the larger.
#: [ratio; by hand: else the foot rolls or turns]
ALIKE_GLIDE_SHARE = 0.5

#: A foot that slides is back where it was to this share of how far it slid. [ratio; by hand: what
#: goes elsewhere may be a step that is slid]
RETURNED_SHARE = 0.5

#: A foot that slides by so much may be wrong; half as sure as can be. [m; by hand: three times what
#: captured feet slide in the mean]
LEAST_SLIDE_M = 0.03

#: It does so as quickly as this, out and back. [m/s; by hand: what is slower wanders]
QUICK_GLIDE_M_S = 0.25

#: And goes so far of the whole in one go. [ratio; by hand]
ONE_GO_SHARE = 0.6

#: A foot that is so far below where it stands may be wrong; half as sure as can be. [m; by hand]
LEAST_SINK_M = 0.02

#: Feet hardly ever come below the heights that they are below in this share of the frames.
#: [ratio; by hand: a foot is down for half of a walk]
FLOOR_SHARE = 0.05

#: Where the floor is uneven it counts from so many times the rise lower from there to four times
#: that share. [ratio; by hand]
TIMES_USUAL_SINK = 1.0

#: A foot that swings both before and after it is low, over so long, ... [s; by hand]
BESIDE_SINK_S = 0.1

#: ... faster than this, stands on lower ground: it does not sink. [m/s; by hand: of feet that were
#: drawn down on the calibration clips 1 in 20 does]
SWINGING_M_S = 0.25

#: A foot is wrong for no longer: what lasts is another floor. [s; by hand]
LONGEST_FOOT_FAULT_S = 1.5

#: How quickly the odds of a foot fault rise with its size: by this power. [1; by hand: twice the
#: least size is .94 sure]
FOOT_FAULT_SLOPE = 4.0

# -- contacts and feet ---------------------------------------------------------------------------

#: A foot that rests on both sides of a span has rested within it if it is no further away
#: afterwards. [m; by hand]
SAME_PLACE_M = 0.03

#: Frames on either side in which it has to be seen at rest. [frames; by hand]
LEAST_BESIDE = 2

#: Standard deviation of the filter that keeps the root's pace from changing at once where a foot is
#: held. [s; by hand]
SETTLE_S = 0.05

#: Feet that are pulled by less, in heights of the body, stay as they are. [ratio; by hand: far
#: below what is seen]
LEAST_PULL = 1e-5

# -- evaluation ----------------------------------------------------------------------------------

#: A joint that jumps so far anywhere in a clip is not clean: it gets no fault and does not count.
#: [degrees; by hand: many a captured toe, hand or thumb does]
CLEAN_JUMP_DEG = 8.0

#: A joint that turns less over a clip gets no fault of the kit. [degrees; what a viewer sees: a
#: freeze or a straight line of what stands is none]
LEAST_SWING_DEG = 3.0

#: One fault is injected for so much motion. [s; makes about an eighth of the words wrong, as in the
#: paper]
SECONDS_PER_FAULT = 8.0

#: A word is wrong, or flagged, if so many of its frames are. [frames at the clip's rate; by hand]
LEAST_WRONG_FRAMES = 2

#: A fault is found, and a flagged span right, if the other covers this share of it. [ratio; a half
#: by convention]
FOUND_SHARE = 0.5

#: A repair that is further from the truth than the fault was, by more than this, made it worse.
#: [degrees; what is hardly seen]
WORSE_DEG = 0.5

# -- the detector's regressions: fitted, all that follows ----------------------------------------

#: Confidence from which a span is flagged. [1; fitted by scripts/fit_cleaning.py: the middle of
#: those with the best F-scores on subjects left out]
DETECTION_THRESHOLD = 0.8

#: Log-odds that an offset or flip between two edges is a fault: a constant, and what a unit of each
#: evidence adds. [log-odds; fitted by scripts/fit_cleaning.py]
OFFSET_MODEL = {
    "constant": -7.5124,
    "strength": 1.7569,
    "size": 1.9661,
    "misfit": -8.6951,
    "background": -0.3862,
    "simultaneous": -3.8081,
    "extra_edges": -0.6053,
    "low_rate": -2.3479,
    "at_limit": 1.8121,
    "length": -0.0087,
    "low_rate_strength": -0.1171,
    "low_rate_size": 1.4014,
    "missed": 0.0,
    "isolation": -0.0864,
    "release": 0.0,
    "dissimilarity": 1.8311,
    "low_rate_dissimilarity": -0.1534,
    "beyond_limits": -0.4619,
    "low_rate_beyond_limits": -0.9078,
}

#: Log-odds that noise is a fault: a constant, and what a unit of each evidence adds. [log-odds;
#: fitted by scripts/fit_cleaning.py]
NOISE_MODEL = {
    "constant": 0.9049,
    "strength": 1.7883,
    "size": 1.4078,
    "misfit": 3.641,
    "background": -0.6883,
    "simultaneous": -3.1766,
    "extra_edges": -0.4841,
    "low_rate": -0.197,
    "at_limit": 0.0,
    "length": 3.9125,
    "low_rate_strength": 0.1929,
    "low_rate_size": 0.4127,
    "missed": 0.0,
    "isolation": 0.0467,
    "release": 0.0,
    "dissimilarity": 0.6889,
    "low_rate_dissimilarity": 0.1852,
    "beyond_limits": -0.1278,
    "low_rate_beyond_limits": 0.3259,
}

#: Log-odds that a joint that stands exactly still is a fault: a constant, and what a unit of each
#: evidence adds. [log-odds; fitted by scripts/fit_cleaning.py]
FREEZE_MODEL = {
    "constant": 2.2043,
    "strength": 0.2894,
    "size": 0.7265,
    "misfit": -5.0072,
    "background": 0.9939,
    "simultaneous": -1.4888,
    "extra_edges": -0.5193,
    "low_rate": 1.9135,
    "at_limit": -3.1307,
    "length": 1.4662,
    "low_rate_strength": -1.3196,
    "low_rate_size": 0.997,
    "missed": -0.5827,
    "isolation": -0.6185,
    "release": 1.1846,
    "dissimilarity": -0.6231,
    "low_rate_dissimilarity": 0.6475,
    "beyond_limits": -0.5656,
    "low_rate_beyond_limits": -0.0129,
}

#: Log-odds that a drift up to an edge is a fault: a constant, and what a unit of each evidence
#: adds. [log-odds; fitted by scripts/fit_cleaning.py]
DRIFT_MODEL = {
    "constant": -4.9532,
    "strength": 0.5913,
    "size": 1.1674,
    "misfit": -0.7332,
    "background": 0.2016,
    "simultaneous": -2.2206,
    "extra_edges": -0.6294,
    "low_rate": -0.0461,
    "at_limit": 0.9482,
    "length": 1.0799,
    "low_rate_strength": -0.8672,
    "low_rate_size": 0.7847,
    "missed": 0.0,
    "isolation": 0.4747,
    "release": 0.0,
    "dissimilarity": -0.0645,
    "low_rate_dissimilarity": 1.1565,
    "beyond_limits": 0.4709,
    "low_rate_beyond_limits": 0.1821,
}

#: Log-odds that an offset that an end of the clip cuts off is a fault: a constant, and what a unit
#: of each evidence adds. [log-odds; fitted by scripts/fit_cleaning.py]
CUT_OFFSET_MODEL = {
    "constant": -5.9493,
    "strength": 0.5155,
    "size": 0.7251,
    "misfit": -3.4263,
    "background": -1.1381,
    "simultaneous": -0.7898,
    "extra_edges": -3.1524,
    "low_rate": 1.4661,
    "at_limit": -3.0332,
    "length": 0.7252,
    "low_rate_strength": -0.4556,
    "low_rate_size": -0.3453,
    "missed": 0.0,
    "isolation": 0.0169,
    "release": 0.0,
    "dissimilarity": 2.1925,
    "low_rate_dissimilarity": -1.3478,
    "beyond_limits": 1.6099,
    "low_rate_beyond_limits": -0.2901,
    "odd_pose": -0.0629,
    "moved": 0.3183,
    "neighbours_move": 0.6554,
    "arm": -1.1354,
    "leg": 0.8028,
    "hand": -6.4091,
    "toe": -4.5804,
    "root": -1.672,
}

#: Log-odds that a slow drift of the root is a fault: a constant, and what a unit of each evidence
#: adds. [log-odds; fitted by scripts/fit_cleaning.py]
SLOW_DRIFT_MODEL = {
    "constant": -0.4145,
    "strength": -0.2414,
    "size": -0.2674,
    "simultaneous": -1.6903,
    "low_rate": 1.3737,
    "length": -0.536,
    "isolation": 0.8768,
    "moved": 0.371,
}

#: Log-odds that a joint that trembles in place up to an edge is a fault: a constant, and what a
#: unit of each evidence adds. [log-odds; fitted by scripts/fit_cleaning.py]
HELD_MODEL = {
    "constant": -12.7345,
    "strength": 2.5707,
    "size": 1.0647,
    "misfit": -1.1212,
    "background": -0.4126,
    "simultaneous": -3.1377,
    "extra_edges": -0.4938,
    "low_rate": 0.94,
    "at_limit": -1.2705,
    "length": 1.064,
    "low_rate_strength": -3.2382,
    "low_rate_size": 1.652,
    "missed": 2.8143,
    "isolation": -0.8616,
    "release": 0.0445,
    "dissimilarity": -0.0195,
    "low_rate_dissimilarity": 0.6607,
    "beyond_limits": -0.7735,
    "low_rate_beyond_limits": 6.3059,
}

#: Log-odds that an offset that shows at a lower rate only is a fault: a constant, and what a unit
#: of each evidence adds. [log-odds; fitted by scripts/fit_cleaning.py]
SOFT_OFFSET_MODEL = {
    "constant": -0.8092,
    "strength": 0.263,
    "size": 1.9651,
    "misfit": -6.1661,
    "background": -0.316,
    "simultaneous": -3.5824,
    "extra_edges": -2.11,
    "low_rate": -4.1011,
    "at_limit": -0.5067,
    "length": 1.1494,
    "low_rate_strength": -0.2823,
    "low_rate_size": 0.3383,
    "missed": 0.0,
    "isolation": -0.6321,
    "release": 0.0,
    "dissimilarity": 3.751,
    "low_rate_dissimilarity": -0.0522,
    "beyond_limits": -1.4918,
    "low_rate_beyond_limits": 0.6163,
}

#: Log-odds that noise that shows at a lower rate only is a fault: a constant, and what a unit of
#: each evidence adds. [log-odds; fitted by scripts/fit_cleaning.py]
SOFT_NOISE_MODEL = {
    "constant": -7.3895,
    "strength": 2.9967,
    "size": 0.4409,
    "misfit": 0.0,
    "background": 2.9134,
    "simultaneous": -2.9907,
    "extra_edges": -0.1097,
    "low_rate": -2.0652,
    "at_limit": 0.0,
    "length": 2.591,
    "low_rate_strength": 0.0676,
    "low_rate_size": 0.1185,
    "missed": 0.0,
    "isolation": 0.3794,
    "release": 0.0,
    "dissimilarity": 3.1658,
    "low_rate_dissimilarity": 0.538,
    "beyond_limits": 0.9065,
    "low_rate_beyond_limits": -1.3868,
}

#: Log-odds that a drift that shows at a lower rate only is a fault: a constant, and what a unit of
#: each evidence adds. [log-odds; fitted by scripts/fit_cleaning.py]
SOFT_DRIFT_MODEL = {
    "constant": -1.9861,
    "strength": -0.5167,
    "size": 0.3519,
    "misfit": 1.8845,
    "background": -0.5154,
    "simultaneous": -3.1077,
    "extra_edges": -1.3698,
    "low_rate": -1.4166,
    "at_limit": -1.093,
    "length": 1.1635,
    "low_rate_strength": -0.6114,
    "low_rate_size": 0.5098,
    "missed": 0.0,
    "isolation": -0.0421,
    "release": 0.0,
    "dissimilarity": 2.3605,
    "low_rate_dissimilarity": -0.6028,
    "beyond_limits": -0.2409,
    "low_rate_beyond_limits": 0.5549,
}

#: Log-odds that a stretch that is unlike similar motion, without edges is a fault: a constant, and
#: what a unit of each evidence adds. [log-odds; fitted by scripts/fit_cleaning.py]
SIMILARITY_MODEL = {
    "constant": -4.974,
    "peak": 0.5846,
    "size": -0.1812,
    "length": 2.2335,
    "simultaneous": -0.7642,
    "rest_of_body": -3.5336,
    "recurrence": -1.7201,
    "sharpness": 2.0128,
    "spread": -0.0291,
    "dissimilarity": 0.8302,
    "beyond_limits": 0.7543,
    "odd_pose": 0.5366,
    "moved": -1.0916,
    "neighbours_move": 0.709,
    "arm": -4.6193,
    "leg": -1.4528,
    "hand": -3.9626,
    "toe": -3.973,
    "rate": -0.3156,
    "rate_hand_or_toe": -1.3787,
    "rate_dissimilarity": 0.1791,
    "rate_beyond_limits": 0.5386,
    "rate_odd_pose": -0.1644,
}

#: Log-odds that an excursion with soft edges is a fault: a constant, and what a unit of each
#: evidence adds. [log-odds; fitted by scripts/fit_cleaning.py]
EXCURSION_MODEL = {
    "constant": 2.1081,
    "oddness": 0.1911,
    "size": 0.337,
    "against_usual": -0.356,
    "length": 1.2613,
    "simultaneous": -4.6907,
    "pace": 0.0635,
    "kink": 0.4965,
    "one_axis": -8.3277,
    "dissimilarity": 1.4895,
    "beyond_limits": 0.6843,
    "odd_pose": 1.6008,
    "moved": -0.0661,
    "neighbours_move": 0.3435,
    "arm": -1.1846,
    "leg": -0.2439,
    "hand": -5.2516,
    "toe": -2.4538,
    "rate": 0.3414,
    "rate_hand_or_toe": -1.2539,
    "rate_dissimilarity": -0.1763,
    "rate_beyond_limits": 0.1043,
    "rate_odd_pose": 0.6427,
}

#: Log-odds that a tremble is a fault: a constant, and what a unit of each evidence
#: adds. [log-odds; fitted by scripts/fit_cleaning.py]
JITTER_MODEL = {
    "constant": 1.6357,
    "contrast": 0.2858,
    "size": 2.0445,
    "length": 3.6547,
    "turns": 1.1355,
    "simultaneous": -8.8691,
    "one_way": -0.6889,
    "agitation": 1.5969,
    "unrest": -0.541,
    "dissimilarity": 0.3217,
    "beyond_limits": 0.666,
    "odd_pose": 1.0603,
    "moved": -0.5821,
    "neighbours_move": -0.2457,
    "arm": -4.2282,
    "leg": -1.9248,
    "hand": -5.3781,
    "toe": -4.2146,
    "rate": 0.5772,
    "rate_hand_or_toe": -1.9498,
    "rate_dissimilarity": 0.6164,
    "rate_beyond_limits": -0.0743,
    "rate_odd_pose": 0.2948,
}

#: Log-odds that a straight line is a fault: a constant, and what a unit of each evidence
#: adds. [log-odds; by hand: in the clips that the others are fitted on no line is wrong]
STRAIGHT_LINE_MODEL = {
    "constant": 3.0,
    "elsewhere": -20.0,
}

#: Log-odds that an exchange of left and right is a fault: a constant, and what a unit of each
#: evidence adds. [log-odds; fitted by scripts/fit_cleaning.py]
EXCHANGE_MODEL = {
    "constant": -3.192,
    "jump": 0.2018,
    "left_over": -0.346,
    "strength": 0.395,
    "length": -0.2983,
    "misfit": -3.3917,
    "together": 1.9439,
    "dissimilarity": 0.5474,
    "beyond_limits": 0.2164,
    "odd_pose": 0.1588,
    "moved": -0.0551,
    "neighbours_move": 0.9702,
    "arm": 0.1602,
    "leg": 0.8185,
    "hand": 0.0,
    "toe": -0.936,
    "rate": -0.4777,
    "rate_hand_or_toe": -0.2681,
    "rate_dissimilarity": 0.6224,
    "rate_beyond_limits": 0.1254,
    "rate_odd_pose": 0.2423,
}

#: Log-odds that a jump of the root is a fault: a constant, and what a unit of each evidence
#: adds. [log-odds; fitted by scripts/fit_cleaning.py]
ROOT_MODEL = {
    "constant": -0.693,
    "jump": 0.6796,
    "strength": 0.4676,
    "misfit": -7.7758,
    "length": 1.2155,
    "dissimilarity": 0.0,
    "beyond_limits": 0.0,
    "odd_pose": 0.0,
    "moved": 0.0,
    "neighbours_move": 0.0,
    "arm": 0.0,
    "leg": 0.0,
    "hand": 0.0,
    "toe": 0.0,
    "rate": 0.5192,
    "rate_hand_or_toe": 0.0,
    "rate_dissimilarity": 0.0,
    "rate_beyond_limits": 0.0,
    "rate_odd_pose": 0.0,
}

#: Log-odds that a hypothesis is a fault, beside all others about its joint: by kind a constant, and
#: what a unit of each evidence adds. [log-odds; fitted by scripts/fit_cleaning.py]
CORROBORATION_MODELS = {
    "offset": {
        "constant": 2.6624,
        "own": 0.4318,
        "similarity": 0.0191,
        "excursion": 0.1681,
        "jitter": 0.0323,
        "soft": 0.2361,
        "odd_pose": 0.2091,
        "odd_move": 0.2143,
        "length": 0.452,
        "rate": 0.9218,
    },
    "noise": {
        "constant": 2.7522,
        "own": 0.1913,
        "similarity": 0.0702,
        "excursion": 0.1404,
        "jitter": 0.1596,
        "soft": 0.1311,
        "odd_pose": 0.2836,
        "odd_move": 0.2962,
        "length": 0.8238,
        "rate": 0.4982,
    },
    "drift": {
        "constant": 8.7575,
        "own": 0.4045,
        "similarity": 0.2583,
        "excursion": 0.4198,
        "jitter": 0.4384,
        "soft": 0.316,
        "edges": 0.1308,
        "rival": -0.0097,
        "shared": 0.1743,
        "near_end": -0.1425,
        "odd_beside": -0.8373,
        "odd_pose": 0.2752,
        "odd_move": 0.1733,
        "length": 0.2622,
        "rate": 0.8423,
    },
    "cut offset": {
        "constant": 7.632,
        "own": 0.3034,
        "similarity": 0.1222,
        "excursion": 0.3629,
        "jitter": 0.3343,
        "soft": 0.2277,
        "edges": 0.2606,
        "rival": 0.0708,
        "shared": 0.2118,
        "near_end": -0.1947,
        "odd_beside": -1.0171,
        "odd_pose": -0.1714,
        "odd_move": 0.3648,
        "length": -0.1168,
        "rate": 0.6932,
    },
    "soft offset": {
        "constant": 2.9449,
        "own": 0.1933,
        "similarity": -0.0491,
        "excursion": 0.1513,
        "jitter": 0.0668,
        "edges": 0.3802,
        "odd_pose": 0.2397,
        "odd_move": 0.1611,
        "length": 0.624,
        "rate": 1.4328,
    },
    "soft noise": {
        "constant": 3.6197,
        "own": 0.151,
        "similarity": 0.0839,
        "excursion": 0.1313,
        "jitter": 0.1228,
        "edges": 0.1151,
        "odd_pose": 0.2824,
        "odd_move": 0.3306,
        "length": 0.9398,
        "rate": 0.5134,
    },
    "soft drift": {
        "constant": 6.8378,
        "own": 0.3619,
        "similarity": 0.1902,
        "excursion": 0.2455,
        "jitter": 0.3371,
        "edges": 0.134,
        "odd_pose": 0.7593,
        "odd_move": 0.4429,
        "length": 0.7977,
        "rate": 1.2354,
    },
    "similarity": {
        "constant": 3.4754,
        "own": 0.2493,
        "excursion": 0.1903,
        "jitter": 0.1644,
        "soft": 0.1817,
        "edges": 0.1665,
        "odd_pose": 0.3031,
        "odd_move": 0.2618,
        "length": 0.2486,
        "rate": 0.2515,
    },
    "excursion": {
        "constant": 5.1717,
        "own": 0.4191,
        "similarity": 0.15,
        "jitter": 0.2186,
        "soft": 0.2934,
        "edges": 0.2599,
        "odd_pose": 0.5524,
        "odd_move": 0.3126,
        "length": 0.0894,
        "rate": 0.185,
    },
    "jitter": {
        "constant": 3.8198,
        "own": 0.1823,
        "similarity": 0.0653,
        "excursion": 0.1148,
        "soft": 0.1145,
        "edges": 0.0909,
        "odd_pose": 0.1399,
        "odd_move": 0.3427,
        "length": 1.3441,
        "rate": 0.1619,
    },
}
