"""Panel: the selected range as a query; its hits, which can be judged and searched by again."""

from __future__ import annotations

import html
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from mocapdb.indexing.search.body_parts import PARTS
from mocapdb.scenes.stage import ACTOR_COLOURS, Actor, Stage
from mocapdb.viewer.panel import Panel, breakable, number_cell, paragraph
from mocapdb.viewer.pictures import picture_html

if TYPE_CHECKING:
    from mocapdb.indexing import Agreement
    from mocapdb.library.searching.retrieval import Hit, Retrieval
    from mocapdb.motion.clip import Clip

__all__ = ["QueryPanel", "agreement_html"]

MOST_TOGETHER = 4  # hits beside the query: more do not fit on the stage
WHOLE_BODY = "the whole body"
COUNTS, MOST_HITS = (5, 10, 20, 50), 50  # hits that can be asked for
SWITCHES = {
    "mirror": ("mirrored too", "Left for right counts as well."),
    "others": ("other subjects only", "Leave out who performs the query."),
    "listed": ("listed clips only", "Search only the clips that are chosen at the left."),
}
AGAIN = (
    "With the hits that have a thumb up as further examples, and without what is more like those "
    "with a thumb down."
)
THUMB = "M1 9h4v10H1zM7 19h9l3-8V9h-6l1-6-2-1-5 7z"  # in a square of 20, up
OVERLAP = 0.5  # of the shorter of two stretches, from which on they are the same hit
SHADES = 55  # of 100 steps of light, from the same to as far apart as any two poses


@dataclass(frozen=True)
class Options:
    """How a query is asked."""

    part: str = WHOLE_BODY
    k: int = 10
    mirror: bool = False
    others: bool = False
    listed: bool = False


@dataclass(frozen=True)
class Asked:
    """What was asked for: an example, and from which clip and whom it is."""

    example: Clip
    name: str
    performer: str


