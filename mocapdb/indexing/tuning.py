"""The tuned numbers of searching and recognising motion, in one table.

What is fitted, ``scripts/fit_search.py`` fits again from labelled clips that a user names. What
decides only how fast a search is (tiles, shares of work) stands beside its code.
"""

# -- the canonical body ----------------------------------------------------------------------------

#: Rate of indexes and queries. [frames per second; that of the motion words of Aristidou et al.,
#: 2018]
FPS = 24.0

# -- what frames are compared by -------------------------------------------------------------------

#: A joint that is 1 m/s faster counts as one that is this many metres away. [s; fitted by
#: scripts/fit_search.py: half or double changes the average precision by 0.03 at most]
VELOCITY_S = 0.1

#: Metres for a metre of difference in the height of the hips. [1; fitted by scripts/fit_search.py]
HEIGHT = 1.0

#: Metres for 1 m/s of difference in how the hips travel. [s; fitted by scripts/fit_search.py]
TRAVEL_S = 0.5

#: Metres for 1 rad/s of difference in how the body turns. [m s; fitted by scripts/fit_search.py]
TURN_MS = 0.1

#: Principal axes that frames are kept along; of 24, 98 % of first hits are right, of these 100 %.
#: [count; chosen by benchmarks/bench_query.py on CMU and HDM05]
N_AXES = 32

#: Frames that lie so many times further from the middle of a library's clips than is usual are no
#: motion: their clips shape neither the space nor a class. [ratio; chosen by hand: the furthest
#: frame of CMU and HDM05 is 8 times as far]
OUTLYING = 12.0

#: Frames that lie within this distance of the middle are never held to be outliers, however alike
#: the other clips are. [m; chosen by hand: a quick dancer's frames are 8 m from the middle]
OUTLYING_M = 12.0

#: Clips whose roots are further from the origin are outliers too: nobody captures so far from where
#: the cameras are. [m; a choice: ten times the largest stage]
FURTHEST_ROOT_M = 1000.0

# -- the stored frames -----------------------------------------------------------------------------

#: Steps of a stored number to a standard deviation of its axis, of which a byte holds eight.
#: [1; rounding changes a distance by 0.02 at most]
STEPS_PER_DEVIATION = 16.0

#: Frames of the index that are one in its sketch. [count; chosen by benchmarks/bench_query.py: a
#: rough search finds 0.99 of the exact ten hits]
SKETCH_FRAMES = 3

#: Axes of a frame of the sketch, a multiple of 4. [count; as `SKETCH_FRAMES`]
SKETCH_AXES = 16

#: Frames of the sketch that are one in its outline. [count; as `SKETCH_FRAMES`]
OUTLINE_FRAMES = 2

#: Axes of a frame of the outline, a multiple of 4. [count; as `SKETCH_FRAMES`]
OUTLINE_AXES = 8

#: Axes that the frames of a part of the body are kept along, a multiple of 4. [count; as many as a
#: sketch has; an arm's 18 numbers lie along them but for a thousandth of their variance]
PART_AXES = 16

# -- queries and hits ------------------------------------------------------------------------------

#: Shortest query. [s; chosen by hand: seven frames]
MIN_QUERY_S = 0.3

#: How fast the query goes in each of its searches: velocities of a slow performance fit anything,
#: so that a run at half speed would find walks. [ratio; chosen by benchmarks/bench_query.py]
SPEEDS = (1.0, 2.0)

#: Of two hits in a clip that share more of the shorter one, only the better stays. [share; a hit
#: that is mostly another one says nothing new]
MOST_OVERLAP = 0.5

#: How many times as many hits are gone through at most where some are left out for what they are
#: unlike. [ratio; chosen by hand: an end, in a library that holds little of what is meant]
UNLIKE_HITS = 16

#: Indexes of more frames are searched roughly unless told otherwise. [frames; where an exact search
#: takes a tenth of a second on two cores]
EXACT_FRAMES = 3_000_000

#: Nearest places of the outline, for each template, around which the sketch is compared.
#: [count; the recall of a rough search, by scripts/fit_search.py]
OUTLINE_PLACES = 1_000

#: Nearest places of the sketch, for each template, around which distances are measured in full.
#: [count; as `OUTLINE_PLACES`]
SKETCH_PLACES = 120

#: Ranges of frames, evenly over the index, whose median cost is the distance of a random stretch.
#: [count; chosen by hand]
SAMPLE_SPANS = 80

#: Frames of each such range. [frames; one second]
SAMPLE_FRAMES = 24

# -- whole clips -----------------------------------------------------------------------------------

#: Frames that every clip is brought to when clips are compared as a whole. [frames; chosen by
#: hand: two seconds at the rate of the index]
CLIP_FRAMES = 48

#: Clips that are compared, those whose mean and deviation are nearest. [count; chosen by
#: hand: the clips at hand are fewer]
SHORTLIST = 500

#: Best hits that a query for whole clips is averaged with: the mean average precision on HDM05 is
#: 0.990 with and 0.975 without. [count; benchmarks/bench_query.py]
EXPAND = 2

# -- classes ---------------------------------------------------------------------------------------

#: Share of the variance that the axes of a class keep. [share; O'Kane 2008, section 3.2.4]
KEPT_VARIANCE = 0.99

#: By how much people who do the same differ in a coordinate: no class is narrower. [m; fitted by
#: scripts/fit_search.py, leaving out each subject in turn]
FLOOR_M = 0.15

#: How much likelier frames must be in all under another class for a change of class. [nats; chosen
#: by hand: by scripts/fit_search.py 60 and 120 differ by half a point of the frames of HDM05]
SWITCH_NATS = 60.0

#: What the density counts in the novelty of a clip beside the distance to the nearest one known.
#: [1; chosen by hand: by scripts/fit_search.py all up to 0.2 are as good on HDM05]
DENSITY_SHARE = 0.2

#: Share of the clips that classes were learned from, each seen from other people's, that are not
#: rejected. [share; a choice: one clip in fifty is]
STRICTNESS = 0.98

#: Of a value over the clips, the quantiles between which its spread is measured. [share; the middle
#: four fifths, which a few odd clips do not change]
SPREAD_QUANTILES = (0.1, 0.9)

#: Clips, evenly chosen, whose novelty is looked at to find where to cut. [count; chosen by hand:
#: time grows with their number times all clips]
CALIBRATION_CLIPS = 1000

#: How often classes are learned again at most while clips are given to them. [count; chosen by
#: hand: an end to what usually ends by itself]
ASSIGN_ROUNDS = 20
