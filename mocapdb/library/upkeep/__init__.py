"""Keeping a library sound, small and searchable.

=========  ========================================================
`verify`   every checksum, every file, every clip
`compact`  the space of replaced clips, given back
`index`    a library made ready for queries; classes given to clips
=========  ========================================================
"""
