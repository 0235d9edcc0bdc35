"""The full model of a machine stepped through a run: a truth for experiments."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from twin.errors import LogError
from twin.face.inputs import Quantity, positive, run_of
from twin.face.machine import Machine, warn
from twin.progress import Progress, reporter

if TYPE_CHECKING:
    from twin.logs.run import Run


@dataclass(frozen=True)
class SimulateOptions:
    """How the full model is stepped, and the noise of what it writes."""

    size: Quantity | None = None  # m: new meshes of this size by the model's geometry.py
    dt: Quantity = "60 s"
    substeps: int = 1  # steps of the second-order method per step
    hours: float | None = None  # stop after this time; the whole run by default
    tcp_every: Quantity = "30 min"  # TCP rows, where the run has no tcp.csv
    noise: Quantity = "0 K"  # standard deviation at sensors
    tcp_noise: Quantity = "0 um"  # and of TCP rows
    seed: int = 0  # of the noise


@dataclass(frozen=True)
class Simulation:
    """What the full model would have measured."""

    run: Run
    balance_error: float  # the largest of any step, as a share of the throughput

    def __str__(self) -> str:
        run = self.run
        rows = 0 if run.tcp is None else len(run.tcp.time)
        table = run.temperatures
        counts = (0, 0) if table is None else (len(table.time), len(table.columns))
        return (
            f"{counts[0]} rows of {counts[1]} temperatures, {rows} TCP rows; "
            f"heat balance closes to {self.balance_error:.1e} of the throughput"
        )


def simulate(
    machine: Machine | str | Path,
    run: Run | str | Path,
    output: str | Path | None = None,
    options: SimulateOptions | None = None,
    progress: Progress | bool | None = None,
) -> Run:
    """Step the full model of a machine through the loads of a run; returns a run with temperatures and TCP rows.

    output: run folder to write, which is read again: what was written is what you get. Other arguments accept what
    `twin.run` does. Raises TwinError with everything that `twin.check` calls an error, LogError for a folder that holds
    measured data.

    >>> import twin
    >>> options = twin.SimulateOptions(noise="0.1 K", seed=1)
    >>> truth = twin.simulate("tests/machines/spindle", "tests/machines/spindle/runs/warm_up", options=options)
    >>> truth.synthetic
    ('temperatures', 'tcp', 'loads')
    >>> bool(truth.temperatures.columns["front"].max() > 38.0)  # degC
    True
    """
    from twin.logs.read import read_run

    found = simulation(machine, run, output, options, progress)
    return found.run if output is None else read_run(Path(output))


def simulation(
    machine: Machine | str | Path,
    run: Run | str | Path,
    output: str | Path | None = None,
    options: SimulateOptions | None = None,
    progress: Progress | bool | None = None,
) -> Simulation:
    """The same, with the error of its heat balance."""
    from twin.build.remesh import remesh
    from twin.build.simulate import Noise, simulate_run
    from twin.logs.write import refuse_to_destroy, write_run

    o = options or SimulateOptions()
    noise = Noise(
        positive("noise", o.noise, "delta_degC", zero=True),
        positive("tcp_noise", o.tcp_noise, "m", zero=True),
        o.seed,
    )
    size = None if o.size is None else positive("size", o.size, "m")
    step, every = positive("dt", o.dt, "s"), positive("tcp_every", o.tcp_every, "s")
    if output is not None:
        if isinstance(run, str | Path) and Path(output).resolve() == Path(run).resolve():
            raise LogError("is the run that is read", str(output), "choose another folder with -o")
        refuse_to_destroy(Path(output))  # now, not after hours
    loaded = warn(machine)
    described = loaded.description
    if size is not None:
        described = remesh(described, size)
    made, balance = simulate_run(
        described, run_of(run), step, o.substeps, o.hours, every, noise=noise, progress=reporter(progress)
    )
    if output is not None:  # what it was made for, so that `twin check` knows its signals
        named = Path(os.path.relpath(loaded.path.resolve(), Path(output).resolve())).as_posix()
        made = replace(made, machine=named, folder=Path(output))
        write_run(Path(output), made)
    return Simulation(made, balance)
