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

#: Queries whose joints are slower than this on average are told to be a pose. [m/s; chosen by hand:
#: people sway by that much while they stand still]
STILL_MS = 0.03

#: A pose is a query of this length: about as long as a run is in a pose. [s; the shortest query]
POSE_S = 0.3

#: Two hits of a pose in a clip are so far apart, or they are one. [s; chosen by hand: steps and
#: waves come again after that]
APART_S = 0.5

#: Distance at which a hit, alone with its label, is as likely of the query's class as not. [1; the
#: lowest that scripts/fit_probability.py fits on one of CMU, HDM05 and Bandai, people or styles
#: left out, 0.62, rounded down: it is better to promise too little]
EVEN_ODDS = 0.6

#: By which power of the distance the odds fall. [1; chosen by hand: fitted with the distance it is
#: 4 to 5 with one corpus left out or another]
ODDS_POWER = 4.0

#: Nearest hits whose labels tell how finely motions are told apart. [count; as many as a query
#: returns, so that they cost nothing; 15 transfers no better]
NEAR_HITS = 10

#: By which power of their distance these count less. [1; of 2, 4 and 6 chosen with each of CMU,
#: HDM05 and Bandai left out in turn]
NEAR_POWER = 4.0

#: What is added to their distance: the same motion counts no more than some twice as much as the
#: next performance. [1; as `NEAR_POWER`, of 0.05 and 0.1]
NEAR_BY = 0.1

#: Share of its label that a hit without one is taken to have. [share; of the nearest hits those
#: that are right in the corpus where they are least, by scripts/fit_probability.py]
UNTOLD_SHARE = 0.64

#: Of two hits in a clip that share more of the shorter one, only the better stays. [share; a hit
#: that is mostly another one says nothing new]
MOST_OVERLAP = 0.5

#: Stretches that last so many times as long as the query, or so many times less, are no hits.
#: [ratio; chosen by benchmarks/bandai_search.py: of 2.2, 2.5 and 3 the best over Bandai's two sets,
#: and without it 3 points of the average precision are lost; HDM05 and CMU do not change]
MOST_SPEED_RATIO = 2.5

#: What a radian of difference in the net turn of query and hit adds to their distance. [1/rad;
#: chosen by benchmarks/bandai_search.py: of 0.2, 0.3 and 0.5 the one that costs HDM05 and CMU
#: nothing]
TURN_COST = 0.3

#: The same of whole clips. [1/rad; as `TURN_COST`, of 0.08, 0.15 and 0.2]
WHOLE_TURN_COST = 0.15

#: Differences of the net turn up to this cost nothing: hips sway. [rad; half of what the hips turn
#: by in a stride of a walk, about 20 degrees]
SWAY_RAD = 0.2

#: What a difference of the net turn adds at most. [1; chosen by hand: half of any motion]
MOST_TURN_COST = 0.5

#: What a course that has nothing in common adds to the distance of matched frames: see
#: `mocapdb.indexing.search.course`. [1; chosen on Bandai's clips in styles made up for it,
#: HDM05 and CMU: each left out in turn, the others choose 0.3 to 0.8. No script does that again]
COURSE_COST = 0.5

#: What moving in other joints adds, for a distance of 1 between the spreads. [1; as `COURSE_COST`:
#: of 0.5, 0.9 and 1.4; 1.4 costs HDM05 0.01 of the mean average precision]
SHARES_COST = 0.9

#: What going at quite another velocity adds. [1; as `COURSE_COST`: more costs hits at other speeds]
TRAVEL_COST = 0.15

#: What a radian between the directions that two bodies go, each as it faces itself, adds.
#: [1/rad; as `COURSE_COST`: of 0.3 to 0.6]
DIRECTION_COST = 0.5

#: Radians between directions that count at most. [rad; chosen by hand: who goes to the side does
#: not go straight on; who goes backwards is told by the frames themselves]
MOST_DIRECTION_RAD = 0.7

#: Who is slower goes nowhere: the direction is not looked at. [m/s; chosen by hand: a fifth of a
#: walk]
GOING_MS = 0.3

#: Added to a velocity before another is divided by it. [m/s; chosen by hand]
UNSURE_TRAVEL_MS = 0.5

#: Spread of frames below which a stretch is a pose rather than a course. [m; chosen by hand: who
#: stands still sways by so much]
STILL_SPREAD_M = 0.05

