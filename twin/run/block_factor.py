"""Block elimination of a matrix whose blocks couple along the machine's kinematic chain, in few dimensions.

Bodies touch their neighbours only, and a chain or tree eliminated from its leaves has no fill-in: the work is a sum of
n_b^3 over the bodies instead of (sum n_b)^3, and a solve is a few products with small dense blocks. Golub, Van Loan,
Matrix Computations, 4th ed., sections 4.2.9 and 4.5; D_i are the pivot blocks left after elimination of earlier bodies.

Bodies touch at few pads: S_ji = U_ji V_ji with as many columns in U as there are pads. Every block that elimination
makes beside the diagonal is such a product again, and none is ever multiplied out: on the shipped machine that would be
two fifths of all numbers that a solve reads, and more than half of the work of a factorisation.

- symmetric positive definite: block Cholesky, D_i = G_i G_i^T. The factor holds G_i^-1 and L_ji = S_ji G_i^-T =
  U_ji (V_ji G_i^-T) for coupled later bodies j. Inverted triangles turn the many solves of frozen steps into products,
  and are held in strips, which leave out most of their zeros; D_i^-1 would cost n_i^3 more per factorisation.
- otherwise: block LU, pivoting inside the blocks only. The factor holds D_i^-1, L_ji = S_ji D_i^-1, R_ij = D_i^-1 S_ij.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
from jax.scipy.linalg import solve_triangular

Product = tuple[jax.Array, jax.Array]  # U (n_i, k) and V (k, n_j) of U V
Couplings = Mapping[tuple[int, int], Product]  # (row body, column body) -> block beside the diagonal; absent means zero


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
    """Parallel to Elimination.order; inner tuples of left and right parallel to Elimination.later."""

    pivot: tuple[tuple[jax.Array, ...], ...]  # strips of G_i^-1, or D_i^-1 (n_i, n_i) of oblique matrices alone
    left: tuple[tuple[Product, ...], ...]  # L_ji (n_j, n_i)
    right: tuple[tuple[Product, ...], ...]  # R_ij (n_i, n_j); empty for symmetric matrices


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


STRIP = 64  # rows of a strip: of a triangle of 235 rows four, which hold 0.63 of its square


def _strips(lower: jax.Array) -> tuple[jax.Array, ...]:
    """Rows of a lower triangle up to its diagonal, some at a time."""
    n = len(lower)
    count = max(round(n / STRIP), 1)
    ends = [n * i // count for i in range(count + 1)]
    return tuple(lower[a:b, :b] for a, b in pairwise(ends))


def _times(strips: tuple[jax.Array, ...], x: jax.Array) -> jax.Array:
    """L x (n,) of a triangle in strips."""
    return jnp.concatenate([strip @ x[: strip.shape[1]] for strip in strips])


def _transpose_times(strips: tuple[jax.Array, ...], y: jax.Array) -> jax.Array:
    """L^T y (n,)."""
    found, begin = jnp.zeros(0), 0
    for strip in strips:
        more = y[begin : begin + len(strip)] @ strip  # three times faster than strip.T @ y in XLA on a CPU
        found, begin = jnp.concatenate([found + more[: len(found)], more[len(found) :]]), begin + len(strip)
    return found


def factorise(
    diagonal: Sequence[jax.Array], couplings: Couplings, elimination: Elimination, symmetric: bool
) -> BlockFactor:
    """Factor of the matrix with these blocks; couplings: (i, j) beside (j, i)."""
    D, S = list(diagonal), dict(couplings)
    pivots, lefts, rights = [], [], []
    for i, later in zip(elimination.order, elimination.later, strict=True):
        pivot = _inverse(D[i], symmetric)
        if symmetric:
            left = tuple((S[j, i][0], S[j, i][1] @ pivot.T) for j in later)
            above = tuple((Y.T, U.T) for U, Y in left)  # L_ki^T = Y^T U^T
        else:
            left = tuple((S[j, i][0], S[j, i][1] @ pivot) for j in later)
            above = tuple(S[i, k] for k in later)
        for j, (U, Y) in zip(later, left, strict=True):
            for k, (Z, V) in zip(later, above, strict=True):
                taken = U @ -(Y @ Z)
                if j == k:
                    D[j] = D[j] + taken @ V
                elif (j, k) in S:
                    S[j, k] = jnp.hstack([S[j, k][0], taken]), jnp.vstack([S[j, k][1], V])
                else:
                    S[j, k] = taken, V
        pivots.append(_strips(pivot) if symmetric else (pivot,))
        lefts.append(left)
        rights.append(() if symmetric else tuple((pivot @ Z, V) for Z, V in above))
    return BlockFactor(tuple(pivots), tuple(lefts), tuple(rights))


def solve(factor: BlockFactor, elimination: Elimination, right: list[jax.Array], symmetric: bool) -> list[jax.Array]:
    """Solution per body for right-hand sides per body (n_b,)."""
    y = list(right)
    for place, (i, later) in enumerate(zip(elimination.order, elimination.later, strict=True)):
        if symmetric:
            y[i] = _times(factor.pivot[place], y[i])
        for j, (U, Y) in zip(later, factor.left[place], strict=True):
            y[j] = y[j] - U @ (Y @ y[i])
    for place in reversed(range(len(elimination.order))):
        i, later = elimination.order[place], elimination.later[place]
        if symmetric:
            for j, (U, Y) in zip(later, factor.left[place], strict=True):
                y[i] = y[i] - (y[j] @ U) @ Y
            y[i] = _transpose_times(factor.pivot[place], y[i])
        else:
            y[i] = factor.pivot[place][0] @ y[i]
            for j, (Z, V) in zip(later, factor.right[place], strict=True):
                y[i] = y[i] - Z @ (V @ y[j])
    return y
