"""The compiled step against plain NumPy, the exact exponential and the heat balance."""

from dataclasses import replace

import jax
import numpy as np
import pytest
import synthetic
from dense_reference import Dense, gamma

from twin.rom.contact import station_weights
from twin.rom.drive import evaluate
from twin.rom.load_model import EnvironmentWiring
from twin.rom.tableau import IMPLICIT_EULER, SDIRK2_6
from twin.run.matrix import couplings_of, diagonal_blocks
from twin.run.replay import integrate
from twin.run.stepping import advance, inputs_of
from twin.run.system import prepare

MODEL = synthetic.machine(n_bodies=4)
TIME, SIGNALS = synthetic.loads(MODEL.load_model, hours=1.5)
DRIVE = evaluate(MODEL.load_model, TIME, SIGNALS, 60.0)
VARIANTS = {"galerkin": MODEL, "oblique": synthetic.oblique(MODEL)}


@pytest.fixture(params=VARIANTS)
def model(request):
    return VARIANTS[request.param]


def test_gamma_is_the_mean_of_d_dT_along_the_path():
    """Brute force: many samples of one step, g d d^T of every pad, d = pad minus weighted segments."""
    load, step = MODEL.load_model, 7
    fine = 60.0 * step + (np.arange(20000) + 0.5) * 60.0 / 20000
    expected = np.zeros((len(load.ports), len(load.ports)))
    for pair in load.pairs:
        rail, axis = load.rails[pair.rail], load.axes[pair.axis]
        position = np.interp(fine, TIME, SIGNALS[axis.position])
        s = pair.station - position if pair.rail_moves else pair.station + position
        i, right = station_weights(np.asarray(rail.stations), s)
        d = np.zeros((len(fine), len(load.ports)))
        d[np.arange(len(fine)), rail.first_port + i] = -(1.0 - right)
        d[np.arange(len(fine)), rail.first_port + i + 1] -= right
        d[:, pair.pad_port] = 1.0
        expected += pair.conductance * pair.area * d.T @ d / len(fine)
    assert DRIVE.weight[step].max(axis=1).min() < 1.0  # axes do move in this step
    np.testing.assert_allclose(gamma(MODEL, DRIVE, step), expected, atol=1e-6 * expected.max())


def test_system_matrix_equals_the_dense_one(model):
    """Blocks in coordinates with E = 1 against E^-1 A, compared through their action."""
    prepared, dense = prepare(model), Dense(model, DRIVE)
    inputs = inputs_of(model.load_model, DRIVE, 4, follow=0.0)
    one_step = jax.tree.map(lambda a: a[9], inputs)
    layout, system = prepared.layout, prepared.system
    blocks = {key: U @ V for key, (U, V) in couplings_of(layout, system, one_step.contacts).items()}
    diagonal = diagonal_blocks(layout, system, one_step.rate, one_step.contacts, one_step.theta)
    blocks |= {(b, b): block for b, block in enumerate(diagonal)}
    offsets = prepared.layout.offsets
    S = np.zeros((model.n, model.n))
    for (i, j), block in blocks.items():
        S[offsets[i] : offsets[i + 1], offsets[j] : offsets[j + 1]] = block
    x = np.random.default_rng(0).standard_normal(model.n)
    z = prepared.from_artefact(x)
    expected = np.linalg.solve(dense.E, dense.A(9) @ x) + 4 / 60.0 / SDIRK2_6.diagonal * x
    np.testing.assert_allclose(prepared.to_artefact(S @ z), expected, rtol=1e-11, atol=1e-12 * np.abs(expected).max())


@pytest.mark.long
@pytest.mark.parametrize("substeps", [1, pytest.param(4, marks=pytest.mark.long)])
def test_steps_equal_plain_numpy(model, substeps):
    prepared, dense = prepare(model), Dense(model, DRIVE)
    start = prepared.uniform(23.0)
    steps = integrate(prepared, inputs_of(model.load_model, DRIVE, substeps), start)
    expected = dense.runge_kutta(dense.uniform(23.0), substeps)
    states = prepared.to_artefact(np.concatenate([start[None], steps.z]))
    for ours, theirs in (
        (dense.temperature(states), dense.temperature(expected)),
        (dense.tcp(states), dense.tcp(expected)),
    ):
        assert np.abs(ours - theirs).max() <= 1e-12 * np.abs(theirs).max()


