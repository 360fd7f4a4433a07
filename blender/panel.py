"""The panel in the sidebar of the 3-D view: loops, library, faults."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import bpy.utils.previews

from .settings import NO_CLASS

__all__ = ["CLASSES", "forget_pictures"]

CATEGORY = "mocapdb"
MOST_LOOPS = 12  # rows of the diagram
PICTURES: dict[str, Any] = {}  # the one collection of pictures, made when there is one to show


def forget_pictures() -> None:
    """Free the pictures that the panel has shown."""
    for collection in PICTURES.values():
        bpy.utils.previews.remove(collection)
    PICTURES.clear()


class _InSidebar:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = CATEGORY


class ExtractionPanel(_InSidebar, bpy.types.Panel):
    """Options of a periodic motion, and the button that extracts it."""

    bl_idname = "MOCAPDB_PT_extraction"
    bl_label = "Periodic Motion"

    def draw(self, context: Any) -> None:
        """Draw the options that are always shown."""
        layout, settings = _options(self.layout), context.scene.mocapdb_loops
        if not _draw_work(layout, context):
            layout.operator("mocapdb.extract", icon="FILE_REFRESH")
        if context.mode == "POSE":
            layout.label(text="Selected bones only", icon="BONE_DATA")
        _with_switch(layout, settings, "use_epsilon", "epsilon")
        layout.prop(settings, "subsample")
        column = layout.column(align=True)
        column.prop(settings, "use_range")
        if settings.use_range:
            column.prop(settings, "first_frame")
            column.prop(settings, "n_frames")
        layout.prop(settings, "n_loops")
        layout.prop(settings, "loop_by")
        if settings.loop_by == "FRAMES":
            layout.prop(settings, "laps")
        column = layout.column(align=True)
        column.prop(settings, "use_translation")
        if settings.use_translation:
            for axis in "xyz":
                row = column.row(align=True, heading=axis.upper())
                row.prop(settings, f"use_{axis}", text="")
                inner = row.row(align=True)
                inner.active = getattr(settings, f"use_{axis}")
                inner.prop(settings, f"way_{axis}", text="")


class AdvancedPanel(_InSidebar, bpy.types.Panel):
    """Options that are seldom changed."""

    bl_idname = "MOCAPDB_PT_advanced"
    bl_label = "Advanced"
    bl_parent_id = "MOCAPDB_PT_extraction"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        """Draw them."""
        layout, settings = _options(self.layout), context.scene.mocapdb_loops
        layout.prop(settings, "model")
        _with_switch(layout, settings, "use_delays", "delays", "lag")
        layout.prop(settings, "prime")
        layout.prop(settings, "harmonics")
        _with_switch(layout, settings, "use_root_harmonics", "root_harmonics")
        column = layout.column()
        column.active = settings.model in ("m1", "m3")
        column.prop(settings, "use_velocities")
        column.prop(settings, "use_accelerations")
        _with_switch(layout, settings, "use_pictures", "pictures")


class DiagramPanel(_InSidebar, bpy.types.Panel):
    """The persistence diagram, to choose loops from."""

    bl_idname = "MOCAPDB_PT_diagram"
    bl_label = "Persistence Diagram"
    bl_parent_id = "MOCAPDB_PT_extraction"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        """Draw the picture and a row for each loop."""
        layout, settings = self.layout, context.scene.mocapdb_loops
        layout.operator("mocapdb.find_loops", icon="VIEWZOOM")
        if not settings.found:
            return
        if Path(settings.diagram).is_file():
            layout.template_icon(_picture(settings.diagram), scale=10.0)
        column = layout.column(align=True)
        for loop in list(settings.found)[:MOST_LOOPS]:
            row = column.row()
            row.prop(loop, "chosen", text=f"Loop {loop.rank}")
            row.label(text=f"{loop.birth:.3f} to {loop.death:.3f}")
        if len(settings.found) > MOST_LOOPS:
            column.label(text=f"and {len(settings.found) - MOST_LOOPS} shorter ones")
        layout.operator("mocapdb.forget_loops", icon="X")


class ClipList(bpy.types.UIList):
    """The clips of a library."""

    bl_idname = "MOCAPDB_UL_clips"

    def draw_item(
        self, context: Any, layout: Any, data: Any, item: Any, icon: Any, active: Any, name: str
    ) -> None:
        """Draw a clip."""
        row = layout.row(align=True)
        row.label(text=item.name, icon="ERROR" if item.flagged else "ACTION")
        row.label(text=item.label)
        row.label(text=f"{item.seconds:.1f} s")


class HitList(bpy.types.UIList):
    """What a query has found."""

    bl_idname = "MOCAPDB_UL_hits"

    def draw_item(
        self, context: Any, layout: Any, data: Any, item: Any, icon: Any, active: Any, name: str
    ) -> None:
        """Draw a hit."""
        row = layout.row(align=True)
        row.label(text=f"{item.name}  {item.label}")
        row.label(text=f"{item.start_s:.1f} to {item.end_s:.1f} s")
        row.label(text=f"{item.probability:.0%}")


class LibraryPanel(_InSidebar, bpy.types.Panel):
    """A library: its clips, filters, what to do with them."""

    bl_idname = "MOCAPDB_PT_library"
    bl_label = "Motion Library"

    def draw(self, context: Any) -> None:
        """Draw the filters, the clips and the buttons."""
        layout, settings = self.layout, context.scene.mocapdb_library
        row = layout.row(align=True)
        row.prop(settings, "path", text="")
        row.operator("mocapdb.open_library", text="", icon="FILE_REFRESH")
        if settings.problem:
            _draw_text(layout, settings.problem)
        row = layout.row(align=True)
        row.prop(settings, "words", icon="VIEWZOOM")
        row.prop(settings, "label", text="")
        for facet in settings.facets:
            row = layout.row(align=True)
            row.prop(facet, "facet", text="")
            for switch, value in (("use_least", "least"), ("use_most", "most")):
                row.prop(facet, switch, text="")
                inner = row.row(align=True)
                inner.active = getattr(facet, switch)
                inner.prop(facet, value)
        row = layout.row(align=True)
        row.operator("mocapdb.change_facets", text="Range", icon="ADD")
        row.operator("mocapdb.change_facets", text="", icon="REMOVE").remove = True
        layout.template_list("MOCAPDB_UL_clips", "", settings, "clips", settings, "clip", rows=6)
        layout.label(text=f"{len(settings.clips)} clips")
        column = _options(layout.column())
        column.prop(settings, "rate")
        column.prop(settings, "onto_selected")
        column.prop(settings, "original")
        if not _draw_work(layout, context):
            row = layout.row(align=True)
            row.operator("mocapdb.import_clip", text="Import Clip", icon="IMPORT").what = "CLIP"
            chosen = settings.label if settings.label not in ("", NO_CLASS) else "Class"
            button = row.operator(
                "mocapdb.import_clip", text=f"Cycle of {chosen}", icon="FILE_REFRESH"
            )
            button.what = "CYCLE"


class QueryPanel(_InSidebar, bpy.types.Panel):
    """Search by example, and what was found."""

    bl_idname = "MOCAPDB_PT_query"
    bl_label = "Similar Motion"
    bl_parent_id = "MOCAPDB_PT_library"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        """Draw the button and the hits."""
        layout, settings = self.layout, context.scene.mocapdb_library
        if not context.window_manager.mocapdb_work:
            layout.operator("mocapdb.query", icon="VIEWZOOM")
        if context.scene.mocapdb_loops.use_range:
            layout.label(text="Frame range as of Periodic Motion", icon="TIME")
        if context.mode == "POSE":
            layout.label(text="Selected bones only", icon="BONE_DATA")
        layout.prop(settings, "n_hits")
        layout.template_list("MOCAPDB_UL_hits", "", settings, "hits", settings, "hit", rows=4)
        if settings.hits and not context.window_manager.mocapdb_work:
            layout.operator("mocapdb.import_clip", text="Import Hit", icon="IMPORT").what = "HIT"


class AddPanel(_InSidebar, bpy.types.Panel):
    """The active action into the library."""

    bl_idname = "MOCAPDB_PT_add"
    bl_label = "Add Action"
    bl_parent_id = "MOCAPDB_PT_library"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        """Draw the class and the button."""
        layout, settings = self.layout, context.scene.mocapdb_library
        layout.prop(settings, "new_label")
        layout.prop(settings, "mean_mm")
        if not context.window_manager.mocapdb_work:
            layout.operator("mocapdb.add_action", icon="ADD")


class FaultList(bpy.types.UIList):
    """The faults of an action."""

    bl_idname = "MOCAPDB_UL_faults"

    def draw_item(
        self, context: Any, layout: Any, data: Any, item: Any, icon: Any, active: Any, name: str
    ) -> None:
        """Draw a fault, with the box that accepts its repair."""
        row = layout.row(align=True)
        row.prop(item, "accepted", text="")
        row.label(text=f"{item.kind}  {item.name}")
        row.label(text=f"{item.start:.0f} to {item.end:.0f}")
        row.label(text=f"{item.confidence:.2f}  {item.method}")


class CleaningPanel(_InSidebar, bpy.types.Panel):
    """Faults: found, listed, repaired."""

    bl_idname = "MOCAPDB_PT_cleaning"
    bl_label = "Faults"

    def draw(self, context: Any) -> None:
        """Draw the options, the faults and the buttons."""
        layout, settings = self.layout, context.scene.mocapdb_clean
        column = _options(layout.column())
        _with_switch(column, settings, "use_threshold", "threshold")
        column.prop(settings, "use_context")
        is_free = not _draw_work(layout, context)
        if is_free:
            layout.operator("mocapdb.clean", icon="VIEWZOOM")
        if not settings.faults:
            return
        layout.template_list("MOCAPDB_UL_faults", "", settings, "faults", settings, "fault", rows=5)
        row = layout.row(align=True)
        row.operator("mocapdb.go_to_fault", icon="TIME")
        row.operator("mocapdb.remove_markers", icon="MARKER")
        if is_free:
            layout.operator("mocapdb.repair_accepted", icon="CHECKMARK")


def _options(layout: Any) -> Any:
    """Return a layout that draws options as Blender's own panels do: names left, values right."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    return layout


