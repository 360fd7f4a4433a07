"""A stage: bodies in motion, in metres with the ground at their feet, and a camera that follows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import ClipError
from mocapdb.motion.body import part_from_scene
from mocapdb.motion.clip import Clip
from mocapdb.motion.heading import heading_angles
from mocapdb.motion.kinematics import forward_kinematics, to_metres
from mocapdb.motion.rotations import elementary
from mocapdb.scenes.capsule_body import Body, body_of, bone_error_mm, error_colours

__all__ = ["ACTOR_COLOURS", "SHOWN_FPS", "VIEW_ANGLE", "Actor", "Camera", "Stage"]

SHOWN_FPS = 30.0  # frames a second that are shown, at most
ACTOR_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Okabe and Ito's, which the colour-blind tell apart."""

LIGHTER, DARKER = 0.38, 0.7  # left limbs: share of white; right limbs: brightness
APART_M = 1.3  # between the bodies of actors side by side
SOLE_M = 0.02  # from the lowest joints to the ground under them
GOES_M = 0.3  # a body that goes no further in all has no direction

STAYS_M = 1.5  # a body that goes no further is watched without following
SMOOTHED_S = 1.0  # over which the camera's way is averaged
VIEW_ANGLE = math.radians(32.0)  # from the lower edge of the picture to the upper
ASIDE, ABOVE = math.radians(60.0), math.radians(14.0)  # of the camera, from the first actor's way
LEAST_RADIUS_M, ROOM = 0.6, 1.15  # of what is in sight, and how much larger the picture is


@dataclass(frozen=True, eq=False)
class Actor:
    """One body in motion.

    Attributes
    ----------
    name : str
    body : Body
    positions : (F, J, 3) metres, Y up
    fps : float, frames per second
    colour : str
        ``"#rrggbb"``.
    error_mm : (F, B), optional
        Of each capsule of the body, drawn as colour.
    error_is : str
        What that is, for the legend.
    """

    name: str
    body: Body
    positions: FloatArray
    fps: float
    colour: str = ACTOR_COLOURS[0]
    error_mm: FloatArray | None = None
    error_is: str = "off by"

    @classmethod
    def of(
        cls,
        clip: Clip,
        *,
        name: str | None = None,
        colour: str = ACTOR_COLOURS[0],
        fps: float = SHOWN_FPS,
        against: Clip | None = None,
        error_is: str = "off by",
    ) -> Actor:
        """Return a clip as an actor, at most `fps` frames per second.

        Parameters
        ----------
        clip : Clip
        name : str, optional
            What to call it; the clip's name by default.
        colour : str
        fps : float, frames per second
            Frames in between are interpolated; a clip at a lower rate keeps its own.
        against : Clip, optional
            The original of a decoded clip: how far each bone is off becomes its colour.
        error_is : str
            What to call that distance: ``"off by"`` of a decoded clip, ``"moved by"`` of a repair.

        Raises
        ------
        ClipError
            If the original has another skeleton or length.
        """
        if against is not None and (against.skeleton != clip.skeleton or len(against) != len(clip)):
            raise ClipError(
                f"Expected the original of {clip.name!r} to have its skeleton and its "
                f"{len(clip)} frames, but {against.name!r} does not."
            )
        clip, _ = part_from_scene(clip)
        skeleton = clip.skeleton
        pose = forward_kinematics(skeleton, clip.channels)
        body = body_of(skeleton, pose.positions)
        error = None
        if against is not None:
            other = forward_kinematics(skeleton, part_from_scene(against)[0].channels)
            if skeleton.n_joints > 1:
                error = bone_error_mm(skeleton, other, pose)[:, body.heads - 1]
        positions = to_metres(skeleton, pose.positions)
        rate = min(fps, clip.fps)
        return cls(
            clip.name if name is None else name,
            body,
            _resampled(positions, clip.fps, rate),
            rate,
            colour,
            None if error is None else _resampled(error, clip.fps, rate),
            error_is,
        )

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def middle(self) -> FloatArray:
        """The middle of the bones in each frame (F, 3): the first joint may stand far away."""
        tails, heads = self.positions[:, self.body.tails], self.positions[:, self.body.heads]
        lengths = np.linalg.norm(heads[0] - tails[0], axis=1) + 1e-9
        middle = np.einsum("fbi,b->fi", 0.5 * (heads + tails), lengths / lengths.sum())
        return np.asarray(middle)

    def colours(self, frame: int, most_error_mm: float) -> FloatArray:
        """Return (B, 3), in 0 to 255: its error, else its colour, left lighter than right."""
        if self.error_mm is not None:
            return error_colours(self.error_mm[frame], most_error_mm).astype(np.float64)
        base = np.array([int(self.colour[i : i + 2], 16) for i in (1, 3, 5)], dtype=np.float64)
        sides = self.body.sides[:, None]
        lighter, darker = base + LIGHTER * (255 - base), DARKER * base
        return np.where(sides > 0, lighter, np.where(sides < 0, darker, base))

    def moved(self, shift: Sequence[float] | FloatArray, yaw: float = 0.0) -> Actor:
        """Return the actor turned by `yaw` radians about the vertical, then shifted, in metres."""
        turned = self.positions @ elementary("Y", np.array(yaw)).T if yaw else self.positions
        return replace(self, positions=turned + np.asarray(shift, dtype=np.float64))

    def from_origin(self, clip: Clip) -> Actor:
        """Return the actor of a clip as it would be if it started at the origin, facing +z."""
        clip, _ = part_from_scene(clip)
        skeleton = clip.skeleton
        start = forward_kinematics(skeleton, clip.channels[:1])
        yaw = float(heading_angles(start.rotations[:, 0], skeleton.up_index)[0])
        turned = self.moved((0, 0, 0), -yaw)
        x, _, z = turned.positions[0, 0]
        return turned.moved((-x, 0.0, -z))


