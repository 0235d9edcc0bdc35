"""The elastic machine at any position: patch tests, conservation, mechanisms, and the direct solve as its reference."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from twin.build.coupled_direct import CoupledMachine, assemble_coupled
from twin.build.displacement_field import DisplacementField
from twin.build.elastic_ports import PortTable, rigid_modes
from twin.build.mesh import BodyMesh, load_body_meshes
from twin.build.springs import spring_system
from twin.build.structure import Structure, assemble_structure
from twin.errors import DescriptionError, ModelError
from twin.machine.bodies import bodies_of
from twin.machine.description import Machine, StiffnessOfPair, Support
from twin.machine.load import load_machine

ROOT = Path(__file__).parents[2]
POSITIONS = [-0.2, -0.113, 0.0, 0.05, 0.2]  # m: between and on stations, both ends of the stroke


@cache
def slide() -> Machine:
    return load_machine(ROOT / "tests/machines/slide/machine.toml")


@cache
def meshes() -> tuple[BodyMesh, ...]:
    return load_body_meshes(slide())


def isostatic_twin() -> Machine:
    """The slide machine out of one material's expansion, on supports that do not hinder it."""
    machine = slide()
    k = 1e8
    stiffness = {"foot_1": (k, k, k), "foot_2": (k, 0.0, k), "foot_3": (0.0, 0.0, k)}
    supports = {n: Support(surface=f"{n}.z_min", stiffness=s) for n, s in stiffness.items()}
    materials = {n: m.model_copy(update={"expansion": 12e-6}) for n, m in machine.materials.items()}
    return machine.model_copy(update={"supports": supports, "materials": materials})


@cache
def structure() -> Structure:
    return assemble_structure(slide(), meshes())


@cache
def coupled() -> CoupledMachine:
    return assemble_coupled(slide(), meshes())


@cache
def free_structure() -> Structure:
    return assemble_structure(isostatic_twin(), meshes())


def random_fields(seed: int) -> list[np.ndarray]:
    """Rough fields over a smooth one, kelvins."""
    rng = np.random.default_rng(seed)
    return [rng.normal(size=b.n) + 20.0 * b.nodes @ rng.normal(size=3) for b in meshes()]


@pytest.mark.parametrize("x", POSITIONS)
def test_uniform_expansion_moves_the_tcp_by_its_lever_and_strains_no_contact(x: float) -> None:
    dT = 10.0
    fields = [np.full(b.n, dT) for b in meshes()]
    system = free_structure().system
    grown = 12e-6 * dT * (system.tool.centroid + [x, 0.0, 0.0] - system.work.centroid)  # between the two patches
    assert free_structure().displacement({"x": x}, fields) == pytest.approx(grown, abs=1e-10 * np.linalg.norm(grown))
    forces, _ = free_structure().solve({"x": x}, fields)
    locked = 12e-6 * dT * 1e8  # N: what a spring would carry that takes up the growth of a metre
    assert abs(forces).max() <= 1e-8 * locked
    # every node, not only the TCP: alpha dT times the distance from the foot that is held, in space
    foot = system.grounds[0].port.centroid
    for shift, b, u in zip((0.0, x), meshes(), free_field()({"x": x}, fields), strict=True):
        error = abs(u - 12e-6 * dT * (b.nodes + [shift, 0.0, 0.0] - foot)) / abs(u).max()
        for part, first in zip(b.parts, b.offsets, strict=True):
            # the screw, a cantilever 35 times as long as thick, yields to the rounding of the forces on it
            assert error[first : first + part.n].max() <= (1e-9 if part.name == "screw" else 1e-10)


@cache
def free_field() -> DisplacementField:
    return DisplacementField(isostatic_twin(), meshes(), free_structure())


@pytest.mark.parametrize("x", POSITIONS)
def test_rigid_motion_of_the_whole_machine_opens_no_gap(x: float) -> None:
    """A common motion in space, rotation included: no force in any moving contact, no relative TCP displacement."""
    system = structure().system
    U = coupled().U
    t, w = np.array([1e-3, 2e-3, -1e-3]), np.array([1e-3, -2e-3, 3e-3])
    u = np.concatenate([t + np.cross(w, b.nodes + [shift, 0, 0]) for shift, b in zip((0.0, x), meshes(), strict=True)])
    ports = U.T @ u.ravel()
    contacts = [i for i, name in enumerate(system.names) if name.startswith("contacts")]
    assert len(contacts) == 9
    assert abs((system.gap_rows({"x": x}) @ ports)[contacts]).max() <= 1e-10 * abs(u).max()
    assert abs(system.tcp_rows({"x": x}) @ ports).max() <= 1e-10 * abs(u).max()


@pytest.mark.parametrize("x", POSITIONS)
def test_forces_of_a_pair_have_no_resultant_and_no_moment(x: float) -> None:
    system = structure().system
    forces, _ = structure().solve({"x": x}, random_fields(1))
    J = system.gap_rows({"x": x})
    points = np.vstack([b.nodes + [shift, 0, 0] for shift, b in zip((0.0, x), meshes(), strict=True)])
    modes = rigid_modes(points)
    assert abs(forces[:8]).min() > 1.0  # of the carriages; the screw alone holds along x, so statics unloads it
    for guide in system.guides:
        rows = slice(guide.first, guide.first + len(guide.directions))
        nodal = coupled().U @ (-J[rows].T @ forces[rows])
        assert abs(modes.T @ nodal).max() <= 1e-10 * abs(forces).max()
    total = modes.T @ (coupled().U @ (-J.T @ forces))  # the ground carries nothing: heat has no resultant
    assert abs(total).max() <= 1e-9 * abs(forces).sum()


