"""How far calibration moves each parameter of a machine that has nothing but its tolerances: what is far beyond that.

Whether a loss 1.6 times as large is news follows from this machine's own synthetic measurements without a cause: each
parameter's moves there have their own spread, and the farthest of a kind its own distribution. Two calibrations tell:
the one that finds causes is sure of fast and local effects, the settled one of slow ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.diagnose.evidence.batch import Hypothesis
from twin.rom.parameter import Parameter

NAMED = ("source", "film", "joint", "contact", "expansion")  # kinds whose number may be named out of its tolerance
# prior standard deviations: no limit is lower; three times a spread of a quarter of a tolerance (before any result)
LEAST = 0.75
TAIL = 0.03  # of synthetic measurements that may have a parameter farther off: as of all other causes together


@dataclass(frozen=True)
class Spread:
    """How far one calibration moves n parameters."""

    limit: np.ndarray  # (n,) prior standard deviations, beyond which one is out; infinite for those that are not named

    @classmethod
    def of(cls, parameters: Sequence[Parameter], x: np.ndarray) -> Spread:
        """From parameters (nulls, n) of synthetic measurements.

        One limit per kind: model discrepancy biases joints and films by more than their tolerances, losses by less.
        """
        kinds = np.array([p.kind if p.scale == "log" else "" for p in parameters])
        named = [kind for kind in NAMED if (kinds == kind).any()]
        limit, sigma = np.full(len(kinds), np.inf), np.maximum(np.sqrt(np.mean(x**2, axis=0)), 1e-9)
        farthest = [np.abs(x / sigma)[:, kinds == kind].max(axis=1) for kind in named]
        for kind, most in zip(named, tails(np.array(farthest).T, TAIL) if named else (), strict=True):
            limit[kinds == kind] = np.maximum(most * sigma[kinds == kind], LEAST)
        return cls(limit)

    def strain(self, x: np.ndarray) -> np.ndarray:
        """(n,) 1 at the limit."""
        return np.asarray(np.abs(x) / self.limit)


@dataclass(frozen=True)
class Pulls:
    """By the calibration that finds causes, and by the settled one."""

    fitted: Spread
    settled: Spread

    @classmethod
    def of(cls, parameters: Sequence[Parameter], fitted: np.ndarray, settled: np.ndarray) -> Pulls:
        """From parameters (nulls, n) of synthetic measurements, by both calibrations."""
        return cls(Spread.of(parameters, fitted), Spread.of(parameters, settled))

    def strain(self, fitted: np.ndarray, settled: np.ndarray) -> np.ndarray:
        """(n,) 1 at the limit of how far parameters (n,) are moved, by either calibration."""
        return np.maximum(self.fitted.strain(fitted), self.settled.strain(settled))


@dataclass(frozen=True)
class Loose:
    """A parameter out of its tolerance, and its value without one."""

    index: int
    x: float  # prior standard deviations
    sigma: float  # prior standard deviations, of x
    strain: float  # times the limit
    rivals: tuple[tuple[Hypothesis, float], ...] = ()  # what does the same, with its cosine
    settled: bool = True  # x and sigma are those of the settled calibration


def tails(values: np.ndarray, share: float) -> np.ndarray:
    """(k,) limits to (n, k) values, of which `share` of the rows pass any: Gumbel tails at one probability for all."""
    at, scale = np.array([gumbel(own) for own in values.T]).T

    def limits(p: float) -> np.ndarray:
        return np.asarray(at - scale * np.log(-np.log1p(-p)))

    low, high = 1e-6, 0.3
    for _ in range(40):
        p = np.sqrt(low * high)
        passing = float(np.mean(np.any(values > limits(p), axis=1)))
        low, high = (p, high) if passing <= share else (low, p)
    return limits(low)


def gumbel(values: np.ndarray) -> tuple[float, float]:
    """Location and scale of a Gumbel law with the upper half's quantiles (50 % and 97 %) of the values (on such tails:
    Embrechts, Klueppelberg, Mikosch, Modelling Extremal Events, 1997, ch. 6)."""
    a, b = np.quantile(values, [0.5, 0.97])
    scale = max((b - a) / (-np.log(-np.log(0.97)) + np.log(-np.log(0.5))), 1e-3)
    return float(a + scale * np.log(-np.log(0.5))), float(scale)
