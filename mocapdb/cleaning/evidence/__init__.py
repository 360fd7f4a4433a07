"""What speaks for a fault: hypotheses, and the evidence on each.

=====================  ===================================================================
`discontinuities`      jumps: where a joint turns as no body does
`fault_shapes`         what may stand between the jumps of one joint
`hypotheses`           hypotheses by jumps, with their evidence
`similarity_evidence`  hypotheses by similar motion, where there are no jumps, with theirs
`joint_limits`         how far a joint is beyond the rotations that it takes elsewhere
`fault_confidence`     how likely a hypothesis is a fault, given all evidence
=====================  ===================================================================
"""
