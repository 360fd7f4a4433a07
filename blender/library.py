"""A library of motions in the panel: listed, searched, brought in, added to.

The list is read here, by numpy and h5py alone; what decodes or compares motion is done beside.
"""

from __future__ import annotations

import contextlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, StringProperty

from . import compat
from .armatures import (
    RefusedError,
    frame_rate,
    keys_of,
    make_armature,
    read_action,
    rest_motion,
    span_of_action,
)
from .background import WORKER, TaskError
from .extraction import armatures_with_actions, selected_bones
from .job_operator import JobOperator, Task, Work
from .keying import make_cyclic, write_keys
from .motions import Motion, read_motion_file, write_motion_file
from .settings import NO_CLASS

__all__ = ["CLASSES", "list_clips"]

RATES_DIGITS = 1000  # a frame rate is a whole number over a base: to so many parts


def library_path(context: Any) -> str:
    """Return the folder of the library.

    Raises
    ------
    RefusedError
        If none is named.
    """
    path = context.scene.mocapdb_library.path
    if not path:
        raise RefusedError("Expected a library: choose the folder of one that mocapdb has built.")
    return str(bpy.path.abspath(path)).rstrip("/\\")


def list_clips(context: Any) -> None:
    """List the clips that the filters leave; what cannot be listed is said in the panel."""
    settings = context.scene.mocapdb_library
    settings.clips.clear()
    settings.problem = ""
    try:
        path = library_path(context)
        rows, classes = _rows(path, settings)
    except RefusedError as problem:
        settings.problem = str(problem)
        return
    if [row.name for row in settings.classes] != classes:
        settings.classes.clear()
        for name in classes:
            settings.classes.add().name = name
    add = settings.clips.add
    for name, label, seconds, fps, flagged in rows:
        row = add()
        row.name, row.label, row.seconds, row.fps, row.flagged = name, label, seconds, fps, flagged
    settings.clip = min(settings.clip, max(len(settings.clips) - 1, 0))
    with contextlib.suppress(TaskError):  # who asks for a clip is told
        WORKER.prepare()


def _rows(path: str, settings: Any) -> tuple[list[tuple[str, str, float, float, bool]], list[str]]:
    """Return name, class, length, rate of the clips, and whether faults are left in them."""
    from mocapdb.errors import MocapdbError
    from mocapdb.library import Library

    try:
        with Library(path) as library:
            records = library.records(**_asked(settings))
            revisions = library.catalogue.revisions()
            classes = sorted(library.classes())
    except MocapdbError as problem:
        raise RefusedError(str(problem)) from None
    except ModuleNotFoundError as problem:
        raise RefusedError(f"Listing a library needs the Python package {problem.name}.") from None
    rows = []
    for record in records:
        revision = revisions.get(record.id)
        flagged = revision is not None and bool(revision.left)
        rows.append((record.name, record.label or "", record.duration_s, record.fps, flagged))
    return rows, classes


def _asked(settings: Any) -> dict[str, Any]:
    """Return the filters as `mocapdb.Library.records` has them."""
    ranges = {
        row.facet: (row.least if row.use_least else None, row.most if row.use_most else None)
        for row in settings.facets
        if row.use_least or row.use_most
    }
    return {
        "label": None if settings.label in ("", NO_CLASS) else settings.label,
        "search": settings.words.strip() or None,
        "facets": ranges,
    }


class OpenLibrary(bpy.types.Operator):
    """List the clips of the library anew"""

    bl_idname = "mocapdb.open_library"
    bl_label = "Open Library"
    bl_options = {"REGISTER"}

    path: StringProperty(name="Library", subtype="DIR_PATH", options={"SKIP_SAVE"})

    def execute(self, context: Any) -> set[str]:
        """List the clips; begin to load what decoding needs, beside."""
        settings = context.scene.mocapdb_library
        if self.path:
            settings.path = self.path
        else:
            list_clips(context)
        if settings.problem:
            self.report({"ERROR"}, settings.problem)
            return {"CANCELLED"}
        self.report({"INFO"}, f"{len(settings.clips)} clips")
        return {"FINISHED"}


