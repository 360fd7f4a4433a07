"""Keeping a library sound, small and searchable.

=========  ====================================================================
`verify`   every checksum, every file, every clip
`compact`  the space of replaced clips, given back; many small files, made few
`recover`  a damaged library brought back
`gather`   what shards hold, found without a catalogue
`clean`    cleaned revisions beside the clips as captured, made and taken back
`index`    a library made ready for queries; classes given to clips
=========  ====================================================================
"""
