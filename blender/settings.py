"""What the panel asks: properties of the scene, named and explained as the panel shows them."""

# Blender reads the annotations: they are properties and no types.

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)
from bpy.types import PropertyGroup

__all__ = ["CLASSES", "add_properties", "remove_properties"]

WAYS = (
    ("ADVANCE", "Advance", "Goes on and sways: a line and harmonics (Raunio 2014, eq. 3.27)"),
    ("SWAY", "Sway", "Only sways about a place: harmonics alone (eq. 3.6)"),
)
MODELS = (
    ("harmonic", "Harmonic, smoothed", "Harmonics of poses, smoothed as much as laps differ"),
    ("typical", "Typical trajectory", "Centroids of poses of like phase"),
    ("m1", "Raunio's, weighted", "Poses, velocities and accelerations, each with its weight"),
    ("m2", "Raunio's, poses alone", "Poses alone"),
    ("m3", "Raunio's, unweighted", "Poses, velocities and accelerations alike"),
)
LOOPS = (
    ("MODIFIER", "Cycles modifier", "One lap, repeated for ever by a modifier, at its very tempo"),
    ("FRAMES", "Exact frames", "Whole laps as keys at whole frames"),
)
RATES = (
    ("RESAMPLE", "Scene's", "Resample the motion to the scene's frame rate"),
    ("KEYS", "All keys", "Keep every captured frame: keys may lie between frames"),
    ("SCENE", "Set the scene's", "Give the scene the clip's frame rate"),
)
FACETS = (
    ("root_speed", "Speed (m/s)", "Mean speed of the hips over the ground"),
    ("turn", "Turn (degrees)", "Change of facing, to the left positive"),
    ("height", "Stature (m)", "Stature of who performs it"),
    ("duration", "Length (s)", "Length in seconds"),
    ("contacts", "Steps", "How often a foot is set down"),
)
NO_CLASS = "All classes"


def _list_again(settings: "LibrarySettings", context: bpy.types.Context) -> None:
    from .library import list_clips

    list_clips(context)


def _classes(settings: "LibrarySettings", context: bpy.types.Context, text: str) -> list[str]:
    return [NO_CLASS, *(row.name for row in settings.classes)]


class FoundLoop(PropertyGroup):
    """A loop that cohomology sees."""

    chosen: BoolProperty(name="", description="Make a motion of this loop")
    rank: IntProperty()
    birth: FloatProperty()
    death: FloatProperty()


class LoopSettings(PropertyGroup):
    """How a periodic motion is extracted."""

    use_epsilon: BoolProperty(
        name="Largest Distance",
        description="Say at which distance poses are no longer joined; else it is found",
    )
    epsilon: FloatProperty(
        name="Epsilon",
        description="Lower is quicker, higher finds more persistent loops",
        default=1.0, min=1e-6, soft_max=10.0, precision=3,
    )  # fmt: skip
    subsample: IntProperty(
        name="Subsample",
        description="Look at one of so many frames only; the loop has all",
        default=1, min=1, soft_max=16,
    )  # fmt: skip
    use_range: BoolProperty(
        name="Frame Range", description="Look at some frames of the action only"
    )
    first_frame: IntProperty(name="First Frame", default=1, description="First frame to look at")
    n_frames: IntProperty(
        name="Frames", default=250, min=4, description="Look at so many frames at most"
    )
    n_loops: IntProperty(
        name="Motions",
        description="Make a motion of each of so many loops, the most persistent ones",
        default=1, min=1, soft_max=8, max=64,
    )  # fmt: skip
    use_translation: BoolProperty(
        name="Translation", default=True, description="Let the root move; else it stays in place"
    )
    use_x: BoolProperty(name="X", default=True, description="Let the root move along X")
    use_y: BoolProperty(name="Y", default=True, description="Let the root move along Y")
    use_z: BoolProperty(name="Z", default=True, description="Let the root move along Z")
    way_x: EnumProperty(name="X", items=WAYS)
    way_y: EnumProperty(name="Y", items=WAYS)
    way_z: EnumProperty(name="Z", items=WAYS)
    loop_by: EnumProperty(name="Loop by", items=LOOPS)
    laps: IntProperty(
        name="Laps", default=1, min=1, soft_max=16, description="How many laps are keyed"
    )
    model: EnumProperty(name="Model", items=MODELS)
    use_delays: BoolProperty(
        name="Delay Factor",
        description="Say how many later poses are put beside each; else it is found",
    )
    delays: IntProperty(name="Delays", default=2, min=0, soft_max=16)
    lag: IntProperty(name="Lag", default=1, min=1, description="Frames between them")
    prime: IntProperty(
        name="Prime", default=47, min=2, description="Cohomology is computed modulo this prime"
    )
    harmonics: IntProperty(
        name="K", default=40, min=1, soft_max=60, description="Most harmonics of the joints"
    )
    use_root_harmonics: BoolProperty(
        name="K of Translation", description="Other harmonics for the root than for the joints"
    )
    root_harmonics: IntProperty(name="K", default=5, min=1, soft_max=60)
    use_velocities: BoolProperty(
        name="Velocities", default=True, description="Fit velocities, too (Raunio's m1 and m3)"
    )
    use_accelerations: BoolProperty(
        name="Accelerations", default=True,
        description="Fit accelerations, too (Raunio's m1 and m3)",
    )  # fmt: skip
    use_pictures: BoolProperty(
        name="Pictures",
        description="Draw the motion and its loop on their principal axes, and the diagram",
    )
    pictures: StringProperty(name="Folder", subtype="DIR_PATH", default="//loops")
    found: CollectionProperty(type=FoundLoop)
    found_for: StringProperty(description="Of what the loops were found, and how")
    diagram: StringProperty()


