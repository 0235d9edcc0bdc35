"""Full-model truths of the trials in tests/hidden, written where tests find them.

    python -m benchmarks.hidden_store                  # those that are missing, the most important first
    python -m benchmarks.hidden_store zone coolant     # these, anew
    python -m benchmarks.hidden_store --error 120      # what the time step changes in the first 120 min

Needs gmsh, once; some 2 min a trial. Each is stored as soon as it is done; trials of one machine whose causes move the
TCP and heat nothing share their temperatures. The three runs of a trial are stepped side
by side: one factor per body solves for all of them, at coefficients between theirs, and what differs goes to the right
side. A minute is one step of a method of second order with two stages (Alexander, SIAM J. Numer. Anal. 14, 1977:
L-stable), which costs what two Euler steps cost.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.hidden_truth import START, STEP, _felt, machine_of, other_text
from tests.hidden.load import MODEL, RUNS, TRUTH, Truth, plan, write
from tests.hidden.trial import Trial, about, hidden_text
from tests.hidden.trials import SIMULATED, TRIALS
from twin.build.full_model import FullModel, assemble
from twin.build.simulate import simulate
from twin.build.stepper import CoupledStepper, Loads, contact_matrix, sensor_temperatures
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.rom.drive import Drive, evaluate, measured_air

GAMMA = 1.0 - 0.5**0.5  # of both stages, in steps
WITHIN = 0.9  # of the coefficients of a factor: stable below 1
KEPT = 12  # factors per body
COLD = ("expansion", "scale_expansion")  # families that change no temperature


@dataclass(frozen=True)
class Ride:
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
        forcing = [np.column_stack(f) for f in zip(*(self.forcing(v) for v in loads), strict=True)]
        h = drives[0].time[1] - drives[0].time[0]
        factors = [self._common(b, loads, 1.0 / (GAMMA * h)) for b in range(len(self.model.bodies))]
        theta = np.column_stack([v.theta for v in loads])

        def stage(base: list[np.ndarray], seen: list[np.ndarray]) -> list[np.ndarray]:
            y = []
            for b, (body, f) in enumerate(zip(self.model.bodies, factors, strict=True)):
                more = theta[list(body.theta)] - f.theta[:, None]
                rest = sum((d * (a @ seen[b]) for d, a in zip(more, body.A, strict=True)), np.zeros_like(seen[b]))
                y.append(f.solve(f.rate * (body.E @ base[b]) + forcing[b] - rest))
            for r, gamma in enumerate(gammas):  # joins the bodies, as `CoupledStepper.solve`
                Q, t = np.zeros_like(gamma), np.zeros(len(gamma))
                for body, f, yb in zip(self.model.bodies, factors, y, strict=True):
                    ports = list(body.ports)
                    Q[np.ix_(ports, ports)], t[ports] = f.Q, body.port_rows @ yb[:, r]
                q = gamma @ np.linalg.solve(np.eye(len(gamma)) + Q @ gamma, t)
                for body, f, yb in zip(self.model.bodies, factors, y, strict=True):
                    yb[:, r] -= f.X @ q[list(body.ports)]
            return y

        first = stage(x, x)
        return stage([a + (1.0 - GAMMA) / GAMMA * (b - a) for a, b in zip(x, first, strict=True)], first)

    def _common(self, b: int, loads: Sequence[Loads], rate: float) -> Any:
        """A factor of body b with the coefficients of all drives WITHIN its own."""
        own = np.array([v.theta[list(self.model.bodies[b].theta)] for v in loads])
        for factor in reversed(self._cache[b]):
            if np.all(np.abs(own - factor.theta) <= WITHIN * factor.theta):
                return factor
        between = loads[0].theta.copy()
        between[list(self.model.bodies[b].theta)] = 0.5 * (own.min(axis=0) + own.max(axis=0))
        return self._factor(b, between, rate, 0.0)


def made(trials: Sequence[Trial]) -> list[tuple[Truth, ...]]:
    """What the machines of trials really do in RUNS, without noise; several trials have the same temperatures."""
    texts = [hidden_text(other_text(t.seed), t) for t in trials]
    models = [assemble(machine_of(text)) for text, _ in texts]
    felt, before = texts[0][1], trials[0].before
    warm = {run: {body: by for (where, body), by in trials[0].warm.items() if where == run} for run in RUNS}
    rides = [_ride(models[0], run, felt.get(run, {}), before.get(run, 0.0), warm[run]) for run in RUNS]
    return ridden(models, rides)


def together(name: str) -> list[Trial]:
    """The trial of a name and those that have its temperatures."""
    first = TRIALS[name]
    alike = [TRIALS[n] for n in SIMULATED if TRIALS[n].seed == first.seed and n != name]
    return [first, *(t for t in alike if all(c.family in COLD for c in (*first.causes, *t.causes)))]


def ridden(models: Sequence[FullModel], rides: Sequence[Ride], steps: int | None = None) -> list[tuple[Truth, ...]]:
    """Per model its truths, of all rides side by side; models are thermally alike. The first `steps` of the rides."""
    model = models[0].thermal
    stepper, drives = SideBySide(model, KEPT), [r.drive for r in rides]
    x = [
        xb[:, None] + np.outer(body.one, [ride.warm.get(body.name, 0.0) for ride in rides])
        for body, xb in zip(model.bodies, stepper.uniform(START), strict=True)
    ]
    shown = [measured_air(model.load_model, d)[:, [e for _, e in model.ambient_sensors]] for d in drives]
    row_step = [np.searchsorted(r.drive.time, r.when, side="left") - 1 for r in rides]
    tcp = [[np.zeros((len(r.when), 3)) for r in rides] for _ in models]
    T = [[np.concatenate([sensor_temperatures(model, [xb[:, i] for xb in x]), s[0]])] for i, s in enumerate(shown)]
    for k in range(steps or max(d.n_steps for d in drives)):
        x = stepper.step(drives, k, x)
        for i, ride in enumerate(rides):
            if k >= ride.drive.n_steps:
                continue
            own = [xb[:, i] for xb in x]
            T[i].append(np.concatenate([sensor_temperatures(model, own), shown[i][k]]))
            for row in np.flatnonzero(row_step[i] == k):
                positions = dict(zip(model.pose_axes, ride.where[row], strict=True))
                for m, full in enumerate(models):
                    tcp[m][i][row] = full.structure.displacement(positions, tuple(own))
    sensors = (*model.sensors, *(name for name, _ in model.ambient_sensors))
    at = [ride.drive.time[: len(t)] - ride.ahead for ride, t in zip(rides, T, strict=True)]
    return [
        tuple(
            Truth(ride.name, at[i][at[i] >= -1e-6], np.array(T[i])[at[i] >= -1e-6], sensors, ride.when - ride.ahead,
                  ride.where, own_tcp[i])
            for i, ride in enumerate(rides)
        )
        for own_tcp in tcp
    ]  # fmt: skip


def _ride(
    full: FullModel, name: str, felt: Mapping[str, np.ndarray], before: float = 0.0, warm: Mapping[str, float] = {}
) -> Ride:
    run = read_run(MODEL / "runs" / name)
    when, where = plan(run, full.thermal.pose_axes)
    longer, ahead = _felt(run, felt, before)
    load = full.thermal.load_model
    drive = evaluate(load, longer.loads.time, signal_values(longer, load.signals), STEP)
    return Ride(name, drive, ahead, when + ahead, where, warm)


def print_error(steps: int) -> None:
    """Against Euler steps of `twin simulate`: four to the minute, and sixteen, which are next to exact."""
    full = assemble(machine_of(other_text(0)))
    rides = [_ride(full, run, {}) for run in RUNS]
    began = time.process_time()
    (side,) = ridden([full], rides, steps)
    print(f"   {len(RUNS)} runs of {steps} min side by side in {time.process_time() - began:.0f} s")
    for truth, ride in zip(side[:2], rides[:2], strict=True):
        run = read_run(MODEL / "runs" / ride.name)
        load = full.thermal.load_model
        drive = evaluate(load, run.loads.time, signal_values(run, load.signals), STEP, steps)
        rows = ride.when <= drive.time[-1]
        euler = {n: simulate(full, drive, ride.when[rows], ride.where[rows], START, n) for n in (4, 16)}
        for name, T, tcp in (
            ("side by side", truth.temperatures, truth.tcp[rows]),
            ("4 Euler steps", euler[4].temperatures, euler[4].tcp),
        ):
            error = T - euler[16].temperatures
            most, mean = np.abs(error).max(axis=0), np.sqrt((error**2).mean(axis=0))
            worst = np.argsort(most)[:-4:-1]
            told = ", ".join(f"{truth.sensors[j]} {most[j]:.3f} (rms {mean[j]:.3f})" for j in worst)
            um = 1e6 * np.abs(tcp - euler[16].tcp).max()
            print(f"   {ride.name}, {name} against 16: K at most {told}; TCP {um:.2f} um", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.hidden_store", description=__doc__)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(SIMULATED)}")
    parser.add_argument("--error", type=int, metavar="MINUTES", help="print what the time step changes in these")
    asked = parser.parse_args()
    if asked.error:
        print_error(asked.error)
        return
    for name in asked.names or SIMULATED:
        if not asked.names and (TRUTH / f"{name}.npz").exists():
            continue
        began = time.perf_counter()
        trials = together(name)
        for trial, truths in zip(trials, made(trials), strict=True):
            size = write(trial.name, truths, about(trial)).stat().st_size
            print(f"   {trial.name}: {time.perf_counter() - began:.0f} s, {size / 1e3:.0f} kB", flush=True)


if __name__ == "__main__":
    main()
