"""Laws that follow the machine's temperatures: tables, one step of lag, energy, and both steppers alike."""

from __future__ import annotations

from dataclasses import replace

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from synthetic import oblique

from tests.build import two_bodies
from twin.build.stepper import CoupledStepper
from twin.errors import ModelError
from twin.physics.laws import LAWS
from twin.physics.radiation import radiation_coefficient
from twin.rom.drive import evaluate
from twin.rom.following import DIFFERENCES, difference_place, read_table
from twin.rom.following_flags import following_flags
from twin.rom.law_values import law_table
from twin.rom.load_model import EnvironmentWiring, Film, LawUse, LoadModel, Signal, Source
from twin.rom.model import AffineBody, MachineModel
from twin.run.replay import integrate
from twin.run.stepping import inputs_of
from twin.run.system import prepare

pytestmark = pytest.mark.long

PLATE = LawUse("free_vertical_plate", {"height": 0.4}, {})
MIXED = LawUse("mixed_plate", {"length": 0.3, "height": 0.4}, {"speed": "speed"})
WINDING = LawUse("motor_winding", {"resistance": 1.2, "coefficient": 0.00393}, {"current": "current"})


def plate(films, sources=(), environments=(EnvironmentWiring("room", "air", 20.0),), heights=(0.0,)) -> MachineModel:
    """A thin plate of one node per height: 3 kg of aluminium and 0.5 m^2 each, linked by 1 W/K."""
    n = len(heights)
    link = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    link[0, 0] = link[-1, -1] = 1.0 if n > 1 else 0.0
    area = np.full(n, 0.5)
    load = LoadModel(
        signals=(
            Signal("air", "air", "degC", "value", 0.0, 50.0),
            Signal("speed", "speed", "m/s", "value", 0.0, 2.0),
            Signal("current", "current", "A", "rms", 0.0, 20.0),
        ),
        axes=(),
        environments=environments,
        sources=tuple(sources),
        films=tuple(films),
        joints=(),
        ports=(),
        rails=(),
        pairs=(),
    )
    terms = tuple(range(len(films)))
    body = AffineBody(
        name="plate",
        E=2700.0 * np.eye(n),
        A0=link,
        A=tuple(np.diag(area) for _ in terms),
        theta=terms,
        M=np.column_stack([area] * len(terms)),
        B=np.full((n, len(sources)), 1.0 / n),
        sources=tuple(range(len(sources))),
        P=np.zeros((n, 0)),
        ports=(),
        C=np.eye(n),
        sensors=tuple(range(n)),
        G=np.zeros((1, 3, n)),
        one=np.ones(n),
        energy=np.full(n, 2700.0),
        H=np.column_stack([area * np.array(heights)] * len(terms)),
    )
    return MachineModel("plate", (body,), load, 20.0, tuple(f"T{i}" for i in range(n)), (), (), (), np.zeros((1, 0)))


def history(model, hours, dt, start, air=20.0, current=0.0, speed=0.0, substeps=1):
    """Temperatures (n + 1, nodes) by the offline stepper, and the worst rest of a balance beside the largest flow."""
    time = np.arange(0.0, hours * 3600.0 + 1.0, 10.0)
    signals = {k: np.broadcast_to(v, time.shape) for k, v in (("air", air), ("speed", speed), ("current", current))}
    drive = evaluate(model.load_model, time, signals, dt)
    stepper = CoupledStepper(model)
    x, T, rest, largest = stepper.uniform(start), [], 0.0, 0.0
    for _, x, heat in stepper.run(drive, x, substeps):  # noqa: B020
        T.append(20.0 + x[0])
        rest = max(rest, abs(heat.power.sum() + heat.film.sum() - heat.stored))
        largest = max(largest, np.abs(heat.film).sum())
    return np.vstack([np.full(len(x[0]), start), T]), rest / largest


def free(surface, air):
    return float(LAWS["free_vertical_plate"].function(surface=surface, ambient=air, height=0.4))


