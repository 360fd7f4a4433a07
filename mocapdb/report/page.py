"""Putting a page together: pictures and tables as HTML, style and scripts inside."""

from __future__ import annotations

import base64
import html
import io
import math
from collections.abc import Iterable, Sequence
from importlib.resources import files
from typing import TYPE_CHECKING

from mocapdb.scenes.player import PAGE, player_script, player_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["figures", "grid", "new_figure", "page", "picture", "section", "table"]

escape = html.escape
PX_PER_INCH = 96  # of CSS


def new_figure(width: float, height: float) -> Figure:
    """Return a figure of that size in inches, which belongs to no window."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def picture(figure: Figure, caption: str, text: str = "") -> str:
    """Return a figure as an image inside the page, with a caption; `text` describes it."""
    import matplotlib as mpl

    image = io.BytesIO()
    with mpl.rc_context({"svg.fonttype": "path", "svg.hashsalt": "mocapdb"}):
        figure.savefig(image, format="svg", metadata={"Date": None})
    data = base64.b64encode(image.getvalue()).decode("ascii")
    width = round(PX_PER_INCH * figure.get_size_inches()[0])
    return (
        f'<figure><img width="{width}" alt="{escape(text or caption)}" '
        f'src="data:image/svg+xml;base64,{data}"><figcaption>{escape(caption)}</figcaption>'
        "</figure>"
    )


def section(title: str, name: str, *parts: str) -> str:
    """Return a section with a heading that can be linked to."""
    inside = "\n".join(part for part in parts if part)
    return f'<section id="{name}">\n<h2>{escape(title)}</h2>\n{inside}\n</section>'


def grid(parts: Iterable[str]) -> str:
    """Return parts beside each other, as many as fit."""
    return f'<div class="grid">{"".join(parts)}</div>'


def figures(values: Iterable[tuple[str, str]]) -> str:
    """Return key figures: (value, what it is)."""
    items = "".join(
        f"<div><dd>{escape(value)}</dd><dt>{escape(name)}</dt></div>" for value, name in values
    )
    return f'<dl class="figures">{items}</dl>'


def table(columns: Sequence[str], rows: Iterable[Sequence[str | float]], *, left: int = 1) -> str:
    """Return a table that sorts by a column when its head is clicked, numbers by value."""
    heads = "".join(
        f'<th scope="col" aria-sort="none"><button>{escape(name)}</button></th>' for name in columns
    )
    body = "".join(
        "<tr>" + "".join(_cell(value, i < left) for i, value in enumerate(row)) + "</tr>"
        for row in rows
    )
    return (
        '<div class="scroll"><table class="sorts">'
        f"<thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table></div>"
    )


def _cell(value: str | float, text: bool) -> str:
    if isinstance(value, str):
        return f"<td{'' if text else ' class=number'}>{escape(value)}</td>"
    if math.isnan(value):
        return '<td class="number" data-value="-1e999">–</td>'
    return f'<td class="number" data-value="{value:.9g}">{value:,.4g}</td>'


def page(title: str, body: str) -> str:
    """Return a whole page with the style and the scripts that its tables and stages need."""
    here = files("mocapdb.report")
    return PAGE.format(
        title=escape(title),
        style=(here / "report.css").read_text(encoding="utf-8") + player_style(),
        body=body,
        script=(here / "report.js").read_text(encoding="utf-8") + player_script(),
    )
