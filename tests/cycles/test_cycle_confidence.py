import numpy as np
import pytest

from mocapdb.cycles.cycle_confidence import gather_evidence, list_doubts, smoothness
from mocapdb.cycles.period.autocorrelation import PeriodGuess
from mocapdb.cycles.phase.circular_coordinates import Topology


def test_few_laps_in_a_long_clip_say_less():
    guess = PeriodGuess(100.0, 1.0)
    whole = gather_evidence(guess, None, 100.0, 1.5)["laps"]
    half, little = (
        gather_evidence(guess, None, 100.0, 1.5, share)["laps"] for share in (0.5, 0.02)
    )
    assert whole == 1.0
    assert whole > half > 0.5 > little
    assert gather_evidence(guess, None, 100.0, 4.0, 0.02)["laps"] == 1.0


def found_loop(**changes):
    usual = {
        "coordinates": np.zeros(4),
        "period_frames": 100.0,
        "persistence_ratio": 4.0,
        "backtracking": 0.0,
        "bars": np.zeros((1, 2)),
    }
    return Topology(**(usual | changes))


def test_each_piece_of_evidence():
    guess = PeriodGuess(100.0, 0.8)
    found = gather_evidence(guess, found_loop(period_frames=115.0), 100.0, 1.4, 0.25)
    assert found["repetition"] == pytest.approx(1 - 0.4**2)
    assert found["laps"] == pytest.approx(1.25 * 0.4 - 0.2)
    assert found["agreement"] == pytest.approx(1 - 0.07 / 0.17)
    assert found["persistence"] == pytest.approx(0.875)
    assert gather_evidence(guess, found_loop(backtracking=0.2), 100.0, 2.0)["forwards"] == 0.6
    assert gather_evidence(guess, None, 100.0, 2.0)["topology"] == 0.3


def test_laps_that_differ_and_change_of_tempo_say_less():
    guess = PeriodGuess(100.0, 1.0)
    found = gather_evidence(guess, None, 100.0, 4.0, left_over=0.1, tempo_change=0.4)
    assert found["fit"] == pytest.approx(0.8)
    assert found["tempo"] == pytest.approx(0.7)
    steady = gather_evidence(guess, None, 100.0, 4.0, tempo_change=0.08)
    assert steady["tempo"] == steady["fit"] == 1.0


def test_rests_in_few_laps_say_less():
    guess = PeriodGuess(100.0, 1.0)
    assert gather_evidence(guess, None, 100.0, 3.4, rests=True)["rests"] == 0.65
    assert "rests" not in gather_evidence(guess, None, 100.0, 4.6, rests=True)
    assert "rests" not in gather_evidence(guess, None, 100.0, 2.6)


def test_a_loop_that_pops_says_less():
    assert smoothness({}) == 1.0
    assert smoothness({"ltibia": 2.0, "rtibia": 6.0}) == 0.25


@pytest.mark.parametrize(
    ("laps", "weakest", "period", "told"),
    [
        (1.6, 0.55, 107.0, []),
        (1.4, 0.55, 107.0, ["only 1.40 laps"]),
        (1.6, 0.45, 107.0, ["doubtful"]),
        (1.6, 0.55, 109.0, ["disagree"]),
    ],
)
def test_what_a_user_is_told(laps, weakest, period, told):
    topology = found_loop(period_frames=period)
    doubts = list_doubts(PeriodGuess(100.0, 0.9), topology, laps, {"laps": weakest})
    assert len(doubts) == len(told)
    assert all(words in doubt for words, doubt in zip(told, doubts, strict=True))
