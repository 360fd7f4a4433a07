"""The tuned numbers of the search for cycles, each with its meaning, unit and origin.

Differences of poses are relative: the squared difference of two stretches over the sum of their
variances, 0 where they are the same and about 1 where they are unrelated. Most numbers were chosen
by hand on walks and runs of CMU, cut, thinned and disturbed, and on single actions of HDM05 (the
clips of ``benchmarks/bench_cycle_search.py``). ``scripts/fit_cycles.py`` tries others for those of
the period and of the timing on any clips; what it said is of 70 to 146 trials of walks, runs,
single actions and synthetic clips.
"""

from __future__ import annotations

# -- what is looked at ---------------------------------------------------------------------------

#: Principal axes of the poses that the period is searched and time is told on.
#: [count; chosen by hand: they hold over 95 % of a walk's variance]
PERIOD_AXES = 8

#: Principal axes of the poses that cohomology sees. [count; chosen by hand]
EMBEDDING_AXES = 16

#: Poses a second that ranges and loops are searched at; clips that have more are thinned.
#: [Hz; what a body does is below 15 Hz, which is half of it]
ANALYSIS_HZ = 30.0

# -- the period by autocorrelation ---------------------------------------------------------------

#: Laps that a motion must have: its last seventh repeats its first one.
#: [laps; chosen by hand on clips cut to 1.1 to 1.3 laps]
LEAST_LAPS = 1.15

#: No period is shorter. [frames; the derivatives' stencil of 9 frames spans it]
LEAST_PERIOD_FRAMES = 8

#: A lag at which the motion differs by no more than this is a period, even where a longer one is
#: nearer. [relative difference; chosen by hand: 0.06 to 0.24 do as well in scripts/fit_cycles.py]
CLEAR_DIFFERENCE = 0.12

#: So is one that differs by at most so many times the least difference of all lags.
#: [ratio; chosen by hand: 1.2 to 3 do as well in scripts/fit_cycles.py]
NEAR_LOWEST = 1.5

#: Stretches that differ by more are unrelated, and no period is as far.
#: [relative difference; half of what unrelated stretches have]
UNRELATED_DIFFERENCE = 0.5

#: How far around a known period the refined one is searched.
#: [share of the period; chosen by hand, more than `TEMPO_CHANGE`]
PERIOD_REACH = 0.12

# -- ranges of a clip that repeat ----------------------------------------------------------------

#: Shortest period that is searched in parts of a clip. [s; the fastest steps take 0.35 s]
SHORTEST_PERIOD_S = 0.3

#: Longest period that is searched in parts of a clip. [s; chosen by hand: a slow dance step]
LONGEST_PERIOD_S = 5.0

#: Length of a stretch that is compared with the same part of the next lap.
#: [laps; chosen by hand: 0.6 to 1.5 do as well in scripts/fit_cycles.py]
WINDOW_LAPS = 0.75

#: How much longer or shorter than the others a lap may be.
#: [share of the period; chosen by hand: 0.063 to 0.14 do as well in scripts/fit_cycles.py]
TEMPO_CHANGE = 0.07

#: How much a change of posture from one lap to the next counts, beside the motion.
#: [weight; chosen by hand: 0.125 to 0.5 do as well in scripts/fit_cycles.py]
POSTURE_WEIGHT = 0.25

#: Stretches that differ by less are the same motion. [relative difference; chosen by hand on real
#: laps: scripts/fit_cycles.py would take 0.125 to 0.16 where synthetic clips count, too]
SIMILAR_DIFFERENCE = 0.25

#: A clip whose stretches, but for the rest of this share, are no more than
#: `UNRELATED_DIFFERENCE` from those a lap later repeats throughout.
#: [share of the stretches; chosen by hand: 0.4 to 0.94 do as well in scripts/fit_cycles.py]
SHARE_REPEATED = 0.75

#: A stretch that varies less does not move, and is like nothing.
#: [share of the clip's variance; chosen by hand: 0.0015 to 0.006 do as well in
#: scripts/fit_cycles.py]
LEAST_VARIANCE = 0.003

#: Of ranges in which the joints travel at least so far as in the best, the one of the shortest
#: period is taken. [share of the path; chosen by hand on real clips: scripts/fit_cycles.py would
#: take 0.88]
COMPARABLE_PATH = 0.7

