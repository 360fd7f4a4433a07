"""The clips of a file that Blender imports: each skeleton in each take.

Blender does what exporters disagree on (pivots, pre-rotations, orders of rotation, units, axes);
what comes here are the matrices of bones in the world, frame by frame.
"""

from __future__ import annotations

import mmap
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.base.files import expect_file
from mocapdb.errors import ClipError, FormatError, SkeletonError
from mocapdb.io.blender.fbx_header import FbxHeader, read_fbx_header, without_pictures
from mocapdb.io.blender.process import BlenderError, BlenderProcess, shared_blender
from mocapdb.io.blender.program import find_blender
from mocapdb.io.conventions import unique
from mocapdb.io.frame_rates import nearby_rate
from mocapdb.io.posed_clips import STILL_M, clip_of_pose
from mocapdb.io.tuning import BLENDER_S, BLENDER_S_PER_MB, SINGLE_PRECISION
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import Pose
from mocapdb.motion.skeleton import UpAxis

__all__ = ["SceneClip", "may_move", "read_scene", "read_scene_clip", "take_words", "time_limit"]

USD_RATE = re.compile(rb"^\s*timeCodesPerSecond\s*=\s*(\d+\.?\d*)\s*$", re.MULTILINE)
COLLADA_PICTURES = re.compile(rb"<library_images\b.*?</library_images>", re.DOTALL)
HEADING = 100_000  # bytes in which what is said of a whole file stands
ORTHOGONAL = 1e-5
STILL_TURN = 1e-4  # a leaf's rotation that differs from its parent's by less is none


class SceneClip(NamedTuple):
    """One skeleton in one take of a file.

    Attributes
    ----------
    key : str
        What tells it from the others of its file: the take, the skeleton, or both.
    clip : Clip
    """

    key: str
    clip: Clip


def may_move(path: StrPath) -> bool:
    """Tell whether a file says that it has a skeleton and an animation; True if only Blender knows.

    Also of a file that cannot be read: whoever reads it learns why.
    """
    told = {".fbx": ((b"LimbNode",), (b"AnimationCurve", b"KeyCount")),
            ".dae": ((b"JOINT",), (b"<animation",))}.get(Path(path).suffix.lower())  # fmt: skip
    if told is None:
        return True
    try:
        with (
            Path(path).open("rb") as file,
            mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as d,
        ):
            return all(any(d.find(word) >= 0 for word in words) for words in told)
    except (OSError, ValueError):
        return True


def take_words(keys: Sequence[str]) -> list[str]:
    """Return for the keys of a file's clips words of letters, digits and ``_``, all different.

    Examples
    --------
    >>> take_words(["Walk", "mixamo.com", "Take 1/Ann", "take 1/Ann"])
    ['Walk', 'mixamo_com', 'Take_1_Ann', 'take_1_Ann2']
    """
    words: list[str] = []
    for key in keys:
        word = re.sub(r"[^\w-]+", "_", key).strip("_") or "take"
        taken = {other.lower() for other in words}
        number, free = 1, word
        while free.lower() in taken:
            number += 1
            free = f"{word}{number}"
        words.append(free)
    return words


def time_limit(path: StrPath) -> float:
    """Return how many seconds Blender may take for a file."""
    return BLENDER_S + BLENDER_S_PER_MB * Path(path).stat().st_size / 1e6


def read_scene_clip(
    path: StrPath,
    *,
    take: str | None = None,
    fps: float | None = None,
    blender: StrPath | None = None,
) -> Clip:
    """Read one clip of a file.

    Parameters
    ----------
    path : path-like
    take : str, optional
        Its key (see `SceneClip`), in either case, or the word that it has in a library; by default
        the first that moves.
    fps, blender
        As in `read_scene`.

    Raises
    ------
    FormatError
        As `read_scene`, or if there is no such take.
    """
    clips = read_scene(path, fps=fps, blender=blender)
    keys = [repr(key) for key, _ in clips]
    if take is None:
        _, clip = clips[0]
        if len(clips) == 1:
            return clip
        step = f"warning: {keys[0]} is read, and {', '.join(keys[1:])} left out"
        return replace(clip, provenance=(*clip.provenance, step))
    words = take_words([key for key, _ in clips])
    for (key, clip), word in zip(clips, words, strict=True):
        if take.lower() in {key.lower(), word.lower()}:
            return clip
    raise FormatError(path, f"Expected a take out of {', '.join(keys)}, but got {take!r}.")


