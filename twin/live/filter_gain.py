"""The filter `gain` of `twin update` beside the machine: per axis a gain, a slow gain and an offset of the TCP error.

docs/update.md; `twin.calibrate.update.gain_filter`. It learns from measured TCP errors alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from twin.calibrate.update import gain_filter
from twin.calibrate.update.gain_filter import GainPrior, GainState
from twin.errors import TwinError

AXES = ("dx", "dy", "dz")


class GainFilter:
    """A `twin.live.learner.Filter`."""

    def __init__(self, poses: int, prior: GainPrior = GainPrior()):
        self.prior = prior
        self._state: GainState | None = None  # None: no step yet
        self._base = self._slow = np.zeros((poses, 3))

    def step(self, time: float, base: np.ndarray, temperatures: Mapping[str, float]) -> None:
        if self._state is None:
            self._state, self._slow = gain_filter.begin(self.prior, time), base
        else:
            self._slow = gain_filter.lagged(self.prior, self._slow, base, time - self._state.time)
            self._state = gain_filter.wait(self.prior, self._state, time)
        self._base = base

    def at_poses(self) -> np.ndarray:
        if self._state is None:
            return self._base
        gain, slow, offset = np.einsum("ba,bam->ma", self._state.weight, self._state.mean)
        return np.asarray(self._base * gain + self._slow * slow + offset)

    def learn(
        self, time: float, position: np.ndarray, weights: np.ndarray, displacement: np.ndarray, sigma: float
    ) -> list[dict[str, Any]]:
        assert self._state is not None
        n = len(weights)
        parts = np.column_stack([weights @ self._base[:n], weights @ self._slow[:n]])
        self._state, told = gain_filter.assimilate(self.prior, self._state, parts, displacement, sigma)
        return [{"name": AXES[t.axis], "innovation_m": t.innovation, "sigma_m": t.sigma, "accepted": t.accepted}
                for t in told]  # fmt: skip

    def learnt(self) -> dict[str, Any]:
        """Gain, slow gain and offset [m] of each axis, the means over the bank of filters."""
        if self._state is None:
            return {}
        mean = np.einsum("ba,bam->am", self._state.weight, self._state.mean)
        return {axis: [float(v) for v in row] for axis, row in zip(AXES, mean, strict=True)}

    def stored(self) -> dict[str, Any]:
        state = None if self._state is None else self._state.to_json()
        return {"gain": state, "base": self._base.tolist(), "slow": self._slow.tolist()}

    def restore(self, told: dict[str, Any]) -> None:
        if "gain" not in told:
            raise TwinError("the state is of another way to learn", "--learn", "give the one before, or --fresh")
        self._state = None if told["gain"] is None else GainState.from_json(told["gain"])
        self._base, self._slow = np.array(told["base"]), np.array(told["slow"])
