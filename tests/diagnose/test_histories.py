"""Signals of logs finer than the steps: what happens within a step is not lost, and those of coarser logs stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.faults.elements import histories_of
from twin.diagnose.model.probed_model import _means, drive_of
from twin.diagnose.model.study import Study
from twin.logs.run import Run

HOURS, ON, CYCLE = 2.0, 12.0, 60.0
DUTY = ON / CYCLE


def logged(step: float) -> Run:
    """Loads that switch in every minute, in rows of `step` [s]: on at its start, an axis to and fro.

    In the second hour the current is twice as large, and the axis half as fast.
    """
    run = small_case.runs()[0]
    time = np.arange(0.0, HOURS * 3600.0 + 1.0, step)
    on = (time % CYCLE < ON).astype(float)
    hour = 1.0 + (time >= 3600.0)
    columns = {
        "x_position": 0.1 - 0.2 * (time % CYCLE >= CYCLE / 2),
        "x_speed": 0.2 / hour * on * (1.0 - 2.0 * (time % CYCLE >= ON / 2)),
        "spindle_current": 8.0 * hour * on,
        "spindle_speed": np.full(len(time), 50.0),
        "shop_air": 1.0 - 2.0 * (time % CYCLE >= CYCLE / 2),
        "coolant_inlet": np.full(len(time), 19.0),
    }
    return replace(run, loads=replace(run.loads, time=time, columns=columns))


def means(run: Run) -> dict[str, np.ndarray]:
    base = small_case.probed().base
    return _means(base, run, drive_of(base, run))


def test_a_cycle_within_a_step_is_seen():
    found = means(logged(1.0))
    n = round(HOURS * 60)
    hour = np.repeat([1.0, 2.0], n // 2)
    np.testing.assert_allclose(found["spindle_current"][:n] ** 2, DUTY * (8.0 * hour) ** 2)  # what heats
    np.testing.assert_allclose(np.abs(found["x_speed"][:n]), DUTY * 0.2 / hour)  # to and fro is not at rest
    np.testing.assert_array_equal(found["spindle_speed"], 50.0)
    for name in ("shop_air", "x_position"):  # temperatures and positions act with their sign
        np.testing.assert_allclose(found[name][:n], 0.0, atol=1e-12)


def test_gaps_hold_the_last_value():
    run = logged(1.0)
    current = run.loads.columns["spindle_current"].copy()
    current[run.loads.time % CYCLE != 0.0] = np.nan  # told once a minute
    current[0] = np.nan
    found = means(replace(run, loads=replace(run.loads, columns={**run.loads.columns, "spindle_current": current})))
    n = round(HOURS * 60)
    np.testing.assert_allclose(found["spindle_current"][:n], np.repeat([8.0, 16.0], n // 2))


def test_its_history_is_searched():
    study = small_case.study()
    runs = tuple(
        replace(p, run=replace(p.run, signals=means(logged(1.0)), drive=drive_of(study.probed.base, logged(1.0))))
        for p in study.runs
    )
    histories = histories_of(Study(study.probed, study.effects, runs, study.fitted))
    assert {"spindle_current^2", "x_speed"} <= set(histories.signals)
    first, last = histories.signals["spindle_current^2"][0][[0, 90]]
    assert (first, last) == pytest.approx((0.25, 1.0))


@pytest.mark.parametrize("step", [60.0, 90.0, 600.0])
def test_of_rows_no_finer_than_a_step_the_one_in_the_middle_is_taken(step):
    run = logged(step)
    rng = np.random.default_rng(1)
    columns = {name: 1.0 + rng.random(len(v)) for name, v in run.loads.columns.items()}
    columns["shop_air"][2] = np.nan
    run = replace(run, loads=replace(run.loads, columns=columns))
    drive = drive_of(small_case.probed().base, run)
    middle = (drive.time[:-1] + drive.time[1:]) / 2
    found = means(run)
    assert set(found) == set(columns)
    for name, values in found.items():
        good = np.isfinite(columns[name])
        time = run.loads.time[good]
        row = [np.flatnonzero(time <= t)[-1] for t in middle]
        assert np.array_equal(values, columns[name][good][row]), name
