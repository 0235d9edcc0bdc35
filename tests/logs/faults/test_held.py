"""Readings that a logger repeats where it has none: set aside, and what follows is no leap."""

from __future__ import annotations

import numpy as np
import pytest

from tests.logs.faults.test_usable import SENSORS, changed, made
from twin.calibrate.channels.readings import emptied
from twin.logs.faults.find import faults_of
from twin.logs.faults.tell import fault_problems
from twin.logs.faults.usable import aside_words, usable


def repeating(name: str, digit: float, *stretches: tuple[int, int]):
    """The run with a channel of such a last digit [K] whose readings of rows first .. last repeat the one before."""
    run = made()
    values = digit * np.round(run.temperatures.columns[name] / digit)
    for first, last in stretches:
        values[first : last + 1] = values[first - 1]
    return changed(run, name, values)


@pytest.mark.parametrize(("digit", "rows"), [(0.001, 10), (0.02, 20)])
def test_repeated_readings_are_set_aside_and_what_follows_is_used(digit, rows):
    run = repeating("t5", digit, (100, 99 + rows), (300, 299 + rows))
    kept, aside = usable(run, SENSORS)
    assert [(f.kind, f.channels, f.first_row, f.last_row - f.first_row + 1) for f in aside] == [
        ("held", ("t5",), 100, rows), ("held", ("t5",), 300, rows)
    ]  # fmt: skip
    assert np.flatnonzero(np.isnan(kept.temperatures.columns["t5"])).tolist() == [
        *range(100, 100 + rows), *range(300, 300 + rows)
    ]  # fmt: skip
    assert "repeats" in aside_words(aside[0])
    assert any("'t5' repeats" in p.what for p in fault_problems(run, faults_of(run)))
    np.testing.assert_array_equal(
        np.isnan(emptied(run)[0].temperatures.columns["t5"]), np.isnan(kept.temperatures.columns["t5"])
    )


def test_a_rounded_channel_rests_by_itself():
    assert faults_of(repeating("t5", 0.5)) == []


def test_what_stands_still_for_longer_than_a_logger_repeats_is_a_sensor_at_fault():
    (fault,) = faults_of(repeating("t5", 0.001, (100, 160)))
    assert (fault.kind, fault.first_row) == ("stuck", 99)
