"""Panel: the selected range as a query, and its hits to be played beside it."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Any

from mocapdb.scenes.stage import ACTOR_COLOURS, Actor, Stage

if TYPE_CHECKING:
    from mocapdb.library.retrieval import Hit
    from mocapdb.motion.clip import Clip
    from mocapdb.viewer.session import Session

__all__ = ["QueryPanel"]

MOST_TOGETHER = 4


class QueryPanel:
    """Asking for more of what is selected.

    Parameters
    ----------
    session : Session
    gui : viser.GuiApi
    """

    def __init__(self, session: Session, gui: Any) -> None:
        self._session = session
        self._gui = gui
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
        find.on_click(lambda _: session.post(self._find))
        self._together.on_click(lambda _: session.post(self._play_first))
        self.refresh()

    def refresh(self) -> None:
        """Write the range that is selected."""
        selection = self._session.selection
        if self._session.clip is None:
            text = "Open a clip first."
        elif selection is None:
            text = "The whole clip. Drag along the grey strip under the timeline to select a range."
        else:
            text = f"{html.escape(self._session.name)}, {selection[0]:.2f} to {selection[1]:.2f} s."
        self._range.content = f'<div class="mt-list"><p>{text}</p></div>'

    def play(self, number: int) -> None:
        """Play a hit beside the query."""
        if not 0 <= number < len(self._hits):
            return
        self._chosen = number
        self._play(self._hits[number : number + 1])
        self._write()

    def _find(self) -> None:
        from mocapdb.library.naming import subject_of
        from mocapdb.library.retrieval import Filter

        session = self._session
        clip = session.clip
        if clip is None:
            session.say("Open a clip first.")
            return
        start, end = session.selection or (0.0, clip.duration_s)
        first, last = round(start * clip.fps), round(end * clip.fps)
        self._example = clip[first : min(max(last, first + 1), len(clip))]
        subject = subject_of(session.record().stem)
        only = Filter(
            not_clips=[session.name], not_subjects=[subject] if self._others.value else []
        )
        self._chosen = -1
        self._hits = session.library.retrieval.query(
            self._example, k=int(self._k.value), only=only, mirror=self._mirror.value
        )
        self._write()

    def _write(self) -> None:
        rows = "".join(
            f'<tr{" class=mt-here" if i == self._chosen else ""} data-send="hit {i}">'
            f"<td>{html.escape(hit.record.name)}</td><td>{html.escape(hit.record.label or '')}</td>"
            f"<td class=mt-number>{hit.start_s:.2f}</td><td class=mt-number>{hit.end_s:.2f}</td>"
            f"<td class=mt-number>{hit.distance:.2f}</td>"
            f"<td class=mt-number>{1 / hit.time_scale:.2f}×</td></tr>"
            for i, hit in enumerate(self._hits)
        )
        heads = "".join(
            f"<th>{head}</th>" for head in ("clip", "class", "from s", "to s", "distance", "speed")
        )
        self._list.content = (
            f'<div class="mt-list mt-hits"><p>{len(self._hits)} hits; click one to play it beside '
            f'the query</p><div class="mt-scroll"><table><thead><tr>{heads}</tr></thead>'
            f"<tbody>{rows}</tbody></table></div></div>"
        )
        self._together.visible = len(self._hits) > 1

    def _play_first(self) -> None:
        self._chosen = -1
        self._play(self._hits[:MOST_TOGETHER])

    def _play(self, hits: list[Hit]) -> None:
        assert self._example is not None  # there are hits
        session = self._session
        clips = [(self._example, "query")]
        clips += [
            (
                session.library.clip(hit.record.name, slice(hit.start, hit.end)),
                f"{hit.record.name} from {hit.start_s:.2f} s",
            )
            for hit in hits
        ]
        actors = [
            Actor.of(clip, name=name, colour=ACTOR_COLOURS[i % len(ACTOR_COLOURS)]).from_origin(
                clip
            )
            for i, (clip, name) in enumerate(clips)
        ]
        session.show_aside(Stage.side_by_side(actors), "a query and what is like it")
