"""From actions to loops: the operators that extract periodic motions."""

from __future__ import annotations

import json
import math
import shutil
import tempfile
from typing import Any, NamedTuple

import bpy
import numpy as np
from mathutils import Matrix

from . import compat
from .armatures import RefusedError, Span, keys_of, moving_bones, read_action, span_of_action
from .background import WORKER
from .job_operator import JobOperator, Task, Work
from .keying import make_cyclic, write_keys
from .motions import Motion, read_motion_file, write_motion_file

__all__ = ["CLASSES"]

PREFIX = "Periodic"
SOURCE = "mocapdb_made_of"  # the property of a loop that names the action it was made of
DOUBTFUL = 0.5  # confidence under which a loop is warned of


def armatures_with_actions(context: Any) -> list[Any]:
    """Return the selected armatures that play an action; in pose mode those that are posed.

    Raises
    ------
    RefusedError
        If there is none, which says what is selected instead.
    """
    if context.mode == "POSE":
        chosen = list(context.objects_in_mode)
    else:
        chosen = list(context.selected_objects)
    armatures = [owner for owner in chosen if owner.type == "ARMATURE"]
    if not armatures:
        others = ", ".join(f"{owner.type.lower()} {owner.name!r}" for owner in chosen[:3])
        raise RefusedError(
            f"Expected a selected armature, but {others or 'nothing'} is selected. "
            "Select the armature whose action is meant."
        )
    playing = [owner for owner in armatures if compat.assigned(owner)[0] is not None]
    if not playing:
        names = ", ".join(repr(owner.name) for owner in armatures[:3])
        raise RefusedError(f"Expected an armature that plays an action, but {names} has none.")
    return playing


def selected_bones(context: Any, owner: Any) -> list[str] | None:
    """Return the bones that are selected in pose mode; None in object mode, where all count.

    Raises
    ------
    RefusedError
        If none is selected.
    """
    if context.mode != "POSE":
        return None
    names = [bone.name for bone in owner.pose.bones if compat.is_selected(bone)]
    if not names:
        raise RefusedError(f"Expected selected bones in pose mode, but of {owner.name!r} none is.")
    return None if len(names) == len(owner.pose.bones) else names


class _Taken(NamedTuple):
    """An armature, what it plays or what the loop that it plays was made of, and what of that."""

    owner: Any
    action: Any
    bones: list[str] | None
    span: Span
    motion: Motion


def _take(operator: JobOperator, context: Any, owner: Any) -> _Taken:
    """Read the motion of an armature; it plays on what it has played."""
    bones = selected_bones(context, owner)
    action, slot = compat.assigned(owner)
    source = bpy.data.actions.get(action.get(SOURCE, ""))
    if source is not None:
        action, slot = source, compat.slot_for(source, owner)
    span = _span(context, action, slot)
    with compat.playing(owner, action, slot):
        motion = read_action(context.scene, owner, span, operator.said)
    return _Taken(owner, action, bones, span, motion)


def _words_of(taken: _Taken, search: dict[str, Any], subsample: int) -> str:
    """Return what the loops that cohomology finds depend on, as a text."""
    how = {name: search[name] for name in ("delays", "lag", "prime", "epsilon")}
    what = [taken.owner.name, taken.action.name, taken.bones, list(taken.span), subsample]
    return json.dumps([what, how])


def _pictures_folder(settings: Any) -> str | None:
    """Return the folder for pictures, None if none are drawn.

    Raises
    ------
    RefusedError
        If it is said from the place of a file that has none yet, or not at all.
    """
    if not settings.use_pictures:
        return None
    folder = settings.pictures.strip()
    if not folder:
        raise RefusedError("Expected a folder for the pictures: choose one.")
    if folder.startswith("//") and not bpy.data.filepath:
        raise RefusedError(
            f"Expected a saved file, beside which the pictures' folder {folder!r} is, but it has "
            "not been saved yet. Save the file, or choose a folder."
        )
    return str(bpy.path.abspath(folder))


def _span(context: Any, action: Any, slot: Any) -> Span:
    settings = context.scene.mocapdb_loops
    if settings.use_range:
        return span_of_action(action, slot, settings.first_frame, settings.n_frames)
    return span_of_action(action, slot)


def _search_settings(settings: Any) -> dict[str, Any]:
    """Return what the worker's settings of an extraction are called."""
    axes = "".join(axis for axis in "xyz" if getattr(settings, f"use_{axis}"))
    axes = axes if settings.use_translation else ""
    linear = "".join(axis for axis in axes if getattr(settings, f"way_{axis}") == "ADVANCE")
    has_derivatives = settings.model in ("m1", "m3")
    return {
        "model": settings.model,
        "harmonics": settings.harmonics,
        "root_harmonics": settings.root_harmonics if settings.use_root_harmonics else None,
        "root_axes": axes,
        "root_linear": linear,
        "delays": settings.delays if settings.use_delays else None,
        "lag": settings.lag if settings.use_delays else None,
        "prime": settings.prime,
        "epsilon": settings.epsilon if settings.use_epsilon else None,
        "use_velocities": settings.use_velocities or not has_derivatives,
        "use_accelerations": settings.use_accelerations or not has_derivatives,
    }


