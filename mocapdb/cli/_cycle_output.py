"""Loops as files: in every format that ``mocapdb export`` writes, named where there are more."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict, cast

import click

from mocapdb.cli._options import EVENTS, check_representation_file

if TYPE_CHECKING:
    from mocapdb.base.arrays import StrPath
    from mocapdb.cycles import Cycle, Loop
    from mocapdb.cycles.cycle import RootMotion
    from mocapdb.cycles.synthesis.blending import Transition
    from mocapdb.cycles.synthesis.loop_start import Start
    from mocapdb.motion.body import Scene
    from mocapdb.motion.representations import RepresentationName

__all__ = ["FORMATS", "LoopFiles", "LoopOptions", "written_loop"]

FORMATS = ("bvh", "amc", "npz", "glb", "fbx", "gif", "mp4", "html")
ROOT_BONE_SUFFIX = ".glb"


class LoopOptions(TypedDict):
    """What `make_loop` is told, but for the cycle, and where its loop starts."""

    fps: float | None
    n_laps: int
    root: RootMotion
    hold_feet: bool
    start: Start
    lap_frames: int | None
    closed: bool
    animate: tuple[str, ...] | None


@dataclass(frozen=True)
class LoopFiles:
    """Where loops are written, and as what.

    Attributes
    ----------
    output : Path, optional
        A file; where there are several loops ``loop.bvh`` becomes ``loop_1.bvh`` and so on, and a
        name without a suffix is a folder.
    in_place : bool
        Whether loops stay in place. In a ``.glb`` those that do not have their root motion on a
        bone of its own.
    format : str
        Suffix of the files in a folder.
    representation : str, optional
        Which of O'Kane's representations is written.
    blender : path-like, optional
        What writes an FBX.
    """

    output: Path | None
    in_place: bool
    format: str = "bvh"
    representation: str | None = None
    blender: StrPath | None = None
    _taken: set[str] = field(default_factory=set)

    @property
    def is_folder(self) -> bool:
        """Whether the output is a folder."""
        return self.output is not None and (self.output.is_dir() or not self.output.suffix)

    def check(self, *, many: bool) -> None:
        """Refuse an output that cannot be written, as wrong usage, before anything is searched."""
        if self.output is None:
            return
        if self.is_folder and not many:
            raise click.UsageError(
                f"Expected a file for one loop ({', '.join(FORMATS)}), but got {self.output}."
            )
        suffix = f".{self.format}" if self.is_folder else self.output.suffix
        if self.representation is not None:
            check_representation_file(Path(f"loop{suffix}"), self.representation)
        elif suffix.lower().removeprefix(".") not in FORMATS:
            raise click.UsageError(
                f"Expected a loop as one of {', '.join(FORMATS)}, but got {suffix!r}."
            )

    @property
    def root(self) -> RootMotion:
        """What the clips of loops have of the root's way; a bone of its own may have the rest."""
        return "in-place" if self.in_place or self._has_root_bone else "advance"

    @property
    def _has_root_bone(self) -> bool:
        if self.output is None or self.in_place or self.representation is not None:
            return False
        suffix = f".{self.format}" if self.is_folder else self.output.suffix
        return suffix.lower() == ROOT_BONE_SUFFIX

    def path(self, clip: str = "", number: str = "") -> Path | None:
        """Return the file of the loop of a clip, or of its part of that number.

        Both are empty where there is one loop only.
        """
        if self.output is None or not (clip or number):
            return self.output
        words = [word for word in (clip, number) if word]
        name = "_".join(words if self.is_folder else [self.output.stem, *words])
        name = as_file_name(name, self._taken)
        if self.is_folder:
            return self.output / f"{name}.{self.format}"
        return self.output.with_name(f"{name}{self.output.suffix}")

    def write(self, loop: Loop | Transition, path: Path | None) -> None:
        """Write a loop, or a transition, that was made with `root`."""
        if path is None:
            return
        from mocapdb.base.files import make_folder

        make_folder(path.parent)
        if self.representation == EVENTS:
            from mocapdb.gait import write_events

            write_events([loop.clip], path)
        elif self.representation is not None:
            from mocapdb.io import write_representation

            write_representation(loop.clip, cast("RepresentationName", self.representation), path)
        elif self._has_root_bone:
            from mocapdb.scenes.gltf import RootTrack, write_glb

            write_glb(loop.clip, path, RootTrack(loop.path, loop.heading_rad))
        else:
            from mocapdb.jobs import write_clip

            write_clip(loop.clip, path, blender=self.blender)


def written_loop(
    cycle: Cycle,
    options: LoopOptions,
    files: LoopFiles,
    path: Path | None,
    *,
    fps: float,
    most_jerk: float,
    scene: Scene | None,
) -> Loop:
    """Make the loop of a cycle from its phase 0 on, put its scene back, write and return it.

    `fps` is the frame rate where the options have none; see `make_loop` for `most_jerk`.
    """
    from mocapdb.cycles import make_loop

    animate = options["animate"]
    if animate is not None:
        cycle = cycle.animating(animate)
    loop = make_loop(
        cycle,
        options["fps"] or fps,
        n_laps=options["n_laps"],
        root=options["root"],
        hold_feet=options["hold_feet"] and (animate is None or cycle.skeleton.names[0] in animate),
        most_jerk=most_jerk,
        lap_frames=options["lap_frames"],
        closed=options["closed"],
    )
    if scene is not None:
        loop = loop._replace(clip=scene.put_back(loop.clip))
    files.write(loop, path)
    return loop


def as_file_name(name: str, taken: set[str]) -> str:
    """Return a name that no other file has yet, without letters that files cannot have."""
    plain = "".join(letter if letter.isalnum() or letter in "-_." else "-" for letter in name)
    unused, number = plain, 1
    while unused in taken:
        number += 1
        unused = f"{plain}_{number}"
    taken.add(unused)
    return unused
