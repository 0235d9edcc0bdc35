"""What it costs that an orthogonal projection has one space for the responses to inputs and the adjoints of outputs.

S = s E + A(theta) at real s >= 0; X = S^-1 B and Y = S^-1 C^T are what a projection has to represent. Of a Galerkin
projection on V the residuals R = X - V X_r and Q = Y - V Y_r are orthogonal to V in S, and its error at s is Q^T S R:

    |Q^T S R| <= |Q|_S |R|_S,    |.|_S >= |.|_S0,  S0 = A(theta_low) <= S

Let a, b be the root mean squares over samples of s and theta of |R|_S and |Q|_S (Frobenius over columns), and t(k)
what the best space of r states leaves of the samples of [X, k Y] in S0 (Eckart, Young 1936). Then
a^2 + k^2 b^2 >= t(k)^2 for every k, and with k = a/b

    a b >= min over k of t(k)^2 / (2 k)                                                      `one_space`

whatever V is. A projection with a space for each, V for the responses and W for the adjoints, has no such bound: the
best of each leave t_X t_Y (`two_spaces`). These are bounds of the product of residuals, not of the error: that is
smaller where the residuals of inputs and outputs happen to be orthogonal to each other.
"""

from __future__ import annotations

import numpy as np

from twin.build.body_matrix import system_matrix
from twin.rom.model import AffineBody

SHIFTS = np.r_[0.0, np.logspace(-6, 2, 25)]  # 1/s, over the frequencies that errors are measured at
WEIGHTS = np.logspace(-4, 4, 65)  # k, about that at which X and k Y are of equal size


def _left(values: np.ndarray, states: int) -> float:
    """What the best space leaves that has `states` directions, the uniform field among them."""
    return float(np.sqrt((values[states - 1 :] ** 2).sum()))


def products(
    body: AffineBody, films: list[np.ndarray], low: np.ndarray, states: tuple[int, ...]
) -> dict[int, tuple[float, float]]:
    """(one_space, two_spaces) by states, in the unit of the transfer function (n_out per n_films).

    body: dense, symmetric, E = 1; films: thetas (n_theta,) of the samples, low: their lower bounds.
    """
    X, Y = [], []
    for theta in films:
        rate, U = np.linalg.eigh(system_matrix(body, theta, 0.0))
        B, C = U.T @ (body.M * theta[list(body.theta)]), U.T @ body.C.T
        for s in SHIFTS:
            X.append(U @ (B / (rate + s)[:, None]))
            Y.append(U @ (C / (rate + s)[:, None]))
    L = np.linalg.cholesky(system_matrix(body, low, 0.0))  # |z|_S0 = |L^T z|
    one = L.T @ body.one / np.linalg.norm(L.T @ body.one)
    R, Q = (_triangle(L.T @ np.column_stack(Z) / np.sqrt(len(Z)), one) for Z in (X, Y))
    of_R, of_Q = (np.linalg.svd(Z, compute_uv=False) for Z in (R, Q))
    equal = np.linalg.norm(R) / np.linalg.norm(Q)
    together = {k: np.linalg.svd(np.hstack([R, k * Q]), compute_uv=False) for k in equal * WEIGHTS}
    return {
        r: (min(_left(v, r) ** 2 / (2.0 * k) for k, v in together.items()), _left(of_R, r) * _left(of_Q, r))
        for r in states
    }


def _triangle(Z: np.ndarray, one: np.ndarray) -> np.ndarray:
    """(n, n) with the Gram matrix Z Z^T of Z (n, m) less its part along `one`."""
    Z = Z - np.outer(one, one @ Z)
    return np.asarray(np.linalg.qr(Z.T, mode="r").T)
