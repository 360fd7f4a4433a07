"""Building a library from a folder of motion files.

================  ============================================================
`build`           a folder of motion files to a library, from beginning to end
`settings`        how clips are encoded
`corpus_listing`  the files of a folder
`corpus_labels`   what a label file says of them
`file_states`     how files look from outside: which need not be read
`changed_files`   which files look otherwise than the last build left them
`plan`            which files have to be encoded
`known_files`     what is known of a file before it is read
`folder_bodies`   unit and axis on which clips of one skeleton agree
`class_bases`     what clips of a class share, learned before they are encoded
`encode_files`    workers that read, encode and measure files
`assumptions`     what was taken for granted, for the end of a build
`takes`           what the clips of a file that holds several are called
`commit_clips`    a shard and a transaction at a time
`revise_clips`    cleaned revisions beside the clips
================  ============================================================
"""
