"""Tanks: one more state of a body behind a conductance, in the full, the reduced and the lumped model."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse.linalg

from tests.support.descriptions import edited
from tests.support.lumped import edited as edited_lumped
from twin.build.body_matrix import system_matrix
from twin.build.check_meshes import check_meshes
from twin.build.full_model import FullModel, assemble
from twin.build.pipeline import rich_model
from twin.build.rich_basis import RichOptions
from twin.build.scenario import draw
from twin.build.stepper import CoupledStepper, sensor_temperatures, tcp_at_poses
from twin.errors import DescriptionError
from twin.machine.description import Scale, Tank
from twin.machine.load import load_machine
from twin.machine.parameters import parameters
from twin.rom.apply import member_capacity, member_mean, with_values
from twin.rom.artefact import read_artefact, write_artefact
from twin.rom.model import MachineModel

OIL = '[tanks.oil]\nsurface = "bed.x_max"\ncapacity = "50 kJ/K"\nconductance = "10 W/K"\n\n'
WORK = '[tanks.workpiece]\nsurface = "plate.z_max"\ncapacity = "2 kJ/K"\nconductance = "25 W/K"\n\n'
BEFORE = "[signals.x_position]"


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    return load_machine(edited(tmp_path_factory.mktemp("tanks"), (BEFORE, OIL + WORK + BEFORE)))


@pytest.fixture(scope="module")
def full(machine) -> FullModel:
    return assemble(machine)


@pytest.fixture(scope="module")
def models(machine, full) -> dict[str, MachineModel]:
    return {"full": full.thermal, "reduced": rich_model(machine, full, RichOptions(samples=6))}


def test_matrices_stay_symmetric_and_conserve_heat(full):
    for body, name, capacity, conductance in zip(
        full.thermal.bodies, ("oil", "workpiece"), (5e4, 2e3), (10.0, 25.0), strict=True
    ):
        A0 = body.A0.toarray()
        assert body.members[-1] == f"tanks.{name}"
        assert A0[-1, -1] == pytest.approx(conductance, rel=1e-12)
        np.testing.assert_allclose(A0, A0.T, atol=1e-14)
        np.testing.assert_allclose(A0 @ body.one, 0.0, atol=1e-11)
        assert np.linalg.eigvalsh(A0).min() > -1e-10
        assert body.E[-1, -1] == body.energy[-1] == capacity
        assert body.energy.sum() == pytest.approx(body.E.sum(), rel=1e-12)
        for rows in (body.M, body.B, body.P, body.C.T, *(a.toarray() for a in body.A)):
            assert not rows[-1].any()
        assert not body.G[..., -1].any()
        assert body.F.shape[1] == body.n


@pytest.mark.parametrize("most", [3000, 10])
def test_what_it_takes_leaves_its_surface_evenly(machine, full, tmp_path, monkeypatch, most):
    """k b b^T with the weights b of the mean: no heat goes from the warm end of a surface to the cold one."""
    bare = assemble(load_machine(edited(tmp_path)))
    monkeypatch.setattr("twin.build.tanks.MOST", most)
    thermal = full.thermal if most == 3000 else assemble(machine).thermal
    for body, without, k in zip(thermal.bodies, bare.thermal.bodies, (10.0, 25.0), strict=True):
        A0 = body.A0.toarray()
        b = -A0[:-1, -1] / k
        assert b.sum() == pytest.approx(1.0, rel=1e-12)
        assert 0 < np.count_nonzero(b) <= most
        np.testing.assert_allclose(A0[:-1, :-1] - without.A0.toarray(), k * np.outer(b, b), atol=1e-10)


@pytest.mark.parametrize("kind", ["full", "reduced"])
def test_heat_is_conserved(models, kind):
    model = models[kind]
    stepper = CoupledStepper(model)
    drive = draw(model.load_model, 3, hours=0.5).drive
    stored = 0.0
    x = start = stepper.uniform(18.0)
    for step, now, heat in stepper.run(drive, start):
        x = now
        assert heat.balance_error < 1e-10
        stored += heat.stored * (drive.time[step + 1] - drive.time[step])
    energy = sum(float(b.energy @ (xb - x0)) for b, xb, x0 in zip(model.bodies, x, start, strict=True))
    assert energy == pytest.approx(stored, rel=1e-9)


@pytest.mark.parametrize("kind", ["full", "reduced"])
def test_in_the_end_a_tank_is_as_warm_as_its_surface(models, full, kind):
    model = models[kind]
    stepper = CoupledStepper(model)
    x = stepper.steady_state(draw(model.load_model, 8, hours=0.1).drive, 0)
    for body, xb, whole in zip(model.bodies, x, full.thermal.bodies, strict=True):
        A0 = whole.A0.tocsc()[:, [whole.n - 1]].toarray()[:, 0]  # minus the conductance times the mean's weights
        tank = member_mean(body, len(body.members) - 1) @ xb
        if kind == "full":
            assert tank == pytest.approx(-(A0[:-1] @ xb[:-1]) / A0[-1], abs=1e-7)
        assert abs(tank) > 0.2  # K: it is somewhere else than where it began
    truth = CoupledStepper(models["full"]).steady_state(draw(model.load_model, 8, hours=0.1).drive, 0)
    for body, xb, whole, xf in zip(model.bodies, x, models["full"].bodies, truth, strict=True):
        tank = member_mean(body, len(body.members) - 1) @ xb
        assert tank == pytest.approx(xf[whole.first[-1]], abs=0.02)


def slowest(body, theta) -> float:
    """1/s."""
    A = system_matrix(body, theta, 0.0)
    if isinstance(A, np.ndarray):
        return float(np.linalg.eigvalsh(A)[0])  # E = 1
    return float(scipy.sparse.linalg.eigsh(A.tocsc(), 1, body.E.tocsc(), sigma=0.0, return_eigenvectors=False)[0])


def test_a_slow_tank_decays_at_its_own_rate(tmp_path, models):
    """A tank much slower than its bed decays with its own capacity and the resistance to the air."""
    described = edited(tmp_path, (BEFORE, OIL.replace("50 kJ/K", "5 MJ/K") + BEFORE))
    slow = load_machine(described)
    whole = assemble(slow)
    reduced = rich_model(slow, whole, RichOptions(samples=6))
    load = whole.thermal.load_model
    theta = np.array([6.0] * len(load.films) + [j.conductance for j in load.joints])
    full_rate, rate = slowest(whole.thermal.bodies[0], theta), slowest(reduced.bodies[0], theta)
    assert rate == pytest.approx(full_rate, rel=1e-3)
    A = system_matrix(whole.thermal.bodies[0], theta, 0.0).tocsc()
    inner, across = A[:-1, :-1], A[:-1, [-1]].toarray()[:, 0]
    to_the_air = A[-1, -1] - across @ scipy.sparse.linalg.spsolve(inner, across)  # W/K, the bed in between at rest
    assert to_the_air < 0.9 * 10.0
    assert rate == pytest.approx(to_the_air / 5e6, rel=0.03)  # the bed's capacity, 2 % of the tank's, slows it further
    assert slowest(models["full"].bodies[0], theta) > 5.0 * rate


def test_outputs_of_the_reduced_model_and_what_tanks_change(models, full, tmp_path):
    small, whole = models["reduced"], models["full"]
    drive = draw(whole.load_model, 5, hours=1.0).drive
    last = {}
    for name, model in {"small": small, "whole": whole}.items():
        stepper = CoupledStepper(model)
        *_, (_, x, _) = stepper.run(drive, stepper.uniform(20.0))
        last[name] = sensor_temperatures(model, x), tcp_at_poses(model, x), x
    np.testing.assert_allclose(last["small"][0], last["whole"][0], atol=0.02)
    np.testing.assert_allclose(last["small"][1], last["whole"][1], atol=0.2e-6)
    for pose, moved in zip(whole.poses, last["whole"][1], strict=True):  # the structure with the same fields
        np.testing.assert_allclose(full.structure.displacement(pose, last["whole"][2]), moved, atol=1e-12)
    bare = assemble(load_machine(edited(tmp_path)))
    stepper = CoupledStepper(bare.thermal)
    *_, (_, x, _) = stepper.run(drive, stepper.uniform(20.0))
    assert np.abs(sensor_temperatures(bare.thermal, x) - last["whole"][0]).max() > 0.05
    for body, with_tank in zip(bare.thermal.bodies, whole.bodies, strict=True):
        np.testing.assert_allclose(with_tank.G[..., :-1], body.G, rtol=1e-9, atol=1e-18)


def test_members_and_their_capacity(machine, models, tmp_path):
    """The shares add up to E, and the capacity of a tank can be corrected; all that through a file."""
    path = tmp_path / "a.h5"
    write_artefact(path, models["reduced"], parameters=parameters(machine))
    artefact = read_artefact(path)
    chosen = [p for p in artefact.parameters if p.path.startswith("tanks")]
    assert [p.path for p in chosen] == ["tanks.oil.capacity", "tanks.workpiece.capacity"]
    changed = with_values(artefact.model, chosen, {"tanks.oil.capacity": 80e3})
    exact = with_values(models["full"], chosen, {"tanks.oil.capacity": 80e3})
    for body, other, whole in zip(artefact.model.bodies, changed.bodies, exact.bodies, strict=True):
        np.testing.assert_allclose(body.E_members.sum(axis=0), body.E, atol=1e-10 * np.abs(body.E).max())
        tank = len(body.members) - 1
        assert body.one @ member_capacity(body, tank) @ body.one == pytest.approx(
            {"bed": 50e3, "slide": 2e3}[body.name], rel=1e-6
        )
        more = 30e3 if body.name == "bed" else 0.0
        assert other.one @ other.energy == pytest.approx(body.one @ body.energy + more, rel=1e-9)
        assert whole.energy.sum() == pytest.approx(other.one @ other.energy, rel=1e-9)


LUMPED = '[tanks.oil]\nsurface = "{0}"\ncapacity = "7 kJ/K"\nconductance = "9 W/K"\n\n'
AS_NODE = (
    '[nodes.oil]\ncapacity = "7 kJ/K"\n\n[contacts.oil]\nkind = "fixed"\nsurfaces = ["oil", "{0}"]\ntotal = "9 W/K"\n\n'
)


@pytest.mark.parametrize("place", ["housing", "screw.end"])
def test_of_a_lumped_machine_a_tank_is_a_node_with_a_link(tmp_path, place):
    at = "[contacts.front_outer]"
    results = []
    for text in (LUMPED, AS_NODE):
        model = assemble(load_machine(edited_lumped(tmp_path, (at, text.format(place) + at)))).thermal
        stepper = CoupledStepper(model)
        scenarios = (draw(model.load_model, seed, hours=1.0) for seed in range(99))
        drive = next(s.drive for s in scenarios if "films laws" in s.label)  # others draw joints, of which one has more
        heats = list(stepper.run(drive, stepper.uniform(20.0)))
        assert max(heat.balance_error for *_, heat in heats) < 1e-10
        x = heats[-1][1]
        capacity = sum(b.energy.sum() for b in model.bodies)
        results.append((sensor_temperatures(model, x), tcp_at_poses(model, x), capacity))
    for ours, theirs in zip(*results, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-13)


def test_a_tank_on_a_whole_bar_keeps_the_balance(tmp_path):
    at = "[contacts.front_outer]"
    full = assemble(load_machine(edited_lumped(tmp_path, (at, LUMPED.format("screw") + at))))
    body = next(b for b in full.thermal.bodies if "tanks.oil" in b.members)
    np.testing.assert_allclose(body.A0 @ body.one, 0.0, atol=1e-12)
    assert body.A0[-1, -1] == pytest.approx(9.0, rel=1e-12)
    x = [np.zeros(b.n) for b in full.thermal.bodies]
    x[full.thermal.bodies.index(body)][-1] = 1.0
    np.testing.assert_array_equal(full.structure.displacement(full.thermal.poses[0], x), 0.0)


def test_surfaces_that_no_mesh_has(machine):
    """Of meshes from files the description alone cannot tell."""
    tank = Tank(surface="bed.nowhere", capacity=1.0, conductance=1.0)
    scale = Scale(axis="x", surface="screw.nowhere", expansion=1e-6)
    problems = check_meshes(machine.model_copy(update={"tanks": {"oil": tank}, "scales": {"glass": scale}})).problems
    assert {p.where for p in problems if "nowhere" in p.what} == {"tanks.oil.surface", "scales.glass.surface"}
    assert not any("tanks" in p.where for p in check_meshes(machine).problems)


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("bed.x_max", "bad.x_max", "did you mean 'bed'"),
        ("bed.x_max", "bed.left", "unknown surface"),
        ("bed.x_max", "bed.*", "name the surface"),
        ("50 kJ/K", "0 J/K", "greater than 0"),
        ("10 W/K", "10 W/m", "W"),
        ("conductance", "conductances", "unknown key"),
    ],
)
def test_what_is_refused(tmp_path, old, new, what):
    with pytest.raises(DescriptionError, match=what) as e:
        load_machine(edited(tmp_path, (BEFORE, OIL.replace(old, new) + BEFORE)))
    assert any("tanks.oil" in p.where for p in e.value.problems)
    at = "[contacts.front_outer]"
    with pytest.raises(DescriptionError, match="hosing"):
        load_machine(edited_lumped(tmp_path, (at, LUMPED.format("hosing") + at)))
