"""Cycles that several tests look at."""

import pytest

from mocapdb.corpus import synthetic
from mocapdb.cycles import extract_cycle


@pytest.fixture(scope="package")
def walk():
    return extract_cycle(synthetic.make_clip("walk", seed=1, sensor_noise_deg=0.15)).cycle


@pytest.fixture(scope="package")
def run():
    return extract_cycle(synthetic.make_clip("run", seed=2, sensor_noise_deg=0.15)).cycle
