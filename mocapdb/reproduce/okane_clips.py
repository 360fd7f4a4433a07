"""The clips of CMU's database that stand for O'Kane's, who names none of his."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from math import comb
from pathlib import Path

from mocapdb.corpus import read_manifest
from mocapdb.errors import CorpusError
from mocapdb.io import find_motion_files, read_with_settings
from mocapdb.motion.clip import Clip

__all__ = ["CMU_UNIT_M", "NEAR", "Found", "ThesisClips", "ThesisSet"]

CMU_UNIT_M = 0.0254 / 0.45
NEAR = 0.1  # a stand-in of so nearly his frames is marked by one star
CMU_NAME = re.compile(r"\d{2,3}_\d{2}")
CMU_FPS = 120.0
DAZ = "BVH of Daz"
MOST_CHOICES = 1000
# CMU's descriptions of clips of a kind and nothing else: not of "walk on uneven terrain"
_KINDS = {
    "run": re.compile(r"^run(/jog)?$"),
    "walk": re.compile(r"^walk$"),
    "boxing": re.compile(r"^(boxing|punch/strike)$"),
    "break dance": re.compile(r"break ?dance"),
}
_NAMED = {"1 run": "02_03", "1 walk": "07_01"}


@dataclass(frozen=True)
class ThesisSet:
    """A set of clips as the thesis describes it.

    Attributes
    ----------
    name : str
        Its row in the tables.
    kind : str
        ``"run"``, ``"walk"``, ``"boxing"`` or ``"break dance"``.
    n_clips, n_frames : int
    """

    name: str
    kind: str
    n_clips: int
    n_frames: int


@dataclass(frozen=True)
class Found:
    """The clips that a set is computed on, and what to say about them."""

    clips: tuple[Clip, ...]
    note: str


class ThesisClips:
    """The clips of CMU's database that a folder has, as AMC or as BVH.

    Parameters
    ----------
    corpus : Path
        Of the conversions to BVH that of MotionBuilder keeps the bodies; that of Daz has one body
        for all, and serves where there is no other.

    Raises
    ------
    CorpusError
        If there is none.
    """

    def __init__(self, corpus: Path) -> None:
        found = [
            path
            for path in find_motion_files(corpus, [".amc", ".bvh"])
            if CMU_NAME.fullmatch(path.stem)
        ]
        if not found:
            raise CorpusError(
                f"{corpus}: expected AMC or BVH files under CMU's names, such as 02_03.amc, but "
                "found none. Get them with: mocapdb fetch 02_03 07_01"
            )
        self._formats: dict[str, dict[str, Path]] = {"AMC": {}, "BVH": {}, DAZ: {}}
        for path in found:
            format_ = "AMC" if path.suffix.lower() == ".amc" else "BVH"
            if format_ == "BVH" and "daz" in path.parent.name.lower():
                format_ = DAZ
            self._formats[format_].setdefault(path.stem, path)
        self.find = cache(self._find)

    def of_kind(self, kind: str) -> tuple[str, list[Clip]]:
        """Return all clips of a kind in the format that has most of them, and its name."""
        names = _names_of(kind)
        most = max(self._formats, key=lambda f: len(names & self._formats[f].keys()))
        chosen = sorted(names & self._formats[most].keys())
        return most, [_read(self._formats[most][name]) for name in chosen]

    def _find(self, wanted: ThesisSet) -> Found:
        """Return the clips of a set: his, or a stand-in, or none."""
        named = _NAMED.get(wanted.name)
        if named in self._formats["AMC"]:
            clip = _read(self._formats["AMC"][named])
            if len(clip) == wanted.n_frames:
                return Found((clip,), f"{named}, which has his {wanted.n_frames} frames")
        best: tuple[str, list[str], int] | None = None
        counts = []
        for format_, paths in self._formats.items():
            if best is not None and format_ == DAZ:
                break
            names = sorted(_names_of(wanted.kind) & paths.keys())
            counts.append(len(names))
            if len(names) < wanted.n_clips:
                continue
            chosen, frames = _nearest(wanted, [(len(_read(paths[name])), name) for name in names])
            if best is None or _off(frames, wanted) < _off(best[2], wanted):
                best = format_, chosen, frames
            if _off(best[2], wanted) <= NEAR:
                break
        if best is None:
            return Found(
                (),
                f"cannot be computed: needs {wanted.n_clips} of CMU's clips of {wanted.kind}, "
                f"but {max(counts)} are at hand",
            )
        format_, chosen, frames = best
        clips = tuple(_read(self._formats[format_][name]) for name in chosen)
        listed = " + ".join(chosen) if len(chosen) < 9 else f"{len(chosen)} clips"
        if format_ != "AMC":
            listed += f" as {format_}"
        if frames == wanted.n_frames:
            return Found(clips, f"{listed}, found by the number of frames")
        how = "stand-in" if _off(frames, wanted) <= NEAR else "far stand-in"
        return Found(clips, f"{how}: {listed}, {frames} frames; he names no clips")


def _nearest(wanted: ThesisSet, lengths: list[tuple[int, str]]) -> tuple[list[str], int]:
    """Return the clips whose frames together are nearest to his.

    Of a few among a few every choice is looked at; else only clips of neighbouring lengths.
    """
    lengths = sorted(lengths)
    count = wanted.n_clips
    choices: Iterable[Sequence[tuple[int, str]]] = combinations(lengths, count)
    if comb(len(lengths), count) > MOST_CHOICES:
        choices = [lengths[i : i + count] for i in range(len(lengths) - count + 1)]
    chosen = min(choices, key=lambda own: abs(_frames(own) - wanted.n_frames))
    return sorted(name for _, name in chosen), _frames(chosen)


def _frames(chosen: Sequence[tuple[int, str]]) -> int:
    return sum(length for length, _ in chosen)


def _off(frames: int, wanted: ThesisSet) -> float:
    return abs(frames - wanted.n_frames) / wanted.n_frames


@cache
def _read(path: Path) -> Clip:
    return read_with_settings(path, drop_tpose=path.suffix.lower() == ".bvh")


@cache
def _names_of(kind: str) -> frozenset[str]:
    """Return the names of CMU's clips that show nothing but a kind, at the thesis's rate."""
    return frozenset(
        entry.clip
        for entry in read_manifest()
        if entry.fps == CMU_FPS and _KINDS[kind].search(entry.description.lower())
    )
