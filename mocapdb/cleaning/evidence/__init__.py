"""What speaks for a fault: hypotheses, and the evidence on each.

=====================  ============================================================================
`quieting`             rotations without noise that is not seen
`discontinuities`      jumps: where a joint turns as no body does
`fault_shapes`         what may stand between the jumps of one joint
`hypotheses`           hypotheses by jumps, with their evidence
`excursions`           hypotheses by excursions that a joint never makes elsewhere: soft edges
`jitter`               hypotheses by a tremble that a joint does not have elsewhere
`straight_lines`       hypotheses by straight lines: filled gaps
`exchanges`            hypotheses by left and right exchanged
`foot_faults`          feet that slide where they stand, or go through the floor
`root_jumps`           hypotheses by jumps of the root's translation
`similarity_evidence`  hypotheses by similar motion, where there are no jumps, with theirs
`joint_limits`         how far a joint is beyond the rotations that it takes elsewhere
`pose_spread`          how odd its rotations are among the joint's others
`pooled_spread`        the same, and its way, among the joint's others and the opposite joint's
`fault_confidence`     how likely a hypothesis is a fault, given all evidence on it
`corroboration`        how likely it is in the light of the other hypotheses
=====================  ============================================================================
"""
