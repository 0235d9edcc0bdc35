"""Faults planted into simulated measurements of the ball screw axis: each told once, with its channel and its row."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from twin.build.simulate import Noise, simulate_run
from twin.inject.damage.channels import Damage
from twin.inject.damage.kinds import damaged
from twin.logs.check import check_run
from twin.logs.faults.find import faults_of
from twin.logs.read import read_run
from twin.logs.run import Run, Tcp

pytestmark = pytest.mark.long

AXIS = Path(__file__).parents[3] / "models" / "ball_screw_axis"
HOUR = 3600.0


def simulate(noise: Noise) -> Run:
    """Eight hours of random motion; the tool is measured at one place every two minutes."""
    run = read_run(AXIS / "runs" / "mixed_load")
    time = np.arange(120.0, 8 * HOUR, 120.0)
    place = Tcp(time, ("x",), np.full((len(time), 1), 0.1), np.zeros((len(time), 3)))
    return simulate_run(AXIS / "nodes.toml", replace(run, tcp=place), noise=noise)[0]


@pytest.fixture(scope="module")
def exact() -> Run:
    return simulate(Noise())


@pytest.fixture(scope="module")
def noisy() -> Run:
    return simulate(Noise(0.02, 0.3e-6))


@pytest.mark.parametrize("name", ["exact", "noisy"])
def test_nothing_is_told_of_sound_measurements(name, request):
    run = request.getfixturevalue(name)
    assert np.ptp(run.temperatures.columns["nut"]) > 3.0  # K
    assert np.ptp(run.tcp.displacement[:, 0]) > 20e-6  # m
    assert faults_of(run) == []


def test_rounded_measurements_are_sound(noisy):
    table = noisy.temperatures
    for digits in (0, 1):
        rounded = replace(table, columns={n: np.round(v, digits) for n, v in table.columns.items()})
        assert faults_of(replace(noisy, temperatures=rounded)) == []


SENSORS = ("nut", "motor", "bed")
CASES = [
    *((Damage("sensor", f"sensors.{n}", 5.0, "noise", start=at * HOUR), "noise") for n in SENSORS for at in (2, 6)),
    *((Damage("sensor", f"sensors.{n}", v, "rail"), "rail") for n in SENSORS for v in (-200.0, 850.0, 0.0)),
    *((Damage("sensor", f"sensors.{n}", v, "offset"), "leap") for n in SENSORS for v in (12.0, -30.0)),
    *((Damage("sensor", f"sensors.{n}", 1.5 * HOUR, "stuck"), "stuck") for n in SENSORS),
    *((Damage("not_thermal", f"tcp.{c}", v, "step"), "leap") for c in ("dx", "dz") for v in (60e-6, -90e-6)),
    *((Damage("measurement", f"tcp.{c}", 1.5 * HOUR, "stuck"), "stuck") for c in ("dx",)),
    (Damage("measurement", "tcp.dx", 0.0, "rezero"), "rezero"),
]


@pytest.mark.parametrize(("damage", "kind"), CASES, ids=lambda x: x if isinstance(x, str) else f"{x.place}-{x.size:g}")
def test_a_planted_fault_is_told_once_with_its_channel_and_row(noisy, damage, kind):
    if damage.start == -math.inf:
        damage = replace(damage, start=3.0 * HOUR)
    table, _, channel = damage.place.replace("sensors", "temperatures").partition(".")
    (found,) = faults_of(damaged(noisy, damage))
    time = getattr(noisy, table).time
    assert (found.kind, found.table, found.channels) == (kind, table, (channel,))
    assert abs(found.first_row - int(np.searchsorted(time, damage.start))) <= 1
    assert found.first_time == time[found.first_row]
    lasts = damage.size if kind == "stuck" else math.inf
    assert found.last_row == pytest.approx(np.searchsorted(time, damage.start + lasts) - 1, abs=1)
    if kind == "leap":
        assert found.size == pytest.approx(damage.size, rel=0.15)
    if kind == "rail":
        assert (found.size, found.unit) == (damage.size, "degC")
    if kind == "rezero":
        before = noisy.tcp.displacement[found.first_row, 0]
        assert found.size == pytest.approx(-before, rel=0.1)


def test_there_and_back_is_one_fault(noisy):
    (found,) = faults_of(damaged(noisy, Damage("sensor", "sensors.nut", 12.0, start=2 * HOUR, end=3 * HOUR)))
    assert (found.first_row, found.last_row) == (120, 179)


def test_rows_of_another_time_are_one_fault_of_all_channels(noisy):
    run = damaged(noisy, Damage("signal", "run", 3.0 * HOUR, "splice", start=1.0 * HOUR))
    found = faults_of(run)
    assert [(f.kind, f.table, f.first_row) for f in found] == [("splice", "temperatures", 60)]
    assert len(found[0].channels) >= 4
    told = [p for p in check_run(run) if "another time" in p.what]
    assert len(told) == 1
    assert told[0].where.endswith("temperatures.csv (line 62)")
    assert not [p for p in check_run(run) if "leaps" in p.what]


def test_swapped_names_leap_together(noisy):
    d = Damage("sensor", "sensors.motor", math.nan, "swapped", other="sensors.bed", start=4 * HOUR)
    (found,) = faults_of(damaged(noisy, d))
    assert (found.kind, found.channels, found.first_row) == ("leap", ("bed", "motor"), 240)


def test_a_drift_is_not_seen_in_one_run(noisy):
    assert faults_of(damaged(noisy, Damage("sensor", "sensors.bed", 3.0, "drift"))) == []


def test_empty_cells_move_no_row(noisy):
    run = damaged(noisy, Damage("sensor", "sensors.bed", 8.0, "offset", start=3.0 * HOUR))
    columns = {n: np.where(np.arange(len(v)) % 5 == 2, np.nan, v) for n, v in run.temperatures.columns.items()}
    (found,) = faults_of(replace(run, temperatures=replace(run.temperatures, columns=columns)))
    assert (found.kind, found.first_row) == ("leap", 180)
