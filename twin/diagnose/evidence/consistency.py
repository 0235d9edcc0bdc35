"""Whether a cause has the same size in every run: a property of the machine has one, an imitation takes what fits.

Each run alone gives a size a_k with standard deviation s_k, the parameters free within their tolerances. Around their
weighted mean

    Q = sum_k (a_k - mean)^2 / (s_k^2 + (own mean)^2)

is chi-square of as many degrees of freedom as runs tell a size, less one (Cochran, Biometrics 10, 1954; own: the share
by which the form of the model may bend a size in one run and not in another).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.stats

from twin.diagnose.evidence.whiten import Projector

CHANCE = 1e-3  # probability that a true cause is refused in a diagnosis: with three causes still below a per cent
TOLD = 3.0  # times the standard deviation over all runs: a run that tells a size worse than that tells nothing


@dataclass(frozen=True)
class Size:
    """The first amplitude of a cause in one run alone, and its standard deviation; infinite where it does not act."""

    amplitude: float
    sigma: float


def sizes(
    N: np.ndarray, D: np.ndarray, white: np.ndarray, rows: Sequence[slice], firsts: Sequence[int]
) -> tuple[tuple[Size, ...], ...]:
    """Per cause its size in every run.

    N: (m, q) nuisance columns of unit prior variance. D: (m, k) columns of all amplitudes. white: (m,) what both
    explain. rows: of the runs. firsts: the causes' first amplitudes among the columns.
    """
    made = []
    for own in rows:
        d, Pd = D[own], Projector.of(N[own])(D[own])
        F, g = d.T @ Pd, Pd.T @ white[own]
        acts = np.diag(F) > 0.0
        found, variance = np.zeros(len(F)), np.full(len(F), np.inf)
        inverse = np.linalg.pinv(F[np.ix_(acts, acts)], rcond=1e-10, hermitian=True)
        found[acts], variance[acts] = inverse @ g[acts], np.diag(inverse)
        made.append([Size(float(found[i]), float(np.sqrt(max(variance[i], 0.0)))) for i in firsts])
    return tuple(tuple(of_cause) for of_cause in zip(*made, strict=True))


def differs(found: Sequence[Size], own: float, least: float = 0.0) -> bool:
    """Whether sizes of one cause are not the same beyond CHANCE; least: of Q, what is no evidence in a poor model."""
    told = [s for s in found if np.isfinite(s.sigma) and s.sigma > 0.0]
    if len(told) < 2:
        return False
    a, variance = np.array([s.amplitude for s in told]), np.array([s.sigma**2 for s in told])
    kept = variance < TOLD**2 * len(told) / (1.0 / variance).sum()
    if kept.sum() < 2:
        return False
    a, variance = a[kept], variance[kept]
    variance = variance + (own * _mean(a, variance)) ** 2
    Q = float(((a - _mean(a, variance)) ** 2 / variance).sum())
    return bool(scipy.stats.chi2.sf(Q, len(a) - 1) < CHANCE and least < Q)


def _mean(a: np.ndarray, variance: np.ndarray) -> float:
    """Weighted by inverse variances."""
    return float((a / variance).sum() / (1.0 / variance).sum())
