"""What the shards of a library hold, found without its catalogue: every payload is decoded once."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mocapdb.base.progress import Progress, silent
from mocapdb.errors import LibraryError, MocapdbError
from mocapdb.library.layout import SHARD_NAME, SHARDS_FOLDER
from mocapdb.library.shard_entries import entry_bytes
from mocapdb.library.shards import ShardReader
from mocapdb.motion.skeleton import Skeleton

__all__ = ["Basis", "Dropped", "Gathered", "Kept", "gather"]


@dataclass(frozen=True)
class Dropped:
    """What cannot be used: what it is called, why, and its row of the catalogue if it is known."""

    what: str
    reason: str
    row: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Kept:
    """A sound payload: its shard's file, its place there, its entry and its skeleton.

    The digest of the entry as it is stored tells copies of one payload from all others.
    """

    file: str
    place: int
    entry: Mapping[str, Any]
    skeleton: Skeleton
    digest: bytes

    @property
    def row(self) -> dict[str, Any]:
        """What the catalogue said of it."""
        return dict(self.entry["row"])

    @property
    def key(self) -> tuple[str, str]:
        """The corpus and the file that a clip was built from."""
        return str(self.row["corpus"]), str(self.row["source"])


@dataclass(frozen=True)
class Basis:
    """A basis of a class, as a shard has it."""

    digest: bytes
    label: str
    layout: str
    data: bytes


@dataclass
class Gathered:
    """What shards hold.

    Attributes
    ----------
    clips : list of Kept
        Live clips; of those that were replaced only the last.
    revisions : list of (Kept, Kept)
        Live revisions, each with its clip.
    bases : dict of Basis
        By digest.
    dropped : list of Dropped
    files : dict of int
        Every shard that could be opened, and how many payloads it has.
    unknown : list of str
        Shards that tell nothing of what is in them.
    """

    clips: list[Kept] = field(default_factory=list)
    revisions: list[tuple[Kept, Kept]] = field(default_factory=list)
    bases: dict[bytes, Basis] = field(default_factory=dict)
    dropped: list[Dropped] = field(default_factory=list)
    files: dict[str, int] = field(default_factory=dict)
    unknown: list[str] = field(default_factory=list)

    def whole_files(self) -> set[str]:
        """Return the shards of which every payload is live."""
        used = [kept.file for kept in self.clips] + [kept.file for kept, _ in self.revisions]
        return {file for file, count in self.files.items() if used.count(file) == count > 0}


def gather(folder: Path, progress: Progress = silent) -> Gathered:
    """Read all shards of a library's folder, the oldest first."""
    found = Gathered()
    paths = [
        path
        for path in (folder / SHARDS_FOLDER).iterdir()
        if SHARD_NAME.fullmatch(path.name) and path.is_file() and not path.is_symlink()
    ]
    paths.sort(key=lambda path: int(path.stem))
    skeletons: dict[str, Skeleton] = {}
    for path in paths:
        try:
            with closing(ShardReader(path)) as reader:
                found.files[path.name] = len(reader)
                _take_shared(reader.shared_entries(), skeletons, found.bases)
                if not reader.is_complete:
                    raise LibraryError(
                        f"{path}: an earlier version wrote it, without the skeletons and names of "
                        "its clips."
                    )
        except MocapdbError as problem:
            found.unknown.append(path.name)
            found.dropped.append(Dropped(path.name, str(problem)))
    bases = {digest: basis.data for digest, basis in found.bases.items()}
    clips: list[Kept] = []
    revisions: list[Kept] = []
    readable = [path for path in paths if path.name not in found.unknown]
    for done, path in enumerate(readable, start=1):
        with closing(ShardReader(path)) as reader:
            for place in range(len(reader)):
                kept = _read(reader, place, skeletons, bases)
                if isinstance(kept, Dropped):
                    found.dropped.append(kept)
                elif kept.entry["kind"] == "clip":
                    clips.append(kept)
                else:
                    revisions.append(kept)
        progress(done, len(readable), path.name)
    found.clips = _live(clips)
    found.revisions = _of_clips(revisions, found.clips)
    # of a clip that is there all the same, from another shard, nothing is lost
    there = {(row["source"], row["source_sha256"]) for row in (kept.row for kept in found.clips)}
    found.dropped = [
        each
        for each in found.dropped
        if each.row is None or (each.row.get("source"), each.row.get("source_sha256")) not in there
    ]
    return found


