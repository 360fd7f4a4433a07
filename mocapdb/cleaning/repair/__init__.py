"""New rotations for what was flagged, and feet and hands that stay where they have to be.

=================  ==============================================================================
`contact_targets`  Contacts: places where a joint has to be, which repairs choose by and then
`foot_skate`       Foot skate: feet that slide where they rest, and two ways to stop them
`gaps`             One span of one joint, and the ways to fill it; see `repair`
`missing_joints`   Filling in joints that were not captured, from similar motion (Aristidou 2018,
`repair`           Repair: new rotations for the flagged stretches, everything else bit for bit
=================  ==============================================================================
"""