def _draw_work(layout: Any, context: Any) -> bool:
    """Draw what is being done and the button that breaks it off; return whether anything is."""
    work = context.window_manager.mocapdb_work
    if work:
        row = layout.row()
        row.label(text=work, icon="SORTTIME")
        row.operator("mocapdb.cancel", icon="CANCEL", text="")
    return bool(work)


def _with_switch(layout: Any, settings: Any, switch: str, *values: str) -> None:
    """Draw a switch, and below it the values that it switches on."""
    column = layout.column(align=True)
    column.prop(settings, switch)
    if getattr(settings, switch):
        for value in values:
            column.prop(settings, value)


def _draw_text(layout: Any, text: str, width: int = 46) -> None:
    """Draw a text over as many lines as it needs: labels do not wrap."""
    import textwrap

    column = layout.column(align=True)
    for i, line in enumerate(textwrap.wrap(text, width)):
        column.label(text=line, icon="NONE" if i else "ERROR")


def _picture(path: str) -> int:
    """Return the icon of a picture."""
    if "all" not in PICTURES:
        PICTURES["all"] = bpy.utils.previews.new()
    collection = PICTURES["all"]
    if path not in collection:
        collection.load(path, path, "IMAGE")
    return int(collection[path].icon_id)


CLASSES = (
    ExtractionPanel,
    AdvancedPanel,
    DiagramPanel,
    ClipList,
    HitList,
    LibraryPanel,
    QueryPanel,
    AddPanel,
    FaultList,
    CleaningPanel,
)
