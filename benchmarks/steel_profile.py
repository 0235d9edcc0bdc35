"""Reduction order on a parametric steel profile: transfer function error per state, over all frequencies and films."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy.linalg
import scipy.sparse.linalg

from benchmarks.shared_space import products
from benchmarks.steel_profile_model import profile
from twin.build.body_matrix import system_matrix
from twin.build.compress import Tolerances, balanced, galerkin
from twin.build.fitted_basis import fitted_galerkin
from twin.build.frequency_training import drawn_films, responses
from twin.build.project import project
from twin.build.rich_basis import RichOptions, rich_basis
from twin.build.scenario import theta_bounds
from twin.rom.model import AffineBody, MachineModel

# A tight basis: to the decay of the finest element (2 mm: 7e-6 m2/s / h^2 is 2 1/s) and well beyond.
TIGHT = RichOptions(samples=24, shift_high=100.0, tolerance=3e-5)
OMEGA = np.r_[0.0, np.logspace(-6, 2, 33)]  # rad/s
UNIT = Tolerances(1.0, 1.0)
STATES = (20, 28, 40, 56)
TRAINING, HELD_OUT = 24, 20
FRESH = 404  # seed of the held-out films: how snapshots are weighted was chosen on others
ROUNDING = 1e-10  # of the norm of a matrix: eigenvalues of insulated bodies are zero to 1e-15 of it
# Films beyond their upper bounds that growing modes are looked for at: multiples, and patterns of what films have.
BEYOND, PATTERNS = np.logspace(0, 4, 21), 100


def transfer(body: AffineBody, theta: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """H(i omega) (n_omega, 6, 7): temperature differences per kelvin of each outer temperature."""
    S, B = system_matrix(body, theta, 0.0), body.M * theta[list(body.theta)]
    if not isinstance(S, np.ndarray):
        sparse = [scipy.sparse.linalg.splu((S + 1j * w * body.E).tocsc()).solve(B.astype(complex)) for w in omega]
        return np.array([body.C @ X for X in sparse])
    if body.symmetric:  # E = 1
        rate, U = np.linalg.eigh(S)
        return (body.C @ U / (rate + 1j * omega[:, None])[:, None]) @ (U.T @ B)
    return np.array([body.C @ np.linalg.solve(S + 1j * w * body.E, B) for w in omega])


def largest(H: np.ndarray) -> float:
    """The largest singular value over all frequencies."""
    return float(np.linalg.norm(H, 2, axis=(1, 2)).max())


def hankel(body: AffineBody, theta: np.ndarray) -> np.ndarray:
    """Hankel singular values at one theta: no model of r states is off by less than value r (counted from 0) there.

    Adamjan, Arov, Krein 1971; Glover, Int. J. Control 39, 1984. Symmetric body: both Gramians by its eigenvectors.
    """
    rate, U = np.linalg.eigh(system_matrix(body, theta, 0.0))
    roots = []
    for X in (U.T @ (body.M * theta[list(body.theta)]), U.T @ body.C.T):
        value, W = np.linalg.eigh((X @ X.T) / (rate[:, None] + rate[None, :]))
        roots.append(W * np.sqrt(np.maximum(value, 0.0)))
    return np.linalg.svd(roots[1].T @ roots[0], compute_uv=False)


def grows(body: AffineBody, high: np.ndarray) -> tuple[float, np.ndarray] | None:
    """The smallest of the multiples BEYOND of the upper bounds of films, below which random films from 0 up make a
    mode of a reduced model grow, and these films (n_films,) [W/(m^2 K)]; None where none of those tried does.

    One growing mode is a proof that a model is not stable for every film coefficient >= 0; none is no proof.
    """
    shares = np.random.default_rng(31).random((PATTERNS, len(high)))
    shares[::2] = np.round(shares[::2])  # half of the patterns at the bounds: nothing, or all
    A0, A = np.linalg.solve(body.E, body.A0), np.linalg.solve(body.E, np.array(body.A))
    for multiple in BEYOND:
        thetas = multiple * high * shares
        S = A0 + np.tensordot(thetas[:, list(body.theta)], A, axes=1)
        rate, size = np.linalg.eigvals(S).real.min(axis=1), np.linalg.norm(S, axis=(1, 2))
        worst = int((rate / size).argmin())
        if rate[worst] < -ROUNDING * size[worst]:
            return float(multiple), thetas[worst]
    return None


def training(model: MachineModel) -> list[np.ndarray]:
    """The films that snapshots are made at, and matrices fitted at."""
    return drawn_films(*theta_bounds(model.load_model), TRAINING, 5)


Method = Callable[..., MachineModel]  # (rich, snapshots, states, unit) -> reduced


def fitted(rich: MachineModel, snapshots: list[np.ndarray], states: int, unit: Tolerances) -> MachineModel:
    """As `twin import` makes a model of few states."""
    return fitted_galerkin(rich, snapshots, states, unit, training(rich))


METHODS: dict[str, Method] = {"galerkin": galerkin, "fitted": fitted, "balanced": balanced}


def errors(
    refinements: int, methods: dict[str, Method], states: tuple[int, ...]
) -> tuple[int, int, dict[tuple[str, int], float]]:
    """Nodes, rich states, and the worst relative error over held-out films by (method, states).

    Beside the methods: ``rich``; ``bound``, below which no linear model of so many states is at all of the films; and
    ``one space`` and ``two spaces`` (`benchmarks.shared_space`), as shares of the largest transfer function.
    Prints where each reduced model grows.
    """
    machine = profile(refinements)
    full, (low, high) = machine.bodies[0], theta_bounds(machine.load_model)
    rich_body = project(full, rich_basis(full, low, high, TIGHT))
    rich: MachineModel = replace(machine, bodies=(rich_body,))
    snapshots = [responses(rich_body, training(rich))]
    films = drawn_films(low, high, HELD_OUT, FRESH)
    exact = [transfer(full, theta, OMEGA) for theta in films]

    def worst(body: AffineBody) -> float:
        return max(largest(transfer(body, t, OMEGA) - H) / largest(H) for t, H in zip(films, exact, strict=True))

    found = {("rich", rich_body.n): worst(rich_body)}
    values = [hankel(rich_body, t) / largest(H) for t, H in zip(films, exact, strict=True)]
    for count in states:
        for name, method in methods.items():
            reduced = method(rich, snapshots, count, UNIT).bodies[0]
            found[name, count] = worst(reduced)
            if (growing := grows(reduced, high)) is not None:
                multiple, theta = growing
                print(f"   {full.n} nodes, {name}, {count} states: no stable model at {multiple:.0f} times the largest "
                      f"films, at {', '.join(f'{t:.0f}' for t in theta)} W/(m2 K)")  # fmt: skip
        found["bound", count] = max(float(v[count]) for v in values)
    size = max(map(largest, exact))
    for count, (one, two) in products(rich_body, films, low, states).items():
        found["one space", count], found["two spaces", count] = one / size, two / size
    return full.n, rich_body.n, found


def table(methods: dict[str, Method], states: tuple[int, ...]) -> None:
    for refinements in (2, 3):
        n, rich, found = errors(refinements, methods, states)
        print(f"   {n} nodes; {rich} rich states, off by {found['rich', rich]:.1e}")
        columns = (*methods, "bound", "one space", "two spaces")
        print("   states   " + "   ".join(f"{name:>10}" for name in columns))
        for count in states:
            row = (found[name, count] for name in columns)
            print(f"   {count:6d}   " + "   ".join(f"{value:10.1e}" for value in row), flush=True)
    print("   bound: no linear model of so many states is better at the worst of the films (Hankel singular value)")
    print("   one space: product of the residuals of inputs and outputs that no projection with one space is below")
    print("   two spaces: that of the best space of either")


def main() -> None:
    table(METHODS, STATES)
