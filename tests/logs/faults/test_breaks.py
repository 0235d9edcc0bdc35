"""Noise where there was none, and values that are left no more."""

from __future__ import annotations

import numpy as np
import pytest

from twin.logs.faults.breaks import noise, rail, rest_before, rests_by_rounding
from twin.logs.faults.series import Series

ROWS = np.arange(480)


def series(values: np.ndarray, unit: str = "degC") -> Series:
    return Series("temperatures", "a", unit, ROWS, 30.0 * ROWS, values)


def warm(size: float = 0.05) -> np.ndarray:
    return 20.0 + 8.0 * (1.0 - np.exp(-ROWS / 150.0)) + size * np.random.default_rng(1).standard_normal(len(ROWS))


def broken(first: int, last: int, size: float = 15.0, values: np.ndarray | None = None) -> np.ndarray:
    wrong = 40.0 + size * np.random.default_rng(2).standard_normal(len(ROWS))
    return np.where((first <= ROWS) & (last >= ROWS), wrong, warm() if values is None else values)


@pytest.mark.parametrize(("first", "last"), [(100, 479), (300, 479), (0, 200), (150, 260), (440, 479), (60, 479)])
@pytest.mark.parametrize("digits", [3, 1])
def test_noise_has_its_first_and_last_row(first, last, digits):
    (found,) = noise(series(np.round(broken(first, last), digits)))
    assert abs(found.first - first) <= 1
    assert abs(found.last - last) <= 1
    assert 5.0 < found.size < 25.0


def test_two_stretches_of_noise():
    values = broken(330, 420, values=broken(90, 200))
    assert [(round(f.first, -1), round(f.last, -1)) for f in noise(series(values))] == [(90, 200), (330, 420)]


def test_noise_that_grows_with_a_load_is_none():
    louder = warm(0.02) + np.where(ROWS > 200, 1.0, 0.0) * 0.1 * np.random.default_rng(5).standard_normal(len(ROWS))
    assert noise(series(louder)) == []
    still = np.where(ROWS < 200, 0.0, np.random.default_rng(5).standard_normal(len(ROWS)))  # a probe, at rest at first
    assert noise(series(1e-6 * still, "m")) == []


def test_heat_that_is_switched_every_minute_is_no_noise():
    flicker = 0.1 * np.random.default_rng(5).choice([0.0, 1.0], len(ROWS)) * (ROWS > 200)
    assert noise(series(warm(0.001) + flicker)) == []


def at_a_rail(value: float, rows: int) -> np.ndarray:
    return np.where((ROWS >= 240) & (240 + rows > ROWS), value, warm())


@pytest.mark.parametrize(("value", "rows"), [(-200.0, 5), (850.0, 240), (0.0, 60), (130.0, 240)])
def test_a_rail_has_its_rows_and_value(value, rows):
    found = rail(series(at_a_rail(value, rows)), 240)
    assert (found.first, found.last, found.size) == (240, 239 + rows, value)


def test_a_rounded_channel_that_rests_after_a_leap_is_at_no_rail():
    values = np.round(warm(0.0) + np.where(ROWS >= 240, 30.0, 0.0))
    assert rail(series(values), 240) is None
    assert rail(series(at_a_rail(60.0, 4)), 240) is None


def test_the_longest_rest_before_a_leap_was_none():
    values = warm()
    values[150:240] = values[150]
    found = rest_before(series(values), 240)
    assert (found.first, found.last, found.size) == (150, 239, values[150])
    values[300:] = values[300]  # it rests even longer elsewhere
    assert rest_before(series(values), 240) is None


def test_a_rounded_channel_that_goes_on_by_one_digit_lost_nothing():
    turning = np.round(30.0 - ((ROWS - 240) / 400.0) ** 2, 1)
    last = int(np.flatnonzero(turning == 30.0)[-1])
    assert rests_by_rounding(series(turning), last)
    assert not rests_by_rounding(series(np.where(last < ROWS, turning - 0.5, turning)), last)
    assert not rests_by_rounding(series(turning), len(ROWS) - 1)  # the log ends before it goes on
    loud = warm(0.3)
    loud[100:200] = loud[100]
    loud[200] = loud[100] + 1e-5  # unrounded: by chance
    assert not rests_by_rounding(series(loud), 199)