#: How far around the lag of a range its best lag is searched. [share of the lag; chosen by hand:
#: 0.13 to 0.5 do as well in scripts/fit_cycles.py]
LAG_REACH = 0.25

#: Most ranges of a clip. [count; a bound on the time that is spent]
MOST_RANGES = 12

#: Laps that a range must have: in a long clip two stretches may be alike by chance.
#: [laps; chosen by hand on long clips: 0.8 to 3.3 do as well in scripts/fit_cycles.py]
LEAST_LAPS_OF_RANGE = 1.65

#: A clip with fewer laps is searched for many shorter ones: it may go there and back once.
#: [laps; chosen by hand]
LAPS_BEYOND_DOUBT = 2.2

#: Periods are shorter where they are less than this. [share of the clip's period; chosen by hand]
SHORTER_PERIOD = 0.6

#: Ranges of shorter periods are taken if the joints travel so far in them.
#: [share of the clip's path; chosen by hand]
SHORTER_PERIOD_PATH = 0.5

#: A period that is as clear needs no search in parts of the clip.
#: [clarity, 1 less the relative difference; chosen by hand: 0.38 to 0.83 do as well in
#: scripts/fit_cycles.py]
CLEAR_PERIOD = 0.75

# -- the ends of a range -------------------------------------------------------------------------

#: Length of the stretch by which an end is judged. [laps; chosen by hand: shorter than a step;
#: scripts/fit_cycles.py would take 0.24]
END_WINDOW_LAPS = 0.12

#: How much earlier or later the like pose of the next lap may come. [laps; chosen by hand on real
#: laps: scripts/fit_cycles.py would take 0.06]
END_TEMPO = 0.03

#: A lap that varies less is rest. [share of the variance of the range's most varied lap; chosen by
#: hand: 0.05 to 0.2 do as well in scripts/fit_cycles.py]
END_VARIANCE = 0.1

#: Poses at an end belong to the range up to so many times the difference in its middle.
#: [ratio; chosen by hand on real laps: scripts/fit_cycles.py would take 10]
END_TOLERANCE = 5.0

#: They do in any case if they differ by less than this. [relative difference; chosen by hand on
#: real laps: scripts/fit_cycles.py would take 0.1]
END_DIFFERENCE = 0.05

# -- circular coordinates ------------------------------------------------------------------------

#: Coefficients of the cohomology are integers modulo this odd prime.
#: [1; Vejdemo-Johansson et al. 2015, section 4.2]
PRIME = 47

#: Points that persistent cohomology takes; of more, `LANDMARKS` are taken.
#: [count; its time grows with the cube: this many take half a minute]
LARGEST_CLOUD = 1000

#: Points that are put into the complex of a larger cloud, and of a clip of several motions.
#: [count; chosen by hand: 0.2 to 3 s of work]
LANDMARKS = 400

#: Points of a clip that are put into the complex. [count; chosen by hand: a second's work]
COMPLEX_POINTS = 320

#: Time between a pose and the later ones that are put beside it.
#: [laps; chosen by hand: two of them span a quarter lap]
DELAY_LAPS = 1 / 8

#: A clip of more laps has two delays, of fewer one: they shorten it.
#: [laps; two delays leave a lap and a twentieth]
LAPS_FOR_TWO_DELAYS = 1.3

#: Distances between a class's death and its birth at which integer coefficients are tried.
#: [count; chosen by hand: the first nearly always does]
LIFT_THRESHOLDS = 6

#: Points of the complex between which a new point gets its coordinate. [count; chosen by hand]
NEAREST_POINTS = 3

#: Components of the Gaussian mixture of coordinates. [count; Vejdemo-Johansson et al. 2015, 4.4]
MIXTURE_COMPONENTS = 30

#: Least variance of a component. [laps squared; chosen by hand: a frame in a lap of 2 s]
MIXTURE_VARIANCE = 1e-5

#: Coordinates that are drawn for a typical trajectory. [count; Vejdemo-Johansson et al. 2015, 4.4]
CENTROID_SAMPLES = 500

#: Poses whose mean each drawn coordinate takes. [count; Vejdemo-Johansson et al. 2015, 4.4]
CENTROID_NEIGHBOURS = 10

