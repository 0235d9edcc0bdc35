"""Normal equations of "model plus members" on stretches of runs: what predicts a stretch that it was not fitted to.

Measured minus computed displacements y (k, m axes) are explained by parameters of the model, through its derivatives
J (k, m, n) and with the priors of their tolerances, and by members: responses F (k, c) [K], one expansion per axis with
prior N(0, tau^2) [m/K] each:

    minimise  sum_rows ((y - J x - F a) / sigma)^2 + |x - x_0|^2 + |a / tau|^2,   x in prior standard deviations.

All stretches are summed up once; leaving one out is a subtraction, so that hundreds of candidates cost little.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Stretch:
    """Rows that are left out together; k rows, m axes, n parameters, c candidates."""

    y: np.ndarray  # (k, m) m, measured minus computed
    sigma: np.ndarray  # (k,) m
    J: np.ndarray  # (k, m, n) m per prior standard deviation
    F: np.ndarray  # (k, c) K


@dataclass(frozen=True)
class Sums:
    """Products of a stretch, weighted by 1 / sigma^2."""

    rows: float  # sum of weights [1/m^2]
    yy: np.ndarray  # (m,)
    JJ: np.ndarray  # (m, n, n)
    Jy: np.ndarray  # (m, n)
    FF: np.ndarray  # (c, c), the same for every axis
    FJ: np.ndarray  # (m, c, n)
    Fy: np.ndarray  # (m, c)

    @classmethod
    def of(cls, s: Stretch) -> Sums:
        w = 1.0 / s.sigma**2
        WJ = w[:, None, None] * s.J
        WF = w[:, None] * s.F
        return cls(
            float(w.sum()), np.einsum("k,km->m", w, s.y**2), np.einsum("kma,kmb->mab", WJ, s.J),
            np.einsum("kma,km->ma", WJ, s.y), WF.T @ s.F, np.einsum("kc,kma->mca", WF, s.J), (WF.T @ s.y).T,
        )  # fmt: skip

    def __add__(self, other: Sums) -> Sums:
        return Sums(*(a + b for a, b in zip(self._all, other._all, strict=True)))

    def __sub__(self, other: Sums) -> Sums:
        return Sums(*(a - b for a, b in zip(self._all, other._all, strict=True)))

    @property
    def _all(self) -> tuple:
        return self.rows, self.yy, self.JJ, self.Jy, self.FF, self.FJ, self.Fy


@dataclass(frozen=True)
class Solved:
    """What the rows say."""

    x: np.ndarray  # (n,) prior standard deviations, from where the model was linearised
    a: np.ndarray  # (m, s) m/K of the chosen members
    chosen: tuple[int, ...]
    covariance: np.ndarray  # (n + m s, n + m s)

    def left(self, rows: Sums) -> np.ndarray:
        """(m,) m^2: weighted mean square of what is left of rows, seen or not, per axis."""
        s = list(self.chosen)
        square = rows.yy - 2.0 * (rows.Jy @ self.x) - 2.0 * np.einsum("ms,ms->m", rows.Fy[:, s], self.a)
        square = square + np.einsum("a,mab,b->m", self.x, rows.JJ, self.x)
        square = square + np.einsum("ms,st,mt->m", self.a, rows.FF[np.ix_(s, s)], self.a)
        square = square + 2.0 * np.einsum("ms,msa,a->m", self.a, rows.FJ[:, s], self.x)
        return np.maximum(square, 0.0) / rows.rows


def solve(rows: Sums, chosen: Sequence[int], tau: np.ndarray, before: np.ndarray) -> Solved:
    """The minimum. tau (c,) [m/K] of every candidate; before (n,): where the model was linearised, in prior standard
    deviations from its nominal values, towards which the prior pulls."""
    s = list(chosen)
    m, n = rows.Jy.shape
    size = n + m * len(s)
    A, b = np.zeros((size, size)), np.zeros(size)
    A[:n, :n] = rows.JJ.sum(axis=0) + np.eye(n)
    b[:n] = rows.Jy.sum(axis=0) - before
    prior = np.diag(1.0 / tau[s] ** 2)
    for axis in range(m):
        own = slice(n + axis * len(s), n + (axis + 1) * len(s))
        A[own, own] = rows.FF[np.ix_(s, s)] + prior
        A[own, :n] = rows.FJ[axis, s]
        A[:n, own] = A[own, :n].T
        b[own] = rows.Fy[axis, s]
    scale = 1.0 / np.sqrt(np.diag(A))  # expansions are of 1e-6
    inverse = np.linalg.inv(A * np.outer(scale, scale)) * np.outer(scale, scale)
    found = inverse @ b
    return Solved(found[:n], found[n:].reshape(m, len(s)), tuple(s), inverse)


def held_out(stretches: Sequence[Sums], chosen: Sequence[int], tau: np.ndarray, before: np.ndarray) -> np.ndarray:
    """(f, m) m^2: mean square of each stretch, predicted by a fit to the others."""
    total = stretches[0]
    for more in stretches[1:]:
        total = total + more
    return np.array([solve(total - out, chosen, tau, before).left(out) for out in stretches])
