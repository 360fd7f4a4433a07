"""What speaks for a fault, before any neighbour is asked and after.

=====================  =========================================================================
`discontinuities`      Discontinuities: where a joint jumps as no body does
`fault_confidence`     How likely a hypothesis is a fault, given all evidence: one logistic
`fault_shapes`         What may stand between the edges of one joint; `hypotheses` says which
`hypotheses`           Hypotheses: stretches of a joint whose edges look like those of a fault
`joint_limits`         Joint limits, learnt from clean data: the rotations that a joint has been
`similarity_evidence`  Hypotheses by self-similarity: stretches in which one joint does what it
=====================  =========================================================================
"""