# -- several loops in a clip: `excitation` --------------------------------------------------------

#: Time between a pose and the later ones that are put beside it. [s; chosen by hand: an eighth of a
#: lap of most motions]
EXCITED_DELAY_S = 0.13

#: Share of the loops that may be none. [share; chosen by hand: one in ten, and those that are gone
#: round less than `EXCITED_LAPS` are left out afterwards]
FALSE_LOOPS = 0.1

#: Most loops of a clip that are looked at. [count; a bound on the time that is spent]
MOST_LOOPS = 12

#: Time over which a coordinate is seen to move. [s; chosen by hand: half a lap of most motions]
EXCITED_WINDOW_S = 1.0

#: How far it goes in that. [laps; chosen by hand: a lap of 5 s; Vejdemo-Johansson et al. 2015, 4.6,
#: name none]
EXCITED_TRAVEL = 0.2

#: A coordinate may rest so long within a region. [s; chosen by hand]
LONGEST_REST_S = 0.6

#: How far a coordinate must go in a region. [laps; chosen by hand: once round, nearly: what is less
#: may be a way there and back]
EXCITED_LAPS = 0.9

# -- from coordinates to time --------------------------------------------------------------------

#: Parts of a lap whose duration is measured. [count; finer than any lap has frames]
CLOCK_PARTS = 2048

#: Harmonics of the curve by which times are compared.
#: [count; chosen by hand: they hold nearly all of a walk's variance]
ROUGH_HARMONICS = 6

#: Searches of a steady period, each around the best of the one before: how far, and how many
#: periods are tried. [share of the period and count; the last is finer than a frame in 500 laps]
PERIOD_SEARCHES = ((0.06, 13), (0.01, 9), (0.002, 9))

#: Laps between the knots of the spline of a drifting tempo.
#: [laps; chosen by hand: fewer would follow what happens within a lap]
LAPS_BETWEEN_KNOTS = 2.0

#: Steps of Gauss and Newton that curve and spline take in turns.
#: [count; chosen by hand: the phase moves by less than 1e-3 laps afterwards]
NEWTON_STEPS = 8

#: Penalty on the bends of the spline. [share of the mean power of the normal equations; chosen by
#: hand]
TEMPO_STIFFNESS = 1e-2

#: Clips of more laps are never quite steady, and get a drifting tempo. [laps; chosen by
#: hand: scripts/fit_cycles.py would take 4 to 5]
STEADY_LAPS = 8.0

#: A drifting tempo must leave less than this of the squares that a steady one leaves.
#: [ratio; chosen by hand; scripts/fit_cycles.py tries others]
DRIFT_GAIN = 0.6

#: A drifting tempo must be so far from a steady one, root mean square. [laps; chosen by hand;
#: scripts/fit_cycles.py tries others]
DRIFT_DEVIATION = 0.02

# -- motion that stops and goes on -----------------------------------------------------------------

#: A body rests where it is slower. [share of its upper quartile's speed; chosen by hand on
#: synthetic walks and runs that stop and go on]
RESTING_SPEED = 0.15

#: Speeds are those of poses that are averaged so far to each side.
#: [s; noise of a capture is above 10 Hz]
REST_REACH_S = 0.05

#: A shorter rest is none. [s; physical: the turning points of a motion are shorter]
LEAST_REST_S = 0.15

#: A coordinate of which more steps go back is no lap's. [share; chosen by hand]
MOST_BACKTRACKING = 0.15

#: A coordinate is smoothed so far to each side, one standard deviation.
#: [s; chosen by hand on synthetic walks and runs that stop and go on: 0.03 does nearly as well]
COORDINATE_REACH_S = 0.06

#: Parts of a lap whose duration is told. [count; chosen by hand: a part is longer than the jitter
#: of a coordinate]
LAP_PARTS = 24

#: A part of a lap takes as long as in this share of its passes, the quickest first: rests make the
#: others longer. [share; chosen by hand on synthetic walks and runs that stop and go on: with half,
#: two rests at one phase count]
USUAL_PASS = 0.3

#: Laps by coordinates are taken where autocorrelation's period is so many times theirs.
#: [ratio; chosen by hand: a rest in each lap, of always the same length, is part of the motion]
STOP_AND_GO_RATIO = 1.25

