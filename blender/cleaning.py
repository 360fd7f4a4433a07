"""Faults of an action: found, marked, repaired in a second action as the user decides."""

from __future__ import annotations

from typing import Any

import bpy

from . import compat
from .armatures import RefusedError, keys_of, read_action, span_of_action
from .background import WORKER
from .extraction import armatures_with_actions
from .job_operator import JobOperator, Task, Work
from .keying import replace_keys
from .library import library_path
from .motions import read_motion_file, write_motion_file

__all__ = ["CLASSES"]

PREFIX = "Cleaned"
MARK = "fault"  # how the names of markers begin, so that they can be taken away again
END = " end"


class CleanAction(JobOperator, bpy.types.Operator):
    """Find the faults of the active action, mark them, and repair them in a second action"""

    bl_idname = "mocapdb.clean"
    bl_label = "Find and Repair Faults"
    bl_options = {"REGISTER", "UNDO"}

    def work(self, context: Any) -> Work:
        """Search the action of the first armature."""
        settings = context.scene.mocapdb_clean
        owner = armatures_with_actions(context)[0]
        action, slot = compat.assigned(owner)
        original = _searched_action(settings, owner, action)
        if original is not None:  # what is played are the repairs: search what they are of
            action, slot = original, compat.slot_for(original, owner)
        yield from _clean(self, context, owner, action, slot, accepted=None)
        if not settings.faults:
            self.report({"INFO"}, f"No faults in {action.name!r}: nothing is repaired")
            return
        n_repaired = sum(row.method not in ("left", "refused") for row in settings.faults)
        self.report({"INFO"}, f"{len(settings.faults)} faults, {n_repaired} repaired")


class RepairAccepted(JobOperator, bpy.types.Operator):
    """Make the repaired action anew, with those repairs alone that are accepted in the list"""

    bl_idname = "mocapdb.repair_accepted"
    bl_label = "Repair Accepted"
    bl_options = {"REGISTER", "UNDO"}

    def work(self, context: Any) -> Work:
        """Repair again what is accepted."""
        settings = context.scene.mocapdb_clean
        owner = context.scene.objects.get(settings.armature)
        action = bpy.data.actions.get(settings.action)
        if owner is None or action is None or not settings.faults:
            raise RefusedError("Expected faults that were found before: find them first.")
        accepted = [i for i, row in enumerate(settings.faults) if row.accepted]
        slot = compat.slot_for(action, owner)
        yield from _clean(self, context, owner, action, slot, accepted)
        self.report({"INFO"}, f"{len(accepted)} of {len(settings.faults)} repairs accepted")


class GoToFault(bpy.types.Operator):
    """Go to the frame of the chosen fault and select its bone"""

    bl_idname = "mocapdb.go_to_fault"
    bl_label = "Go to Fault"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: Any) -> set[str]:
        """Set the scene's frame, and the active bone."""
        settings = context.scene.mocapdb_clean
        owner = context.scene.objects.get(settings.armature)
        if owner is None or not settings.faults:
            self.report({"ERROR"}, "Expected faults that were found before: find them first.")
            return {"CANCELLED"}
        row = settings.faults[min(settings.fault, len(settings.faults) - 1)]
        context.scene.frame_set(int(row.start))
        bone = owner.pose.bones.get(row.name)
        if bone is not None:
            owner.data.bones.active = bone.bone
            compat.select_bone(bone)
        return {"FINISHED"}


class RemoveMarkers(bpy.types.Operator):
    """Take the markers of faults away from the action that was searched"""

    bl_idname = "mocapdb.remove_markers"
    bl_label = "Remove Markers"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: Any) -> set[str]:
        """Remove those that mocapdb has set."""
        action = bpy.data.actions.get(context.scene.mocapdb_clean.action)
        if action is not None:
            _remove_markers(action)
        return {"FINISHED"}


def _clean(
    operator: JobOperator,
    context: Any,
    owner: Any,
    action: Any,
    slot: Any,
    accepted: list[int] | None,
) -> Work:
    """Search and repair an action of an armature; fill the list, set markers, key the repairs.

    Where there is no fault the armature plays on what it has played.
    """
    settings = context.scene.mocapdb_clean
    span = span_of_action(action, slot)
    if owner.animation_data is None:
        owner.animation_data_create()
    with compat.playing(owner, action, slot):
        motion = read_action(context.scene, owner, span, operator.said)
    source = WORKER.file(".npz")
    write_motion_file(motion, source)
    answer = yield Task(
        "clean",
        {
            "motion": source,
            "threshold": settings.threshold if settings.use_threshold else None,
            "accepted": accepted,
            "context": library_path(context) if settings.use_context else None,
            "output": WORKER.file(".npz"),
        },
    )
    times = span.times
    _list_faults(settings, answer["spans"], times, accepted)
    settings.action, settings.armature = action.name, owner.name
    _remove_markers(action)
    for row in settings.faults:
        marker = action.pose_markers.new(f"{MARK} {row.kind} {row.name} {row.confidence:.2f}")
        marker.frame = round(row.start)
    if not settings.faults:
        return
    repaired = _repaired_action(settings, action, slot, owner)
    keys = keys_of(context.scene, owner, read_motion_file(answer["file"]))
    for name, frames in answer["changed"].items():
        if name in keys:
            bone = owner.pose.bones[name]
            moves = keys[name].location is not None
            replace_keys(*repaired, bone, keys[name], times, frames, moves=moves)
    compat.assign(owner, *repaired)
    context.view_layer.update()


def _list_faults(
    settings: Any, spans: list[dict[str, Any]], times: Any, accepted: list[int] | None
) -> None:
    settings.faults.clear()
    for i, span in enumerate(spans):
        row = settings.faults.add()
        row.name = span["joint"].removesuffix(END)
        row.kind, row.confidence, row.method = span["kind"], span["confidence"], span["method"]
        first, last = span["frames"][0], span["frames"][1] - 1
        row.start, row.end = float(times[first]), float(times[last])
        row.accepted = accepted is None or i in accepted


def _repaired_action(settings: Any, action: Any, slot: Any, owner: Any) -> tuple[Any, Any]:
    """Return a copy of an action, to be repaired; it takes the place of an earlier one."""
    former = bpy.data.actions.get(settings.repaired)
    if former is not None and former.get("mocapdb_repairs") == action.name:
        bpy.data.actions.remove(former)
    copy, own_slot = compat.copy_action(action, slot, f"{PREFIX} {action.name}")
    copy["mocapdb_repairs"] = action.name
    _remove_markers(copy)
    settings.repaired = copy.name
    return copy, own_slot


def _searched_action(settings: Any, owner: Any, action: Any) -> Any:
    """Return the action that the one played has the repairs of, or None where it is no such one."""
    of = action.get("mocapdb_repairs")
    if of is None or settings.repaired != action.name:
        return None
    return bpy.data.actions.get(of)


def _remove_markers(action: Any) -> None:
    for marker in list(action.pose_markers):
        if marker.name.startswith(f"{MARK} "):
            action.pose_markers.remove(marker)


CLASSES = (CleanAction, RepairAccepted, GoToFault, RemoveMarkers)
