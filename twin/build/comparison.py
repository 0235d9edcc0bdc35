"""How far one model is from another over scenarios: the largest error of every output, and of the size of what case.

The outputs are the sensors and the TCP displacement at places: the poses of the grid, then positions between them. Two
models in equal steps differ by what their equations leave out; one model in two steps by the time integration.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from twin.build.scenario import Scenario
from twin.build.stepper import CoupledStepper, sensor_temperatures, tcp_at_poses
from twin.build.workers import LONG, each
from twin.machine.description import Limits
from twin.rom.drive import split
from twin.rom.model import MachineModel
from twin.rom.poses import pose_weights
from twin.rom.tcp import elastic_rows, inputs, is_exact

TINY = 1e-12  # K or m: an output that does not move at all has no relative error
# Of the largest scenario: one in which less happens is scaled as if it were that large. Loads drawn near zero are no
# smaller case of the same machine, but next to none: an error of 1 mK in 4 mK says nothing of 10 K. A judgement.
IDLE = 0.01
# Steps of the reference within one: of a method of second order a quarter of the step leaves a sixteenth of its error,
# where the step resolves what moves. `step_halved` says how much it leaves.
FINER = 4


@dataclass(frozen=True)
class Comparison:
    """Maximum error against a reference per scenario and output."""

    labels: tuple[str, ...]
    temperature_error: np.ndarray  # (n_scenarios, n_sensors) K
    displacement_error: np.ndarray  # (n_scenarios, n_places, 3) m
    temperature_low: np.ndarray  # (n_scenarios, n_sensors) degC, of the reference
    temperature_high: np.ndarray
    displacement_low: np.ndarray  # (n_scenarios, n_places, 3) m, of the reference
    displacement_high: np.ndarray

    @property
    def temperature_range(self) -> np.ndarray:
        """(n_sensors,) K over all scenarios."""
        return self.temperature_high.max(axis=0) - self.temperature_low.min(axis=0)

    @property
    def displacement_range(self) -> np.ndarray:
        """(n_places, 3) m over all scenarios."""
        return self.displacement_high.max(axis=0) - self.displacement_low.min(axis=0)

    @property
    def temperature_case(self) -> np.ndarray:
        """(n_scenarios,) K: the size of each scenario: largest change of any sensor, steady state included."""
        return (self.temperature_high - self.temperature_low).max(axis=1, initial=0.0)

    @property
    def displacement_case(self) -> np.ndarray:
        """(n_scenarios,) m: the largest change of the TCP displacement at any place in each scenario."""
        return (self.displacement_high - self.displacement_low).max(axis=(1, 2), initial=0.0)

    def scaled(self, limits: Limits) -> tuple[np.ndarray, np.ndarray]:
        """Maximum error per sensor (n_sensors,) K and TCP row (n_places, 3) m with every scenario scaled to the case.

        Exact for scenarios with given films, because the models are linear in loads and air temperatures then: the
        scenario with all of them scaled has all responses and errors scaled. An estimate where films follow the
        surface: scaled loads have other films, in both models alike. Scenarios in which next to nothing happens (IDLE)
        are scaled as larger ones.
        """
        T_size, u_size = (
            np.maximum(case, max(IDLE * case.max(initial=0.0), TINY))
            for case in (self.temperature_case, self.displacement_case)
        )
        T = self.temperature_error * (limits.at_temperature_range / T_size)[:, None]
        u = self.displacement_error * (limits.at_displacement_range / u_size)[:, None, None]
        return T.max(axis=0), u.max(axis=0)

    def times(self, factor: float) -> Comparison:
        """The comparison with all errors so many times as large."""
        T, u = factor * self.temperature_error, factor * self.displacement_error
        return replace(self, temperature_error=T, displacement_error=u)

    def range_in_case(self, limits: Limits) -> tuple[np.ndarray, np.ndarray]:
        """Ranges of sensors (n_sensors,) K and TCP rows (n_places, 3) m where all scenarios together are the case."""
        T = limits.at_temperature_range / max(self.temperature_case.max(initial=0.0), TINY)
        u = limits.at_displacement_range / max(self.displacement_case.max(initial=0.0), TINY)
        return self.temperature_range * T, self.displacement_range * u


@dataclass(frozen=True)
class Way:
    """A model, and in steps of what part of the runtime's it is stepped: 1 / `finer`."""

    model: MachineModel
    finer: int = 1


def compare(
    reference: MachineModel,
    candidate: MachineModel,
    scenarios: Sequence[Scenario],
    substeps: int = 1,
    progress: Callable[[str], None] = lambda _: None,
    long: float = LONG,
) -> Comparison:
    """The candidate against the reference in equal steps: `compare_ways` of two."""
    ways = (Way(reference), Way(candidate))
    return compare_ways(ways, ((0, 1),), scenarios, substeps, progress=progress, long=long)[0]


