"""A fitted Galerkin basis: its gradient is that of the error, and the error is smaller; stable by its form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from twin.build.compress import Tolerances, galerkin
from twin.build.fitted_basis import Fit, fitted_galerkin, mixed_directions
from twin.build.frequency_training import drawn_films, responses
from twin.build.scenario import theta_bounds
from twin.rom.load_model import EnvironmentWiring, Film, LawUse, LoadModel, Signal
from twin.rom.model import AffineBody, MachineModel

UNIT = Tolerances(1.0, 1.0)
ROWS, COLUMNS, STATES = 6, 14, 10
OMEGA = np.r_[0.0, np.logspace(-6, 2, 20)]  # rad/s


def plate() -> MachineModel:
    """Cells of a plate, 40 J/K each, 0.5 W/K to each neighbour, films on three edges, differences across as outputs."""
    number = np.arange(ROWS * COLUMNS).reshape(ROWS, COLUMNS)
    n = number.size
    A0 = np.zeros((n, n))
    for a, b in zip(
        [*number[:, :-1].ravel(), *number[:-1].ravel()], [*number[:, 1:].ravel(), *number[1:].ravel()], strict=True
    ):
        d = np.zeros(n)
        d[a], d[b] = 1.0, -1.0
        A0 += 0.5 * np.outer(d, d)
    edges = (number[:, 0], number[:, -1], number[0])
    A = tuple(sp.diags(np.isin(np.arange(n), edge) * 0.01).toarray() for edge in edges)
    C = np.zeros((3, n))
    for row, (a, b) in zip(C, ((3, 60), (30, 41), (70, 13)), strict=True):
        row[a], row[b] = 1.0, -1.0
    B = np.zeros((n, 1))
    B[35] = 1.0
    scale = 40.0**-0.5  # coordinates with E = 1
    one = np.full(n, 1.0 / scale)
    body = AffineBody(
        name="plate", E=np.eye(n), A0=scale**2 * A0, A=tuple(scale**2 * a for a in A), theta=(0, 1, 2),
        M=np.column_stack([scale**2 * a @ one for a in A]), B=scale * B, sources=(0,), P=np.zeros((n, 0)), ports=(),
        C=scale * C, sensors=(0, 1, 2), G=np.zeros((1, 3, n)), one=one, energy=one,
    )  # fmt: skip
    air = Signal("air", "air", "degC", "value", 10.0, 40.0)
    films = tuple(Film(f"f{k}", LawUse("constant_film", {"natural": 2.0}, {}), 0, 2.0, 40.0) for k in range(3))
    load = LoadModel(
        signals=(air,), axes=(), environments=(EnvironmentWiring("air", "air", 20.0),), sources=(), films=films,
        joints=(), ports=(), rails=(), pairs=(),
    )  # fmt: skip
    return MachineModel("plate", (body,), load, 20.0, ("a", "b", "c"), (), (), (), np.zeros((1, 0)))


@pytest.fixture(scope="module")
def machine():
    return plate()


def films_of(machine: MachineModel, count: int, seed: int) -> list[np.ndarray]:
    return drawn_films(*theta_bounds(machine.load_model), count, seed)


@pytest.mark.parametrize("heat", [0.0, 0.3])
@pytest.mark.parametrize("power", [1, 4])
def test_the_gradient_is_that_of_the_error(machine, power, heat):
    films = films_of(machine, 3, 1)
    fit = Fit(machine.bodies[0], np.array(films), OMEGA[[0, *range(6, 13)]], heat)
    x = fit.parameters(mixed_directions(machine, [responses(machine.bodies[0], films, heat)], STATES, UNIT))
    rng = np.random.default_rng(4)
    for _ in range(3):
        step = rng.standard_normal(x.size)
        step *= 1e-5 * np.linalg.norm(x) / np.linalg.norm(step)
        change = (fit.loss(x + step, power)[0] - fit.loss(x - step, power)[0]) / 2.0
        assert change == pytest.approx(fit.loss(x, power)[1] @ step, rel=1e-4, abs=1e-9)


def transfer(body: AffineBody, theta: np.ndarray) -> np.ndarray:
    """(n_omega, 3, 4) by solving at each frequency."""
    S = body.A0 + np.tensordot(theta, np.array(body.A), axes=1)
    inputs = np.column_stack([body.M * theta, 0.3 * body.B])
    return np.array([body.C @ np.linalg.solve(S + 1j * w * body.E, inputs) for w in OMEGA])


def error(reduced: AffineBody, body: AffineBody, films: list[np.ndarray]) -> float:
    """The largest singular value of the error, over that of the transfer function, at the worst of the films."""
    pairs = [(transfer(body, theta), transfer(reduced, theta)) for theta in films]
    largest = [[np.linalg.norm(X, 2, axis=(1, 2)).max() for X in (H, H_r - H)] for H, H_r in pairs]
    return max(off / size for size, off in largest)


@pytest.mark.long
def test_it_has_a_fraction_of_the_error_of_modes_chosen_by_what_they_capture(machine):
    (body,), films = machine.bodies, films_of(machine, 8, 2)
    snapshots = [responses(body, films, 0.3)]
    fitted = fitted_galerkin(machine, snapshots, STATES, UNIT, films, 0.3).bodies[0]
    plain = galerkin(machine, snapshots, STATES, UNIT).bodies[0]
    assert error(fitted, body, films_of(machine, 6, 3)) < 0.75 * error(plain, body, films_of(machine, 6, 3))
    assert fitted.n == plain.n == STATES
    for X in (fitted.A0, *fitted.A):
        assert np.array_equal(X, X.T)
        assert np.linalg.eigvalsh(X).min() > -1e-12 * np.abs(X).max()
    assert fitted.A0 @ fitted.one == pytest.approx(0.0, abs=1e-10)  # a uniform temperature is kept
    assert fitted.energy @ fitted.one == pytest.approx(body.energy @ body.one)


def test_the_default_stays_where_the_basis_is_no_better(machine):
    """As many states as the body has: nothing is left to fit."""
    n = machine.bodies[0].n
    films = films_of(machine, 8, 2)
    whole = replace(machine, bodies=(replace(machine.bodies[0], V=np.eye(n)),))
    made = fitted_galerkin(whole, [responses(machine.bodies[0], films)], n, UNIT, films)
    assert Fit(machine.bodies[0], np.array(films), OMEGA, 0.0).largest(np.asarray(made.bodies[0].V)) < 1e-6
