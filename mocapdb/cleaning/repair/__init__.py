"""New rotations for what was flagged, and feet and hands that stay where they have to be.

=================  ============================================================
`repair`           repair of flagged spans; everything else stays bit for bit
`gaps`             the ways to fill one span of one joint
`contact_targets`  places where a joint has to be, given or found from feet
`held_feet`        feet that slide or sink, held where they were
`exchanged_limbs`  limbs whose left and right were exchanged, swapped back
`foot_skate`       feet that slide where they rest, stopped
`missing_joints`   joints that were not captured, filled in from similar motion
=================  ============================================================
"""