class ExtractLoops(JobOperator, bpy.types.Operator):
    """Make a motion that repeats of what the selected armatures do, or their selected bones"""

    bl_idname = "mocapdb.extract"
    bl_label = "Extract Periodic Motion"
    bl_options = {"REGISTER", "UNDO"}

    def work(self, context: Any) -> Work:
        """Extract the loops of each armature; key them when all have theirs, so all or nothing."""
        settings = context.scene.mocapdb_loops
        search = _search_settings(settings)
        pictures = _pictures_folder(settings)
        all_taken = [_take(self, context, owner) for owner in armatures_with_actions(context)]
        usual = list(range(settings.n_loops)) if settings.n_loops > 1 else None
        chosen = [loop.rank for loop in settings.found if loop.chosen]
        fits = [settings.found_for == _words_of(one, search, settings.subsample)
                for one in all_taken]  # fmt: skip
        answers = []
        for taken, is_found in zip(all_taken, fits, strict=True):
            if chosen and not is_found:
                self.said(
                    f"the loops that were chosen are not of {taken.action.name!r} with these "
                    "settings: its most persistent ones are taken"
                )
            source = WORKER.file(".npz")
            write_motion_file(taken.motion, source)
            by_modifier = settings.loop_by == "MODIFIER"
            folder = tempfile.mkdtemp(dir=WORKER.folder)
            answer = yield Task(
                "extract",
                {
                    "motion": source,
                    "folder": folder,
                    "settings": search,
                    "loop": {
                        "by_modifier": by_modifier,
                        "laps": settings.laps,
                        "advance": bool(search["root_linear"]),
                    },
                    "ranks": (chosen or usual) if is_found else usual,
                    "subsample": settings.subsample,
                    "animate": taken.bones,
                    "pictures": pictures,
                },
            )
            answers.append((folder, answer))
        if chosen and not any(fits):
            forget_loops(settings)
        for taken, (folder, answer) in zip(all_taken, answers, strict=True):
            self._key(context, taken, answer["loops"])
            shutil.rmtree(folder, ignore_errors=True)
            for rank, reason in answer["without"].items():
                self.said(f"loop {rank} of {taken.motion.name!r} is no cycle: {reason}")

    def _key(self, context: Any, taken: _Taken, loops: list[dict[str, Any]]) -> None:
        """Make an action of each loop; the armature plays the first."""
        owner, action, bones, span, motion = taken
        moving = moving_bones(motion)
        made = []
        for told in loops:
            loop = read_motion_file(told["file"])
            keys = keys_of(context.scene, owner, loop, moving)
            if bones is not None:
                keys = {name: own for name, own in keys.items() if name in bones}
            name = f"{PREFIX} {action.name}"
            if told["rank"] is not None:
                name += f", loop {told['rank']}"
            new, slot = compat.make_action(name, owner)
            by_modifier = len(loop) == told["lap_frames"] + 1
            step = span.step
            if by_modifier:  # a lap takes the time that it takes, between frames if need be
                rate = context.scene.render.fps / context.scene.render.fps_base
                step = told["period_s"] * rate / told["lap_frames"]
            times = span.start + step * np.arange(len(loop), dtype=np.float64)
            write_keys(new, slot, owner.pose.bones, keys, times)
            if by_modifier:
                make_cyclic(new, slot, advances=told["advances"])
            new.use_frame_range = new.use_cyclic = True
            new.frame_start = span.start
            new.frame_end = span.start + step * told["lap_frames"]
            for key in ("period_s", "confidence", "method", "laps"):
                new[f"mocapdb_{key}"] = told[key]
            new[SOURCE] = action.name
            made.append((new, slot))
            self._tell(new, told)
        if bones is not None:
            for bone in owner.pose.bones:
                if bone.name not in bones:
                    bone.matrix_basis = Matrix()
        compat.assign(owner, *made[0])
        context.view_layer.update()

    def _tell(self, action: Any, told: dict[str, Any]) -> None:
        text = f"{action.name}: {told['period_s']:.3f} s a lap, {told['laps']:.1f} laps seen, "
        text += f"confidence {told['confidence']:.2f}"
        self.report({"INFO"}, text)
        if told["confidence"] < DOUBTFUL:
            self.said(f"{action.name!r} is doubtful: its confidence is {told['confidence']:.2f}")
        for warning in told["warnings"]:
            self.said(warning)


class FindLoops(JobOperator, bpy.types.Operator):
    """Show the loops that the motion of the active armature has, to choose from"""

    bl_idname = "mocapdb.find_loops"
    bl_label = "Show Loops"
    bl_options = {"REGISTER"}

    def work(self, context: Any) -> Work:
        """Fill the list of loops, and load the picture of the diagram."""
        settings = context.scene.mocapdb_loops
        taken = _take(self, context, armatures_with_actions(context)[0])
        search = _search_settings(settings)
        words = _words_of(taken, search, settings.subsample)
        source = WORKER.file(".npz")
        write_motion_file(taken.motion, source)
        answer = yield Task(
            "find_loops",
            {
                "motion": source,
                "picture": WORKER.file(".png"),
                "settings": search,
                "subsample": settings.subsample,
                "animate": taken.bones,
            },
        )
        settings.found.clear()
        settings.found_for = words
        for rank, (birth, death) in enumerate(answer["bars"]):
            row = settings.found.add()
            row.rank, row.birth, row.death = rank, birth, min(death, math.inf)
        settings.diagram = answer["picture"]


def forget_loops(settings: Any) -> None:
    """Empty the list of loops."""
    settings.found.clear()
    settings.found_for = settings.diagram = ""


class ForgetLoops(bpy.types.Operator):
    """Let the most persistent loops be taken again"""

    bl_idname = "mocapdb.forget_loops"
    bl_label = "Forget Loops"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: Any) -> set[str]:
        """Empty the list."""
        forget_loops(context.scene.mocapdb_loops)
        return {"FINISHED"}


CLASSES = (ExtractLoops, FindLoops, ForgetLoops)
