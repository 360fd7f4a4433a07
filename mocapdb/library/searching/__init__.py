"""What makes a library searchable, and searching it.

==================  ======================================================
`canonical_shards`  every clip on the canonical body, beside the payloads
`clip_facets`       speed, turn and contacts of a clip, measured
`search_index`      the frames of all clips, derived from those shards
`learned_classes`   the classes of a library, `models.h5`, likewise
`refreshing`        both brought up to date
`retrieval`         queries by example, and classes
`many_libraries`    queries of several libraries at once
`saved_queries`     queries that a library keeps
`class_cycles`      the cycle of a class, kept or made
==================  ======================================================
"""
