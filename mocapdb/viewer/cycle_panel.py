"""Panel: cycles of a clip or of classes, playing in place or advancing, blended, exported."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from mocapdb.errors import CycleError
from mocapdb.motion.clip import Clip
from mocapdb.scenes.stage import Actor, Stage
from mocapdb.viewer.downloads import FORMATS, download_clip
from mocapdb.viewer.panel import Panel, paragraph
from mocapdb.viewer.tuning import CLASS_CYCLE_CLIPS, EXPORTED_FPS

if TYPE_CHECKING:
    from mocapdb.cycles import Cycle
    from mocapdb.cycles.cycle import RootMotion

__all__ = ["CyclePanel"]

THIS_CLIP, NOTHING = "(this clip)", "nothing"
PLAYED_FPS = 60.0  # frames a second of a cycle that is only looked at
ADVANCING_S = 8.0  # seconds that an advancing cycle goes before it starts again


class CyclePanel(Panel):
    """Choosing two cycles, and what lies between them."""

    def _add_controls(self, gui: Any) -> None:
        self._found: dict[str, Cycle] = {}
        self._shown = False
        names = (THIS_CLIP, *self._host.library.classes())
        self._a = gui.add_dropdown("cycle", names, initial_value=THIS_CLIP)
        self._b = gui.add_dropdown("blend with", (NOTHING, *names), initial_value=NOTHING)
        self._weight = gui.add_slider(
            "blend", 0.0, 1.0, 0.01, 0.0, hint="0 is the first cycle, 1 the second."
        )
        self._advance = gui.add_checkbox("advance", False, hint="Else it stays in place.")
        play = gui.add_button("Play the cycle")
        self._about = gui.add_html("")
        self._format = gui.add_dropdown("export as", FORMATS, initial_value="bvh")
        export = gui.add_button("Export", hint="One lap, feet held where they rest.")
        play.on_click(self._does(self._play))
        export.on_click(self._does(self._export))
        for control in (self._a, self._b):
            control.on_update(self._does(self._changed))
        for control in (self._weight, self._advance):
            control.on_update(self._does(self._changed, latest="blend"))

    def forget_clip(self) -> None:
        """Forget the cycle of the clip that was open."""
        self._found.pop(THIS_CLIP, None)
        self._shown = False

    def _changed(self) -> None:
        if self._shown:
            self._play()

    def _play(self) -> None:
        cycle = self._blend()
        n_laps = max(2, math.ceil(ADVANCING_S / cycle.period_s)) if self._advance.value else 2
        clip = self._loop(cycle, PLAYED_FPS, n_laps=n_laps, hold_feet=False)
        stage = Stage.together([Actor.of(clip, name=cycle.name)])
        self._host.show_aside(stage, f"cycle of {cycle.name}", keep_camera=self._shown)
        self._shown = True
        self._about.content = paragraph(
            f"{cycle.period_s:.2f} s a lap, {_speed(cycle):.2f} m/s when it advances"
        )

    def _export(self) -> None:
        clip = self._loop(self._blend(), EXPORTED_FPS)
        download_clip(self._host, clip, clip.name, self._format.value)

    def _loop(self, cycle: Cycle, fps: float, **options: Any) -> Clip:
        from mocapdb.cycles import make_loop

        root: RootMotion = "advance" if self._advance.value else "in-place"
        return make_loop(cycle, fps, root=root, **options).clip

    def _blend(self) -> Cycle:
        from mocapdb.cycles import blend

        first = self._cycle(self._a.value)
        if self._b.value == NOTHING:
            return first
        second = self._cycle(self._b.value)
        weight = float(self._weight.value)
        return blend([first, second], [1.0 - weight, weight])

    def _cycle(self, name: str) -> Cycle:
        """Return a cycle: found already, kept by the library, or found now."""
        if name not in self._found:
            self._host.say(f"Looking for the cycle of {name.strip('()')}")
            self._found[name] = self._of_clip() if name == THIS_CLIP else self._of_class(name)
        return self._found[name]

    def _of_clip(self) -> Cycle:
        from mocapdb.cycles import extract_cycle

        if self._view.clip is None:
            raise CycleError("Expected a clip that is open. Choose one from the list.")
        return extract_cycle(self._view.clip).cycle

    def _of_class(self, label: str) -> Cycle:
        from mocapdb.library.searching.class_cycles import class_cycle

        return class_cycle(self._host.library, label, most_clips=CLASS_CYCLE_CLIPS).cycle


def _speed(cycle: Cycle) -> float:
    level = [float(v) for axis, v in enumerate(cycle.advance) if axis != cycle.skeleton.up_index]
    return math.hypot(*level) * cycle.skeleton.metres_per_unit / cycle.period_s
