"""Coordinates in which contacts touch as few states as they have ports, and the factors of fine steps in them.

With z = T y, T^T P = [R; 0], a matrix of a fine step becomes

    T^T (c + P Gamma P^T) T = [c_pp + R Gamma R^T   c_pf]
                              [c_fp                 c_ff]

where only the first block follows the contacts. So c_ff and the Schur complement c_pp - c_pf c_ff^-1 c_fp are factored
once for all fine steps of a coarse one, and every fine step factors a matrix of the size of the ports
(Golub, Van Loan, Matrix Computations, 4th ed. 2013, chapters 3 to 5).

The first states are the temperatures of the ports, so that R = 1 and Gamma is added as it is: two products of matrices
less in every fine step. Ports that move together, or nearly so, have no such coordinates; they keep an R.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
from jax import lax
from jax.scipy.linalg import cho_solve, solve_triangular

from twin.run.system import Array, System

TOGETHER = 1e-6  # of the largest singular value of P: ports that differ by less move together


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Basis:
    """Of r states and their ports; p = min(r, n_ports)."""

    T: jax.Array  # (r, r)
    R: jax.Array  # (p, n_ports)
    plain: jax.Array  # bool: R = 1

    def across(self, gamma: jax.Array) -> jax.Array:
        """R Gamma R^T (p, p)."""
        if self.R.shape[0] != self.R.shape[1]:
            return self.R @ gamma @ self.R.T
        return jnp.asarray(lax.cond(self.plain, lambda g: g, lambda g: self.R @ g @ self.R.T, gamma))


def basis(P: Array) -> Basis:
    """For P (r, n_ports)."""
    r, ports = P.shape
    if not ports:
        return Basis(jnp.eye(r), jnp.zeros((0, 0)), jnp.array(True))
    Q, R = jnp.linalg.qr(jnp.asarray(P), mode="complete")
    if ports > r:
        return Basis(Q, R, jnp.array(False))
    U, s, Vt = jnp.linalg.svd(R[:ports])
    apart = s > TOGETHER * s[0]
    own = (U / jnp.where(apart, s, jnp.where(s[0] > 0.0, s[0], 1.0))) @ Vt
    return Basis(jnp.hstack([Q[:, :ports] @ own, Q[:, ports:]]), own.T @ R[:ports], apart.all())


def within(T: jax.Array, many: Array) -> jax.Array:
    """T^T X T of matrices X (k, r, r)."""
    return jnp.asarray(T.T @ (jnp.asarray(many) @ T))


def turned(system: System, T: jax.Array) -> System:
    """A machine of one body in coordinates y, z = T y, as far as `model.integration` reads it; its E is T^T T."""
    r, ports = system.P[0].shape
    P = (T.T @ jnp.asarray(system.P[0])).at[min(r, ports) :].set(0.0)
    return replace(
        system, A0=(within(T, system.A0[0]),), A=(within(T, system.A[0]),), P=(P,),
        M=T.T @ system.M, H=T.T @ system.H, B=T.T @ system.B,
        source_rows=system.source_rows @ T, film_rows=system.film_rows @ T,
    )  # fmt: skip


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Held:
    """Of a coarse step: what contacts do not change. p states that contacts touch, f others."""

    L: jax.Array  # (f, f) of c_ff
    Y: jax.Array  # (f, p) L^-1 c_fp
    S: jax.Array  # (p, p) Schur complement


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Factor:
    """Of a fine step."""

    held: Held
    L: jax.Array  # (p, p) of S + R Gamma R^T


def held(c: jax.Array, ports: int) -> Held:
    """c (r, r), symmetric and positive definite."""
    p = min(ports, len(c))
    if p == len(c):
        return Held(jnp.zeros((0, 0)), jnp.zeros((0, p)), c)
    L = jnp.linalg.cholesky(c[p:, p:])
    Y = solve_triangular(L, c[p:, :p], lower=True)
    return Held(L, Y, c[:p, :p] - Y.T @ Y)


def factor(held: Held, contacts: jax.Array) -> Factor:
    """contacts (p, p): R Gamma R^T."""
    return Factor(held, jnp.linalg.cholesky(held.S + contacts) if len(held.S) else held.S)


def solved(factor: Factor, b: jax.Array) -> jax.Array:
    """(c + P Gamma P^T)^-1 b, b (r,)."""
    held, p = factor.held, len(factor.L)
    if p == len(b):
        return jnp.asarray(cho_solve((factor.L, True), b))
    rest = solve_triangular(held.L, b[p:], lower=True)
    if not p:
        return jnp.asarray(solve_triangular(held.L, rest, trans=1, lower=True))
    first = cho_solve((factor.L, True), b[:p] - held.Y.T @ rest)
    return jnp.concatenate([first, solve_triangular(held.L, rest - held.Y @ first, trans=1, lower=True)])
