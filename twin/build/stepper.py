"""Implicit Euler for coupled bodies, full (sparse) or rich (dense): one factor per body, contacts by Schur complement.

    (E/h + A(theta) + P Gamma P^T) x_new = E x/h + M theta (T_amb - T_ref) + B q + P q_port

Paper 000 eqs (4)-(6) with the films implicit (erratum E-000-3: the lagged form is stable only for dt < 2 rho c d/h).
The axis position changes Gamma only, so a moving axis costs no factorisation: with S = E/h + A(theta) per body,
X = S^-1 P and Q = P^T X, the port temperatures solve (1 + Q Gamma) t = P^T S^-1 r, and x_new = S^-1 r - X Gamma t.
Assembling and factorising the coupled matrix at every position was rejected: 720 steps would be 720 factorisations.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.linalg
import scipy.sparse

from twin.build.factorize import factorize
from twin.rom.drive import Drive
from twin.rom.model import AffineBody, MachineModel, Matrix


def contact_matrix(model: MachineModel, drive: Drive, step: int) -> np.ndarray:
    """Gamma (n_ports, n_ports) W/K of one step: q_port = -Gamma T_port; symmetric, rows sum to zero."""
    load = model.load_model
    gamma = np.zeros((len(load.ports), len(load.ports)))
    for k, pair in enumerate(load.pairs):
        rail = load.rails[pair.rail]
        n = len(rail.stations)
        ports = slice(rail.first_port, rail.first_port + n)
        g = drive.conductance[step, k]
        w = drive.weight[step, k, :n]
        side = drive.neighbour[step, k, : n - 1]
        gamma[pair.pad_port, pair.pad_port] += g
        gamma[pair.pad_port, ports] -= g * w
        gamma[ports, pair.pad_port] -= g * w
        gamma[ports, ports] += g * (np.diag(drive.square[step, k, :n]) + np.diag(side, 1) + np.diag(side, -1))
    return gamma


@dataclass
class _Factored:
    solve: Callable[[np.ndarray], np.ndarray]
    X: np.ndarray  # (n, n_ports_b) S^-1 P
    Q: np.ndarray  # (n_ports_b, n_ports_b)


def system_matrix(body: AffineBody, theta: np.ndarray, rate: float) -> Matrix:
    """rate E + A0 + sum_k theta_k A_k with rate = 1/h [1/s] (0: steady state)."""
    S = body.A0 + rate * body.E
    for k, a in zip(body.theta, body.A, strict=True):
        S = S + theta[k] * a
    return S


class CoupledStepper:
    """Steps a MachineModel whose bodies are sparse (full) or dense (rich); keeps the last factors per body."""

    def __init__(self, model: MachineModel, keep: int = 2):
        self.model = model
        self._cache: tuple[OrderedDict, ...] = tuple(OrderedDict() for _ in model.bodies)
        self._keep = keep

    def _factor(self, b: int, theta: np.ndarray, rate: float) -> _Factored:
        body, cache = self.model.bodies[b], self._cache[b]
        key = (rate, *theta[list(body.theta)])
        if key in cache:
            cache.move_to_end(key)
            return cache[key]
        while len(cache) >= self._keep:  # free first: two factors of a large body need not fit beside a third
            cache.popitem(last=False)
        S = system_matrix(body, theta, rate)
        solve: Callable[[np.ndarray], np.ndarray]
        if scipy.sparse.issparse(S):
            solve = factorize(S.tocsr(), rhs_hint=1000).solve
        elif body.symmetric:
            factor = scipy.linalg.cho_factor(S, lower=True, check_finite=False)
            solve = partial(scipy.linalg.cho_solve, factor, check_finite=False)
        else:
            solve = partial(scipy.linalg.lu_solve, scipy.linalg.lu_factor(S, check_finite=False), check_finite=False)

        X = solve(np.ascontiguousarray(body.P)) if body.P.shape[1] else np.zeros_like(body.P)
        cache[key] = _Factored(solve, X, body.port_rows @ X)
        return cache[key]

    def forcing(self, drive: Drive, step: int) -> list[np.ndarray]:
        """Per body M theta (T_amb - T_ref) + B q + P q_port [W]."""
        load, T_ref = self.model.load_model, self.model.reference_temperature
        q_port = drive.port_heat[step]
        theta = drive.theta[step]
        result = []
        for body in self.model.bodies:
            rise = np.array(
                [
                    theta[k] * (drive.environment[step, load.films[k].environment] - T_ref)
                    if k < len(load.films)
                    else 0.0
                    for k in body.theta
                ]
            )
            q = drive.power[step, list(body.sources)]
            result.append(body.M @ rise + body.B @ q + body.P @ q_port[list(body.ports)])
        return result

    def solve(self, rhs: list[np.ndarray], theta: np.ndarray, gamma: np.ndarray, rate: float) -> list[np.ndarray]:
        """Solve (rate E + A(theta) + P Gamma P^T) x = rhs for all bodies; rate 0 is the steady state."""
        bodies = self.model.bodies
        factors = [self._factor(b, theta, rate) for b in range(len(bodies))]
        y = [f.solve(r) for f, r in zip(factors, rhs, strict=True)]
        n_ports = gamma.shape[0]
        if n_ports == 0:
            return y
        Q, t = np.zeros((n_ports, n_ports)), np.zeros(n_ports)
        for body, f, yb in zip(bodies, factors, y, strict=True):
            ports = list(body.ports)
            Q[np.ix_(ports, ports)] = f.Q
            t[ports] = body.port_rows @ yb
        q = gamma @ np.linalg.solve(np.eye(n_ports) + Q @ gamma, t)
        return [yb - f.X @ q[list(body.ports)] for body, f, yb in zip(bodies, factors, y, strict=True)]

    def run(
        self, drive: Drive, start: list[np.ndarray], substeps: int = 1, first: int = 0
    ) -> Iterator[tuple[int, list[np.ndarray], list[np.ndarray]]]:
        """Yield (step, state after it, mean state over its substeps) for steps first, first + 1, ... of `drive`.

        States per body (n_b,) K. The mean is what heat flows of the step are proportional to (implicit Euler).
        """
        x = list(start)
        for step in range(first, drive.n_steps):
            rate = substeps / (drive.time[step + 1] - drive.time[step])
            gamma = contact_matrix(self.model, drive, step)
            f = self.forcing(drive, step)
            mean = [np.zeros_like(xb) for xb in x]
            for _ in range(substeps):
                rhs = [rate * (b.E @ xb) + fb for b, xb, fb in zip(self.model.bodies, x, f, strict=True)]
                x = self.solve(rhs, drive.theta[step], gamma, rate)
                mean = [m + xb / substeps for m, xb in zip(mean, x, strict=True)]
            yield step, x, mean

    def steady_state(self, drive: Drive, step: int) -> list[np.ndarray]:
        """The state that the loads of one step would reach if held for ever."""
        return self.solve(self.forcing(drive, step), drive.theta[step], contact_matrix(self.model, drive, step), 0.0)

    def uniform(self, temperature: float) -> list[np.ndarray]:
        """The state of a machine at one temperature [degC]."""
        return [(temperature - self.model.reference_temperature) * b.one for b in self.model.bodies]


def sensor_temperatures(model: MachineModel, x: list[np.ndarray]) -> np.ndarray:
    """Structural sensors (n_sensors,) degC."""
    T = np.full(len(model.sensors), model.reference_temperature)
    for body, xb in zip(model.bodies, x, strict=True):
        T[list(body.sensors)] += body.C @ xb
    return T


def tcp_at_poses(model: MachineModel, x: list[np.ndarray]) -> np.ndarray:
    """TCP displacement (n_poses, 3) m."""
    return sum(body.G @ xb for body, xb in zip(model.bodies, x, strict=True))


def heat_balance_error(
    model: MachineModel,
    drive: Drive,
    step: int,
    before: list[np.ndarray],
    after: list[np.ndarray],
    mean: list[np.ndarray],
) -> float:
    """|heat in - heat out - heat stored| / throughput of one step (0.06; erratum E-000-3).

    before, after, mean: states per body as `CoupledStepper.run` yields them. Contacts drop out of the sum because what
    leaves one side enters the other.
    """
    load, T_ref = model.load_model, model.reference_temperature
    dt = drive.time[step + 1] - drive.time[step]
    heat_in = float(drive.power[step].sum())
    out = stored = throughput = 0.0
    for body, x0, x1, xm in zip(model.bodies, before, after, mean, strict=True):
        stored += float(body.energy @ (x1 - x0)) / dt
        for column, k in enumerate(body.theta):
            if k >= len(load.films):
                continue
            rise = drive.environment[step, load.films[k].environment] - T_ref
            flow = float(drive.theta[step, k] * (film_heat_row(body, column) @ xm - film_area(body, column) * rise))
            out += flow
            throughput += abs(flow)
    throughput += abs(heat_in) + abs(stored)
    return abs(heat_in - out - stored) / max(throughput, 1e-12)


def film_heat_row(body: AffineBody, column: int) -> np.ndarray:
    """Row (n,) m^2 such that theta * row @ x is the heat [W] a film takes out of the body at ambient T_ref."""
    left_one = np.linalg.solve(body.E.T, body.energy) if body.P_out is not None else body.one
    return body.A[column].T @ left_one


def film_area(body: AffineBody, column: int) -> float:
    """m^2 of a film on this body."""
    left_one = np.linalg.solve(body.E.T, body.energy) if body.P_out is not None else body.one
    return float(left_one @ body.M[:, column])
