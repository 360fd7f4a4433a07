"""Panel: joints of the open clip that were not captured, filled in from the library."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

from mocapdb.errors import ClipError, MocapdbError
from mocapdb.scenes.stage import ACTOR_COLOURS, Actor, Stage
from mocapdb.viewer.clip_choice import ClipChoice
from mocapdb.viewer.downloads import FORMATS, download_clip
from mocapdb.viewer.panel import Panel, breakable, number_cell, paragraph, table, text_cell
from mocapdb.viewer.tuning import FILLING_CLIPS, HELD_OUT_CLIPS

if TYPE_CHECKING:
    from mocapdb.cleaning.filling_error import FillingError
    from mocapdb.cleaning.local_rotations import Texture
    from mocapdb.library.clip_record import ClipRecord
    from mocapdb.motion.clip import Clip
    from mocapdb.motion.skeleton import Skeleton
    from mocapdb.viewer.panel import PanelHost

__all__ = ["FillPanel"]

OVER, BESIDE = VIEWS = ("over the capture", "beside it")
ALL, LISTED = SOURCES = ("the library", "listed clips")
PRESETS = {
    "nine": ("nine joints", "Neck, shoulders, elbows, hips and knees were captured."),
    "every": ("all", "Every joint was captured."),
    "none": ("none", "Only what carries the body was captured."),
}


@dataclass
class Reading:
    """A clip to be filled, and what was read of the library so far.

    Attributes
    ----------
    clip : Clip
    known : tuple of str
        Joints that were captured, besides those that are always kept (see `kept_joints`).
    waiting : list of ClipRecord
        What is still to be read.
    n_fitting : int
        Clips that have the joints, of which `FILLING_CLIPS` are read at most.
    textures : list of Texture
    held_out : list of Clip
        Of which filling is measured.
    failed : list of str
        Names of clips that could not be read.
    """

    clip: Clip
    known: tuple[str, ...]
    waiting: list[ClipRecord]
    n_fitting: int
    textures: list[Texture] = field(default_factory=list)
    held_out: list[Clip] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Filled:
    """What came of it.

    Attributes
    ----------
    reading : Reading
    clip : Clip
    error : FillingError
        As measured on clips held out.
    expected : FillingError
        Of this clip, which the library may fit less well.
    """

    reading: Reading
    clip: Clip
    error: FillingError
    expected: FillingError


class FillPanel(Panel):
    """Choosing the joints that were captured, and having the others filled in.

    Parameters
    ----------
    host : PanelHost
    gui : viser.GuiApi
    clips : ClipChoice
    """

    def __init__(self, host: PanelHost, gui: Any, clips: ClipChoice) -> None:
        self._clips = clips
        super().__init__(host, gui)

    def _add_controls(self, gui: Any) -> None:
        self._joints: tuple[str, ...] = ()  # that turn, without those always kept
        self._known: set[str] = set()
        self._nine: tuple[str, ...] = ()
        self._shown_as, self._source, self._format = OVER, ALL, FORMATS[0]
        self._reading: Reading | None = None
        self._filled: Filled | None = None
        self._state = ""
        self._form = gui.add_html("")
        self._result = gui.add_html("")
        host = self._host
        host.on_message("captured", self._toggle)
        host.on_message("fill", lambda _: self._start())
        host.on_message("fill-from", self._set_source)
        host.on_message("fill-view", self._set_view)
        host.on_message("fill-format", self._set_format)
        host.on_message("fill-save", lambda _: self._save())
        for preset in PRESETS:
            host.on_message(f"captured-{preset}", partial(self._preset, preset))
        self.follow()

    def follow(self) -> None:
        """Take the joints of the clip that is open; a choice of the same joints stays."""
        from mocapdb.cleaning.repair.missing_joints import kept_joints, nine_joints

        clip = self._view.clip
        kept = () if clip is None else [clip.skeleton.names[joint] for joint in kept_joints(clip)]
        names = () if clip is None else _turning(clip.skeleton)
        names = tuple(name for name in names if name not in kept)
        if clip is not None and names != self._joints:
            self._nine = nine_joints(clip)
            self._known = set(self._nine or names)
        self._joints = names
        self._reading = self._filled = None
        self._state = ""
        self._write()

    # -- what is chosen ----------------------------------------------------------------------------

    def _toggle(self, name: str) -> None:
        if name in self._joints:
            self._known ^= {name}
            self._write()

    def _preset(self, preset: str, _: str) -> None:
        chosen = {"nine": self._nine, "every": self._joints, "none": ()}[preset]
        self._known = set(chosen)
        self._write()

    def _set_source(self, source: str) -> None:
        if source in SOURCES:
            self._source = source
            self._write()

    def _set_format(self, suffix: str) -> None:
        if suffix in FORMATS:
            self._format = suffix
            self._write()

    def _set_view(self, view: str) -> None:
        if view in VIEWS:
            self._shown_as = view
            self._write()
            if self._filled is not None:
                self._play(self._filled, keep_camera=True)

    # -- filling -----------------------------------------------------------------------------------

    def _start(self) -> None:
        clip, record = self._view.clip, self._view.record
        if clip is None or record is None:
            self._host.say("Open a clip first.")
            return
        known = tuple(name for name in self._joints if name in self._known)
        if not known or len(known) == len(self._joints):
            raise ClipError(
                f"Expected some of the {len(self._joints)} joints as captured, and others to be "
                f"filled, but {len(known)} are. Click on joints to change that."
            )
        fitting = self._fitting(record)
        if not fitting:
            raise ClipError(
                f"Expected other clips with the joints of {record.name} among {self._source}, but "
                "there is none."
            )
        step = max(1.0, len(fitting) / FILLING_CLIPS)
        chosen = [fitting[int(i * step)] for i in range(min(len(fitting), FILLING_CLIPS))]
        self._filled = None
        self._reading = Reading(clip, known, chosen, len(fitting))
        self._read_next(self._reading)

    def _fitting(self, record: ClipRecord) -> list[ClipRecord]:
        """Return the other clips whose joints turn by the same names."""
        records = self._clips.records
        if self._source == LISTED:
            records = [records[row] for row in self._clips.rows(self._host.choice)]
        library = self._host.library
        wanted = _turning(library.skeleton(record))
        bodies: dict[int, bool] = {}
        for other in records:
            if other.skeleton_id not in bodies:
                bodies[other.skeleton_id] = _turning(library.skeleton(other)) == wanted
        return [r for r in records if bodies[r.skeleton_id] and r.id != record.id]

    def _read_next(self, reading: Reading) -> None:
        """Read one clip of the library, and have the next one read when other things are done."""
        from mocapdb.cleaning.local_rotations import motion_texture
        from mocapdb.cleaning.tuning import TEXTURE_FPS

        if reading is not self._reading:
            return  # another clip was opened, or other joints are to be filled
        if not reading.waiting:
            self._say("filling…")
            self._host.loop.background(partial(_fill, reading), self._keep)
            return
        n_read = len(reading.textures) + len(reading.failed)
        self._say(f"reading {n_read + 1} of {n_read + len(reading.waiting)} clips…")
        record = reading.waiting.pop(0)
        try:
            clip = self._host.library.decode(record)
            rate = min(TEXTURE_FPS, reading.clip.fps)
            if clip.fps < rate:
                raise ClipError(f"{record.name} has fewer than {rate:g} frames a second.")
            reading.textures.append(motion_texture(clip, rate))
        except MocapdbError:
            reading.failed.append(record.name)
        else:
            every = max(1, min(reading.n_fitting, FILLING_CLIPS) // HELD_OUT_CLIPS)
            if len(reading.textures) % every == 0 and len(reading.held_out) < HELD_OUT_CLIPS:
                reading.held_out.append(clip)
        self._host.loop.post(partial(self._read_next, reading))

    def _keep(self, answer: Filled | MocapdbError) -> None:
        if isinstance(answer, MocapdbError):
            self._say("")
            raise answer
        if answer.reading is not self._reading:
            return
        self._filled, self._reading = answer, None
        self._say("")
        self._play(answer)

    def _play(self, filled: Filled, *, keep_camera: bool = False) -> None:
        before = Actor.of(filled.reading.clip, name="captured", colour=ACTOR_COLOURS[1])
        after = Actor.of(
            filled.clip, name="filled", against=filled.reading.clip, error_is="apart by"
        )
        stage = Stage.together if self._shown_as == OVER else Stage.side_by_side
        self._host.show_aside(
            stage([before, after]), f"{self._view.name}, filled", keep_camera=keep_camera
        )

    def _save(self) -> None:
        if self._filled is None:
            self._host.say("Fill a clip first.")
            return
        download_clip(self._host, self._filled.clip, f"{self._view.name}-filled", self._format)

    # -- HTML --------------------------------------------------------------------------------------

    def _say(self, state: str) -> None:
        self._state = state
        self._write()

    def _write(self) -> None:
        if not self._joints:
            self._form.content = paragraph("Open a clip with joints that turn first.")
            self._result.content = ""
        else:
            n_missing = len(self._joints) - len(self._known & set(self._joints))
            self._form.content = paragraph(
                f"{breakable(self._view.name)}: {len(self._joints) - n_missing} joints were "
                f"captured, {n_missing} are to be filled. A click on a joint changes that; what "
                "carries the body always was.",
                self._controls(),
            )
            self._result.content = self._result_html()

    def _controls(self) -> str:
        presets = "".join(
            f'<button data-send="captured-{preset}" title="{about}">{text}</button>'
            for preset, (text, about) in PRESETS.items()
            if preset != "nine" or self._nine
        )
        joints = "".join(
            f'<button data-send="captured {html.escape(name)}" '
            f"aria-pressed={'true' if name in self._known else 'false'}>{html.escape(name)}"
            "</button>"
            for name in self._joints
        )
        return (
            f'<div class="mt mt-bar">captured: {presets}</div>'
            f'<div class="mt mt-values mt-joints" data-scroll="joints">{joints}</div>'
            f'<div class="mt mt-bar">{_menu("fill-from", "from", SOURCES, self._source)}'
            f"{_menu('fill-view', 'show', VIEWS, self._shown_as)}"
            f'<button data-send="fill" class=mt-main>Fill</button>{html.escape(self._state)}</div>'
        )

    def _result_html(self) -> str:
        filled = self._filled
        if filled is None:
            return ""
        reading, error, expected = filled.reading, filled.error, filled.expected
        n_clips = len(reading.textures)
        seconds = sum(len(texture) / texture.fps for texture in reading.textures)
        text = f"filled from {n_clips} clips, {seconds:.0f} s of motion"
        if reading.n_fitting > n_clips + len(reading.failed):
            text += f", of {reading.n_fitting:,} that have these joints"
        if reading.failed:
            text += f"; not read: {', '.join(map(breakable, reading.failed))}"
        save = (
            f'<div class="mt mt-bar">{_menu("fill-format", "save as", FORMATS, self._format)}'
            '<button data-send="fill-save" title="The browser keeps it as a file.">'
            "Save the filled clip</button></div>"
        )
        if not error.clips:
            return paragraph(
                f"{text}. The error to expect is not known: it takes two clips and more, of some "
                "seconds each.",
                save,
            )
        rows = (
            f"<tr>{text_cell(name)}{number_cell(f'{degrees:.1f}°')}</tr>"
            for name, degrees in expected.mean_deg.items()
        )
        return paragraph(
            f"{text}. Off by {error.overall_deg:.1f}° on average on {len(error.clips)} of these "
            f"clips, each filled from the others; of this one {expected.overall_deg:.1f}° is "
            "expected, by how well its captured joints are met.",
            save
            + table(
                ("<th>filled joint</th>", '<th class="mt-number">expected error</th>'),
                rows,
                scroll="filled",
            ),
            " mt-filled",
        )


def _fill(reading: Reading) -> Filled | MocapdbError:
    """Fill the clip, and measure on clips that have all joints what filling is off."""
    from mocapdb.cleaning import Vocabulary, measure_filling
    from mocapdb.cleaning.repair.missing_joints import fill_with_misfit

    try:
        context = Vocabulary.of(reading.textures)
        clip, misfit = fill_with_misfit(reading.clip, reading.known, context)
        error = measure_filling(reading.known, context, held_out=reading.held_out)
        return Filled(reading, clip, error, error.expected(misfit))
    except MocapdbError as problem:
        return problem


def _menu(verb: str, label: str, options: Sequence[str], chosen: str) -> str:
    items = "".join(
        f"<option{' selected' if option == chosen else ''}>{option}</option>" for option in options
    )
    return f'<select data-choose="{verb}" aria-label="{label}">{items}</select>'


def _turning(skeleton: Skeleton) -> tuple[str, ...]:
    """Return the names of the joints that turn, with that of the first, which is always kept."""
    joints = dict.fromkeys((0, *skeleton.rotating_joints))
    return tuple(skeleton.names[joint] for joint in joints)