class QueryPanel(Panel):
    """Asking for more of what is selected, and again by what was said of the hits."""

    def _add_controls(self, gui: Any) -> None:
        self._asked: Asked | None = None
        self._hits: list[Hit] = []
        self._liked: list[Hit] = []
        self._unliked: list[Hit] = []
        self._chosen: Hit | None = None
        self._options = Options()
        self._form = gui.add_html("")
        self._list = gui.add_html("")
        self._together = gui.add_button(f"Play the first {MOST_TOGETHER} beside it", visible=False)
        self._together.on_click(self._does(self._play_first))
        host = self._host
        host.on_message("find", lambda _: self._find())
        host.on_message("again", lambda _: self._search())
        host.on_message("part", self._set_part)
        host.on_message("k", lambda count: self._set(k=min(max(int(count), 1), MOST_HITS)))
        for switch in SWITCHES:
            host.on_message(switch, partial(self._switch, switch))
        host.on_message("hit", lambda number: self._play_hit(int(number)))
        host.on_message("like", lambda number: self._judge(int(number), likes=True))
        host.on_message("unlike", lambda number: self._judge(int(number), likes=False))
        host.on_message("pardon", lambda number: self._pardon(int(number)))
        host.on_message("go", lambda number: self._go(int(number)))
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
            text = f"{breakable(view.name)}, {start:.2f} to {end:.2f} s."
        self._form.content = paragraph(text, self._controls())

    def _controls(self) -> str:
        options = self._options
        parts = "".join(
            f'<option value="{part}"{" selected" if part == options.part else ""}>'
            f"{part.replace('-', ' ')}</option>"
            for part in (WHOLE_BODY, *PARTS)
        )
        counts = "".join(
            f'<option value="{k}"{" selected" if k == options.k else ""}>{k} hits</option>'
            for k in sorted({*COUNTS, options.k})
        )
        switches = "".join(
            f'<button data-send="{switch}" title="{about}"'
            f"{' aria-pressed=true' if getattr(options, switch) else ''}>{text}</button>"
            for switch, (text, about) in SWITCHES.items()
        )
        again = (
            f'<button data-send="again" class=mt-main title="{AGAIN}">Search again</button>'
            if self._liked or self._unliked
            else ""
        )
        return (
            f'<div class="mt mt-bar"><select data-choose="part" aria-label="compare">{parts}'
            f'</select><select data-choose="k" aria-label="hits">{counts}</select>{switches}'
            f'<button data-send="find" class=mt-main>Find this</button>{again}</div>'
        )

    def _set(self, **options: Any) -> None:
        self._options = replace(self._options, **options)
        self.refresh()

    def _set_part(self, part: str) -> None:
        if part in (WHOLE_BODY, *PARTS):
            self._set(part=part)

    def _switch(self, switch: str, _: str) -> None:
        self._set(**{switch: not getattr(self._options, switch)})

    @cached_property
    def _retrieval(self) -> Retrieval:
        from mocapdb.library.searching.retrieval import Retrieval

        return Retrieval(self._host.library)

    # -- searching ---------------------------------------------------------------------------------

    def _find(self) -> None:
        view = self._view
        if view.clip is None or view.record is None:
            self._host.say("Open a clip first.")
            return
        clip = view.clip
        start, end = view.selection or (0.0, clip.duration_s)
        first, last = round(start * clip.fps), round(end * clip.fps)
        example = clip[first : min(max(last, first + 1), len(clip))]
        self._asked = Asked(example, view.name, view.record.performer)
        self._liked, self._unliked = [], []
        self._search()

    def _search(self) -> None:
        """Ask by the example and by what was judged since."""
        from mocapdb.library.searching.retrieval import Filter

        asked = self._asked
        if asked is None:
            return
        options = self._options
        chosen = self._host.choice.filter() if options.listed else Filter()
        left_out = [asked.performer] if asked.performer and options.others else []
        k = options.k
        found = self._retrieval.query(
            [asked.example, *map(self._clip, self._liked)],
            k=k + 2 * len(self._liked),  # these are found again
            only=replace(chosen, not_clips=[asked.name], not_subjects=left_out),
            unlike=[*map(self._clip, self._unliked)],
            joints=[] if options.part == WHOLE_BODY else [options.part],
            mirror=options.mirror,
        )
        judged = [*self._liked, *self._unliked]
        new = [hit for hit in found if not any(_is_same(hit, other) for other in judged)]
        self._hits = [*self._liked, *new[:k]]
        self._chosen = None
        for note in self._retrieval.notes:
            self._host.say(note)
        self._write()

    def _clip(self, hit: Hit) -> Clip:
        return self._host.library.clip(hit.record.name, slice(hit.start, hit.end))

    def _judge(self, number: int, *, likes: bool) -> None:
        """Give a hit a thumb; the same thumb again takes it back."""
        if not 0 <= number < len(self._hits):
            return
        hit = self._hits[number]
        own, other = (self._liked, self._unliked) if likes else (self._unliked, self._liked)
        taken_back = _has(own, hit)
        for judged in (own, other):
            judged[:] = [each for each in judged if each is not hit]
        if not taken_back:
            own.append(hit)
        self._write()

    def _pardon(self, number: int) -> None:
        """Take back a thumb down, of a hit that may not be shown any more."""
        if 0 <= number < len(self._unliked):
            del self._unliked[number]
            self._write()

    # -- HTML --------------------------------------------------------------------------------------

    def _write(self) -> None:
        cards = "".join(self._card(number, hit) for number, hit in enumerate(self._hits))
        gone = "".join(
            f'<button data-send="pardon {number}" title="take back">{breakable(hit.record.name)} ✕'
            "</button>"
            for number, hit in enumerate(self._unliked)
            if not _has(self._hits, hit)
        )
        text = f"{len(self._hits)} hits; click one to play it beside the query"
        if gone:
            text += f'<br><span class="mt">unlike: {gone}</span>'
        self._list.content = paragraph(
            text, f'<div class="mt mt-cards" data-scroll="hits">{cards}</div>', " mt-hits"
        )
        self.refresh()
        self._together.visible = len(self._hits) > 1

    def _card(self, number: int, hit: Hit) -> str:
        record = hit.record
        here = " mt-here" if hit is self._chosen else ""
        said = " · ".join(
            text for text in (record.label, f"{hit.start_s:.2f} to {hit.end_s:.2f} s") if text
        )
        thumbs = "".join(
            f'<button data-send="{verb} {number}" title="{title}" aria-label="{verb}"'
            f"{' aria-pressed=true' if _has(judged, hit) else ''}>"
            f'<svg viewBox="0 0 20 20" width=14 height=14><path d="{THUMB}"/></svg></button>'
            for verb, title, judged in (
                ("like", "This is meant, too", self._liked),
                ("unlike", "This is not meant", self._unliked),
            )
        )
        picture = picture_html(self._host.library, record, slice(hit.start, hit.end))
        return (
            f'<div class="mt-card{here}" data-send="hit {number}" '
            f'title="{html.escape(record.description)}">{picture}'
            f"<div><b>{breakable(record.name)}</b><small>{html.escape(said)}</small>"
            f'<small title="the same motion; distance {hit.distance:.2f}">'
            f"{100 * hit.probability:.0f} % likely, {_pace(hit.time_scale)}</small>"
            f"<div class=mt-parts>{self._parts(hit)}</div></div>"
            f'<div class=mt-thumbs>{thumbs}<button data-send="go {number}" '
            'title="Open the clip, with this range selected">open</button></div></div>'
            + (agreement_html(self._retrieval.agreement(hit)) if here else "")
        )

    def _parts(self, hit: Hit) -> str:
        """Return the parts of the body, each as dark as it is unlike the query's."""
        agreement = self._retrieval.agreement(hit)
        return "".join(
            f'<i style="background:{_shade(share)}" title="{100 * metres:.0f} cm apart">'
            f"{part.replace('-', ' ')}</i>"
            for part, (share, metres) in agreement.of_parts().items()
        )

    # -- playing -----------------------------------------------------------------------------------

    def _go(self, number: int) -> None:
        """Open the clip of a hit, with its range selected."""
        if 0 <= number < len(self._hits):
            hit = self._hits[number]
            self._host.open(hit.record.name)
            self._host.select(hit.start_s, hit.end_s)
            self._view.playback.seek(hit.start_s)

    def _play_hit(self, number: int) -> None:
        if 0 <= number < len(self._hits):
            hit = self._chosen = self._hits[number]
            self._play([hit])
            self._write()

    def _play_first(self) -> None:
        self._chosen = None
        self._play(self._hits[:MOST_TOGETHER])

    def _play(self, hits: list[Hit]) -> None:
        """Play hits beside the query, each from one place and facing one way."""
        assert self._asked is not None  # there are hits
        clips = [(self._asked.example, "query")]
        clips += [(self._clip(hit), f"{hit.record.name} from {hit.start_s:.2f} s") for hit in hits]
        actors = [
            Actor.of(clip, name=name, colour=colour).from_origin(clip)
            for (clip, name), colour in zip(clips, ACTOR_COLOURS, strict=False)
        ]
        self._host.show_aside(Stage.side_by_side(actors), "a query and what is like it")


