"""A fine step's matrix factored where contacts touch it: the solution of the whole system, whatever the ports are."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.ports_first import basis, factor, held, solved, turned, within


def some(states, ports, rank, seed):
    """c (r, r) and P (r, n_ports) of this rank, Gamma (n_ports, n_ports), b (r,)."""
    rng = np.random.default_rng(seed)
    c = rng.standard_normal((states, states))
    c = c @ c.T + states * np.eye(states)
    P = rng.standard_normal((states, rank)) @ rng.standard_normal((rank, ports))
    gamma = rng.standard_normal((ports, ports))
    return c, P, gamma @ gamma.T, rng.standard_normal(states)


@pytest.mark.parametrize(("states", "ports", "rank"), [(9, 4, 4), (9, 4, 2), (5, 8, 5), (6, 6, 6), (7, 0, 0)])
def test_it_solves_the_whole_system(states, ports, rank):
    c, P, gamma, b = some(states, ports, rank, states + ports)
    Q = basis(P)
    np.testing.assert_allclose(Q.T @ Q, np.eye(states), atol=1e-12)
    R = (Q.T @ P)[:ports]
    made = factor(held(within(Q, c[None])[0], ports), R @ gamma @ R.T)
    assert made.L.shape == (min(ports, states),) * 2
    np.testing.assert_allclose(Q @ solved(made, Q.T @ b), np.linalg.solve(c + P @ gamma @ P.T, b), rtol=1e-9)


def test_a_turned_machine_has_its_ports_first_and_reads_the_same():
    system = small_case.bench().system
    Q = basis(system.P[0])
    after = turned(system, Q)
    ports = system.P[0].shape[1]
    assert not np.any(np.asarray(after.P[0])[ports:])
    z = np.random.default_rng(1).standard_normal(len(Q))
    np.testing.assert_allclose(after.film_rows @ (Q.T @ z), system.film_rows @ z, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(Q @ (after.A0[0] @ (Q.T @ z)), system.A0[0] @ z, rtol=1e-9, atol=1e-9)
