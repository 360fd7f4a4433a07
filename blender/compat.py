"""Where Blender 4.5 and 5 differ, and what both ask of actions with layers: in one place.

Since 4.4 an action has slots, one for each thing that it animates, and its curves stand in channel
bags, one a slot; 5.0 has dropped ``Action.fcurves``, which showed those of the first slot. Whether
a bone is selected is the bone's own in 4.5 and its pose bone's since 5.0.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

__all__ = [
    "assign",
    "assigned",
    "copy_action",
    "curves_of",
    "is_selected",
    "make_action",
    "playing",
    "select_bone",
    "slot_for",
]

SELECTS_POSE_BONES = "select" in bpy.types.PoseBone.bl_rna.properties
LONGEST_NAME = 63  # bytes, in 4.5


def assigned(owner: Any) -> tuple[Any, Any]:
    """Return the action of an object and its slot; None and None where it has none."""
    data = owner.animation_data
    if data is None or data.action is None:
        return None, None
    return data.action, data.action_slot


def assign(owner: Any, action: Any, slot: Any) -> None:
    """Let an object play an action; the one that it has played is kept also without a user."""
    data = owner.animation_data or owner.animation_data_create()
    if data.action is not None:
        data.action.use_fake_user = True
    data.action = action
    data.action_slot = slot


@contextmanager
def playing(owner: Any, action: Any, slot: Any) -> Iterator[None]:
    """Let an object play an action for a while, and then again what it has played."""
    data = owner.animation_data
    before = data.action, data.action_slot
    data.action = action
    data.action_slot = slot
    try:
        yield
    finally:
        data.action = before[0]
        data.action_slot = before[1]


def make_action(name: str, owner: Any) -> tuple[Any, Any]:
    """Return a new empty action with a slot for an object; it is kept also while nothing plays it.

    A name that is too long is cut.
    """
    action = bpy.data.actions.new(name.encode()[:LONGEST_NAME].decode(errors="ignore"))
    action.use_fake_user = True
    slot = action.slots.new(id_type="OBJECT", name=owner.name)
    action.layers.new("Layer").strips.new(type="KEYFRAME").channelbag(slot, ensure=True)
    return action, slot


def copy_action(action: Any, slot: Any, name: str) -> tuple[Any, Any]:
    """Return a copy of an action under another name, and its slot that is the copy of `slot`."""
    copy = action.copy()
    copy.name = name.encode()[:LONGEST_NAME].decode(errors="ignore")
    copy.use_fake_user = True
    return copy, next(own for own in copy.slots if own.identifier == slot.identifier)


def slot_for(action: Any, owner: Any) -> Any:
    """Return the slot of an action that is an object's, else the first."""
    identifier = f"OB{owner.name}"
    return next((slot for slot in action.slots if slot.identifier == identifier), action.slots[0])


def curves_of(action: Any, slot: Any) -> Any:
    """Return the bag of a slot's curves, or None where it has none.

    It has ``fcurves`` and ``groups``.
    """
    for layer in action.layers:
        for strip in layer.strips:
            if strip.type == "KEYFRAME" and (bag := strip.channelbag(slot)) is not None:
                return bag
    return None


def is_selected(pose_bone: Any) -> bool:
    """Return whether a bone is selected in pose mode."""
    return bool(pose_bone.select if SELECTS_POSE_BONES else pose_bone.bone.select)


def select_bone(pose_bone: Any, value: bool = True) -> None:
    """Select a bone, or do not."""
    (pose_bone if SELECTS_POSE_BONES else pose_bone.bone).select = value