def read_scene(
    path: StrPath, *, fps: float | None = None, blender: StrPath | None = None
) -> list[SceneClip]:
    """Read the clips of a file.

    Parameters
    ----------
    path : path-like
        An FBX, Collada or USD file. It is not run, and the pictures that it names are not opened.
    fps : float, optional, frames per second
        At which takes are sampled. By default the rate of their keys, or the file's where keys are
        rarer. Of USD, how many of its time codes are a second: by default what a ``.usda`` says,
        else 24.
    blender : path-like, optional
        See `find_blender`.

    Raises
    ------
    FormatError
        If there is no Blender, it cannot read the file or takes too long, or the file holds no
        skeleton that moves.
    """
    try:
        expect_file(path)
        data = Path(path).read_bytes()
    except FileNotFoundError:
        raise FormatError(path, "Expected a motion file, but there is none.") from None
    except OSError as problem:
        raise FormatError(path, f"Expected a motion file, but cannot read it: {problem}.") from None
    process = shared_blender(find_blender(path, blender))
    suffix = Path(path).suffix.lower()
    is_fbx, is_usd = suffix == ".fbx", suffix.startswith(".usd")
    own_fps = _usd_rate(data) if is_usd else None
    told = {"scene_fps": fps or own_fps} if is_usd else {"fps": fps}  # frames of USD have no times
    try:
        answer, arrays = _imported(process, path, _cleaned(data, suffix), told)
    except BlenderError as problem:
        raise FormatError(path, str(problem)) from None
    if not answer["clips"]:
        raise FormatError(path, _what_is_missing(answer))
    header = read_fbx_header(data) if is_fbx else FbxHeader()
    stated = {".fbx": True, ".dae": None}.get(suffix, own_fps is not None)
    keys = _keys(answer["clips"])
    try:
        with np.errstate(all="ignore"):  # absurd numbers are told by the clip
            return [
                SceneClip(key, _clip(path, found, arrays, number, header, fps, stated))
                for number, (key, found) in enumerate(zip(keys, answer["clips"], strict=True))
            ]
    except (ClipError, SkeletonError, np.linalg.LinAlgError) as problem:
        raise FormatError(path, str(problem)) from None


def _cleaned(data: bytes, suffix: str) -> bytes | None:
    """Return a file without the pictures that it names; None if it names none."""
    if suffix == ".fbx":
        return without_pictures(data)
    cleaned, count = COLLADA_PICTURES.subn(b"", data) if suffix == ".dae" else (data, 0)
    return cleaned if count else None


def _imported(
    process: BlenderProcess, path: StrPath, cleaned: bytes | None, told: Mapping[str, float | None]
) -> tuple[dict[str, Any], dict[str, FloatArray]]:
    """Return what Blender found in a file."""
    taken = Path(path).absolute()
    arrays = process.folder / "read.npz"
    copy = None
    if cleaned is not None:
        copy = taken = process.folder / f"read{Path(path).suffix}"
        copy.write_bytes(cleaned)
    try:
        request = {"do": "read", "path": str(taken), "out": str(arrays), **told}
        answer = process.ask(request, time_limit(path))
        with np.load(arrays, allow_pickle=False) as file:
            return answer, {name: file[name] for name in file.files}
    finally:
        for file in (arrays, copy):
            if file is not None:
                file.unlink(missing_ok=True)


def _usd_rate(data: bytes) -> float | None:
    """Return the rate that a USD states as text; a packed one may have any."""
    found = USD_RATE.search(data[:HEADING]) if data.startswith(b"#usda") else None
    return float(found[1]) if found and float(found[1]) > 0 else None


