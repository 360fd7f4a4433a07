"""The pose codec: smooth channels, quantised in the metric of the skin, entropy-coded in blocks.

In the order in which a clip passes through them:

=================  ==============================================================================
`pose_codec`       the codec as a whole: what is tried, and the smallest payload of it
`smooth_channels`  channels without jumps of their angles, in orders of axes that suit the motion
`class_basis`      directions in which a body's channels move together, by PCA
`skin_metric`      what an error of each channel costs on the points that errors are measured on
`own_motion`       what the joints have to keep of their own motion, and how much that counts
`target_search`    the search for the coarsest step whose error is within the target
`block_metric`     the metric of a block's frames, and what of it changes with the weights
`block_encoder`    the encoder of one block: for every channel its mode, integers and spikes
`modes`            the ways in which a channel becomes integers: splines, one value, DCT, wavelet
`spline`           cubic B-splines with knots every few frames: fitted and evaluated
`spikes`           single frames of a channel that differ from its smooth curve
`quantise`         the beam search for integers of little error and few bits
`entropy`          prediction and context modelling of the integers
`range_coder`      an adaptive range coder in integers
`blocks`           a range of frames as integers, and as bytes
`pose_layout`      the bytes of a payload: an index and a head in front, then the blocks
=================  ==============================================================================
"""
