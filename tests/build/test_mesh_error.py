"""The estimated error of the mesh against the true one, and what is told where a finer mesh does not fit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.corner import corner
from twin.build.certificate import MESH, Part
from twin.build.comparison import compare
from twin.build.full_model import FullModel, assemble, assemble_meshed
from twin.build.mesh import body_mesh
from twin.build.mesh_error import mesh_part, refined_bytes
from twin.build.refine import refined
from twin.build.scenario import Scenario, draw
from twin.build.stepper import CoupledStepper, tcp_at_poses
from twin.errors import DescriptionError
from twin.machine.description import Machine
from twin.machine.load import load_machine

SPINDLE = Path(__file__).parents[1] / "machines" / "spindle"
NOWHERE = np.zeros((1, 0))  # a machine without axes has one position


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    return load_machine(corner(tmp_path_factory.mktemp("corner")))


@pytest.fixture(scope="module")
def full(machine: Machine) -> FullModel:
    return assemble(machine)


@pytest.fixture(scope="module")
def scenarios(full: FullModel) -> list[Scenario]:
    return [draw(full.thermal.load_model, 4, hours=0.5)]


@pytest.fixture(scope="module")
def estimate(machine: Machine, full: FullModel, scenarios: list[Scenario]) -> Part:
    return mesh_part(machine, full, scenarios, 1, NOWHERE)


def true_error(machine: Machine, full: FullModel, scenarios: list[Scenario]) -> tuple[np.ndarray, np.ndarray]:
    """Per sensor [K] and component [m] in the case, against a mesh of a quarter of the size."""
    twice = tuple(body_mesh(b.name, tuple(refined(refined(part)) for part in b.parts)) for b in full.bodies)
    found = compare(assemble_meshed(machine, twice).thermal, full.thermal, scenarios)
    low, high = np.minimum(found.displacement_low, 0.0), np.maximum(found.displacement_high, 0.0)
    T, u = replace(found, displacement_low=low, displacement_high=high).scaled(machine.limits)
    return T, u.max(axis=0)


@pytest.mark.long
def test_the_estimate_is_within_a_factor_of_two_of_the_error_against_a_much_finer_mesh(
    machine: Machine, full: FullModel, scenarios: list[Scenario], estimate: Part
):
    T, u = estimate.errors.scaled(machine.limits)
    true_T, true_u = true_error(machine, full, scenarios)
    assert true_T.max() > machine.limits.temperature  # not negligible
    assert true_u.max() > machine.limits.displacement
    np.testing.assert_array_less(T, 2.0 * true_T)
    np.testing.assert_array_less(true_T / 2.0, T)
    moved = true_u > 0.1 * true_u.max()
    assert moved.sum() >= 2
    np.testing.assert_array_less(u.max(axis=0)[moved], 2.0 * true_u[moved])
    np.testing.assert_array_less(true_u[moved] / 2.0, u.max(axis=0)[moved])


def test_the_part_says_what_it_is_and_counts_in_no_sum(estimate: Part):
    assert (estimate.name, estimate.counts) == (MESH, False)
    assert estimate.between.endswith(" x the difference to a mesh of half the size")
    assert estimate.errors.displacement_error.shape == (1, 2, 3)  # the pose of the grid, then the position


def test_without_memory_for_a_finer_mesh_linear_elements_give_an_indication(
    machine: Machine, full: FullModel, scenarios: list[Scenario], estimate: Part
):
    indication = mesh_part(machine, full, scenarios, 1, NOWHERE, memory=refined_bytes(full.bodies) / 2)
    assert indication.between.startswith("indication: 0.66 x the difference to linear elements")
    assert "of memory" in indication.between
    (T, u), (finer_T, finer_u) = (part.errors.scaled(machine.limits) for part in (indication, estimate))
    assert finer_T.max() / 4.0 < T.max() < 4.0 * finer_T.max()
    assert finer_u.max() / 4.0 < u.max() < 4.0 * finer_u.max()


def test_a_machine_that_only_stands_warm_is_wrong_by_a_share_of_what_it_has_grown_by(machine: Machine, full: FullModel):
    still = draw(full.thermal.load_model, 1, hours=0.1)  # less than a milliwatt, 35 degC of air and machine throughout
    _, u = mesh_part(machine, full, [still], 1, NOWHERE).errors.scaled(machine.limits)
    assert 0 < u.max() < 0.05 * machine.limits.at_displacement_range


def test_linear_elements_expand_freely_without_strain_and_keep_heat(machine: Machine, full: FullModel):
    linear, quadratic = assemble_meshed(machine, full.bodies, linear=True).thermal, full.thermal
    assert linear.n == sum(part.mesh.nvertices for body in full.bodies for part in body.parts)
    for a, b in zip(linear.bodies, quadratic.bodies, strict=True):
        assert a.energy.sum() == pytest.approx(b.energy.sum(), rel=1e-12)
        np.testing.assert_allclose(a.B.sum(axis=0), 1.0)
        np.testing.assert_allclose(a.C.sum(axis=1), 1.0)
    warm = [tcp_at_poses(m, CoupledStepper(m).uniform(m.reference_temperature + 10.0)) for m in (linear, quadratic)]
    np.testing.assert_allclose(warm[0], warm[1], atol=5e-3 * np.abs(warm[1]).max())


def test_a_machine_without_a_mesh_has_no_mesh_error(full: FullModel):
    with pytest.raises(DescriptionError, match="a lumped machine has no mesh"):
        mesh_part(load_machine(SPINDLE), replace(full), [], 1, NOWHERE)
