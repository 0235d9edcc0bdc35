"""What is measured beside the machine, as it teaches a filter of `twin update`, one step of the model at a time.

The model goes on untouched; a filter (`twin.live.filter_gain`, `twin.live.filter_state`) tells the TCP error at the
poses as learnt. The slew limit of `twin update` is left out: that of the outputs bounds whatever is learnt.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from twin.live.facts import Facts
from twin.rom.poses import pose_weights

LATE = 15  # steps that a measurement may come late: what the model has moved by since is known


class Filter(Protocol):
    """A method of learning; n poses of the artefact. `stored` gives plain numbers, and the same bit by bit back."""

    def step(self, time: float, base: np.ndarray, temperatures: Mapping[str, float]) -> None:
        """The model has reached `time` [s since its start], with TCP errors (n, 3) m; sensors read in the step [degC].

        Raises EngineFailure.
        """

    def at_poses(self) -> np.ndarray:
        """TCP errors (n, 3) m, now, as learnt."""

    def learn(
        self, time: float, position: np.ndarray, weights: np.ndarray, displacement: np.ndarray, sigma: float
    ) -> list[dict[str, Any]]:
        """A TCP error (3,) m measured now, NaN where it was not, at a position [m] between poses with weights (m,) on
        the grid; sigma NaN: the prior's. What became of each component, and how far off it was."""

    def learnt(self) -> dict[str, Any]:
        """For the health record."""

    def stored(self) -> dict[str, Any]: ...

    def restore(self, told: dict[str, Any]) -> None: ...


class Learner:
    """A filter, and what it takes to learn what was measured some steps ago."""

    def __init__(self, facts: Facts, filter_: Filter):
        self.facts, self.filter = facts, filter_
        self._grid = tuple(np.array(g) for g in facts.pose_grid)
        self._before: list[tuple[float, np.ndarray]] = []  # time [s] and TCP error as learnt at the poses
        self.told: list[dict[str, Any]] = []  # of the last measurement

    def step(self, time: float, displacements: Sequence[float], temperatures: Mapping[str, float]) -> None:
        """The model has reached `time` [s since its start], with TCP errors (3 * pose + component) [m]."""
        self.filter.step(time, np.array(displacements).reshape(-1, 3), temperatures)
        self._before = [*self._before[-LATE:], (time, self.filter.at_poses())]

    def corrected(self, displacements: Sequence[float]) -> list[float]:
        """TCP errors as learnt, of those that `step` was given last."""
        return [float(v) for v in self._before[-1][1].ravel()] if self._before else list(displacements)

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
        if time < self.oldest():
            raise ValueError(f"made at {time:g} s, which is too old")
        at = np.array(position, dtype=float)
        weights = pose_weights(self._grid, at[None])[0][0]
        n, (now, own) = self.facts.poses, self._before[-1]
        moved = weights @ (own[:n] - self._then(min(time, now))[:n])  # by the model, since it was made
        self.told = self.filter.learn(now, at, weights, np.array(displacement, dtype=float) + moved, sigma)
        self._before[-1] = (now, self.filter.at_poses())

    def _then(self, time: float) -> np.ndarray:
        """TCP errors at the poses at a time [s] within the last steps, straight between them."""
        times = np.array([b[0] for b in self._before])
        k = min(int(np.searchsorted(times, time)), len(times) - 1)
        (early, a), (late, b) = self._before[max(k - 1, 0)], self._before[k]
        share = 1.0 if late == early else (time - early) / (late - early)
        return np.asarray(a + share * (b - a))

    def stored(self) -> dict[str, Any]:
        before = [[time, own.tolist()] for time, own in self._before]
        return {"filter": self.filter.stored(), "before": before, "told": self.told}

    def restore(self, told: dict[str, Any]) -> None:
        """The inverse of `stored`."""
        self.filter.restore(told["filter"])
        self._before = [(time, np.array(own)) for time, own in told["before"]]
        self.told = told["told"]
