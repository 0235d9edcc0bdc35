"""The JAX back end: the step of `twin run`, one at a time, as rows come in.

Each step makes its factor anew, where `twin run` keeps one while film coefficients stay within a fifth of it: so the
state is z alone. The difference is of second order in that fifth (measured: 5e-5 K over an hour of the spindle).

Rows are evaluated PIECE at a time while a step goes on: a step at 100 Hz has thousands, and its last block would wait
for all of them.
"""

from __future__ import annotations

import twin.run.jax_setup  # noqa: F401  isort: skip  before NumPy

import json
from array import array
from dataclasses import replace
from pathlib import Path

import jax
import numpy as np

from twin.errors import FailedCheck, TwinError
from twin.live.engine import EngineFailure
from twin.live.give_back import give_back
from twin.live.prepare import facts_of, strut_rows
from twin.logs.signals import as_meant
from twin.rom.artefact import read_artefact
from twin.rom.drive import Drive, evaluate_between, measured_air
from twin.rom.following_flags import following_flags
from twin.rom.joined import joined
from twin.rom.poses import outside_grid
from twin.rom.turning import STRAIGHT, off_zero
from twin.run.correction_struts import on_struts
from twin.run.plausible import refuse_glowing, refuse_not_finite, refuse_unbalanced
from twin.run.stepping import Inputs, StepHeat, advance, inputs_of
from twin.run.system import prepare

PIECE = 1000  # rows: a block of 10 s at 100 Hz
_SETTLED = 2  # times that a state is kept, by when all is compiled


