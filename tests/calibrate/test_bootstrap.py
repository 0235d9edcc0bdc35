"""The interval of an rms difference covers the truth, also where neighbours in time are alike."""

import numpy as np
import pytest
from scipy.signal import lfilter

from twin.calibrate.score.bootstrap import rms_difference


def residuals(rng: np.random.Generator, n: int, scale: float) -> np.ndarray:
    """AR(1) with correlation 0.8 and standard deviation `scale`."""
    e = rng.standard_normal(n + 200) * np.sqrt(1.0 - 0.8**2)
    return scale * np.abs(lfilter([1.0], [1.0, -0.8], e)[200:])


def test_the_interval_covers_the_true_difference():
    """Two tests of 150 rows, 40 draws; blocks of one row, which take them as independent, cover far less."""
    rng = np.random.default_rng(1)
    hits, naive = 0, 0
    for _ in range(40):
        model = [residuals(rng, 150, 1.0) for _ in range(2)]
        baseline = [residuals(rng, 150, 1.5) for _ in range(2)]
        found, single = rms_difference(model, baseline), rms_difference(model, baseline, block=1)
        hits += found.low <= -0.5 <= found.high
        naive += single.low <= -0.5 <= single.high
    assert hits >= 32
    assert naive < hits - 4


def test_the_value_is_that_of_the_pooled_rms_and_blocks_stay_in_their_test():
    a, b = [np.array([1.0, 2.0, 2.0]), np.array([4.0])], [np.array([3.0, 3.0, 3.0]), np.array([3.0])]
    found = rms_difference(a, b)
    assert found.value == pytest.approx(2.5 - 3.0)
    assert (found.low, found.high, found.rows) == (None, None, 4)
    same = [np.full(50, 2.0)]
    assert rms_difference(same, same, block=5).low == 0.0
