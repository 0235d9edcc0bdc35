"""Block elimination along chains, trees and loops of bodies."""

from itertools import pairwise

import jax.numpy as jnp
import numpy as np
import pytest

from twin.run.block_factor import factorise, plan, solve

GRAPHS = {
    "chain": (4, {(0, 1), (1, 2), (2, 3)}),
    "star": (5, {(2, 0), (2, 1), (2, 3), (2, 4)}),
    "loop": (4, {(0, 1), (1, 2), (2, 3), (0, 3)}),
    "apart": (3, set()),
}


def test_trees_have_no_fill_in():
    for name in ("chain", "star"):
        n, edges = GRAPHS[name]
        assert sum(map(len, plan(n, edges).later)) == len(edges)
    assert sum(map(len, plan(*GRAPHS["loop"]).later)) == 5  # one block of fill-in


@pytest.mark.long
@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("graph", GRAPHS)
def test_solves_the_whole_system(graph, symmetric):
    n, edges = GRAPHS[graph]
    rng = np.random.default_rng(1)
    sizes = rng.integers(1, 6, n)
    sizes[0] = 150  # in strips
    starts = np.cumsum([0, *sizes])
    A = np.zeros((starts[-1], starts[-1]))
    both_ways = {*edges, *((b, a) for a, b in edges)}
    couplings = {}
    for i, j in sorted(both_ways):
        pads = 2 if symmetric else rng.integers(1, 3)
        U, V = rng.standard_normal((sizes[i], pads)), rng.standard_normal((pads, sizes[j]))
        if symmetric and (j, i) in couplings:
            U, V = (np.asarray(part).T for part in reversed(couplings[j, i]))
        couplings[i, j] = jnp.asarray(U), jnp.asarray(V)
        A[starts[i] : starts[i + 1], starts[j] : starts[j + 1]] = U @ V
    diagonal = []
    for own in (slice(a, b) for a, b in pairwise(starts)):
        A[own, own] = rng.standard_normal(A[own, own].shape)
        A[own, own] += (A[own, own].T if symmetric else 0.0) + 100.0 * np.eye(own.stop - own.start)
        diagonal.append(jnp.asarray(A[own, own]))
    b = rng.standard_normal(len(A))
    elimination = plan(n, edges)
    x = solve(
        factorise(diagonal, couplings, elimination, symmetric),
        elimination,
        [jnp.asarray(p) for p in np.split(b, starts[1:-1])],
        symmetric,
    )
    np.testing.assert_allclose(np.concatenate(x), np.linalg.solve(A, b), rtol=1e-11, atol=1e-13)