# -- the curve -----------------------------------------------------------------------------------

#: Joints that turn further in one frame are taken to have jumped.
#: [rad; no joint of a body turns so fast at 120 Hz, nor at 30 Hz]
IMPOSSIBLE_STEP_RAD = 1.5

#: Joints whose angle has a wider range are written as matrices.
#: [degrees; no joint's range is as wide unless it turns all the way round]
WIDEST_SWING_DEG = 270.0

#: So are those whose middle angle comes so near to gimbal lock.
#: [cosine of the angle; chosen by hand: 78 degrees]
LOCK_COSINE = 0.2

#: Clips that turn by less a lap go straight on. [degrees; chosen by hand]
UNROLLED_TURN_DEG = 10.0

#: Harmonics of a lap at most. [count; chosen by hand: `docs/cycles.md` compares 30 and 40]
N_HARMONICS = 40

#: How strongly a channel is smoothed: the penalty on its first harmonic, for laps that differ by as
#: much as they share. [ratio; chosen with benchmarks/bench_loops.py: with .01 a lap left out gains
#: another percent, and the laps at hand are matched two percent worse]
SMOOTHING = 0.003

#: Harmonics of the curve whose variance laps are taken to share. [count; chosen by hand: they hold
#: nearly all of a walk's variance]
SMOOTHING_HARMONICS = 6

#: How many laps of evidence it counts as that all channels differ alike. [laps; chosen by hand: 0.1
#: to 1 do as well in benchmarks/bench_loops.py]
POOLED_LAPS = 0.3

#: Poses whose mean a typical trajectory takes, of each lap. [count; chosen by hand: of many laps
#: all have a say, and a lap of a second is not blurred]
NEIGHBOURS_A_LAP = 4

#: Where time nearly stands still there are no derivatives by it: the tempo is at least this.
#: [share of the mean tempo; chosen by hand]
SLOWEST_TEMPO = 0.1

#: Samples of a cycle. [count; more than twice the harmonics]
N_SAMPLES = 128

#: A cycle whose root advances less a lap stays in place. [share of the body's height; chosen by
#: hand: 3 cm]
LEAST_TRAVEL = 0.02

#: A cycle whose root rises or sinks less a lap is level. [share of the body's height; chosen by
#: hand: 5 cm, a low step]
LEAST_CLIMB = 0.03

#: Step from a loop's last frame to its first above which it is no loop. [median steps; chosen by
#: hand: loops that were written have 0.9 at most]
WIDEST_SEAM = 3.0

#: Harmonics of the root's path in a loop that is read back. [count; chosen by hand]
PATH_HARMONICS = 8

#: A loop that is read back and turns less a lap goes straight on. [rad; chosen by hand: the heading
#: of one lap is not at the same phase at its ends]
LEAST_TURN_RAD = 0.1

# -- how sure a cycle is -------------------------------------------------------------------------

#: Periods of cohomology and autocorrelation that differ by less agree. [share; chosen by hand: more
#: than `TEMPO_CHANGE`]
AGREEMENT = 0.08

#: Periods that differ by more contradict each other. [share; chosen by hand: half of what a double
#: or half period would be off]
DISAGREEMENT = 0.25

#: With so many laps it shows whether each has the same rest.
#: [laps; physical: two or three could be alike by chance]
LAPS_TO_KNOW_RESTS = 4.0

#: Evidence where rests within a motion have too few laps to be known.
#: [confidence; scripts/measure_confidence.py: more than half of such are right]
UNKNOWN_RESTS = 0.65

#: Tempi of the laps of a steady motion differ by this. [share; people's walks vary by 2 to 4 % from
#: lap to lap]
USUAL_TEMPO_CHANGE = 0.1

#: Confidence below which a cycle is called doubtful and left out of a class.
#: [confidence; chosen by hand]
DOUBTFUL = 0.5

#: Confidence up to which the evidence contradicts itself, and another range is tried.
#: [confidence; chosen by hand]
CONTRADICTED = 0.1

#: Cycles of fewer laps come with a warning. [laps; chosen by hand]
FEW_LAPS = 1.5

#: Evidence where cohomology finds no loop. [confidence; chosen by hand: doubtful, not contradicted]
WITHOUT_TOPOLOGY = 0.3

