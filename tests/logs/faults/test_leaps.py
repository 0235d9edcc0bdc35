"""Leaps against heat: what is told of one channel by itself."""

from __future__ import annotations

import numpy as np
import pytest

from twin.logs.faults.leaps import changes, leaps, leapt_together, set_to_zero
from twin.logs.faults.series import Series

ROWS = np.arange(400)


def series(values: np.ndarray, time: np.ndarray | None = None, name: str = "a", unit: str = "degC") -> Series:
    rows = np.arange(len(values))
    return Series("temperatures", name, unit, rows, 30.0 * rows if time is None else time, values)


def leaps_of(values: np.ndarray, time: np.ndarray | None = None) -> list[tuple[int, float]]:
    s = series(values, time)
    return leaps(s, changes(s))


def noise(size: float, seed: int = 0) -> np.ndarray:
    return size * np.random.default_rng(seed).standard_normal(len(ROWS))


def heated(time_constant: float, rise: float = 20.0) -> np.ndarray:
    """A first-order response that begins at row 150; the time constant in rows."""
    return 20.0 + rise * np.where(ROWS < 150, 0.0, 1.0 - np.exp(-(ROWS - 149) / time_constant))


@pytest.mark.parametrize("time_constant", [1.0, 2.0, 5.0, 20.0, 100.0])
@pytest.mark.parametrize("size", [0.0, 0.01, 0.3])
def test_heat_however_fast_is_no_leap(time_constant, size):
    assert leaps_of(heated(time_constant) + noise(size)) == []


def test_a_light_bearing_whose_spindle_stood_for_six_rows_does_not_leap():
    """It begins to warm at its last reading; the median of the three before is a fifth of its first step above that."""
    values = 38.2 + noise(0.05)
    stood = [38.49, 36.30, 35.22, 34.60, 34.21, 33.92, 33.60]
    warms = [34.87, 35.46, 35.78, 35.78, 36.06, 35.96, 35.97]
    values[200:214] = [*stood, *warms]
    values[214:] -= 2.15
    assert leaps_of(values) == []


@pytest.mark.parametrize("size", [3.0, -12.0])
@pytest.mark.parametrize("rounded", [3, 1])
def test_a_leap_on_the_way_up_has_its_row_and_size(size, rounded):
    values = heated(100.0) + noise(0.05) + np.where(ROWS >= 170, size, 0.0)
    ((row, found),) = leaps_of(np.round(values, rounded))
    assert row == 170
    assert found == pytest.approx(size, rel=0.1)


def test_several_leaps_of_one_channel_are_all_found():
    values = noise(0.05)
    for row in (60, 130, 200, 290, 360):
        values = values + np.where(row <= ROWS, 4.0 if row != 200 else -9.0, 0.0)
    assert [row for row, _ in leaps_of(values)] == [60, 130, 200, 290, 360]


def test_single_wrong_values_and_heavy_tails_are_no_leaps():
    values = noise(0.05)
    values[[50, 200]] += 30.0
    assert leaps_of(values) == []
    assert leaps_of(0.1 * np.random.default_rng(3).standard_t(2.0, len(ROWS))) == []


def test_two_wrong_values_are_a_leap_there_and_back():
    values = noise(0.05)
    values[[50, 51]] += 30.0
    assert [(row, round(size, -1)) for row, size in leaps_of(values)] == [(50, 30.0), (52, -30.0)]


def test_what_may_have_happened_in_a_gap_is_no_leap():
    slope = 0.02 * ROWS + noise(0.02)
    late = 30.0 * ROWS + np.where(ROWS >= 200, 6000.0, 0.0)  # s: 200 rows are missing, 4 K at the pace of the others
    values = slope + np.where(ROWS >= 200, 4.0, 0.0)
    assert leaps_of(values, late) == []
    assert [row for row, _ in leaps_of(values)] == [200]  # without a gap it is one
    assert [row for row, _ in leaps_of(values + np.where(ROWS >= 200, 9.0, 0.0), late)] == [200]


def test_short_series_tell_nothing():
    assert leaps_of(np.array([1.0, 9.0] * 5)) == []


def together(leaping: int, of: int) -> dict[int, dict[str, float]]:
    all_series = [
        series(noise(0.1, k) + np.where((ROWS >= 220) & (k < leaping), 1.0, 0.0), name=f"t{k}") for k in range(of)
    ]
    return leapt_together(all_series, [changes(s) for s in all_series])


def test_most_channels_together_are_rows_of_another_time():
    (found,) = together(10, 14).items()
    assert found[0] == 220
    assert set(found[1]) <= {f"t{k}" for k in range(10)}
    assert together(5, 14) == {}
    assert together(2, 2) == {}


def test_a_probe_that_ends_at_zero_to_the_last_digit_was_set_to_zero():
    shown = 12.0 + 0.01 * ROWS + noise(1.0)
    zeroed = np.round(shown - np.where(ROWS >= 250, shown[250], 0.0), 1)
    moved = np.round(zeroed + np.where(ROWS >= 250, 3.0, 0.0), 1)
    for values, wanted in ((zeroed, 250), (moved, None)):
        s = series(values, unit="m")
        found = set_to_zero(s, changes(s))
        assert (found[0] if found else None) == wanted
