"""The chosen numbers of synthetic motion, in one table.

They decide what a synthetic clip is like, and so every test that is made with one. Measured data
(proportions of the body, joint-angle curves of gaits) stand with their sources beside their code,
as do the amplitudes of each motion; what decides only how patient a download is, in `fetch`.
"""

# -- people ----------------------------------------------------------------------------------------

#: Mean and standard deviation of stature. [m; adults of both sexes, as in CMU's subjects]
STATURE_M = (1.71, 0.09)

#: Least and largest stature. [m; about three deviations from the mean]
STATURE_RANGE_M = (1.45, 2.0)

#: Standard deviation of the proportions of legs, arms and shoulders. [ratio; chosen by hand: people
#: of one stature differ by a few per cent]
PROPORTION_SD = 0.03

#: Least and largest proportions. [ratio; over two deviations from the mean]
PROPORTION_RANGE = (0.92, 1.08)

# -- how somebody moves ----------------------------------------------------------------------------

#: Standard deviations of vigour, arm swing, tempo and breadth of the track. [ratio; chosen by hand]
STYLE_SD = (0.06, 0.15, 0.04, 0.15)

#: Least and largest of these. [ratio; a motion that is still of its class]
STYLE_RANGE = (0.7, 1.3)

#: Means of lean, bend of the elbows, arms and toes turned out. [degrees; chosen by hand: arms that
#: do not touch the trunk, feet as people set them]
POSTURE_DEG = (0.0, 0.0, 9.0, 6.0)

#: Standard deviations of these. [degrees; chosen by hand]
POSTURE_SD_DEG = (1.5, 4.0, 2.0, 1.5)

#: Standard deviation of the angles of wrists, hands and clavicles. [degrees; chosen by hand]
HAND_SD_DEG = 2.0

#: Reach of a leg: a knee is never quite straight. [share of thigh and shank; 6 degrees are left]
LONGEST_REACH = 0.9985

# -- tempo -----------------------------------------------------------------------------------------

#: Sine waves that a wandering of the phase is made of. [count; chosen by hand: no pattern is seen]
N_WAVES = 6

#: Longest and shortest of them. [cycles; slower than a cycle, so that no cycle is bent]
WAVE_CYCLES = (10.0, 1.7)

# -- motions ---------------------------------------------------------------------------------------

#: Phase of a walk at which the pelvis is lowest. [cycles; the middle of double support]
DIP_PHASE = 0.03

#: Share of a hop on the ground. [share; chosen by hand]
HOP_DUTY = 0.5

#: Longest flight of a hop. [s; 16 cm high, what people do over and over]
LONGEST_FLIGHT_S = 0.36

# -- clips and sequences ---------------------------------------------------------------------------

#: Length of a clip of one class. [s; four walking cycles or more]
DEFAULT_DURATION_S = 5.0

#: Classes of a sequence. [count; chosen by hand]
N_SEGMENTS = 3

#: Least and largest length of each. [s; two cycles of most classes]
SEGMENT_S = (2.5, 3.5)

#: How long one class fades into the next. [s; chosen by hand: nothing jerks]
TRANSITION_S = 0.6

#: Height that a foot is lifted by to stand elsewhere. [m; chosen by hand]
STEP_LIFT_M = 0.05

#: A foot that is lifted by less is on the ground. [m; a marker's own noise]
AT_REST_M = 0.002

# -- faults ----------------------------------------------------------------------------------------

#: Least and largest size of a fault. [degrees; from what is hardly seen to what nobody overlooks]
FAULT_DEG = (15.0, 60.0)

#: Least and largest length of a fault. [s; chosen by hand]
FAULT_S = (0.1, 0.5)

#: Places that are tried for a fault. [count; chosen by hand: an end to the search for room]
PLACE_TRIES = 200

#: A joint freezes where it would have turned by as much. [degrees; less would be no fault]
FREEZE_LEAST_DEG = 5.0

#: What turns a joint by less, as an exchange of two alike may, does not count as a fault.
#: [degrees; what nobody overlooks]
LEAST_FAULT_DEG = 10.0

#: Standard deviation of the filter that smooths jitter put into a clip. [s; by hand: frequencies up
#: to some 5 Hz pass]
FAULT_JITTER_S = 0.03

#: A foot is drawn aside only so long after it has come to rest, and before it leaves. [s; by hand]
REST_EDGE_S = 0.06

# -- the written corpus ----------------------------------------------------------------------------

#: Frame rate. [frames per second; CMU's]
CORPUS_FPS = 120.0

#: Least and largest length of a clip; sequences are twice as long. [s; chosen by hand]
CORPUS_DURATION_S = (3.0, 6.0)

#: Slowest and fastest. [ratio; chosen by hand]
CORPUS_SPEED = (0.85, 1.2)

#: Largest turn to either side. [degrees; chosen by hand: no two clips go the same way]
CORPUS_HEADING_DEG = 70.0

#: Standard deviation of white noise on the angles. [degrees; an optical system's]
CORPUS_NOISE_DEG = 0.15

#: Standard deviation of the length of cycles. [ratio; that of adults who walk]
CORPUS_JITTER = 0.02
