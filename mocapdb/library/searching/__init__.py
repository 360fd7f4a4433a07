"""What makes a library searchable, and searching it.

==================  ======================================================
`canonical_shards`  every clip on the canonical body, beside the payloads
`search_index`      `search.h5` and `models.h5`, derived from those shards
`retrieval`         queries by example, and classes
`class_cycles`      the cycle of a class, kept or made
==================  ======================================================
"""
