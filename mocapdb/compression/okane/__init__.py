"""O'Kane's codec: PCA over the poses, a transform over time, only the largest coefficients.

===============  ============================================================================
`okane_search`   the choice among what the codec leaves open: representation, transform, PCA
`okane_codec`    the codec as a whole: its stages, each with a budget for the error
`body_and_root`  a clip as two matrices that are coded apart: the body's poses and the root's
                 track
`pca`            principal components of poses
`root_finding`   the smallest number of coefficients or components that will do, and the
                 budgets that cost least
`set_basis`      axes that the clips of a set share
`okane_layout`   what is stored of a clip, in memory and as bytes
===============  ============================================================================
"""
