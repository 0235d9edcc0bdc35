"""On-machine update: sparse TCP measurements, and temperatures, correct the TCP error of an untouched base model.

A method is a set of pure functions of its own state (`Updater`); `Program` makes of any of them what runs beside the
machine: `advance` through a step, `assimilate` a measurement, `predict`. What a measurement changes is let in no faster
than `slew`, so the correction never jumps. `replay_update` drives a program through a logged run the way it would have
lived it: rows of tcp.csv exist from their time on, and each is predicted before it is used (erratum E-000-7).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Generic, Protocol, TypeVar

import numpy as np

from twin.calibrate.score.compare import tcp_positions
from twin.calibrate.update.plan import Plan
from twin.errors import LogError
from twin.logs.run import Run
from twin.progress import Progress, silent
from twin.rom.model import MachineModel
from twin.rom.poses import pose_weights
from twin.rom.turning import STRAIGHT
from twin.run.results import Result

S = TypeVar("S")
SLEW = 5e-6 / 60.0  # m/s: 5 um per minute


@dataclass(frozen=True)
class Measurement:
    """A measured TCP error at one position."""

    time: float  # s
    position: np.ndarray  # (n_pose_axes,) m
    displacement: np.ndarray  # (3,) m, NaN where not measured
    sigma: float | None = None  # m, of each component


@dataclass(frozen=True)
class Told:
    """What became of one scalar measurement: "dx", "dy", "dz" [m], or a sensor [K]."""

    time: float  # s
    name: str
    innovation: float  # measured minus predicted, before it was assimilated
    sigma: float  # standard deviation of that difference, as predicted
    accepted: bool


class Updater(Protocol[S]):
    """A method of updating; its state is immutable and holds all that it has learnt."""

    def begin(self) -> S:
        """The state at the start of the run."""
        ...

    def advance(self, state: S, step: int) -> S:
        """The state at the end of a step (0 is the first)."""
        ...

    def predict(self, state: S, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """TCP error (3,) m at a position, now, and its standard deviation (3,) m without measurement noise."""
        ...

    def at_poses(self, state: S) -> np.ndarray:
        """TCP error (n_poses, 3) m, now."""
        ...

    def learn_temperatures(self, state: S, values: np.ndarray, readings: np.ndarray) -> tuple[S, tuple[Told, ...]]:
        """Assimilate sensors (n_sensors,) degC, NaN where not measured, each the mean of so many readings."""
        ...

    def learn_tcp(self, state: S, measurement: Measurement) -> tuple[S, tuple[Told, ...]]:
        """Assimilate a TCP measurement made now."""
        ...


@dataclass(frozen=True)
class Live(Generic[S]):
    """What a program keeps between calls."""

    state: S
    held: np.ndarray  # (n_poses, 3) m: what was learnt and is not let in yet


@dataclass(frozen=True)
class Program(Generic[S]):
    """A method with its slew limit [m/s]; 0: none. Pure: the same calls give the same numbers."""

    updater: Updater[S]
    model: MachineModel
    dt: float  # s, of a step
    slew: float = SLEW

    def begin(self) -> Live[S]:
        return Live(self.updater.begin(), np.zeros((len(self.model.poses), 3)))

    def advance(self, live: Live[S], step: int) -> Live[S]:
        """Through one step; what is held back shrinks towards zero."""
        most = self.slew * self.dt
        return Live(self.updater.advance(live.state, step), live.held - np.clip(live.held, -most, most))

    def temperatures(self, live: Live[S], values: np.ndarray, readings: np.ndarray) -> tuple[Live[S], tuple[Told, ...]]:
        """Assimilate temperatures."""
        state, told = self.updater.learn_temperatures(live.state, values, readings)
        return self._without_jump(live, state) if told else live, told

    def assimilate(self, live: Live[S], measurement: Measurement) -> tuple[Live[S], tuple[Told, ...]]:
        """Assimilate a TCP measurement."""
        state, told = self.updater.learn_tcp(live.state, measurement)
        return self._without_jump(live, state), told

    def predict(self, live: Live[S], position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """TCP error (3,) m that the control is told at a position, and the standard deviation of its error."""
        mean, sigma = self.updater.predict(live.state, position)
        weights, _ = pose_weights(self.model.pose_grid, position[None])
        held = weights[0] @ live.held
        return mean - held, np.hypot(sigma, held)

    def at_poses(self, live: Live[S]) -> np.ndarray:
        """The same (n_poses, 3) m at all poses."""
        return self.updater.at_poses(live.state) - live.held

    def _without_jump(self, live: Live[S], state: S) -> Live[S]:
        if self.slew <= 0.0:
            return Live(state, live.held)
        return Live(state, live.held + self.updater.at_poses(state) - self.updater.at_poses(live.state))


@dataclass(frozen=True)
class Updated:
    """A run replayed online; n steps, m rows of tcp.csv inside it."""

    method: str
    time: np.ndarray  # (n + 1,) s
    base: np.ndarray  # (n + 1, n_poses, 3) m, the untouched model
    correction: np.ndarray  # (n + 1, n_poses, 3) m, to be added to it
    position: np.ndarray  # (n + 1, n_pose_axes) m, where the machine stood
    tcp: np.ndarray  # (n + 1, 3) m, updated, at the actual position
    sigma: np.ndarray  # (n + 1, 3) m, of its error
    row_time: np.ndarray  # (m,) s
    row_position: np.ndarray  # (m, n_pose_axes) m
    measured: np.ndarray  # (m, 3) m
    row_sigma: np.ndarray  # (m,) m, of the measurement, NaN where unknown
    predicted: np.ndarray  # (m, 3) m, before the row was used
    predicted_sigma: np.ndarray  # (m, 3) m
    predicted_base: np.ndarray  # (m, 3) m, by the base model
    used: np.ndarray  # (m,) bool: assimilated; others only scored
    asked: tuple[float, ...]  # s, when a scheduler asked for a measurement
    told: tuple[Told, ...]
    reference: float | None  # s: the row that the others count from, where they do; it is none of the m


def replay_update(
    program: Program[S],
    method: str,
    run: Run,
    base: Result,
    plan: Plan | None = None,
    sensors: tuple[str, ...] = (),
    progress: Progress = silent,
) -> tuple[Updated, Live[S]]:
    """Replay a run online; `base` is its replay on the untouched model.

    plan: which rows of tcp.csv are used, by default all; the others are predicted all the same. sensors: names of
    structural sensors in the model's order, to be read from the run's temperatures.

    Where deviations count from the first row of tcp.csv they are put on what is predicted when it comes. That row
    measures nothing then, and what the prediction is wrong there all later errors keep.

    Raises LogError where the run has no row of tcp.csv inside its loads' time, none but the one that the others count
    from, or where that one is outside or has no position.
    """
    plan = Plan() if plan is None else plan
    if run.tcp is None:
        raise LogError("no tcp.csv", str(run.folder), "an update needs rows of time, positions, dx, dy, dz")
    reference, rows = _rows(run, base)
    if not rows:
        where = str(run.folder / "tcp.csv")
        remedy = "check the times of tcp.csv; a rotary axis that turns tool or work must be at zero"
        raise LogError("no TCP measurement inside the time of the loads", where, remedy)
    model, n, m = program.model, len(base.time) - 1, len(rows)
    values, readings = _temperatures(run, base.time, sensors)
    of_step = np.searchsorted(base.time, [r.time for r in rows], side="left") - 1
    counted = np.zeros(3)  # m: what the base model's error is too little by, where deviations count from a row
    position = base.position[:, [base.axes.index(a) for a in model.pose_axes]]
    live = program.begin()
    correction, (tcp, sigma) = np.zeros_like(base.tcp), np.zeros((2, n + 1, 3))
    predicted, predicted_sigma, predicted_base = np.zeros((3, m, 3))
    used, told = np.zeros(m, dtype=bool), list[Told]()
    correction[0] = program.at_poses(live) - base.tcp[0]
    tcp[0], sigma[0] = program.predict(live, position[0])
    with progress("update", n) as advanced:
        for k in range(n):
            before, live = live, program.advance(live, k)
            end = float(base.time[k + 1])
            tcp[k + 1], sigma[k + 1] = program.predict(live, position[k + 1])
            correction[k + 1] = program.at_poses(live) - base.tcp[k + 1]
            if reference is not None and k == max(0, np.searchsorted(base.time, reference.time, side="left") - 1):
                zero, _, by_base, _ = _expected(program, base, k, before, live, reference)
                counted = zero - by_base
                rows = [replace(r, displacement=r.displacement + zero) for r in rows]
            drift = {}
            here = np.flatnonzero(of_step == k)
            for i in here:  # all of them before any is learnt
                predicted[i], predicted_sigma[i], by_base, drift[i] = _expected(program, base, k, before, live, rows[i])
                predicted_base[i] = by_base + counted
            if readings[k].any():
                live, news = program.temperatures(live, values[k], readings[k])
                told += news
            for i in here:
                if plan.uses(rows[i].time, rows[i].position):
                    used[i] = True
                    now = replace(rows[i], time=end, displacement=rows[i].displacement + drift[i])
                    live, news = program.assimilate(live, now)
                    told += news
            plan.consider(end, partial(_worth, program, live, position[k + 1], end))
            advanced(f"{end / 3600:.1f} h")
    known = [np.nan if r.sigma is None else r.sigma for r in rows]
    return Updated(
        method=method,
        time=base.time,
        base=base.tcp,
        correction=correction,
        position=position,
        tcp=tcp,
        sigma=sigma,
        row_time=np.array([r.time for r in rows]),
        row_position=np.array([r.position for r in rows]),
        measured=np.array([r.displacement for r in rows]),
        row_sigma=np.array(known, dtype=float),
        predicted=predicted,
        predicted_sigma=predicted_sigma,
        predicted_base=predicted_base,
        used=used,
        asked=tuple(plan.asked),
        told=tuple(told),
        reference=None if reference is None else reference.time,
    ), live


def _expected(
    program: Program[S], base: Result, k: int, before: Live[S], live: Live[S], row: Measurement
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """When a row comes in step k, between `before` and `live`, each (3,) m: the TCP error as predicted, its standard
    deviation, as the base model has it, and by how much the method's own prediction moves to the end of the step."""
    ahead = (base.time[k + 1] - row.time) / (base.time[k + 1] - base.time[k])
    late, sigma = program.predict(live, row.position)
    predicted = late + ahead * (program.predict(before, row.position)[0] - late)
    weights, _ = pose_weights(program.model.pose_grid, row.position[None])
    by_base = weights[0] @ (ahead * base.tcp[k] + (1.0 - ahead) * base.tcp[k + 1])
    own = [program.updater.predict(p.state, row.position)[0] for p in (before, live)]
    return predicted, sigma, by_base, ahead * (own[1] - own[0])


