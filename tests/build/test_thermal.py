"""The assembled thermal model: patch tests, balances, sensors, poses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

from tests.build.parts import STEEL, box, linear, stacked
from twin.build.factorize import factorize
from twin.build.interface import interface
from twin.build.mesh import load_body_meshes
from twin.build.surface import mass, patch
from twin.build.thermal import assemble_thermal, part_matrices, pose_grid
from twin.errors import DescriptionError
from twin.machine.description import Environment, Machine, Sensor
from twin.machine.load import load_machine
from twin.rom.model import AffineBody, MachineModel

SLIDE = load_machine(Path(__file__).parents[1] / "machines" / "slide")


@pytest.fixture(scope="module")
def model() -> MachineModel:
    return assemble_thermal(SLIDE, load_body_meshes(SLIDE))


def test_constant_and_linear_temperatures_of_one_part():
    part = box("a", (0.0, 0.0, 0.0), (1.0, 0.5, 0.2), (3, 2, 2))
    E, A0 = part_matrices(part, STEEL)
    volume = 0.1
    assert E.sum() == pytest.approx(STEEL.density * STEEL.heat_capacity * volume, rel=1e-12)
    np.testing.assert_allclose(A0 @ np.ones(part.n), 0.0, atol=1e-11)
    inner = np.setdiff1d(np.arange(part.n), np.unique(part.dofs.get_facet_dofs(part.mesh.boundary_facets()).flatten()))
    np.testing.assert_allclose((A0 @ linear(part.nodes))[inner], 0.0, atol=1e-11)  # no sources inside
    flow = A0 @ linear(part.nodes)
    faces = {s: patch(part, part.facets(s)) for s in part.surfaces}
    gradient = {"x": 2.0, "y": -3.0, "z": 0.5}
    expected = sum(
        STEEL.conductivity * gradient[s[0]] * (1 if s.endswith("max") else -1) * p.area * p.d0 for s, p in faces.items()
    )
    np.testing.assert_allclose(flow, expected, atol=1e-11)


def test_capacity_and_conduction_are_symmetric_and_chunks_make_no_difference():
    part = box("a", (0.0, 0.0, 0.0), (1.0, 0.5, 0.2), (3, 2, 2))
    for matrix in part_matrices(part, STEEL):
        assert abs(matrix - matrix.T).max() < 1e-12 * abs(matrix).max()
    x = part.nodes[:, 0]
    E, A0 = part_matrices(part, STEEL)
    assert x**2 @ E @ x**2 == pytest.approx(STEEL.density * STEEL.heat_capacity * 0.1 / 5, rel=1e-12)
    assert x**2 @ A0 @ x**2 == pytest.approx(STEEL.conductivity * 0.1 * 4 / 3, rel=1e-12)


@pytest.mark.parametrize(("a", "b"), [((2, 2, 2), (3, 3, 2)), ((3, 4, 1), (5, 2, 2))])
def test_heat_through_a_joint_between_meshes_that_do_not_match(a: tuple[int, int, int], b: tuple[int, int, int]):
    """Linear temperature in both blocks and the jump q/g between them, though no facet fits another."""
    body = stacked(a, b)
    g, q = 800.0, 9000.0  # W/(m^2 K), W/m^2 upwards
    parts = [part_matrices(p, STEEL)[1] for p in body.parts]
    K = sp.csr_array(sp.block_diag(parts)) + g * interface(body, "a.z_max", "b.z_min").matrix
    top, bottom = body.parts[1], body.parts[0]
    cold = 1e3 * mass(top, top.facets("z_max"))  # a film to 0 K fixes the level
    K = K + sp.csr_array(sp.block_diag([sp.csr_array((bottom.n, bottom.n)), cold]))
    load = np.concatenate([q * patch(bottom, bottom.facets("z_min")).d0, np.zeros(top.n)])
    T = factorize(sp.csr_array(K)).solve(load)
    z = body.nodes[:, 2]
    on_b = np.arange(body.n) >= body.offsets[1]
    exact = q / 1e3 + q / STEEL.conductivity * (0.5 - z) + np.where(on_b, 0.0, q / g)
    np.testing.assert_allclose(T, exact, rtol=1e-10)


def test_balances_of_every_body(model: MachineModel):
    for body in model.bodies:
        volume_heat = sum(
            SLIDE.materials[SLIDE.parts[p].material].density
            * SLIDE.materials[SLIDE.parts[p].material].heat_capacity
            * np.prod(SLIDE.parts[p].box.size)
            for p in parts_of(body)
        )
        assert body.energy.sum() == pytest.approx(volume_heat, rel=1e-12)
        np.testing.assert_allclose(body.A0 @ body.one, 0.0, atol=1e-12)
        np.testing.assert_allclose(body.B.sum(axis=0), 1.0, rtol=1e-13)
        np.testing.assert_allclose(body.P.sum(axis=0), 1.0, rtol=1e-13)
        np.testing.assert_allclose(body.C.sum(axis=1), 1.0, rtol=1e-13)
        np.testing.assert_array_equal(body.energy, body.E @ body.one)
        n_films = len(model.load_model.films)
        for k, a, m in zip(body.theta, body.A, body.M.T, strict=True):
            assert abs(a - a.T).max() < 1e-15
            if k < n_films:
                np.testing.assert_allclose(a @ body.one, m, atol=1e-16)
            else:
                assert not m.any()
                np.testing.assert_allclose(a @ body.one, 0.0, atol=1e-15)


def parts_of(body: AffineBody) -> tuple[str, ...]:
    from twin.machine.bodies import bodies_of

    return next(b.parts for b in bodies_of(SLIDE) if b.name == body.name)


def test_films_cover_their_surfaces(model: MachineModel):
    bed, slide = model.bodies
    structure = bed.M[:, bed.theta.index(0)].sum()
    rails = 2 * (2 * 0.8 * 0.03 + 2 * 0.03 * 0.03 + 0.8 * 0.03)  # four sides and ends, less the glued one
    block = 2 * 0.05 * 0.045 + 0.06 * 0.045 + 0.05 * 0.06  # y sides, motor face, top
    sides = 2 * 0.8 * 0.1 + 2 * 0.3 * 0.1
    assert structure == pytest.approx(sides + rails + block, rel=1e-12)
    assert 0 not in slide.theta  # that film touches no part of the slide
    assert bed.theta == tuple(range(3 + 7))
    assert slide.theta == (1, *range(10, 16))


def test_sources_ports_and_sensors_are_numbered_as_in_the_machine(model: MachineModel):
    bed, slide = model.bodies
    assert model.sensors == ("bed_front", "block", "slide", "plate")
    assert model.ambient_sensors == (("shop_air", 0),)
    assert (bed.sources, slide.sources) == ((0,), ())  # heat of contacts goes through ports
    assert (bed.sensors, slide.sensors) == ((0, 1), (2, 3))
    assert sorted(bed.ports + slide.ports) == list(range(len(model.load_model.ports)))
    meshes = load_body_meshes(SLIDE)
    np.testing.assert_allclose(slide.C @ meshes[1].nodes, [[0.07, 0.05, 0.2], [0.0, 0.0, 0.23]], atol=1e-15)
    assert bed.G.shape == (0, 3, bed.n)


def test_poses_span_the_stroke(model: MachineModel):
    assert model.pose_axes == ("x",)
    np.testing.assert_allclose(model.poses, np.linspace(-0.2, 0.2, 5)[:, None], atol=1e-16)

    def grid(wanted: dict) -> list[np.ndarray]:
        return list(pose_grid(SLIDE.model_copy(update={"poses": wanted})))

    np.testing.assert_allclose(grid({})[0], np.linspace(-0.2, 0.2, 5))
    np.testing.assert_allclose(grid({"x": 1})[0], [0.0])
    np.testing.assert_allclose(grid({"x": (-0.1, 0.05)})[0], [-0.1, 0.05])


def test_misplaced_sensors_are_reported_together():
    sensors = {
        "a": Sensor(part="bed", position=(0, 0, 5)),
        "b": Sensor(part="plate", position=(1, 0, 0)),
    }
    machine = SLIDE.model_copy(update={"sensors": sensors})
    with pytest.raises(DescriptionError) as e:
        assemble_thermal(machine, load_body_meshes(machine))
    assert [p.where for p in e.value.problems] == ["sensors.a.position", "sensors.b.position"]


def test_broken_descriptions_are_refused_before_they_are_assembled():
    broken: Machine = SLIDE.model_copy(
        update={"sensors": {"a": Sensor(environment="hal")}, "films": {**SLIDE.films, "more": SLIDE.films["floor"]}}
    )
    with pytest.raises(DescriptionError) as e:
        assemble_thermal(broken, load_body_meshes(broken))
    said = " | ".join(p.what for p in e.value.problems)
    assert "unknown environment 'hal'" in said
    assert "'foot_1.*' is also in films.floor" in said


def test_air_that_is_warmer_above_heats_by_the_height_of_the_surface():
    shop = Environment(signal="shop_air", gradient=0.5, height=1.0)
    machine = SLIDE.model_copy(update={"environment": {**SLIDE.environment, "shop": shop}})
    model = assemble_thermal(machine, load_body_meshes(machine))
    assert model.load_model.environments[0].gradient == 0.5
    for body in model.bodies:
        nodes = next(b for b in load_body_meshes(machine) if b.name == body.name).nodes
        assert body.H is not None
        for column, a in enumerate(body.A):
            film = body.theta[column] < len(model.load_model.films)
            np.testing.assert_allclose(body.H[:, column], a @ nodes[:, 2] if film else 0.0, atol=1e-15)
    assert assemble_thermal(SLIDE, load_body_meshes(SLIDE)).bodies[0].H is None
