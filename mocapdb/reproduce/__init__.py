"""The papers' tables, computed again beside the papers' own figures.

``okane.reproduce``       O'Kane (2008), tables 4.1 to 4.4: compression
``aristidou.reproduce``   Aristidou et al. (2018), tables 1 and 2: cleaning

Each gives rows ``{"table", "row", "column", "paper", "ours", "note"}``.
"""
