"""Writing a library: one writer at a time, and every file whole or not at all.

==================  ==================================================================
`open_for_writing`  a library as its only writer
`writer_lock`       a lock that the operating system drops when its holder dies
`catalogue_writer`  the catalogue made, written and shrunk; its commit is *the* commit
`shard_writer`      new shards, and the strays of writers that were killed
==================  ==================================================================
"""
