"""The five-axis machine shows what paper 000 observed (0.25 to 0.29, 0.32), with the full model in both experiments."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from models.scripts import load_script
from twin.build.full_model import FullModel
from twin.build.pipeline import full_model
from twin.build.pose_study import study_grids
from twin.build.stepper import CoupledStepper, sensor_temperatures, tcp_at_poses
from twin.build.volumetric import displacements, volumetric_shares
from twin.cli.main import run as twin
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.machine.load import load_machine
from twin.rom.drive import evaluate

FOLDER = Path(__file__).parents[2] / "models" / "five_axis"
DT = 300.0  # s: an R-test is one step
HOUR = 12  # steps


@pytest.mark.parametrize("name", ["experiment_a", "experiment_b"])
def test_runs_are_sound_and_what_their_script_writes(name):
    make_runs = load_script(FOLDER, "runs/make_runs.py")
    (experiment,) = [e for e in make_runs.EXPERIMENTS if e.name == name]
    assert make_runs.table(make_runs.log_of(experiment)) == (FOLDER / "runs" / name / "loads.csv").read_text(
        encoding="utf-8"
    )
    assert twin(["check", str(FOLDER / "runs" / name)]) == 0


def test_the_door_lets_the_air_fall_and_the_draught_in():
    loads = read_run(FOLDER / "runs" / "experiment_b").loads
    air, wind, hours = loads.columns["ambient"], loads.columns["draught"], loads.time / 3600
    before, is_open, after = hours < 4, (hours > 4.5) & (hours < 6), hours > 8
    assert air[before].min() - air[is_open].max() > 4.0
    assert wind[is_open].min() > 0.5 > 0.1 > wind[before].max()
    assert abs(air[after].mean() - air[before].mean()) < 1.0
    moving = loads.columns["x_speed"] > 0.3
    assert moving[(hours > 0.1) & (hours < 6.9)].mean() > 0.9  # loaded for 7 h, the R-tests apart
    assert not moving[(hours > 7.1) & (hours < 8.9)].any()


@dataclass(frozen=True)
class Result:
    """Every DT, the start included."""

    rise: dict[str, np.ndarray]  # K per sensor
    power: dict[str, np.ndarray]  # W per source, from the first step on
    tcp: np.ndarray  # (n, n_poses, 3) um
    fields: tuple[list[np.ndarray], ...]  # K, at full hours 1, 2, ...
    balance: float


@cache
def machine_model() -> FullModel:
    return full_model(load_machine(FOLDER))


@cache
def experiment(name: str) -> Result:
    model, run = machine_model().thermal, read_run(FOLDER / "runs" / name)
    drive = evaluate(model.load_model, run.loads.time, signal_values(run, model.load_model.signals), DT)
    stepper = CoupledStepper(model)
    x = stepper.uniform(run.initial_temperature)
    T, u, power, fields, balance = [sensor_temperatures(model, x)], [tcp_at_poses(model, x)], [], [], 0.0
    for step, x, heat in stepper.run(drive, x):  # noqa: B020  x goes on from where it began
        T.append(sensor_temperatures(model, x))
        u.append(tcp_at_poses(model, x))
        power.append(heat.power)
        balance = max(balance, heat.balance_error)
        if (step + 1) % HOUR == 0:
            fields.append(list(x))
    rise = np.array(T) - run.initial_temperature
    return Result(
        dict(zip(model.sensors, rise.T, strict=True)),
        dict(zip([s.name for s in model.load_model.sources], np.array(power).T, strict=True)),
        1e6 * np.array(u),
        tuple(fields),
        balance,
    )


def change_per_hour(tcp):
    """Largest change of any component at any pose over each half hour [um/h]; entry i ends at step i + HOUR / 2."""
    return 2.0 * np.abs(tcp[HOUR // 2 :] - tcp[: -HOUR // 2]).max(axis=(1, 2))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["experiment_a", "experiment_b"])
def test_size_of_the_experiments(name):
    """Paper: TCP errors up to 38 um in A and 48 um in B (0.27, 0.29)."""
    result = experiment(name)
    assert result.balance < 1e-8
    assert 30.0 < np.abs(result.tcp).max() < 50.0
    assert 12.0 < max(np.ptp(T) for T in result.rise.values()) < 18.5


@pytest.mark.slow
def test_vertical_axis_heats_at_standstill():
    """(a) of 0.32: the Y motor carries the headstock, hence heat without any motion; the X motor is silent."""
    result = experiment("experiment_a")
    rest = slice(4 * HOUR + 1, 6 * HOUR - 2)  # between two R-tests
    assert result.power["y_motor"][rest].min() > 300.0
    assert result.power["x_motor"][rest].max() < 0.01 * result.power["y_motor"][rest].min()
    assert result.power["y_guide"][rest].max() == 0.0
    assert (np.diff(result.rise["y_motor"][rest]) > 0.0).all()
    assert (np.diff(result.rise["x_motor"][rest]) < 0.0).all()


@pytest.mark.slow
@pytest.mark.parametrize("hour", [8, 10, 12])
def test_an_r_test_cools_the_y_motor(hour):
    """(b) of 0.32: it brings more heat into the motor, and more wind, which wins; elsewhere it warms."""
    result = experiment("experiment_a")
    end = hour * HOUR
    motor, heat = result.rise["y_motor"], result.power["y_motor"]
    assert heat[end - 1] > heat[end - 2] + 5.0
    assert motor[end] < motor[end - 1] - 0.02
    assert motor[end - 1] > motor[end - 2]
    for sensor in ("x_motor", "x_nut", "y_nut", "z_nut", "x_rail_1"):
        assert result.rise[sensor][end] > result.rise[sensor][end - 1] + 0.05


@pytest.mark.slow
def test_y_structure_keeps_warming_hours_after_the_stop():
    """(c) of 0.32, while the X axis cools."""
    rise = experiment("experiment_a").rise
    for sensor in ("y_motor", "column_front_top", "column_front_middle", "y_rail_1"):
        hourly = rise[sensor][4 * HOUR :: 2 * HOUR]
        assert (np.diff(hourly) > 0.0).all()
        assert hourly[-1] > 1.3 * hourly[0]
    for sensor in ("x_motor", "x_bearing"):
        assert rise[sensor][6 * HOUR] < 0.5 * rise[sensor][4 * HOUR]


@pytest.mark.slow
def test_the_error_of_the_cooling_machine_is_mostly_a_shift():
    """0.28: true for the column's growth; while X moves, its warm screw stretches the volume along X."""
    result, poses = experiment("experiment_a"), machine_model().thermal.poses
    share = {hour: volumetric_shares(poses, result.tcp[hour * HOUR]) for hour in (4, 8, 12)}
    assert share[12].shift > 0.9 > 0.8 > share[4].shift > 0.3
    assert share[4].shift < share[8].shift < share[12].shift
    assert all(s.higher < 0.1 for s in share.values())


