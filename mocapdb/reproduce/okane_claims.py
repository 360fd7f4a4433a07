"""What O'Kane (2008) concludes from his tables, and whether it comes back on the clips at hand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from mocapdb.reproduce._tables import Row

__all__ = ["Verdict", "verdicts"]

SEVERAL = ("4 runs", "3 walks", "1 boxing")
SINGLE = ("1 run", "1 walk")
TURNED = "1 walk, turned"
RIGHT = (("walk class", "test walks"), ("run class", "test run"), ("boxing class", "test boxing"))
CLOSE = 2.0  # % by which formats differ that stand-ins for his clips may well exchange
POSITIONAL = ("positions", "scaled", "normalised")


@dataclass(frozen=True)
class Verdict:
    """One of his claims.

    Attributes
    ----------
    claim : str
    holds : bool, "partly" or None
        "partly" where some of what speaks of it fulfils it; None where what is at hand does not
        tell.
    figures : str
        What was found.
    """

    claim: str
    holds: bool | Literal["partly"] | None
    figures: str

    def __str__(self) -> str:
        words = {True: "holds", False: "does not hold", None: "cannot be told"}
        word = "holds partly" if self.holds == "partly" else words[self.holds]
        return f"{self.claim}: {word}; {self.figures}"


class _Figures:
    """Ours, by table, row and column."""

    def __init__(self, rows: Sequence[Row]) -> None:
        self._ours = {
            (row["table"], row["row"].split(" (")[0], row["column"]): row["ours"]
            for row in rows
            if row["ours"] is not None
        }

    def ratios(
        self, top: tuple[str, str], bottom: tuple[str, str], sets: Sequence[str]
    ) -> dict[str, float]:
        """Return by set one (table, column) over another, where both are there."""
        found = {}
        for name in sets:
            above = self._ours.get((top[0], name, top[1]))
            below = self._ours.get((bottom[0], name, bottom[1]))
            if above is not None and below:
                found[name] = above / below
        return found

    def column(self, table: str, column: str) -> dict[str, float]:
        """Return a column of a table by row."""
        return {
            row: ours for (own, row, of), ours in self._ours.items() if (own, of) == (table, column)
        }


def verdicts(rows: Sequence[Row]) -> list[Verdict]:
    """Return a verdict on each of his claims.

    Parameters
    ----------
    rows : sequence of dict
        Of all of his tables and of the wavelets, as far as they were computed.
    """
    figures = _Figures(rows)
    each = (
        _formats_alike, _pca_pays_from_several, _pca_not_for_channels, _dct_before_dwt,
        _dwt_for_jumps, _walks_best, _low_error_evens_out, _normalised_classify_best,
        _channels_classify_worst,
    )  # fmt: skip
    return [judge(figures) for judge in each]


def _all_or_part(fulfilled: Sequence[bool]) -> bool | Literal["partly"]:
    """Return whether all, none or some of what speaks of a claim fulfils it."""
    return all(fulfilled) if all(fulfilled) == any(fulfilled) else "partly"


def _judged(
    claim: str, found: dict[str, float], holds: Callable[[float], bool], what: str
) -> Verdict:
    """Return a verdict that needs all of some figures to fulfil a condition."""
    if not found:
        return Verdict(claim, None, "nothing at hand")
    told = ", ".join(f"{name} {value:.2f}" for name, value in found.items())
    return Verdict(claim, all(map(holds, found.values())), f"{what}: {told}")


def _formats_alike(figures: _Figures) -> Verdict:
    claim = "Scaled and normalised positions cost about what positions do"
    found = {
        f"{name} {column}": ratio
        for column in POSITIONAL[1:]
        for name, ratio in figures.ratios(
            ("4.2", column), ("4.2", "positions"), SINGLE + SEVERAL
        ).items()
    }
    return _judged(claim, found, lambda ratio: abs(ratio - 1) < 0.08, "times the bytes (4.2)")


def _pca_pays_from_several(figures: _Figures) -> Verdict:
    claim = "PCA pays in positions from several clips or many frames on, not for one short clip"
    pair = ("4.2", "positions"), ("4.1", "positions")
    one, many = figures.ratios(*pair, SINGLE), figures.ratios(*pair, SEVERAL)
    if not one or not many:
        return Verdict(claim, None, "needs single clips and sets of them")
    told = ", ".join(f"{name} {ratio:.2f}" for name, ratio in (one | many).items())
    fulfilled = [ratio > 1 for ratio in one.values()] + [ratio < 1 for ratio in many.values()]
    return Verdict(claim, _all_or_part(fulfilled), f"times the bytes with it: {told}")


def _pca_not_for_channels(figures: _Figures) -> Verdict:
    claim = "PCA never pays for channels"
    found = figures.ratios(("4.2", "channels"), ("4.1", "channels"), SINGLE + SEVERAL)
    return _judged(claim, found, lambda ratio: ratio > 1, "times the bytes with it")


def _dct_before_dwt(figures: _Figures) -> Verdict:
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
    is_so = _all_or_part([wavelet in kinds for wavelet in beaten])
    return Verdict(claim, is_so, f"{said}; times the DCT's bytes: {', '.join(told)}")


def _dwt_for_jumps(figures: _Figures) -> Verdict:
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
    return Verdict(claim, _all_or_part([ratio < 1 for ratio in found.values()]), counted)


def _walks_best(figures: _Figures) -> Verdict:
    claim = "Many walks compress best, a single run worst (4.4, high error)"
    ratios = figures.column("4.4", "high_error")
    if "1 run" not in ratios or len(ratios) < 3:
        return Verdict(claim, None, "too few sets at hand")
    order = sorted(ratios, key=lambda name: -ratios[name])
    told = ", ".join(f"{name} {ratios[name]:.1f}" for name in order)
    return Verdict(claim, "walks" in order[0] and order[-1] == "1 run", f"ratios: {told}")


def _low_error_evens_out(figures: _Figures) -> Verdict:
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


def _normalised_classify_best(figures: _Figures) -> Verdict:
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


def _channels_classify_worst(figures: _Figures) -> Verdict:
    claim = "Channels classify worst"
    scores = _scores(figures)
    if len(scores) < 4:
        return Verdict(claim, None, "needs tables 4.5 to 4.8")
    told = ", ".join(f"{name} {score:.1f}" for name, score in scores.items())
    worst = min(scores, key=scores.__getitem__)
    return Verdict(claim, worst == "channels", f"mean % on the diagonal: {told}")


def _scores(figures: _Figures) -> dict[str, float]:
    """Return the mean share of right poses of each format of the recognition tables."""
    formats = {"4.5": "positions", "4.6": "channels", "4.7": "scaled", "4.8": "normalised"}
    right = (
        ("walk class", "test walks"),
        ("run class", "test run"),
        ("boxing class", "test boxing"),
    )
    scores = {}
    for table, name in formats.items():
        cells = [figures.column(table, column).get(row) for row, column in right]
        known = [cell for cell in cells if cell is not None]
        if len(known) == len(right):
            scores[name] = sum(known) / len(known)
    return scores
