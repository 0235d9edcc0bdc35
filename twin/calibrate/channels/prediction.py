"""One channel from all others: a Gaussian process whose mean is theirs, and what a fault would do to it.

A machine that is warmer throughout is so in every channel, so a channel is compared with the median of the others.
Above that, it is a mix of how they differ from their median, of unknown weights, plus a constant, plus what no mix
gives: one constant per run and a slow, local part. All of these are Gaussian (a linear kernel, constants, an
exponential one), so that nothing is fitted but the size of the last two, by the likelihood: Rasmussen, Williams,
Gaussian Processes for Machine Learning, 2006, sections 2.7 (explicit columns: the faults), 4.2 and 5.4.1. One size is
shared by all channels (their median), so that a channel at fault cannot call its fault usual: each may depart from it,
at a price.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from twin.calibrate.channels.readings import Readings

# Of these four only the last decides much: chosen by the likelihood on every other day of a lathe, where factors of two
# cost less than 1 % of it
MIX = 0.9  # of the weights of all others together, root of the sum of their variances
CONSTANT = 0.5  # K: beyond the mix, of all runs alike
PER_RUN, LOCAL = 0.2, 0.1  # K, times a size that the data choose
LASTS = 7200.0  # s, of the local part
SIZES = 2.0 ** np.arange(-3.0, 5.0)
PRICE = float(np.log(2.5))  # of a channel's own size: standard deviation of its logarithm about the median


@dataclass(frozen=True)
class Scan:
    """k histories of a fault, at the size of the discrepancy that is most likely beside each."""

    statistic: np.ndarray  # (k,) twice the log-likelihood ratio against no fault
    amplitude: np.ndarray  # (k,) K
    sigma: np.ndarray  # (k,) K


def predictors(r: Readings, channel: int, without: tuple[int, ...] = ()) -> list[int]:
    """The other channels that are known in every row."""
    whole = np.isfinite(r.values).all(axis=0)
    return [c for c in range(len(r.names)) if whole[c] and c != channel and c not in without]


@dataclass(frozen=True)
class Prediction:
    """One channel, in the m rows in which it is known, in coordinates in which its covariance is diagonal at every
    size.

    With known = L Lᵀ and L⁻¹ slow L⁻ᵀ = Q diag(slow) Qᵀ, the covariance of Qᵀ L⁻¹ y is 1 + size² slow.
    """

    rows: np.ndarray  # (m,) of the readings
    above: np.ndarray  # (m,) K above the median of the others
    to: np.ndarray  # (m, m) 1/K: Qᵀ L⁻¹
    slow: np.ndarray  # (m,) variances of what no mix gives, at size 1, in units of the known part
    volume: float  # log det L
    weight: float  # variance of the weight of each other channel

    @classmethod
    def of(cls, r: Readings, channel: int, without: tuple[int, ...] = ()) -> Prediction:
        """A channel by all others but some; at least one must be left."""
        others = predictors(r, channel, without)
        rows = np.flatnonzero(np.isfinite(r.values[:, channel]))
        middle, mixed, left = _covariances(r, others, rows)
        L = np.linalg.cholesky(mixed + r.noise[channel] ** 2 * np.eye(len(rows)))
        inverse = solve_triangular(L, np.eye(len(rows)), lower=True)
        slow, Q = np.linalg.eigh(inverse @ left @ inverse.T)
        volume = float(np.log(np.diag(L)).sum())
        to, weight = Q.T @ inverse, MIX**2 / len(others)
        return cls(rows, r.values[rows, channel] - middle, to, np.maximum(slow, 0.0), volume, weight)

    def likelihoods(self) -> np.ndarray:
        """Logarithms, at every one of SIZES."""
        variance = self._variances()
        return np.asarray(-0.5 * ((self.to @ self.above) ** 2 / variance + np.log(variance)).sum(axis=1) - self.volume)

    def likelihood(self, usual: float) -> float:
        """At the best size, its price paid; usual: the size that channels have."""
        return float(np.max(self.likelihoods() + priced(usual)))

    def scan(self, columns: np.ndarray, usual: float) -> Scan:
        """Faults with histories (n, k) over all rows of the readings."""
        y, H, each = self.to @ self.above, self.to @ columns[self.rows], 1.0 / self._variances()
        information = np.maximum(each @ H**2, 1e-12)  # (sizes, k)
        score = each @ (H * y[:, None])
        without = self.likelihoods() + priced(usual)
        beside = without[:, None] + 0.5 * score**2 / information
        best, k = np.argmax(beside, axis=0), np.arange(H.shape[1])
        gain = np.max(beside, axis=0) - without.max()
        return Scan(2.0 * gain, (score / information)[best, k], information[best, k] ** -0.5)

    def precision(self, size: float) -> np.ndarray:
        """(m, m) 1/K², of its rows at one size."""
        return np.asarray(self.to.T @ (self.to / (1.0 + size**2 * self.slow)[:, None]))

    def _variances(self) -> np.ndarray:
        return np.asarray(1.0 + SIZES[:, None] ** 2 * self.slow)


def _covariances(r: Readings, others: Sequence[int], rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The median of other channels (m,) [degC], and covariances (m, m) [K²] of what a channel shows above it: of the
    mix with its constant, and of what no mix gives, at size 1."""
    theirs = r.values[rows][:, others]
    middle = np.median(theirs, axis=1)
    X = theirs - middle[:, None]
    run, time = r.run[rows], r.time[rows]
    same = (run[:, None] == run[None, :]).astype(float)
    local = same * np.exp(-np.abs(time[:, None] - time[None, :]) / LASTS)
    return middle, MIX**2 / len(others) * X @ X.T + CONSTANT**2, PER_RUN**2 * same + LOCAL**2 * local


def expected(r: Readings, channel: int) -> tuple[np.ndarray, np.ndarray]:
    """What a channel most likely is in every row (n,) [degC], by what is known of it and all others, and the standard
    deviation of that (n,) [K]: eqs (2.23) and (2.24) there.

    At least one other must be known in every row.
    """
    middle, mixed, left = _covariances(r, predictors(r, channel), np.arange(len(r.run)))
    known = np.flatnonzero(np.isfinite(r.values[:, channel]))
    size = SIZES[int(np.argmax(Prediction.of(r, channel).likelihoods()))]
    K = mixed + size**2 * left
    seen = K[np.ix_(known, known)] + r.noise[channel] ** 2 * np.eye(len(known))
    by = np.linalg.solve(seen, K[known])  # (k, n)
    mean = middle + by.T @ (r.values[known, channel] - middle[known])
    return mean, np.sqrt(np.maximum(np.diag(K) - np.sum(by * K[known], axis=0), 0.0))


def priced(usual: float) -> np.ndarray:
    """The logarithm of the prior at every one of SIZES."""
    return np.asarray(-0.5 * (np.log(SIZES / usual) / PRICE) ** 2)


def usual_size(predictions: Iterable[Prediction]) -> float:
    """The median of the sizes that channels would have for themselves."""
    return float(np.median([SIZES[int(np.argmax(p.likelihoods()))] for p in predictions]))
