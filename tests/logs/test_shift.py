"""Shifts by a row: speeds, motors, and temperatures of the full model against its loads."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.logs.test_slips import FIVE, RAM, SLIDE, loaded, new_findings
from twin.build.simulate import simulate_run
from twin.logs.motion import motion_problems
from twin.logs.read import read_run
from twin.logs.run import Run, Table
from twin.logs.shift import table_shifts

SPINDLE = Path(__file__).parents[1] / "machines" / "spindle"


@pytest.fixture(scope="module")
def warm_up() -> Run:
    """Loads every 10 s and what the full model answers; the air of the shop left out, which both tables would hold."""
    run, _ = simulate_run(SPINDLE / "machine.toml", SPINDLE / "runs" / "warm_up", dt=10.0)
    assert run.temperatures is not None
    columns = {n: v for n, v in run.temperatures.columns.items() if n != "shop_air"}
    shown = replace(run.temperatures, columns=columns, units=dict.fromkeys(columns, "degC"))
    return replace(run, loads=read_run(SPINDLE / "runs" / "warm_up").loads, temperatures=shown)


def late(run: Run, rows: int, noise: float = 0.0) -> Run:
    """Its temperatures some rows late."""
    assert run.temperatures is not None
    rng = np.random.default_rng(rows + 5)
    table, keep = run.temperatures, slice(max(0, rows), len(run.temperatures.time) + min(0, rows))
    columns = {n: np.roll(v, rows)[keep] + noise * rng.standard_normal(len(v[keep])) for n, v in table.columns.items()}
    return replace(run, temperatures=Table(table.time[keep], columns, table.units))


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.05])
def test_temperatures_in_step_are_silent(warm_up, noise):
    assert table_shifts(late(warm_up, 0, noise)) == []


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.05])
@pytest.mark.parametrize("rows", [1, 2])
def test_temperatures_that_foresee_their_loads(warm_up, rows, noise):
    (found,) = table_shifts(late(warm_up, -rows, noise))
    assert found.warning
    assert "'front' answers the loads" in found.what
    assert "before they act" in found.what
    if noise < 0.05:
        assert f"{rows} interval(s) of 10 s" in found.what


@pytest.mark.parametrize("rows", [1, 2])
def test_temperatures_that_come_late_and_sharply(warm_up, rows):
    (found,) = table_shifts(late(warm_up, rows))
    assert f"'front', the quickest of the temperatures that tell, answers the loads {rows} interval(s)" in found.what


def test_a_channel_in_both_tables():
    time = 10.0 * np.arange(300)
    air = 20.0 + np.sin(time / 200.0) + 0.02 * np.random.default_rng(0).standard_normal(300)
    loads = Table(time, {"shop": air}, {"shop": "degC"})

    def told(rows: int, synthetic: tuple[str, ...] = ()) -> list[str]:
        shown = Table(time, {"shop": np.roll(air, rows)}, {"shop": "degC"})
        return [p.what for p in table_shifts(Run(loads, shown, synthetic=synthetic))]

    assert told(0) == []
    assert told(1) == ["'shop' is 1 interval(s) of 10 s late against the same channel in loads.csv"]
    assert told(-2) == ["'shop' is 2 interval(s) of 10 s early against the same channel in loads.csv"]
    assert told(1, ("temperatures",)) == []  # computed: the mean of the step that ends


@pytest.mark.parametrize("rows", [-1, 1, 2])
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_motor_and_axis_some_rows_apart(axis, rows):
    motor = f"{axis}_motor_speed"
    found = new_findings(FIVE, **{motor: np.roll(loaded(FIVE)[0].loads.columns[motor], rows)})
    says = f"'{motor}' changes {abs(rows)} row(s) {'after' if rows > 0 else 'before'} '{axis}_speed'"
    assert any(says in p.what for p in found)


@pytest.mark.parametrize("rows", [-2, -1, 2])
def test_speed_some_samples_off_its_position(rows):
    found = new_findings(SLIDE, x_speed=np.roll(loaded(SLIDE)[0].loads.columns["x_speed"], rows))
    assert any("sample(s)" in p.what for p in found)


def test_current_some_rows_off_its_speed():
    run = loaded(RAM)[0]
    found = new_findings(RAM, y_current=np.roll(run.loads.columns["y_current"], 2))
    assert any("'y_current' changes 2 row(s) after 'y_speed'" in p.what for p in found)


@pytest.mark.parametrize("plausible", [0.0, 0.5, 1.0])
def test_plausible_ways_to_log_a_speed(plausible):
    """The mean of the interval that starts, the speed at the sample, the mean of the interval that ended."""
    time, fine = np.arange(300.0), np.arange(0.0, 301.0, 0.01)
    path = np.interp(fine, fine, 0.1 * np.sin(fine / 6.0) * np.sin(fine / 50.0))
    at = path[:-1:100][:300]
    means = np.diff(path[::100])[:300]
    speed = {0.0: means, 1.0: np.roll(means, 1), 0.5: np.gradient(path, 0.01)[:-1:100][:300]}[plausible]
    units = {"x_position": "m", "x_speed": "m/s"}
    assert motion_problems(Table(time, {"x_position": at, "x_speed": speed}, units), "loads.csv") == []
    shifted = motion_problems(Table(time, {"x_position": at, "x_speed": np.roll(speed, 2)}, units), "loads.csv")
    assert len(shifted) == 1
    assert "late against 'x_position'" in shifted[0].what