def test_tables_are_read_to_a_thousandth():
    rng = np.random.default_rng(0)
    air = 21.0
    difference = np.concatenate([rng.uniform(-80.0, 80.0, 200), 10.0 ** rng.uniform(-2, 1, 100)])
    table = law_table(PLATE, {}, 1, {"surface": air + DIFFERENCES[None, :], "ambient": np.array([[air]])})[0]
    tables = np.tile(table[:, None, :], (len(difference), 1, 1))
    read = read_table(np, tables, difference_place(np, difference)[:, None])[:, 0]
    exact = np.array([free(air + d, air) for d in difference])
    error = np.abs(read / exact - 1.0)
    assert error[np.abs(difference) > 0.5].max() < 1e-3
    assert (error * np.abs(difference)).max() < 1e-3 * 80.0
    assert error.max() < 0.02  # where next to no heat flows


def test_the_mean_over_a_step_is_of_coefficients_and_not_of_speeds():
    model = plate([Film("plate", MIXED, 0, 1.0, 50.0)])
    time = np.arange(0.0, 600.0, 6.0)
    speed = np.where(np.arange(100) % 5 == 0, 1.5, 0.0)  # 20 % duty
    signals = {"air": np.full(100, 20.0), "speed": speed, "current": np.zeros(100)}
    drive = evaluate(model.load_model, time, signals, 60.0)
    k = 36
    law = LAWS["mixed_plate"].function
    surface = 20.0 + DIFFERENCES[k]
    exact = np.mean([float(law(speed=v, surface=surface, ambient=20.0, length=0.3, height=0.4)) for v in speed])
    assert drive.films.value[3, 0, k] == pytest.approx(exact, rel=1e-12)
    at_mean = float(law(speed=speed.mean(), surface=surface, ambient=20.0, length=0.3, height=0.4))
    assert abs(at_mean / exact - 1.0) > 0.05


def test_one_step_of_lag_is_of_first_order_and_small_beside_the_implicit_solution():
    """Cooling plate with free convection and radiation: lagged coefficients, fully implicit ones, the exact."""
    model = plate([Film("plate", PLATE, 0, 1.0, 50.0, emissivity=0.9)])

    def flow(T):
        return 0.5 * (free(T, 20.0) + float(radiation_coefficient(T, 20.0, 0.9))) * (T - 20.0)

    exact = solve_ivp(lambda _, y: [-flow(y[0]) / 2700.0], (0.0, 7200.0), [60.0], rtol=1e-10, atol=1e-10).y[0, -1]
    lagged, implicit = [], []
    for dt in (120.0, 60.0, 30.0):
        T = 60.0
        for _ in range(round(7200.0 / dt)):
            before = T
            T = brentq(lambda y: 2700.0 * (y - before) / dt + flow(y), 10.0, 70.0, xtol=1e-12)  # noqa: B023
        implicit.append(T - exact)
        lagged.append(history(model, 2.0, dt, 60.0)[0][-1, 0] - exact)
    lagged, implicit = np.array(lagged), np.array(implicit)
    assert np.abs(lagged[-1] - implicit[-1]) < 0.02  # K, of 40 K, at 30 s
    ratios = np.abs(np.diff(lagged))  # free of the tables' own error
    assert ratios[0] / ratios[1] == pytest.approx(2.0, rel=0.2)
    with_substeps = history(model, 2.0, 60.0, 60.0, substeps=4)[0][-1, 0] - exact
    assert with_substeps == pytest.approx(lagged[1], rel=0.1)  # films are read once per step, whatever the substeps


def test_a_winding_that_warms_makes_more_heat():
    """Steady state of P20 (1 + a (T - 20)) = h A (T - T_air), h constant: linear, hence exact."""
    still = LawUse("constant_film", {"natural": 12.0}, {})
    model = plate([Film("plate", still, 0, 1.0, 50.0)], [Source("motor", WINDING, 1.1, "", 0.0)])
    P20 = 1.1 * 3 * 1.2 * 6.0**2
    expected = (12.0 * 0.5 * 25.0 + P20 * (1 - 0.00393 * 20.0)) / (12.0 * 0.5 - P20 * 0.00393)
    T, worst = history(model, 8.0, 60.0, 25.0, air=25.0, current=6.0)
    assert T[-1, 0] == pytest.approx(expected, abs=1e-3)
    assert worst < 1e-10
    drive = evaluate(
        model.load_model,
        np.arange(0.0, 120.0, 10.0),
        {"air": np.full(12, 25.0), "speed": np.zeros(12), "current": np.full(12, 6.0)},
        60.0,
    )
    steady = CoupledStepper(model).steady_state(drive, 0)
    assert 20.0 + steady[0][0] == pytest.approx(expected, abs=1e-4)


