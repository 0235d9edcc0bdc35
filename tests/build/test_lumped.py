"""Lumped machines against closed solutions: one and two nodes, rods and fins, screws, heat balance."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.lumped import SPINDLE, film, source, write
from twin.build.body_matrix import system_matrix
from twin.build.full_model import FullModel, assemble
from twin.build.lumped import lumped_bodies, lumped_ports
from twin.build.scenario import draw
from twin.build.stepper import CoupledStepper, sensor_temperatures
from twin.machine.load import load_machine
from twin.rom.drive import Drive, evaluate
from twin.rom.lumped_structure import integral
from twin.rom.tableau import SDIRK2_6, Tableau

AXIS = """
[axes.x]
direction = [{sign}1.0, 0.0, 0.0]
stroke = ["-250 mm", "250 mm"]
carries = ["{carried}"]
position = "x_position"

[signals.x_position]
unit = "mm"
range = [-250, 250]
"""
SCREW = """
[bars.screw]
material = "steel"
origin = [{origin}, 0.0, 0.0]
direction = [{direction}, 0.0, 0.0]
length = 1.0
cross_section = "8 cm^2"
perimeter = "100 mm"
elements = 10
fixed_end = "{fixed}"

[nodes.nut]
capacity = "500 J/K"
area = "0.02 m^2"
position = [0.05, 0.0, 0.0]

[contacts.screw_nut]
kind = "moving"
axis = "x"
pairs = [["screw", "nut"]]
total = "5 W/K"
"""


def model(folder, *texts) -> FullModel:
    return assemble(load_machine(write(folder, *texts)))


def drive_of(full: FullModel, hours: float, dt: float, current: float, **signals: float) -> Drive:
    """Constant loads."""
    time = np.array([0.0, hours * 3600.0])
    values = {name: np.full(2, value) for name, value in {"current": current, **signals}.items()}
    return evaluate(full.thermal.load_model, time, values, dt)


def matrices(full: FullModel, body: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """E and A of a body at its described coefficients."""
    drive = drive_of(full, 1.0, 60.0, 0.0)
    own = full.thermal.bodies[body]
    return own.E.toarray(), system_matrix(own, drive.theta[0], 0.0).toarray()


ONE = '[nodes.a]\ncapacity = "4 kJ/K"\narea = "0.5 m^2"\n', film("a", "a", 8.0), source("a", "a")


def decay_of_a_step(tableau: Tableau, z: float) -> float:
    """R(-z) = 1 - z b (1 + z a)^-1 1 (Hairer, Wanner, Solving Ordinary Differential Equations II, IV.3.)"""
    s = len(tableau.rows)
    a = np.array([np.pad(row, (0, s - len(row))) for row in tableau.rows])
    return float(1.0 - z * np.array(tableau.weights) @ np.linalg.solve(np.eye(s) + z * a, np.ones(s)))


def test_one_node_warms_by_its_time_constant(tmp_path):
    full = model(tmp_path, *ONE)
    tau, rise = 4000.0 / (8.0 * 0.5), 10.0**2 / (8.0 * 0.5)
    error = []
    for dt in (60.0, 30.0):
        stepper, drive = CoupledStepper(full.thermal), drive_of(full, 1.0, dt, 10.0)
        decay = decay_of_a_step(SDIRK2_6, dt / tau)
        for step, (x,), _ in stepper.run(drive, stepper.uniform(20.0)):
            assert x[0] == pytest.approx(rise * (1.0 - decay ** (step + 1)), rel=1e-12)  # the method, exactly
        error.append(abs(x[0] - rise * (1.0 - np.exp(-3600.0 / tau))))
        assert stepper.steady_state(drive, 0)[0][0] == pytest.approx(rise, rel=1e-9)
    assert 1.9 < np.log2(error[0] / error[1]) < 2.1


def test_two_nodes_have_the_steady_state_and_the_time_constants_of_the_closed_solution(tmp_path):
    C1, C2, G, h = 2000.0, 9000.0, 12.0, 5.0
    full = model(
        tmp_path,
        '[nodes.a]\ncapacity = "2 kJ/K"\n[nodes.b]\ncapacity = "9 kJ/K"\narea = "1 m^2"\n',
        '[contacts.ab]\nkind = "fixed"\nsurfaces = ["a", "b"]\ntotal = "12 W/K"\n',
        film("b", "b", h),
        source("a", "a"),
    )
    E, A = matrices(full)
    trace, determinant = G / C1 + (G + h) / C2, G * h / (C1 * C2)
    rates = (trace + np.array([1, -1]) * np.sqrt(trace**2 - 4 * determinant)) / 2
    assert np.sort(np.linalg.eigvals(np.linalg.solve(E, A)).real)[::-1] == pytest.approx(rates, rel=1e-12)
    (x,) = CoupledStepper(full.thermal).steady_state(drive_of(full, 1.0, 60.0, 10.0), 0)
    assert x == pytest.approx([100.0 / G + 100.0 / h, 100.0 / h], rel=1e-9)
    assert full.thermal.load_model.theta_names == ("films.b", "contacts.ab.total")


def test_area_and_conductance_are_the_same_as_their_product(tmp_path):
    nodes = '[nodes.a]\ncapacity = "2 kJ/K"\n[nodes.b]\ncapacity = "9 kJ/K"\narea = "1 m^2"\n', film("b", "b", 5.0)
    joint = '[contacts.ab]\nkind = "fixed"\nsurfaces = ["a", "b"]\n'
    total = model(tmp_path, *nodes, joint, 'total = "12 W/K"\n')
    by_area = model(tmp_path, *nodes, joint, 'area = "50 cm^2"\nconductance = "2400 W/(m^2*K)"\n')
    assert matrices(total)[1] == pytest.approx(matrices(by_area)[1], rel=1e-12)


def rod(elements: int, perimeter: str = '"40 mm"') -> str:
    return f"""
