"""A step with all laws following speeds and temperatures, beside one with constant films, on the same loads."""

from __future__ import annotations

import twin.run.jax_setup  # noqa: F401  isort: skip  before numpy: JAX's LAPACK is SciPy's OpenBLAS

import time
from dataclasses import replace

import jax
import numpy as np

from benchmarks.five_axis import FOLDER, compact
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.rom.drive import Drive, evaluate
from twin.rom.law_values import states_of
from twin.rom.load_model import LawUse, LoadModel
from twin.rom.model import MachineModel
from twin.run.replay import BLOCK
from twin.run.stepping import advance, inputs_of
from twin.run.system import prepare

STILL = LawUse("constant_film", {"natural": 10.0}, {})
HEAT = LawUse("constant_heat", {"power": 100.0}, {})


def constant(load: LoadModel) -> LoadModel:
    """The same machine with literature values for all films, no radiation, and constant heat where a source follows."""
    films = tuple(replace(f, use=STILL, gain=1.0, emissivity=0.0) for f in load.films)
    sources = tuple(replace(s, use=HEAT) if states_of(s.use) else s for s in load.sources)
    return replace(load, films=films, sources=sources)


def seconds_per_step(model: MachineModel, drive: Drive, repeat: int = 5) -> float:
    """Median over repetitions of the mean over all steps."""
    prepared = prepare(model)
    inputs = inputs_of(model.load_model, drive, 4)
    n = drive.n_steps // BLOCK * BLOCK
    blocks = [jax.tree.map(lambda a, b=b: a[b : b + BLOCK], inputs) for b in range(0, n, BLOCK)]
    times = []
    for _ in range(repeat + 1):
        z = prepared.uniform(22.0)
        began = time.perf_counter()
        for block in blocks:
            states, _ = advance(prepared.layout, prepared.system, z, block)
            z = states[-1]
        jax.block_until_ready(z)
        times.append(time.perf_counter() - began)
    return float(np.median(times[1:])) / n  # the first one compiles


def main() -> None:
    model = compact()
    run = read_run(FOLDER / "runs" / "experiment_a")
    signals = signal_values(run, model.load_model.signals)
    following = sum(bool(states_of(f.use)) for f in model.load_model.films)
    print(f"   {model.n} states, {len(model.load_model.films)} films ({following} follow the surface temperature), "
          f"{sum(f.emissivity > 0 for f in model.load_model.films)} radiate, "
          f"{sum(bool(states_of(s.use)) for s in model.load_model.sources)} sources follow theirs")  # fmt: skip
    plain = replace(model, load_model=constant(model.load_model))
    still = {s.name: np.full_like(run.loads.time, signals[s.name][0]) for s in model.load_model.signals}
    for name, loads in (("experiment A, 12 h", signals), ("every axis at rest", still)):
        every, few = (seconds_per_step(m, evaluate(m.load_model, run.loads.time, loads, 60.0)) for m in (model, plain))
        print(f"   {name}: {1e3 * every:.3f} ms a step, constant films {1e3 * few:.3f} ms: {every / few:.2f} times")