def test_a_wall_that_is_warmer_than_the_air_makes_its_surface_warmer():
    """Radiant surroundings of their own temperature: the surface settles where both flows cancel."""
    still = LawUse("constant_film", {"natural": 4.0}, {})
    room = (EnvironmentWiring("room", "air", 20.0), EnvironmentWiring("walls", "", 35.0))
    model = plate([Film("plate", still, 0, 1.0, 50.0, emissivity=0.8, radiant=1)], environments=room)
    T, worst = history(model, 12.0, 60.0, 20.0, air=20.0)
    radiated = float(radiation_coefficient(T[-1, 0], 35.0, 0.8)) * (35.0 - T[-1, 0])
    assert radiated == pytest.approx(4.0 * (T[-1, 0] - 20.0), rel=1e-4)
    assert worst < 1e-10


def test_air_that_is_warmer_above():
    still = LawUse("constant_film", {"natural": 6.0}, {})
    room = (EnvironmentWiring("room", "air", 20.0, gradient=0.5, height=1.0),)
    model = plate([Film("plate", still, 0, 1.0, 50.0)], environments=room, heights=(0.0, 1.0, 3.0))
    model = replace(model, bodies=(replace(model.bodies[0], A0=np.zeros((3, 3))),))
    T, worst = history(model, 12.0, 60.0, 20.0, air=22.0)
    np.testing.assert_allclose(T[-1], [21.5, 22.0, 23.0], atol=1e-3)
    assert worst < 1e-10


def following_machine(cold: float = 3.0) -> MachineModel:
    """Two bodies with a moving contact; films and a motor that follow, radiation and a gradient."""
    model = two_bodies.model()
    films = (
        Film("bed", PLATE, 0, cold, 40.0, gain=1.2, emissivity=0.9),
        Film("slide", MIXED, 0, cold, 80.0, emissivity=0.5, radiant=1),
    )
    load = replace(
        model.load_model,
        films=films,
        sources=(replace(model.load_model.sources[0], use=WINDING), model.load_model.sources[1]),
        environments=(EnvironmentWiring("room", "air", 20.0, gradient=0.3), EnvironmentWiring("walls", "", 18.0)),
    )
    rng = np.random.default_rng(5)
    bodies = tuple(
        replace(b, H=np.column_stack([a @ rng.uniform(0.0, 2.0, b.n) if k < 2 else np.zeros(b.n)
                                      for k, a in zip(b.theta, b.A, strict=True)]))
        for b in model.bodies
    )  # fmt: skip
    return replace(model, load_model=load, bodies=bodies)


