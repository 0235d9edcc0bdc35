"""Coordinates in which contacts touch as few states as they have ports, and the factors of fine steps in them.

With P = Q [R; 0] (QR) a matrix of a fine step becomes

    Q^T (c + P Gamma P^T) Q = [c_pp + R Gamma R^T   c_pf]
                              [c_fp                 c_ff]

where only the first block follows the contacts. So c_ff and the Schur complement c_pp - c_pf c_ff^-1 c_fp are factored
once for all fine steps of a coarse one, and every fine step factors a matrix of the size of the ports
(Golub, Van Loan, Matrix Computations, 4th ed. 2013, chapters 3 to 5). E = 1 stays, as Q is orthogonal. (The ports'
temperatures as coordinates would leave Gamma as it is, but need R^-1, and ports that move together have none.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
from jax.scipy.linalg import cho_solve

from twin.run.system import Array, System


def basis(P: Array) -> jax.Array:
    """Q (r, r), orthogonal, with Q^T P zero below its first min(r, n_ports) rows; P (r, n_ports)."""
    if not P.shape[1]:
        return jnp.eye(P.shape[0])
    return jnp.asarray(jnp.linalg.qr(jnp.asarray(P), mode="complete")[0])


def within(Q: jax.Array, many: Array) -> jax.Array:
    """Q^T X Q of matrices X (k, r, r)."""
    return jnp.asarray(Q.T @ (jnp.asarray(many) @ Q))


def turned(system: System, Q: jax.Array) -> System:
    """A machine of one body in coordinates Q^T z, as far as `twin.diagnose.march` reads it."""
    r, ports = system.P[0].shape
    P = (Q.T @ jnp.asarray(system.P[0])).at[min(r, ports) :].set(0.0)
    return replace(
        system, A0=(within(Q, system.A0[0]),), A=(within(Q, system.A[0]),), P=(P,),
        M=Q.T @ system.M, H=Q.T @ system.H, B=Q.T @ system.B,
        source_rows=system.source_rows @ Q, film_rows=system.film_rows @ Q,
    )  # fmt: skip


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Held:
    """Of a coarse step: what contacts do not change. p states that contacts touch, f others."""

    L: jax.Array  # (f, f) of c_ff
    W: jax.Array  # (f, p) c_ff^-1 c_fp
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
    W = cho_solve((L, True), c[p:, :p])
    return Held(L, W, c[:p, :p] - c[:p, p:] @ W)


def factor(held: Held, contacts: jax.Array) -> Factor:
    """contacts (p, p): R Gamma R^T."""
    return Factor(held, jnp.linalg.cholesky(held.S + contacts) if len(held.S) else held.S)


def solved(factor: Factor, b: jax.Array) -> jax.Array:
    """(c + P Gamma P^T)^-1 b, b (r,)."""
    held, p = factor.held, len(factor.L)
    if p == len(b):
        return jnp.asarray(cho_solve((factor.L, True), b))
    rest = cho_solve((held.L, True), b[p:])
    if not p:
        return jnp.asarray(rest)
    first = cho_solve((factor.L, True), b[:p] - held.W.T @ b[p:])
    return jnp.concatenate([first, rest - held.W @ first])
