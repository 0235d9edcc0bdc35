"""A described machine run by both models: the full one, and the reduced one in the runtime's steps."""

from __future__ import annotations

import twin.run.jax_setup  # isort: skip  before numpy: JAX's LAPACK is SciPy's OpenBLAS

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import twin
from twin.build.pipeline import BuildOptions, compact_model, full_model, rich_model
from twin.build.product import build_artefact
from twin.build.simulate import simulate_run
from twin.logs.run import Run, Table
from twin.machine.load import load_machine
from twin.rom.artefact import write_artefact

Columns = Mapping[str, tuple[str, np.ndarray]]  # of loads.csv: unit and values (n,)


@dataclass(frozen=True)
class Computed:
    """What one of the models gives, the initial state included."""

    time: np.ndarray  # (n + 1,) s
    temperature: dict[str, np.ndarray]  # sensor -> (n + 1,) degC
    tcp: np.ndarray  # (n, 3) m at the ends of the steps


@dataclass(frozen=True)
class Both:
    full: Computed
    reduced: Computed
    states: int  # of the reduced model
    unknowns: int  # of the full one


@dataclass(frozen=True)
class Steps:
    """How both models are stepped."""

    dt: float = 60.0  # s
    substeps: int | None = 1  # of the runtime in a step; None: built and certified, and as many as `twin build` chooses
    full: int = 1  # of the full model in a step
    start: float = 0.0  # degC of the whole machine


def run_both(
    folder: Path, description: str, time: np.ndarray, columns: Columns, steps: Steps, options: BuildOptions
) -> Both:
    """Write the description to `folder`, build from it, and step both models through the loads (n,) at times [s]."""
    path = folder / "machine.toml"
    path.write_text(description, encoding="utf-8")
    machine = load_machine(path)
    full = full_model(machine)
    reduced = compact_model(machine, rich_model(machine, full, options.rich), options)
    run = Run(
        Table(time, {k: v for k, (_, v) in columns.items()}, {k: unit for k, (unit, _) in columns.items()}),
        initial_temperature=steps.start,
    )
    simulated, balance = simulate_run(machine, run, steps.dt, steps.full, tcp_every=steps.dt)
    assert balance < 1e-6
    assert simulated.temperatures is not None
    moved = np.zeros((0, 3)) if simulated.tcp is None else simulated.tcp.displacement
    of_full = Computed(simulated.temperatures.time, simulated.temperatures.columns, moved)
    artefact = folder / "machine.h5"
    if steps.substeps is None:
        build_artefact(path, artefact, options)
    else:
        bare = replace(reduced, bodies=tuple(replace(b, F=None) for b in reduced.bodies))
        write_artefact(artefact, bare, description)
    numbers = twin.run(artefact, run, dt=steps.dt, substeps=steps.substeps).numbers
    temperature = dict(zip(numbers.sensors, numbers.temperature.T, strict=True))
    of_reduced = Computed(numbers.time, temperature, numbers.tcp_actual[1:])
    return Both(of_full, of_reduced, reduced.n, full.thermal.n)
