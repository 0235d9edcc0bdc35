"""The full model of a machine in several runs at once, without noise.

One factor per body solves for all runs, at coefficients between theirs, and what differs goes to the right side. A
minute is one step of SDIRK2 (`twin.rom.tableau`), which costs what two Euler steps cost.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from twin.build.full_model import FullModel
from twin.build.stepper import CoupledStepper, contact_matrix, sensor_temperatures
from twin.inject.experiment import START, STEP, plan
from twin.inject.stored.files import Truth
from twin.logs.run import Run, Table
from twin.logs.signals import signal_values
from twin.rom.drive import Drive, evaluate, measured_air
from twin.rom.model import MachineModel
from twin.rom.step_loads import StepLoads
from twin.rom.tableau import SDIRK2, stages

WITHIN = 0.9  # of the coefficients of a factor: stable below 1
KEPT = 12  # factors per body


@dataclass(frozen=True)
class Driven:
    """One run as the machine feels it."""

    name: str
    drive: Drive
    ahead: float  # s of work before the run's start
    when: np.ndarray  # (m,) s of TCP rows, since the drive's start
    where: np.ndarray  # (m, axes) m
    warm: Mapping[str, float]  # body -> K above START at the start


class SideBySide(CoupledStepper):
    """Several drives of one machine at once; states per body (n_b, drives) K."""

    def step(self, drives: Sequence[Drive], k: int, x: list[np.ndarray]) -> list[np.ndarray]:
        """The states after step k; a drive that has ended keeps its last loads."""
        at = [min(k, d.n_steps - 1) for d in drives]
        own = [[xb[:, r] for xb in x] for r in range(len(drives))]
        loads = [self.loads(d, i, s) for d, i, s in zip(drives, at, own, strict=True)]
        gammas = [contact_matrix(self.model, d, i) for d, i in zip(drives, at, strict=True)]
        forcing = np.column_stack([np.concatenate(self.forcing(v)) for v in loads])
        h = drives[0].time[1] - drives[0].time[0]
        factors = [self._common(b, loads, 1.0 / (SDIRK2.diagonal * h)) for b in range(len(self.model.bodies))]
        across = [self.across(factors, gamma) for gamma in gammas]
        theta = np.column_stack([v.theta for v in loads])

        def solve(right: np.ndarray, near: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            y = []
            parts = zip(self.model.bodies, factors, self._parts(right), self._parts(near), strict=True)
            for body, f, known, seen in parts:
                more = theta[list(body.theta)] - f.theta[:, None]
                y.append(f.solve(known - sum((d * (a @ seen) for d, a in zip(more, body.A, strict=True)), 0.0 * seen)))
            for r in range(len(gammas)):
                alone = self.joined([yb[:, r] for yb in y], factors, across[r])
                for yb, state in zip(y, alone, strict=True):
                    yb[:, r] = state
            return np.concatenate(y), near

        after, _ = stages(SDIRK2, solve, partial(self._capacity, factors), np.concatenate(x), forcing)
        return self._parts(after)

    def _common(self, b: int, loads: Sequence[StepLoads], rate: float) -> Any:
        """A factor of body b with the coefficients of all drives WITHIN its own."""
        own = np.array([v.theta[list(self.model.bodies[b].theta)] for v in loads])
        for factor in reversed(self._cache[b]):
            if np.all(np.abs(own - factor.theta) <= WITHIN * factor.theta):
                return factor
        between = loads[0].theta.copy()
        between[list(self.model.bodies[b].theta)] = 0.5 * (own.min(axis=0) + own.max(axis=0))
        return self._factor(b, between, rate, 0.0)


def driven(
    full: FullModel, run: Run, felt: Mapping[str, np.ndarray], before: float = 0.0, warm: Mapping[str, float] = {}
) -> Driven:
    """A run as a machine feels it.

    felt: signals that the log lacks or has wrong (n,) [SI], by name, at the rows of loads.csv. before [h]: so much of
    the run's own work comes before its start. warm: body -> K warmer at the start.
    """
    when, where = plan(run, full.thermal.pose_axes)
    longer, ahead = felt_run(run, felt, before)
    load = full.thermal.load_model
    drive = evaluate(load, longer.loads.time, signal_values(longer, load.signals), STEP)
    return Driven(run.folder.name, drive, ahead, when + ahead, where, warm)


def felt_run(run: Run, extra: Mapping[str, np.ndarray], before: float) -> tuple[Run, float]:
    """The run with signals `extra`, `before` [h] of its own work ahead, and the time [s] by which its start is late."""
    columns = {**run.loads.columns, **extra}
    units = {**dict.fromkeys(extra, "1"), **run.loads.units}
    t = run.loads.time
    ahead = round(3600.0 * before / STEP) * STEP
    first = t < ahead  # the work of its first hours, once more
    joined = Table(
        np.concatenate([t[first], t + ahead]),
        {k: np.concatenate([v[first], v]) for k, v in columns.items()},
        units,
    )
    return replace(run, loads=joined), ahead


def truths_of(
    models: Sequence[FullModel], several: Sequence[Driven], steps: int | None = None
) -> list[tuple[Truth, ...]]:
    """Per model its truths of several runs, stepped side by side; models are thermally alike.

    steps: so many of them only.
    """
    model = models[0].thermal
    stepper, drives = SideBySide(model, KEPT), [r.drive for r in several]
    x = _start(model, several)
    shown = [measured_air(model.load_model, d)[:, [e for _, e in model.ambient_sensors]] for d in drives]
    row_step = [np.searchsorted(r.drive.time, r.when, side="left") - 1 for r in several]
    tcp = [[np.zeros((len(r.when), 3)) for r in several] for _ in models]
    T = [[np.concatenate([sensor_temperatures(model, [xb[:, i] for xb in x]), s[0]])] for i, s in enumerate(shown)]
    for k in range(steps or max(d.n_steps for d in drives)):
        x = stepper.step(drives, k, x)
        for i, one in enumerate(several):
            if k >= one.drive.n_steps:
                continue
            own = [xb[:, i] for xb in x]
            T[i].append(np.concatenate([sensor_temperatures(model, own), shown[i][k]]))
            for row in np.flatnonzero(row_step[i] == k):
                for full, rows in zip(models, tcp, strict=True):
                    rows[i][row] = _displacement(full, one.where[row], own)
    return [
        tuple(
            _truth(model, one, np.array(own_T), own_tcp) for one, own_T, own_tcp in zip(several, T, each, strict=True)
        )
        for each in tcp
    ]


def _start(model: MachineModel, several: Sequence[Driven]) -> list[np.ndarray]:
    """Per body the states (n_b, drives) K at START, and what is warmer."""
    start = START - model.reference_temperature
    return [np.outer(b.one, [start + d.warm.get(b.name, 0.0) for d in several]) for b in model.bodies]


def _displacement(full: FullModel, position: np.ndarray, x: list[np.ndarray]) -> np.ndarray:
    """Of the TCP (3,) m at a position (axes,) m."""
    return full.structure.displacement(dict(zip(full.thermal.pose_axes, position, strict=True)), tuple(x))


def _truth(model: MachineModel, one: Driven, T: np.ndarray, tcp: np.ndarray) -> Truth:
    """Of one run, from its start on. T: (n, sensors) degC at the drive's times, tcp (m, 3) m."""
    sensors = model.all_sensors
    at = one.drive.time[: len(T)] - one.ahead
    inside = at >= -1e-6  # s: rounding of clock times
    return Truth(one.name, at[inside], T[inside], sensors, one.when - one.ahead, one.where, tcp)
