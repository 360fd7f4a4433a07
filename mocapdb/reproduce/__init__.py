"""The papers' tables, computed again beside the papers' own figures.

======================  ========================================================================
`okane`                 O'Kane (2008), tables 4.1 to 4.4: compression
`okane_clips`           the clips of CMU's that stand for his
`okane_open_questions`  what he leaves open, tried both ways; variance by dimension
`recognition`           O'Kane (2008), tables 4.5 to 4.8: recognition of classes
`raunio`                Raunio (2014), tables A and B: template errors and period counts
`vejdemo`               Vejdemo-Johansson et al. (2015), table 1: births and times of cohomology
`vejdemo_walks`         what they say of walks, measured on those at hand
`aristidou`             Aristidou et al. (2018), tables 1 and 2: detection and repair of faults
`aristidou_baselines`   what their table compares with: limits, another search for neighbours
`aristidou_kit`         beyond the paper: every kind of fault, found and repaired, beside rivals
`aristidou_rivals`      the rivals: interpolation, filters, low-rank completion
`side_by_side`          all papers in one run, with a verdict on each of their claims
`_tables`               what all of these share: printed figures, rows, folders, progress
======================  ========================================================================

Each has a function ``reproduce`` that gives rows ``{"table", "row", "column", "paper", "ours",
"note"}``, and ``CONVENTIONS``, which say what was assumed.
"""