def _take_shared(
    entries: Iterable[Mapping[str, Any]],
    skeletons: dict[str, Skeleton],
    bases: dict[bytes, Basis],
) -> None:
    """Take the skeletons and bases of a shard, by their digests; what is damaged has another."""
    for entry in entries:
        try:
            if entry["kind"] == "skeleton":
                skeleton = Skeleton.from_dict(entry["skeleton"])
                skeletons[skeleton.digest] = skeleton
            elif entry["kind"] == "basis":
                data, digest = entry_bytes(entry["data"]), bytes.fromhex(entry["digest"])
                if hashlib.sha256(data).digest().startswith(digest) and digest:
                    bases[digest] = Basis(digest, str(entry["label"]), str(entry["layout"]), data)
        except (KeyError, TypeError, ValueError, MocapdbError):
            continue  # whoever refers to it is dropped, and says so


def _read(
    reader: ShardReader, place: int, skeletons: Mapping[str, Skeleton], bases: dict[bytes, bytes]
) -> Kept | Dropped:
    """Return a payload that decodes to what its entry says, or why it does not."""
    from mocapdb.compression import decode

    what, row = f"row {place} of {reader.path.name}", None
    try:
        entry = reader.entry(place)
        row = entry["row"]
        is_clip = entry["kind"] == "clip"
        about = row if is_clip else entry["of"]
        what = str(about["name"]) + ("" if is_clip else ", as it was cleaned")
        if str(entry["skeleton"]) not in skeletons:
            raise LibraryError("its skeleton is damaged.")
        skeleton = skeletons[str(entry["skeleton"])]
        digest = row["source_sha256"] if is_clip else row["sha256"]
        channels = decode(reader.payload(place, digest), skeleton, bases=bases)
        if len(channels) != about["frames"]:
            raise LibraryError(f"expected {about['frames']} frames, but got {len(channels)}.")
        _expect_whole(row, is_clip)
        entry_bytes(str(entry.get("joint_errors") or ""))
    except MocapdbError as problem:
        return Dropped(what, str(problem), row if row and "source" in row else None)
    except (KeyError, TypeError, ValueError) as problem:
        return Dropped(what, f"what its shard says of it cannot be read ({problem!r}).")
    stored = hashlib.sha256(reader.entry_data(place)).digest()
    return Kept(reader.path.name, place, entry, skeleton, stored)


def _expect_whole(row: Mapping[str, Any], is_clip: bool) -> None:
    """Raise what a row raises that lacks what is looked for in it."""
    for name in ("name", "corpus", "source", "settings") if is_clip else ("spans", "settings"):
        if not isinstance(row[name], str):
            raise TypeError(name)
    json.loads(row["settings"])


def _live(clips: Sequence[Kept]) -> list[Kept]:
    """Return the clips that no other has taken the place of, the last of each file."""
    places = {(clip.file, str(clip.place)): clip for clip in clips}
    replaced: set[bytes] = set()
    for clip in clips:
        told = clip.entry.get("replaces")
        if isinstance(told, dict):
            # by where it is kept: its corpus may have moved since, and another file may be the same
            old = places.get((str(told.get("file")), str(told.get("shard_row"))))
            if old is not None and old.row["source_sha256"] == told.get("source_sha256"):
                replaced.add(old.digest)  # and with it the copies of it in other shards
    live: dict[tuple[str, str], Kept] = {}
    for clip in clips:
        known = live.get(clip.key)
        if clip.digest not in replaced and (known is None or known.digest != clip.digest):
            live[clip.key] = clip
    return list(live.values())


def _of_clips(revisions: Iterable[Kept], clips: Iterable[Kept]) -> list[tuple[Kept, Kept]]:
    """Return the last revision of each clip that is there, with the clip."""
    by_source: dict[tuple[str, ...], Kept] = {}
    for clip in clips:
        by_source[_source(clip.row)] = clip
    live: dict[tuple[str, ...], Kept] = {}
    for revision in revisions:
        if _source(revision.entry["of"]) in by_source:
            live[_source(revision.entry["of"])] = revision
    return [(revision, by_source[source]) for source, revision in live.items()]


def _source(row: Mapping[str, Any]) -> tuple[str, ...]:
    return str(row["source"]), str(row["source_sha256"]), str(row["settings"])
