"""What O'Kane (2008) concludes from his tables, and whether it comes back on the clips at hand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from mocapdb.reproduce._tables import Row
from mocapdb.reproduce.side_by_side.verdict import PaperFigures, Verdict, all_or_part, judged

__all__ = ["verdicts"]

SEVERAL = ("4 runs", "3 walks", "1 boxing")
SINGLE = ("1 run", "1 walk")
TURNED = "1 walk, turned"
RIGHT = (("walk class", "test walks"), ("run class", "test run"), ("boxing class", "test boxing"))
FORMATS = {"4.5": "positions", "4.6": "channels", "4.7": "scaled", "4.8": "normalised"}
CLOSE = 2.0  # % by which formats differ that stand-ins for his clips may well exchange
POSITIONAL = ("positions", "scaled", "normalised")


def verdicts(rows: Sequence[Row]) -> list[Verdict]:
    """Return a verdict on each of his claims.

    Parameters
    ----------
    rows : sequence of dict
        Of all of his tables and of the wavelets, as far as they were computed.
    """
    figures = PaperFigures(rows)
    each = (
        _positions_before_channels, _formats_alike, _pca_pays_from_several, _pca_not_for_channels,
        _dct_before_dwt,
        _dwt_for_jumps, _walks_best, _low_error_evens_out, _normalised_classify_best,
        _channels_classify_worst, _classes_told_apart,
    )  # fmt: skip
    return [judge(figures) for judge in each]


def _positions_before_channels(figures: PaperFigures) -> Verdict:
    claim = "Aligned positions take fewer bytes than channels"
    found: dict[str, float] = {}
    for table in ("4.1", "4.2"):
        own = figures.ratios((table, "positions"), (table, "channels"), SINGLE + SEVERAL)
        found |= {f"{table} {name}": ratio for name, ratio in own.items()}
    if not found:
        return Verdict(claim, None, "nothing at hand")
    told = ", ".join(f"{name} {ratio:.2f}" for name, ratio in found.items())
    holds = all_or_part([ratio < 1 for ratio in found.values()])
    return Verdict(claim, holds, f"times the channels' bytes: {told}")


def _formats_alike(figures: PaperFigures) -> Verdict:
    claim = "Scaled and normalised positions cost about what positions do"
    found = {
        f"{name} {column}": ratio
        for column in POSITIONAL[1:]
        for name, ratio in figures.ratios(
            ("4.2", column), ("4.2", "positions"), SINGLE + SEVERAL
        ).items()
    }
    return judged(claim, found, lambda ratio: abs(ratio - 1) < 0.08, "times the bytes (4.2)")


def _pca_pays_from_several(figures: PaperFigures) -> Verdict:
    claim = "PCA pays in positions from several clips or many frames on, not for one short clip"
    pair = ("4.2", "positions"), ("4.1", "positions")
    one, many = figures.ratios(*pair, SINGLE), figures.ratios(*pair, SEVERAL)
    if not one or not many:
        return Verdict(claim, None, "needs single clips and sets of them")
    told = ", ".join(f"{name} {ratio:.2f}" for name, ratio in (one | many).items())
    fulfilled = [ratio > 1 for ratio in one.values()] + [ratio < 1 for ratio in many.values()]
    return Verdict(claim, all_or_part(fulfilled), f"times the bytes with it: {told}")


def _pca_not_for_channels(figures: PaperFigures) -> Verdict:
    claim = "PCA never pays for channels"
    found = figures.ratios(("4.2", "channels"), ("4.1", "channels"), SINGLE + SEVERAL)
    return judged(claim, found, lambda ratio: ratio > 1, "times the bytes with it")


def _dct_before_dwt(figures: PaperFigures) -> Verdict:
    claim = "DCT beats DWT on walks, runs and boxing"
    sets = ("2 walks", "4 walks", "1 run", "4 runs", "2 boxing")
    told, beaten = [], {}
    for wavelet in ("haar", "db2", "db4", "sym8", "bior4.4"):
        found = figures.ratios(("wavelets", wavelet), ("wavelets", "dct"), sets)
        if found:
            beaten[wavelet] = sum(ratio > 1 for ratio in found.values()) / len(found)
            values = "/".join(f"{ratio:.2f}" for ratio in found.values())
            told.append(f"{wavelet} {values}")
    if not told:
        return Verdict(claim, None, "nothing at hand")
    kinds = [wavelet for wavelet, share in beaten.items() if share > 0.5]
    others = [wavelet for wavelet in beaten if wavelet not in kinds]
    said = f"so with {', '.join(kinds) or 'none'}, not with {', '.join(others) or 'none'}"
    is_so = all_or_part([wavelet in kinds for wavelet in beaten])
    return Verdict(claim, is_so, f"{said}; times the DCT's bytes: {', '.join(told)}")


def _dwt_for_jumps(figures: PaperFigures) -> Verdict:
    claim = "DWT wins where alignment turns the body round"
    found = {}
    for wavelet in ("haar", "db2", "db4", "sym8", "bior4.4"):
        own = figures.ratios(("wavelets", wavelet), ("wavelets", "dct"), [TURNED])
        if own:
            found[wavelet] = own[TURNED]
    if not found:
        return Verdict(claim, None, "nothing at hand")
    told = ", ".join(f"{wavelet} {ratio:.2f}" for wavelet, ratio in found.items())
    winning = sum(ratio < 1 for ratio in found.values())
    counted = f"{winning} of {len(found)} wavelets; times the DCT's bytes: {told}"
    return Verdict(claim, all_or_part([ratio < 1 for ratio in found.values()]), counted)


def _walks_best(figures: PaperFigures) -> Verdict:
    claim = "Many walks compress best, a single run worst (4.4, high error)"
    ratios = figures.column("4.4", "high_error")
    if "1 run" not in ratios or len(ratios) < 3:
        return Verdict(claim, None, "too few sets at hand")
    order = sorted(ratios, key=lambda name: -ratios[name])
    told = ", ".join(f"{name} {ratios[name]:.1f}" for name in order)
    return Verdict(claim, "walks" in order[0] and order[-1] == "1 run", f"ratios: {told}")


def _low_error_evens_out(figures: PaperFigures) -> Verdict:
    claim = "At a low error the sets differ less (he: 6 times at high, 2.5 at low)"
    spread = {}
    for column in ("high_error", "low_error"):
        ratios = figures.column("4.4", column).values()
        if len(ratios) > 1:
            spread[column] = max(ratios) / min(ratios)
    if len(spread) < 2:
        return Verdict(claim, None, "too few sets at hand")
    high, low = spread["high_error"], spread["low_error"]
    return Verdict(claim, low < high, f"best over worst: {high:.1f} at high, {low:.1f} at low")


def _normalised_classify_best(figures: PaperFigures) -> Verdict:
    claim = "Normalised positions classify best"
    scores = _scores(figures)
    if len(scores) < 4:
        return Verdict(claim, None, "needs tables 4.5 to 4.8")
    told = ", ".join(f"{name} {score:.1f}" for name, score in scores.items())
    best, next_best = sorted(scores, key=scores.__getitem__, reverse=True)[:2]
    ahead = scores[best] - scores[next_best]
    is_so: bool | Literal["partly"] = best == "normalised"
    if is_so and ahead < CLOSE:
        is_so = "partly"
    return Verdict(claim, is_so, f"mean % on the diagonal: {told}; {best} leads by {ahead:.1f}")


def _channels_classify_worst(figures: PaperFigures) -> Verdict:
    claim = "Channels classify worst"
    scores = _scores(figures)
    if len(scores) < 4:
        return Verdict(claim, None, "needs tables 4.5 to 4.8")
    told = ", ".join(f"{name} {score:.1f}" for name, score in scores.items())
    worst = min(scores, key=scores.__getitem__)
    return Verdict(claim, worst == "channels", f"mean % on the diagonal: {told}")


def _classes_told_apart(figures: PaperFigures) -> Verdict:
    claim = "Classes are told apart in each format"
    ahead = {}
    for table, name in FORMATS.items():
        right: list[float] = []
        wrong: list[float] = []
        for row in (own for own, _ in RIGHT):
            for column in (test for _, test in RIGHT):
                cell = figures.get(table, row, column)
                if cell is not None:
                    (right if (row, column) in RIGHT else wrong).append(cell)
        if len(right) == len(RIGHT) and wrong:
            ahead[name] = min(right) - max(wrong)
    if not ahead:
        return Verdict(claim, None, "needs tables 4.5 to 4.8")
    told = ", ".join(f"{name} {points:.1f}" for name, points in ahead.items())
    holds = all_or_part([points > 0 for points in ahead.values()])
    return Verdict(claim, holds, f"worst right cell less worst wrong, in %: {told}")


def _scores(figures: PaperFigures) -> dict[str, float]:
    """Return the mean share of right poses of each format of the recognition tables."""
    scores = {}
    for table, name in FORMATS.items():
        cells = [figures.column(table, column).get(row) for row, column in RIGHT]
        known = [cell for cell in cells if cell is not None]
        if len(known) == len(RIGHT):
            scores[name] = sum(known) / len(known)
    return scores
