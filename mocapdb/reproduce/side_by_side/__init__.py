"""All papers in one run: their tables beside ours, and a verdict on each of their claims.

==================  ============================================================================
`verdict`           a claim, and whether it comes back
`okane_claims`      what O'Kane (2008) concludes
`raunio_claims`     what Raunio (2014) concludes
`vejdemo_claims`    what Vejdemo-Johansson et al. (2015) conclude
`aristidou_claims`  what Aristidou et al. (2018) conclude
`paper_tables`      tables, verdicts and machine as Markdown, CSV and JSON
`all_papers`        the whole run
==================  ============================================================================
"""