class ClipRow(PropertyGroup):
    """A clip of the library."""

    label: StringProperty()
    seconds: FloatProperty()
    fps: FloatProperty()
    flagged: BoolProperty()


class ClassRow(PropertyGroup):
    """A class of the library."""


class FacetRow(PropertyGroup):
    """A range of a number that clips are chosen by."""

    facet: EnumProperty(name="", items=FACETS, update=_list_again)
    use_least: BoolProperty(name="", default=True, update=_list_again)
    least: FloatProperty(name="from", default=0.0, update=_list_again)
    use_most: BoolProperty(name="", update=_list_again)
    most: FloatProperty(name="to", default=1.0, update=_list_again)


class HitRow(PropertyGroup):
    """A stretch of a clip that is like the query."""

    label: StringProperty()
    start: IntProperty()
    end: IntProperty()
    start_s: FloatProperty()
    end_s: FloatProperty()
    distance: FloatProperty()
    probability: FloatProperty()


class LibrarySettings(PropertyGroup):
    """Which library, what of it is listed, and how it is brought in."""

    path: StringProperty(
        name="Library", subtype="DIR_PATH", update=_list_again,
        description="Folder of a library that mocapdb has built",
    )  # fmt: skip
    words: StringProperty(
        name="", description="Only clips with these words", update=_list_again,
        options={"TEXTEDIT_UPDATE"},
    )  # fmt: skip
    label: StringProperty(
        name="Class", default=NO_CLASS, search=_classes, update=_list_again,
        description="Only clips of this class",
    )  # fmt: skip
    facets: CollectionProperty(type=FacetRow)
    clips: CollectionProperty(type=ClipRow)
    clip: IntProperty(name="Clip")
    classes: CollectionProperty(type=ClassRow)
    problem: StringProperty()
    original: BoolProperty(
        name="As Captured", description="Bring in clips as they were captured, not as cleaned"
    )
    rate: EnumProperty(name="Rate", items=RATES)
    onto_selected: BoolProperty(
        name="Onto Armature",
        description="Give the motion to the active armature, where its bones are of the same body",
    )
    n_hits: IntProperty(name="Hits", default=10, min=1, soft_max=100)
    hits: CollectionProperty(type=HitRow)
    hit: IntProperty(name="Hit")
    new_label: StringProperty(name="Class", description="Class of the clip that is added")
    mean_mm: FloatProperty(
        name="Mean Error (mm)", default=1.0, min=0.001,
        description="Mean error of the joints that coding may make",
    )  # fmt: skip


class FaultRow(PropertyGroup):
    """A stretch of a bone that was flagged."""

    accepted: BoolProperty(name="", default=True, description="Repair this one")
    kind: StringProperty()
    start: FloatProperty()
    end: FloatProperty()
    confidence: FloatProperty()
    method: StringProperty()


class CleanSettings(PropertyGroup):
    """What is searched for faults, and what was found."""

    use_threshold: BoolProperty(
        name="Threshold", description="Say from which confidence a fault is flagged"
    )
    threshold: FloatProperty(name="Confidence", default=0.5, min=0.0, max=1.0)
    use_context: BoolProperty(
        name="Similar Motion from Library",
        description="Look for similar motion in the library's clips of the same bones",
    )
    faults: CollectionProperty(type=FaultRow)
    fault: IntProperty(name="Fault")
    action: StringProperty(description="The action that was searched")
    armature: StringProperty(description="The armature that played it")
    repaired: StringProperty(description="The action that has the repairs")


CLASSES = (
    FoundLoop,
    LoopSettings,
    ClipRow,
    ClassRow,
    FacetRow,
    HitRow,
    LibrarySettings,
    FaultRow,
    CleanSettings,
)


def add_properties() -> None:
    """Give every scene the settings."""
    scene, manager = bpy.types.Scene, bpy.types.WindowManager
    scene.mocapdb_loops = PointerProperty(type=LoopSettings)
    scene.mocapdb_library = PointerProperty(type=LibrarySettings)
    scene.mocapdb_clean = PointerProperty(type=CleanSettings)
    manager.mocapdb_work = StringProperty(description="What mocapdb is doing just now")


def remove_properties() -> None:
    """Take them away."""
    scene, manager = bpy.types.Scene, bpy.types.WindowManager
    del scene.mocapdb_loops, scene.mocapdb_library, scene.mocapdb_clean, manager.mocapdb_work
