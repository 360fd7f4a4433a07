"""The page's player: stages as JSON, the script and the style that play them.

Positions are whole numbers of a 32767th of the way that an actor covers, so a stage costs 6 bytes a
joint and frame before base64: 20 s of a body of 31 joints at 30 Hz are 150 kB.
"""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Sequence
from importlib.resources import files
from typing import Any, Protocol

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.scenes.capsule_body import ERROR_COLOURS, Body

__all__ = ["page", "player_script", "player_style", "stage_element"]

STEPS = 32767  # of a position from the middle of an actor's way to its end: what 16 bits hold
DECIMALS, RADIUS_DECIMALS = 5, 4  # of metres and radians, and of radii in metres
ERROR_STEPS = 255  # from no error to the largest: what 8 bits hold

PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="mocapdb">
<title>{title}</title>
<link rel="icon" href="data:,">
<style>
{style}
</style>
</head>
<body>
{body}
<script>
{script}
</script>
</body>
</html>
"""
FULL_SCREEN = """
html, body { height: 100%; margin: 0; }
body { font: 15px/1.5 system-ui, sans-serif; color: #1c2733; background: #fff; display: flex; }
.stage { flex: 1; padding: .75rem; box-sizing: border-box; }
.stage canvas { height: auto; min-height: 0; }
"""


class _Actor(Protocol):
    """What the player shows of a `mocapdb.scenes.stage.Actor`."""

    @property
    def name(self) -> str: ...
    @property
    def colour(self) -> str: ...
    @property
    def body(self) -> Body: ...
    @property
    def positions(self) -> FloatArray: ...
    @property
    def error_mm(self) -> FloatArray | None: ...
    def __len__(self) -> int: ...


class _Stage(Protocol):
    """What the player shows of a `mocapdb.scenes.stage.Stage`, which can show itself by it."""

    @property
    def title(self) -> str: ...
    @property
    def fps(self) -> float: ...
    @property
    def actors(self) -> Sequence[_Actor]: ...
    @property
    def most_error_mm(self) -> float: ...
    def camera(self) -> Any: ...
    def legend(self) -> Sequence[tuple[Any, str]]: ...


def player_script() -> str:
    """Return the script that plays every stage of a page; it goes at the page's end."""
    return (files("mocapdb.scenes") / "player.js").read_text(encoding="utf-8")


def player_style() -> str:
    """Return the style of stages."""
    return (files("mocapdb.scenes") / "player.css").read_text(encoding="utf-8")


def stage_element(stage: _Stage, name: str, *, loop: bool = True, autoplay: bool = True) -> str:
    """Return a stage as HTML: an element, and its data under the id `name`."""
    camera = stage.camera()
    most = stage.most_error_mm
    data = {
        "title": stage.title,
        "fps": stage.fps,
        "loop": loop,
        "autoplay": autoplay,
        "yaw": round(camera.yaw, DECIMALS),
        "pitch": round(camera.pitch, DECIMALS),
        "distance": round(camera.distance, DECIMALS),
        "targets": _packed(camera.targets.astype("<f4")),
        "colours": ERROR_COLOURS,
        "legend": [text for _, text in stage.legend()],
        "actors": [_actor_data(actor, most) for actor in stage.actors],
    }
    text = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    return (
        f'<div class="stage" data-stage="{html.escape(name)}"></div>\n'
        f'<script type="application/json" id="{html.escape(name)}">{text}</script>'
    )


def page(stage: _Stage) -> str:
    """Return a page that plays a stage, filling the window."""
    return PAGE.format(
        title=html.escape(stage.title or "mocapdb"),
        style=player_style() + FULL_SCREEN,
        body=stage_element(stage, "motion"),
        script=player_script(),
    )


def _actor_data(actor: _Actor, most_error_mm: float) -> dict[str, Any]:
    used = np.unique(np.concatenate([actor.body.tails, actor.body.heads]))
    place = np.zeros(actor.positions.shape[1], dtype=np.int64)
    place[used] = np.arange(len(used))
    positions = actor.positions[:, used]
    low, high = positions.min(axis=(0, 1)), positions.max(axis=(0, 1))
    centre = 0.5 * (low + high)
    scale = max(float((high - centre).max()), 1e-6) / STEPS
    steps = np.rint((positions - centre) / scale).clip(-STEPS, STEPS).astype("<i2")
    data: dict[str, Any] = {
        "name": actor.name,
        "colour": actor.colour,
        "frames": len(actor),
        "joints": len(used),
        "tails": place[actor.body.tails].tolist(),
        "heads": place[actor.body.heads].tolist(),
        "radii": actor.body.radii_m.round(RADIUS_DECIMALS).tolist(),
        "sides": actor.body.sides.tolist(),
        "scale": scale,
        "centre": centre.round(DECIMALS).tolist(),
        "positions": _packed(steps),
    }
    if actor.error_mm is not None:
        share = np.clip(actor.error_mm / max(most_error_mm, 1e-12), 0, 1)
        data["error"] = _packed(np.rint(ERROR_STEPS * share).astype(np.uint8))
    return data


def _packed(values: np.ndarray[Any, Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
