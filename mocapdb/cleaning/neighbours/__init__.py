"""Similar motion: the nearest words of every word, and what they say of each joint.

====================  =======================================================================
`nearest_words`       the K nearest words of every word, and the vocabulary they are found in
`similarity`          what the neighbours say of each joint; the paper's two-stage search
`counterpart_joints`  motion of another actor or rig, put onto the joints of a clip's
`body_halves`         groups of joints that move together, by the skeleton's hierarchy
`sketches`            which stretches of a long vocabulary are worth comparing with a word
`_neighbour_kernels`  kernels that search a vocabulary: all of it, or promising blocks
`_word_warping`       kernels that compare frames and warp words
====================  =======================================================================
"""
