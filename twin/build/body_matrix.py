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


def solver_of(
    body: AffineBody, terms: DenseTerms | None, theta: np.ndarray, rate: float
) -> Callable[[np.ndarray], np.ndarray]:
    """The solution of the body's system (n,) or (n, k) by a factor made here; terms: of dense bodies."""
    if terms is None:
        return factorize(system_matrix(body, theta, rate).tocsr(), rhs_hint=1000).solve
    S = terms.system(theta[list(body.theta)], rate)
    if body.symmetric:  # its own transpose, in the order that LAPACK overwrites
        factor = scipy.linalg.cho_factor(S.T, lower=True, overwrite_a=True, check_finite=False)
        return partial(scipy.linalg.cho_solve, factor, check_finite=False)
    return partial(scipy.linalg.lu_solve, scipy.linalg.lu_factor(S, check_finite=False), check_finite=False)