class ChangeFacets(bpy.types.Operator):
    """Add a range that clips have to be in, or take the last one away"""

    bl_idname = "mocapdb.change_facets"
    bl_label = "Ranges"
    bl_options = {"REGISTER", "UNDO"}

    remove: BoolProperty(options={"SKIP_SAVE"})

    def execute(self, context: Any) -> set[str]:
        """Change the rows, and list again."""
        facets = context.scene.mocapdb_library.facets
        if not self.remove:
            facets.add()
        elif facets:
            facets.remove(len(facets) - 1)
        list_clips(context)
        return {"FINISHED"}


class QueryLibrary(JobOperator, bpy.types.Operator):
    """Find the stretches of the library that are like the active action, or its selected bones"""

    bl_idname = "mocapdb.query"
    bl_label = "Find Similar Motion"
    bl_options = {"REGISTER"}

    def work(self, context: Any) -> Work:
        """Fill the list of hits."""
        scene = context.scene
        settings, loops = scene.mocapdb_library, scene.mocapdb_loops
        path = library_path(context)
        owner = armatures_with_actions(context)[0]
        action, slot = compat.assigned(owner)
        limits = (loops.first_frame, loops.n_frames) if loops.use_range else ()
        motion = read_action(scene, owner, span_of_action(action, slot, *limits), self.said)
        source = WORKER.file(".npz")
        write_motion_file(motion, source)
        asked = _asked(settings)
        answer = yield Task(
            "query",
            {
                "library": path,
                "motion": source,
                "k": settings.n_hits,
                "joints": selected_bones(context, owner),
                "only": {
                    "label": asked["label"],
                    "text": asked["search"],
                    "facets": asked["facets"],
                },
            },
        )
        settings.hits.clear()
        for hit in answer["hits"]:
            row = settings.hits.add()
            row.name = hit.pop("clip")
            for key, value in hit.items():
                setattr(row, key, value)
        for note in answer["notes"]:
            self.said(note)
        self.report({"INFO"}, f"{len(settings.hits)} stretches are like {action.name!r}")


class ImportClip(JobOperator, bpy.types.Operator):
    """Bring in a clip, a hit, or the cycle of a class, as an armature with an action"""

    bl_idname = "mocapdb.import_clip"
    bl_label = "Import"
    bl_options = {"REGISTER", "UNDO"}

    what: EnumProperty(
        items=(
            ("CLIP", "Clip", "The clip that is chosen in the list"),
            ("HIT", "Hit", "The stretch that is chosen in the hits"),
            ("CYCLE", "Cycle of Class", "The cycle of the class of the chosen clip"),
        ),
        options={"SKIP_SAVE"},
    )
    clip: StringProperty(
        description="Name of a clip, or of a class; else what the lists have chosen",
        options={"SKIP_SAVE"},
    )

    def work(self, context: Any) -> Work:
        """Decode the motion beside, then make the armature and key it."""
        scene = context.scene
        settings = scene.mocapdb_library
        path = library_path(context)
        owner = self._target(context)
        target = None
        if owner is not None:
            target = WORKER.file(".npz")
            write_motion_file(rest_motion(scene, owner), target)
        shared = {
            "library": path,
            "fps": frame_rate(scene) if settings.rate == "RESAMPLE" else None,
            "target": target,
            "output": WORKER.file(".npz"),
        }
        if self.what == "CYCLE":
            label = self.clip or self._chosen_class(settings)
            answer = yield Task("class_cycle", {"label": label, "by_modifier": True, **shared})
            name = f"Periodic {label}"
        else:
            name, frames = self._chosen_clip(settings)
            answer = yield Task(
                "decode",
                {"clip": name, "frames": frames, "original": settings.original, **shared},
            )
            name = answer["clip"]
        if not answer["compiled"]:
            self.said("numba is not in this build of the extension, so that decoding is slow")
        motion = replace(read_motion_file(answer["file"]), name=name)
        if settings.rate == "SCENE":
            _set_rate(scene, motion.fps)
        step = frame_rate(scene) / motion.fps
        if self.what == "CYCLE":
            step = answer["period_s"] * frame_rate(scene) / answer["lap_frames"]
        owner, action, slot = _key_motion(context, owner, motion, step)
        if self.what == "CYCLE":
            make_cyclic(action, slot, advances=answer["advances"])
            self.report(
                {"INFO"}, f"{name}: the mean of {answer['members']} clips, "
                f"{len(answer['left_out'])} left out"
            )  # fmt: skip
        else:
            self.report({"INFO"}, f"{name}: {len(motion)} frames at {motion.fps:g} a second")

    def _target(self, context: Any) -> Any:
        """Return the armature that gets the motion, or None for a new one."""
        if not context.scene.mocapdb_library.onto_selected:
            return None
        owner = context.active_object
        if owner is None or owner.type != "ARMATURE":
            raise RefusedError(
                "Expected an active armature to bring the motion onto. Select one, or switch off "
                "Onto Armature."
            )
        return owner

    def _chosen_clip(self, settings: Any) -> tuple[str, list[int] | None]:
        if self.what == "HIT":
            if not settings.hits:
                raise RefusedError("Expected a hit to be chosen: find similar motion first.")
            hit = settings.hits[min(settings.hit, len(settings.hits) - 1)]
            return hit.name, [hit.start, hit.end]
        if self.clip:
            return self.clip, None
        if not settings.clips:
            raise RefusedError("Expected a clip to be chosen, but none is listed.")
        return settings.clips[min(settings.clip, len(settings.clips) - 1)].name, None

    def _chosen_class(self, settings: Any) -> str:
        if settings.label not in ("", NO_CLASS):
            return str(settings.label)
        clips = settings.clips
        label = clips[min(settings.clip, len(clips) - 1)].label if clips else ""
        if not label:
            raise RefusedError("Expected a class: choose one, or a clip that has one.")
        return str(label)


