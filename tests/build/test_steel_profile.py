"""The steel profile of the model reduction literature on coarse meshes: its matrices, and bounds of its reduction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.steel_profile import drawn, hankel, largest, responses, transfer
from benchmarks.steel_profile_model import CONDUCTIVITY, CORNERS, DENSITY, HEAT, profile
from twin.build.compress import Tolerances, balanced, galerkin
from twin.build.project import project
from twin.build.scenario import theta_bounds

OMEGA = np.r_[0.0, np.logspace(-6, 2, 17)]  # rad/s
UNIT = Tolerances(1.0, 1.0)


@pytest.fixture(scope="module")
def machine():
    return profile(0)


@pytest.fixture(scope="module")
def rich(machine):
    """All states of the coarsest mesh in coordinates with E = 1, as reductions expect them."""
    full = machine.bodies[0]
    L = np.linalg.cholesky(full.E.toarray())
    return replace(machine, bodies=(project(full, np.linalg.inv(L).T),))


def test_the_meshes_have_as_many_nodes_as_the_benchmark_of_the_literature(machine):
    assert [machine.n, profile(1).n, profile(2).n] == [109, 371, 1357]


def test_the_profile_has_the_mass_and_the_boundary_of_its_outline(machine):
    body = machine.bodies[0]
    x, y = CORNERS.T
    area = np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2
    assert body.energy.sum() == pytest.approx(DENSITY * HEAT * area)
    lengths = np.linalg.norm(np.roll(CORNERS, -1, axis=0) - CORNERS, axis=1)
    assert body.M.sum() == pytest.approx(lengths[:-1].sum())  # all but the axis of symmetry
    assert np.abs(body.A0 @ body.one).max() < 1e-12 * CONDUCTIVITY


def test_equal_outer_temperatures_leave_no_difference(machine):
    body = machine.bodies[0]
    H = transfer(body, np.full(7, 10.0), np.zeros(1))[0]
    assert np.abs(H.sum(axis=1)).max() < 1e-10
    assert largest(H[None]) > 1e-3


def test_no_method_is_better_than_the_hankel_bound_and_galerkin_is_stable_without_films(machine, rich):
    low, high = theta_bounds(machine.load_model)
    body = rich.bodies[0]
    snapshots = [responses(body, drawn(low, high, 3, 1))]
    for method in (galerkin, balanced):
        for states in (12, 24):
            small = method(rich, snapshots, states, UNIT).bodies[0]
            for theta in drawn(low, high, 3, 2):
                error = largest(transfer(small, theta, OMEGA) - transfer(body, theta, OMEGA))
                # a share below: the largest error may lie between two frequencies
                assert error > 0.9 * hankel(body, theta)[states]
            if method is galerkin:
                for theta in np.vstack([np.zeros(7), 1e4 * np.eye(7)]):
                    A = small.A0 + np.tensordot(theta, np.array(small.A), 1)
                    assert np.linalg.eigvalsh(A).min() > -1e-12 * np.abs(A).max()


def test_truncation_at_one_theta_obeys_the_bound_of_balanced_truncation(rich):
    """Twice the sum of what is cut off (Glover 1984): the values of `hankel` are those of the very system."""
    body, theta = rich.bodies[0], np.array([2.0, 40.0, 5.0, 10.0, 20.0, 3.0, 30.0])
    values = hankel(body, theta)
    rate, U = np.linalg.eigh(body.A0 + np.tensordot(theta, np.array(body.A), 1))
    B, C = U.T @ (body.M * theta), body.C @ U
    Wc, Wo = (X / (rate[:, None] + rate[None, :]) for X in (B @ B.T, C.T @ C))
    root = np.linalg.cholesky(Wc + 1e-13 * np.trace(Wc) * np.eye(len(Wc)))
    left, s, _ = np.linalg.svd(root.T @ Wo @ root)
    r = 10
    assert np.sqrt(s[:r]) == pytest.approx(values[:r], rel=1e-3)
    V = root @ left[:, :r]
    W = np.linalg.solve(root.T, left[:, :r])
    H = transfer(body, theta, OMEGA)
    small = np.array([C @ V @ np.linalg.solve(1j * w * np.eye(r) + W.T * rate @ V, W.T @ B) for w in OMEGA])
    assert 0.5 * values[r] < largest(small - H) < 2.0 * values[r:].sum()
