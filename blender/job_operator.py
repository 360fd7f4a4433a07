"""Operators whose work is done beside Blender, so that the window stays alive meanwhile."""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import bpy

from .armatures import RefusedError
from .background import WORKER, Progress, TaskError

__all__ = ["CancelTask", "JobOperator", "Task", "Work"]

LOOK_S = 0.1


class Task(NamedTuple):
    """What the worker is asked."""

    name: str
    arguments: dict[str, Any]


Work: TypeAlias = Generator[Task, Any, None]


class JobOperator:
    """What operators with long work have in common.

    ``work`` of an operator is a generator: it yields tasks and is sent their results. What it does
    in between is done in Blender. From a script it runs to its end; from the panel it goes on
    whenever the worker has an answer, and Escape or the panel's button breaks it off.
    """

    if TYPE_CHECKING:  # what Blender gives every operator
        bl_label: str
        report: Any

    def work(self, context: Any) -> Work:
        """Do the operator's work."""
        raise NotImplementedError

    def execute(self, context: Any) -> set[str]:
        """Do all of it before returning."""
        try:
            work = self.work(context)
            answer = None
            while True:
                task = work.send(answer)
                answer = WORKER.do(task.name, **task.arguments)
        except StopIteration:
            return {"FINISHED"}
        except (RefusedError, TaskError) as problem:
            return self._refuse(str(problem))

    def invoke(self, context: Any, event: Any) -> set[str]:
        """Begin, and go on in `modal`."""
        if WORKER.busy:
            return self._refuse("mocapdb is at work on something else: wait for it, or cancel it.")
        self._work = self.work(context)
        if (done := self._go_on(context, None)) is not None:
            return done
        manager = context.window_manager
        manager.progress_begin(0, 1)
        manager.mocapdb_work = self.bl_label
        self._timer = manager.event_timer_add(LOOK_S, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        """Look whether the worker has an answer."""
        manager = context.window_manager
        if event.type == "ESC" or not manager.mocapdb_work:
            self._work.close()
            WORKER.stop()
            self._end(context)
            self.report({"INFO"}, "Cancelled: nothing was changed")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            return self._look(context)
        except BaseException:  # whatever it is, the timer and the panel's words end with it
            self._work.close()
            WORKER.stop()
            self._end(context)
            raise

    def said(self, text: str) -> None:
        """Warn the user."""
        self.report({"WARNING"}, text[:1].upper() + text[1:])

    def _look(self, context: Any) -> set[str]:
        """Take what the worker has to say, and go on where that is a result."""
        manager = context.window_manager
        try:
            answer = WORKER.look()
        except TaskError as problem:
            self._end(context)
            return self._refuse(str(problem))
        if isinstance(answer, Progress):
            manager.progress_update(answer.done / max(answer.total, 1))
            manager.mocapdb_work = f"{self.bl_label}: {answer.done} of {answer.total}"
            _redraw(context)
        if isinstance(answer, dict) and (done := self._go_on(context, answer)) is not None:
            self._end(context)
            return done
        return {"PASS_THROUGH"}

    def _go_on(self, context: Any, answer: dict[str, Any] | None) -> set[str] | None:
        """Begin the next task; return how the operator ends if there is none."""
        try:
            task = self._work.send(answer)
            WORKER.start(task.name, **task.arguments)
        except StopIteration:
            return {"FINISHED"}
        except (RefusedError, TaskError) as problem:
            return self._refuse(str(problem))
        return None

    def _refuse(self, text: str) -> set[str]:
        self.report({"ERROR"}, text)
        return {"CANCELLED"}

    def _end(self, context: Any) -> None:
        manager = context.window_manager
        manager.event_timer_remove(self._timer)
        manager.progress_end()
        manager.mocapdb_work = ""
        _redraw(context)


class CancelTask(bpy.types.Operator):
    """Break off what mocapdb is doing; nothing is changed"""

    bl_idname = "mocapdb.cancel"
    bl_label = "Cancel"

    def execute(self, context: Any) -> set[str]:
        """Tell the running operator to end."""
        context.window_manager.mocapdb_work = ""
        return {"FINISHED"}


def _redraw(context: Any) -> None:
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