#: What a stretch taken at random costs, warped and as a whole, where the warping alone costs 1.
#: [1; median over the queries of CMU, HDM05 and both sets of Bandai]
ANY_STRETCH = 2.3

#: Share of the rate of turning, as a direction, that the axes of a space must hold for turns to be
#: read from the frames of an index of an earlier version. [1; chosen by hand: the spaces of Bandai,
#: CMU and HDM05 hold 0.75 to 0.99]
TURN_KNOWN = 0.5

#: How many times as many stretches as hits are asked for are compared as a whole: the nearest by
#: warping. [ratio; of 1, 2, 4 and 8 chosen by benchmarks/bandai_search.py when only turns were
#: compared so]
LOOKED_AT = 2

#: Stretches that are compared as a whole at least, however few hits are asked for. [count; as
#: `LOOKED_AT`]
LEAST_LOOKED_AT = 20

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

#: Best hits that a query for whole clips is averaged with: the mean average precision with them and
#: without is 0.987 and 0.983 on HDM05, 0.862 and 0.857 on CMU, 0.782 and 0.779 on Bandai, subjects
#: and styles left out. [count; benchmarks/bench_query.py]
EXPAND = 2

#: Only hits that are nearer than this are averaged with. [1; chosen by benchmarks/bandai_search.py:
#: on HDM05 nothing changes, on Bandai 0.01 of the mean average precision is gained]
EXPAND_WITHIN = 0.7

# -- classes ---------------------------------------------------------------------------------------

#: Share of the variance that the axes of a class keep. [share; O'Kane 2008, section 3.2.4]
KEPT_VARIANCE = 0.99

#: By how much people who do the same differ in a coordinate: no class is narrower. [m; fitted by
#: scripts/fit_search.py, leaving out each subject in turn]
FLOOR_M = 0.15

#: How much likelier frames must be in all under another class for a change of class. [nats; chosen
#: by hand: by scripts/fit_search.py 60 and 120 differ by half a point of the frames of HDM05]
SWITCH_NATS = 60.0

#: How many spreads below the median of the log densities of known clips a stretch is none of the
#: classes. [ratio; chosen by hand on HDM05, a class and a person left out: 1 % of the frames of
#: known ones are taken for none and 65 % of unknown ones; at 1 they are 7 and 81 %]
NONE_SPREADS = 1.5

#: Even samples of a clip that classes are learned from, which its course is compared by. [count;
#: half as many as whole clips are searched by: as good within 2 % of the clips taken]
EXAMPLE_FRAMES = 24

#: Axes of these samples. [count; as `EXAMPLE_FRAMES`, of 16 and 32]
EXAMPLE_AXES = 16

#: What the course counts beside the frames, each over what is usual. [1; chosen by
#: benchmarks/bench_classes.py on HDM05, CMU and Bandai as libraries, each of the others unknown: of
#: 0, 1, 2 and 3 the one at which none of the six pairs loses; more harms CMU, less Bandai]
EXAMPLE_COURSE = 2.0

#: Share of the spread between people of a class that is taken as it is found, beside one that is
#: the same in all directions. [share; as `EXAMPLE_COURSE`, of 0, 0.25, 0.5, 0.8 and 0.95]
OWN_SPREAD = 0.5

#: Parts that people are divided into where each clip is seen from what is learned of the others.
#: [count; chosen by hand: time grows with it]
LEFT_OUT_PARTS = 10

#: Classes whose frames are less likely by no more than this, on average, are ranked by their
#: nearest examples. [nats; chosen on HDM05, CMU and Bandai, people and styles left out: of 2 to 30
#: the one that costs walks and runs of CMU nothing]
ALIKE_NATS = 2.0

#: Nearest examples of a class that are looked at for that, each warped to the clip. [count; chosen
#: by hand: a fiftieth of a second for 20 classes]
ALIKE_EXAMPLES = 16

#: How much the reach of a class, the median distance between its clips by different people, counts
#: in what is far from it: 0 is one cut for all classes, 1 a cut of its own for each. [1; chosen on
#: HDM05, CMU and Bandai as libraries, each of the others unknown: benchmarks/bench_classes.py]
CLASS_POWER = 0.5

#: How much stricter or laxer than usual a class is at most. [ratio; chosen by hand: takes of one
#: session are much nearer to each other than anybody else is]
MOST_STRICTER = 2.0

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
