"""How long a period is, and where in a clip something repeats.

=================  =============================================================================
`autocorrelation`  The period of a motion by autocorrelation: quick, and right where topology
`periodic_ranges`  Where in a clip something repeats: ranges of frames, each with its own period
=================  =============================================================================
"""
