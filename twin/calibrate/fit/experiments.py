"""Which experiment would separate what the data could not: sensitivities of the model on loads that were never run.

Candidates are simple enough for a shop floor: one group of signals at work for two hours and two hours of rest, moving
air or a warmer hall while the machine cools, every one measured like the runs at hand. The gain is the posterior
standard deviation of the worst unseparated combination with the candidate's data added (A-optimal along that
direction; e.g. Atkinson, Donev, Tobias, Optimum Experimental Designs, 2007, ch. 10). The window model was made for the
measured runs: for other loads its sensitivities are good enough to rank experiments, not to predict temperatures.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.calibrate.fit.evaluated import Evaluated, noise_at, whitened_jacobian
from twin.calibrate.fit.fit import Fit
from twin.calibrate.fit.integration import loads_for
from twin.calibrate.fit.measured import Measured
from twin.calibrate.fit.problem import FitRun, Problem
from twin.calibrate.fit.separation import Combination
from twin.rom.drive import evaluate
from twin.rom.load_model import LoadModel

HOURS, SAMPLING = 4.0, 10.0  # h, s
WORK = 0.6  # of a signal's range


@dataclass(frozen=True)
class Experiment:
    """What to do, and what it would bring."""

    name: str
    sigma_before: float  # of the combination, in prior standard deviations
    sigma_after: float


def propose(fit: Fit, combinations: tuple[Combination, ...], best: int = 3) -> dict[str, tuple[Experiment, ...]]:
    """Per combination (by its names, joined with " / ") the candidates that shrink it most, best first."""
    if not combinations:
        return {}
    problem, n = fit.problem, len(fit.x)
    told = fit.information + np.eye(n)
    brought = {name: _information(fit, run) for name, run in _candidates(problem).items()}
    result = {}
    for c in combinations:
        before = float(np.sqrt(c.vector @ np.linalg.solve(told, c.vector)))
        ranked = sorted(
            (
                Experiment(name, before, float(np.sqrt(c.vector @ np.linalg.solve(told + more, c.vector))))
                for name, more in brought.items()
            ),
            key=lambda e: e.sigma_after,
        )
        result[" / ".join(c.names)] = tuple(ranked[:best])
    return result


def _information(fit: Fit, run: FitRun) -> np.ndarray:
    """(n, n) of a candidate whose sensors scatter like those of the first run; its initial state is taken as known."""
    made = Evaluated(replace(fit.problem, runs=(run,)))
    sensors, tcp = fit.noise[0]
    noise = noise_at(made, [(sensors.channels, tcp.channels)], fit.x)
    J = whitened_jacobian(made, noise, fit.x)
    J[:, len(fit.problem.parameters) :] = 0.0
    return np.asarray(J.T @ J)


def _candidates(problem: Problem) -> dict[str, FitRun]:
    load = problem.model.load_model
    units = {s.name: s.unit for s in load.signals}
    groups: dict[tuple[str, ...], str] = {}
    for source in load.sources:
        own = tuple(sorted({n for n in source.use.signals.values() if units[n] != "degC"}))
        if own:
            groups.setdefault(own, source.name)
    air = {n for f in load.films for n in f.use.signals.values() if units[n] != "degC"}
    result = {
        f"{', '.join(own)} at {WORK:.0%} of range for 2 h, then 2 h of rest": _run(problem, dict.fromkeys(own, 1.0))
        for own in groups
    }
    everything = {n: 1.0 for own in groups for n in own}
    result["all loads together for 2 h, then 2 h of rest"] = _run(problem, everything)
    for name in sorted(air - set(everything)):
        result[f"all loads for 2 h, then rest with {name} at {WORK:.0%} of range"] = _run(
            problem, everything, after={name: 1.0}
        )
    for environment in load.environments:
        if environment.signal:
            result[f"rest, with {environment.signal} 5 K warmer for 2 h"] = _run(problem, {}, warmer=environment.signal)
    return result


def _signals(load: LoadModel, problem: Problem) -> dict[str, float]:
    """Every signal at rest: zero where its range allows, temperatures as the first run's mean."""
    drive = problem.runs[0].drive
    mean = {e.signal: float(drive.environment[:, k].mean()) for k, e in enumerate(load.environments) if e.signal}
    return {s.name: mean.get(s.name, float(np.clip(0.0, s.low, s.high))) for s in load.signals}


def _run(
    problem: Problem, at_work: dict[str, float], after: dict[str, float] | None = None, warmer: str = ""
) -> FitRun:
    load, first = problem.model.load_model, problem.runs[0]
    time = np.arange(0.0, HOURS * 3600.0 + SAMPLING / 2, SAMPLING)
    working = time < HOURS * 1800.0
    ranges = {s.name: s for s in load.signals}
    values = {name: np.full(len(time), level) for name, level in _signals(load, problem).items()}
    for name, share in at_work.items():
        values[name] = np.where(working, share * WORK * ranges[name].high, values[name])
    for name, share in (after or {}).items():
        values[name] = np.where(working, values[name], share * WORK * ranges[name].high)
    if warmer:
        values[warmer] = values[warmer] + np.where(working, 5.0, 0.0)
    if at_work:  # what moves sweeps its stroke, at no common period
        for k, axis in enumerate(load.axes):
            phase = np.mod(time / (37.0 + 11.0 * k), 1.0)
            swing = 0.4 * (axis.high - axis.low) * (4.0 * np.abs(phase - 0.5) - 1.0)
            values[axis.position] = np.where(working, (axis.low + axis.high) / 2 + swing, values[axis.position])
    drive = evaluate(load, time, values, problem.options.dt)
    n, m = drive.n_steps, first.measured
    bins = np.arange(0, n, max(1, round(problem.options.bin_length / problem.options.dt)))
    mean_of = np.zeros((len(bins), n + 1))
    mean_of[np.arange(len(bins)), bins + 1] = 1.0
    hours = np.arange(1, int(HOURS) + 1) if len(m.tcp) else np.zeros(0)
    k = len(hours)
    measured = Measured(
        name=first.name, sensors=m.sensors, column=m.column, bin_time=drive.time[bins + 1], mean_of=mean_of,
        temperature=np.zeros((len(bins), len(m.sensors))), count=np.ones((len(bins), len(m.sensors))),
        tcp_time=3600.0 * hours, tcp_step=(60 * hours - 1).astype(int).clip(0, n - 1), tcp_share=np.ones(k),
        pose=np.repeat(m.pose[:1], k, axis=0), tcp=np.zeros((k, 3)), tcp_sigma=None, from_first=False, skipped=(),
        position=np.repeat(m.position[:1], k, axis=0),
    )  # fmt: skip
    rows = replace(
        first.rows,
        step=measured.tcp_step,
        share=measured.tcp_share,
        row=np.repeat(np.asarray(first.rows.row)[:1], k, axis=0),
        member_row=np.repeat(np.asarray(first.rows.member_row)[:, :1], k, axis=1),
    )
    return FitRun(first.name, drive, first.start, measured, loads_for(problem.model, drive, problem.options.substeps),
                  rows, np.asarray(first.z0))  # fmt: skip
