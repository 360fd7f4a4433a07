"""Panel: the selected range as a query, and its hits to be played beside it."""

from __future__ import annotations

import html
from functools import cached_property
from typing import TYPE_CHECKING, Any

from mocapdb.scenes.stage import ACTOR_COLOURS, Actor, Stage
from mocapdb.viewer.panel import Panel, number_cell, paragraph, row, table, text_cell

if TYPE_CHECKING:
    from mocapdb.library.searching.retrieval import Hit, Retrieval
    from mocapdb.motion.clip import Clip

__all__ = ["QueryPanel"]

MOST_TOGETHER = 4  # hits beside the query: more do not fit on the stage
HEADS = ("clip", "class", "from s", "to s", "distance", "speed")


class QueryPanel(Panel):
    """Asking for more of what is selected."""

    def _add_controls(self, gui: Any) -> None:
        self._example: Clip | None = None
        self._hits: list[Hit] = []
        self._chosen = -1
        self._range = gui.add_html("")
        self._k = gui.add_slider("hits", 1, 50, 1, 10)
        self._mirror = gui.add_checkbox(
            "mirrored too", False, hint="Left for right counts as well."
        )
        self._others = gui.add_checkbox(
            "other subjects only", False, hint="Leave out who performs the query."
        )
        find = gui.add_button("Find this")
        self._list = gui.add_html("")
        self._together = gui.add_button(f"Play the first {MOST_TOGETHER} beside it", visible=False)
        find.on_click(self._does(self._find))
        self._together.on_click(self._does(self._play_first))
        self._host.on_message("hit", lambda number: self._play_hit(int(number)))
        self.refresh()

    def refresh(self) -> None:
        """Write the range that is selected."""
        view = self._view
        if view.clip is None:
            text = "Open a clip first."
        elif view.selection is None:
            text = "The whole clip. Drag along the grey strip under the timeline to select a range."
        else:
            start, end = view.selection
            text = f"{html.escape(view.name)}, {start:.2f} to {end:.2f} s."
        self._range.content = paragraph(text)

    @cached_property
    def _retrieval(self) -> Retrieval:
        from mocapdb.library.searching.retrieval import Retrieval

        return Retrieval(self._host.library)

    def _find(self) -> None:
        from mocapdb.library.searching.retrieval import Filter

        view = self._view
        if view.clip is None or view.record is None:
            self._host.say("Open a clip first.")
            return
        clip = view.clip
        start, end = view.selection or (0.0, clip.duration_s)
        first, last = round(start * clip.fps), round(end * clip.fps)
        self._example = clip[first : min(max(last, first + 1), len(clip))]
        who = view.record.performer
        performers = [who] if who and self._others.value else []
        self._chosen = -1
        self._hits = self._retrieval.query(
            [self._example],
            k=int(self._k.value),
            only=Filter(not_clips=[view.name], not_subjects=performers),
            mirror=self._mirror.value,
        )
        self._write()

    def _write(self) -> None:
        rows = (
            row(
                f"hit {i}",
                [
                    text_cell(hit.record.name),
                    text_cell(hit.record.label or ""),
                    number_cell(f"{hit.start_s:.2f}"),
                    number_cell(f"{hit.end_s:.2f}"),
                    number_cell(f"{hit.distance:.2f}"),
                    number_cell(f"{1 / hit.time_scale:.2f}×"),
                ],
                here=i == self._chosen,
            )
            for i, hit in enumerate(self._hits)
        )
        heads = (f"<th>{head}</th>" for head in HEADS)
        text = f"{len(self._hits)} hits; click one to play it beside the query"
        self._list.content = paragraph(text, table(heads, rows), " mt-hits")
        self._together.visible = len(self._hits) > 1

    def _play_hit(self, number: int) -> None:
        if 0 <= number < len(self._hits):
            self._chosen = number
            self._play(self._hits[number : number + 1])
            self._write()

    def _play_first(self) -> None:
        self._chosen = -1
        self._play(self._hits[:MOST_TOGETHER])

    def _play(self, hits: list[Hit]) -> None:
        """Play hits beside the query, each from one place and facing one way."""
        assert self._example is not None  # there are hits
        library = self._host.library
        clips = [(self._example, "query")]
        clips += [
            (
                library.clip(hit.record.name, slice(hit.start, hit.end)),
                f"{hit.record.name} from {hit.start_s:.2f} s",
            )
            for hit in hits
        ]
        actors = [
            Actor.of(clip, name=name, colour=colour).from_origin(clip)
            for (clip, name), colour in zip(clips, ACTOR_COLOURS, strict=False)
        ]
        self._host.show_aside(Stage.side_by_side(actors), "a query and what is like it")
