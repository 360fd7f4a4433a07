"""What O'Kane (2008) leaves open, tried both ways: his wavelet, and how his text is to be read.

And the proportion of variance by dimension, by which his chapter 4 argues without printing it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.base.progress import Progress, silent
from mocapdb.compression.okane.body_and_root import parts_of
from mocapdb.motion.representations import RepresentationName
from mocapdb.reproduce._tables import Row, corpus_folder, printed_figures, reported, table_row
from mocapdb.reproduce.okane import BUDGETS, FIGURES, HIS, Reading, compressed_bytes, thesis_set
from mocapdb.reproduce.okane_clips import ThesisClips

__all__ = [
    "READINGS",
    "VARIANCE",
    "WAVELETS",
    "readings",
    "variance",
    "wavelets",
]

WAVELETS = ("haar", "db2", "db4", "sym8", "bior4.4")
TURNED = "1 walk, turned"
READINGS: Mapping[str, Reading] = {
    "as in the tables": HIS,
    "T against the source": replace(HIS, against_source=True),
    "every frame": replace(HIS, stride=1),
    "sum over N": replace(HIS, spare_frames=0),
    "a unit a fifth larger": replace(HIS, unit=1.2 * HIS.unit),
    "a unit a fifth smaller": replace(HIS, unit=0.8 * HIS.unit),
}
VARIANCE = (0.9, 0.95, 0.99, 0.999)
KINDS = ("run", "walk", "boxing")
FORMATS: tuple[RepresentationName, ...] = (
    "channels", "positions", "aligned", "scaled", "normalised",
)  # fmt: skip


def wavelets(corpus: StrPath, *, progress: Progress = silent) -> list[Row]:
    """Compute table 4.3 with several wavelets, and on a walk that his alignment would turn round.

    Returns
    -------
    list of dict
        As `okane.reproduce`; the column names the transform, ``paper`` is his of DCT or DWT.
    """
    folder = ThesisClips(corpus_folder(corpus, "CMU's AMC or BVH files"))
    printed = {(f["row"], f["column"]): f for f in printed_figures(FIGURES) if f["table"] == "4.3"}
    sets = {row: (thesis_set(figure), HIS) for (row, _), figure in printed.items()}
    walk = next(f for f in printed_figures(FIGURES) if f["row"] == "1 walk")
    sets[TURNED] = thesis_set(walk), replace(HIS, turned=True)
    rows: list[Row] = []
    for name, (wanted, reading) in reported(list(sets.items()), progress, lambda each: each[0]):
        found = folder.find(wanted)
        if not found.clips:
            continue
        for column in ("dct", *WAVELETS):
            is_dct = column == "dct"
            size = compressed_bytes(
                found.clips,
                "aligned",
                "dct" if is_dct else "dwt",
                BUDGETS["4.3"],
                count_root=False,
                reading=reading if is_dct else replace(reading, wavelet=column),
            )
            his = printed.get((name, "dct" if is_dct else "dwt"))
            paper = float(his["value"]) if his else None
            rows.append(table_row("wavelets", name, column, paper, round(size, 2), found.note))
    return rows


def readings(corpus: StrPath, *, progress: Progress = silent) -> list[Row]:
    """Compute the positions of tables 4.1 and 4.2 with his text read one way and the other.

    On the run and the walk alone, which are his clips by their frames.
    """
    folder = ThesisClips(corpus_folder(corpus, "CMU's AMC or BVH files"))
    wanted = [
        figure
        for figure in printed_figures(FIGURES)
        if figure["table"] in {"4.1", "4.2"}
        and figure["column"] == "positions"
        and figure["row"] in {"1 run", "1 walk"}
    ]
    rows: list[Row] = []
    for figure in reported(wanted, progress, lambda each: f"{each['table']} {each['row']}"):
        found = folder.find(thesis_set(figure))
        if not found.clips:
            continue
        budgets, paper = BUDGETS[figure["table"]], float(figure["value"])
        column = f"{figure['table']} {figure['row']}"
        for name, reading in READINGS.items():
            size = compressed_bytes(
                found.clips, "aligned", "dct", budgets, count_root=False, reading=reading
            )
            rows.append(table_row("readings", name, column, paper, round(size, 2), found.note))
        size = compressed_bytes(found.clips, "positions", "dct", budgets, count_root=False)
        rows.append(
            table_row(
                "readings", "positions in the world", column, paper, round(size, 2), found.note
            )
        )
    return rows


def variance(
    corpus: StrPath, *, progress: Progress = silent
) -> tuple[list[Row], dict[str, FloatArray]]:
    """Compute how many dimensions of each format hold how much of the variance of each class.

    Returns
    -------
    rows : list of dict
        ``ours`` is how many hold 99 %; the note has the others.
    shares : dict of (D,) arrays
        The proportion of variance that the first dimensions hold, by ``"walk, aligned"``.
    """
    folder = ThesisClips(corpus_folder(corpus, "CMU's AMC or BVH files"))
    rows: list[Row] = []
    shares: dict[str, FloatArray] = {}
    for kind in reported(KINDS, progress, str):
        format_, clips = folder.of_kind(kind)
        for name in FORMATS if clips else ():
            bodies = np.vstack([parts_of(clip, name).body for clip in clips])
            spread = np.linalg.svd(bodies - bodies.mean(axis=0), compute_uv=False) ** 2
            held = np.cumsum(spread) / spread.sum()
            shares[f"{kind}, {name}"] = held
            counts = [int(np.searchsorted(held, share)) + 1 for share in VARIANCE]
            texts = [f"{100 * s:g} %: {n}" for s, n in zip(VARIANCE, counts, strict=True)]
            note = f"{', '.join(texts)} of {bodies.shape[1]}; {len(clips)} clips of {format_}"
            label = f"{kind} ({len(bodies)} frames)"
            rows.append(
                table_row("variance", label, name, None, counts[VARIANCE.index(0.99)], note)
            )
    return rows, shares