def test_first_order_against_the_exact_exponential():
    """Loads and positions constant, so that the scheme alone errs."""
    time = np.array([0.0, 960.0])
    signals = {name: np.repeat(values[300:301], 2) for name, values in SIGNALS.items()}
    errors = []
    for n in (32, 64):
        drive = evaluate(MODEL.load_model, time, signals, 960.0 / n)
        prepared, dense = prepare(MODEL), Dense(MODEL, drive)
        steps = integrate(
            prepared, inputs_of(MODEL.load_model, drive, 1, tableau=IMPLICIT_EULER), prepared.uniform(15.0)
        )
        exact = dense.temperature(dense.exact(dense.uniform(15.0)))[1:]
        error = np.abs(dense.temperature(prepared.to_artefact(steps.z)) - exact)
        errors.append(error[n // 32 - 1 :: n // 32].max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(1.0, abs=0.1)


@pytest.mark.long
def test_four_substeps_with_one_factor_are_three_to_four_times_closer():
    """Four for smooth loads; less here, where pads that move from step to step excite fast modes."""
    drive = evaluate(MODEL.load_model, TIME, SIGNALS, 60.0)
    prepared, dense = prepare(MODEL), Dense(MODEL, drive)
    exact = dense.temperature(dense.exact(dense.uniform(20.0)))[1:]

    def error(substeps):
        inputs = inputs_of(MODEL.load_model, drive, substeps, tableau=IMPLICIT_EULER)
        steps = integrate(prepared, inputs, prepared.uniform(20.0))
        return np.abs(dense.temperature(prepared.to_artefact(steps.z)) - exact).max()

    assert 3.0 < error(1) / error(4) < 4.1


@pytest.mark.long
def test_heat_in_is_heat_stored_at_every_position(model):
    prepared = prepare(model)
    steps = integrate(prepared, inputs_of(model.load_model, DRIVE, 4, follow=0.0), prepared.uniform(20.0))
    into = 60.0 * (DRIVE.power.sum(axis=1) + steps.film.sum(axis=1))
    throughput = 60.0 * (DRIVE.power.sum(axis=1) + np.abs(steps.film).sum(axis=1))
    assert throughput.min() > 0.0
    assert np.abs(steps.stored - into).max() <= 1e-11 * throughput.max()
    assert (np.abs(steps.stored - into) / throughput).max() <= 1e-8
    # and the stored heat is that of the temperatures, by the rows of the artefact
    dense = Dense(model, DRIVE)
    total = dense.energy @ (prepared.to_artefact(steps.z[-1]) - dense.uniform(20.0))
    assert steps.stored.sum() == pytest.approx(total, rel=1e-10)


@pytest.mark.long
def test_a_machine_at_the_temperature_of_its_surroundings_stays_there(model):
    air = (EnvironmentWiring("hall", "ambient", 20.0), EnvironmentWiring("pit", "", 26.0))
    load = replace(model.load_model, environments=air)
    model = replace(model, load_model=load)
    still = {name: np.zeros_like(values) for name, values in SIGNALS.items()} | {"ambient": np.full(len(TIME), 26.0)}
    still |= {axis.position: SIGNALS[axis.position] for axis in load.axes}
    drive = evaluate(load, TIME, still, 60.0)
    prepared, dense = prepare(model), Dense(model, drive)
    steps = integrate(prepared, inputs_of(load, drive, 4, follow=0.0), prepared.uniform(26.0))
    np.testing.assert_allclose(dense.temperature(prepared.to_artefact(steps.z)), 26.0, atol=1e-10)


@pytest.mark.long
def test_a_kept_factor_equals_factorising_every_step(model):
    prepared = prepare(model)
    inputs = inputs_of(model.load_model, DRIVE, 4, follow=0.0)
    assert 0 < inputs.changed.sum() < DRIVE.n_steps  # axes rest for some steps
    kept = advance(prepared.layout, prepared.system, prepared.uniform(20.0), inputs)
    always = advance(
        prepared.layout, prepared.system, prepared.uniform(20.0), replace(inputs, changed=np.ones(DRIVE.n_steps, bool))
    )
    for a, b in zip(jax.tree.leaves(kept), jax.tree.leaves(always), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("what", ["conductance", "weight", "time"])
def test_the_factor_is_renewed_when_the_matrix_changes(what):
    still = {name: np.repeat(values[:1], len(TIME)) for name, values in SIGNALS.items()}
    drive = evaluate(MODEL.load_model, TIME, still, 60.0)
    assert np.flatnonzero(inputs_of(MODEL.load_model, drive, 4).changed).tolist() == [0]
    values = getattr(drive, what).copy()
    if what == "time":
        values[31:] += 30.0
    else:
        values[30] *= 1.1
    changed = np.flatnonzero(inputs_of(MODEL.load_model, replace(drive, **{what: values}), 4).changed)
    assert changed.tolist() == [0, 30, 31]


@pytest.mark.long
def test_bodies_in_any_order_and_without_contacts():
    """Elimination and contacts do not depend on the order of bodies; a machine may have one body only."""
    swapped = replace(MODEL, bodies=tuple(MODEL.bodies[i] for i in (2, 0, 3, 1)))
    temperatures = []
    for model in (MODEL, swapped):
        prepared, dense = prepare(model), Dense(model, DRIVE)
        steps = integrate(prepared, inputs_of(model.load_model, DRIVE, 4, follow=0.0), prepared.uniform(20.0))
        temperatures.append(dense.temperature(prepared.to_artefact(steps.z)))
    np.testing.assert_allclose(temperatures[1], temperatures[0], rtol=1e-12)
    alone = synthetic.machine(n_bodies=1)
    time, signals = synthetic.loads(alone.load_model)
    drive = evaluate(alone.load_model, time, signals, 60.0)
    prepared, dense = prepare(alone), Dense(alone, drive)
    steps = integrate(prepared, inputs_of(alone.load_model, drive, 4, follow=0.0), prepared.uniform(10.0))
    expected = dense.runge_kutta(dense.uniform(10.0), 4)[1:]
    np.testing.assert_allclose(
        dense.temperature(prepared.to_artefact(steps.z)), dense.temperature(expected), rtol=1e-12
    )
