"""Writing a library: one writer at a time, and every file whole or not at all.

==================  ==================================================================
`open_for_writing`  a library as its only writer, and the lock that says so
`catalogue_writer`  the catalogue made, written and shrunk; its commit is *the* commit
`shard_writer`      new shards, whole or not at all
==================  ==================================================================
"""
