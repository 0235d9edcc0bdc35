"""Frozen channels, leaps and single wrong values."""

from __future__ import annotations

import numpy as np
import pytest

from tests.logs.test_slips import RAM, SLIDE, UNIT, loaded, new_findings
from twin.logs.check import check_run
from twin.logs.run import Run, Table


def frozen(folder: str, column: str, first: int, last: int) -> np.ndarray:
    values = loaded(folder)[0].loads.columns[column].copy()
    values[first:last] = values[first]
    return values


@pytest.mark.parametrize(
    ("folder", "column", "first", "says"),
    [
        (SLIDE, "x_position", 40, "'x_position' rests while 'x_speed' does not"),
        (UNIT, "z_motor_speed", 100, "'z_motor_speed' stands still while 'z_speed' changes"),
        (RAM, "spindle_power", 200, "to the last digit while 'spindle_speed' goes on"),
    ],
)
def test_frozen_loads_with_their_lines(folder, column, first, says):
    found = [p for p in new_findings(folder, **{column: frozen(folder, column, first, first + 120)}) if says in p.what]
    assert len(found) == 1
    assert found[0].warning
    low, high = map(int, found[0].where.split("(lines ")[1].rstrip(")").split(" .. "))
    assert abs(low - (first + 2)) <= 2
    assert high >= first + 100


def test_a_power_that_is_nought_for_hours_while_its_spindle_turns_is_told_where_it_never_is_elsewhere():
    loads = loaded(RAM)[0].loads
    power, turns = loads.columns["spindle_power"].copy(), loads.columns["spindle_speed"] != 0.0
    power[200:320] = 0.0
    says = "'spindle_power' is 0 W to the last digit while 'spindle_speed' goes on"
    assert [p.what for p in new_findings(RAM, spindle_power=power) if "to the last digit" in p.what] == [says]
    power[np.flatnonzero(turns)[::10]] = 0.0  # a drive that coasts
    assert not [p for p in new_findings(RAM, spindle_power=power) if "to the last digit" in p.what]


def temperatures(n: int = 600) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(4)
    time = np.arange(n) * 10.0
    rise = {"a": 9.0, "b": 6.0, "c": 3.0}
    return {k: 20.0 + r * (1.0 - np.exp(-time / 2000.0)) + 0.02 * rng.standard_normal(n) for k, r in rise.items()}


def told(columns: dict[str, np.ndarray]) -> list:
    n = len(next(iter(columns.values())))
    time = 10.0 * np.arange(n)
    loads = Table(time, {"i": 1.0 + 0.1 * np.sin(time)}, {"i": "A"})
    return check_run(Run(loads, Table(time, columns, dict.fromkeys(columns, "degC"))))


def test_a_frozen_sensor_is_found():
    columns = temperatures()
    assert told(columns) == []
    columns["b"][300:] = columns["b"][300]
    (found,) = told(columns)
    assert found.what.startswith("'b' stands still at")
    assert found.where.endswith("(lines 302 .. 601)")


def test_frozen_is_what_was_read_and_not_what_is_missing():
    columns = temperatures()
    columns["c"][300:] = np.nan
    assert not [p for p in told(columns) if "stands still" in p.what]
    columns = temperatures()
    columns["b"][300:] = columns["b"][300]
    columns["b"][::3] = np.nan
    (found,) = [p for p in told(columns) if "stands still" in p.what]
    assert found.where.endswith("(lines 303 .. 601)")


def test_coarse_sensors_in_slow_air_are_not_frozen():
    assert told({k: np.round(v, 1) for k, v in temperatures().items()}) == []
    shared = np.round(20.0 + 3.0 * (1.0 - np.exp(-np.arange(600) / 60.0)), 1)  # all come to rest together
    assert told({"a": shared, "b": shared + 1.0, "c": shared + 0.3}) == []


@pytest.mark.parametrize("size", [3.0, -8.0, 60.0])
def test_single_wrong_temperature(size):
    columns = temperatures()
    columns["c"][77] += size
    found = [p for p in told(columns) if "'c'" in p.what]
    assert found
    assert all("(line 79)" in p.where for p in found if "leaps" in p.what or "otherwise" in p.what)


def test_a_leap_that_stays_is_found():
    columns = temperatures()
    columns["a"][400:] += 5.0
    (found,) = told(columns)
    assert "'a' leaps by" in found.what
    assert found.where.endswith("(line 402)")


def test_an_air_temperature_among_the_loads_that_leaps():
    time = np.arange(600.0)
    air = np.round(20.0 + 0.5 * np.sin(time / 90.0), 2)
    for leap, says in ((0.0, []), (5.0, ["'air' leaps by 5 K, once"])):
        loads = Table(time, {"air": air + np.where(time >= 400.0, leap, 0.0)}, {"air": "degC"})
        assert [p.what for p in check_run(Run(loads))] == says


def test_outlier_of_a_load():
    run = loaded(RAM)[0]
    power = run.loads.columns["spindle_power"].copy()
    power[500] = 40_000.0
    assert any("(line 502)" in p.where and "spindle_power" in p.what for p in new_findings(RAM, spindle_power=power))


def test_a_constant_current_beside_a_speed_that_changes():
    time = np.arange(200.0)
    columns = {"x_speed": np.sin(time / 9.0), "x_current": np.full(200, 4.2)}
    (found,) = [
        p for p in check_run(Run(Table(time, columns, {"x_speed": "m/s", "x_current": "A"}))) if "never" in p.what
    ]
    assert "column 'x_current' never changes (4.2 A)" in found.what