@dataclass(frozen=True, eq=False)
class Camera:
    """Where a stage is looked at from: round `targets`, which move with the actors.

    Attributes
    ----------
    targets : (F, 3) metres
    yaw, pitch : float, radians
    distance : float, metres
    """

    targets: FloatArray
    yaw: float
    pitch: float
    distance: float


@dataclass(frozen=True, eq=False)
class Stage:
    """Actors that are played together, all at one rate.

    Attributes
    ----------
    actors : tuple of Actor
    fps : float, frames per second
    title : str

    Examples
    --------
    >>> from mocapdb.corpus import synthetic
    >>> walk = synthetic.make_clip("walk", seed=1)
    >>> run = synthetic.make_clip("run", seed=1)
    >>> stage = Stage.side_by_side([Actor.of(walk), Actor.of(run, colour=ACTOR_COLOURS[1])])
    >>> stage.fps, [actor.name for actor in stage.actors]
    (30.0, ['walk_1', 'run_1'])
    """

    actors: tuple[Actor, ...]
    fps: float
    title: str = ""

    @classmethod
    def together(cls, actors: Sequence[Actor], title: str = "") -> Stage:
        """Put actors on a stage, at the fastest rate among them, on the ground."""
        if not actors:
            raise ClipError("Expected an actor at least, but got none.")
        fps = max(actor.fps for actor in actors)
        same = [
            actor
            if actor.fps == fps
            else replace(
                actor,
                positions=_resampled(actor.positions, actor.fps, fps),
                error_mm=None
                if actor.error_mm is None
                else _resampled(actor.error_mm, actor.fps, fps),
                fps=fps,
            )
            for actor in actors
        ]
        ground = min(_ground(actor) for actor in same)
        return cls(tuple(actor.moved((0.0, -ground, 0.0)) for actor in same), fps, title)

    @classmethod
    def side_by_side(cls, actors: Sequence[Actor], title: str = "") -> Stage:
        """Put actors on a stage beside each other, across the way that the first one goes."""
        stage = cls.together(actors, title)
        along = _way(stage.actors[0].middle)
        across = APART_M * np.array([along[2], 0.0, -along[0]])
        middle = (len(actors) - 1) / 2
        apart = tuple(actor.moved((i - middle) * across) for i, actor in enumerate(stage.actors))
        return replace(stage, actors=apart)

    def _repr_html_(self) -> str:
        """Play in a notebook."""
        import html

        from mocapdb.scenes.player import page

        inside = html.escape(page(self), quote=True)
        return f'<iframe srcdoc="{inside}" width="100%" height="420" frameborder="0"></iframe>'

    def legend(self) -> list[tuple[Actor, str]]:
        """Return the actors and what to write beside their colours; nothing if that is plain."""
        if len(self.actors) == 1 and self.actors[0].error_mm is None:
            return []
        most = f"{self.most_error_mm:.3g}"
        return [
            (
                actor,
                actor.name
                if actor.error_mm is None
                else f"{actor.name}, {actor.error_is} 0 to {most} mm",
            )
            for actor in self.actors
        ]

    @property
    def n_frames(self) -> int:
        """Frames of the longest actor."""
        return max(len(actor) for actor in self.actors)

    @property
    def most_error_mm(self) -> float:
        """The error that is drawn as the brightest colour, rounded to read well."""
        errors = [actor.error_mm for actor in self.actors if actor.error_mm is not None]
        if not errors:
            return 0.0
        most = max(_usual_largest(error) for error in errors)
        step = 10.0 ** math.floor(math.log10(max(most, 1e-3)))
        return float(math.ceil(most / step) * step)

    def camera(self) -> Camera:
        """Return a view from the side of the first actor's way that keeps every body in sight."""
        n_frames = self.n_frames
        held = [_held(actor.positions, n_frames) for actor in self.actors]
        middles = np.mean([_held(actor.middle, n_frames) for actor in self.actors], axis=0)
        drawn = [np.unique([actor.body.tails, actor.body.heads]) for actor in self.actors]
        everything = np.concatenate(
            [positions[:, joints] for positions, joints in zip(held, drawn, strict=True)], axis=1
        )
        targets = middles.copy()
        if np.ptp(middles[:, [0, 2]], axis=0).max() <= STAYS_M:
            targets[:] = 0.5 * (middles.min(axis=0) + middles.max(axis=0))
        else:
            width = max(1, round(SMOOTHED_S * self.fps))
            padded = np.pad(targets, ((width // 2, width - 1 - width // 2), (0, 0)), mode="edge")
            sums = np.cumsum(np.vstack([np.zeros((1, 3)), padded]), axis=0)
            targets = (sums[width:] - sums[:-width]) / width
        low, high = everything[..., 1].min(), np.percentile(everything[..., 1], 99.5)
        targets[:, 1] = 0.5 * (low + high)
        reach = np.linalg.norm(everything - targets[:, None], axis=-1).max(axis=1)
        radius = max(LEAST_RADIUS_M, float(np.percentile(reach, 98)))
        along = _way(self.actors[0].middle)
        yaw = math.atan2(along[0], along[2]) + ASIDE
        distance = ROOM * radius / math.sin(VIEW_ANGLE / 2)
        return Camera(targets, yaw, ABOVE, distance)


def _usual_largest(error: FloatArray) -> float:
    """Return what the larger errors come up to: no single outlier, nor the many near zero."""
    largest = float(error.max())
    return float(np.percentile(error[error >= 0.05 * largest], 99)) if largest > 0 else 0.0


def _resampled(values: FloatArray, fps: float, rate: float) -> FloatArray:
    """Return frames at another rate, interpolated; the last is the last that there is."""
    if rate == fps:
        return values
    at = np.arange(max(1, math.floor((len(values) - 1) * rate / fps + 1e-9) + 1)) * (fps / rate)
    before = np.minimum(at.astype(np.int64), len(values) - 1)
    after = np.minimum(before + 1, len(values) - 1)
    share = (at - before).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(values[before] * (1 - share) + values[after] * share)


def _held(positions: FloatArray, n_frames: int) -> FloatArray:
    """Return positions of so many frames, the last one held."""
    return positions[np.minimum(np.arange(n_frames), len(positions) - 1)]


def _ground(actor: Actor) -> float:
    """Return the height of the floor under an actor: what its lowest joints mostly reach."""
    return float(np.percentile(actor.positions[..., 1].min(axis=1), 5)) - SOLE_M


def _way(middle: FloatArray) -> FloatArray:
    """Return the horizontal unit vector that a body (F, 3) travels along, +z for who stays."""
    ground = middle[-1] - middle[0]
    ground = ground * [1.0, 0.0, 1.0]
    length = np.linalg.norm(ground)
    return np.asarray(ground / length) if length > GOES_M else np.array([0.0, 0.0, 1.0])
