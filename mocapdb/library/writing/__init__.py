"""Writing a library: one writer at a time, and every file whole or not at all.

==================  ==================================================================
`open_for_writing`  a library as its only writer, and the lock that says so
`catalogue_writer`  the catalogue made, written and shrunk; its commit is *the* commit
`shard_writer`      new shards, whole or not at all
`index_writer`      clips appended to the search index
`derived_files`     files made from others, with their checksums
`pack_shards`       shards that say all there is to know of what they hold
==================  ==================================================================
"""
