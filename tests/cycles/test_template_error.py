import numpy as np
import pytest

from mocapdb.cycles.template_error import match_template


@pytest.mark.parametrize("n_frames", [40, 97])
def test_template_equals_its_naive_twin(n_frames):
    rng = np.random.default_rng(2)
    cycle = rng.normal(size=(37, 4))
    values = cycle[(np.arange(n_frames) + 11) % 37] + rng.normal(0, 0.1, (n_frames, 4))
    errors = [
        np.sqrt(((values - cycle[(np.arange(n_frames) + shift) % 37]) ** 2).sum(axis=1).mean())
        for shift in range(37)
    ]
    match = match_template(values, cycle)
    assert match.offset == np.argmin(errors) == 11
    assert match.error == pytest.approx(min(errors))