class JaxEngine:
    """A machine read from an artefact; the state between steps is z and the rows since the last one."""

    def __init__(self, path: Path):
        """Raises ArtefactError for files that are no artefact."""
        self._read(path)
        give_back()  # of the artefact, six times of what is stepped
        self._load = self._model.load_model
        self.loads: list[tuple[Inputs, np.ndarray]] | None = None  # of steps, for a filter that takes them; None: none
        self._positions = set(self.facts.axis_channels)
        system = self._prepared.system
        self._films = jax.tree.map(np.asarray, system).film_plan
        self._C, self._G = np.asarray(system.C), np.asarray(system.G)
        self.start(self.facts.reference_temperature)
        self._fresh = True  # no step of this process is made yet
        self._kept = 0  # times

    def _read(self, path: Path) -> None:
        artefact = read_artefact(path)
        self.facts = facts_of(artefact)
        self._prepared = prepare(artefact.model)
        self._E = strut_rows(artefact.model, self._prepared) if on_struts(artefact.model) else None
        self._model = replace(artefact.model, bodies=(), structure=None)  # what is stepped is in `_prepared`
        self.substeps = int(artefact.certificate.get("substeps", 1))

    def start(self, temperature: float) -> None:
        self.initial = temperature  # degC
        self._z = self._prepared.uniform(temperature)
        self._steps = 0
        self._times = np.zeros(0)
        self._rows = np.zeros((0, len(self.facts.channels)))  # since the last step or piece of one
        self._pieces: list[Drive] = []  # of the step that goes on
        self._fed = [(self._times, self._rows)]  # since the last step
        self._air = [temperature] * len(self._model.ambient_sensors)
        self._flags: list[str] = []
        self._balance = 0.0

    def feed(self, times: array[float], rows: array[float]) -> int:
        before, small = self._steps, 1e-9 * self.facts.step
        time, row = np.array(times), np.array(rows).reshape(len(times), -1)
        if not len(self._times) and len(time):
            default = np.array([np.nan if c.default is None else c.default for c in self.facts.channels])
            row[0] = np.where(np.isnan(row[0]), default, row[0])
        if np.any(np.diff(np.append(self._times[-1:], time)) <= 0.0):
            raise EngineFailure("time does not increase", "engine", "look at the log with `twin check`")
        at = 0
        while at < len(time):  # up to the row that completes a step, and so on
            edge = (self._steps + 1) * self.facts.step
            end = min(int(np.searchsorted(time, edge - small)) + 1, len(time))
            self._append(time[at:end], row[at:end])
            while self._times[-1] >= (self._steps + 1) * self.facts.step - small:
                self._step()
            at = end
        return self._steps - before

    def _append(self, time: np.ndarray, row: np.ndarray) -> None:
        """Rows of the step that goes on; where its pieces end depends on the rows alone, not on how they come."""
        self._fed.append((time, row))
        self._times = np.append(self._times, time)
        self._rows = np.concatenate([self._rows, row])
        before = (self._steps + 1 - 1e-9) * self.facts.step
        while len(self._times) > PIECE:
            known = np.isfinite(self._rows[:PIECE]).any(axis=0)
            # no piece ends where a value is missing: the next would begin with it held, and nobody flag it
            ends = np.isfinite(self._rows[PIECE:, known]).all(axis=1) & (self._times[PIECE:] < before)
            if not ends.any():
                return
            self._evaluate(float(self._times[PIECE + int(np.argmax(ends))]))

    def _evaluate(self, end: float) -> None:
        """The piece of a step up to `end` [s], whose rows are then done with."""
        last = int(np.searchsorted(self._times, end - 1e-9 * self.facts.step)) + 1
        time, values = self._times[:last], self._rows[:last]
        signals = {
            c.name: as_meant(c, values[:, k])
            for k, c in enumerate(self._load.signals)
            if np.isfinite(values[:, k]).any()
        }
        edges = np.array([0.0, end - time[0]])
        self._pieces.append(evaluate_between(self._load, time, signals, edges, self.facts.step))
        self._keep(end)

    def _step(self) -> None:
        dt = self.facts.step
        begin, edge = self._steps * dt, (self._steps + 1) * dt
        self._evaluate(edge)
        drive = joined(self._pieces)
        self._pieces, self._fed = [], [(self._times, self._rows)]
        inputs = inputs_of(self._load, drive, self.substeps)
        if self.loads is not None:
            self.loads.append((inputs, drive.contact_heat))
        states, heat = advance(self._prepared.layout, self._prepared.system, self._z, inputs)
        before, self._z = self._z, np.asarray(states)[-1]
        self._steps += 1
        self._judge(drive, jax.tree.map(np.asarray, heat), np.array([begin, edge]), np.stack([before, self._z]))
        if self._fresh:
            self._fresh = False
            give_back()

    def _keep(self, edge: float) -> None:
        """What stands at the end of a step or piece begins the next one: values hold, axes are on their way."""
        small = 1e-9 * self.facts.step
        first = int(np.searchsorted(self._times, edge - small))
        there = first < len(self._times) and self._times[first] <= edge + small  # a row at the edge itself
        past = self._rows[: first + there]
        last = np.where(np.isnan(past), -1, np.arange(len(past))[:, None]).max(axis=0)  # -1: no value yet
        held = past[np.maximum(last, 0), np.arange(past.shape[1])]
        if there:
            first += 1
        elif first < len(self._times):
            before = self._times[first - 1]
            part, to = (edge - before) / (self._times[first] - before), self._rows[first]
            moved = np.array(sorted(self._positions), dtype=int)
            known = moved[~np.isnan(to[moved])]
            held[known] += part * (to[known] - held[known])
        self._times = np.append(edge, self._times[first:])
        self._rows = np.concatenate([held[None], self._rows[first:]])

    def _judge(self, drive: Drive, heat: StepHeat, time: np.ndarray, states: np.ndarray) -> None:
        """Flags, air and balance of a step; raises EngineFailure for what cannot be."""
        dt = float(time[1] - time[0])
        throughput = dt * (np.abs(heat.power).sum() + heat.gross.sum())
        net = heat.stored.sum() - dt * (heat.power.sum() + heat.film.sum())
        self._balance = float(abs(net) / max(throughput, 1e-6 * self._prepared.heat_capacity))
        rise = states @ self._C.T
        try:
            refuse_not_finite(time, states)
            refuse_glowing(time, rise, self._model.sensors)
            refuse_unbalanced(time, np.array([self._balance]))
        except FailedCheck as e:
            raise EngineFailure(e.problems[0].what, "engine", e.problems[0].remedy) from e
        self._air = measured_air(self._load, drive)[0, [i for _, i in self._model.ambient_sensors]].tolist()
        theta, surface, winding = (np.asarray(a) for a in (heat.theta, heat.surface, heat.winding))
        followed = following_flags(self._load, drive, self._films, theta, surface, winding)
        axes = [a.name for a in self._load.axes]
        here = drive.position[:, [axes.index(a) for a in self._model.pose_axes]]
        self._flags = [name for k, name in enumerate(drive.flag_names) if drive.flags[0, k]]
        self._flags += [name for name, raised in followed.items() if raised[0]]
        turned = zip(self._load.rotary, np.abs(drive.angle[0]) > STRAIGHT, strict=True)
        self._flags += [off_zero(axis.name) for axis, off in turned if off]
        if outside_grid(self._model.pose_grid, here)[0]:
            self._flags.append("position outside the pose grid, TCP error of its border")

    @property
    def steps(self) -> int:
        return self._steps

    def sensors(self) -> list[float]:
        structural = self.facts.reference_temperature + self._C @ self._z
        return [*structural.tolist(), *self._air]

    def displacements(self) -> list[float]:
        found: list[float] = (self._G @ self._z).tolist()
        return found

    def errors(self) -> list[float]:
        if self._E is None:
            return self.displacements()
        found: list[float] = (self._E @ self._z).tolist()
        return found

    def states(self) -> list[float]:
        found: list[float] = self._z.tolist()
        return found

    def flags(self) -> list[str]:
        return list(self._flags)

    def balance(self) -> float:
        return self._balance

    def saved(self) -> bytes:
        self._kept += 1
        if self._kept <= _SETTLED:
            give_back()
        times, rows = (np.concatenate(own) for own in zip(*self._fed, strict=True))
        told = {"steps": self._steps, "rows": len(times), "air": self._air, "flags": self._flags,
                "balance": self._balance, "initial": self.initial}  # fmt: skip
        numbers = np.concatenate([self._z, times, rows.ravel()])  # as text 6,000 rows take 0.1 s
        return json.dumps(told).encode() + b"\n" + numbers.astype("<f8").tobytes()

    def restore(self, saved: bytes) -> None:
        line, _, state = saved.partition(b"\n")
        try:
            told = json.loads(line)
            numbers = np.frombuffer(state, dtype="<f8").astype(float)
            n, m, s = len(self._z), told["rows"], len(self.facts.channels)
            if len(numbers) != n + m + m * s:
                raise ValueError("another number of states")
        except (ValueError, KeyError) as e:
            raise TwinError("the state is of another engine", "state", "start afresh with --fresh") from e
        self.start(told["initial"])
        self._z, self._steps = numbers[:n], told["steps"]
        self._times, self._rows = numbers[n : n + m], numbers[n + m :].reshape(m, s)
        self._fed = [(self._times, self._rows)]  # pieces are evaluated with the next rows: a start does not wait for it
        self._air, self._flags, self._balance = told["air"], told["flags"], told["balance"]
