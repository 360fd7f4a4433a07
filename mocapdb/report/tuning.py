"""How much of a library a report looks at, and at which errors it encodes again."""

from __future__ import annotations

# -- size and error --------------------------------------------------------------------------------

#: Mean vertex errors at which stretches of clips are encoded again. [mm; each about three times the
#: one before, round the usual target of 1 mm]
TARGETS_MM = (0.3, 1.0, 3.0, 10.0)

#: Length of such a stretch, from the middle of a clip. [s; long enough for the bytes of a frame to
#: settle, chosen by hand]
CURVE_SECONDS = 2.5

#: Clips of which a stretch is encoded again, each of another class. [count; chosen by hand: curves
#: that one still tells apart]
CURVES = 4

# -- classes ---------------------------------------------------------------------------------------

#: Folds that subjects are dealt to: each is recognised by classes learned from the others. [count;
#: the usual number of folds of a cross-validation]
FOLDS = 5

#: Subjects by whom a class must be performed to be recognised across subjects. [count; one to learn
#: from and one to recognise]
LEAST_PERFORMERS = 2

#: Clips that are recognised. [count; chosen by hand, about a minute of work]
RECOGNISED_CLIPS = 1000

# -- faults ----------------------------------------------------------------------------------------

#: Motion that is searched for faults. [s; chosen by hand, about a minute of work]
FAULT_SECONDS = 300.0

#: A clip is passed over that would take the motion searched beyond this many times what was asked
#: for. [ratio; chosen by hand: the clips that are drawn vary in length]
MOST_OVER_FAULT_SECONDS = 1.5

# -- cycles ----------------------------------------------------------------------------------------

#: Clips that the cycle of a class is averaged from, where the library keeps none, in a report of
#: few classes. [count; chosen by hand]
CYCLE_CLIPS = 8

#: The same in a report of many classes, so that every one of them is shown. [count; the fewest that
#: make a mean]
LEAST_CYCLE_CLIPS = 2

#: Clips that all these cycles are averaged from. [count; chosen by hand, about a minute of work]
ALL_CYCLE_CLIPS = 160
