"""The table of peers in the docs is one run's: its Markdown has what its CSV has."""

from __future__ import annotations

import csv
from pathlib import Path

TABLES = Path(__file__).parents[1] / "docs" / "tables"
COLUMNS = ("task", "unit", "ours", "peer", "theirs", "ratio", "quality")


def test_the_markdown_is_the_csv():
    rows = list(csv.DictReader((TABLES / "peers.csv").read_text().splitlines()))
    text = (TABLES / "peers.md").read_text()
    lines = text.splitlines()
    assert lines[0].startswith(f"Measured {rows[0]['date']}: ")
    assert f"mocapdb {rows[0]['mocapdb']}" in lines[0]
    assert lines[4:] == ["| " + " | ".join(row[name] for name in COLUMNS) + " |" for row in rows]


def test_every_peer_of_every_task_is_there():
    peers = " ".join(
        row["peer"] for row in csv.DictReader((TABLES / "peers.csv").read_text().splitlines())
    )
    for name in (
        "pybvh", "bvhio", "stumpy", "plain warping", "dreimac", "zlib", "zstd", "blosc2", "O'Kane",
        "ACL", "autocorrelation", "crossfaded", "Butterworth", "Savitzky-Golay", "Hampel",
    ):  # fmt: skip
        assert name in peers
