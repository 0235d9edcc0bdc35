"""Compression in the rich space: `galerkin` (POD of coupled trajectories) or `balanced` (oblique, smaller, checked).

Both measure states in the norm of the limits: how far a state moves the stored heat, the sensors and the TCP, each in
units of the error the certificate allows. A plain energy norm spends its directions on heat that no output sees.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from twin.build.body_matrix import system_matrix
from twin.build.project import project
from twin.build.scenario import Scenario, theta_bounds
from twin.build.stepper import CoupledStepper, sensor_temperatures
from twin.build.workers import each
from twin.errors import ModelError
from twin.rom.model import AffineBody, MachineModel
from twin.rom.tableau import IMPLICIT_EULER


@dataclass(frozen=True)
class Tolerances:
    """The certificate's limits, used as units of error."""

    temperature: float  # K
    displacement: float  # m


# Snapshots need the shapes of fields, not the last per cent: coefficients may go far from those of a factor (what
# remains is stepped explicitly, with implicit Euler stable up to 1), which saves most factorisations.
TRAINING_FOLLOW, TRAINING_KEEP = 0.8, 4


def trajectories(
    rich: MachineModel, scenarios: Sequence[Scenario], progress: Callable[[Scenario], None] = lambda _: None
) -> list[np.ndarray]:
    """Snapshots per body (n_b, m) of the coupled rich model: every step and the final steady state.

    Each scenario is scaled until its warmest sensor changes by 1 K: the model is nearly linear in the loads, and a
    scenario that happens to be drawn mild must count as much as a violent one, since the certificate measures both so.
    """
    stepper = CoupledStepper(rich, keep=TRAINING_KEEP, follow=TRAINING_FOLLOW, tableau=IMPLICIT_EULER)
    columns = each(_snapshots, stepper, scenarios, progress)
    return [np.column_stack(body) for body in zip(*columns, strict=True)]


def _snapshots(stepper: CoupledStepper, scenario: Scenario) -> list[np.ndarray]:
    """Snapshots per body (n_b, steps + 1) of one scenario."""
    stepper.forget()
    drive = scenario.drive
    states = [x for _, x, _ in stepper.run(drive, stepper.uniform(scenario.start))]
    states.append(stepper.steady_state(drive, drive.n_steps - 1))
    response = np.array([sensor_temperatures(stepper.model, x) for x in states])
    size = max(float(np.ptp(response, axis=0).max(initial=0.0)), 1e-9) if response.size else 1.0
    return [np.column_stack(body) / size for body in zip(*states, strict=True)]


def _weight(body: AffineBody, unit: Tolerances) -> np.ndarray:
    """Gram matrix (n, n) of the norm of the limits for a dense body with E = 1."""
    W = body.E / (body.one @ body.energy) / unit.temperature**2
    W = W + body.C.T @ body.C / unit.temperature**2
    rows = body.G.reshape(-1, body.n)
    if rows.shape[0]:
        W = W + rows.T @ rows / (rows.shape[0] / 3) / unit.displacement**2
    return (W + W.T) / 2


def _without_mean(body: AffineBody, X: np.ndarray) -> np.ndarray:
    """X with the constant field (kept exactly anyway) removed, E-orthogonally."""
    total = body.one @ body.energy
    return X - np.outer(body.one, body.energy @ X) / total


def _share(values: list[np.ndarray], states: int) -> list[int]:
    """How many directions each body gets: the largest values of all bodies together; one per body is for the mean."""
    free = states - len(values)
    if free < len(values):
        raise ModelError(
            f"{states} states are too few for {len(values)} bodies", "--states", "ask for at least 20 per body"
        )
    every = np.sort(np.concatenate(values))[::-1]
    threshold = every[min(free, len(every)) - 1]
    return [int(np.sum(v >= threshold)) for v in values]


def galerkin(rich: MachineModel, snapshots: list[np.ndarray], states: int, unit: Tolerances) -> MachineModel:
    """Galerkin projection on the POD of the snapshots (Sirovich 1987), in the norm of the limits.

    Theorem: among all subspaces of its size the POD has the smallest summed squared projection error of the snapshots
    in that norm; the projection is orthogonal in E, so stability for all theta, g >= 0 and all positions is inherited
    (`twin.build.project`). states: of the whole machine, shared out by singular values.
    """
    modes, values = [], []
    for body, X in zip(rich.bodies, snapshots, strict=True):
        L = np.linalg.cholesky(_weight(body, unit))
        # there are many more snapshots than states, and their coefficients are not asked for
        (R,) = scipy.linalg.qr((L.T @ _without_mean(body, X)).T, mode="r", overwrite_a=True, check_finite=False)
        U, s, _ = np.linalg.svd(R[: X.shape[0]].T, full_matrices=False)
        modes.append(scipy.linalg.solve_triangular(L.T, U, lower=False))
        values.append(s / np.sqrt(X.shape[1]))
    bodies = []
    for body, V, r in zip(rich.bodies, modes, _share(values, states), strict=True):
        Q, _ = np.linalg.qr(np.column_stack([body.one, V[:, :r]]))  # rich E is the identity
        bodies.append(project(body, Q))
    return replace(rich, bodies=tuple(bodies))


