"""How well members explain displacements, and how probable that is: a linear Gaussian model and its evidence.

Measured minus computed displacements y (k, m axes) are explained by expansions of the model, through its derivatives
J (k, m, n) and with the priors of their tolerances, and by members: responses F (k, c) [K], an expansion per member and
axis with prior N(0, s^2) [m/K] each:

    y_a = J_a x + F a_a + e,   x ~ N(0, 1),   a ~ N(0, s^2),   e ~ N(0, sigma_a^2).

s and the sigma_a are those with the largest evidence p(y | s, sigma), the integral over x and a (MacKay, Bayesian
interpolation, Neural Computation 4, 1992): it weighs fit against freedom without leaving anything out. Rows of one hour
are taken for one witness: what such a model leaves is alike for so long.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, solve_triangular

EVERY = 600.0  # s between the rows that are used
MEMORY = 5400.0  # s for which what is left of a displacement is alike: a row counts as EVERY / MEMORY of a witness
NOISE_ROUNDS = 8  # of the fixed point for sigma; the fourth digit of a micrometre stands after four
LEAST_NOISE = 0.1e-6  # m, of a measured displacement


@dataclass(frozen=True)
class Sums:
    """Products of rows, each row counting `EVERY / MEMORY`; axis first, NaN rows of an axis left out."""

    rows: np.ndarray  # (m,) witnesses
    yy: np.ndarray  # (m,) m^2
    JJ: np.ndarray  # (m, n, n)
    Jy: np.ndarray  # (m, n)
    FF: np.ndarray  # (m, c, c) K^2
    FJ: np.ndarray  # (m, c, n)
    Fy: np.ndarray  # (m, c)

    @classmethod
    def of(cls, y: np.ndarray, J: np.ndarray, F: np.ndarray) -> Sums:
        """y (k, m) m, J (k, m, n) m, F (k, c) K of rows that are EVERY apart."""
        w = (EVERY / MEMORY) * np.isfinite(y).astype(float)
        y = np.where(w > 0.0, y, 0.0)
        return cls(
            w.sum(axis=0), np.einsum("km,km->m", w, y**2), np.einsum("km,kma,kmb->mab", w, J, J),
            np.einsum("km,kma,km->ma", w, J, y), np.einsum("km,kc,kd->mcd", w, F, F),
            np.einsum("km,kc,kma->mca", w, F, J), np.einsum("km,kc,km->mc", w, F, y),
        )  # fmt: skip

    @property
    def _all(self) -> tuple[np.ndarray, ...]:
        return self.rows, self.yy, self.JJ, self.Jy, self.FF, self.FJ, self.Fy

    def __add__(self, other: Sums) -> Sums:
        return Sums(*(a + b for a, b in zip(self._all, other._all, strict=True)))

    def __sub__(self, other: Sums) -> Sums:
        return Sums(*(a - b for a, b in zip(self._all, other._all, strict=True)))


@dataclass(frozen=True)
class Explained:
    """The most probable x and a, and how probable the data are at this scale and noise."""

    chosen: tuple[int, ...]  # s members of all candidates
    scale: float  # m/K
    noise: np.ndarray  # (m,) m
    x: np.ndarray  # (n,) prior standard deviations
    a: np.ndarray  # (m, s) m/K
    log_evidence: float  # ln p(y | scale, noise), a constant left out

    def left(self, rows: Sums) -> np.ndarray:
        """(m,) m: rms of what is left of rows, seen or not."""
        s = list(self.chosen)
        square = rows.yy - 2.0 * (rows.Jy @ self.x) - 2.0 * np.einsum("ms,ms->m", rows.Fy[:, s], self.a)
        square = square + np.einsum("a,mab,b->m", self.x, rows.JJ, self.x)
        square = square + np.einsum("ms,mst,mt->m", self.a, rows.FF[:, s][:, :, s], self.a)
        square = square + 2.0 * np.einsum("ms,msa,a->m", self.a, rows.FJ[:, s], self.x)
        return np.sqrt(np.maximum(square, 0.0) / np.maximum(rows.rows, 1e-30))


def explain(rows: Sums, chosen: Sequence[int], scale: float, noise: np.ndarray) -> Explained:
    """At a given scale [m/K] and noise (m,) [m]."""
    s = list(chosen)
    m, n = rows.Jy.shape
    size = n + m * len(s)
    A, b = np.eye(size), np.zeros(size)
    for axis in range(m):
        own, at = slice(n + axis * len(s), n + (axis + 1) * len(s)), noise[axis] ** -2
        A[:n, :n] += at * rows.JJ[axis]
        b[:n] += at * rows.Jy[axis]
        A[own, own] += (at * scale**2) * rows.FF[axis][np.ix_(s, s)]
        A[own, :n] = (at * scale) * rows.FJ[axis, s]
        A[:n, own] = A[own, :n].T
        b[own] = (at * scale) * rows.Fy[axis, s]
    L = np.linalg.cholesky(A)
    z = solve_triangular(L, b, lower=True)
    found = solve_triangular(L, z, lower=True, trans=1)
    misfit = float((rows.yy / noise**2).sum() - z @ z)
    log = -0.5 * misfit - float(np.log(np.diag(L)).sum()) - float((rows.rows * np.log(noise)).sum())
    return Explained(tuple(s), scale, noise, found[:n], scale * found[n:].reshape(m, len(s)), log)


def with_noise(rows: Sums, chosen: Sequence[int], scale: float, noise: np.ndarray | None = None) -> Explained:
    """At the noise of the largest evidence for this scale, by MacKay's fixed point sigma_a^2 = rss_a / (n_a - gamma_a),
    gamma_a: well determined numbers, shared among the axes by their rows. noise (m,) [m]: a first guess."""
    m = len(rows.rows)
    noise = np.sqrt(rows.yy / np.maximum(rows.rows, 1.0)) / 3.0 if noise is None else noise
    noise = np.maximum(noise, LEAST_NOISE)
    for _ in range(NOISE_ROUNDS):
        found = explain(rows, chosen, scale, noise)
        free = np.array(
            [max(rows.rows[a] - _determined(rows, chosen, scale, noise, a), 0.1 * rows.rows[a]) for a in range(m)]
        )
        noise = np.maximum(np.sqrt(found.left(rows) ** 2 * rows.rows / np.maximum(free, 1e-30)), LEAST_NOISE)
    return explain(rows, chosen, scale, noise)


def _determined(rows: Sums, chosen: Sequence[int], scale: float, noise: np.ndarray, axis: int) -> float:
    """How many expansions of an axis its rows determine: trace of A^-1 times what the data add to it."""
    s = list(chosen)
    if not s:
        return 0.0
    data = (scale / noise[axis]) ** 2 * rows.FF[axis][np.ix_(s, s)]
    factor = np.linalg.cholesky(data + np.eye(len(s)))
    return float(np.trace(cho_solve((factor, True), data)))


def total(stretches: Sequence[Sums]) -> Sums:
    """All rows together."""
    result = stretches[0]
    for more in stretches[1:]:
        result = result + more
    return result


def held_out(stretches: Sequence[Sums], chosen: Sequence[int], scale: float, noise: np.ndarray) -> np.ndarray:
    """(m,) m: rms over all stretches, each predicted by a fit to the others."""
    every = total(stretches)
    square = np.zeros_like(noise)
    for out in stretches:
        square += explain(every - out, chosen, scale, noise).left(out) ** 2 * out.rows
    return np.sqrt(square / every.rows)
