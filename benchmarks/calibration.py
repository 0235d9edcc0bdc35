"""Time of a calibration (20 parameters, 12 h, 32 sensors) and of a batch (1,000 samples, 8 h), and their accuracy."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from benchmarks.recovery import artefact
from benchmarks.recovery_truth import NOISE, truth
from twin.calibrate.fit.batch import batch
from twin.calibrate.fit.calibration import calibrate
from twin.calibrate.fit.options import Options
from twin.calibrate.fit.problem import problem
from twin.calibrate.fit.training import states_at
from twin.logs.run import Run

SAMPLES, HOURS = 1000, 8.0
OPTIONS = Options(temperature_sigma=NOISE.temperature)
COARSE = replace(OPTIONS, tail=1e-6)


def first(run: Run, hours: float) -> Run:
    """The first hours of a run."""
    past = run.loads.time <= 3600.0 * hours
    columns = {name: values[past] for name, values in run.loads.columns.items()}
    return replace(run, loads=replace(run.loads, time=run.loads.time[past], columns=columns))


def main() -> None:
    model, run = artefact(), truth(0)
    sources = [p for p in model.parameters if p.kind == "source"]
    chosen = sources + [p for p in model.parameters if p.kind == "film"][: 20 - len(sources)]
    for again in ("with everything to compile", "again"):
        began = time.perf_counter()
        result = calibrate(model, [run], chosen, OPTIONS)
        print(f"   calibration of {len(chosen)} parameters, 12 h, {len(result.fit.problem.runs[0].measured.sensors)} "
              f"structural of 32 sensors, {again}: {time.perf_counter() - began:.0f} s; {len(result.fit.history)} "
              f"iterations, stopped at {result.fit.stopped}, {result.fit.problem.model.n} states")  # fmt: skip
    print(f"   window model against the runtime at the fit, rms: {1e3 * result.agreement.temperature:.1f} mK, "
          f"{1e6 * result.agreement.displacement:.2f} um")  # fmt: skip

    short = first(run, HOURS)
    made = problem(model, [short], chosen, COARSE)
    samples = np.random.default_rng(0).standard_normal((SAMPLES, len(chosen)))
    low, high = made.bounds
    samples = np.clip(samples, low, high)
    began = time.perf_counter()
    many = batch(made, made.runs[0], samples)
    print(f"   batch of {SAMPLES} samples, {HOURS:g} h, {made.model.n} states: {time.perf_counter() - began:.0f} s")
    worst = 0.0
    one = np.concatenate([b.one for b in model.model.bodies])
    for k in range(3):
        x0 = (made.runs[0].start - model.model.reference_temperature) * one
        states = states_at(model.model, chosen, made.values(samples[k]), made.runs[0].drive, x0, OPTIONS.substeps)
        first_state, T = 0, np.zeros((len(states), len(model.model.sensors)))
        for body in model.model.bodies:
            T[:, list(body.sensors)] += states[:, first_state : first_state + body.n] @ body.C.T
            first_state += body.n
        m = made.runs[0].measured
        wanted = m.mean_of @ (T[:, m.column] + model.model.reference_temperature)
        worst = max(worst, float(np.sqrt(np.mean((many.temperature[k] - wanted) ** 2, axis=0)).max()))
    spread = float(many.temperature.std(axis=0).max())
    print(f"   against the artefact's runtime at three samples: worst sensor {1e3 * worst:.0f} mK (rms); the samples "
          f"spread it by up to {spread:.1f} K (standard deviation)")  # fmt: skip


if __name__ == "__main__":
    main()
