"""A motion as a small picture: poses in a row, or a loop that plays. Both are SVG, some kB.

The body is seen from the side that it turns to the viewer when it faces to the right, left limbs
paler than right ones. Sizes are those of the body, so that a child, a horse and a hand fill it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.scenes.stage import ACTOR_COLOURS, DARKER, LIGHTER, Actor

__all__ = ["LOOP_FPS", "loop_svg", "strip_svg"]

WIDTH, HEIGHT = 300, 100  # of a picture, in units of its own
MARGIN, LINE = 6, 4  # round the bodies, and how thick a bone is drawn
LEAST_POSES, MOST_POSES = 3, 7
OVERLAP, FARTHEST = 0.8, 1.5  # from one pose to the next, of the widest pose
SHORTEST = 0.02  # bones that are shorter, of the body's extent, are not drawn
ASIDE = math.radians(60.0)  # of the viewer, from where the body faces
LOOP_FPS = 12.0  # frames a second of a loop
SIDES = (1, 0, -1)  # in the order in which they are drawn: what is farther first


def strip_svg(actor: Actor) -> str:
    """Return poses of an actor in a row, evenly spaced in time.

    Parameters
    ----------
    actor : Actor

    Returns
    -------
    str
        An SVG, three times as wide as it is high.
    """
    seen = _Seen(actor)
    spacing = OVERLAP * seen.width
    room = (WIDTH - 2 * MARGIN - seen.width) / max(spacing, 1.0)
    n_poses = min(max(LEAST_POSES, 1 + math.floor(room)), MOST_POSES, len(actor))
    frames = np.linspace(0, len(actor) - 1, n_poses).round().astype(int)
    step = min((WIDTH - 2 * MARGIN - seen.width) / max(n_poses - 1, 1), FARTHEST * seen.width)
    middles = WIDTH / 2 + step * (np.arange(n_poses) - (n_poses - 1) / 2)
    paths = (
        _path(
            side,
            "".join(
                seen.lines(frame, middle, side)
                for frame, middle in zip(frames, middles, strict=True)
            ),
        )
        for side in SIDES
    )
    return _svg(paths)


def loop_svg(actor: Actor) -> str:
    """Return an actor that moves on the spot, again and again, as fast as it does.

    Parameters
    ----------
    actor : Actor
        Every frame of it is shown: `LOOP_FPS` a second is enough.
    """
    seen = _Seen(actor)
    paths = []
    for side in SIDES:
        frames = [seen.lines(frame, WIDTH / 2, side) for frame in range(len(actor))]
        moves = (
            f'<animate attributeName="d" calcMode="discrete" repeatCount="indefinite" '
            f'dur="{len(actor) / actor.fps:.2f}s" values="{";".join(frames)}"/>'
        )
        paths.append(_path(side, frames[0], moves if frames[0] else ""))
    return _svg(paths)


class _Seen:
    """An actor as it is seen: every joint's place across and below, in units of the picture."""

    def __init__(self, actor: Actor) -> None:
        body, positions = actor.body, actor.positions
        right = _to_the_right(_facing(actor))
        middle = positions.mean(axis=1, keepdims=True)
        across = (positions - middle) @ right  # (F, J) metres
        height = positions[..., 1]
        bottom = float(height.min())
        widest = float(np.ptp(across, axis=1).max())
        tallest = float(height.max()) - bottom
        scale = (HEIGHT - 2 * MARGIN) / max(tallest, widest * HEIGHT / WIDTH * LEAST_POSES, 1e-6)
        centre = 0.5 * (across.max(axis=1) + across.min(axis=1))
        self._across = (across - centre[:, None]) * scale
        self._below = HEIGHT - MARGIN - (height - bottom) * scale
        self.width = max(widest * scale, LINE)
        lengths = np.linalg.norm(positions[0, body.heads] - positions[0, body.tails], axis=1)
        self._long = lengths >= SHORTEST * max(tallest, widest)
        if not self._long.any():
            self._long[:] = True
        self._body = body

    def lines(self, frame: int, middle: float, side: int) -> str:
        """Return the bones of a side in a frame, as the data of a path."""
        bones = np.flatnonzero(self._long & (self._body.sides == side))
        x = (middle + self._across[frame]).round().astype(int)
        y = self._below[frame].round().astype(int)
        return "".join(
            f"M{x[tail]} {y[tail]}L{x[head]} {y[head]}"
            for tail, head in zip(self._body.tails[bones], self._body.heads[bones], strict=True)
        )


def _facing(actor: Actor) -> FloatArray:
    """Return the horizontal unit vector that an actor faces at first; +z where nobody knows."""
    body, start = actor.body, actor.positions[0]
    left, right = body.heads[body.sides > 0], body.heads[body.sides < 0]
    if not (len(left) and len(right)):
        return np.array([0.0, 0.0, 1.0])
    x, _, z = start[left].mean(axis=0) - start[right].mean(axis=0)
    length = math.hypot(x, z)
    return np.array([-z, 0.0, x]) / length if length > 0 else np.array([0.0, 0.0, 1.0])


def _to_the_right(facing: FloatArray) -> FloatArray:
    """Return what is to the right in the picture, for a body that faces so."""
    yaw = math.atan2(facing[0], facing[2]) - ASIDE
    return np.array([math.cos(yaw), 0.0, -math.sin(yaw)])


def _path(side: int, lines: str, inside: str = "") -> str:
    return f'<path stroke="{_COLOURS[side]}" d="{lines}">{inside}</path>'


def _svg(paths: Iterable[str]) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}">'
        f'<g fill="none" stroke-width="{LINE}" stroke-linecap="round" stroke-linejoin="round">'
        f"{''.join(paths)}</g></svg>"
    )


def _colour(side: int) -> str:
    base = [int(ACTOR_COLOURS[0][i : i + 2], 16) for i in (1, 3, 5)]
    if side > 0:
        base = [round(value + LIGHTER * (255 - value)) for value in base]
    elif side < 0:
        base = [round(DARKER * value) for value in base]
    return "#" + "".join(f"{value:02x}" for value in base)


_COLOURS = {side: _colour(side) for side in SIDES}
