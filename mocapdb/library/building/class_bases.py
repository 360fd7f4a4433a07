"""The bases of a library's classes: what clips of a class share, learned before they are coded.

A basis is learned from some clips of a class, once, and stays: clips refer to it. It is kept in the
catalogue, so that it becomes visible in the same moment as, and never later than, its clips.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Sequence

from mocapdb.base.progress import Progress, silent
from mocapdb.compression.pose.class_basis import Basis, fit_basis
from mocapdb.compression.pose.smooth_channels import SmoothChannels, three_angle_joints
from mocapdb.errors import MocapdbError
from mocapdb.io import read_clip
from mocapdb.library.building.plan import Task
from mocapdb.library.tuning import LEAST_CLIPS, MOST_CLIPS
from mocapdb.library.writing.catalogue_writer import CatalogueWriter
from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import Skeleton

__all__ = ["basis_for", "learn_bases"]

ClassBases = dict[tuple[str, str], bytes]
"""Bases by label and layout of channels."""


def learn_bases(
    catalogue: CatalogueWriter, tasks: Sequence[Task], progress: Progress = silent
) -> ClassBases:
    """Learn a basis for each class that has none yet, and return those of all classes.

    Files that cannot be read are passed over; whoever encodes them says what is wrong.
    """
    known = catalogue.class_bases()
    by_label: dict[str, list[Task]] = {}
    for task in tasks:
        if task.label is not None:
            by_label.setdefault(task.label, []).append(task)
    wanted = {label: own for label, own in by_label.items() if len(own) >= LEAST_CLIPS}
    for done, (label, own) in enumerate(wanted.items(), start=1):
        clips: dict[str, list[Clip]] = {}
        for task in own[:: -(-len(own) // MOST_CLIPS)]:
            clip = _read(task)
            if clip is not None:
                clips.setdefault(_layout(clip.skeleton), []).append(clip)
        for layout, alike in clips.items():
            if len(alike) < LEAST_CLIPS or (label, layout) in known:
                continue
            try:
                basis = fit_basis(_in_common_orders(alike))
            except (ArithmeticError, ValueError, MocapdbError):  # one of them is out of this world
                continue  # each clip does without
            if basis is not None:
                with catalogue.transaction():
                    catalogue.add_basis(basis.digest, label, layout, basis.to_bytes())
        progress(done, len(wanted), f"basis of {label}")
    return catalogue.class_bases()


def basis_for(bases: ClassBases, label: str | None, skeleton: Skeleton) -> Basis | None:
    """Return the basis of a class for a skeleton, if there is one."""
    data = bases.get((label or "", _layout(skeleton)))
    return None if data is None else Basis.from_bytes(data, skeleton)


def _read(task: Task) -> Clip | None:
    try:
        return read_clip(task.path, task.reading)
    except Exception:  # whatever it is, encoding says it
        return None


def _layout(skeleton: Skeleton) -> str:
    """Return what skeletons have in common whose channels mean the same."""
    content = json.dumps([skeleton.names, skeleton.dofs, skeleton.rotation_orders])
    return hashlib.sha256(content.encode()).hexdigest()[:16]


def _in_common_orders(clips: Sequence[Clip]) -> list[SmoothChannels]:
    """Return smooth channels of clips, every joint in the order of axes that suits most of them."""
    turning = three_angle_joints(clips[0].skeleton)
    orders = [SmoothChannels(clip).skeleton.rotation_orders for clip in clips]
    common = [Counter(own[joint] for own in orders).most_common(1)[0][0] for joint in turning]
    return [SmoothChannels(clip, common) for clip in clips]
