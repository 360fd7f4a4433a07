"""The codec's shares of a target, and for which targets they serve."""

from mocapdb.compression import Budgets, Target
from mocapdb.compression.okane import okane_codec
from mocapdb.compression.okane.okane_codec import OkaneCoder
from mocapdb.corpus import synthetic


def test_shares_serve_targets_up_to_two_fifths_larger_or_smaller(monkeypatch):
    coder = OkaneCoder(synthetic.make_clip("walk", seed=1, duration_s=0.3), "channels")
    searched = []

    def best(plan):
        searched.append(plan.target.value)
        return Budgets(0.2, 0.0, 0.8)

    monkeypatch.setattr(coder, "_best_shares", best)
    for value in (1.0, 1.38, 0.72, 1.42, 1.0):
        plan = okane_codec._Plan(Target("mean_mm", value), "dct", "db4", False, None)
        coder._usual_shares(plan)
    assert searched == [1.0, 1.42, 1.0]
