"""Frames of a stage as images: capsules from far to near, a grid on the ground, shadows under all.

The page's player (`player.js`) draws the same picture in the same way.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.scenes.capsule_body import error_colours
from mocapdb.scenes.stage import VIEW_ANGLE, Camera, Stage

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

__all__ = ["draw_frames"]

FINER = 2  # drawn larger and then made smaller, for smooth edges
NEAR_M = 0.1  # what is nearer to the camera is drawn as if it were there
FARTHEST_METRES = 10.0  # from a camera that is further away, the grid's lines are 2, 4, ... m apart
GRID_STRENGTH = 0.4  # share of the grid's colour in that of the ground, in the middle
SKY, GROUND = (238, 242, 245), (223, 229, 234)  # colours are RGB, 0 to 255
GRID, SHADOW = (110, 125, 140), (201, 209, 216)
INK = (28, 39, 51)
# a capsule: brightness lying and added standing; of its edge; width of the edge in pixels; and the
# highlight's mix with white, its shift to the upper left and its width, relative to the capsule's
LYING, STANDING, EDGE, EDGE_PX = 0.84, 0.16, 0.45, 1.6
SHINE, SHINE_SHIFT, SHINE_WIDTH = 0.22, 0.14, 0.42
# writing, in pixels: size, the corner it begins in, and from line to line
LETTER_PX, CORNER_PX, TITLE_PX, LINE_PX = 14, (12, 10), 20, 19
DOT_PX, RAMP_PX, TIME_PX = 11, 48, 26  # a colour's dot, an error's ramp, the time above the edge


def draw_frames(stage: Stage, size: tuple[int, int] = (640, 480)) -> Iterator[Image]:
    """Yield every frame of a stage as an RGB image of `size` pixels, with names and time.

    Parameters
    ----------
    stage : Stage
    size : (int, int)
        Width and height.
    """
    from PIL import ImageDraw

    camera = stage.camera()
    width, height = FINER * size[0], FINER * size[1]
    sky = _backdrop(width, height)
    most = stage.most_error_mm
    for frame in range(stage.n_frames):
        view = _View(camera, frame, width, height)
        image = sky.copy()
        pen = ImageDraw.Draw(image)
        _draw_ground(pen, view, camera.distance)
        _draw_bodies(pen, view, stage, frame, most)
        image = image.reduce(FINER)
        _write(ImageDraw.Draw(image), stage, frame)
        yield image


class _View:
    """The projection of one frame: world to pixels."""

    def __init__(self, camera: Camera, frame: int, width: int, height: int) -> None:
        cy, sy = math.cos(camera.yaw), math.sin(camera.yaw)
        cp, sp = math.cos(camera.pitch), math.sin(camera.pitch)
        self.target = camera.targets[min(frame, len(camera.targets) - 1)]
        back = np.array([sy * cp, sp, cy * cp])
        self.axes = np.stack([[cy, 0.0, -sy], [-sy * sp, cp, -cy * sp], -back])
        self.eye = self.target + camera.distance * back
        self.focal = min(height, 1.2 * width) / 2 / math.tan(VIEW_ANGLE / 2)
        self.middle = np.array([width / 2, height / 2])

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return pixels (..., 2), depth (...) in metres and pixels a metre (...) of points."""
        seen = (points - self.eye) @ self.axes.T
        depth = np.maximum(seen[..., 2], NEAR_M)
        scale = self.focal / depth
        pixels = self.middle + seen[..., :2] * scale[..., None] * [1.0, -1.0]
        return pixels, seen[..., 2], scale


class _Capsule(NamedTuple):
    """A capsule on the screen."""

    depth: float
    ends: FloatArray
    width: float
    colour: FloatArray


