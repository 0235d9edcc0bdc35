"""Block elimination of a matrix whose blocks couple along the machine's kinematic chain.

Bodies touch their neighbours only, and a chain or tree eliminated from its leaves has no fill-in: the work is a sum of
n_b^3 over the bodies instead of (sum n_b)^3, and a solve is a few products with small dense blocks. Golub, Van Loan,
Matrix Computations, 4th ed., sections 4.2.9 and 4.5; D_i are the pivot blocks left after elimination of earlier bodies.

- symmetric positive definite: block Cholesky, D_i = G_i G_i^T. The factor holds G_i^-1 and L_ji = S_ji G_i^-T for
  coupled later bodies j. Inverted triangles turn the many solves of frozen steps into products; D_i^-1 itself would
  save a product per solve and cost n_i^3 more per factorisation.
- otherwise: block LU, pivoting inside the blocks only. The factor holds D_i^-1, L_ji = S_ji D_i^-1, R_ij = D_i^-1 S_ij.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jax.scipy.linalg import solve_triangular

Blocks = dict[tuple[int, int], jax.Array]  # (row body, column body) -> dense block; absent means zero


@dataclass(frozen=True)
class Elimination:
    """Order of elimination and, per eliminated body, the coupled bodies that come later. Hashable."""

    order: tuple[int, ...]
    later: tuple[tuple[int, ...], ...]  # parallel to `order`


def plan(n_bodies: int, edges: set[tuple[int, int]]) -> Elimination:
    """Minimum-degree order for bodies coupled by undirected `edges`; fill-in included in `later`."""
    neighbours: dict[int, set[int]] = {i: set() for i in range(n_bodies)}
    for i, j in edges:
        if i != j:
            neighbours[i].add(j)
            neighbours[j].add(i)
    order, later = [], []
    while neighbours:
        i = min(neighbours, key=lambda b: (len(neighbours[b]), b))
        beside = neighbours.pop(i)
        for j in beside:
            neighbours[j] |= beside - {j}
            neighbours[j].discard(i)
        order.append(i)
        later.append(tuple(sorted(beside)))
    return Elimination(tuple(order), tuple(later))


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class BlockFactor:
    """Parallel to Elimination.order; inner tuples parallel to Elimination.later."""

    pivot: tuple[jax.Array, ...]  # G_i^-1, or D_i^-1 for oblique matrices (n_i, n_i)
    left: tuple[tuple[jax.Array, ...], ...]  # L_ji (n_j, n_i)
    right: tuple[tuple[jax.Array, ...], ...]  # R_ij (n_i, n_j); empty for symmetric matrices


def _inverse(block: jax.Array, symmetric: bool) -> jax.Array:
    """G^-1 of G G^T = block, or block^-1."""
    if not symmetric:
        return jnp.linalg.inv(block)
    return _triangular_inverse(jnp.linalg.cholesky(block, symmetrize_input=False))


LEAF = 32  # rows from which on a triangle is inverted by substitution


def _triangular_inverse(lower: jax.Array) -> jax.Array:
    """Inverse of a lower triangle by halves: products are four times faster than substitution against the identity."""
    n = len(lower)
    if n <= LEAF:
        return solve_triangular(lower, jnp.eye(n), lower=True)
    half = n // 2
    first, last = _triangular_inverse(lower[:half, :half]), _triangular_inverse(lower[half:, half:])
    return jnp.block([[first, jnp.zeros((half, n - half))], [-last @ (lower[half:, :half] @ first), last]])


def factorise(blocks: Blocks, elimination: Elimination, symmetric: bool) -> BlockFactor:
    """Factor of the matrix made of `blocks`; diagonal blocks must all be present."""
    S = dict(blocks)
    pivots, lefts, rights = [], [], []
    for i, later in zip(elimination.order, elimination.later, strict=True):
        pivot = _inverse(S[i, i], symmetric)
        left = tuple(S[j, i] @ (pivot.T if symmetric else pivot) for j in later)
        for j, L in zip(later, left, strict=True):
            for k, beside in zip(later, left, strict=True):
                update = L @ (beside.T if symmetric else S[i, k])
                S[j, k] = S[j, k] - update if (j, k) in S else -update
        pivots.append(pivot)
        lefts.append(left)
        rights.append(() if symmetric else tuple(pivot @ S[i, j] for j in later))
    return BlockFactor(tuple(pivots), tuple(lefts), tuple(rights))


def solve(factor: BlockFactor, elimination: Elimination, right: list[jax.Array], symmetric: bool) -> list[jax.Array]:
    """Solution per body for right-hand sides per body (n_b,)."""
    y = list(right)
    for place, (i, later) in enumerate(zip(elimination.order, elimination.later, strict=True)):
        if symmetric:
            y[i] = factor.pivot[place] @ y[i]
        for j, L in zip(later, factor.left[place], strict=True):
            y[j] = y[j] - L @ y[i]
    for place in reversed(range(len(elimination.order))):
        i, later = elimination.order[place], elimination.later[place]
        if symmetric:
            for j, L in zip(later, factor.left[place], strict=True):
                y[i] = y[i] - y[j] @ L  # three times faster than L.T @ y[j] in XLA on a CPU
            y[i] = y[i] @ factor.pivot[place]
        else:
            y[i] = factor.pivot[place] @ y[i]
            for j, R in zip(later, factor.right[place], strict=True):
                y[i] = y[i] - R @ y[j]
    return y
