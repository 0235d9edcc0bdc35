"""How far calibration moves each parameter of a machine that has nothing but its tolerances: what is far beyond that.

Whether a loss 1.6 times as large is news follows from this machine's own synthetic measurements without a cause. Of a
number that they have at t, -1 <= t <= 1 in tolerances, a calibration makes

    x = b t + s z,    t ~ U(-1, 1),    z ~ N(0, 1),

with b near 1 where data tell it and near 0 where they do not. How rare an x is, as the normal deviate that is as rare,
is alike for all numbers then, but for what model discrepancy does to each kind: the farthest of a kind has its own
distribution. Two calibrations tell: the one that finds causes is sure of fast and local effects, the settled one of
slow ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from twin.diagnose.evidence.batch import Hypothesis
from twin.rom.parameter import Parameter

# kinds whose number may be named out of its tolerance
NAMED = ("source", "film", "joint", "contact", "capacity", "expansion", "environment")
# prior standard deviations: no limit is lower; three times a spread of a quarter of a tolerance (before any result)
LEAST = 0.75
TAIL = 0.03  # of synthetic measurements that may have a parameter farther off: as of all other causes together


@dataclass(frozen=True)
class Spread:
    """How far one calibration moves n parameters."""

    limit: np.ndarray  # (n,) prior standard deviations, beyond which one is out; infinite for those that are not named

    @classmethod
    def of(cls, parameters: Sequence[Parameter], drawn: np.ndarray, x: np.ndarray) -> Spread:
        """From parameters of synthetic measurements, drawn (nulls, n), and as calibrated, x (nulls, n).

        One limit per kind: model discrepancy biases joints and films by more than their tolerances, losses by less.
        """
        b = np.clip((drawn * x).sum(axis=0) / np.maximum((drawn**2).sum(axis=0), 1e-9), 0.0, 1.0)
        s = np.maximum(np.sqrt(np.mean((x - b * drawn) ** 2, axis=0)), 1e-9)
        kinds = np.array([p.kind for p in parameters])
        named = [kind for kind in NAMED if (kinds == kind).any()]
        limit, deviates = np.full(len(kinds), np.inf), deviate(np.abs(x), b, s)
        farthest = [deviates[:, kinds == kind].max(axis=1) for kind in named]
        for kind, most in zip(named, tails(np.array(farthest).T, TAIL) if named else (), strict=True):
            limit[kinds == kind] = np.maximum(as_rare(float(most), b, s)[kinds == kind], LEAST)
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
    def of(cls, parameters: Sequence[Parameter], drawn: np.ndarray, fitted: np.ndarray, settled: np.ndarray) -> Pulls:
        """From parameters (nulls, n) of synthetic measurements, as drawn and by both calibrations."""
        return cls(Spread.of(parameters, drawn, fitted), Spread.of(parameters, drawn, settled))

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
    told: float = 0.0  # likelihood-ratio units by which it explains more without its tolerance
    follows: bool = False  # within its limit once the farthest one has no tolerance


def deviate(x: np.ndarray, b: np.ndarray, s: np.ndarray) -> np.ndarray:
    """The normal deviate that |b t + s z| reaches as rarely as x >= 0 (..., n); b, s (n,).

    P(b t + s z > x) = s / (2 b) (K((x - b) / s) - K((x + b) / s)),    K(u) = phi(u) - u (1 - Phi(u))
    """
    b = np.maximum(b, 1e-3 * s)
    low, high = ((x + sign * b) / s for sign in (-1.0, 1.0))
    beyond = s / (2.0 * b) * ((norm.pdf(low) - low * norm.sf(low)) - (norm.pdf(high) - high * norm.sf(high)))
    return np.asarray(norm.isf(np.clip(beyond, 1e-300, 0.5)))


def as_rare(most: float, b: np.ndarray, s: np.ndarray) -> np.ndarray:
    """(n,) the inverse: x of that deviate, by bisection."""
    low, high = np.zeros(len(b)), b + most * s
    for _ in range(50):
        middle = (low + high) / 2.0
        nearer = deviate(middle, b, s) < most
        low, high = np.where(nearer, middle, low), np.where(nearer, high, middle)
    return high


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
