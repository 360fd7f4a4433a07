"""Every tuned number of gait analysis, in the order in which a clip meets them."""

from __future__ import annotations

# -- feet: `feet` ---------------------------------------------------------------------------------

#: How far the heel lies behind the ankle, as a share of the level way from ankle to ball.
#: [ratio; Winter, figure 4.1: the ankle stands over a quarter of the foot, the ball at 0.7 of it]
HEEL_BACK = 0.5

#: The sole is flat where the ankle is as slow as in this share of frames.
#: [share of frames; physical: a foot is flat for a fifth of a walk and a tenth of a run]
FLAT_SHARE = 0.1

#: The velocity of the lowest point of the feet is a mean over so long to each side.
#: [s; physical: noise of a degree at 120 Hz moves an ankle as fast as a slow walk]
BELT_REACH_S = 0.05

#: The ground is a belt, or the walk in place, where the lower foot goes at this speed at least.
#: [m/s; physical: slower than any walk, faster than feet slide]
LEAST_BELT_M_S = 0.25

#: The body travels by less than this share of the way that the belt makes.
#: [ratio; physical: who stays on a treadmill does not travel]
MOST_TRAVEL_OF_BELT = 0.3

# -- events: `foot_events` ------------------------------------------------------------------------

#: A point of the foot rests if it is slower than this, however slow the gait.
#: [m/s; physical: soles roll and captured feet slide by 0.1 to 0.3; over 0.6 slow swings go]
RESTING_M_S = 0.5

#: It rests, too, if it is slower than this share of the body.
#: [ratio; chosen by hand: fast feet leave little time to see them at rest]
RESTING_SHARE = 0.2

#: Where a run was smoothed, feet rest up to so many times those speeds, from each to the next as
#: far as there is too much flight with it. [ratio; chosen by hand: feet that slide as they land do
#: so at 1 m/s and more]
SLIDING_TIMES = (1.0, 1.6, 2.4, 3.2, 4.5)

#: A speed that is higher than the usual one by more than this is told.
#: [ratio; chosen by hand: less moves an event by less than a frame or two]
SLIDING_TOLD = 1.3

#: Who is slower than the first walks, who is faster than the second may run; between them it is
#: both in part. [Froude number of body and leg; Alexander, Physiological Reviews 69, 1989: people
#: change at a half]
WALK_RUN_FROUDE = (0.35, 0.5)

#: Who has hips that fall for less than the first of these walks, for more than the second runs;
#: between them in part. [share of the time; physical: a walk's hips never fall, a slow run's do
#: for a fifth of it]
WALK_RUN_FALL = (0.06, 0.16)

#: Hips fall if half of gravity or more pulls them down, over so long to each side.
#: [s; physical: less than half of a flight, which takes 0.08 and more, and longer than noise]
FALL_REACH_S = 0.04

#: Feet are off the ground for longer than the hips fall not at all with the first of these, for
#: certain with the second. [share of the time; chosen by hand on synthetic runs: hips are not the
#: whole body]
FALL_SHORT = (0.02, 0.1)

#: Where they differ by more, there is a note. [share of the time; chosen by hand: noise makes
#: less]
FALL_TOLD = 0.05

#: Feet are looked at at this rate at least. [Hz; chosen by hand: CMU's captures have it, and a
#: contact its fifteen frames]
EVENT_HZ = 120.0

#: Of heel, ball and tip the slowest tells the event; one faster by this counts 0.37 beside it.
#: [m/s; chosen by hand: with 0.1 synthetic strikes are off by 6 ms and not by 2, with less events
#: jump from one point to another when a clip changes by a millimetre]
ALIKE_M_S = 0.05

#: Contacts and swings shorter than this are none. [s; physical: a sprint's contact is 0.08]
LEAST_PHASE_S = 0.06

#: An event is refined by the path of the foot in the air this near to it. [s; chosen by hand on
#: synthetic gaits with noise: at 0.05 single events of noisy clips are off by 50 ms]
AIR_WINDOW_S = 0.09

#: And by its path on the ground this near to it. [s; physical: half of what a foot rolls over its
#: heel or its tip]
GROUND_WINDOW_S = 0.1

#: What a slide on the ground counts in that, as if the foot were seen so long.
#: [s; chosen by hand: 0.02 to 0.1 do as well]
DRIFT_WEIGHT_S = 0.05

#: What the height of a landing foot counts in that beside the level way.
#: [ratio; chosen by hand: feet that slide when they land have a kink in their height alone]
LANDING_UP_WEIGHT = 4.0

#: And what that of a leaving foot counts.
#: [ratio; chosen by hand: toes leave the ground level, so the level way tells as much]
LEAVING_UP_WEIGHT = 1.5

#: A foot in the air has gone by this power of the time to its landing. [1; physical: it is braked
#: evenly, a little more at first; between 2 and 2.2 by hand on synthetic gaits]
LANDING_POWER = 2.12

#: And by this power of the time since it left, in a walk and in a run.
#: [1; chosen by hand on synthetic gaits: a foot that peels off is lifted evenly, one that pushes
#: the body into the air is pulled up more and more]
LEAVING_POWERS = (1.9, 2.6)

#: Share of the stride on the ground of that walk and that run; between them the power is, too.
#: [ratio; physical: Winter; Novacheck, Gait and Posture 7, 1998]
DUTIES = (0.6, 0.45)

#: An event moves by no more than this when it is refined. [s; physical: a foot that has slowed
#: down to `RESTING_M_S` is not far from the ground]
REFINE_REACH_S = 0.06

# -- strides: `strides` ---------------------------------------------------------------------------

#: Least and most duration of a stride. [s; physical: sprints are 0.42, the slowest walks 2.5]
STRIDE_S = (0.35, 3.0)

#: The other foot strikes between these shares of a stride.
#: [ratio; physical: 0.5 of a symmetric gait, with room for a limp]
OPPOSITE_STRIKE = (0.25, 0.75)

#: A stride is longer than this share of the leg. [ratio; physical: shuffling in place is no gait]
LEAST_STRIDE = 0.25

#: A stride turns by less than this. [degrees; physical: more is a pivot]
MOST_TURN_DEG = 75.0

# -- what zero means: `calibration` ---------------------------------------------------------------

#: Legs of a rest pose in which somebody stands are at most so far from the vertical.
#: [degrees; physical: CMU's stand astride by 20]
STANDING_LEG_DEG = 35.0

#: Knees of a rest pose in which somebody stands are bent by no more than this.
#: [degrees; physical: a locked knee is straight within 10]
STANDING_KNEE_DEG = 15.0

#: Feet of a rest pose in which somebody stands are as level as in mid-stance, but for this.
#: [degrees; physical: shoes and slopes of 5 to 10]
STANDING_FOOT_DEG = 15.0

#: A knee whose axis is found from motion bends by this at least, from its most to its least.
#: [degrees; physical: half of what a walk's knee bends]
LEAST_BEND_DEG = 25.0