@pytest.mark.parametrize("x", POSITIONS)
def test_planted_tilt_of_one_branch_gives_tilt_times_lever(x: float) -> None:
    system, U = structure().system, coupled().U
    tilt, pivot = np.array([2e-4, -5e-4, 3e-4]), np.array([0.1, 0.2, 0.3])
    bed, table = meshes()
    tool_side = np.concatenate([np.zeros((bed.n, 3)), np.cross(tilt, table.nodes - pivot)])
    expected = np.cross(tilt, [0.0, 0.0, 0.28] - pivot)  # the tool centre point of machine.toml, carried along
    assert system.tcp_rows({"x": x}) @ (U.T @ tool_side.ravel()) == pytest.approx(expected, abs=1e-14)
    work_side = np.concatenate([np.cross(tilt, bed.nodes - pivot), np.zeros((table.n, 3))])
    expected = -np.cross(tilt, [x, 0.0, 0.28] - pivot)  # the same point in space, as part of the bed
    assert system.tcp_rows({"x": x}) @ (U.T @ work_side.ravel()) == pytest.approx(expected, abs=1e-14)


def test_flexibility_matches_the_direct_solve_at_random_poses() -> None:
    poses = np.random.default_rng(7).uniform(-0.2, 0.2, size=(5, 1))
    rows = structure().pose_rows(poses)
    for i, pose in enumerate(poses):
        direct = coupled().rows(pose)
        largest = max(abs(G).max() for G in direct)
        for condensed, G in zip(rows, direct, strict=True):
            assert abs(condensed[i] - G).max() <= 1e-8 * largest
        fields = random_fields(i)
        w = coupled().displacement(pose, fields)
        assert structure().displacement(pose, fields) == pytest.approx(w, abs=1e-8 * np.linalg.norm(w))


def test_displacement_field_matches_the_direct_solve() -> None:
    recover, fields = DisplacementField(slide(), meshes(), structure()), random_fields(4)
    for u, direct in zip(recover({"x": 0.07}, fields), coupled().field({"x": 0.07}, fields), strict=True):
        assert abs(u - direct).max() <= 1e-7 * abs(direct).max()


def test_springs_yield_by_their_stiffness() -> None:
    """Only heat in the slide, softer guides: forces fall, and each force is stiffness times gap."""
    fields = [np.zeros(meshes()[0].n), 30.0 * meshes()[1].nodes[:, 1]]
    forces, motions = structure().solve({"x": 0.0}, fields)
    field = DisplacementField(slide(), meshes(), structure())({"x": 0.0}, fields)
    gaps = structure().system.gap_rows({"x": 0.0}) @ (coupled().U.T @ np.concatenate(field).ravel())
    assert motions.shape == (2, 6)
    assert forces == pytest.approx(structure().system.stiffness * gaps, abs=1e-6 * abs(forces).max())


def with_stiffness(name: str, stiffness: StiffnessOfPair) -> Machine:
    contact = slide().contacts[name].model_copy(update={"stiffness": stiffness})
    return slide().model_copy(update={"contacts": slide().contacts | {name: contact}})


def test_a_slide_without_screw_stiffness_is_a_mechanism() -> None:
    with pytest.raises(ModelError, match="body 'slide' moves freely along x"):
        assemble_structure(with_stiffness("x_screw", StiffnessOfPair()), meshes())


def test_a_machine_on_rollers_is_a_mechanism() -> None:
    k = (0.0, 1e8, 1e8)
    supports = {n: s.model_copy(update={"stiffness": k}) for n, s in slide().supports.items()}
    with pytest.raises(ModelError, match="moves freely along x, together with"):
        assemble_structure(slide().model_copy(update={"supports": supports}), meshes())


def test_a_machine_without_springs_is_refused() -> None:
    loose = {n: c.model_copy(update={"stiffness": StiffnessOfPair()}) for n, c in slide().contacts.items()}
    bare = slide().model_copy(update={"supports": {}, "contacts": loose})
    with pytest.raises(ModelError) as error:
        assemble_structure(bare, meshes())
    assert "12 free motion(s)" in str(error.value)


def test_a_pad_that_faces_along_the_axis_is_refused() -> None:
    guide = slide().contacts["x_guide"]
    turned = guide.model_copy(update={"pairs": (("rail_1.z_max", "pad_1.x_min"),)})
    machine = slide().model_copy(update={"contacts": slide().contacts | {"x_guide": turned}})
    with pytest.raises(DescriptionError, match="points along the axis"):
        spring_system(machine, bodies_of(machine), PortTable(meshes()))


def test_unknown_axes_and_wrong_counts_are_refused() -> None:
    with pytest.raises(ValueError, match="no linear axis"):
        structure().rows({"y": 0.0})
    with pytest.raises(ValueError, match="positions of shape"):
        structure().rows(np.zeros(2))


@pytest.mark.slow
def test_flexibility_matches_the_direct_solve_on_the_five_axis_machine() -> None:
    machine = load_machine(ROOT / "models/five_axis/machine.toml")
    bodies = load_body_meshes(machine)
    condensed, direct = assemble_structure(machine, bodies), assemble_coupled(machine, bodies)
    rng = np.random.default_rng(11)
    poses = np.array([[rng.uniform(*machine.axes[a].stroke) for a in condensed.axes] for _ in range(5)])
    rows = condensed.pose_rows(poses)
    for i, pose in enumerate(poses):
        expected = direct.rows(pose)
        largest = max(abs(G).max() for G in expected)
        for G, E in zip(rows, expected, strict=True):
            assert abs(G[i] - E).max() <= 1e-8 * largest