def _worth(program: Program[S], live: Live[S], position: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations (3,) m before and after a measurement now: they do not depend on what it will say."""
    mean, sigma = program.updater.predict(live.state, position)
    after, _ = program.updater.learn_tcp(live.state, Measurement(time, position, mean))
    return sigma, program.updater.predict(after, position)[1]


def _rows(run: Run, base: Result) -> tuple[Measurement | None, list[Measurement]]:
    """The rows of tcp.csv inside the computed time, with a position and a value, in the order of time; before them the
    one that all count from, where they do.

    Without those of a turned tool or work: what is learnt is told at the poses, whose angles are zero.
    """
    tcp = run.tcp
    if tcp is None or not len(tcp.time):
        return None, []
    position, n = tcp_positions(tcp, base), len(base.pose_axes)
    position, straight = position[:, :n], np.abs(position[:, n:]).max(axis=1, initial=0.0) <= STRAIGHT
    good = straight & (tcp.time >= base.time[0]) & (tcp.time <= base.time[-1]) & np.isfinite(position).all(axis=1)
    from_first = run.tcp_reference == "first"
    if from_first and not good[0]:
        raise LogError(
            "deviations count from the first row, which is outside the loads' time, has no position, or a turned axis",
            str(run.folder / "tcp.csv"),
            "let the loads begin before the first row, or count from a row with rotary axes at zero",
        )
    good &= (tcp.time > base.time[0]) & np.isfinite(tcp.displacement).any(axis=1)
    sigma = tcp.sigma

    def row(i: int) -> Measurement:
        known = sigma is not None and np.isfinite(sigma[i]) and sigma[i] > 0.0
        own = float(sigma[i]) if sigma is not None and known else None
        return Measurement(float(tcp.time[i]), position[i], tcp.displacement[i], own)

    good[0] &= not from_first
    rows = [row(i) for i in np.argsort(tcp.time, kind="stable") if good[i]]
    return row(0) if from_first else None, rows


def _temperatures(run: Run, time: np.ndarray, sensors: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Per step the mean (n, n_sensors) degC of the readings that arrived in it, and their number (n, n_sensors)."""
    n = len(time) - 1
    total, count = np.zeros((2, n, len(sensors)))
    if run.temperatures is not None:
        step = np.searchsorted(time, run.temperatures.time, side="left") - 1
        inside = (step >= 0) & (step < n)
        for i, name in enumerate(sensors):
            values = run.temperatures.columns.get(name)
            if values is None:
                continue
            good = inside & np.isfinite(values)
            np.add.at(total[:, i], step[good], values[good])
            np.add.at(count[:, i], step[good], 1.0)
    return np.where(count > 0, total / np.maximum(count, 1.0), np.nan), count
