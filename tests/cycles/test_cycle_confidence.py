from mocapdb.cycles.cycle_confidence import gather_evidence
from mocapdb.cycles.period.autocorrelation import PeriodGuess


def test_few_laps_in_a_long_clip_say_less():
    guess = PeriodGuess(100.0, 1.0)
    whole = gather_evidence(guess, None, 100.0, 1.5)["laps"]
    half, little = (
        gather_evidence(guess, None, 100.0, 1.5, share)["laps"] for share in (0.5, 0.02)
    )
    assert whole == 1.0
    assert whole > half > 0.5 > little
    assert gather_evidence(guess, None, 100.0, 4.0, 0.02)["laps"] == 1.0
