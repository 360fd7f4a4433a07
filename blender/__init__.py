# SPDX-License-Identifier: GPL-3.0-or-later
"""mocapdb in Blender: loops from actions, a library of motions, faults found and repaired.

================  ==================================================================
`panel`           the panel in the sidebar of the 3-D view
`settings`        what it asks: properties of the scene
`extraction`      operators: from actions to loops
`library`         operators: a library listed, searched, brought in, added to
`cleaning`        operators: faults found, marked, repaired
`job_operator`    what operators with long work have in common
`background`      the worker, as seen from Blender
`armatures`       armatures and their actions as motions, and the other way
`keying`          curves of actions as arrays
`compat`          where Blender 4.5 and 5 differ
`motions`         motion as plain arrays, as both processes know it
`worker`          the process beside Blender; it and what follows know nothing of bpy
`tasks`           what it can do
`clips`           motions as clips of mocapdb, and the other way
`retargeting`     a motion on another armature
================  ==================================================================
"""

from __future__ import annotations

import bpy

from . import cleaning, extraction, job_operator, library, panel, settings
from .background import WORKER

CLASSES = (
    *settings.CLASSES,
    job_operator.CancelTask,
    *extraction.CLASSES,
    *library.CLASSES,
    *cleaning.CLASSES,
    *panel.CLASSES,
)


def register() -> None:
    """Make the add-on known to Blender."""
    for each in CLASSES:
        bpy.utils.register_class(each)
    settings.add_properties()


def unregister() -> None:
    """Take it away again."""
    WORKER.close()
    panel.forget_pictures()
    settings.remove_properties()
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
