"""Both integrators, host and JAX, with each tableau: order, agreement, heat balance, derivative of the solve."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import synthetic
from dense_reference import Dense, gamma

from twin.build.stepper import CoupledStepper
from twin.rom.contact_matrix import (
    ContactPlaces,
    contact_entries,
    dense,
    entries_by_contact,
    product,
    projected,
    scaled,
)
from twin.rom.drive import evaluate
from twin.rom.tableau import IMPLICIT_EULER, SDIRK2, SDIRK2_6, stages
from twin.run.integrator import integrate, solved
from twin.run.replay import integrate as replayed
from twin.run.stepping import inputs_of
from twin.run.system import prepare

MODEL = synthetic.machine(n_bodies=3)
TIME, SIGNALS = synthetic.loads(MODEL.load_model, hours=1.0)
TABLEAUS = pytest.mark.parametrize("tableau", [IMPLICIT_EULER, SDIRK2, SDIRK2_6], ids=lambda t: t.name)


def on_host(model, drive, tableau, start, substeps=1, follow=0.0):
    """States (n_steps, N) and the largest relative error of a step's heat balance."""
    stepper = CoupledStepper(model, follow=follow, tableau=tableau)
    made = list(stepper.run(drive, stepper.uniform(start), substeps))
    return np.array([np.concatenate(x) for _, x, _ in made]), max(heat.balance_error for *_, heat in made)


def in_jax(model, drive, tableau, start, substeps=1, follow=0.0):
    """The same by the runtime."""
    prepared = prepare(model)
    inputs = inputs_of(model.load_model, drive, substeps, follow=follow, tableau=tableau)
    steps = replayed(prepared, inputs, prepared.uniform(start))
    into = np.diff(drive.time) * (steps.power.sum(axis=1) + steps.film.sum(axis=1))
    through = np.diff(drive.time) * (np.abs(steps.power).sum(axis=1) + np.abs(steps.film).sum(axis=1))
    return prepared.to_artefact(steps.z), (np.abs(steps.stored - into) / through).max()


@TABLEAUS
def test_rows_of_a_tableau_belong_together(tableau):
    """One diagonal entry for all stages, consistent weights, and the conditions of its order (Hairer, Wanner, IV.6)."""
    s = len(tableau.rows)
    a = np.array([np.pad(row, (0, s - len(row))) for row in tableau.rows])
    assert np.ptp(np.diag(a)) == 0.0
    b, c = np.array(tableau.weights), a.sum(axis=1)
    assert b.sum() == pytest.approx(1.0, rel=1e-15)
    assert (abs(b @ c - 0.5) < 1e-14) == (tableau.order >= 2)
    # L-stable: R(z) = 1 + z b (1 - z a)^-1 1 vanishes at infinity
    far = -1e9
    assert abs(1.0 + far * b @ np.linalg.solve(np.eye(s) - far * a, np.ones(s))) < 1e-8


def test_six_solves_err_least_as_the_mean_of_six_euler_steps():
    """The largest error of a step over all decays z >= 0, at six solves each (figures in `twin.rom.tableau`)."""
    z = np.concatenate([[0.0], np.logspace(-3, 6, 4001)])

    def worst(tableau, times):
        made = np.ones_like(z)
        for _ in range(times):  # x' = -z x: base plus nothing, divided by 1 + gamma z
            made, _ = stages(tableau, lambda b, _: (b / (tableau.diagonal * z / times + 1), b), lambda x: x, made, 0.0)
        return np.abs(made - np.exp(-z)).max()

    assert worst(SDIRK2_6, 1) < 0.0011
    assert worst(SDIRK2, 3) > 0.008
    assert worst(IMPLICIT_EULER, 6) > 0.04


@TABLEAUS
@pytest.mark.parametrize("integrated", [on_host, in_jax])
def test_order_of_convergence_against_the_exact_exponential(integrated, tableau):
    """Loads and positions constant, so that the scheme alone errs; the start-up of the fast modes is left behind."""
    signals = {name: np.repeat(values[300:301], 2) for name, values in SIGNALS.items()}
    time, errors = np.array([0.0, 960.0]), []
    for n in (64, 128, 256):
        drive = evaluate(MODEL.load_model, time, signals, 960.0 / n)
        reference = Dense(MODEL, drive)
        exact = reference.temperature(reference.exact(reference.uniform(15.0)))[-1]
        states, _ = integrated(MODEL, drive, tableau, 15.0)
        errors.append(np.abs(reference.temperature(states)[-1] - exact).max())
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    np.testing.assert_allclose(orders, tableau.order, atol=0.1)


@TABLEAUS
@pytest.mark.parametrize(
    ("substeps", "projection"),
    [
        (3, "oblique"),
        *(pytest.param(*more, marks=pytest.mark.slow) for more in ((1, "galerkin"), (1, "oblique"), (3, "galerkin"))),
    ],
)
@pytest.mark.long
def test_host_and_jax_give_the_same_states_and_close_the_heat_balance(tableau, projection, substeps):
    """Axes move; factors exact."""
    model = synthetic.oblique(MODEL) if projection == "oblique" else MODEL
    drive = evaluate(model.load_model, TIME, SIGNALS, 60.0)
    assert np.ptp(drive.position) > 0.1
    (host, host_error), (jitted, jax_error) = (
        integrated(model, drive, tableau, 23.0, substeps) for integrated in (on_host, in_jax)
    )
    temperature = Dense(model, drive).temperature
    np.testing.assert_allclose(temperature(jitted), temperature(host), rtol=1e-12)
    assert host_error < 1e-10
    assert jax_error < 1e-8  # of a step's throughput, the heat of which may be small beside what is stored


