"""The matrix of a time step by body, and its factor: kept as long as its coefficients stay near.

    S = rate + A0 + sum_k theta_k A_k + P Gamma P^T        in coordinates with E = 1

Gamma (`twin.rom.contact_matrix`) is tridiagonal on every rail, diagonal on pads, and of rank one between a rail and a
pad: S is assembled by body from its entries, never as an n_ports x n_ports product.
"""

from __future__ import annotations

from collections.abc import Sequence

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from twin.rom.contact_matrix import ContactEntries, tridiagonal_product
from twin.run.block_factor import BlockFactor, Couplings, Product, factorise, solve
from twin.run.system import Array, Layout, System


def diagonal_blocks(
    layout: Layout, system: System, rate: Array, contacts: ContactEntries, theta: Array
) -> list[jax.Array]:
    """Blocks of S [1/s] of each body, for one step's contacts and all coefficients theta (n_theta,)."""
    blocks = []
    for b, size in enumerate(layout.sizes):
        block = system.A0[b] + terms_of(layout, system, b, theta - system.nominal) + rate * jnp.eye(size)
        ports = np.array(layout.ports[b], dtype=int)
        if len(ports):  # neighbours on a rail have consecutive local ports
            PG = tridiagonal_product(jnp, system.P[b], contacts.diagonal[ports], contacts.neighbour[ports])
            block = block + PG @ system.port_rows[b]
        blocks.append(jnp.asarray(block))
    return blocks


def couplings_of(layout: Layout, system: System, contacts: ContactEntries) -> Couplings:
    """Blocks of S [1/s] by the pads of one body on the rails of another, or of the same (b, b) where it has both."""
    blocks: dict[tuple[int, int], Product] = {}
    for c in layout.couplings:
        r, p, pads = c.rail_body, c.pad_body, np.array(c.pad_ports)
        facing = [
            (slice(first, first + n), contacts.weight[k, :n])
            for k, first, n in zip(c.pairs, c.rail_first, c.rail_count, strict=True)
        ]
        rail_in = jnp.stack([system.P[r][:, rail] @ w for rail, w in facing], axis=1)
        rail_out = jnp.stack([w @ system.port_rows[r][rail] for rail, w in facing])
        for key, U, V in (
            ((r, p), rail_in, jnp.asarray(system.port_rows[p])[pads]),
            ((p, r), jnp.asarray(system.P[p])[:, pads], rail_out),
        ):
            before = blocks.get(key)
            blocks[key] = (-U, V) if before is None else (jnp.hstack([before[0], -U]), jnp.vstack([before[1], V]))
    return blocks


def terms_of(layout: Layout, system: System, b: int, theta: Array) -> jax.Array:
    """sum_k theta_k A_k of one body, without a pass over the joints where they are zero, as in most runs.

    Written as a sum, which XLA makes one pass over memory; a product with the stacked A takes three times as long.
    """
    terms, A, size = layout.terms[b], jnp.asarray(system.A[b]), layout.sizes[b]
    theta = jnp.asarray(theta)

    def part(films: bool) -> jax.Array:
        own = [theta[k] * A[i] for i, k in enumerate(terms) if (k < layout.n_films) == films]
        return sum(own, jnp.zeros((size, size)))

    joints = np.array([k for k in terms if k >= layout.n_films], dtype=int)
    if not len(joints):
        return part(True)
    return lax.cond(jnp.any(theta[joints] != 0.0), lambda: part(True) + part(False), lambda: part(True))


def factor_of(layout: Layout, system: System, rate: Array, contacts: ContactEntries, theta: Array) -> BlockFactor:
    """Factor of the matrix of a step with coefficients theta (n_theta,)."""
    diagonal = diagonal_blocks(layout, system, rate, contacts, theta)
    couplings = dict(couplings_of(layout, system, contacts))
    for b in range(len(diagonal)):
        if (b, b) in couplings:
            U, V = couplings.pop((b, b))
            diagonal[b] = diagonal[b] + U @ V
    return factorise(diagonal, couplings, layout.elimination, layout.symmetric)


def by_factor(
    layout: Layout, factor: BlockFactor, rest: Sequence[jax.Array], right: jax.Array, near: jax.Array
) -> jax.Array:
    """S^-1 right (N,) by the factor of a matrix nearby: what it lacks, rest (n, n) per body, acts on the state `near`.

    rest: () where the factor is exact.
    """
    borders = layout.offsets[1:-1]
    if len(rest):
        right = right - jnp.concatenate([R @ zb for R, zb in zip(rest, jnp.split(near, borders), strict=True)])
    return jnp.concatenate(solve(factor, layout.elimination, jnp.split(right, borders), layout.symmetric))
