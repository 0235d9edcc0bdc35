"""Units that contradict each other: the models' own runs with one channel a usual factor off."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.logs.test_check import TIME, Signal
from tests.logs.test_check import found as found_in
from twin.errors import Problem
from twin.face.check import Expected
from twin.face.check import expected as expected_of
from twin.logs.check import check_run
from twin.logs.read import parse_run
from twin.logs.run import Run, Table, Tcp

ROOT = Path(__file__).parents[2]
SLIDE, SPINDLE = "tests/machines/slide/runs/short", "tests/machines/spindle/runs/warm_up"
FIVE, RAM, UNIT, SCREW = (
    f"models/{p}" for p in ("five_axis/runs/experiment_a", "ram_borer/runs/test_5", "transfer_unit/runs/working_day",
                            "ball_screw_axis/runs/mixed_load")
)  # fmt: skip


@cache
def loaded(folder: str) -> tuple[Run, Expected]:
    run = parse_run(ROOT / folder)
    expected = expected_of(ROOT / folder, None, None)
    assert expected is not None
    return run, expected


def check(run: Run, expected: Expected) -> list[Problem]:
    return check_run(run, expected.signals, expected.axes, expected.sensors, None, expected.strokes)


def new_findings(folder: str, **columns: np.ndarray) -> list[Problem]:
    """What is found in the run with these columns instead, and not in the run itself."""
    run, expected = loaded(folder)
    before = {p.what for p in check(run, expected)}
    hurt = replace(run, loads=replace(run.loads, columns={**run.loads.columns, **columns}))
    return [p for p in check(hurt, expected) if p.what not in before]


@pytest.mark.parametrize("factor", [60.0, 1 / 60.0, 1000.0, 1e-3])
@pytest.mark.parametrize(
    ("folder", "column"),
    [
        (SLIDE, "x_position"), (SLIDE, "x_speed"), (SPINDLE, "spindle_current"),
        (FIVE, "x_position"), (FIVE, "z_position"), (FIVE, "x_speed"), (FIVE, "y_speed"), (FIVE, "z_speed"),
        (FIVE, "x_motor_speed"), (FIVE, "z_motor_speed"), (FIVE, "x_current"), (FIVE, "y_current"),
        (RAM, "y_position"), (RAM, "y_speed"), (RAM, "y_current"), (RAM, "spindle_speed"), (RAM, "spindle_power"),
        (UNIT, "x_position"), (UNIT, "x_speed"), (UNIT, "z_torque"), (UNIT, "table_motor_speed"),
        (UNIT, "spindle_power"), (SCREW, "x_position"), (SCREW, "x_speed"),
    ],
)  # fmt: skip
def test_a_factor_of_60_or_1000_is_found(folder, column, factor):
    found = new_findings(folder, **{column: factor * loaded(folder)[0].loads.columns[column]})
    assert any(f"'{column}'" in p.what for p in found)
    assert all(p.warning and "loads.csv" in p.where for p in found)


@pytest.mark.parametrize(("folder", "column"), [(SLIDE, "shop_air"), (RAM, "oil"), (FIVE, "enclosure")])
@pytest.mark.parametrize(
    "slip", [lambda v: v + 273.15, lambda v: v - 273.15, lambda v: 1.8 * v + 32.0, lambda v: (v - 32.0) / 1.8]
)
def test_temperatures_in_another_unit(folder, column, slip):
    found = new_findings(folder, **{column: slip(loaded(folder)[0].loads.columns[column])})
    assert any(f"'{column}'" in p.what for p in found)


def test_revolutions_and_radians():
    """An axis of rotation: 1/min under rad/s is 9.5 times off, radians for revolutions 2 pi."""
    time = np.arange(400.0)
    angle = 3.0 * np.sin(time / 30.0)
    speed = np.gradient(angle) / (2.0 * np.pi)
    table = Table(time, {"c_position": angle, "c_speed": speed}, {"c_position": "rad", "c_speed": "1/s"})
    assert check_run(Run(table)) == []
    hurt = replace(table, columns=dict(table.columns) | {"c_speed": 2.0 * np.pi * speed})
    (found,) = check_run(Run(hurt))
    assert "6.28" in found.what
    assert "2 pi: radians for revolutions" in found.what


def test_power_against_torque_and_speed():
    time = np.arange(200.0)
    n, torque = 20.0 + 10.0 * np.sin(time / 9.0), 4.0 + np.cos(time / 5.0)
    columns = {"s_speed": n, "s_torque": torque, "s_power": 2.0 * np.pi * n * torque / 0.85}
    units = {"s_speed": "1/s", "s_torque": "N*m", "s_power": "W"}
    assert check_run(Run(Table(time, columns, units))) == []
    for name, factor in (("s_speed", 1 / 60.0), ("s_power", 1e-3), ("s_torque", 60.0)):
        found = check_run(Run(Table(time, columns | {name: factor * columns[name]}, units)))
        assert any("2 pi 's_speed' 's_torque'" in p.what for p in found)


def test_lead_of_a_screw():
    (found,) = [
        p for p in new_findings(FIVE, x_motor_speed=loaded(FIVE)[0].loads.columns["x_motor_speed"] / 2.0 / np.pi)
        if "for each revolution" in p.what
    ]  # fmt: skip
    assert "125.7 mm" in found.what  # 20 mm times 2 pi


def test_positions_of_r_tests_beyond_the_stroke():
    time = np.array([0.0, 100.0])
    tcp = Tcp(time, ("x",), np.array([[0.1], [90.0]]), np.full((2, 3), 1e-6))
    run = Run(Table(time, {"x": np.zeros(2)}, {"x": "m"}), tcp=tcp)
    (found,) = check_run(run, strokes={"x": (-0.2, 0.2)})
    assert found.where.endswith("tcp.csv (line 3)")
    assert "90 m, beyond its stroke" in found.what


def test_range_names_the_slip():
    time = np.arange(100.0)
    run = Run(Table(time, {"i": 6000.0 + time}, {"i": "A"}))
    told = [p.what for p in check_run(run, (Signal("i", "i", "A", low=0.0, high=15.0),))]
    assert any("100 rows outside 0 .. 15: 1000 times too large (milli)?" in what for what in told)


@pytest.mark.parametrize(
    ("column", "value", "says"),
    [("a [A]", 5000.0, "much"), ("a [A]", 0.006, "little"), ("p [W]", 0.7, "little"), ("n [1/s]", 6000.0, "much")],
)
def test_magnitudes_that_no_machine_has(tmp_path, column, value, says):
    (told,) = found_in(tmp_path, {"time [s]": TIME, column: value * (1.0 + 0.1 * np.sin(TIME))})
    assert told.what.endswith(f"which is {says}")
