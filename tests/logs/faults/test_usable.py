"""What is set aside before anything is fitted: broken and leaping temperatures, rows of another time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from twin.logs.faults.usable import aside_words, usable
from twin.logs.run import Run, Segment, Table, Tcp

N = 400
SENSORS = tuple(f"t{k}" for k in range(6))


def made(seed: int = 1) -> Run:
    """Six temperatures of a machine that warms, a minute apart, and a TCP row every quarter of an hour."""
    rng = np.random.default_rng(seed)
    time = 60.0 * np.arange(N)
    level = np.repeat(rng.random(10), N // 10)
    warm = np.zeros(N)
    for i in range(1, N):
        warm[i] = warm[i - 1] + (12.0 * level[i] - warm[i - 1]) / 60.0
    columns = {f"t{k}": 20.0 + (k + 1) / 3.0 * warm + 0.03 * rng.standard_normal(N) for k in range(6)}
    rows = np.arange(900.0, time[-1], 900.0)
    tcp = Tcp(rows, ("x",), np.zeros((len(rows), 1)), 1e-6 * rng.standard_normal((len(rows), 3)), np.ones(len(rows)),
              angle={"c": np.zeros(len(rows))})  # fmt: skip
    loads = Table(time, {"speed": level}, {"speed": "m/s"})
    return Run(loads, Table(time, columns, dict.fromkeys(columns, "degC")), tcp)


def changed(run: Run, name: str, values: np.ndarray) -> Run:
    assert run.temperatures is not None
    return replace(run, temperatures=replace(run.temperatures, columns={**run.temperatures.columns, name: values}))


def test_a_healthy_run_is_used_as_it_is():
    run = made()
    kept, aside = usable(run, SENSORS)
    assert aside == ()
    assert kept is run


@pytest.mark.parametrize("kind", ["noise", "rail", "leap"])
def test_a_broken_temperature_is_emptied_from_there_on_and_told(kind):
    run, at = made(), 230
    good = run.temperatures.columns["t2"]
    bad = good.copy()
    bad[at:] = {"noise": good[at:] + 15.0 * np.random.default_rng(3).standard_normal(N - at),
                "rail": np.full(N - at, -200.0), "leap": good[at:] + 9.0}[kind]  # fmt: skip
    kept, (fault,) = usable(changed(run, "t2", bad), SENSORS)
    assert (fault.kind, fault.channels) == (kind, ("t2",))
    assert abs(fault.first_row - at) <= 1
    assert np.isnan(kept.temperatures.columns["t2"][at + 1 :]).all()
    assert np.array_equal(kept.temperatures.columns["t2"][: at - 1], bad[: at - 1])
    for name in ("t0", "t5"):
        assert np.array_equal(kept.temperatures.columns[name], run.temperatures.columns[name])
    assert f"lines {fault.first_row + 2} to" in aside_words(fault)
    assert kept.tcp is run.tcp


def test_rows_of_another_time_are_not_used_and_neither_are_tcp_rows_there():
    run, at = made(), 250
    other = made(8)
    run = replace(run, temperatures=replace(run.temperatures, columns={
        n: np.concatenate([v[:at], other.temperatures.columns[n][at - 180 : N - 180] + 2.0])
        for n, v in run.temperatures.columns.items()}))  # fmt: skip
    kept, aside = usable(run, SENSORS)
    assert [f.kind for f in aside] == ["splice"]
    assert aside[0].first_row == at
    assert all(np.isnan(v[at:]).all() and np.isfinite(v[:at]).all() for v in kept.temperatures.columns.values())
    assert kept.tcp.time.max() < 60.0 * at <= run.tcp.time.max()
    assert len(kept.tcp.angle["c"]) == len(kept.tcp.time) == len(kept.tcp.sigma) == len(kept.tcp.displacement)


def test_a_door_that_opens_moves_the_air_and_not_the_machine():
    """Air sensors leap together; they are no sensors of the machine, and have no say about its rows."""
    run, at = made(), 250
    doors = {f"air{k}": 20.0 - np.where(np.arange(N) >= at, 6.0 + k, 0.0) for k in range(5)}
    table = run.temperatures
    run = replace(run, temperatures=replace(table, columns={**table.columns, **doors}))
    kept, aside = usable(run, SENSORS)
    assert aside == ()
    assert kept is run


def test_a_coolant_that_is_switched_on_is_the_machine():
    """Two wetted sensors fall at once, over some minutes, in a log of a row each 5 min: to one that looks, a leap."""
    run = made()
    columns = dict(run.temperatures.columns)
    cold = np.where(np.arange(N) >= 250, 8.0, 0.0)
    for name in ("t1", "t4"):
        columns[name] = columns[name] - cold
    both = replace(run, temperatures=replace(run.temperatures, columns=columns))
    assert usable(both, SENSORS)[1] == ()
    slow = replace(run.temperatures, time=5.0 * run.temperatures.time)
    alone = replace(run, temperatures=replace(slow, columns={**slow.columns, "t1": columns["t1"]}))
    assert usable(alone, SENSORS)[1] == ()


def test_a_fault_ends_where_the_next_test_of_the_log_begins():
    run, at, begins = made(), 150, 300
    bad = run.temperatures.columns["t2"].copy()
    bad[at:begins] += 9.0
    segments = (Segment("a", 0.0, 60.0 * (begins - 1)), Segment("b", 60.0 * begins, 60.0 * (N - 1)))
    kept, (fault,) = usable(replace(changed(run, "t2", bad), segments=segments), SENSORS)
    assert abs(fault.last_row - (begins - 1)) <= 1
    assert np.array_equal(kept.temperatures.columns["t2"][begins:], bad[begins:])
