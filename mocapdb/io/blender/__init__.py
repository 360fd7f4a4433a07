"""Files that Blender reads for mocapdb: FBX, Collada, USD; and FBX, which it writes.

=============  =====================================================================
`scenes`       the clips of a file, and which one `read_clip` takes
`fbx_writing`  a clip as FBX
`fbx_header`   unit and vertical axis of an FBX; pictures that are not opened
`program`      finding a Blender
`process`      a Blender that runs beside mocapdb, with time limits
`worker`       what runs inside Blender
=============  =====================================================================
"""
