"""The movement digression map, and the detector that fills it.

================  ============================================================================
`detector`        The detector: how likely each hypothesis is a fault, given all evidence
`digression_map`  The movement digression map: how sure each joint is wrong in each frame, and
================  ============================================================================
"""
