"""The papers' tables, computed again beside the papers' own figures.

``okane.reproduce``   O'Kane (2008), tables 4.1 to 4.4: compression

Each gives rows ``{"table", "row", "column", "paper", "ours", "note"}``.
"""
