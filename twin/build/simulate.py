"""Step the full model through a run: the truth for certificates and for experiments with hidden effects.

It takes any description, so an edited description is another machine. What it writes has the shape of measured data.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twin.build.full_model import FullModel
from twin.build.pipeline import full_model
from twin.build.stepper import CoupledStepper, sensor_temperatures
from twin.errors import LogError
from twin.logs.read import read_run
from twin.logs.run import Run, Table, Tcp, tcp_places
from twin.logs.signals import signal_values
from twin.machine.description import Machine
from twin.machine.load import load_machine
from twin.progress import Progress, silent
from twin.rom.drive import Drive, evaluate, measured_air
from twin.rom.load_model import LoadModel
from twin.rom.rest import rest_before
from twin.rom.tcp import places


@dataclass(frozen=True)
class Noise:
    """Standard deviations of simulated measurement noise."""

    temperature: float = 0.0  # K
    displacement: float = 0.0  # m
    seed: int = 0


@dataclass(frozen=True)
class Simulation:
    """Result of the full model; temperatures at step ends."""

    time: np.ndarray  # (n + 1,) s, the initial state included
    temperatures: np.ndarray  # (n + 1, n_sensors + n_ambient_sensors) degC
    sensors: tuple[str, ...]
    tcp_time: np.ndarray  # (m,) s
    tcp_positions: np.ndarray  # (m, n_axes) m
    tcp: np.ndarray  # (m, 3) m
    balance_error: np.ndarray  # (n,) 1: |in - out - stored| / throughput per step


def simulate(
    full: FullModel,
    drive: Drive,
    tcp_time: np.ndarray,
    tcp_positions: np.ndarray,
    start: float | None,
    substeps: int = 1,
    noise: Noise = Noise(),
    progress: Progress = silent,
) -> Simulation:
    """Step the full model through `drive` and solve the thermo-elastic problem at the TCP rows.

    tcp_time (m,) s since the drive's start, tcp_positions (m, n_axes) m, perhaps with angles [rad] behind them: a row
    is evaluated at the end of the step it falls in. start: uniform initial temperature [degC], None: in equilibrium
    with the surroundings.
    """
    model = full.thermal
    stepper = CoupledStepper(model)
    x = stepper.uniform(_air(model.load_model, drive) if start is None else start)
    if start is None:
        for _, x, _ in stepper.run(rest_before(drive), x):  # noqa: B007, B020
            pass
    row_step = np.clip(np.searchsorted(drive.time, tcp_time, side="left") - 1, -1, drive.n_steps - 1)
    tcp = np.zeros((len(tcp_time), 3))
    shown = measured_air(model.load_model, drive)[:, [e for _, e in model.ambient_sensors]]

    def tcp_rows(step: int) -> None:
        for r in np.flatnonzero(row_step == step):
            positions = dict(zip((*model.pose_axes, *model.turning), tcp_positions[r], strict=False))
            tcp[r] = full.structure.displacement(positions, tuple(x))

    temperatures = [np.concatenate([sensor_temperatures(model, x), shown[0]])]
    tcp_rows(-1)
    balance = np.zeros(drive.n_steps)
    with progress("full model", drive.n_steps) as advance:
        for step, x, heat in stepper.run(drive, x, substeps):  # noqa: B020  x goes on from where it began
            balance[step] = heat.balance_error
            temperatures.append(np.concatenate([sensor_temperatures(model, x), shown[step]]))
            tcp_rows(step)
            advance(f"{drive.time[step + 1] / 3600:.1f} h")
    rng = np.random.default_rng(noise.seed)
    T = np.array(temperatures)
    return Simulation(
        time=drive.time,
        temperatures=T + noise.temperature * rng.standard_normal(T.shape),
        sensors=model.all_sensors,
        tcp_time=np.asarray(tcp_time, dtype=float),
        tcp_positions=np.asarray(tcp_positions, dtype=float),
        tcp=tcp + noise.displacement * rng.standard_normal(tcp.shape),
        balance_error=balance,
    )


def simulate_run(
    machine: Machine | Path,
    run: Run | Path,
    dt: float = 60.0,
    substeps: int = 1,
    hours: float | None = None,
    tcp_every: float = 1800.0,
    noise: Noise = Noise(),
    progress: Progress = silent,
) -> tuple[Run, float]:
    """The full model of a description driven by the loads of a run, as a run, and its worst heat balance error.

    machine, run: or where they lie; a machine to be meshed otherwise comes from `remesh`. TCP rows lie at the times
    and positions of the run's tcp.csv, else every `tcp_every` [s] at the logged axis positions. The machine starts at
    the run's initial temperature or in its steady state, else at that of the air around it. Where no temperature moves
    the tool, there are no rows.
    """
    machine = machine if isinstance(machine, Machine) else load_machine(machine)
    full = full_model(machine, progress)
    run = run if isinstance(run, Run) else read_run(run)
    load = full.thermal.load_model
    span = float(run.loads.time[-1] - run.loads.time[0]) / 3600.0
    if hours is not None and hours > span + dt / 3600.0:
        raise LogError(f"the log covers {span:g} h, not {hours:g} h", str(run.folder), "give --hours within the log")
    n_steps = None if hours is None else int(np.ceil(hours * 3600.0 / dt))
    drive = evaluate(load, run.loads.time, signal_values(run, load.signals), dt, n_steps)
    tcp_time, positions = np.zeros(0), np.zeros((0, 0))
    if full.thermal.moves:
        tcp_time, positions = _tcp_rows(full, run, drive, max(1, round(tcp_every / dt)))
    inside = tcp_time <= drive.time[-1]
    start = run.initial_temperature
    if start is None and not run.steady_start:
        start = _air(load, drive)
    result = simulate(full, drive, tcp_time[inside], positions[inside], start, substeps, noise, progress)
    kept = run.loads.time <= drive.time[-1]
    loads = Table(run.loads.time[kept], {k: v[kept] for k, v in run.loads.columns.items()}, run.loads.units)
    temperatures = Table(
        result.time,
        dict(zip(result.sensors, result.temperatures.T, strict=True)),
        dict.fromkeys(result.sensors, "degC"),
    )
    sigma = np.full(len(result.tcp_time), noise.displacement) if noise.displacement > 0 else None
    simulated = Run(
        loads=loads,
        temperatures=temperatures,
        tcp=_told(full, result, sigma) if len(result.tcp_time) else None,
        start=run.start,
        zone=run.zone,
        sampling=run.sampling,
        provenance=f"twin simulate: full model of '{machine.machine.name}', noise seed {noise.seed}",
        synthetic=(
            "temperatures",
            *(("tcp",) if len(result.tcp_time) else ()),
            *(("loads",) if "loads" in run.synthetic else ()),
        ),
        initial_temperature=start,
        steady_start=run.steady_start,
    )
    return simulated, float(result.balance_error.max(initial=0.0))


def _air(load: LoadModel, drive: Drive) -> float:
    """degC around the machine in the first step."""
    return float(measured_air(load, drive)[0, load.surroundings])


def _told(full: FullModel, result: Simulation, sigma: np.ndarray | None) -> Tcp:
    axes, turning = full.thermal.pose_axes, full.thermal.turning
    position, angle = result.tcp_positions[:, : len(axes)], result.tcp_positions[:, len(axes) :]
    return Tcp(result.tcp_time, axes, position, result.tcp, sigma, angle=dict(zip(turning, angle.T, strict=True)))


def _tcp_rows(full: FullModel, run: Run, drive: Drive, every: int) -> tuple[np.ndarray, np.ndarray]:
    """Times (m,) [s] and positions (m, n_axes) [m] of the run's tcp.csv, else of every so many steps.

    With the angles [rad] of rotary axes that turn behind them.
    """
    model = full.thermal
    if run.tcp is not None:
        return run.tcp.time, tcp_places(run.tcp, model.pose_axes, model.turning)
    steps = np.arange(every - 1, drive.n_steps, every)
    return drive.time[steps + 1], places(model, drive.position[steps], drive.angle[steps])
