"""`twin update --method state`: the reduced thermal state and the machine's parameters learn from everything measured.

Temperatures are assimilated every step, TCP measurements when they come (`twin.calibrate.update.state_filter`). The
base model is not touched: the filter steps its own copy, and the correction is the difference. A sensor beyond `gate`
predicted standard deviations is left out, unless more than half of them are: then it is the model that is wrong. A
component of a TCP measurement beyond it is left out, unless the next one agrees.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import numpy as np

from twin.calibrate.update import state_filter, state_learn
from twin.calibrate.update.program import Measurement, Told
from twin.calibrate.update.state_filter import Machine, StateEstimate
from twin.calibrate.update.state_tangent import UncertainLoads

AXES = ("dx", "dy", "dz")
GATE = 4.0
MOST_DOUBT = 20e-6  # m


@dataclass(frozen=True)
class StateUpdater:
    """The filter beside one load history; `loads` are stacked, one row per step of dt [s]."""

    machine: Machine
    loads: UncertainLoads
    dt: float  # s
    time: float  # s, of the start
    temperature: float  # degC, of the whole machine at the start
    gate: float = GATE

    def begin(self) -> StateEstimate:
        """The machine at its initial temperature, parameters at their nominal values."""
        return state_filter.begin(self.machine, self.time, self.temperature, self._loads(0))

    def advance(self, state: StateEstimate, step: int) -> StateEstimate:
        """One step of the state and of what is uncertain about it."""
        return state_filter.advance(self.machine, state, self._loads(step), self.dt)

    def predict(self, state: StateEstimate, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """TCP error (3,) m at a position and its standard deviation."""
        mean, rows = state_learn.tcp_at(self.machine, state, position)
        return mean, state_learn.tcp_sigma(state, rows)

    def at_poses(self, state: StateEstimate) -> np.ndarray:
        """TCP error (n_poses, 3) m."""
        return state_learn.tcp_at_poses(self.machine, state)

    def learn_temperatures(
        self, state: StateEstimate, values: np.ndarray, readings: np.ndarray
    ) -> tuple[StateEstimate, tuple[Told, ...]]:
        """Sensors one after the other, after all of them have been held against the prediction."""
        machine = self.machine
        present = np.flatnonzero(readings > 0)
        noise = machine.prior.sensor_noise / np.sqrt(np.maximum(readings, 1.0))
        rows = state_learn.sensor_rows(machine)
        innovation = values - state_learn.sensors_at(machine, state)
        sigma = np.hypot(np.linalg.norm(rows @ state.root, axis=1), noise)
        far = np.abs(innovation) > self.gate * sigma
        # all at once: the heat is not where the model has it, so believe them, but each no more than its gate
        model_wrong = 2 * int(far[present].sum()) > len(present)
        told = []
        for i in present:
            accepted = model_wrong or not far[i]
            told.append(
                Told(state.time, machine.artefact.model.sensors[i], float(innovation[i]), float(sigma[i]), accepted)
            )
            if accepted:
                wide = float(noise[i] if not far[i] else np.hypot(noise[i], innovation[i] / self.gate))
                now = values[i] - state_learn.sensors_at(machine, state)[i]
                state = state_learn.assimilate_scalar(state, rows[i], float(now), wide)
        return state_learn.bounded(machine, state), tuple(told)

    def learn_tcp(self, state: StateEstimate, measurement: Measurement) -> tuple[StateEstimate, tuple[Told, ...]]:
        """The components one after the other."""
        machine = self.machine
        noise = machine.prior.tcp_noise if measurement.sigma is None else measurement.sigma
        mean, rows = state_learn.tcp_at(machine, state, measurement.position)
        innovation = measurement.displacement - mean
        sigma = np.hypot(state_learn.tcp_sigma(state, rows), noise)
        near = np.abs(innovation) <= self.gate * sigma  # and measured
        state = state_learn.judged(state, rows[near], innovation[near], float(noise))
        told, left_out = [], state.left_out.copy()
        for a in np.flatnonzero(np.isfinite(innovation)):
            far = abs(innovation[a]) > self.gate * sigma[a]
            agrees = abs(innovation[a] - left_out[a]) <= self.gate * np.hypot(sigma[a], noise)
            accepted = not far or bool(agrees)
            told.append(Told(measurement.time, AXES[a], float(innovation[a]), float(sigma[a]), accepted))
            left_out[a] = np.nan if accepted else innovation[a]
            if not accepted:
                continue
            if far:  # twice far off in the same way: something displaces the tool that the model does not know
                state = state_learn.doubted(
                    machine, state, int(a), min(float(abs(innovation[a])) / self.gate, MOST_DOUBT)
                )
            mean, rows = state_learn.tcp_at(machine, state, measurement.position)
            state = state_learn.assimilate_scalar(
                state, rows[a], float(measurement.displacement[a] - mean[a]), float(noise)
            )
        return replace(state_learn.bounded(machine, state), left_out=left_out), tuple(told)

    def _loads(self, step: int) -> UncertainLoads:
        return jax.tree.map(lambda a: a[step], self.loads)
