"""Surfaces that face each other without touching: heat passes by a conductance, force does not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from skfem import MeshTet1

from tests.build.parts import box
from tests.support.descriptions import SLIDE, edited
from twin.build.check_meshes import check_meshes
from twin.build.full_model import assemble
from twin.build.interface import interface
from twin.build.mesh import BodyMesh, body_mesh, part_mesh
from twin.build.stepper import CoupledStepper, sensor_temperatures
from twin.errors import DescriptionError
from twin.machine.load import load_machine
from twin.rom.drive import evaluate

GAP = 0.01  # m


def apart(shift: float = 0.0, gap: float = GAP) -> BodyMesh:
    """Two unit-square blocks above each other whose meshes do not match, the upper one moved by `shift` along x."""
    lower, upper = (0, 0, 0), (shift, 0, 0.2 + gap)
    return body_mesh("a", (box("a", lower, (1, 1, 0.2), (3, 4, 1)), box("b", upper, (1, 1, 0.3), (5, 2, 2))))


def shape(name: str, mesh: MeshTet1, wanted: str) -> BodyMesh:
    """Block a below a part of any mesh whose facets that look down are the surface `wanted`."""
    corner = mesh.p[:, mesh.facets[:, mesh.boundary_facets()]]
    normal = np.cross((corner[:, 1] - corner[:, 0]).T, (corner[:, 2] - corner[:, 0]).T)
    inside = mesh.p[:, mesh.t[:, mesh.f2t[0, mesh.boundary_facets()]]].mean(axis=1)
    outward = np.sign(np.einsum("ki,ki->k", normal, (corner.mean(axis=1) - inside).T))
    down = (normal * outward[:, None])[:, 2] < -0.9 * np.linalg.norm(normal, axis=1)
    own = {wanted: mesh.boundary_facets()[down], "rest": mesh.boundary_facets()[~down]}
    return body_mesh("a", (box("a", (0, 0, 0), (1, 1, 0.2), (3, 4, 1)), part_mesh(name, mesh, own)))


def test_jumps_across_a_gap_are_integrated_exactly():
    body = apart()
    joint = interface(body, "a.z_max", "b.z_min", gap=GAP)
    assert joint.area == pytest.approx(1.0, rel=1e-12)
    x = body.nodes
    T = np.where(np.arange(body.n) >= body.offsets[1], -(x[:, 0] ** 2), x[:, 0] ** 2 + x[:, 1])
    assert T @ joint.matrix @ T == pytest.approx(4 / 5 + 2 / 3 + 1 / 3, rel=1e-12)
    assert joint.matrix @ np.ones(body.n) == pytest.approx(0.0, abs=1e-14)


def test_only_points_that_face_each_other_are_joined():
    assert interface(apart(0.3), "a.z_max", "b.z_min", gap=GAP).area == pytest.approx(0.7, rel=1e-12)


def test_points_farther_apart_than_the_gap_are_not_joined():
    """A wedge that opens from 0 to 50 mm over a metre: half of it lies within 25 mm."""
    mesh = MeshTet1.init_tensor(np.linspace(0, 1, 4), np.linspace(0, 1, 3), np.linspace(0.2, 0.4, 2))
    p = mesh.p.copy()
    p[2] += 0.05 * p[0]
    joint = interface(shape("b", MeshTet1(p, mesh.t), "below"), "a.z_max", "b.below", gap=0.025)
    assert joint.area == pytest.approx(0.5, rel=1e-5)  # the gap is exceeded by 1e-6 of itself


def test_a_gap_that_reaches_a_second_layer_is_refused():
    """A fork: two tongues above each other, both looking down."""
    mesh = MeshTet1.init_tensor(np.linspace(0, 1, 3), np.linspace(0, 1, 2), 0.21 + np.linspace(0, 0.3, 4))
    middle = mesh.p[:, mesh.t].mean(axis=1)
    fork = mesh.remove_elements(np.flatnonzero((middle[0] > 0.5) & (abs(middle[2] - 0.36) < 0.05)))
    body = shape("b", fork, "below")
    assert interface(body, "a.z_max", "b.below", gap=0.02).area == pytest.approx(1.0, rel=1e-12)
    with pytest.raises(DescriptionError, match="more than once"):
        interface(body, "a.z_max", "b.below", gap=0.3)


def test_surfaces_that_face_each_other_nowhere_are_refused():
    with pytest.raises(DescriptionError, match="face each other nowhere within 9 mm"):
        interface(apart(), "a.z_max", "b.z_min", "contacts.air", gap=0.009)
    with pytest.raises(DescriptionError, match='across a gap give gap = "2 mm"'):
        interface(apart(gap=0.1), "a.z_max", "b.z_min", "contacts.air")


WALLS = """
[machine]
name = "walls"

