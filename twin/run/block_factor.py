"""Block elimination of a matrix whose blocks couple along the machine's kinematic chain.

Bodies touch their neighbours only, and a chain or tree eliminated from its leaves has no fill-in: the work is a sum of
n_b^3 over the bodies instead of (sum n_b)^3, and a solve is a few products with small dense blocks. Golub, Van Loan,
Matrix Computations, 4th ed., section 4.5 (block LDL^T); with D_i the pivot blocks that are left after elimination of
earlier bodies, the factor holds D_i^-1, L_ji = S_ji D_i^-1 and R_ij = D_i^-1 S_ij for coupled later bodies j.

Pivot blocks are inverted by Cholesky for symmetric positive definite matrices (block elimination is then stable
without pivoting) and by LU with pivoting inside the block otherwise.
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

    pivot: tuple[jax.Array, ...]  # D_i^-1 (n_i, n_i)
    left: tuple[tuple[jax.Array, ...], ...]  # L_ji (n_j, n_i)
    right: tuple[tuple[jax.Array, ...], ...]  # R_ij (n_i, n_j); empty for symmetric matrices, where R_ij = L_ji^T


def _inverse(block: jax.Array, symmetric: bool) -> jax.Array:
    if not symmetric:
        return jnp.linalg.inv(block)
    lower = jnp.linalg.cholesky(block, symmetrize_input=False)
    inverse = solve_triangular(lower, jnp.eye(len(block)), lower=True)
    return inverse.T @ inverse


def factorise(blocks: Blocks, elimination: Elimination, symmetric: bool) -> BlockFactor:
    """Factor of the matrix made of `blocks`; diagonal blocks must all be present."""
    S = dict(blocks)
    pivots, lefts, rights = [], [], []
    for i, later in zip(elimination.order, elimination.later, strict=True):
        pivot = _inverse(S[i, i], symmetric)
        left = tuple(S[j, i] @ pivot for j in later)
        for j, L in zip(later, left, strict=True):
            for k in later:
                update = L @ S[i, k]
                S[j, k] = S[j, k] - update if (j, k) in S else -update
        pivots.append(pivot)
        lefts.append(left)
        rights.append(() if symmetric else tuple(pivot @ S[i, j] for j in later))
    return BlockFactor(tuple(pivots), tuple(lefts), tuple(rights))


def solve(factor: BlockFactor, elimination: Elimination, right: list[jax.Array], symmetric: bool) -> list[jax.Array]:
    """Solution per body for right-hand sides per body (n_b,)."""
    y = list(right)
    for place, (i, later) in enumerate(zip(elimination.order, elimination.later, strict=True)):
        for j, L in zip(later, factor.left[place], strict=True):
            y[j] = y[j] - L @ y[i]
    for place in reversed(range(len(elimination.order))):
        i = elimination.order[place]
        x = factor.pivot[place] @ y[i]
        for k, j in enumerate(elimination.later[place]):
            x = x - (factor.left[place][k].T @ y[j] if symmetric else factor.right[place][k] @ y[j])
        y[i] = x
    return y
