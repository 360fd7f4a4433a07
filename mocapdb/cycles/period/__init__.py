"""How long a period is, and where in a clip something repeats.

=================  ============================================================================
`autocorrelation`  the period of a motion, from how much it differs from itself some time later
`periodic_ranges`  ranges of frames that repeat, each with its own period
=================  ============================================================================
"""