@pytest.mark.slow
def test_the_door_changes_the_error_fastest():
    """0.29: the largest change comes while and just after the door is open, and there is no such change without it."""
    a, b = (change_per_hour(experiment(name).tcp) for name in ("experiment_a", "experiment_b"))
    warmed_up = HOUR  # the first hour, when the machine is switched on, is another matter
    worst = warmed_up + int(b[warmed_up:].argmax()) + HOUR // 2
    assert 4 * HOUR < worst <= 6.5 * HOUR
    assert b[warmed_up:].max() > 2.0 * a[warmed_up:].max()
    after = slice(6 * HOUR, 7 * HOUR - HOUR // 2)  # half hours that begin once it is closed
    assert b[after].max() > 2.0 * b[2 * HOUR : 4 * HOUR - HOUR // 2].max()


@pytest.mark.slow
def test_which_pose_grid_suffices_for_a_micrometre():
    """0.20 and 0.28: the paper's 27 poses are far off, its 125 within a hair; 96 do where more of them lie along Y."""
    structure = machine_model().structure
    fields = [experiment(name).fields[h - 1] for name in ("experiment_a", "experiment_b") for h in (1, 4, 5, 8, 12)]
    strokes = [load_machine(FOLDER).axes[a].stroke for a in structure.axes]
    study = study_grids(structure.axes, strokes, lambda p: displacements(structure, p, fields), random=200, most=6)
    error = {g.counts: 1e6 * g.maximum["lagrange"] for g in study.grids}
    assert 30e-6 < study.case < 50e-6
    assert error[5, 5, 5] < 1.3 < 3.0 < error[3, 3, 3]
    assert study.smallest(1e-6, "lagrange").counts == (4, 6, 4)
    assert study.smallest(1e-6, "linear") is None
