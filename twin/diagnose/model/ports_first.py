"""Coordinates in which contacts touch as few states as they have ports.

With z = T y, T^T P = [R; 0], the matrix of a step becomes

    T^T (c + P Gamma P^T) T = [c_pp + R Gamma R^T   c_pf]
                              [c_fp                 c_ff]

The first states are the temperatures of the ports, so that R = 1 and Gamma is added as it is: two products of matrices
less in every step. Ports that move together, or nearly so, have no such coordinates; they keep an R.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
from jax import lax

from twin.run.system import Array, System

TOGETHER = 1e-6  # of the largest singular value of P: ports that differ by less move together


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Basis:
    """Of r states and their ports; p = min(r, n_ports)."""

    T: jax.Array  # (r, r)
    R: jax.Array  # (p, n_ports)
    plain: jax.Array  # bool: R = 1

    def joined(self, c: jax.Array, gamma: jax.Array) -> jax.Array:
        """c + P Gamma P^T (r, r)."""
        p, ports = self.R.shape
        across = self.R @ gamma @ self.R.T if p != ports else lax.cond(self.plain, lambda g: g, self._across, gamma)
        return c.at[:p, :p].add(across)

    def _across(self, gamma: jax.Array) -> jax.Array:
        return self.R @ gamma @ self.R.T


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
