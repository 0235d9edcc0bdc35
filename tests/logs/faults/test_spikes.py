"""Single wrong readings are set aside, and heat is none of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from twin.logs.check import check_run
from twin.logs.faults.find import faults_of
from twin.logs.faults.usable import usable
from twin.logs.run import Run, Table

STEP, ROWS = 45.0, 480  # s; 6 h
TIME = STEP * np.arange(ROWS)


def logged(seed: int = 0, step: float = STEP) -> np.ndarray:
    """A bearing that follows a spindle in steps, with a time constant of 5 min, to a tenth of a kelvin."""
    rng = np.random.default_rng(seed)
    heat = np.repeat(rng.uniform(0.0, 15.0, ROWS // 30), 30)
    T = np.zeros(ROWS)
    for i in range(1, ROWS):
        T[i] = T[i - 1] + step / 300.0 * (heat[i] - T[i - 1])
    return np.round(20.0 + T + 0.07 * rng.standard_normal(ROWS), 1)


def run_of(values: np.ndarray, step: float = STEP) -> Run:
    time = step * np.arange(len(values))
    loads = Table(time, {"speed": np.ones(len(time))}, {"speed": "1/s"})
    return Run(loads, temperatures=Table(time, {"front": values}, {"front": "degC"}), folder=Path("run"))


@pytest.mark.parametrize("rows", [1, 2, 3])
@pytest.mark.parametrize("size", [-220.0, 4.0, 13.0, 830.0])
def test_a_few_wrong_readings_are_set_aside_and_nothing_else(rows, size):
    """Not what comes after them, as of a leap that lasts."""
    values = logged()
    values[200 : 200 + rows] += size
    run = run_of(values)
    kept, aside = usable(run, ["front"])
    assert [(f.kind, f.first_row, f.last_row) for f in aside] == [("spike", 200, 199 + rows)]
    assert aside[0].size == pytest.approx(size, abs=2.0)
    assert kept.temperatures is not None
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(kept.temperatures.columns["front"])), 200 + np.arange(rows))


@pytest.mark.parametrize("seed", range(20))
def test_a_sound_bearing_has_none(seed):
    assert [f.kind for f in faults_of(run_of(logged(seed)))] == []


def test_several_in_one_channel_are_one_warning():
    values = logged(3)
    values[[100, 250, 400]] += [8.0, -9.0, 11.0]
    (told,) = [p for p in check_run(run_of(values)) if "comes back" in p.what]
    assert "3 times" in told.what
    assert "up to 1" in told.what
    assert "102" in told.where  # line 102 of the file


def test_a_light_part_that_is_read_every_ten_minutes_may_warm_and_cool_between_two_rows():
    """An impossible reading is none of it."""
    values = logged(4, step=600.0)
    values[200] += 9.0
    assert [f.kind for f in faults_of(run_of(values, 600.0))] == []
    values[200] = 850.0
    assert [(f.kind, f.first_row) for f in faults_of(run_of(values, 600.0))] == [("spike", 200)]


def test_a_pulse_that_dies_out_is_heat():
    values = logged(5)
    values[200:260] += 6.0 * np.exp(-np.arange(60) / 6.0)
    assert "spike" not in [f.kind for f in faults_of(run_of(values))]
