"""Write data/manifest.csv from an index of the CMU motion capture database.

    python scripts/write_manifest.py INDEX.csv [--labels LABELS.csv] -o data/manifest.csv

INDEX.csv has the columns clip, description and fps. LABELS.csv, the table of a folder that holds
some of the clips, gives the checksums of their AMC files (columns clip, format, path, sha256), and
the checksums of their skeletons are taken from the files that its column `skeleton` names.

Prints the classes with their counts as the Markdown table of docs/classes.md.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import sys
from collections import Counter
from pathlib import Path

from mocapdb.corpus._table import read_rows
from mocapdb.corpus.class_rules import CLASSES, classify_description
from mocapdb.corpus.manifest import MANIFEST_COLUMNS, ManifestEntry, read_manifest
from mocapdb.errors import CorpusError, MocapdbError

BASE_URL = "http://mocap.cs.cmu.edu/subjects"


def main() -> int:
    """Run the script; return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("index", type=Path, metavar="INDEX.csv")
    parser.add_argument("--labels", type=Path, metavar="LABELS.csv")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="MANIFEST.csv")
    args = parser.parse_args()
    try:
        motions, skeletons = known_checksums(args.labels) if args.labels else ({}, {})
        entries = read_index(args.index, motions, skeletons)
        write_manifest(entries, args.output)
    except MocapdbError as error:
        print(error, file=sys.stderr)
        return 1
    print(class_table(entries))
    return 0


def known_checksums(labels: Path) -> tuple[dict[str, str], dict[str, str]]:
    """Return SHA-256 of AMC files by clip, and of ASF files by subject."""
    motions: dict[str, str] = {}
    skeletons: dict[str, Path] = {}
    for row in read_rows(labels, ("clip", "format", "path", "skeleton", "sha256")):
        subject = row["clip"].split("_")[0]
        if row["format"] == "amc" and Path(row["skeleton"]).stem == subject:  # CMU, not HDM05
            motions[row["clip"]] = row["sha256"]
            skeletons[subject] = labels.parent / row["skeleton"]
    try:
        hashes = {
            subject: hashlib.sha256(path.read_bytes()).hexdigest()
            for subject, path in skeletons.items()
        }
    except OSError as error:
        raise CorpusError(f"{error.filename}: Expected a skeleton: {error.strerror}.") from None
    return motions, hashes


def read_index(
    index: Path, motions: dict[str, str], skeletons: dict[str, str]
) -> list[ManifestEntry]:
    """Return the entries of an index, with the checksums that are known."""
    entries = []
    for row in read_rows(index, ("clip", "description", "fps")):
        clip = row["clip"]
        subject, _, trial = clip.partition("_")
        entries.append(
            ManifestEntry(
                clip=clip,
                subject=subject,
                trial=trial,
                label=classify_description(row["description"]),
                description=" ".join(row["description"].split()),
                fps=row.fps(),
                skeleton_url=f"{BASE_URL}/{subject}/{subject}.asf",
                motion_url=f"{BASE_URL}/{subject}/{clip}.amc",
                sha256=motions.get(clip),
                skeleton_sha256=skeletons.get(subject),
            )
        )
    return entries


def write_manifest(entries: list[ManifestEntry], path: Path) -> None:
    """Write the manifest, and read it back before it takes its place."""
    partial = path.with_name(path.name + ".partial")
    with partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(MANIFEST_COLUMNS)
        for entry in entries:
            writer.writerow(
                (
                    entry.clip,
                    entry.subject,
                    entry.trial,
                    entry.label,
                    entry.description,
                    f"{entry.fps:g}",
                    entry.skeleton_url,
                    entry.motion_url,
                    entry.sha256 or "",
                    entry.skeleton_sha256 or "",
                )
            )
    if read_manifest(partial) != entries:
        raise CorpusError(f"{partial}: Expected the manifest to read back as written.")
    partial.replace(path)


def class_table(entries: list[ManifestEntry]) -> str:
    """Return the classes with their counts as a Markdown table."""
    counts = Counter(entry.label for entry in entries)
    rows = [f"| {name} | {counts[name]} | {meaning} |" for name, meaning in CLASSES.items()]
    return "\n".join(("| class | clips | what belongs to it |", "| --- | ---: | --- |", *rows))


if __name__ == "__main__":
    raise SystemExit(main())
