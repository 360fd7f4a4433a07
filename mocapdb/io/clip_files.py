"""Reading and writing clips, the format chosen by the file's suffix."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast, get_args

import numpy as np

from mocapdb.base.arrays import StrPath
from mocapdb.errors import FormatError, SkeletonError
from mocapdb.io.find_files import (
    DRAWN_SUFFIXES,
    GLTF_SUFFIXES,
    READ_SUFFIXES,
    SCENE_SUFFIXES,
    WRITE_SUFFIXES,
)
from mocapdb.io.reading import ReadOptions
from mocapdb.io.tuning import LARGEST_NUMBER, LEAST_STRETCH_M
from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import Skeleton, UpAxis, UpDirection

if TYPE_CHECKING:
    from mocapdb.io.asf import AcclaimSkeleton

__all__ = ["acclaim_rate", "find_skeleton", "read_clip", "read_takes", "write_clip"]

SUBJECT = re.compile(r"[a-z]*\d+(?!\d)")  # "07" of "07_05-walk", "s12" of "s12-run"
RANGE_OF_ERROR = 4 * 3**0.5  # a joint and its parent, either way, along three axes
# what tells an archive of others: SMPL's family, or plain arrays
PLAIN_KEYS = ("poses", "pose_body", "trans", "betas", "quaternions")
CONVERTED_DECIMALS = 8  # 1e-8 degrees move nothing by more than some 1e-9 m


def read_clip(
    path: StrPath,
    options: ReadOptions | None = None,
    *,
    skeleton: Skeleton | StrPath | None = None,
    fps: float | None = None,
    drop_tpose: bool = False,
    metres_per_unit: float | None = None,
    up: UpDirection | None = None,
    joint_map: Mapping[str, str] | None = None,
    strict: bool = False,
) -> Clip:
    """Read a clip from an AMC, BVH, NPZ (AMASS's too) or glTF file, or by way of Blender.

    Parameters
    ----------
    path : path-like
        The file; its suffix decides, in either case.
    options : ReadOptions, optional
        What is known of the file; each of what follows wins over it.
    skeleton : Skeleton or path-like, optional
        For an AMC, its skeleton or the ASF that holds it; `find_skeleton` looks for it otherwise.
        For AMASS, the body model file whose bones are taken; a generic adult's otherwise.
    fps : float, optional, frames per second
        Overrides the file's frame rate, and 120 for an AMC; of glTF, how often it is sampled.
    drop_tpose : bool
        Whether to look for a T-pose in front of the motion, and to leave it out.
    metres_per_unit : float, optional
        Overrides the length of the file's unit in metres.
    up : {"y", "z", "x", "-x", "-y", "-z"}, optional
        Overrides the direction that is up in the file; if it is not y or z, the clip is turned so
        that y is up. AMASS's files are always turned so.
    joint_map : mapping of str to str, optional
        Joints of the skeleton by the names of canonical joints, where they would be found wrongly.
    strict : bool
        Whether to refuse what would have to be mended. By default it is, and the clip's provenance
        says so in steps that start with ``mended:``.

    Raises
    ------
    FormatError
        If the file breaks its format, with the line to blame, or a joint map does not fit.
    ClipError
        If a unit or a rate is no positive number.

    Notes
    -----
    A body that has another stature than 0.5 to 2.5 m in units of that length is read all the
    same; a step of the provenance that starts with ``warning:`` says so.
    """
    said = ReadOptions(
        metres_per_unit, up, fps, skeleton=skeleton, joint_map=joint_map, strict=strict
    ).over(options or ReadOptions())
    turned_from = _turned_from(said)
    if turned_from is not None:
        said = replace(said, up="y")
    try:
        arrays = _plain_arrays(path)
        if arrays is not None and "quaternions" not in arrays:
            clip = _read_smpl(path, arrays, said)
            said = replace(said, up=None, skeleton=None)  # it has its own idea of what is up
        else:
            clip = _read(path, said, arrays)
        clip = _as_said(path, clip, said, turned_from)
    except SkeletonError as problem:
        raise FormatError(path, str(problem)) from None
    if drop_tpose:
        from mocapdb.io.tpose import without_tpose

        clip = without_tpose(clip)
    return clip


def read_takes(path: StrPath, options: ReadOptions | None = None) -> list[tuple[str, Clip]]:
    """Read every clip of a file, each with the name of its take, a word.

    A file of a format without takes, or of which one take is asked for, is read as by `read_clip`,
    and its take has no name.

    Raises
    ------
    FormatError
        As `read_clip`.
    """
    said = options or ReadOptions()
    if Path(path).suffix.lower() not in SCENE_SUFFIXES or said.take is not None:
        return [("", read_clip(path, said))]
    from mocapdb.io.blender.scenes import read_scene, take_words

    if said.skeleton is not None:
        raise FormatError(path, "Expected no skeleton: this format has its own. Leave it out.")
    turned_from = _turned_from(said)
    if turned_from is not None:
        said = replace(said, up="y")
    clips = read_scene(path, fps=said.fps, blender=said.blender)
    words = take_words([key for key, _ in clips])
    try:
        return [
            (word, _as_said(path, clip, said, turned_from))
            for word, (_, clip) in zip(words, clips, strict=True)
        ]
    except SkeletonError as problem:
        raise FormatError(path, str(problem)) from None


def _turned_from(said: ReadOptions) -> UpDirection | None:
    """Return the direction that is up where it is none that a skeleton may have."""
    return said.up if said.up not in (None, *get_args(UpAxis)) else None


def _as_said(path: StrPath, clip: Clip, said: ReadOptions, turned_from: UpDirection | None) -> Clip:
    """Return a clip with what is said of it."""
    clip = _understood(_of_this_world(path, clip), said)
    if turned_from is None:
        return clip
    from mocapdb.io.conventions import turned_to_y_up

    return turned_to_y_up(clip, turned_from)


def _plain_arrays(path: StrPath) -> dict[str, Any] | None:
    """Return the arrays of an NPZ that others made; None where the file is something else."""
    if Path(path).suffix.lower() != ".npz":
        return None
    from mocapdb.io.npz import arrays_of

    return arrays_of(path, PLAIN_KEYS)


def _read_smpl(path: StrPath, arrays: Mapping[str, Any], said: ReadOptions) -> Clip:
    """Read a clip of SMPL's family."""
    from mocapdb.io.amass import clip_of_smpl

    if isinstance(said.skeleton, Skeleton):
        raise FormatError(path, "Expected a body model file, but got a skeleton.")
    return clip_of_smpl(path, arrays, fps=said.fps, body_model=said.skeleton, up=said.up)


def _read(path: StrPath, said: ReadOptions, arrays: Mapping[str, Any] | None) -> Clip:
    """Read a clip of any other format."""
    suffix = Path(path).suffix.lower()
    if suffix == ".amc" and said.take is None:
        return _read_acclaim(path, said.skeleton, said.fps, said.strict)
    if suffix not in READ_SUFFIXES:
        raise _unknown_suffix(path)
    if said.skeleton is not None:
        raise FormatError(path, "Expected no skeleton: this format has its own. Leave it out.")
    if said.take is not None and suffix not in (*GLTF_SUFFIXES, *SCENE_SUFFIXES):
        raise FormatError(path, "Expected no take: this format has one motion. Leave it out.")
    if suffix == ".bvh":
        from mocapdb.io.bvh import read_bvh

        return read_bvh(
            path,
            fps=said.fps,
            metres_per_unit=said.unit_m,
            up=cast(UpAxis | None, said.up),
            joint_map=said.joint_map,
            strict=said.strict,
        )
    if suffix in GLTF_SUFFIXES:
        from mocapdb.io.gltf_reading import read_gltf

        return read_gltf(path, fps=said.fps, take=said.take)
    if suffix in SCENE_SUFFIXES:
        from mocapdb.io.blender.scenes import read_scene_clip

        return read_scene_clip(path, take=said.take, fps=said.fps, blender=said.blender)
    if arrays is not None:
        from mocapdb.io.plain_arrays import clip_of_arrays

        return clip_of_arrays(path, arrays, fps=said.fps)
    from mocapdb.io.npz import read_npz

    clip = read_npz(path)
    return clip if said.fps is None else clip.replace(fps=said.fps)


def _of_this_world(path: StrPath, clip: Clip) -> Clip:
    """Return a clip if its numbers can be a capture's.

    Raises
    ------
    FormatError
        If one is so large that its square would soon be too large to count with.
    """
    skeleton = clip.skeleton
    limits = np.abs(clip.channels).max(axis=0, initial=0.0)
    if limits.max(initial=0.0) > LARGEST_NUMBER:
        channel = int(limits.argmax())
        frame = int(np.abs(clip.channels[:, channel]).argmax())
        where = f"in {skeleton.channel_names[channel]} of frame {frame}"
        raise FormatError(path, _too_large(float(limits[channel]), where))
    lengths = np.abs(skeleton.offsets).max(axis=1)
    if lengths.max() > LARGEST_NUMBER:
        joint = int(lengths.argmax())
        where = f"in the offset of {skeleton.names[joint]!r}"
        raise FormatError(path, _too_large(float(lengths[joint]), where))
    return clip


def _too_large(number: float, where: str) -> str:
    return f"Expected numbers up to {LARGEST_NUMBER:g}, but got {number:.3g} {where}."


def find_skeleton(path: StrPath, listed: dict[Path, list[Path]] | None = None) -> Path:
    """Find the ASF that belongs to an AMC.

    It is looked for in the clip's folder, then in the folder above, then in the folders beside the
    clip's. Of a folder it is the only one, or else the one whose stem starts the clip's
    (``HDM_bd.asf`` for ``HDM_bd_squat_120.amc``), the longest such stem, or the one that starts
    with the same number (``07-walk.asf`` for ``07_05-walk.amc``). Of the folders beside, a single
    ASF counts only if it fits so too.

    Parameters
    ----------
    path : path-like
    listed : dict, optional
        The skeletons of folders that were looked into; what is new is added. Else each call looks.

    Raises
    ------
    FormatError
        If there is none, or no single one.
    """
    clip = Path(path)
    folders = (clip.parent, clip.absolute().parent.parent)
    listed = {} if listed is None else listed
    for folder in folders:
        found = _skeletons_in(folder, listed)
        if len(found) == 1:
            return found[0]
        if found:
            return _only(path, _fitting(clip, found), found, str(folder))
    beside = [asf for folder in _folders_beside(clip) for asf in _skeletons_in(folder, listed)]
    if beside:
        return _only(path, _fitting(clip, beside), beside, f"the folders beside {folders[0]}")
    raise FormatError(
        path,
        f"Expected an .asf in {folders[0]} or {folders[1]}, but there is none. Pass a skeleton.",
    )


def _fitting(clip: Path, skeletons: list[Path]) -> list[Path]:
    """Return the skeletons whose names say that they belong to a clip: the longest stem's."""
    stem = clip.stem.lower()
    starting = [asf for asf in skeletons if _starts(stem, asf.stem.lower())]
    longest = max((len(asf.stem) for asf in starting), default=0)
    if starting:
        return [asf for asf in starting if len(asf.stem) == longest]
    subject = SUBJECT.match(stem)
    return [
        asf
        for asf in skeletons
        if subject and (own := SUBJECT.match(asf.stem.lower())) and own[0] == subject[0]
    ]


def _starts(stem: str, start: str) -> bool:
    """Tell whether a name starts so, without cutting a number in two."""
    cut = start[-1:].isdigit() and stem[len(start) : len(start) + 1].isdigit()
    return stem.startswith(start) and not cut


def _only(path: StrPath, fitting: list[Path], found: list[Path], where: str) -> Path:
    if len(fitting) == 1:
        return fitting[0]
    raise FormatError(
        path,
        f"Expected one .asf in {where} whose name starts the clip's, but {len(fitting)} of "
        f"{len(found)} do. Pass a skeleton.",
    )


def _folders_beside(clip: Path) -> list[Path]:
    """Return the folders beside the clip's, such as ``asf`` beside ``amc``."""
    own = clip.absolute().parent
    try:
        return sorted(
            folder for folder in own.parent.iterdir() if folder.is_dir() and folder != own
        )
    except OSError:  # a folder that cannot be listed has no skeleton to offer
        return []


def write_clip(
    clip: Clip, path: StrPath, *, error_m: float = 0.0, blender: StrPath | None = None
) -> Clip:
    """Write a clip as AMC, BVH, NPZ, CSV or FBX, converted to the format's convention if need be.

    What was read from the same convention is written so that reading it gives the same doubles;
    what has to be converted is rounded to 8 decimals. An AMC gets its skeleton beside it, as an
    ``.asf`` of the same stem. Files appear whole or not at all.

    Parameters
    ----------
    clip : Clip
        Any clip.
    path : path-like
        The file; its suffix decides, in either case.
    error_m : float, metres
        How far joints may be off already: a joint that moves on its bone by no more than this
        could make of a still one is taken as still.
    blender : path-like, optional
        What writes an FBX: see `mocapdb.io.blender`.

    Returns
    -------
    Clip
        As it was written: its provenance says what was converted.

    Raises
    ------
    FormatError
        If the suffix is none of the formats (`mocapdb.write_clip` writes ``.glb`` and animated
        pictures as well), or the file cannot be written.
    SkeletonError
        If the format cannot hold the skeleton.
    """
    suffix = Path(path).suffix.lower()
    if suffix == ".amc":
        return _write_acclaim(clip, Path(path), error_m)
    if suffix == ".bvh":
        from mocapdb.io.bvh import write_bvh
        from mocapdb.io.conventions import to_bvh_convention

        converted = to_bvh_convention(clip)
        write_bvh(converted, path, decimals=None if converted is clip else CONVERTED_DECIMALS)
        return converted
    if suffix == ".npz":
        from mocapdb.io.npz import write_npz

        write_npz(clip, path)
        return clip
    if suffix == ".csv":
        from mocapdb.io.csv_tables import write_csv

        write_csv(clip, path)
        return clip
    if suffix == ".fbx":
        from mocapdb.io.blender.fbx_writing import write_fbx

        return write_fbx(clip, path, blender=blender)
    if suffix in DRAWN_SUFFIXES:
        raise FormatError(
            path,
            f"Expected a suffix out of {', '.join(WRITE_SUFFIXES)}. A {suffix} is written by "
            "mocapdb.write_clip, or mocapdb.scenes.write_animation.",
        )
    raise _unknown_suffix(path, (*WRITE_SUFFIXES, *DRAWN_SUFFIXES))


def _write_acclaim(clip: Clip, path: Path, error_m: float) -> Clip:
    """Write an AMC and its ASF, both or none; return the clip as it was written."""
    from mocapdb.base.files import replacing
    from mocapdb.io._asf_text import asf_text
    from mocapdb.io.amc import amc_text
    from mocapdb.io.conventions import to_acclaim_convention

    clip = to_acclaim_convention(clip, still_m=max(LEAST_STRETCH_M, RANGE_OF_ERROR * error_m))
    with replacing(path, path.with_suffix(".asf")) as (motion, skeleton):
        motion.write_text(amc_text(clip), encoding="utf-8", newline="\n")
        skeleton.write_text(asf_text(clip.skeleton), encoding="utf-8", newline="\n")
    return clip


def _skeletons_in(folder: Path, listed: dict[Path, list[Path]]) -> list[Path]:
    if folder not in listed:
        try:
            found = sorted(file for file in folder.iterdir() if file.suffix.lower() == ".asf")
        except OSError:  # a folder that cannot be listed has no skeleton to offer
            found = []
        listed[folder] = found
    return listed[folder]


def _read_acclaim(
    path: StrPath, skeleton: Skeleton | StrPath | None, fps: float | None, strict: bool
) -> Clip:
    """Read an AMC with the skeleton that was given, or with the one that belongs to it."""
    from mocapdb.io.amc import DEFAULT_FPS, read_amc

    taken: tuple[str, ...] = ()
    if skeleton is None:
        if not Path(path).is_file():
            raise FormatError(path, "Expected a motion file, but there is none.")
        skeleton = find_skeleton(path)
        if skeleton.absolute().parent != Path(path).absolute().parent:
            taken = (f"skeleton of {skeleton.absolute().parent.name}/{skeleton.name}",)
    if isinstance(skeleton, Skeleton):
        clip = read_amc(path, skeleton, fps=fps, strict=strict)
        return replace(clip, unit_source="caller", up_source="caller")
    file = _read_asf_once(skeleton, strict)
    rate = file.fps or DEFAULT_FPS
    clip = read_amc(path, file.skeleton, fps=fps, default_fps=rate, strict=strict)
    if file.fps and clip.fps_source == "default":
        clip = replace(clip, fps_source="file")
    if not file.states_unit:
        clip = replace(clip, unit_source="default")
    return replace(clip, provenance=(*clip.provenance, *taken, *file.notes))


def acclaim_rate(path: StrPath, skeleton: Skeleton | StrPath | None) -> tuple[float, str]:
    """Return the frame rate of an AMC by itself or its ASF, and who states it.

    Raises
    ------
    FormatError
        If one of the files breaks its format.
    """
    from mocapdb.io.amc import DEFAULT_FPS, read_amc_rate

    rate = read_amc_rate(path)
    if rate is None and skeleton is not None and not isinstance(skeleton, Skeleton):
        rate = _read_asf_once(skeleton, strict=False).fps
    return (DEFAULT_FPS, "default") if rate is None else (rate, "file")


def _read_asf_once(path: StrPath, strict: bool) -> AcclaimSkeleton:
    """Read a skeleton, or take it from the last ones if its file has not changed."""
    try:
        state = Path(path).stat()
    except OSError:
        return _cached_asf(str(path), 0, 0, strict)
    return _cached_asf(str(path), state.st_mtime_ns, state.st_size, strict)


@lru_cache(maxsize=256)
def _cached_asf(path: str, changed_ns: int, size: int, strict: bool) -> AcclaimSkeleton:
    from mocapdb.io.asf import read_asf_file

    return read_asf_file(path, strict=strict)


def _understood(clip: Clip, said: ReadOptions) -> Clip:
    """Return the clip with unit, axis and joints as they are said, and a warning if need be.

    Raises
    ------
    SkeletonError
        If the joint map does not fit.
    """
    skeleton = clip.skeleton
    if said.unit_m is not None:
        skeleton = replace(skeleton, metres_per_unit=said.unit_m)
        clip = replace(clip, unit_source="caller", provenance=_without(clip, "unit "))
    if said.up is not None:
        skeleton = replace(skeleton, up=cast(UpAxis, said.up))
        clip = replace(clip, up_source="caller", provenance=_without(clip, "up axis "))
    if said.joint_map:
        skeleton = replace(skeleton, joint_map=said.joint_map)
    if skeleton is not clip.skeleton:
        clip = replace(clip, skeleton=skeleton)
    below_scene = len(skeleton.children[0]) == 1 and not skeleton.body_root
    if said.unit_m is None and not said.joint_map and not below_scene:
        return clip
    from mocapdb.motion.body import Given, understand

    body = understand(skeleton, clip.channels, Given(unit_m=skeleton.metres_per_unit))
    if body.root.value != skeleton.body_root:
        skeleton = replace(skeleton, body_root=body.root.value)
        clip = replace(clip, skeleton=skeleton)
    if said.unit_m is None or not body.odd_stature:
        return clip
    return replace(clip, provenance=(*clip.provenance, f"warning: {body.odd_stature}"))


def _without(clip: Clip, start: str) -> tuple[str, ...]:
    """Return the steps of a clip's provenance but for those that start so."""
    return tuple(step for step in clip.provenance if not step.startswith(start))


def _unknown_suffix(path: StrPath, known: tuple[str, ...] = READ_SUFFIXES) -> FormatError:
    suffix = Path(path).suffix
    only = (*WRITE_SUFFIXES, *DRAWN_SUFFIXES) if known == READ_SUFFIXES else ()
    hint = f" A {suffix} is written only." if suffix.lower() in only else ""
    return FormatError(
        path, f"Expected a suffix out of {', '.join(known)}, but got {suffix!r}.{hint}"
    )
