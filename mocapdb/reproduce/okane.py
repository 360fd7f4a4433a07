"""Tables 4.1 to 4.4 of O'Kane's thesis (2008), computed beside his figures.

He gives the kind of the clips and their frames, not their names, and leaves open his mesh, its
unit and his wavelet. `CONVENTIONS` lists what was found by fitting and what was assumed; the same
conventions serve every row.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import accumulate

import numpy as np

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.base.progress import Progress, silent
from mocapdb.compression.codec import encode
from mocapdb.compression.okane.body_and_root import BodyAndRoot, join_root, split_root
from mocapdb.compression.okane.okane_codec import Budgets
from mocapdb.compression.okane.okane_layout import BYTES_PER_COEFFICIENT, BYTES_PER_NUMBER
from mocapdb.compression.okane.pca import Components, principal_components
from mocapdb.compression.okane.root_finding import Ranking, fewest
from mocapdb.compression.pose.modes import PoseTransform
from mocapdb.compression.targets import Target
from mocapdb.compression.transforms import (
    WAVELET,
    TransformName,
    coefficient_count,
    forward_transform,
    inverse_transform,
)
from mocapdb.errors import CorpusError
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import Pose
from mocapdb.motion.representations import (
    Representation,
    RepresentationName,
    represent,
    restore_pose,
)
from mocapdb.motion.rotations import elementary
from mocapdb.motion.skin import pose_error
from mocapdb.reproduce._tables import (
    Row,
    check_tables,
    corpus_folder,
    printed_figures,
    reported,
    table_row,
)
from mocapdb.reproduce.okane_clips import CMU_UNIT_M, Found, ThesisClips, ThesisSet

__all__ = [
    "BUDGETS",
    "CONVENTIONS",
    "PAPER",
    "TABLES",
    "Reading",
    "compressed_bytes",
    "reproduce",
    "thesis_set",
]

PAPER = "O'Kane 2008"
TABLES = ("4.1", "4.2", "4.3", "4.4")
FIGURES = "okane2008_tables.csv"
CONVENTIONS = (
    "clips: 02_03 and 07_01 have the frames of his run and walk; where none has, a stand-in of "
    "the same class and number of clips, as near to his frames as there is: * within 10 %, ** not. "
    "All clips of a set are of one format: AMC where that is near enough, else BVH",
    "mesh, by fitting table 4.1: six vertices a bone: its two ends and four around it at 30 % of "
    "its length, 1.3 file units away; one unit of his error is 0.55 file units",
    "error on every 4th frame, the sum divided by their number less one (eq. 3.1)",
    "his positions are the aligned ones (section 3.2.1); of channels, the root's six are its track",
    "one threshold for all coefficients of a set of clips; each clip transformed by itself; one "
    "PCA for the set",
    "T is measured against what PCA has left of the motion, plus what PCA left of P: of the two "
    "readings of section 3.2.3 the one nearer to table 4.2",
    "the root counts in table 4.4 only, by his text for 4.1 and 4.2, by fitting for 4.3",
    "his wavelet is not named: bior4.4 here; his figure 3.3 shows Haar's, and 'Wavelets' more",
    "ratios of table 4.4 are to 62 doubles, 496 bytes a frame",
    "the pose codec keeps every frame and the root within the sum of the budgets, clip by clip, by "
    "splines and DCT or by splines alone, whichever is smaller",
)

UNIT = 0.55
STRIDE = 4
POSE_TRANSFORMS: tuple[PoseTransform, ...] = ("auto", "spline")
PLAIN_BYTES = 62 * 8
FLOAT32_BYTES = 62 * 4


@dataclass(frozen=True)
class Reading:
    """How the thesis is read where it leaves something open; the defaults are `CONVENTIONS`.

    Attributes
    ----------
    unit : float
        One unit of his error, in CMU's units of length.
    stride : int
        The error is taken on every so many frames.
    spare_frames : int
        What the number of frames is lessened by where errors are averaged (eq. 3.1).
    against_source : bool
        Whether time's error is measured against the source rather than what PCA has left.
    wavelet : str
    turned : bool
        Whether the body is turned half round in the middle third of each clip, and its root track
        back: what his alignment does to whoever is upside down.
    """

    unit: float = UNIT
    stride: int = STRIDE
    spare_frames: int = 1
    against_source: bool = False
    wavelet: str = WAVELET
    turned: bool = False


HIS = Reading()
_REPRESENTATIONS: Mapping[str, RepresentationName] = {
    "channels": "channels",
    "positions": "aligned",
    "scaled": "scaled",
    "normalised": "normalised",
}
BUDGETS = {
    "4.1": Budgets(root=0.0, pca=0.0, temporal=1.0),
    "4.2": Budgets(root=0.0, pca=0.5, temporal=0.5),
    "4.3": Budgets(root=0.1, pca=0.2, temporal=0.2),
    "high_error": Budgets(root=0.5, pca=1.0, temporal=1.0),
    "low_error": Budgets(root=0.1, pca=0.2, temporal=0.2),
}


def reproduce(
    corpus: StrPath,
    *,
    tables: Sequence[str] = TABLES,
    rows: Sequence[str] | None = None,
    progress: Progress = silent,
) -> list[Row]:
    """Compute tables of the thesis on the clips of a folder.

    Parameters
    ----------
    corpus : path-like
        A folder with CMU's AMC or BVH files, at any depth, under CMU's names.
    tables : sequence of str
        Out of `TABLES`.
    rows : sequence of str, optional
        Only these rows, such as ``"1 run"``.
    progress : callable, optional
        Called with figures done, figures in all, and the set of clips at work.

    Returns
    -------
    list of dict
        ``table``, ``row``, ``column``, ``paper``, ``ours`` (bytes a frame, in table 4.4 the ratio;
        None where the clips are missing), ``production`` (the same of the pose codec at the same
        error, everything counted) and ``note``, which names the clips.

    Raises
    ------
    CorpusError
        If there is no such table or row, the folder does not exist, or it has no clip of CMU's.
    """
    check_tables(tables, TABLES)
    wanted = [figure for figure in printed_figures(FIGURES) if figure["table"] in tables]
    if rows is not None:
        names = sorted({figure["row"] for figure in wanted})
        missing = set(rows) - set(names)
        if missing:
            raise CorpusError(f"Expected rows out of {', '.join(names)}, but got {min(missing)!r}.")
        wanted = [figure for figure in wanted if figure["row"] in rows]
    folder = ThesisClips(corpus_folder(corpus, "CMU's AMC or BVH files"))
    answers = []
    for figure in reported(wanted, progress, lambda each: f"{each['table']} {each['row']}"):
        found = folder.find(thesis_set(figure))
        ours, note = _compute(figure, found)
        production = _production(figure, found) if found.clips else None
        name, paper = f"{figure['row']} ({figure['frames']})", float(figure["value"])
        row = table_row(figure["table"], name, figure["column"], paper, ours, note)
        answers.append(row | {"production": production})
    return answers


def compressed_bytes(
    clips: Sequence[Clip],
    representation: RepresentationName,
    transform: TransformName,
    budgets: Budgets,
    *,
    count_root: bool,
    reading: Reading = HIS,
) -> float:
    """Return the bytes a frame that the thesis's codec needs for a set of clips.

    Parameters
    ----------
    clips : sequence of Clip
        Compressed together: one PCA, one threshold.
    representation, transform : str
    budgets : Budgets
        In units of the thesis.
    count_root : bool
        Whether the root is compressed and counted, or left as it is.
    reading : Reading
        Of what he leaves open.
    """
    clip_set = _ClipSet(clips, representation, reading)
    size = 0
    if count_root and clip_set.roots.size:
        ranking = Ranking(clip_set.transformed(transform, clip_set.roots))

        def root_error(count: int) -> float:
            roots = clip_set.inverted(transform, ranking.largest(count))
            return clip_set.error(clip_set.bodies, roots, clip_set.poses)

        size += BYTES_PER_COEFFICIENT * _kept(root_error, budgets.root, len(ranking))

    components: Components | None = None
    scores, reference, allowed = clip_set.bodies, clip_set.poses, budgets.temporal
    if budgets.pca:
        components, pca_error = _fewest_components(clip_set, budgets.pca)
        scores = components.project(clip_set.bodies)
        if reading.against_source:
            allowed = budgets.total - budgets.root
        else:
            reference = clip_set.pose(components.restore(scores), clip_set.roots)
            allowed += budgets.pca - pca_error
        size += BYTES_PER_NUMBER * components.n_numbers
    ranking = Ranking(clip_set.transformed(transform, scores))

    def error(count: int) -> float:
        bodies = clip_set.inverted(transform, ranking.largest(count))
        if components is not None:
            bodies = components.restore(bodies)
        return clip_set.error(bodies, clip_set.roots, reference)

    size += BYTES_PER_COEFFICIENT * _kept(error, allowed, len(ranking))
    return size / clip_set.n_frames


def _fewest_components(clip_set: _ClipSet, budget: float) -> tuple[Components, float]:
    components = principal_components(clip_set.bodies)

    def error(count: int) -> float:
        chosen = components.first(count)
        projected = chosen.restore(chosen.project(clip_set.bodies))
        return clip_set.error(projected, clip_set.roots, clip_set.poses)

    count = _kept(error, budget, len(components))
    return components.first(count), error(count)


def _kept(error_of: Callable[[int], float], allowed: float, most: int) -> int:
    count = fewest(error_of, allowed, most)
    return most if count is None else count


class _ClipSet:
    """Clips that are compressed as one set, their frames below one another."""

    def __init__(
        self, clips: Sequence[Clip], representation: RepresentationName, reading: Reading
    ) -> None:
        self._clips = clips
        self._reading = reading
        self._name = representation
        shown = [represent(clip, representation) for clip in clips]
        if reading.turned:
            shown = [_turned(each) for each in shown]
        parts = [split_root(each.skeleton, each) for each in shown]
        self._ends = list(accumulate(len(clip) for clip in clips))
        self.bodies = np.vstack([part.body for part in parts])
        self.roots = np.vstack([part.root for part in parts])
        self.poses = self.pose(self.bodies, self.roots)

    @property
    def n_frames(self) -> int:
        return self._ends[-1]

    def pose(self, bodies: FloatArray, roots: FloatArray) -> list[Pose]:
        """Return the pose of each clip on every so many frames."""
        poses = []
        for clip, body, root in zip(
            self._clips, self._split(bodies), self._split(roots), strict=True
        ):
            some = BodyAndRoot(body, root).every(self._reading.stride)
            poses.append(restore_pose(clip.skeleton, join_root(clip.skeleton, self._name, some)))
        return poses

    def error(self, bodies: FloatArray, roots: FloatArray, reference: Sequence[Pose]) -> float:
        """Return the skinned error (eq. 3.1) of the set against poses, in the thesis's unit."""
        total, n_frames = 0.0, 0
        for clip, pose, original in zip(
            self._clips, self.pose(bodies, roots), reference, strict=True
        ):
            error = pose_error(clip.skeleton, original, pose).skinned
            total += len(pose.positions) * error * clip.skeleton.metres_per_unit / CMU_UNIT_M
            n_frames += len(pose.positions)
        return total / max(n_frames - self._reading.spare_frames, 1) / self._reading.unit

    def transformed(self, transform: TransformName, values: FloatArray) -> FloatArray:
        return np.vstack(
            [
                forward_transform(transform, own, self._reading.wavelet)
                for own in self._split(values)
            ]
        )

    def inverted(self, transform: TransformName, coefficients: FloatArray) -> FloatArray:
        wavelet = self._reading.wavelet
        lengths = [coefficient_count(transform, len(clip), wavelet) for clip in self._clips]
        own = np.split(coefficients, list(accumulate(lengths))[:-1])
        return np.vstack(
            [
                inverse_transform(transform, part, len(clip), wavelet)
                for clip, part in zip(self._clips, own, strict=True)
            ]
        )

    def _split(self, values: FloatArray) -> list[FloatArray]:
        return np.split(values, self._ends[:-1])