def agreement_html(agreement: Agreement) -> str:
    """Return which parts of the body are like the query's, and when: white is the same."""
    return paragraph(
        "how far apart on average, and when in the query; white is the same",
        f'<table class="mt-why">{"".join(_part_rows(agreement))}</table>',
    )


def _part_rows(agreement: Agreement) -> Iterator[str]:
    moments = agreement.part_moments()
    seconds = float(agreement.query_s[-1]) if len(agreement.query_s) else 0.0
    for part, (share, metres) in agreement.of_parts().items():
        shades = ", ".join(_shade(value) for value in moments[part])
        yield (
            f"<tr><td>{part.replace('-', ' ')}</td>{number_cell(f'{100 * metres:.0f} cm')}"
            f'<td class="mt-moments" data-drag="seek" data-low="0" data-high="{seconds:.3f}" '
            f'title="{share:.2f} of what any two poses are apart" '
            f'style="background: linear-gradient(to right, {shades}, {_shade(moments[part][-1])})">'
            "</td></tr>"
        )


def _shade(apart: float) -> str:
    """Return white for the same, and blue for as far apart as any two poses."""
    light = 100 - SHADES * min(max(apart, 0.0), 1.0)
    return f"hsl(203 100% {light:.0f}%)"


def _pace(time_scale: float) -> str:
    speed = 1 / time_scale
    return "as fast" if abs(speed - 1) < 0.05 else f"{speed:.2g}× as fast"


def _has(hits: list[Hit], hit: Hit) -> bool:
    return any(each is hit for each in hits)


def _is_same(hit: Hit, other: Hit) -> bool:
    """Return whether two hits are nearly one stretch of a clip."""
    common = min(hit.end, other.end) - max(hit.start, other.start)
    shorter = min(hit.end - hit.start, other.end - other.start)
    return hit.record.id == other.record.id and common > OVERLAP * shorter
