"""Finding stretches and clips that are like an example.

================  ===============================================================================
`agreement`       Why a stretch was found: which joints and which moments are like the query
`body_parts`      Searching by some of the joints only: an arm, the legs
`clip_search`     Finding whole clips that are like a clip, whatever their length and speed
`course`          How two stretches go as a whole: what frames one by one do not see
`example_query`   What is looked for: a motion, or several examples of one
`features`        What a frame is compared by: the pose, how it moves, and how the body travels
`frame_store`     The frames of many clips as a query goes over them
`probability`     How likely a hit is the same motion, by its distance and near labels
`signature`       A clip as a few numbers: candidates are found by them and then verified
`span_scan`       Going over ranges of frames: the distance of the best stretch that ends at each
`stretch_search`  Finding the stretches of many clips that are the motion of a query
`turning`         By how much a stretch turns: what single frames do not see
`warping`         Sub-sequence dynamic time warping: a query against every stretch of a library
================  ===============================================================================
"""
