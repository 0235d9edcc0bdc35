"""Calibration without and with causes: what every synthetic and every measured set of data goes through alike."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from twin.diagnose.evidence.whiten import Projector, Whitener
from twin.diagnose.model.study import Study
from twin.diagnose.model.surrogate import Surrogate

PASSES, INNER = 2, 4
CLOSE = 0.03  # prior standard deviations


@dataclass(frozen=True)
class Fitted:
    """Parameters, the residual linearised there, and the projector that belongs to it."""

    x: np.ndarray  # (n,) in prior standard deviations
    J: np.ndarray  # (m, n) there
    residual: np.ndarray  # (m,) y - f(x) + J x; NaN where nothing was measured
    projector: Projector
    beside: np.ndarray | float = 0.0  # (m,) what accepted causes add to the outputs
    more: np.ndarray | None = None  # (m, k) their white columns in the projector
    reachable: float = np.inf  # misfit that a fit can leave by what is linear at the description


@dataclass(frozen=True)
class Fitter:
    """What a calibration needs."""

    study: Study
    surrogate: Surrogate
    whiten: Whitener
    others: np.ndarray  # (m, q) white nuisance columns besides the parameters: offsets, modes of model discrepancy

    @cached_property
    def gram(self) -> np.ndarray:
        """(q, q) of the other columns: the same for all data."""
        return np.asarray(self.others.T @ self.others)

    def projector(self, J: np.ndarray, more: np.ndarray | None = None) -> Projector:
        """For parameters with Jacobian J; more: white columns without prior (large variance), (m, k)."""
        own = self.whiten(J) if more is None else np.hstack([self.whiten(J), more])
        cross = own.T @ self.others
        return Projector.of(own, self.others, gram=np.block([[own.T @ own, cross], [cross.T, self.gram]]))

    def without_parameters(self, more: np.ndarray | None = None) -> Projector:
        """For the other nuisance columns alone, beside parameters that are known."""
        return self.projector(np.zeros((len(self.others), 0)), more)

    @cached_property
    def _described(self) -> tuple[np.ndarray, np.ndarray, Projector]:
        f, J = self.surrogate.at(np.zeros(len(self.surrogate.scale)))
        for shared in (f, J):
            shared.flags.writeable = False
        return f, J, self.projector(J)

    def linear(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, Projector]:
        """Outputs (m,) of the surrogate at parameters x (n,), their Jacobian (m, n) and its projector; at the
        description, where every fit begins, made once."""
        if not np.any(x):
            return self._described
        f, J = self.surrogate.at(x)
        return f, J, self.projector(J)

    def at_description(self, y: np.ndarray) -> Fitted:
        """Measurements y (m,) beside the parameters as described, before any fit."""
        f, J, projector = self._described
        return Fitted(np.zeros(len(self.surrogate.scale)), J, y - f, projector)

    def __call__(self, y: np.ndarray) -> Fitted:
        """Most likely parameters of measurements y (m,), NaN where missing."""
        low, high = bounds(self.study)
        n = len(low)
        x, offset, reachable = np.zeros(n), np.zeros(len(y)), np.inf
        for _ in range(PASSES):
            before = x
            for _ in range(INNER):
                f, J, projector = self.linear(x)
                white = self.whiten(y - offset - f + J @ x)
                found = np.clip(projector.most_likely(white)[:n], low, high)
                reachable = float(white @ projector(white)) if np.isinf(reachable) else reachable
                moved, x = float(np.abs(found - x).max(initial=0.0)), found
                if moved < CLOSE:
                    break
            exact = self.study.all_outputs(x)
            f, J, projector = self.linear(x)
            offset = exact - f
            if np.abs(x - before).max(initial=0.0) < 5 * CLOSE:
                break
        return Fitted(x, J, y - exact + J @ x, projector, reachable=reachable)


def bounds(study: Study) -> tuple[np.ndarray, np.ndarray]:
    """Low and high (n,) of the parameters in prior standard deviations."""
    ends = [(p.coordinate(p.low), p.coordinate(p.high)) for p in study.probed.parameters]
    low, high = np.array(ends).reshape(-1, 2).T
    return low, high
