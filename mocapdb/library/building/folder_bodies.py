"""Unit and vertical axis of the clips of one skeleton in one folder, which agree on them.

A BVH states neither. A clip in which a body only lies or crawls tells them badly, but the walks
beside it tell them well.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Literal

import numpy as np

from mocapdb.io import read_clip
from mocapdb.io.bvh import SOURCES, read_bvh_skeleton
from mocapdb.io.reading import ReadOptions
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
    root: Path, wanted: Iterable[str], files: Sequence[tuple[str, ReadOptions]]
) -> dict[str, FolderBody]:
    """Return what the clips of each skeleton in each folder agree on, by file.

    Parameters
    ----------
    root : Path
        The corpus folder.
    wanted : iterable of str
        The files to be encoded, by their path from the root.
    files : sequence of (str, ReadOptions)
        All files of the corpus, by their path from the root, and how each is read.

    Returns
    -------
    dict
        Nothing of a file whose skeleton no other file of its folder has.

    Notes
    -----
    Of a skeleton some clips are read, evenly over the list. Skeletons are the same that have the
    same joints, channels and bones; offsets down to where the body forks tell where it stands.
    """
    wanted = {file for file in wanted if PurePosixPath(file).suffix.lower() == ".bvh"}
    folders = {PurePosixPath(file).parent for file in wanted}
    alike: dict[object, list[tuple[str, ReadOptions]]] = {}
    for file, reading in files:
        folder = PurePosixPath(file).parent
        stated = reading.unit_m is not None and reading.up is not None
        if stated or folder not in folders or PurePosixPath(file).suffix.lower() != ".bvh":
            continue
        try:
            bones = _bones(read_bvh_skeleton(root / file))
        except Exception:
            continue
        if bones is not None:
            alike.setdefault((folder, bones), []).append((file, reading))
    found: dict[str, FolderBody] = {}
    for own in alike.values():
        asked = wanted.intersection(file for file, _ in own)
        if len(own) < 2 or not asked:
            continue
        body = _body_of(root, own[:: -(-len(own) // SAMPLED_OF_A_SKELETON)])
        if body is not None:
            found |= dict.fromkeys(asked, body)
    return found


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


def _bones(skeleton: Skeleton) -> object | None:
    """Return what the same skeleton has in another file too; None where it has no bones.

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
        return None
    grid = 10.0 ** (np.floor(np.log10(lengths.max())) - 4)  # of the longest bone, in any unit
    told = (grid, *np.rint(lengths / grid).astype(int).tolist())
    return skeleton.names, tuple(skeleton.parents.tolist()), skeleton.dofs, told