#: How much less evidence laps are for each halving of their share of the clip.
#: [confidence; chosen by hand]
CHANCE = 0.1

#: How much a second loop, as persistent as the first, takes away. [confidence; chosen by hand:
#: where left and right alternate there often is one]
SECOND_LOOP = 0.5

# -- loops that play -----------------------------------------------------------------------------

#: Jerk is measured below this frequency. [Hz; what is above is noise of the capture]
JERK_LOWPASS_HZ = 12.0

#: Fewer frames have no jerk. [frames; the filter's reach]
JERK_LEAST_FRAMES = 8

#: A knee or ankle pops where holding the feet makes its peak acceleration so many times that of the
#: loop without. [ratio; chosen by hand: what is below is not seen]
POP_TIMES = 1.5

#: A loop may be stretched to no fewer frames a lap. [frames; chosen by hand: a step in five poses]
LEAST_LAP_FRAMES = 10

#: All laps of a loop have no more frames. [count; a bound on time and memory: 2.3 hours at 120 Hz]
MOST_LOOP_FRAMES = 1_000_000

#: A loop's last frame nearer to its first closes it, and is no frame of its own.
#: [median steps; chosen by hand: loops' seams are steps like others]
CLOSING_STEP = 0.05

#: The reach of legs is softened while a peak acceleration is so many times that without holding
#: feet. [ratio; chosen by hand: below `POP_TIMES`, for what a loop without is damped by differs]
CALM_TIMES = 1.35

#: A knee or ankle that pops so many times worse is not left to: the feet are not held at all.
#: [ratio; chosen by hand: it is seen at once, more than a foot that slides]
SEVERE_TIMES = 2.0

#: How feet are held: how often each is pulled to its place, from where it came before, the share of
#: a leg's length from which on its reach is soft, and the share of the way that it is pulled. One
#: after the other until no knee or ankle is over `CALM_TIMES`, else the calmest; less than all of
#: the way only while one is over `POP_TIMES`. [count and ratios; chosen by hand on 74 walks and
#: runs: the first does for most, a third pull would gain a tenth of a millimetre]
HOLDS = (
    (2, 0.98, 1.0),
    (2, 0.96, 1.0),
    (2, 0.94, 1.0),
    (2, 0.92, 1.0),
    (2, 0.9, 1.0),
    (1, 0.98, 1.0),
    (1, 0.94, 1.0),
    (1, 0.9, 1.0),
    (1, 0.9, 0.5),
    (1, 0.9, 0.25),
)

#: Harmonics from which on a loop is damped until it jerks no more than its clip, one after the
#: other. [harmonics; chosen by hand: a walk has nearly nothing above the twelfth]
DAMPED_HARMONICS = (14.0, 11.0, 9.0, 7.0, 5.5, 4.5)

# -- cycles on another body ----------------------------------------------------------------------

#: Shorter bones are not asked for the way they point. [share of the longest bone; chosen by hand]
WEIGHTY_BONE = 0.3

# -- the cycle of a class ------------------------------------------------------------------------

#: Rounds of aligning the members with their mean. [count; chosen by hand: the mean changes by less
#: than 0.1 degrees in the last]
ALIGNMENT_ROUNDS = 4

#: A mirror image must be so much nearer to the mean to be taken. [ratio; chosen by hand]
MIRROR_GAIN = 0.8

#: Members that are farther from the mean are left out. [median distances; chosen on CMU's walks of
#: six people: those come to 1.6, swordplay and jumping jacks under the label of a walk from 2.6]
OUTLIER_DISTANCE = 2.1

#: Members that are alike, takes of one person say, do not make another person's an outlier: those
#: within twice this belong. [share of the mean's amplitude; chosen on CMU's runs: another person's
#: comes to .68, one before a leap to 1.9]
LEAST_VARIETY = 0.35

#: Members whose movements differ by more from the mean's have nothing in common. [share of their
#: amplitude, median; chosen on classes of CMU and HDM05: walks, runs and jogs have .2 to .4, any
#: motions that repeat .7 to 1.1]
MOST_UNLIKE = 0.65

#: Rate at which a cycle is sampled to find its foot strikes. [frames/s; by hand: that of the clips
#: that foot events were chosen on]
STRIKE_FPS = 120.0
