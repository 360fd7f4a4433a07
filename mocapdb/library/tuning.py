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

#: Shards of about one size that are joined into one: a build of one clip makes one. Smaller: what
#: is small is written more often; larger: more files to open. [count; chosen by hand: of builds of
#: one clip a few dozen small shards are left at most, and each clip is written five times]
JOINED_SHARDS = 8

#: What a build joins at most, so that one new clip stays quick; `compact` joins the rest, up to the
#: size of a commit. [byte; chosen by hand: a tenth to half of a second]
JOINED_BYTES = 2**20

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

#: Size from which on a piece of the index is full, and what is appended begins the next one.
#: Smaller: more rows in the catalogue; larger: more is hashed again when a clip is added.
#: [byte; chosen by hand: a few milliseconds of hashing]
PIECE_BYTES = 2**22

# -- facets ----------------------------------------------------------------------------------------

#: Time over which the speed of the hips is taken: less adds the noise of the capture, more cuts
#: corners. [s; chosen by hand: 1 mm of noise is 0.02 m/s then, and a tenth of a stride passes]
SPEED_SPAN_S = 0.1

#: Labelled clips that classes need not know, of those that they were learned from: learning takes
#: time with the size of a library, and so few change nothing. [ratio; chosen by hand: one in fifty]
NEW_SHARE = 1 / 50

# -- reading ---------------------------------------------------------------------------------------

#: Size up to which a file that is made from others, or the search index, is compared with its
#: checksum whenever it is opened: a tenth of a second. [byte; chosen by hand: 15 hours of motion]
MOST_HASHED = 2**26

#: Size of all copies of shards of libraries in object storage; those that were not used for the
#: longest make room. The environment's MOCAPDB_CACHE_MB wins. [byte; chosen by hand: a thousand
#: hours of motion, and what a disk has to spare]
MOST_CACHED = 2**33

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

# -- windows to train on ---------------------------------------------------------------------------

#: Windows of a clip that are decoded together. More: less is decoded twice where windows overlap;
#: fewer: less memory, and better mixed. [count; chosen by hand: half a minute of windows that
#: start every half second]
STRETCH_WINDOWS = 64

#: Such stretches whose windows are mixed with each other. More mixes better and needs a larger
#: cache. [count; chosen by hand: two thousand windows, 13 MB of positions of 31 joints]
POOLED_STRETCHES = 32
