"""The matrix of one body in a time step, sparse (full model) or dense (reduced)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import scipy.linalg

from twin.build.factorize import factorize
from twin.rom.model import AffineBody, Matrix


def system_matrix(body: AffineBody, theta: np.ndarray, rate: float) -> Matrix:
    """rate E + A0 + sum_k theta_k A_k with rate = 1/h [1/s] (0: steady state)."""
    S = body.A0 + rate * body.E
    for k, a in zip(body.theta, body.A, strict=True):
        S = S + theta[k] * a
    return S


class DenseTerms:
    """The matrices of a dense body laid out so that one pass over memory adds up its terms."""

    def __init__(self, body: AffineBody, n_films: int):
        self._body, self.n_films = body, sum(k < n_films for k in body.theta)
        if any(k >= n_films for k in body.theta[: self.n_films]):
            raise ValueError("films come before joints")
        self._terms = np.ascontiguousarray(body.A, dtype=float).reshape(len(body.A), body.n**2)
        self.unit = np.array_equal(body.E, np.eye(body.n))
        self._joints: tuple[np.ndarray, np.ndarray] | None = None  # conductances and A0 with them

    def system(self, own: np.ndarray, rate: float) -> np.ndarray:
        """rate E + A0 + sum_k own_k A_k (n, n); own (len(body.theta),)."""
        n, first = self._body.n, self.n_films
        if self._joints is None or not np.array_equal(self._joints[0], own[first:]):
            self._joints = (own[first:], self._body.A0 + (own[first:] @ self._terms[first:]).reshape(n, n))
        S = self.film_terms(own[:first])
        S += self._joints[1]
        if self.unit:
            S.flat[:: n + 1] += rate
        else:
            S += rate * self._body.E
        return S

    def film_terms(self, coefficients: np.ndarray) -> np.ndarray:
        """sum_k coefficients_k A_k (n, n) over the films."""
        return (coefficients @ self._terms[: self.n_films]).reshape(self._body.n, self._body.n)


class _Symmetric:
    """x = S^-1 right by a Cholesky factor (lower) and, once it has been used as often as that pays, by the inverse.

    A product with the inverse reads the matrix once, in order, and takes a fifth of the time of two triangular solves;
    making it costs what n/4 of them do (measured for n = 60 to 500). S is well conditioned where it is used so often:
    in time steps, with E = 1. LAPACK is called itself: what
    scipy.linalg.cho_solve checks takes as long as a small solve.
    """

    def __init__(self, factor: np.ndarray) -> None:
        self._factor, self._solves = factor, 0
        self._inverse: np.ndarray | None = None

    def __call__(self, right: np.ndarray) -> np.ndarray:
        if right.ndim == 1 and self._inverse is None:
            self._solves += 1
            if self._solves > len(self._factor) / 4:
                self._inverse = self._inverted()
        if right.ndim == 1 and self._inverse is not None:
            return np.asarray(self._inverse @ right)
        return np.asarray(scipy.linalg.lapack.dpotrs(self._factor, right, lower=1)[0])

    def _inverted(self) -> np.ndarray:
        lower = np.tril(scipy.linalg.lapack.dpotri(self._factor, lower=1)[0])
        return lower + np.tril(lower, -1).T


def solver_of(
    body: AffineBody, terms: DenseTerms | None, theta: np.ndarray, rate: float
) -> Callable[[np.ndarray], np.ndarray]:
    """The solution of the body's system (n,) or (n, k) by a factor made here; terms: of dense bodies."""
    if terms is None:
        return factorize(system_matrix(body, theta, rate).tocsr(), rhs_hint=1000).solve
    S = terms.system(theta[list(body.theta)], rate)
    if body.symmetric:  # its own transpose, in the order that LAPACK overwrites
        factor, _ = scipy.linalg.cho_factor(S.T, lower=True, overwrite_a=True, check_finite=False)
        return _Symmetric(factor)
    return partial(scipy.linalg.lu_solve, scipy.linalg.lu_factor(S, check_finite=False), check_finite=False)
