"""The tuned numbers of libraries: none changes what is decoded, all change what it costs."""

from __future__ import annotations

# -- commits: what a killed build loses ------------------------------------------------------------

#: Payloads that a build gathers before it writes them as one shard. Smaller: more files to open;
#: larger: more memory, and more to do again. [byte; chosen by hand]
COMMIT_BYTES = 32 * 2**20

#: Time after which a build commits what it has, be it less. [second; chosen by hand: what one is
#: ready to lose when a build is killed]
COMMIT_SECONDS = 20.0

#: Clips whose features are gathered before they are written as one shard, where an index is added
#: to a library that has none. [count; chosen by hand: bounds the memory and what is lost]
COMMIT_CLIPS = 500

# -- bases of classes ------------------------------------------------------------------------------

#: Clips of one class and skeleton that it takes to learn a basis from. Of fewer, the basis is that
#: of the clips and not of the class. [count; chosen by hand]
LEAST_CLIPS = 3

#: Clips of a class that are looked at, spread evenly. [count; chosen by hand: bounds the memory,
#: since all their poses are held at once]
MOST_CLIPS = 24

# -- bodies ----------------------------------------------------------------------------------------

#: Clips of a skeleton in a folder, spread evenly, that are asked for the unit and the vertical axis
#: of all of them. Fewer may all lie or crawl. [count; chosen by hand: reading them takes far less
#: than 5 % of encoding them]
SAMPLED_OF_A_SKELETON = 16

# -- the index -------------------------------------------------------------------------------------

#: Clips, spread evenly, from which the axes of the search are found; up to twice as many, where
#: they do not divide evenly. [count; chosen by hand: bounds the memory of a large library]
SPACE_CLIPS = 2000

#: Share of a library's clips in which the axes must have been found; under it, they are found anew.
#: [ratio; chosen by hand: a library that has doubled gets axes of its own]
KNOWN_SHARE = 1 / 2

# -- reading ---------------------------------------------------------------------------------------

#: Payloads kept open for ranges of frames; the oldest makes room. [count; chosen by hand: bounds
#: the memory]
MOST_READERS = 256

#: Clips of a class that are looked at, spread evenly, for the cycle of a class that a library does
#: not keep. [count; chosen by hand: bounds the waiting]
CYCLE_CLIPS = 8

#: How alike a name and a clip's name must be for the clip to be offered in its place. [ratio of
#: letters in common; chosen by hand: difflib's own 0.6 offers no 01_01 for "walking_01_01"]
CLOSENESS = 0.5

#: Names that are offered at most. [count; chosen by hand: a line of an error message]
CLOSE_NAMES = 3

# -- What joints lost ------------------------------------------------------------------------------

#: From how far on a joint is said to move. [degrees, and mm; chosen by hand: what can be seen]
MOVES = (3.0, 3.0)

#: A joint that moves and loses more of its swing than this is told to be held still.
#: [ratio; chosen by hand]
HELD_STILL = 0.9

#: How many joints, and how many clips, are named that lost most. [count; chosen by hand]
LOSSES_SHOWN = 8
