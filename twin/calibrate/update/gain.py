"""`twin update --method gain` and `paper`: one gain per axis on the base model's TCP error at all poses.

Both know nothing of temperatures. `gain` is the bounded filter of `twin.calibrate.update.gain_filter`; `paper` is eqs
(7) and (8) of paper 003 as printed, for comparison only: its gain is not bounded, jumps, and is not defined where the
simulated error is zero (then the old one is kept).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.calibrate.update import gain_filter
from twin.calibrate.update.gain_filter import GainPrior, GainState
from twin.calibrate.update.program import Measurement, Told
from twin.rom.model import MachineModel
from twin.rom.poses import pose_weights
from twin.run.results import Result

AXES = ("dx", "dy", "dz")


@dataclass(frozen=True)
class At:
    """A method's state with the base model's TCP error of the moment."""

    time: float  # s
    base: np.ndarray  # (n_poses, 3) m
    slow: np.ndarray  # (n_poses, 3) m, the same through the lag
    learnt: GainState


@dataclass(frozen=True)
class GainUpdater:
    """The bounded filter on a base run."""

    model: MachineModel
    base: Result
    prior: GainPrior = GainPrior()

    def begin(self) -> At:
        """Gains of 1."""
        time = float(self.base.time[0])
        base = self.base.tcp[0]
        return At(time, base, base, gain_filter.begin(self.prior, time))

    def advance(self, state: At, step: int) -> At:
        """The base model goes on; gains drift."""
        time = float(self.base.time[step + 1])
        base = self.base.tcp[step + 1]
        slow = gain_filter.lagged(self.prior, state.slow, base, time - state.time)
        return At(time, base, slow, gain_filter.wait(self.prior, state.learnt, time))

    def predict(self, state: At, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """TCP error (3,) m at a position and its standard deviation."""
        return gain_filter.predict(self.prior, state.learnt, self._parts(state, position))

    def at_poses(self, state: At) -> np.ndarray:
        """TCP error (n_poses, 3) m."""
        weight, mean = state.learnt.weight, state.learnt.mean
        gain, slow, offset = np.einsum("ba,bam->ma", weight, mean)
        return np.asarray(state.base * gain + state.slow * slow + offset)

    def learn_temperatures(self, state: At, values: np.ndarray, readings: np.ndarray) -> tuple[At, tuple[Told, ...]]:
        """Nothing to learn."""
        return state, ()

    def learn_tcp(self, state: At, measurement: Measurement) -> tuple[At, tuple[Told, ...]]:
        """Gains and offsets learn a measurement."""
        parts = self._parts(state, measurement.position)
        learnt, told = gain_filter.assimilate(
            self.prior, state.learnt, parts, measurement.displacement, measurement.sigma
        )
        named = tuple(Told(measurement.time, AXES[t.axis], t.innovation, t.sigma, t.accepted) for t in told)
        return replace(state, learnt=learnt), named

    def _parts(self, state: At, position: np.ndarray) -> np.ndarray:
        weights, _ = pose_weights(self.model.pose_grid, position[None])
        return np.column_stack([weights[0] @ state.base, weights[0] @ state.slow])


@dataclass(frozen=True)
class PaperAt:
    """The gain of paper 003 per axis, with the base model's TCP error of the moment."""

    time: float  # s
    base: np.ndarray  # (n_poses, 3) m
    gain: np.ndarray  # (3,)


@dataclass(frozen=True)
class PaperUpdater:
    """Paper 003, eqs (7) and (8); it predicts no uncertainty (NaN)."""

    model: MachineModel
    base: Result

    def begin(self) -> PaperAt:
        """A gain of 1."""
        return PaperAt(float(self.base.time[0]), self.base.tcp[0], np.ones(3))

    def advance(self, state: PaperAt, step: int) -> PaperAt:
        """The base model goes on."""
        return PaperAt(float(self.base.time[step + 1]), self.base.tcp[step + 1], state.gain)

    def predict(self, state: PaperAt, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """TCP error (3,) m at a position; its standard deviation is not known."""
        weights, _ = pose_weights(self.model.pose_grid, position[None])
        return (weights[0] @ state.base) * state.gain, np.full(3, np.nan)

    def at_poses(self, state: PaperAt) -> np.ndarray:
        """TCP error (n_poses, 3) m."""
        return np.asarray(state.base * state.gain)

    def learn_temperatures(
        self, state: PaperAt, values: np.ndarray, readings: np.ndarray
    ) -> tuple[PaperAt, tuple[Told, ...]]:
        """Nothing to learn."""
        return state, ()

    def learn_tcp(self, state: PaperAt, measurement: Measurement) -> tuple[PaperAt, tuple[Told, ...]]:
        """Eq (7)."""
        weights, _ = pose_weights(self.model.pose_grid, measurement.position[None])
        simulated = weights[0] @ state.base
        gain = gain_filter.gain_003(simulated, measurement.displacement)
        told = tuple(
            Told(measurement.time, AXES[a], float(measurement.displacement[a] - simulated[a] * state.gain[a]), np.nan,
                 bool(np.isfinite(gain[a])))
            for a in np.flatnonzero(np.isfinite(measurement.displacement))
        )  # fmt: skip
        return replace(state, gain=np.where(np.isfinite(gain), gain, state.gain)), told