def compare_ways(
    ways: Sequence[Way],
    pairs: Sequence[tuple[int, int]],
    scenarios: Sequence[Scenario],
    substeps: int = 1,
    positions: np.ndarray | None = None,
    progress: Callable[[str], None] = lambda _: None,
    long: float = LONG,
) -> list[Comparison]:
    """Step all ways through the scenarios and, at their ends, to the steady state of the last loads; compare pairs.

    pairs: (reference, candidate), indices of ways. substeps: of the time integrator per step, as many as the runtime
    takes. Finer steps have the loads of the step that they lie in, and evaluate all laws that follow temperatures anew.
    positions: (m, n_axes) m, where the TCP displacement is compared besides the poses of the grid. long: s of work left
    that are worth another process (`twin.build.workers`); the result does not depend on it.
    """
    where = np.zeros((0, len(ways[0].model.pose_axes))) if positions is None else positions
    readers: dict[int, _Reader] = {}
    for way in ways:
        readers.setdefault(id(way.model), _Reader(CoupledStepper(way.model), where))
    how = (tuple((readers[id(way.model)], way.finer) for way in ways), tuple(pairs), substeps)
    rows = each(_compared, how, scenarios, lambda scenario: progress(scenario.label), long)
    labels = tuple(s.label for s in scenarios)
    columns = [map(np.array, zip(*of_pair, strict=True)) for of_pair in zip(*rows, strict=True)]
    return [Comparison(labels, *c) for c in columns]


class _Reader:
    """Steps a model through scenarios and reads its outputs: sensors, and the TCP displacement at places."""

    def __init__(self, stepper: CoupledStepper, positions: np.ndarray) -> None:
        self.stepper, self._positions = stepper, positions

    @cached_property
    def _between(self) -> tuple[np.ndarray, ...]:
        """Per body what maps its elastic inputs, or its displacements at the poses, to positions (m, 3, ...)."""
        model = self.stepper.model
        if is_exact(model):
            return elastic_rows(model, self._positions)
        return (pose_weights(model.pose_grid, self._positions[:, : len(model.pose_axes)])[0],)

    def outputs(self, scenario: Scenario, substeps: int, finer: int) -> tuple[np.ndarray, np.ndarray]:
        """Temperatures (n, n_sensors) degC and TCP displacements (n, n_places, 3) m at the ends of all steps."""
        self.stepper.forget()
        run = self.stepper.run(split(scenario.drive, finer), self.stepper.uniform(scenario.start), substeps)
        return self._joined([self._read(x) for step, x, _ in run if (step + 1) % finer == 0])

    def steady(self, scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
        """The same (1, ...) of the steady state of the last loads."""
        self.stepper.forget()
        state = self.stepper.steady_state(scenario.drive, scenario.drive.n_steps - 1)
        self.stepper.forget()  # factors of a full model need not wait for the next scenario
        return self._joined([self._read(state)])

    def _read(self, x: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
        """Temperatures, displacements at the poses, and elastic inputs per body where positions are to be read."""
        model = self.stepper.model
        wanted = len(self._positions) and is_exact(model)
        own = [inputs(model, b) @ xb for b, xb in enumerate(x)] if wanted else []
        return sensor_temperatures(model, x), tcp_at_poses(model, x), own

    def _joined(self, read: list[tuple[np.ndarray, np.ndarray, list[np.ndarray]]]) -> tuple[np.ndarray, np.ndarray]:
        temperatures, at_poses, own = zip(*read, strict=True)
        T, u = np.array(temperatures), np.array(at_poses)
        if not len(self._positions):
            return T, u
        if is_exact(self.stepper.model):
            per_body = zip(map(np.array, zip(*own, strict=True)), self._between, strict=True)
            off = np.sum([np.tensordot(w, Z, (1, 2)) for w, Z in per_body], axis=0)
        else:
            off = np.einsum("mp,kpc->kmc", self._between[0], u)
        return T, np.concatenate([u, off], axis=1)


def _compared(
    how: tuple[tuple[tuple[_Reader, int], ...], tuple[tuple[int, int], ...], int], scenario: Scenario
) -> list[tuple[np.ndarray, ...]]:
    """Per pair the columns of `Comparison` after the labels."""
    ways, pairs, substeps = how
    steady = {reader: reader.steady(scenario) for reader in dict.fromkeys(reader for reader, _ in ways)}
    made = {}
    for reader, finer in dict.fromkeys(ways):  # a machine that is kept whole is its own reduced model
        moving = reader.outputs(scenario, substeps, finer)
        made[reader, finer] = [np.concatenate(both) for both in zip(moving, steady[reader], strict=True)]
    result: list[tuple[np.ndarray, ...]] = []
    for a, b in pairs:
        (T, u), (T_other, u_other) = made[ways[a]], made[ways[b]]
        errors = np.abs(T_other - T).max(axis=0), np.abs(u_other - u).max(axis=0)
        result.append((*errors, T.min(axis=0), T.max(axis=0), u.min(axis=0), u.max(axis=0)))
    return result
