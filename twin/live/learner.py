"""What measured TCP errors teach beside the machine: the filter `gain` of `twin update`, one step at a time.

The model goes on untouched; per axis a gain, a slow gain and an offset correct its TCP error at all poses
(`twin.calibrate.update.gain_filter`, docs/update.md). Its own slew limit is left out: that of the outputs bounds all.
The filter `state`, which also learns from temperatures, steps a tangent of a hundred columns in JAX: it stays with
`twin update`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from twin.calibrate.update import gain_filter
from twin.calibrate.update.gain_filter import GainPrior, GainState
from twin.live.facts import Facts
from twin.rom.poses import pose_weights

LATE = 15  # steps that a measurement may come late: what the model has moved by since is known
AXES = ("dx", "dy", "dz")


class Learner:
    """The filter and what it needs of the last steps; plain numbers when stored."""

    def __init__(self, facts: Facts, prior: GainPrior = GainPrior()):
        self.facts, self.prior = facts, prior
        self._grid = tuple(np.array(g) for g in facts.pose_grid)
        self._state: GainState | None = None  # None: no step yet
        self._base = self._slow = np.zeros((facts.all_poses, 3))
        self._before: list[tuple[float, np.ndarray]] = []  # time [s] and corrected TCP error at the poses
        self.told: list[dict[str, Any]] = []  # of the last measurement

    def step(self, time: float, displacements: Sequence[float]) -> None:
        """The model has reached `time` [s since its start], with TCP errors (3 * pose + component) [m]."""
        base = np.array(displacements).reshape(-1, 3)
        if self._state is None:
            self._state, self._slow = gain_filter.begin(self.prior, time), base
        else:
            self._slow = gain_filter.lagged(self.prior, self._slow, base, time - self._state.time)
            self._state = gain_filter.wait(self.prior, self._state, time)
        self._base = base
        self._before = [*self._before[-LATE:], (time, self._at_poses())]

    def corrected(self, displacements: Sequence[float]) -> list[float]:
        """TCP errors as learnt, of those that `step` was given last."""
        return list(displacements) if self._state is None else [float(v) for v in self._at_poses().ravel()]

    def oldest(self) -> float:
        """The earliest time [s] of a measurement that can still be used; infinite before the first step."""
        return self._before[0][0] if self._before else np.inf

    def newest(self) -> float:
        """The time [s] that the model has reached."""
        return self._before[-1][0] if self._before else -np.inf

    def measure(self, time: float, position: Sequence[float], displacement: Sequence[float], sigma: float) -> None:
        """Learn an uncorrected TCP error (3,) [m], NaN where not measured, made at `time` [s]; sigma NaN: the prior's.

        Raises ValueError for one from before `oldest`.
        """
        if self._state is None or time < self.oldest():
            raise ValueError(f"made at {time:g} s, which is too old")
        weights, _ = pose_weights(self._grid, np.array(position, dtype=float)[None])
        w, n = weights[0], self.facts.poses
        then = self._then(min(time, self.newest()))
        moved = w @ (self._at_poses()[:n] - then[:n])  # by the model, since it was made
        parts = np.column_stack([w @ self._base[:n], w @ self._slow[:n]])
        measured = np.array(displacement, dtype=float) + moved
        self._state, told = gain_filter.assimilate(self.prior, self._state, parts, measured, sigma)
        self.told = [{"name": AXES[t.axis], "innovation_m": t.innovation, "sigma_m": t.sigma, "accepted": t.accepted}
                     for t in told]  # fmt: skip
        self._before[-1] = (self._before[-1][0], self._at_poses())

    def _then(self, time: float) -> np.ndarray:
        """TCP errors at the poses at a time [s] within the last steps, straight between them."""
        times = np.array([b[0] for b in self._before])
        k = min(int(np.searchsorted(times, time)), len(times) - 1)
        (early, a), (late, b) = self._before[max(k - 1, 0)], self._before[k]
        share = 1.0 if late == early else (time - early) / (late - early)
        return np.asarray(a + share * (b - a))

    def learnt(self) -> dict[str, list[float]]:
        """Gain, slow gain and offset [m] of each axis, the means over the bank of filters."""
        if self._state is None:
            return {}
        mean = np.einsum("ba,bam->am", self._state.weight, self._state.mean)
        return {axis: [float(v) for v in row] for axis, row in zip(AXES, mean, strict=True)}

    def stored(self) -> dict[str, Any]:
        return {
            "state": None if self._state is None else self._state.to_json(),
            "base": self._base.tolist(),
            "slow": self._slow.tolist(),
            "before": [[time, own.tolist()] for time, own in self._before],
            "told": self.told,
        }

    def restore(self, told: dict[str, Any]) -> None:
        """The inverse of `stored`."""
        self._state = None if told["state"] is None else GainState.from_json(told["state"])
        self._base, self._slow = np.array(told["base"]), np.array(told["slow"])
        self._before = [(time, np.array(own)) for time, own in told["before"]]
        self.told = told["told"]

    def _at_poses(self) -> np.ndarray:
        if self._state is None:
            return self._base
        gain, slow, offset = np.einsum("ba,bam->ma", self._state.weight, self._state.mean)
        return np.asarray(self._base * gain + self._slow * slow + offset)
