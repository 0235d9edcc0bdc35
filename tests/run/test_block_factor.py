"""Block elimination along chains, trees and loops of bodies."""

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


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("graph", GRAPHS)
def test_solves_the_whole_system(graph, symmetric):
    n, edges = GRAPHS[graph]
    rng = np.random.default_rng(1)
    sizes = rng.integers(1, 6, n)
    starts = np.cumsum([0, *sizes])
    A = np.zeros((starts[-1], starts[-1]))
    for i, j in {*edges, *((b, a) for a, b in edges), *((k, k) for k in range(n))}:
        A[starts[i] : starts[i + 1], starts[j] : starts[j + 1]] = rng.standard_normal((sizes[i], sizes[j]))
    A = (A + A.T) / 2 if symmetric else A
    A += 12.0 * np.eye(len(A))
    blocks = {
        (i, j): jnp.asarray(A[starts[i] : starts[i + 1], starts[j] : starts[j + 1]])
        for i in range(n)
        for j in range(n)
        if i == j or (i, j) in edges or (j, i) in edges
    }
    b = rng.standard_normal(len(A))
    elimination = plan(n, edges)
    x = solve(
        factorise(blocks, elimination, symmetric),
        elimination,
        [jnp.asarray(p) for p in np.split(b, starts[1:-1])],
        symmetric,
    )
    np.testing.assert_allclose(np.concatenate(x), np.linalg.solve(A, b), rtol=1e-11, atol=1e-13)