def _what_is_missing(answer: Mapping[str, Any]) -> str:
    if answer["skeletons"]:
        names = ", ".join(map(repr, answer["skeletons"]))
        return f"Expected an animation, but the skeleton {names} only stands in its pose."
    held = [f"{count} {kind}" for kind, count in answer["objects"].items()]
    return f"Expected a skeleton, but the file holds {', '.join(held) or 'nothing'}."


def _keys(clips: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return what tells clips from each other."""
    takes, skeletons = ({clip[what] for clip in clips} for what in ("take", "skeleton"))
    if len(skeletons) == 1:
        return [clip["take"] for clip in clips]
    if len(takes) == 1:
        return [clip["skeleton"] for clip in clips]
    return [f"{clip['take']}/{clip['skeleton']}" for clip in clips]


def _clip(
    path: StrPath,
    told: Mapping[str, Any],
    arrays: Mapping[str, FloatArray],
    number: int,
    header: FbxHeader,
    fps: float | None,
    stated: bool | None,
) -> Clip:
    """Return the clip of one skeleton in one take, in the file's unit and with its axis up.

    `stated` tells whether the file states its rate; None where only its keys may.
    """
    rest, worlds = (arrays[f"{name}_{number}"].astype(np.float64) for name in ("rest", "worlds"))
    names, parents = list(told["names"]), list(told["parents"])
    if parents.count(-1) > 1:  # what several roots hang on is a joint, too
        names = [unique(told["skeleton"], names), *names]
        parents = [-1, *(parent + 1 for parent in parents)]
        objects = arrays[f"objects_{number}"].astype(np.float64)
        worlds = np.concatenate([objects[:, None], worlds], axis=1)
        rest = np.concatenate([arrays[f"object_{number}"][None], rest])
    unit_m = header.unit_m or 1.0
    up: UpAxis = "z" if header.up == "z" else "y"
    turns = _rotations(worlds[..., :3, :3]) @ np.swapaxes(_rotations(rest[:, :3, :3]), -1, -2)
    places, stands = worlds[..., :3, 3] / unit_m, rest[:, :3, 3] / unit_m
    if up == "y":  # Blender's world has z up
        to_y = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
        places, stands, turns = places @ to_y.T, stands @ to_y.T, to_y @ turns @ to_y.T
    flat = [0, 2] if up == "y" else [0, 1]
    start = stands[0].copy()
    stands[:, flat] -= start[flat]
    leaves = set(range(len(names))) - set(parents)
    ends = {
        leaf
        for leaf in leaves
        if leaf
        and names[leaf].startswith(f"{names[parents[leaf]]}_End")
        and np.abs(turns[:, leaf] - turns[:, parents[leaf]]).max() < STILL_TURN
    }
    is_told = told["keyed"] if stated is None else stated
    furthest = float(np.abs(places).max(initial=0.0))
    rate = fps or nearby_rate(told["fps"])
    return clip_of_pose(
        names,
        parents,
        stands,
        Pose(places, turns),
        rate,
        unit_m=unit_m,
        up=up,
        ends=ends,
        still=max(STILL_M / unit_m, SINGLE_PRECISION * furthest),
        name=Path(path).stem,
        source=str(path),
        fps_source="caller" if fps else "file" if is_told else "default",
        provenance=(f"imported by Blender {told['version']}",) if "version" in told else (),
    )


def _rotations(matrices: FloatArray) -> FloatArray:
    """Return the nearest rotations (..., 3, 3) of matrices that scale, mirror or shear, too."""
    lengths = np.linalg.norm(matrices, axis=-2, keepdims=True)
    turns = matrices / np.where(lengths > 0, lengths, 1.0)
    squares = np.swapaxes(turns, -1, -2) @ turns
    odd = np.abs(squares - np.eye(3)).max(axis=(-1, -2)) > ORTHOGONAL
    odd |= np.linalg.det(turns) < 0
    if odd.any():
        u, _, v = np.linalg.svd(matrices[odd])
        u[..., 2] *= np.linalg.det(u @ v)[..., None]
        turns[odd] = u @ v
    return turns
