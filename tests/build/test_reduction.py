"""Projection, rich basis and compression, by their properties."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse

from tests.build.two_bodies import load_model, model
from twin.build.body_matrix import system_matrix
from twin.build.compress import Tolerances, balanced, check_stability, galerkin, trajectories
from twin.build.project import orthonormalise, project
from twin.build.rich_basis import RichOptions, rich_basis, sample_points
from twin.build.scenario import draw, theta_bounds
from twin.build.stepper import CoupledStepper, sensor_temperatures, tcp_at_poses
from twin.errors import ModelError
from twin.rom.load_model import EnvironmentWiring, Signal


def sparse(machine):
    """The same machine with sparse matrices, as assembled models have them."""
    csr = scipy.sparse.csr_array
    return replace(
        machine,
        bodies=tuple(replace(b, E=csr(b.E), A0=csr(b.A0), A=tuple(csr(a) for a in b.A)) for b in machine.bodies),
    )


@pytest.fixture(scope="module")
def full():
    return sparse(model(n=(120, 90)))


@pytest.fixture(scope="module")
def rich(full):
    low, high = theta_bounds(full.load_model)
    options = RichOptions(samples=3)
    return replace(full, bodies=tuple(project(b, rich_basis(b, low, high, options)) for b in full.bodies))


def outputs(machine, scenario):
    stepper = CoupledStepper(machine)
    T, u = [], []
    for _, x, _ in stepper.run(scenario.drive, stepper.uniform(scenario.start)):
        T.append(sensor_temperatures(machine, x))
        u.append(tcp_at_poses(machine, x))
    return np.array(T), np.array(u)


def test_orthonormalise_is_orthonormal_to_itself_and_to_v():
    rng = np.random.default_rng(1)
    E = np.diag(rng.uniform(1, 9, 50))
    V = orthonormalise(rng.standard_normal((50, 6)), E)
    X = rng.standard_normal((50, 4))
    X[:, 3] = X[:, 2] + V @ rng.standard_normal(6)  # nothing new beside column 2
    W = orthonormalise(X / np.linalg.norm(X, axis=0), E, V, 1e-7)
    assert W.shape == (50, 3)
    assert np.allclose(W.T @ E @ W, np.eye(3), atol=1e-12)
    assert np.abs(V.T @ E @ W).max() < 1e-12


def test_galerkin_projection_keeps_definiteness_constants_and_energy(full, rich):
    for whole, body in zip(full.bodies, rich.bodies, strict=True):
        assert np.allclose(body.E, np.eye(body.n), atol=1e-10)
        for X in (body.A0, *body.A):
            assert np.allclose(X, X.T)
            assert np.linalg.eigvalsh(X).min() > -1e-10 * np.abs(X).max()
        assert np.abs(body.A0 @ body.one).max() < 1e-8 * np.abs(body.A0).max() * np.abs(body.one).max()
        assert np.allclose(body.P.T @ body.one, 1.0)
        assert np.allclose(body.C @ body.one, whole.C @ whole.one)
        assert np.isclose(body.energy @ body.one, whole.energy @ whole.one)


def test_rich_model_interpolates_the_transfer_function_at_its_samples(full, rich):
    low, high = theta_bounds(full.load_model)
    for whole, body in zip(full.bodies, rich.bodies, strict=True):
        for s, theta in sample_points(whole, low, high, RichOptions(samples=3)):
            exact = whole.C @ np.linalg.solve(system_matrix(whole, theta, s).toarray(), whole.P)
            assert np.allclose(body.C @ np.linalg.solve(system_matrix(body, theta, s), body.P), exact, rtol=1e-4)


def test_galerkin_converges_to_the_full_model_on_unseen_scenarios(full, rich):
    unit = Tolerances(0.02, 0.2e-6)
    snapshots = trajectories(rich, [draw(full.load_model, 100 + i, hours=2.0) for i in range(6)])
    unseen = draw(full.load_model, 7, hours=2.0)
    T, _ = outputs(full, unseen)
    errors = []
    for states in (10, 20, 40):
        small = galerkin(rich, snapshots, states, unit)
        assert small.n == states
        T_small, _ = outputs(small, unseen)
        errors.append(np.abs(T - T_small).max() / np.ptp(T))
    assert errors[2] < errors[0] / 10
    assert errors[2] < 1e-3


def test_reduced_heat_balance_closes(rich):
    snapshots = trajectories(rich, [draw(rich.load_model, 100, hours=1.0)])
    for compress in (galerkin, balanced):
        small = compress(rich, snapshots, 14, Tolerances(0.02, 0.2e-6))
        drive = draw(rich.load_model, 3, hours=0.5).drive
        stepper = CoupledStepper(small)
        x = stepper.uniform(18.0)
        for _, _, heat in stepper.run(drive, x, substeps=2):
            assert heat.balance_error < 1e-9


def test_balanced_is_biorthogonal_stable_and_better_than_nothing(full, rich):
    snapshots = trajectories(rich, [draw(full.load_model, 100 + i, hours=2.0) for i in range(6)])
    small = balanced(rich, snapshots, 20, Tolerances(0.02, 0.2e-6))
    assert not small.bodies[0].symmetric
    for body in small.bodies:
        assert np.allclose(body.E, np.eye(body.n), atol=1e-8)
    unseen = draw(full.load_model, 7, hours=2.0)
    T, _ = outputs(full, unseen)
    assert np.abs(T - outputs(small, unseen)[0]).max() < 0.02 * np.ptp(T)


def test_an_unstable_model_is_refused(rich):
    broken = replace(rich.bodies[0], A0=rich.bodies[0].A0 - 1.0 * np.eye(rich.bodies[0].n))
    with pytest.raises(ModelError, match="grows"):
        check_stability(replace(rich, bodies=(broken, *rich.bodies[1:])), samples=2)


def test_too_few_states_are_refused(rich):
    snapshots = trajectories(rich, [draw(rich.load_model, 100, hours=0.5)])
    with pytest.raises(ModelError, match="too few"):
        galerkin(rich, snapshots, 3, Tolerances(0.02, 0.2e-6))


def test_scenarios_stay_in_the_box_and_repeat():
    load = load_model()
    low, high = theta_bounds(load)
    for seed in range(12):
        drive = draw(load, seed, hours=1.0).drive
        assert np.all(drive.theta >= low - 1e-12)
        assert np.all(drive.theta <= high + 1e-12)
        assert not drive.flags.any(), [n for n, f in zip(drive.flag_names, drive.flags.any(axis=0), strict=True) if f]
        assert np.array_equal(drive.power, draw(load, seed, hours=1.0).drive.power)


def test_the_start_of_a_scenario_is_the_air_of_the_first_measured_environment():
    """The same in every process, however names hash: an equal build gives an equal artefact."""
    load = load_model()
    pits = tuple(f"pit_{i}" for i in range(8))
    load = replace(
        load,
        signals=load.signals + tuple(Signal(p, p, "degC", "value", 5.0, 35.0) for p in pits),
        environments=(
            EnvironmentWiring("floor", "", 19.0),
            *load.environments,
            *(EnvironmentWiring(p, p, 20.0) for p in pits),
        ),
    )
    for seed in range(3):
        scenario = draw(load, seed, hours=0.2, dt=1.0)
        assert scenario.start == pytest.approx(scenario.drive.environment[0, 1], abs=0.02)
