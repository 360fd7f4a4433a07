"""O'Kane's codec: PCA over the poses, a transform over time, only the largest coefficients.

===============  ===============================================================================
`body_and_root`  A representation as two matrices that are coded apart: the body's poses and the
`okane_codec`    O'Kane's codec: PCA over the poses, a transform over time, and only the largest
`okane_layout`   What O'Kane's codec stores of a clip, in memory and as bytes
`pca`            Principal components of poses (O'Kane 2008, section 3.2.2)
`root_finding`   Root finding on a number of things kept (O'Kane 2008, section 3.2.3)
===============  ===============================================================================
"""