PORT_WEIGHT = 1 / 30  # of a port's temperature beside a sensor's: as outputs of full weight ports crowd out the TCP


def balanced_directions(
    body: AffineBody,
    X: np.ndarray,
    unit: Tolerances,
    low: np.ndarray,
    high: np.ndarray,
    films: int,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Right and left directions (n, k) of a body by its snapshots X (n, m), the largest first, and how large they are.

    Of the observability Gramian, see `balanced`; the constant field is in neither.
    """
    rows = body.G.reshape(-1, body.n)
    output = np.vstack(
        [
            body.C / unit.temperature,
            rows / unit.displacement / np.sqrt(max(len(rows) / 3, 1)),
            PORT_WEIGHT * body.port_rows / unit.temperature,
        ]
    )
    Q = np.zeros((body.n, body.n))
    for _ in range(films):
        theta = low * (high / low) ** rng.random(len(low))
        rate, U = np.linalg.eigh(system_matrix(body, theta, 0.0))
        CU = output @ U
        # the slowest port-decoupled mode may be nearly adiabatic: contacts hold it in the machine
        rate = np.maximum(rate, 1e-6)
        Q += U @ ((CU.T @ CU) / (rate[:, None] + rate[None, :])) @ U.T / films
    eigenvalue, U = np.linalg.eigh((Q + Q.T) / 2)
    L = U * np.sqrt(np.maximum(eigenvalue, 0.0))
    X0, L0 = _without_mean(body, X) / np.sqrt(X.shape[1]), _without_mean(body, L)
    Us, s, Zt = np.linalg.svd(L0.T @ X0, full_matrices=False)
    use = s > 1e-10 * s[0]
    return X0 @ Zt[use].T / np.sqrt(s[use]), L0 @ Us[:, use] / np.sqrt(s[use]), s[use]


def balanced(
    rich: MachineModel, snapshots: list[np.ndarray], states: int, unit: Tolerances, films: int = 8, seed: int = 7
) -> MachineModel:
    """Oblique balanced POD (Rowley 2005; Willcox, Peraire 2002): trajectory covariance against observability Gramians.

    The Gramian Q solves A^T Q + Q A = C^T C for `films` Sobol-free random theta of the box and is averaged; outputs are
    sensors, TCP rows (in units of their limits) and ports. About half the states of `galerkin` at equal error, but
    without a stability theorem: `check_stability` must admit it.
    """
    low, high = theta_bounds(rich.load_model)
    rng = np.random.default_rng(seed)
    pairs = zip(rich.bodies, snapshots, strict=True)
    made = [balanced_directions(body, X, unit, low, high, films, rng) for body, X in pairs]
    right, left, values = (list(of_all) for of_all in zip(*made, strict=True))
    bodies = []
    for body, V, W, r in zip(rich.bodies, right, left, _share(values, states), strict=True):
        mean = body.one[:, None] / np.sqrt(body.one @ body.energy)
        bodies.append(project(body, np.column_stack([mean, V[:, :r]]), np.column_stack([mean, W[:, :r]])))
    model = replace(rich, bodies=tuple(bodies))
    check_stability(model)
    return model


def check_stability(model: MachineModel, samples: int = 128, seed: int = 11) -> float:
    """The smallest decay rate [1/s] of the coupled model over random theta, vertex theta and random contact states.

    Raises ModelError if any sample has a growing mode. A sample is no proof: only `galerkin` has one.
    """
    load = model.load_model
    low, high = theta_bounds(load)
    rng = np.random.default_rng(seed)
    offsets = np.cumsum([0, *(b.n for b in model.bodies)])
    n_ports = len(load.ports)
    P_in, P_out = np.zeros((offsets[-1], n_ports)), np.zeros((n_ports, offsets[-1]))
    for b, body in enumerate(model.bodies):
        here = slice(offsets[b], offsets[b + 1])
        P_in[here, list(body.ports)] = body.P
        P_out[list(body.ports), here] = body.port_rows
    slowest = np.inf
    for i in range(samples):
        u = rng.random(len(low))
        theta = low * (high / low) ** (np.round(u) if i % 2 else u)
        gamma = np.zeros((n_ports, n_ports))
        for pair in load.pairs:
            rail = load.rails[pair.rail]
            d = np.zeros(n_ports)
            d[pair.pad_port] = 1.0
            k, w = rng.integers(len(rail.stations) - 1), rng.random()
            d[rail.first_port + k : rail.first_port + k + 2] -= (1 - w, w)
            gamma += pair.conductance * pair.area * 10 ** rng.uniform(-2, 1) * np.outer(d, d)
        A = scipy.linalg.block_diag(*(system_matrix(b, theta, 0.0) for b in model.bodies)) + P_in @ gamma @ P_out
        slowest = min(slowest, float(np.linalg.eigvals(A).real.min()))
        if slowest <= 0:
            raise ModelError(
                f"the compact model grows at {-slowest:.2e} 1/s for sampled films and contacts",
                "--method balanced",
                "use --method galerkin (stable by construction), or other --states",
            )
    return slowest
