"""The pose codec: smooth channels, quantised in the metric of the skin, entropy-coded in blocks.

=================  =============================================================================
`block_encoder`    The encoder's choices for one block: of every channel its mode, its track and
`blocks`           Blocks: a stretch of frames as integers, and as bytes
`class_basis`      Bases: directions in which a body's channels move together, found by PCA in
`entropy`          Tracks: the sequences of integers that channels become, predicted and
`modes`            Modes: the ways in which a channel of a block becomes a track, and back
`pose_codec`       The pose codec: splines in the metric of the skin (docs/format.md, codec 2)
`pose_layout`      The bytes of the pose codec: an index and a head in front, then blocks that
`quantise`         The encoder's search: integers whose errors cancel on the skin, and that code
`range_coder`      An adaptive range coder in integers, the same on every machine
`skin_metric`      How far each degree of freedom moves the points that an error is measured on
`smooth_channels`  The state of a body, frame by frame: channels that a smooth motion moves
`spikes`           Spikes: single frames of a channel that a smooth curve does not follow
`spline`           Cubic B-splines with knots every few frames: fitted to weighted samples, and
`target_search`    Holding a target: the search for the largest step whose error is still within
=================  =============================================================================
"""
