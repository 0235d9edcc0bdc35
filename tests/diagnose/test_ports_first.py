"""A step's matrix where contacts touch it first: that of the whole system, whatever the ports are."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.model.ports_first import basis, packed, turned, unpacked, within


def some(states, ports, rank, seed):
    """c (r, r) and P (r, n_ports) of this rank, Gamma (n_ports, n_ports), b (r,)."""
    rng = np.random.default_rng(seed)
    c = rng.standard_normal((states, states))
    c = c @ c.T + states * np.eye(states)
    P = rng.standard_normal((states, rank)) @ rng.standard_normal((rank, ports))
    gamma = rng.standard_normal((ports, ports))
    return c, P, gamma @ gamma.T, rng.standard_normal(states)


@pytest.mark.parametrize(("states", "ports", "rank"), [(9, 4, 4), (9, 4, 2), (5, 8, 5), (6, 6, 6), (7, 0, 0)])
def test_it_is_the_whole_system(states, ports, rank):
    c, P, gamma, b = some(states, ports, rank, states + ports)
    ports_first = basis(P)
    T, R = ports_first.T, ports_first.R
    np.testing.assert_allclose((T.T @ P)[:ports], R, atol=1e-9)
    np.testing.assert_allclose((T.T @ P)[ports:], 0.0, atol=1e-12)
    assert bool(ports_first.plain) == (rank == ports)
    if rank == ports:
        np.testing.assert_allclose(R, np.eye(ports), atol=1e-12)
    made = np.asarray(ports_first.joined(within(T, c[None])[0], gamma))
    np.testing.assert_allclose(T @ np.linalg.solve(made, T.T @ b), np.linalg.solve(c + P @ gamma @ P.T, b), rtol=1e-9)


def test_a_turned_machine_has_its_ports_first_and_reads_the_same():
    system = small_case.probed().system
    T = basis(system.P[0]).T
    after = turned(system, T)
    ports = system.P[0].shape[1]
    assert not np.any(np.asarray(after.P[0])[ports:])
    y = np.random.default_rng(1).standard_normal(len(T))
    np.testing.assert_allclose(after.film_rows @ y, system.film_rows @ (T @ y), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(after.A0[0] @ y, T.T @ (system.A0[0] @ (T @ y)), rtol=1e-9, atol=1e-9)


def test_a_packed_triangle_holds_all_of_symmetric_matrices():
    X = np.random.default_rng(3).standard_normal((2, 5, 5))
    X = X + np.swapaxes(X, 1, 2)
    assert packed(X).shape == (2, 15)
    np.testing.assert_array_equal(unpacked(packed(X), 5), X)
