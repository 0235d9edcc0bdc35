"""How far calibration moves each parameter of a machine that has nothing but its tolerances: what is far beyond that.

Whether a loss 1.6 times as large is news follows from this machine's own synthetic measurements without a cause: each
parameter's moves there have their own spread, and the farthest of all its own distribution. Two calibrations tell: the
one that finds causes is sure of fast and local effects, the settled one of slow ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.diagnose.evidence.batch import Hypothesis
from twin.rom.parameter import Parameter

NAMED = ("source", "film", "joint", "contact", "expansion")  # kinds whose number may be named out of its tolerance
# prior standard deviations: the least spread that is counted with, a quarter of a tolerance (chosen before any result)
LEAST = 0.25
TAIL = 0.03  # of synthetic measurements that may have a parameter farther off: as of all other causes together


@dataclass(frozen=True)
class Spread:
    """How far one calibration moves n parameters; infinite for those that are not named."""

    sigma: np.ndarray  # (n,) prior standard deviations: rms
    limit: float  # times that, beyond which a parameter is out of its tolerance

    @classmethod
    def of(cls, named: np.ndarray, x: np.ndarray) -> Spread:
        """From parameters (nulls, n) of synthetic measurements; named (n,) bool."""
        sigma = np.where(named, np.maximum(np.sqrt(np.mean(x**2, axis=0)), LEAST), np.inf)
        return cls(sigma, tail(np.abs(x / sigma).max(axis=1, initial=0.0), TAIL))

    def strain(self, x: np.ndarray) -> np.ndarray:
        """(n,) 1 at the limit."""
        return np.asarray(np.abs(x) / self.sigma / self.limit)


@dataclass(frozen=True)
class Pulls:
    """By the calibration that finds causes, and by the settled one."""

    fitted: Spread
    settled: Spread

    @classmethod
    def of(cls, parameters: tuple[Parameter, ...], fitted: np.ndarray, settled: np.ndarray) -> Pulls:
        """From parameters (nulls, n) of synthetic measurements, by both calibrations."""
        named = np.array([p.kind in NAMED and p.scale == "log" for p in parameters], dtype=bool)
        return cls(Spread.of(named, fitted), Spread.of(named, settled))

    def strain(self, fitted: np.ndarray, settled: np.ndarray) -> np.ndarray:
        """(n,) 1 at the limit of how far parameters (n,) are moved; 0 where the calibrations contradict each other."""
        farther = np.maximum(self.fitted.strain(fitted), self.settled.strain(settled))
        return np.where(np.sign(fitted) == np.sign(settled), farther, 0.0)


@dataclass(frozen=True)
class Loose:
    """A parameter out of its tolerance, and its value without one."""

    index: int
    x: float  # prior standard deviations
    sigma: float  # prior standard deviations, of x
    strain: float  # times the limit
    rivals: tuple[tuple[Hypothesis, float], ...] = ()  # what does the same, with its cosine
    settled: bool = True  # x and sigma are those of the settled calibration


def tail(values: np.ndarray, share: float) -> float:
    """What a share of values like these passes, by their Gumbel tail."""
    at, scale = gumbel(values)
    return float(at - scale * np.log(-np.log1p(-share)))


def gumbel(values: np.ndarray) -> tuple[float, float]:
    """Location and scale of a Gumbel law with the upper half's quantiles (50 % and 97 %) of the values (on such tails:
    Embrechts, Klueppelberg, Mikosch, Modelling Extremal Events, 1997, ch. 6)."""
    a, b = np.quantile(values, [0.5, 0.97])
    scale = max((b - a) / (-np.log(-np.log(0.97)) + np.log(-np.log(0.5))), 1e-3)
    return float(a + scale * np.log(-np.log(0.5))), float(scale)
