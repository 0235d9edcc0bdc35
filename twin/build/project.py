"""Projection of an affine body onto a subspace."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy.sparse

from twin.rom.model import AffineBody, Matrix


def project(body: AffineBody, V: np.ndarray, W: np.ndarray | None = None) -> AffineBody:
    """The body restricted to x = V z, tested with W (Galerkin W = V by default).

    V, W: (n, r) with W^T E V = 1 and the constant field in both spans. Then

    - a uniform temperature stays exact, and the heat balance of the projected body is the full body's:
      1 in span(W) makes the sum of the heat equation a row of the projected system;
    - Galerkin: every congruence V^T X V keeps X symmetric positive semidefinite, so the coupled reduced model is
      stable for all film coefficients >= 0, contact conductances >= 0 and axis positions. (Standard; e.g. Benner,
      Gugercin, Willcox, SIAM Review 57, 2015, section 4.) The oblique projection has no such guarantee.

    Raises nothing; the caller owns the quality of V and W.
    """
    left = V if W is None else W

    def congruent(X: Matrix) -> np.ndarray:
        if scipy.sparse.issparse(X):  # films and joints touch few nodes
            rows = np.flatnonzero(np.diff(X.tocsr().indptr))
            R = left[rows].T @ (X[rows] @ V)
        else:
            R = left.T @ (X @ V)
        return (R + R.T) / 2 if W is None else R

    one = left.T @ (body.E @ body.one)
    E_members, G_members, W_members = _members(body, left, V, congruent)
    return replace(
        body,
        first=(),
        E_members=E_members,
        G_members=G_members,
        W_members=W_members,
        E=congruent(body.E),
        A0=congruent(body.A0),
        A=tuple(congruent(a) for a in body.A),
        M=left.T @ body.M,
        B=left.T @ body.B,
        P=left.T @ body.P,
        P_out=None if W is None else V.T @ body.port_rows.T,
        B_out=None if W is None else V.T @ body.source_rows.T,
        H=None if body.H is None else left.T @ body.H,
        raised=None if body.raised is None else left.T @ body.raised,
        C=body.C @ V,
        G=rows_times(body.G, V),
        W=None if body.W is None else rows_times(body.W, V),
        one=one,
        energy=V.T @ body.energy,
        F=None if body.F is None else body.F @ V,
        V=None if body.V is None else body.V @ V,
    )


def rows_times(table: np.ndarray, V: Matrix) -> np.ndarray:
    """table @ V for a table (..., n) by one product: of one per pose each would read V (n, r) again."""
    flat = table.reshape(-1, table.shape[-1]) @ V
    return np.asarray(flat).reshape(*table.shape[:-1], V.shape[1])


def _members(
    body: AffineBody, left: np.ndarray, V: np.ndarray, congruent: Callable[[Matrix], np.ndarray]
) -> tuple[np.ndarray | None, np.ndarray | None, np.ndarray | None]:
    """Shares of the members in the projected E, G and W: slices of the full model, matrices of a reduced one."""
    if not body.members:
        return None, None, None
    if body.E_members is not None and body.G_members is not None:
        W_members = None if body.W_members is None else rows_times(body.W_members, V)
        return np.array([congruent(E) for E in body.E_members]), rows_times(body.G_members, V), W_members
    E, G, W = [], [], []
    for m in range(len(body.members)):
        own = body.member_states(m)
        E.append(left[own].T @ (body.E[own, own] @ V[own]))  # members share no states, E couples none of them
        G.append(rows_times(body.G[:, :, own], V[own]))
        if body.W is not None:
            W.append(rows_times(body.W[:, own], V[own]))
    return np.array(E), np.array(G), np.array(W) if W else None


def orthonormalise(X: np.ndarray, E: Matrix, V: np.ndarray | None = None, tolerance: float = 1e-12) -> np.ndarray:
    """An E-orthonormal basis of the part of span(X) that is E-orthogonal to V, small directions dropped.

    X: (n, m), columns scaled by the caller so that `tolerance` (relative to the largest column norm 1) is meaningful;
    E: (n, n) symmetric positive definite; V: (n, k) E-orthonormal or None. Returns (n, r), r <= m.

    Two passes: the first keeps directions above the tolerance, the second removes what rounding left of V.
    """
    keep = np.sqrt(np.einsum("ij,ij->j", X, E @ X)) > 0
    X = X[:, keep]
    for cut in (tolerance, 1e-3):
        if V is not None and V.shape[1]:
            X = X - V @ (V.T @ (E @ X))
        if X.shape[1] == 0:
            break
        gram = X.T @ (E @ X)
        eigenvalue, Q = np.linalg.eigh((gram + gram.T) / 2)
        # the Gram matrix resolves relative sizes down to 1e-8 only; `tolerance` below that is rounding
        use = eigenvalue > max(cut, 1e-8) ** 2 * (1.0 if cut == tolerance else eigenvalue[-1])
        X = X @ (Q[:, use][:, ::-1] / np.sqrt(eigenvalue[use][::-1]))
    return X