def loads(model, hours=2.0):
    time = np.arange(0.0, hours * 3600.0, 10.0)
    moving = (time // 1200).astype(int) % 2 == 0
    signals = {
        "x": np.where(moving, 0.2 * np.sin(time / 40.0), 0.1),
        "speed": np.where(moving, 0.3, 0.0),
        "current": np.where(moving, 6.0, 2.0),
        "air": 20.0 + time / 3600.0,
    }
    return evaluate(model.load_model, time, signals, 60.0)


@pytest.mark.parametrize("projection", ["galerkin", "oblique"])
@pytest.mark.parametrize(("follow", "tolerance"), [(0.0, 1e-9), (0.2, 2e-3)])
def test_both_steppers_alike_with_every_law_following(follow, tolerance, projection):
    model = following_machine()
    model = oblique(model) if projection == "oblique" else model
    drive = loads(model)
    assert drive.films.index == (0, 1)
    assert drive.losses.index == (0,)
    prepared = prepare(model)
    steps = integrate(prepared, inputs_of(model.load_model, drive, 4, follow=follow), prepared.uniform(19.0))
    stepper = CoupledStepper(model, follow=follow)
    x = stepper.uniform(19.0)
    states, films, powers, worst = [], [], [], 0.0
    for _, x, heat in stepper.run(drive, x, 4):  # noqa: B020
        states.append(np.concatenate(x))
        films.append(heat.film)
        powers.append(heat.power)
        worst = max(worst, heat.balance_error)
    assert worst < 1e-10
    assert np.ptp(states, axis=0).max() > 3.0
    np.testing.assert_allclose(prepared.to_artefact(steps.z), states, atol=tolerance)
    np.testing.assert_allclose(steps.film, films, atol=100 * tolerance)
    np.testing.assert_allclose(steps.power, powers, rtol=max(tolerance, 1e-9))
    into = 60.0 * (steps.power.sum(axis=1) + steps.film.sum(axis=1))
    through = 60.0 * (np.abs(steps.power).sum(axis=1) + np.abs(steps.film).sum(axis=1))
    assert (np.abs(steps.stored - into) / through).max() < 1e-9


def test_a_kept_factor_costs_no_accuracy():
    model = following_machine()
    drive = loads(model)

    def states(follow):
        stepper = CoupledStepper(model, follow=follow)
        return np.array([np.concatenate(x) for _, x, _ in stepper.run(drive, stepper.uniform(19.0), 4)])

    assert np.abs(states(0.2) - states(0.0)).max() < 3e-3  # K, of 10 K


def test_coefficients_outside_the_certificate_and_the_law_are_flagged():
    model = following_machine(cold=12.0)
    drive = loads(model)
    prepared = prepare(model)
    steps = integrate(prepared, inputs_of(model.load_model, drive, 4), prepared.uniform(19.0))
    flags = following_flags(
        model.load_model, drive, prepared.system.film_plan, steps.theta, steps.surface, steps.winding
    )
    assert flags["films.bed below 12 W/(m^2*K)"].any()
    assert not flags["films.bed above 40 W/(m^2*K)"].any()
    text = LAWS["free_vertical_plate"].validity.text
    assert not flags[f"films.bed: law outside {text}"].any()
    hot = replace(drive, films=replace(drive.films, outside=np.ones_like(drive.films.outside)))
    assert following_flags(model.load_model, hot, prepared.system.film_plan, steps.theta, steps.surface, steps.winding)[
        f"films.bed: law outside {text}"
    ].any()


def test_a_steady_state_is_found_where_plain_iteration_diverges():
    """A warm bearing: its loss falls so steeply with temperature that the map from state to state swings."""
    still = LawUse("constant_film", {"natural": 10.0}, {})
    oil = {"f0": 2.0, "viscosity_40": 68e-6, "viscosity_100": 9e-6, "diameter": 0.1, "f1": 2.5e-4, "load": 500.0}
    bearing = LawUse("bearing_friction_warm", oil, {"speed": "speed"})
    model = plate([Film("plate", still, 0, 1.0, 50.0)], [Source("bearing", bearing, 1.0, "", 0.0)])
    time = np.arange(0.0, 40 * 3600.0, 60.0)
    signals = {"air": np.full(len(time), 20.0), "speed": np.full(len(time), 100.0), "current": np.zeros(len(time))}
    drive = evaluate(model.load_model, time, signals, 60.0)
    stepper = CoupledStepper(model)
    *_, (_, x, _) = stepper.run(drive, stepper.uniform(20.0))
    assert 40.0 < 20.0 + x[0][0] < 120.0
    np.testing.assert_allclose(stepper.steady_state(drive, 0)[0], x[0], atol=1e-3)


def test_no_steady_state_is_told():
    from twin.build.fixed_point import fixed_point

    with pytest.raises(ModelError, match="no steady state within 30 turns"):
        fixed_point(lambda x: x + 1.0, np.zeros(3), lambda r: float(np.abs(r).max()), 1e-6, 30)


@pytest.mark.parametrize("wired", ["surface", "ambient"])
def test_a_measured_temperature_may_stand_in_for_a_state(wired):
    use = replace(PLATE, signals={wired: "measured"})
    both = (Film("plate", use, 0, 1.0, 50.0), Film("other", PLATE, 0, 1.0, 50.0))
    model = plate(both)
    time = np.arange(0.0, 1800.0, 10.0)
    measured = np.full(len(time), 45.0)
    signals = {"air": np.full(len(time), 20.0), "measured": measured, "current": 0 * time, "speed": 0 * time}
    drive = evaluate(model.load_model, time, signals, 60.0)
    prepared = prepare(model)
    steps = integrate(prepared, inputs_of(model.load_model, drive, 4), prepared.uniform(50.0))
    surface, ambient = (45.0, 20.0) if wired == "surface" else (50.0, 45.0)
    # the table lies around the environment's air, not around the measured one: coarse where the law has its kink
    assert steps.theta[0, 0] == pytest.approx(free(surface, ambient), rel=0.03)
    assert steps.theta[0, 1] == pytest.approx(free(50.0, 20.0), rel=2e-3)


@pytest.mark.parametrize(("start", "flagged"), [(60.0, False), (190.0, True), (500.0, True), (3000.0, True)])
def test_a_surface_beyond_the_table_is_flagged(start, flagged):
    model = plate([Film("plate", PLATE, 0, 1.0, 50.0)])
    time = np.arange(0.0, 600.0, 10.0)
    drive = evaluate(model.load_model, time, {"air": 0 * time + 20.0, "current": 0 * time, "speed": 0 * time}, 60.0)
    prepared = prepare(model)
    steps = integrate(prepared, inputs_of(model.load_model, drive, 4), prepared.uniform(start))
    flags = following_flags(
        model.load_model, drive, prepared.system.film_plan, steps.theta, steps.surface, steps.winding
    )
    (law,) = (flag for name, flag in flags.items() if "law outside" in name)
    assert law[0] == law.any() == flagged


def test_a_law_sees_the_air_at_the_height_of_its_surface():
    room = (EnvironmentWiring("room", "air", 20.0, gradient=2.0),)
    model = plate([Film("plate", PLATE, 0, 0.1, 50.0)], environments=room, heights=(3.0,))
    time = np.arange(0.0, 120.0, 10.0)
    drive = evaluate(model.load_model, time, {"air": 0 * time + 20.0, "current": 0 * time, "speed": 0 * time}, 60.0)
    stepper, prepared = CoupledStepper(model), prepare(model)
    assert stepper.loads(drive, 0, stepper.uniform(26.5)).theta[0] == pytest.approx(free(26.5, 26.0), rel=0.02)
    steps = integrate(prepared, inputs_of(model.load_model, drive, 4), prepared.uniform(26.5))
    assert steps.theta[0, 0] == pytest.approx(free(26.5, 26.0), rel=0.02)


def test_a_surface_as_warm_as_its_air_has_a_derivative():
    """The fourth root has none there; a run that starts in balance with the air must not make all derivatives NaN."""
    tables = jnp.asarray(5.0 + np.abs(DIFFERENCES) ** 0.25)[None]

    def heat(d: jax.Array) -> jax.Array:
        return d * read_table(jnp, tables, difference_place(jnp, d))

    slopes = [float(jax.jacfwd(heat)(jnp.array([d]))[0, 0]) for d in (0.0, 1e-15, -1e-9, 1e-6, 1e-3)]
    assert slopes == pytest.approx([5.0] * 5, abs=0.3)
    places = [float(difference_place(np, np.float64(d))) for d in (-1e-3, -1e-9, 0.0, 1e-9, 1e-3)]
    assert places == sorted(places)
    assert places[2] == 32.0


def test_values_that_hold_through_many_rows_make_the_same_tables():
    """A log at 100 times the rate whose values change as rarely: each is evaluated once."""
    film = Film("plate", MIXED, 0, 0, 0.0, 50.0)
    load = plate([film], [Source("motor", WINDING, 1.0, "", 0.5)]).load_model
    time, random = np.arange(0.0, 600.0, 7.0), np.random.default_rng(1)
    rare = {"air": 20.0 + random.standard_normal(len(time)), "speed": random.uniform(0.0, 2.0, len(time)),
            "current": random.uniform(0.0, 20.0, len(time))}  # fmt: skip
    often = np.arange(0.0, 602.0, 0.07)
    row = np.searchsorted(time, often + 1e-9, side="right") - 1
    few = evaluate(load, time, rare, 60.0, 9)
    many = evaluate(load, often, {name: v[row] for name, v in rare.items()}, 60.0, 9)
    for a, b in ((few.films, many.films), (few.losses, many.losses)):
        assert np.ptp(a.value) > 0.1
        assert b.value == pytest.approx(a.value, rel=1e-12)
        assert (b.outside == a.outside).all()
