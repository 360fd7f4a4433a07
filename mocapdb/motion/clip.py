"""The clip: a skeleton and its channels over time."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mocapdb.base.arrays import BoolArray, FloatArray, is_number
from mocapdb.errors import ClipError, SkeletonError
from mocapdb.motion.skeleton import Skeleton

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

    from mocapdb.motion.clip_tables import TableForm, TableGroup
    from mocapdb.motion.joint_tracks import RotationForm, RotationSpace, Units, VerticalAxis
    from mocapdb.motion.representations import Representation, RepresentationName

__all__ = ["CODED", "Clip"]

MOST_FRAMES = 100_000_000
"""That a clip is resampled or retimed to: nine days at 120 Hz."""

LEAST_GAP_CM = 1.0  # in height between two clips, that is told
SHOWN = 5  # joints and channels of a clip that is printed
CODED = "coded by"  # how the provenance of a decoded clip names its codec


@dataclass(frozen=True, eq=False, repr=False)
class Clip:
    """A stretch of motion: the channels of a skeleton, frame by frame.

    Parameters
    ----------
    skeleton : Skeleton
        The skeleton that the channels move.
    channels : (F, C) array-like
        Exactly as read: angles in degrees, translations in skeleton units. Kept read-only.
    fps : float, frames per second
        Frame rate.
    name : str
        Name of the clip; a file's stem where it came from a file.
    label : str, optional
        Class of the motion, such as ``"walk"``.
    source : str
        Path of the file that it came from.
    fps_source : str
        Who stated the frame rate: ``"file"``, ``"labels"``, ``"manifest"``, ``"settings"`` (a
        ``mocapdb.toml``), ``"caller"``; ``"default"`` where nobody did.
    unit_source, up_source : str
        Who stated the unit of length and the vertical axis: ``"file"``, ``"settings"``,
        ``"caller"``; ``"inferred"`` where the motion tells, ``"default"`` where nothing does.
    frame_time_text : str
        The frame time as a BVH file spells it, so that it is written back as it was.
    provenance : tuple of str
        The processing steps so far, oldest first.

    Raises
    ------
    ClipError
        If the channels do not fit the skeleton or are not finite, or the rate is not positive.

    Examples
    --------
    >>> from mocapdb.corpus import synthetic
    >>> clip = synthetic.make_clip("walk", seed=1)
    >>> second = clip[:120]
    >>> len(second), second.duration_s
    (120, 1.0)
    >>> clip.resample(30).positions().shape
    (150, 31, 3)
    """

    skeleton: Skeleton
    channels: FloatArray
    fps: float
    name: str
    label: str | None
    source: str
    fps_source: str
    unit_source: str
    up_source: str
    frame_time_text: str
    provenance: tuple[str, ...]

    def __init__(
        self,
        skeleton: Skeleton,
        channels: ArrayLike,
        fps: float,
        *,
        name: str = "",
        label: str | None = None,
        source: str = "",
        fps_source: str = "caller",
        unit_source: str = "caller",
        up_source: str = "caller",
        frame_time_text: str = "",
        provenance: tuple[str, ...] = (),
    ) -> None:
        array = np.asarray(channels, dtype=np.float64)
        if array.ndim != 2 or array.shape[1] != skeleton.n_channels:
            raise ClipError(
                f"Expected channels of shape (frames, {skeleton.n_channels}) for skeleton "
                f"{skeleton.name!r}, but got {array.shape}."
            )
        if len(array) == 0:
            raise ClipError(f"Expected clip {name!r} to have at least one frame, but got none.")
        if not (isinstance(fps, Real) and math.isfinite(fps) and fps > 0):
            raise ClipError(f"Expected a positive frame rate, but got {fps!r}.")
        if not np.isfinite(array).all():
            frame, channel = np.argwhere(~np.isfinite(array))[0]
            raise ClipError(
                f"Expected finite channels, but frame {frame} of {name or 'the clip'!r} has "
                f"{array[frame, channel]} in {skeleton.channel_names[channel]}."
            )
        if array.flags.writeable:
            array = array.copy()
            array.flags.writeable = False
        assign = object.__setattr__  # the dataclass is frozen
        assign(self, "skeleton", skeleton)
        assign(self, "channels", array)
        assign(self, "fps", float(fps))
        assign(self, "name", name)
        assign(self, "label", label)
        assign(self, "source", source)
        assign(self, "fps_source", fps_source)
        assign(self, "unit_source", unit_source)
        assign(self, "up_source", up_source)
        assign(self, "frame_time_text", frame_time_text)
        assign(self, "provenance", tuple(provenance))

    def __len__(self) -> int:
        return len(self.channels)

    @property
    def n_frames(self) -> int:
        """Number of frames F."""
        return len(self.channels)

    @property
    def duration_s(self) -> float:
        """Frames over frame rate, in seconds."""
        return len(self.channels) / self.fps

    def __getitem__(self, frames: slice) -> Clip:
        """Return the frames ``a:b`` as a clip of their own.

        Raises
        ------
        ClipError
            If the range is empty, or the step is not 1 (use `replace` with channels and a rate).
        """
        if not isinstance(frames, slice):
            raise ClipError(f"Expected a range of frames such as clip[10:20], but got {frames!r}.")
        start, stop, step = frames.indices(len(self))
        if step != 1 or start >= stop:
            raise ClipError(
                f"Expected a range within the {len(self)} frames of {self.name!r}, "
                f"but got {frames.start}:{frames.stop}:{frames.step}."
            )
        if stop - start == len(self):
            return self
        return self.replace(channels=self.channels[start:stop], step=f"frames {start}:{stop}")

    def replace(
        self,
        *,
        skeleton: Skeleton | None = None,
        channels: ArrayLike | None = None,
        fps: float | None = None,
        name: str | None = None,
        label: str | None = None,
        step: str | None = None,
    ) -> Clip:
        """Return a clip with some parts replaced, and `step` added to its provenance.

        A rate says how fast the same frames are shown: `resample` makes other frames.
        """
        return Clip(
            self.skeleton if skeleton is None else skeleton,
            self.channels if channels is None else channels,
            self.fps if fps is None else fps,
            name=self.name if name is None else name,
            label=self.label if label is None else label,
            source=self.source,
            fps_source=self.fps_source if fps is None else "caller",
            unit_source=self.unit_source,
            up_source=self.up_source,
            frame_time_text=self.frame_time_text if fps is None else "",
            provenance=self.provenance if step is None else (*self.provenance, step),
        )

    @property
    def was_coded(self) -> bool:
        """Whether the numbers come from a payload, so that a codec drew some of the curve."""
        return any(step.startswith(CODED) for step in self.provenance)

    # -- reading -------------------------------------------------------------------------------

    def positions(self, units: Units = "m", up: VerticalAxis = "y") -> FloatArray:
        """Return where every joint is in the world, frame by frame.

        Parameters
        ----------
        units : {"m", "cm", "mm", "in", "ft", "file"}
            Of length; ``"file"`` are those of the skeleton.
        up : {"y", "z", "file"}
            The vertical axis. ``"file"`` is that of the skeleton: of AMASS's files y, since they
            are turned to y up when they are read.

        Returns
        -------
        (F, J, 3)
            In the order of ``skeleton.names``. In Acclaim's convention the end of the joint's
            bone, in BVH's the joint itself.

        Raises
        ------
        SkeletonError
            If the unit or the axis is unknown.

        Examples
        --------
        >>> from mocapdb.corpus import synthetic
        >>> walk = synthetic.make_clip("walk", seed=1)
        >>> positions = walk.positions()
        >>> positions.shape
        (600, 31, 3)
        >>> float(positions[0, walk.skeleton.joint("head"), 1].round(1))  # metres
        1.7
        """
        from mocapdb.motion.joint_tracks import joint_positions

        return joint_positions(self.skeleton, self.channels, units, up)

    def rotations(
        self,
        space: RotationSpace = "local",
        form: RotationForm = "quat_xyzw",
        up: VerticalAxis = "y",
    ) -> Any:
        """Return how every joint is turned, frame by frame.

        Parameters
        ----------
        space : {"local", "global"}
            In the frame of its parent, or in the world. Zero is the skeleton's rest pose.
        form : {"quat_xyzw", "quat_wxyz", "matrix", "6d", "rotvec", "scipy"}
            Quaternions by the order of their parts; matrices; their first two columns, one after
            the other (Zhou et al. 2019); rotation vectors in radians; or one scipy ``Rotation``
            of F * J, joint after joint, frame after frame.
        up : {"y", "z", "file"}
            The vertical axis, as of `positions`.

        Returns
        -------
        (F, J, 4), (F, J, 3, 3), (F, J, 6), (F, J, 3) or scipy.spatial.transform.Rotation
            Quaternions are continuous over time. Joints that do not turn are at rest.

        Raises
        ------
        SkeletonError
            If the space, the form or the axis is unknown.

        Notes
        -----
        A global rotation is the parent's times the local one. It turns the bones that start in
        the joint; in Acclaim's convention the bone that ends in it.

        Examples
        --------
        >>> from mocapdb.corpus import synthetic
        >>> walk = synthetic.make_clip("walk", seed=1)
        >>> walk.rotations().shape, walk.rotations("global", "matrix").shape
        ((600, 31, 4), (600, 31, 3, 3))
        >>> len(walk.rotations(form="scipy")) == 600 * 31
        True
        """
        from mocapdb.motion.joint_tracks import joint_rotations

        return joint_rotations(self.skeleton, self.channels, space, form, up)

    def velocities(self, units: Units = "m", up: VerticalAxis = "y") -> FloatArray:
        """Return how fast every joint moves in the world, (F, J, 3), in units a second.

        By central differences, in the first and the last frame one-sided ones. Nothing is
        smoothed.

        Raises
        ------
        ClipError
            If there is one frame only.
        SkeletonError
            If the unit or the axis is unknown.

        Examples
        --------
        >>> import numpy as np
        >>> from mocapdb.corpus import synthetic
        >>> walk = synthetic.make_clip("walk", seed=1)
        >>> speeds = np.linalg.norm(walk.velocities(), axis=-1)  # (F, J) metres a second
        >>> bool(1.0 < speeds[:, 0].mean() < 2.0)
        True
        """
        from mocapdb.motion.joint_tracks import joint_velocities

        return joint_velocities(self.positions(units, up), self.fps)

    def contacts(self) -> BoolArray:
        """Return (F, 2) whether the left and the right foot rest on the ground.

        Of what is no human body (F, L) for its legs, in the order of its joints.

        Notes
        -----
        A foot rests where its ball is within 6 cm of its lowest and slow; see
        `mocapdb.motion.foot_contacts`. `mocapdb.gait` finds strikes between frames.

        Examples
        --------
        >>> from mocapdb.corpus import synthetic
        >>> contacts = synthetic.make_clip("walk", seed=1).contacts()
        >>> contacts.shape, bool(contacts.any(axis=1).all())  # a walk always stands on a foot
        ((600, 2), True)
        """
        from mocapdb.motion.foot_contacts import contacts_by_foot

        positions = self.positions("file", "file")
        found = contacts_by_foot(self.skeleton, positions, self.fps)
        return np.column_stack([np.zeros((len(self), 0), dtype=np.bool_), *found.values()])

    def to_dataframe(
        self,
        form: TableForm = "tidy",
        columns: Sequence[TableGroup] = ("positions", "rotations"),
        *,
        units: Units = "m",
        up: VerticalAxis = "y",
        space: RotationSpace = "local",
    ) -> pandas.DataFrame:
        """Return the clip as a pandas table; see `mocapdb.motion.clip_tables` for its columns.

        Parameters
        ----------
        form : {"tidy", "wide"}
            A row for each joint of each frame, or a row for each frame.
        columns : sequence of {"positions", "rotations", "velocities", "channels", "contacts"}
            What is in it; the last two in wide tables only.
        units, up, space
            As of `positions` and `rotations`.

        Raises
        ------
        MissingExtraError
            If pandas is not installed: ``pip install 'mocapdb[pandas]'``.
        ClipError
            If the form or a column is unknown.
        """
        from mocapdb.motion.clip_tables import clip_table, data_frame

        return data_frame(
            clip_table(
                self.skeleton, self.channels, self.fps, form, columns,
                units=units, up=up, space=space,
            )
        )  # fmt: skip

    def plot(self, *, n_poses: int = 10, ax: Axes | None = None) -> Axes:
        """Draw poses along a strip of time, and return matplotlib's axes.

        `mocapdb.plots` has the other pictures, `mocapdb.scenes` those that move.

        Raises
        ------
        ClipError
            If the number of poses is no whole number above 0.
        """
        from mocapdb.plots.strip_plots import skeleton_strip

        return skeleton_strip(self, n_poses=n_poses, ax=ax)

    def represent(self, name: RepresentationName) -> Representation:
        """Return the frames in one of O'Kane's representations, with names, units and root track.

        Parameters
        ----------
        name : {"channels", "positions", "aligned", "scaled", "normalised"}
            See `mocapdb.motion.representations`.

        Raises
        ------
        SkeletonError
            If there is no representation of that name.

        Examples
        --------
        >>> from mocapdb.corpus import synthetic
        >>> walk = synthetic.make_clip("walk", seed=1)
        >>> aligned = walk.represent("aligned")
        >>> aligned.values.shape == (len(walk), 183)
        True
        >>> bool(abs(aligned.restore() - walk.channels).max() < 1e-6)
        True
        """
        from mocapdb.motion.representations import represent

        found = represent(self, name)
        if name == "channels":  # which are the clip's own
            found = replace(found, values=found.values.copy())
        return found

    # -- editing -------------------------------------------------------------------------------

    def cut(self, start_s: float = 0.0, end_s: float | None = None) -> Clip:
        """Return a stretch between two times in seconds; ``clip[a:b]`` counts frames.

        Raises
        ------
        ClipError
            If it is empty or not within the clip, or a time is no number.

        Examples
        --------
        >>> from mocapdb.corpus import synthetic
        >>> len(synthetic.make_clip("walk", seed=1).cut(1.0, 2.5))  # 1.5 s at 120 Hz
        180
        """
        end = self.duration_s if end_s is None else end_s
        if not (is_number(start_s) and is_number(end)):
            raise ClipError(
                f"Expected two times in seconds, such as clip.cut(1.0, 2.5), but got {start_s!r} "
                f"and {end_s!r}."
            )
        last = self.duration_s + 0.5 / self.fps
        first, stop = (round(time * self.fps) if abs(time) < 1e9 else -1 for time in (start_s, end))
        if not (0.0 <= start_s < end <= last and first < stop):
            raise ClipError(
                f"Expected a stretch within the {self.duration_s:g} s of {self._called}, but got "
                f"{start_s:g} to {end:g} s."
            )
        return self[first : min(stop, len(self))]

    def resample(self, fps: float) -> Clip:
        """Return the same motion at another frame rate.

        Parameters
        ----------
        fps : float, frames per second

        Raises
        ------
        ClipError
            If the rate is no positive number, or there would be more than 100 million frames.

        Notes
        -----
        Rotations go along the shortest arc on the sphere (slerp), translations along lines. Times
        that are frames of the clip keep those as they are. Nothing is smoothed before: what is
        faster than half the new rate is folded.

        Examples
        --------
        >>> from mocapdb.corpus import synthetic
        >>> walk = synthetic.make_clip("walk", seed=1)
        >>> print(str(walk.resample(30)).splitlines()[0])
        Clip('walk_1', walk: 150 frames x 62 channels, 5.00 s at 30 Hz, skeleton 'synthetic')
        """
        from mocapdb.motion.edits import channels_at, frames_of_rate

        self._expect_positive("a frame rate", fps)
        if fps == self.fps:
            return self
        self._expect_not_too_many("a frame rate", fps, len(self) * fps / self.fps)
        times = frames_of_rate(len(self), self.fps / fps)
        return self.replace(
            channels=channels_at(self.skeleton, self.channels, times),
            fps=fps,
            step=f"resampled from {self.fps:g} to {fps:g} Hz: rotations by slerp",
        )

    def retime(self, speed: float | None = None, *, duration_s: float | None = None) -> Clip:
        """Return the motion `speed` times as fast, or of a duration, at the same frame rate.

        Frames between frames are made as by `resample`.

        Raises
        ------
        ClipError
            If not just one of the two is given, it is no positive number, or there would be more
            than 100 million frames.
        """
        from mocapdb.motion.edits import channels_at, frames_of_rate

        if (speed is None) == (duration_s is None):
            raise ClipError("Expected a speed or a duration, and one of them only.")
        if duration_s is not None:
            self._expect_positive("a duration", duration_s)
            self._expect_not_too_many("a duration", duration_s, duration_s * self.fps)
            count = max(round(duration_s * self.fps), 1)
            times = np.linspace(0.0, len(self) - 1, count)
            step = f"retimed from {self.duration_s:g} to {count / self.fps:g} s"
        else:
            self._expect_positive("a speed", speed)
            assert speed is not None
            self._expect_not_too_many("a speed", speed, len(self) / speed)
            times = frames_of_rate(len(self), speed)
            step = f"retimed to {speed:g} times its speed"
        channels = channels_at(self.skeleton, self.channels, times)
        return self.replace(channels=channels, step=step)

    def concat(self, *others: Clip, align: bool = False) -> Clip:
        """Return this clip with others after it.

        Parameters
        ----------
        *others : Clip
            Of the same skeleton and rate.
        align : bool
            Whether each is turned about the vertical and moved level, so that its root begins at
            the place and in the heading in which the one before ends. Nothing else is fitted:
            neither the height nor the pose. A gap in height of over a centimetre is noted in the
            provenance. By default frames stay as they are.

        Raises
        ------
        ClipError
            If skeletons or rates differ, or one is no clip.

        Notes
        -----
        Nothing is blended: `mocapdb.cycles.transition` does.
        """
        from mocapdb.motion.edits import continued

        found, gaps = self.channels, []
        for other in others:
            if not isinstance(other, Clip):
                raise ClipError(
                    f"Expected clips, such as first.concat(second, third), but got a "
                    f"{type(other).__name__}."
                )
            if other.skeleton != self.skeleton:
                raise ClipError(
                    f"Expected clips of one skeleton, but {other._called} has {other.skeleton!r} "
                    f"and {self._called} has {self.skeleton!r}."
                )
            if not math.isclose(other.fps, self.fps, rel_tol=1e-4):
                raise ClipError(
                    f"Expected clips of {self.fps:g} Hz, but {other._called} has {other.fps:g}. "
                    f"Resample it: clip.resample({self.fps:g})."
                )
            after = other.channels
            if align:
                after, gap = continued(self.skeleton, found, after)
                gap_cm = 100 * gap * self.skeleton.metres_per_unit
                if abs(gap_cm) > LEAST_GAP_CM:
                    way = "higher" if gap_cm > 0 else "lower"
                    gaps.append(f"{other._called} begins {abs(gap_cm):.1f} cm {way}")
            found = np.concatenate([found, after])
        if not others:
            return self
        step = f"followed by {', '.join(other.name or 'a clip' for other in others)}"
        if align:
            step += ", aligned in place and heading" + "".join(f"; {gap}" for gap in gaps)
        return self.replace(channels=found, step=step)

    def mirror(self) -> Clip:
        """Return the motion with left and right exchanged, as a mirror in the plane x = 0 shows it.

        The body keeps its own bones; see `mocapdb.motion.edits.mirrored`.

        Raises
        ------
        ClipError
            If no joint has one on the other side.
        """
        from mocapdb.motion.edits import mirrored

        return self.replace(channels=mirrored(self.skeleton, self.channels), step="mirrored")

    def with_root(self, joint: str) -> Clip:
        """Return a clip whose root is this joint; what does not hang on it is left out.

        Every joint stays where it is in the world.

        Raises
        ------
        SkeletonError
            If there is no such joint, or a pattern fits several.
        """
        from mocapdb.motion.joint_edits import find_joints, only_below

        root, *more = find_joints(self.skeleton, [joint])
        if more:
            fitting = ", ".join(self.skeleton.names[i] for i in (root, *more))
            raise SkeletonError(f"Expected one joint as root, but {joint!r} fits {fitting}.")
        skeleton, channels = only_below(self.skeleton, self.channels, root)
        left = self.skeleton.n_joints - skeleton.n_joints
        step = f"{self.skeleton.names[root]!r} is the root, {left} joints left out"
        return self.replace(skeleton=skeleton, channels=channels, step=step) if root else self

    def drop_joints(self, *names: str | Sequence[str]) -> Clip:
        """Return a clip without some joints and all that hangs on them.

        Parameters
        ----------
        *names : str or sequence of str
            Joints, or patterns such as ``"*Thumb*"``.

        Raises
        ------
        SkeletonError
            If there is no such joint, or it is the root.
        """
        from mocapdb.motion.joint_edits import find_joints, without_joints

        flat: list[Any] = [
            name
            for each in names
            for name in (each if isinstance(each, list | tuple | set | frozenset) else [each])
        ]
        joints = find_joints(self.skeleton, flat)
        skeleton, channels = without_joints(self.skeleton, self.channels, joints)
        step = f"without {', '.join(self.skeleton.names[joint] for joint in joints)}"
        return self.replace(skeleton=skeleton, channels=channels, step=step) if joints else self

    def rename_joints(self, names: Mapping[str, str] | Callable[[str], str]) -> Clip:
        """Return a clip whose joints have other names: new ones by old ones, or a function.

        Raises
        ------
        SkeletonError
            If there is no such joint, two would have the same name, or a new name is no text,
            empty, or has line breaks or blanks around it.

        Examples
        --------
        >>> from mocapdb.corpus import synthetic
        >>> walk = synthetic.make_clip("walk", seed=1)
        >>> walk.rename_joints({"root": "Hips"}).skeleton.names[:2]
        ('Hips', 'lhipjoint')
        """
        from mocapdb.motion.joint_edits import renamed

        return self.replace(skeleton=renamed(self.skeleton, names), step="joints renamed")

    def place(
        self, at_m: tuple[float, float] | None = None, facing_deg: float | None = None
    ) -> Clip:
        """Return the motion begun at another place on the ground, or in another direction.

        Parameters
        ----------
        at_m : (2,) metres, optional
            Where the body's root is level in the first frame: x and z where y is up, else x and y.
        facing_deg : float, optional, degrees
            Where the body looks in the first frame: 0 along z, 90 along x (y up).

        Raises
        ------
        ClipError
            If the body has no root that can be moved, or the place or the direction is not finite.
        """
        from mocapdb.motion.edits import placed

        if at_m is not None:
            parts = list(at_m) if isinstance(at_m, Sequence | np.ndarray) else []
            if len(parts) != 2 or not all(is_number(x) and math.isfinite(x) for x in parts):
                raise ClipError(f"Expected a place as two numbers in metres, but got {at_m!r}.")
        if facing_deg is not None and not (is_number(facing_deg) and math.isfinite(facing_deg)):
            raise ClipError(f"Expected a direction in degrees, but got {facing_deg!r}.")
        unit_m = self.skeleton.metres_per_unit
        at = None if at_m is None else (at_m[0] / unit_m, at_m[1] / unit_m)
        channels = placed(self.skeleton, self.channels, at, facing_deg)
        return self.replace(channels=channels, step="begun at another place")

    def in_place(self) -> Clip:
        """Return the motion with the body's root over its first place, level.

        Raises
        ------
        ClipError
            If the body has no root that can be moved.
        """
        from mocapdb.motion.edits import in_place

        channels = in_place(self.skeleton, self.channels)
        return self.replace(channels=channels, step="in place")

    # -- value ---------------------------------------------------------------------------------

    @property
    def _called(self) -> str:
        return repr(self.name) if self.name else "the clip"

    def _expect_positive(self, what: str, value: float | None) -> None:
        if not (is_number(value) and math.isfinite(value) and value > 0):
            raise ClipError(f"Expected {what} above 0 for {self._called}, but got {value!r}.")

    def _expect_not_too_many(self, what: str, value: float, frames: float) -> None:
        if frames > MOST_FRAMES:
            raise ClipError(
                f"Expected {what} that makes up to {MOST_FRAMES} frames of {self._called}, "
                f"but got {value:g}."
            )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Clip):
            return NotImplemented
        return (
            self.skeleton == other.skeleton
            and self.fps == other.fps
            and self.name == other.name
            and self.label == other.label
            and np.array_equal(self.channels, other.channels)
        )

    def __hash__(self) -> int:
        return hash((self.skeleton, self.fps, self.name, self.label, self.channels.shape))

    def __repr__(self) -> str:
        skeleton, label = self.skeleton, f", {self.label}" if self.label else ""
        joints = ", ".join(skeleton.names[:SHOWN])
        values = ", ".join(
            f"{name} {value:.4g}"
            for name, value in zip(skeleton.channel_names[:SHOWN], self.channels[0], strict=False)
        )
        more = [", ..." * (count > SHOWN) for count in (skeleton.n_joints, skeleton.n_channels)]
        return (
            f"Clip({self.name!r}{label}: {len(self)} frames x {skeleton.n_channels} channels, "
            f"{self.duration_s:.2f} s at {self.fps:g} Hz, skeleton {skeleton.name!r})\n"
            f"  joints    {skeleton.n_joints}: {joints}{more[0]}\n"
            f"  channels  {values}{more[1]} (degrees, {skeleton.metres_per_unit:.4g} m, "
            f"{skeleton.up} up)\n"
            "  to read   positions() rotations() velocities() contacts() to_dataframe() plot()\n"
            "  to edit   cut() resample() retime() concat() mirror() place() in_place()\n"
            "            with_root() drop_joints() rename_joints()"
        )
