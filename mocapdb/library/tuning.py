"""The tuned numbers of libraries: none changes what is decoded, all change what it costs."""

from __future__ import annotations

# -- commits: what a killed build loses ------------------------------------------------------------

#: Payloads that a build gathers before it writes them as one shard. Smaller: more files to open;
#: larger: more memory, and more to do again. [byte; chosen by hand: a shard opens in 1 ms]
COMMIT_BYTES = 32 * 2**20

#: Time after which a build commits what it has, be it less. [second; chosen by hand: what one is
#: ready to lose when a build is killed]
COMMIT_SECONDS = 20.0

#: Clips whose features are gathered before they are written as one shard, where an index is added
#: to a library that has none. [count; chosen by hand: 500 clips of CMU's database are some 15 MB]
COMMIT_CLIPS = 500

# -- bases of classes ------------------------------------------------------------------------------

#: Clips of one class and skeleton that it takes to learn a basis from. Of fewer, the basis is that
#: of the clips and not of the class. [count; chosen by hand]
LEAST_CLIPS = 3

#: Clips of a class that are looked at, spread evenly. [count; chosen by hand: bounds the memory,
#: since all their poses are held at once]
MOST_CLIPS = 24

# -- the index -------------------------------------------------------------------------------------

#: Clips, spread evenly, from which the axes of the search are found. [count; chosen by hand: it
#: takes a few thousand clips to know along which axes people move, and not all of a million]
SPACE_CLIPS = 2000

#: Share of a library's clips in which the axes must have been found; under it, they are found anew.
#: [ratio; chosen by hand: a library that has doubled gets axes of its own]
KNOWN_SHARE = 1 / 2

# -- reading ---------------------------------------------------------------------------------------

#: Payloads kept open for ranges of frames; the oldest makes room. [count; chosen by hand: bounds
#: the memory, a few kB each]
MOST_READERS = 256

#: Clips of a class that are looked at, spread evenly, for the cycle of a class that a library does
#: not keep. [count; chosen by hand: some seconds of waiting]
CYCLE_CLIPS = 8

#: How alike a name and a clip's name must be for the clip to be offered in its place. [ratio of
#: letters in common; difflib's own is 0.6, which misses "2_02" for "02_02" in longer names]
CLOSENESS = 0.5

#: Names that are offered at most. [count; chosen by hand: a line of an error message]
CLOSE_NAMES = 3
