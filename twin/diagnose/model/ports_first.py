"""Coordinates in which contacts touch as few states as they have ports.

With z = T y, T^T P = [R; 0], the matrix of a step becomes

    T^T (c + P Gamma P^T) T = [c_pp + R Gamma R^T   c_pf]
                              [c_fp                 c_ff]

The first states are the temperatures of the ports, so that R = 1 and Gamma is added as it is: two products of matrices
less in every step. Ports that move together, or nearly so, have no such coordinates; they keep an R.

A step adds up one symmetric matrix per film and joint, of which it reads nothing but the lower triangles: packed one
after the other they are half of what a step has to read, and reading takes longest (r = 221, 28 terms: 1.15 ms whole,
0.49 ms packed and unpacked again, beside 0.55 ms of the Cholesky factor; by a script, beside other work).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from twin.run.system import Array, System

TOGETHER = 1e-6  # of the largest singular value of P: ports that differ by less move together


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Basis:
    """Of r states and their ports; p = min(r, n_ports)."""

    T: Array  # (r, r)
    R: Array  # (p, n_ports)
    plain: Array  # bool: R = 1

    def joined(self, c: Array, gamma: Array) -> jax.Array:
        """c + P Gamma P^T (r, r)."""
        p, ports = self.R.shape
        across = self._across(gamma) if p != ports else lax.cond(self.plain, lambda g: g, self._across, gamma)
        return jnp.asarray(c).at[:p, :p].add(across)

    def _across(self, gamma: Array) -> jax.Array:
        return jnp.asarray(self.R @ gamma @ self.R.T)


def basis(P: np.ndarray) -> Basis:
    """For P (r, n_ports).

    In numpy, as all that is made once per machine: compiled for every new number of states, it took a fifth of the time
    of a small machine's detector, whose other discretisations each have their own number (by a script).
    """
    r, ports = P.shape
    if not ports:
        return Basis(np.eye(r), np.zeros((0, 0)), np.array(True))
    Q, R = np.linalg.qr(P, mode="complete")
    if ports > r:
        return Basis(Q, R, np.array(False))
    U, s, Vt = np.linalg.svd(R[:ports])
    apart = s > TOGETHER * s[0]
    own = (U / np.where(apart, s, s[0] if s[0] > 0.0 else 1.0)) @ Vt
    return Basis(np.hstack([Q[:, :ports] @ own, Q[:, ports:]]), own.T @ R[:ports], np.array(apart.all()))


def within(T: Array, many: Array) -> Array:
    """T^T X T of matrices X (k, r, r)."""
    return T.T @ (many @ T)


def turned(system: System, T: np.ndarray) -> System:
    """A machine of one body in coordinates y, z = T y, as far as `model.integration` reads it; its E is T^T T."""
    r, ports = system.P[0].shape
    P = T.T @ np.asarray(system.P[0])
    P[min(r, ports) :] = 0.0
    return replace(
        system, A0=(within(T, np.asarray(system.A0[0])),), A=(within(T, np.asarray(system.A[0])),), P=(P,),
        M=T.T @ np.asarray(system.M), H=T.T @ np.asarray(system.H), B=T.T @ np.asarray(system.B),
        source_rows=np.asarray(system.source_rows) @ T, film_rows=np.asarray(system.film_rows) @ T,
        C=np.asarray(system.C) @ T,
    )  # fmt: skip


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class PortsFirst:
    """A machine of one body in the coordinates of its ports, t = r (r + 1) / 2."""

    ports: Basis
    system: System  # turned, its A0 and A packed
    E: Array  # (r, r) T^T T

    @classmethod
    def of(cls, system: System) -> PortsFirst:
        ports = basis(np.asarray(system.P[0]))
        T = np.asarray(ports.T)
        own = turned(system, T)
        return cls(ports, replace(own, A0=(packed(own.A0[0]),), A=(packed(own.A[0]),)), T.T @ T)


def packed(X: Array) -> Array:
    """(..., t) of symmetric X (..., r, r): their lower triangles, row by row."""
    rows, columns = np.tril_indices(X.shape[-1])
    return X[..., rows, columns]


def unpacked(v: Array, r: int) -> Array:
    """(..., r, r), both triangles, of v (..., t)."""
    return v[..., _places(r)]


@lru_cache(maxsize=8)
def _places(r: int) -> np.ndarray:
    """(r, r): where each number of a symmetric matrix lies in its packed triangle."""
    high, low = np.maximum.outer(np.arange(r), np.arange(r)), np.minimum.outer(np.arange(r), np.arange(r))
    return (high * (high + 1) // 2 + low).astype(np.int32)
