"""Unit and vertical axis of the clips of one skeleton in one folder, which agree on them.

A BVH states neither. A clip in which a body only lies or crawls tells them badly, but the walks
beside it tell them well.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Literal

import numpy as np

from mocapdb.base.workers import on_workers
from mocapdb.io import read_clip
from mocapdb.io.bvh import SOURCES, read_bvh_skeleton
from mocapdb.io.reading import ReadOptions
from mocapdb.library.naming import suffix_of
from mocapdb.library.tuning import SAMPLED_OF_A_SKELETON
from mocapdb.motion.body import understand
from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import Skeleton

__all__ = ["FolderBody", "as_in_folder", "bodies_of_folders"]


@dataclass(frozen=True)
class FolderBody:
    """What the clips of a skeleton in a folder say together.

    Attributes
    ----------
    unit_m : float, metres
    up : {"y", "z"}
    root : str
        The joint that carries the body.
    n_clips : int
        How many clips were asked.
    unit_source, up_source : str
        ``"inferred"``, or ``"default"`` where they do not tell either.
    """

    unit_m: float
    up: Literal["y", "z"]
    root: str
    n_clips: int
    unit_source: str = "inferred"
    up_source: str = "inferred"


def bodies_of_folders(
    root: Path,
    wanted: Iterable[str],
    files: Sequence[tuple[str, ReadOptions]],
    known: Mapping[str, str] = MappingProxyType({}),
    *,
    jobs: int | None = 1,
    scheduler: str | None = None,
) -> tuple[dict[str, FolderBody], dict[str, str]]:
    """Return what the clips of each skeleton in each folder agree on, by file.

    Parameters
    ----------
    root : Path
        The corpus folder.
    wanted : iterable of str
        The files to be encoded, by their path from the root.
    files : sequence of (str, ReadOptions)
        All files of the corpus, by their path from the root, and how each is read.
    known : mapping of str to str
        Digests of the bones of files that are not to be encoded, from an earlier time.
    jobs, scheduler
        Who reads the clips, where there are several skeletons: see `on_workers`. This process by
        default.

    Returns
    -------
    bodies : dict of str to FolderBody
        Nothing of a file whose skeleton no other file of its folder has.
    bones : dict of str to str
        Digests of the bones of the files that were looked into; empty where there are none.

    Notes
    -----
    Of a skeleton some clips are read, evenly over the list. Skeletons are the same that have the
    same joints, channels and bones; offsets down to where the body forks tell where it stands.
    """
    wanted = {file for file in wanted if suffix_of(file) == ".bvh"}
    folders = {file.rpartition("/")[0] for file in wanted}
    alike: dict[tuple[str, str], list[tuple[str, ReadOptions]]] = {}
    looked: dict[str, str] = {}
    for file, reading in files:
        folder = file.rpartition("/")[0]
        stated = reading.unit_m is not None and reading.up is not None
        if stated or folder not in folders or suffix_of(file) != ".bvh":
            continue
        bones = None if file in wanted else known.get(file)
        if bones is None:
            try:
                bones = looked[file] = _bones(read_bvh_skeleton(root / file))
            except Exception:
                continue
        if bones:
            alike.setdefault((folder, bones), []).append((file, reading))
    asked_of: list[set[str]] = []
    samples: list[tuple[Path, list[tuple[str, ReadOptions]]]] = []
    for own in alike.values():
        asked = wanted.intersection(file for file, _ in own)
        if len(own) >= 2 and asked:
            asked_of.append(asked)
            samples.append((root, own[:: -(-len(own) // SAMPLED_OF_A_SKELETON)]))
    if len(samples) < 2:
        jobs, scheduler = 1, None
    seen = [root / sample[0][0] for _, sample in samples[:1]]
    found: dict[str, FolderBody] = {}
    with closing(
        on_workers(_body_of, samples, jobs=jobs, scheduler=scheduler, seen=seen)
    ) as bodies:
        for asked, body in zip(asked_of, bodies, strict=True):
            if body is not None:
                found |= dict.fromkeys(asked, body)
    return found, looked


def as_in_folder(clip: Clip, body: FolderBody) -> Clip:
    """Return a clip with the folder's unit and axis where nobody stated its own."""
    skeleton, steps = clip.skeleton, []
    others = f"as of {body.n_clips} clips of its skeleton in its folder"
    if clip.up_source in {"inferred", "default"}:
        if skeleton.up != body.up:
            skeleton = replace(skeleton, up=body.up)
            clip = replace(clip, up_source=body.up_source)
            steps.append(f"up axis {body.up} instead, {others}")
        elif clip.up_source == "default" and body.up_source == "inferred":
            clip = replace(clip, up_source="inferred")
            steps.append(f"up axis {body.up}, {others}")
        if body.up_source == "inferred":
            clip = replace(clip, provenance=_without(clip, "up axis "))
    if skeleton.metres_per_unit != body.unit_m and clip.unit_source in {"inferred", "default"}:
        skeleton = replace(skeleton, metres_per_unit=body.unit_m)
        provenance = _without(clip, "the body is ")
        clip = replace(clip, unit_source=body.unit_source, provenance=provenance)
        steps.append(f"unit of {body.unit_m:g} m instead, {others}")
    root = skeleton.names.index(body.root)
    if skeleton.body_root != root:
        skeleton = replace(skeleton, body_root=root)
        steps.append(f"{body.root!r} carries the body, {others}")
    if not steps:
        return clip
    return replace(clip, skeleton=skeleton, provenance=(*clip.provenance, *steps))


def _without(clip: Clip, start: str) -> tuple[str, ...]:
    """Return the steps of a clip's provenance without warnings that start so."""
    return tuple(step for step in clip.provenance if not step.startswith(f"warning: {start}"))


def _body_of(root: Path, sample: Sequence[tuple[str, ReadOptions]]) -> FolderBody | None:
    """Return what some clips of a skeleton say together; None if fewer than two can be read."""
    clips = list(_read(root, sample))
    if len(clips) < 2:
        return None
    body = understand(clips[0].skeleton, [clip.channels for clip in clips])
    carrier = clips[0].skeleton.names[body.root.value]
    return FolderBody(
        body.unit_m.value,
        body.up.value,
        carrier,
        len(clips),
        unit_source=SOURCES[body.unit_m.source],
        up_source=SOURCES[body.up.source],
    )


def _read(root: Path, sample: Sequence[tuple[str, ReadOptions]]) -> Iterator[Clip]:
    for file, reading in sample:
        try:
            clip = read_clip(root / file, reading)
        except Exception:
            continue
        if np.isfinite(clip.channels).all():
            yield clip


def _bones(skeleton: Skeleton) -> str:
    """Return a digest of what the same skeleton has in another file too; empty without bones.

    Offsets that are all zero tell no skeleton from another: positions replace them.
    """
    fork = 0
    while len(skeleton.children[fork]) == 1:
        fork = skeleton.children[fork][0]
    above = [0, *skeleton.chain_to_root(fork)]
    with np.errstate(over="ignore"):  # such a file is refused when it is read
        lengths = np.linalg.norm(skeleton.offsets, axis=1)
    lengths[above] = 0.0
    if not 0 < lengths.max() < math.inf:
        return ""
    power = math.floor(math.log10(lengths.max())) - 4  # of the longest bone, in any unit
    told = [power, *np.rint(lengths / 10.0**power).astype(int).tolist()]
    content = [skeleton.names, skeleton.parents.tolist(), skeleton.dofs, told]
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()[:32]