def _turned(shown: Representation) -> Representation:
    """Return aligned positions whose middle third is turned half round, motion unchanged."""
    values, root = shown.values.copy(), shown.root.copy()
    middle = slice(len(values) // 3, 2 * len(values) // 3)
    half_turn = elementary(shown.skeleton.up_axis, np.array([np.pi]))[0]
    vectors = values[middle].reshape(-1, values.shape[1] // 3, 3) @ half_turn.T
    values[middle] = vectors.reshape(-1, values.shape[1])
    root[middle, 3] += np.pi
    return Representation(shown.name, values, root, shown.skeleton)


# -- the figures ---------------------------------------------------------------------------------


def thesis_set(figure: Mapping[str, str]) -> ThesisSet:
    """Return the set of clips that a figure is of."""
    count, kind = figure["row"].split(" ", 1)
    return ThesisSet(figure["row"], kind.removesuffix("s"), int(count), int(figure["frames"]))


def _compute(figure: Mapping[str, str], found: Found) -> tuple[float | None, str]:
    """Return our figure and its note."""
    if not found.clips:
        return None, found.note
    table, column = figure["table"], figure["column"]
    if table in ("4.1", "4.2"):
        size = compressed_bytes(
            found.clips, _REPRESENTATIONS[column], "dct", BUDGETS[table], count_root=False
        )
    elif table == "4.3":
        transform: TransformName = "dwt" if column == "dwt" else "dct"
        size = compressed_bytes(found.clips, "aligned", transform, BUDGETS[table], count_root=False)
    else:
        size = compressed_bytes(found.clips, "aligned", "dct", BUDGETS[column], count_root=True)
        to_float32 = FLOAT32_BYTES / size
        note = f"{found.note}; {size:.1f} B/frame, {to_float32:.2f} to float32 channels"
        return round(PLAIN_BYTES / size, 2), note
    return round(size, 2), found.note


def _production(figure: Mapping[str, str], found: Found) -> float:
    """Return what the pose codec makes of a figure's clips at the error that its budgets allow.

    The root, headers and checksums count, and every frame is measured.
    """
    table, column = figure["table"], figure["column"]
    budgets = BUDGETS[column if table == "4.4" else table]
    size = _pose_bytes(found.clips, budgets.total * UNIT)
    if table == "4.4":
        return round(PLAIN_BYTES / size, 2)
    return round(size, 2)


@cache
def _pose_bytes(clips: tuple[Clip, ...], skinned_error: float) -> float:
    """Return the pose codec's bytes a frame for clips coded one by one."""

    def size(clip: Clip) -> int:
        units = skinned_error * CMU_UNIT_M / clip.skeleton.metres_per_unit
        target = Target("skinned", units, joint_share=0)
        return min(len(encode(clip, target, transform=name).data) for name in POSE_TRANSFORMS)

    return sum(map(size, clips)) / sum(map(len, clips))