def _draw_bodies(pen: ImageDraw, view: _View, stage: Stage, frame: int, most_mm: float) -> None:
    capsules: list[_Capsule] = []
    for actor in stage.actors:
        now = min(frame, len(actor) - 1)
        joints = actor.positions[now]
        ends = joints[np.stack([actor.body.tails, actor.body.heads], axis=1)]  # (B, 2, 3)
        pixels, depth, scale = view(ends)
        shadows, _, flat = view(ends * [1.0, 0.0, 1.0])
        for line, width in zip(shadows, actor.body.radii_m * flat.sum(axis=1), strict=True):
            _stroke(pen, line, width, SHADOW)
        rises = np.abs(np.diff(ends[..., 1], axis=1)[:, 0])
        upright = rises / np.maximum(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), 1e-9)
        colours = actor.colours(now, most_mm) * (LYING + STANDING * upright)[:, None]
        widths = actor.body.radii_m * scale.sum(axis=1)
        capsules += map(_Capsule, depth.sum(axis=1).tolist(), pixels, widths.tolist(), colours)
    for capsule in sorted(capsules, key=lambda capsule: -capsule.depth):
        _stroke(pen, capsule.ends, capsule.width + EDGE_PX * FINER, EDGE * capsule.colour)
        _stroke(pen, capsule.ends, capsule.width, capsule.colour)
        shine = capsule.colour + SHINE * (255 - capsule.colour)
        _stroke(pen, capsule.ends - SHINE_SHIFT * capsule.width, SHINE_WIDTH * capsule.width, shine)


def _stroke(
    pen: ImageDraw, ends: FloatArray, width: float, colour: FloatArray | tuple[int, ...]
) -> None:
    """Draw a line with round ends."""
    ink = tuple(round(float(value)) for value in colour)
    (x0, y0), (x1, y1) = ends
    radius = width / 2
    pen.line((x0, y0, x1, y1), fill=ink, width=max(1, round(width)))
    if radius >= 1:
        for x, y in ((x0, y0), (x1, y1)):
            pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=ink)


def _draw_ground(pen: ImageDraw, view: _View, distance: float) -> None:
    """Draw a grid of one metre, or more from afar, that fades away from what is looked at."""
    step = 2 ** max(0, math.ceil(math.log2(distance / FARTHEST_METRES)))
    reach = max(3, math.ceil(1.1 * distance / step))
    x0, z0 = (step * round(float(view.target[axis]) / step) for axis in (0, 2))
    square = np.meshgrid(np.arange(-reach, reach + 1), np.arange(-reach, reach), indexing="ij")
    i, j = square[0].ravel(), square[1].ravel()
    far = np.hypot(i, j + 0.5) / reach
    i, j, far = i[far < 1], j[far < 1], far[far < 1]
    zero = np.zeros(len(i))
    starts = np.concatenate([np.stack([i, zero, j], axis=1), np.stack([j, zero, i], axis=1)])
    ends = starts + np.repeat([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]], len(i), axis=0)
    starts, ends = (step * corners + [x0, 0, z0] for corners in (starts, ends))
    pixels, depth, _ = view(np.stack([starts, ends], axis=1))
    strength = GRID_STRENGTH * (1 - np.tile(far, 2))
    for line, near, share in zip(pixels, depth.min(axis=1), strength, strict=True):
        if near > NEAR_M:
            colour = [round(g + (c - g) * share) for g, c in zip(GROUND, GRID, strict=True)]
            pen.line((*line[0], *line[1]), fill=tuple(colour), width=FINER)


def _backdrop(width: int, height: int) -> Image:
    from PIL import Image

    share = np.linspace(0, 1, height)[:, None]
    column = np.array(SKY) * (1 - share) + np.array(GROUND) * share
    rows = np.repeat(column[:, None].round().astype(np.uint8), width, axis=1)
    return Image.fromarray(rows)


def _write(pen: ImageDraw, stage: Stage, frame: int) -> None:
    """Write the actors' names and the time into the corners."""
    from PIL import ImageFont

    font = ImageFont.load_default(size=LETTER_PX)
    x, y = CORNER_PX
    if stage.title:
        pen.text((x, y), stage.title, fill=INK, font=font)
        y += TITLE_PX
    for actor, text in stage.legend():
        if actor.error_mm is None:
            pen.ellipse((x, y + 3, x + DOT_PX, y + 3 + DOT_PX), fill=actor.colour)
            indent = DOT_PX + 7
        else:
            for i, colour in enumerate(error_colours(np.linspace(0, 1, RAMP_PX), 1.0).tolist()):
                pen.line((x + i, y + 4, x + i, y + 13), fill=tuple(colour))
            indent = RAMP_PX + 8
        pen.text((x + indent, y), text, fill=INK, font=font)
        y += LINE_PX
    corner = (x, pen.im.size[1] - TIME_PX)  # type: ignore[union-attr, unused-ignore]
    pen.text(corner, f"{frame / stage.fps:.2f} s", fill=INK, font=font)