[materials.steel]
conductivity = 50.0
density = 8000.0
heat_capacity = 500.0

[parts.a]
material = "steel"
adiabatic = ["x_min", "x_max", "y_min", "y_max", "z_min"]
box = { origin = [0, 0, 0], size = [1, 1, 0.2], divisions = [2, 3, 1] }

[parts.b]
material = "steel"
adiabatic = ["x_min", "x_max", "y_min", "y_max"]
box = { origin = [0, 0, 0.205], size = [1, 1, 0.3], divisions = [3, 2, 1] }

[contacts.air]
kind = "fixed"
surfaces = ["a.z_max", "b.z_min"]
gap = "5 mm"
conductance = "5 W/(m^2*K)"

[environment.shop]
temperature = "20 degC"

[sources.heater]
law = "constant_heat"
surface = "a.z_min"
parameters = { power = "300 W" }

[films.air]
law = "constant_film"
emissivity = 0.0
surfaces = ["b.z_max"]
environment = "shop"
parameters = { natural = "10 W/(m^2*K)" }

[sensors.hot]
part = "a"
position = [0.3, 0.4, 0.0]

[sensors.cold]
part = "b"
position = [0.3, 0.4, 0.205]
"""


def test_resistances_of_walls_and_gap_add_up(tmp_path: Path):
    """Incropera et al., Fundamentals of Heat and Mass Transfer, 7th ed. 2011, eq (3.19): plane walls in series."""
    (tmp_path / "machine.toml").write_text(WALLS, encoding="utf-8")
    machine = load_machine(tmp_path)
    assert check_meshes(machine).problems == ()
    model = assemble(machine).thermal
    assert model.load_model.joints[0].name == "air"
    stepper = CoupledStepper(model)
    drive = evaluate(model.load_model, np.array([0.0, 60.0]), {}, 60.0)
    hot, cold = sensor_temperatures(model, stepper.steady_state(drive, 0))
    assert cold == pytest.approx(20.0 + 300.0 * (1 / 10 + 0.3 / 50), rel=1e-9)
    assert hot - cold == pytest.approx(300.0 * (1 / 5 + 0.2 / 50), rel=1e-9)


BESIDE = """
[contacts.beside]
kind = "fixed"
surfaces = ["rail_1.y_max", "block.y_min"]
gap = "55 mm"
conductance = "2 W/(m^2*K)"

# --- what drives it --"""


def test_a_gap_in_a_machine_with_a_tcp_passes_heat_and_no_force(tmp_path: Path):
    (tmp_path / "gap").mkdir()
    machine = load_machine(edited(tmp_path / "gap", ("# --- what drives it --", BESIDE)))
    assert check_meshes(machine).problems == ()
    gapped, plain = assemble(machine), assemble(load_machine(SLIDE))
    for a, b in zip(gapped.structure.rows(np.zeros(1)), plain.structure.rows(np.zeros(1)), strict=True):
        assert a == pytest.approx(b, abs=1e-12 * abs(b).max())
    bed, joints = gapped.thermal.bodies[0], [j.name for j in gapped.thermal.load_model.joints]
    term = bed.A[bed.theta.index(len(gapped.thermal.load_model.films) + joints.index("beside"))]
    rail = gapped.bodies[0].offsets[[p.name for p in gapped.bodies[0].parts].index("rail_1")]
    x = np.zeros(bed.n)
    x[rail : rail + gapped.bodies[0].part("rail_1")[0].n] = 1.0
    assert x @ term @ x == pytest.approx(0.05 * 0.03, rel=1e-9)  # m^2: of the block's face before the rail's


def test_a_part_that_only_a_gap_holds_is_refused_with_a_tcp(tmp_path: Path):
    old = 'surfaces = ["slide.z_max", "plate.z_min"]\n'
    with pytest.raises(DescriptionError, match="nothing but the gap holds 'slide' in front of 'plate'") as error:
        load_machine(edited(tmp_path, (old, old + 'gap = "1 mm"\n')))
    assert "contacts.plate.gap (line " in str(error.value)