class AddToLibrary(JobOperator, bpy.types.Operator):
    """Add the action of the active armature to the library, which is made where there is none"""

    bl_idname = "mocapdb.add_action"
    bl_label = "Add Action to Library"
    bl_options = {"REGISTER"}

    def work(self, context: Any) -> Work:
        """Write the motion for the worker, and list the library again."""
        settings = context.scene.mocapdb_library
        path = library_path(context)
        owner = armatures_with_actions(context)[0]
        action, slot = compat.assigned(owner)
        motion = read_action(context.scene, owner, span_of_action(action, slot), self.said)
        source = WORKER.file(".npz")
        write_motion_file(motion, source)
        answer = yield Task(
            "add",
            {
                "library": path,
                "motion": source,
                "name": action.name,
                "label": settings.new_label.strip(),
                "mean_mm": settings.mean_mm,
            },
        )
        list_clips(context)
        self.report(
            {"INFO"}, f"{answer['clip']!r} is in {Path(path).name} now: {len(motion)} frames in "
            f"{answer['bytes'] / 1000:.1f} kB"
        )  # fmt: skip


def _key_motion(context: Any, owner: Any, motion: Motion, step: float) -> tuple[Any, Any, Any]:
    """Give a motion to an armature, or to a new one; return it, its action and slot."""
    if owner is None:
        owner, names = make_armature(context, motion)
        motion = replace(motion, names=tuple(names[name] for name in motion.names))
        for bone in owner.pose.bones:
            bone.rotation_mode = "QUATERNION"
    action, slot = compat.make_action(motion.name, owner)
    keys = keys_of(context.scene, owner, motion)
    first = context.scene.frame_start
    write_keys(action, slot, owner.pose.bones, keys, first + step * np.arange(len(motion)))
    compat.assign(owner, action, slot)
    context.view_layer.update()
    return owner, action, slot


def _set_rate(scene: Any, fps: float) -> None:
    """Give a scene a frame rate, to a thousandth: Blender has a whole number and a base."""
    whole = max(round(fps), 1)
    scene.render.fps = whole
    scene.render.fps_base = round(whole / fps * RATES_DIGITS) / RATES_DIGITS


CLASSES = (OpenLibrary, ChangeFacets, QueryLibrary, ImportClip, AddToLibrary)
