"""Similar motion: the nearest words of every word, and what they say of each joint.

====================  ==========================================================================
`_neighbour_kernels`  Kernels that search a vocabulary: all of it, or the most promising blocks
`_word_warping`       Kernels of the neighbour search: distances of frames, constrained warping
`body_halves`         Groups of joints that move together (Aristidou 2018, section 3.1), by the
`nearest_words`       Nearest words: K confirmed local minima of the warping distance (Aristidou
`similarity`          What the neighbours say of every joint and frame: their median, mean and
====================  ==========================================================================
"""