[bars.rod]
material = "steel"
origin = [0.1, 0.2, 0.3]
direction = [0, 0, 2]
length = "300 mm"
cross_section = "1 cm^2"
perimeter = {perimeter}
elements = {elements}
"""


def test_fin_has_the_temperatures_of_the_closed_solution_to_second_order(tmp_path):
    q, h, k, area, perimeter, L = 4.0, 25.0, 50.0, 1e-4, 0.04, 0.3
    m = np.sqrt(h * perimeter / (k * area))
    z = np.array([0.0, 0.113, 0.3])
    exact = q / (k * area * m) * np.cosh(m * (L - z)) / np.sinh(m * L)
    error = []
    for elements in (8, 16, 32, 64):
        at = (f"[sensors.s{i}]\npart = 'rod'\nposition = [0.1, 0.2, {0.3 + s}]\n" for i, s in enumerate(z))
        full = model(tmp_path, rod(elements), film("air", "rod", h), source("q", "rod.start"), *at)
        x = CoupledStepper(full.thermal).steady_state(drive_of(full, 1.0, 60.0, 2.0), 0)
        error.append(np.abs(sensor_temperatures(full.thermal, x) - 20.0 - exact).max())
    orders = np.log2(np.array(error[:-1]) / error[1:])
    assert np.all((orders > 1.9) & (orders < 2.1)), (error, orders)
    assert error[-1] < 1e-3 * exact.max()


def test_insulated_rod_evens_out_at_the_rates_of_the_closed_solution_to_second_order(tmp_path):
    exact = 50.0 / (7800.0 * 500.0) * (np.pi * np.array([1, 2]) / 0.3) ** 2
    error = []
    for elements in (8, 16, 32):
        full = model(tmp_path, rod(elements), film("air", "rod", 5.0))
        body = full.thermal.bodies[0]
        rates = np.sort(np.linalg.eigvals(np.linalg.solve(body.E.toarray(), body.A0.toarray())).real)
        assert abs(rates[0]) < 1e-12
        error.append(np.abs(rates[1:3] / exact - 1.0))
    orders = np.log2(np.array(error[:-1]) / np.array(error[1:]))
    assert np.all((orders > 1.9) & (orders < 2.1)), orders
    assert error[-1][0] < 1e-3


def test_rod_between_two_nodes_resists_by_its_length_at_any_number_of_elements(tmp_path):
    ends = (
        '[nodes.hot]\ncapacity = "1 kJ/K"\n[nodes.cold]\ncapacity = "1 kJ/K"\narea = "1 m^2"\n',
        '[contacts.hot]\nkind = "fixed"\nsurfaces = ["hot", "rod.start"]\ntotal = "2 W/K"\n',
        '[contacts.cold]\nkind = "fixed"\nsurfaces = ["rod.end", "cold"]\ntotal = "3 W/K"\n',
        film("cold", "cold", 10.0),
        source("q", "hot"),
    )
    for elements in (2, 7):
        full = model(tmp_path, rod(elements), *ends)
        (x,) = CoupledStepper(full.thermal).steady_state(drive_of(full, 1.0, 60.0, 3.0), 0)
        (body,) = lumped_bodies(load_machine(tmp_path))
        hot, cold = (x[body.first[body.members.index(n)]] for n in ("hot", "cold"))
        assert cold == pytest.approx(9.0 / 10.0, rel=1e-9)
        assert hot - cold == pytest.approx(9.0 * (1 / 2 + 0.3 / (50.0 * 1e-4) + 1 / 3), rel=1e-9)
        assert full.thermal.bodies[0].energy.sum() == pytest.approx(2000.0 + 7800.0 * 500.0 * 1e-4 * 0.3, rel=1e-12)


def test_heat_balance_closes_on_the_spindle():
    full = assemble(load_machine(SPINDLE))
    for seed in range(3):
        scenario = draw(full.thermal.load_model, seed, hours=1.0)
        stepper = CoupledStepper(full.thermal)
        worst = max(h.balance_error for _, _, h in stepper.run(scenario.drive, stepper.uniform(scenario.start), 2))
        assert worst < 1e-10


def test_a_sweeping_nut_heats_what_it_passes_and_nothing_is_lost(tmp_path):
    nut = 'kind = "moving"\naxis = "x"\npairs = [["screw", "nut"]]\ntotal = "5 W/K"\n'
    texts = (
        SCREW.format(origin=-0.5, direction=1.0, fixed="start").replace(nut, nut + 'assignment = "segment"\n'),
        AXIS.format(sign="", carried="nut"),
        film("all", "screw nut", 10.0),
        source("q", "nut").replace('surface = "nut"', 'contact = "screw_nut"\nrail_share = 1.0'),
    )
    load = model(tmp_path, *texts).thermal.load_model
    time = np.array([0.0, 60.0])
    # the nut stands at 0.05 + position: from border to border of the five elements in -0.2 .. 0.3
    drive = evaluate(load, time, {"current": np.full(2, 10.0), "x_position": np.array([-0.25, 0.25])}, 60.0)
    assert drive.port_heat[0, 3:8] == pytest.approx(np.full(5, 20.0), rel=1e-12)
    assert drive.port_heat.sum() == pytest.approx(100.0, rel=1e-12)


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("fixed", ["start", "end"])
@pytest.mark.parametrize("side", ["tool", "work"])
@pytest.mark.parametrize("carried", ["nut", "screw"])
@pytest.mark.parametrize("sign", ["", "-"])
def test_screw_grows_from_its_bearing_to_the_nut_at_any_position(tmp_path, direction, fixed, side, carried, sign):
    origin = -0.5 if direction > 0 else 0.5
    full = model(
        tmp_path,
        SCREW.format(origin=origin, direction=direction, fixed=fixed),
        AXIS.format(sign=sign, carried=carried),
        film("all", "screw nut", 10.0),
        f"[tcp.screws]\nscrew = '{side}'\n",
    )
    s = np.linspace(-0.5, 0.5, 11) * direction  # machine coordinate of the borders
    T = [3.0 + 4.0 * s, np.array([50.0])]
    if full.thermal.bodies[0].n == 1:
        T = T[::-1]
    bearing = origin if fixed == "start" else -origin
    for position in (-0.25, -0.11, 0.0, 0.2, 0.25):
        shift = position * (1 if sign == "" else -1) * (1 if carried == "nut" else -1)
        nut = 0.05 + shift  # relative to the screw
        growth = 12e-6 * (3.0 * (nut - bearing) + 2.0 * (nut**2 - bearing**2))  # of the nut along machine x
        expected = growth if side == "tool" else -growth
        assert full.structure.displacement({"x": position}, T) == pytest.approx([expected, 0.0, 0.0], abs=1e-15)
        assert full.structure.displacement(np.array([position]), T) == pytest.approx([expected, 0.0, 0.0], abs=1e-15)
    for pose, *rows in zip(full.thermal.poses, *(b.G for b in full.thermal.bodies), strict=True):
        by_rows = np.sum([G @ t for G, t in zip(rows, T, strict=True)], axis=0)
        assert by_rows == pytest.approx(full.structure.displacement(pose, T), abs=1e-18)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_screw_held_at_both_ends_keeps_its_length(tmp_path, direction):
    """u(xi) = int_0^xi a T - xi/L int_0^L a T: for T = 3 + 4 s it is a parabola that is zero at both bearings; a screw
    that is warm all along moves nothing."""
    full = model(
        tmp_path,
        SCREW.format(origin=-0.5 * direction, direction=direction, fixed="both"),
        AXIS.format(sign="", carried="nut"),
        film("all", "screw nut", 10.0),
        "[tcp.screws]\nscrew = 'tool'\n",
    )
    s = np.linspace(-0.5, 0.5, 11) * direction  # machine coordinate of the borders
    for T, expected in (
        (3.0 + 4.0 * s, lambda x: 12e-6 * 2.0 * (x**2 - 0.25)),
        (np.full(11, 7.0), lambda x: 0.0),
    ):
        states = [T, np.array([50.0])] if full.thermal.bodies[0].n == 11 else [np.array([50.0]), T]
        for position in (-0.25, 0.0, 0.2):
            moved = full.structure.displacement({"x": position}, states)
            assert moved == pytest.approx([expected(0.05 + position), 0.0, 0.0], abs=1e-15)


def test_integral_of_a_broken_line():
    nodes = np.array([0.0, 0.5, 2.0])
    assert integral(nodes, 0.25, 1.0) @ nodes == pytest.approx((1.0 - 0.0625) / 2)
    assert integral(nodes, 0.0, 2.0).sum() == pytest.approx(2.0)
    assert integral(nodes, 0.7, 0.7) @ np.ones(3) == 0.0


def test_a_bar_that_points_against_its_axis_is_the_same_machine(tmp_path):
    results = []
    for origin, direction, fixed in ((-0.5, 1.0, "start"), (0.5, -1.0, "end")):
        full = model(
            tmp_path,
            SCREW.format(origin=origin, direction=direction, fixed=fixed),
            AXIS.format(sign="", carried="nut"),
            film("all", "screw nut", 10.0),
            source("q", "nut"),
            "[sensors.s]\npart = 'screw'\nposition = [0.21, 0, 0]\n[tcp.screws]\nscrew = 'tool'\n",
        )
        rail = lumped_ports(load_machine(tmp_path)).rails[0]
        assert rail.stations == pytest.approx(np.linspace(-0.45, 0.45, 10))
        stepper = CoupledStepper(full.thermal)
        (*_, (_, x, _)) = stepper.run(drive_of(full, 1.0, 60.0, 9.0, x_position=0.12), stepper.uniform(20.0))
        results.append([*sensor_temperatures(full.thermal, x), *full.structure.displacement({"x": 0.12}, x)])
    assert results[0] == pytest.approx(results[1], rel=1e-12)
    assert results[0][0] > 20.5
    assert results[0][1] > 0


def test_warmer_air_above_warms_what_stands_higher(tmp_path):
    node = '[nodes.{name}]\ncapacity = "1 kJ/K"\narea = "1 m^2"\nposition = [0, 0, {z}]\n'
    text = node.format(name="low", z=0.5) + node.format(name="high", z=2.5)
    path = write(tmp_path, text, film("a", "low high", 8.0), rod(2), film("b", "rod", 8.0))
    path.write_text(
        path.read_text().replace("[environment.air]", '[environment.air]\ngradient = "1.5 K/m"\nheight = 1.0')
    )
    full = assemble(load_machine(path))
    x = CoupledStepper(full.thermal).steady_state(drive_of(full, 1.0, 60.0, 0.0), 0)
    assert x[0] == pytest.approx([-0.75], abs=1e-9)
    assert x[1] == pytest.approx([2.25], abs=1e-9)
    assert x[2][1] == pytest.approx(1.5 * (0.3 + 0.15 - 1.0), abs=1e-9)  # the rod stands upright: its middle


def test_a_node_between_air_and_coolant(tmp_path):
    full = model(
        tmp_path,
        '[nodes.a]\ncapacity = "1 kJ/K"\narea = "0.5 m^2"\n[environment.coolant]\ntemperature = "30 degC"\n',
        film("air", "a", 6.0),
        film("channel", "a", 400.0, "coolant", 'area = "0.02 m^2"'),
    )
    (x,) = CoupledStepper(full.thermal).steady_state(drive_of(full, 1.0, 60.0, 0.0), 0)
    assert x[0] == pytest.approx(10.0 * 8.0 / (8.0 + 3.0), rel=1e-9)


def test_mass_and_volume_of_a_material(tmp_path):
    a = '[nodes.a]\nmaterial = "steel"\nmass = "2 kg"\narea = 1\n'
    b = '[nodes.b]\nmaterial = "steel"\nvolume = "0.5 l"\narea = 1\n'
    full = model(tmp_path, a, b, film("air", "a b", 6.0))
    assert [float(b.energy[0]) for b in full.thermal.bodies] == pytest.approx([1000.0, 7800.0 * 0.5e-3 * 500.0])