@TABLEAUS
@pytest.mark.parametrize("integrated", [on_host, in_jax])
def test_the_heat_balance_is_exact_with_a_factor_that_is_not(integrated, tableau):
    """Film coefficients that change by a tenth: the factor is kept, what it leaves out is counted where it was seen."""
    drive = evaluate(MODEL.load_model, TIME, SIGNALS, 60.0)
    still = {name: getattr(drive, name)[:1].repeat(drive.n_steps, axis=0)
             for name in ("weight", "square", "neighbour", "conductance")}  # fmt: skip
    drift = 1.0 + 0.1 * np.sin(np.arange(drive.n_steps))[:, None]
    drive = replace(drive, theta=drive.theta * drift, **still)
    kept, error = integrated(MODEL, drive, tableau, 23.0, follow=0.3)
    exact, _ = integrated(MODEL, drive, tableau, 23.0)
    assert error < 1e-8
    apart = np.abs(kept - exact).max()
    assert 0.0 < apart < 1e-2 * np.ptp(exact)


@pytest.mark.long
def test_the_second_order_method_needs_fewer_solves_for_the_same_error():
    """Smooth loads: one step of two stages errs less than two Euler steps."""
    signals = {name: np.repeat(values[300:301], 2) for name, values in SIGNALS.items()}
    drive = evaluate(MODEL.load_model, np.array([0.0, 3600.0]), signals, 60.0)
    reference = Dense(MODEL, drive)
    exact = reference.temperature(reference.exact(reference.uniform(15.0)))[-1]

    def error(tableau, substeps):
        states, _ = in_jax(MODEL, drive, tableau, 15.0, substeps)
        return np.abs(reference.temperature(states)[-1] - exact).max()

    assert error(SDIRK2, 1) < 0.2 * error(IMPLICIT_EULER, 2)


@TABLEAUS
def test_states_side_by_side_are_stepped_as_each_alone(tableau):
    """The rule takes (N,) and (N, k), and single precision stays single."""
    rng = np.random.default_rng(0)
    A = rng.standard_normal((5, 5))
    inverse = np.linalg.inv(np.eye(5) + A @ A.T).astype(np.float32)
    x, f = rng.standard_normal((2, 5, 3)).astype(np.float32)

    def after(x, f):
        def solve(right, near):
            return inverse @ right, near

        return stages(tableau, solve, lambda x: x, x, f)[0]

    together = after(x, f)
    assert together.dtype == np.float32
    for k in range(3):
        np.testing.assert_allclose(together[:, k], after(x[:, k], f[:, k]), rtol=1e-5)


@pytest.mark.long
@TABLEAUS
def test_the_derivative_of_a_step_is_that_of_its_matrix_and_loads(tableau):
    """Forward mode through steps whose factor is not differentiated, against differences."""
    rng = np.random.default_rng(1)
    A0, A1 = (jnp.asarray(B @ B.T) for B in rng.standard_normal((2, 4, 4)))
    z0, f = jnp.asarray(rng.standard_normal((2, 4)))
    rate = 1.0 / tableau.diagonal

    def after(u):
        S = rate * jnp.eye(4) + A0 + u * A1
        inverse = jnp.linalg.inv(jax.lax.stop_gradient(S))

        def solve(right, near):
            x = solved(
                lambda fixed, right, near: fixed[0] @ right, lambda fixed, d, x: d * (fixed[1] @ x),
                (inverse, A1), u, right, near,
            )  # fmt: skip
            return x, x

        return integrate(tableau, 3, solve, lambda z: rate * z, z0, (1.0 + u) * f)[0]

    h = 1e-4
    difference = (after(0.5 + h) - after(0.5 - h)) / (2 * h)
    np.testing.assert_allclose(jax.jacfwd(after)(0.5), difference, atol=1e-7)  # of 0.4


@pytest.mark.long
def test_every_form_of_gamma_is_that_of_its_definition():
    """Dense, as a product, projected, and the sum over contacts that are scaled apart."""
    load = MODEL.load_model
    drive = evaluate(load, TIME, SIGNALS, 60.0)
    places, whole, apart = ContactPlaces.of(load), contact_entries(load, drive), entries_by_contact(load, drive)
    rng, step = np.random.default_rng(2), 20
    T, P = rng.standard_normal((places.n_ports, 2)), rng.standard_normal((6, places.n_ports))
    wanted = gamma(MODEL, drive, step)
    top = np.abs(wanted).max()
    ones = np.ones(places.n_contacts)
    for xp in (np, jnp):
        np.testing.assert_allclose(dense(xp, places, whole.at(step)), wanted, atol=1e-12 * top)
        np.testing.assert_allclose(product(xp, places, whole.at(step), T), wanted @ T, atol=1e-11 * top)
        together = scaled(xp, places, apart.at(step), ones)
        np.testing.assert_allclose(dense(xp, places, together), wanted, atol=1e-12 * top)
        each = projected(xp, places, apart.at(step), P)
        np.testing.assert_allclose(each.sum(axis=0), P @ wanted @ P.T, atol=1e-10 * top)
    one = ones * (np.arange(places.n_contacts) == 1)
    alone = replace(drive, conductance=drive.conductance * (np.array(places.contact_of_pair) == 1))
    np.testing.assert_allclose(
        dense(np, places, scaled(np, places, apart.at(step), one)), gamma(MODEL, alone, step), atol=1e-12 * top
    )
