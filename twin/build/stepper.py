"""Implicit Euler for coupled bodies, full (sparse) or rich (dense): one factor per body, contacts by Schur complement.

    (E/h + A(theta) + P Gamma P^T) x_new = E x/h + M theta (T_out - T_ref) + B q + P q_port

Paper 000 eqs (4)-(6) with the films implicit (erratum E-000-3: the lagged form is stable only for dt < 2 rho c d/h).
The axis position changes Gamma only, so a moving axis costs no factorisation: with S = E/h + A(theta) per body,
X = S^-1 P and Q = P^T X, the port temperatures solve (1 + Q Gamma) t = P^T S^-1 r, and x_new = S^-1 r - X Gamma t.
Assembling and factorising the coupled matrix at every position was rejected: 720 steps would be 720 factorisations.

Coefficients that follow surface temperature and speed change in every step. A factor is kept while they stay within
FOLLOW of those it was made with; the rest, (theta - held) A_k x, goes to the right side, first with the state before
and once more with the state so found. What is left of it is of second order in the deviation, the heat balance counts
what was solved and stays exact, and it is stable as |theta - held| < held.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
import scipy.linalg
import scipy.sparse

from twin.build.factorize import factorize
from twin.build.fixed_point import fixed_point
from twin.rom.drive import Drive
from twin.rom.following import FOLLOW, FilmPlan, difference_place, film_state, read_table, temperature_place
from twin.rom.load_model import Pair, Rail
from twin.rom.model import AffineBody, MachineModel, Matrix

LEAST = 1e-6  # W: a balance is not judged against less than that


def contact_matrix(model: MachineModel, drive: Drive, step: int) -> np.ndarray:
    """Gamma (n_ports, n_ports) W/K of one step: q_port = -Gamma T_port; symmetric, rows sum to zero."""
    load = model.load_model
    n = len(load.ports)
    if not load.pairs:
        return np.zeros((n, n))
    g = drive.conductance[step][:, None]
    to_rail, side = -g * drive.weight[step], g * drive.neighbour[step]
    values = (g, to_rail, to_rail, g * drive.square[step], side, side)
    places = _contact_places(load.rails, load.pairs, n)
    return np.bincount(places, np.concatenate([v.ravel() for v in values]), n * n).reshape(n, n)


@lru_cache(maxsize=8)
def _contact_places(rails: tuple[Rail, ...], pairs: tuple[Pair, ...], n: int) -> np.ndarray:
    """Where in Gamma, as a flat index, the numbers go that `contact_matrix` lines up.

    Weights are padded with zeros to the longest rail: these go to a rail's last segment.
    """
    first = np.array([rails[p.rail].first_port for p in pairs])[:, None]
    last = np.array([len(rails[p.rail].stations) - 1 for p in pairs])[:, None]
    segment = np.arange(max(len(r.stations) for r in rails))[None, :]
    here, beside = first + np.minimum(segment, last), first + np.minimum(segment + 1, last)
    pad = np.array([p.pad_port for p in pairs])[:, None]
    places = (pad * n + pad, pad * n + here, here * n + pad, here * n + here, here * n + beside, beside * n + here)
    return np.concatenate([p.ravel() for p in places])


@dataclass(frozen=True)
class Loads:
    """What drives one step, with the laws that follow the state read at its start."""

    theta: np.ndarray  # (n_theta,) W/(m^2 K), films with radiation, then joints
    rise: np.ndarray  # (n_theta,) K: outer temperature above the reference; zero for joints
    lift: np.ndarray  # (n_theta,) multiplies H
    power: np.ndarray  # (n_sources,) W
    port_heat: np.ndarray  # (n_ports,) W
    surface: np.ndarray  # (n_films,) degC
    radiated: np.ndarray  # (n_films,) W/m^2 into the surfaces by radiation


@dataclass(frozen=True)
class Heat:
    """Mean heat flows of one step [W]; what leaves one side of a contact enters the other, so contacts drop out."""

    power: np.ndarray  # (n_sources,)
    film: np.ndarray  # (n_films,) from the environments into the machine
    stored: float
    radiated: np.ndarray  # (n_films,) the part of `film` by radiation, at the step's start

    @property
    def balance_error(self) -> float:
        """|heat in - heat out - heat stored| / throughput (0.06; erratum E-000-3)."""
        rest = self.power.sum() + self.film.sum() - self.stored
        # radiation and convection of one film may cancel: each counts
        films = np.abs(self.film - self.radiated).sum() + np.abs(self.radiated).sum()
        throughput = np.abs(self.power).sum() + films + abs(self.stored)
        return float(abs(rest) / max(throughput, LEAST))


@dataclass(eq=False)
class _Factored:
    rate: float
    theta: np.ndarray  # (len(body.theta),) the values it was made with
    solve: Callable[[np.ndarray], np.ndarray]
    X: np.ndarray  # (n, n_ports_b) S^-1 P
    Q: np.ndarray  # (n_ports_b, n_ports_b)


def system_matrix(body: AffineBody, theta: np.ndarray, rate: float) -> Matrix:
    """rate E + A0 + sum_k theta_k A_k with rate = 1/h [1/s] (0: steady state)."""
    S = body.A0 + rate * body.E
    for k, a in zip(body.theta, body.A, strict=True):
        S = S + theta[k] * a
    return S


class _Dense:
    """The matrices of a dense body laid out so that one pass over memory adds up its terms."""

    def __init__(self, body: AffineBody, n_films: int):
        self._body, self.n_films = body, sum(k < n_films for k in body.theta)
        if any(k >= n_films for k in body.theta[: self.n_films]):
            raise ValueError("films come before joints")
        self._terms = np.ascontiguousarray(body.A, dtype=float).reshape(len(body.A), body.n**2)
        self.unit = np.array_equal(body.E, np.eye(body.n))
        self._joints: tuple[np.ndarray, np.ndarray] | None = None  # conductances and A0 with them

    def system(self, own: np.ndarray, rate: float) -> np.ndarray:
        """rate E + A0 + sum_k own_k A_k (n, n); own (len(body.theta),)."""
        n, first = self._body.n, self.n_films
        if self._joints is None or not np.array_equal(self._joints[0], own[first:]):
            self._joints = (own[first:], self._body.A0 + (own[first:] @ self._terms[first:]).reshape(n, n))
        S = self.film_terms(own[:first])
        S += self._joints[1]
        if self.unit:
            S.flat[:: n + 1] += rate
        else:
            S += rate * self._body.E
        return S

    def film_terms(self, coefficients: np.ndarray) -> np.ndarray:
        """sum_k coefficients_k A_k (n, n) over the films."""
        return (coefficients @ self._terms[: self.n_films]).reshape(self._body.n, self._body.n)


class CoupledStepper:
    """Steps a MachineModel whose bodies are sparse (full) or dense (rich); keeps the last factors per body."""

    def __init__(self, model: MachineModel, keep: int = 2, follow: float = FOLLOW):
        self.model = model
        self._cache: tuple[list[_Factored], ...] = tuple([] for _ in model.bodies)  # latest last
        self._keep, self._follow = keep, follow
        self._plan = FilmPlan.of(model.load_model)
        n_films, n_theta = len(model.load_model.films), len(model.load_model.theta_names)
        self._film_rows = tuple(body.film_rows for body in model.bodies)
        self._dense = tuple(None if scipy.sparse.issparse(b.E) else _Dense(b, n_films) for b in model.bodies)
        # area and first moment of height of the films
        self._area, self._moment = np.zeros(n_theta), np.zeros(n_theta)
        for body in model.bodies:
            own = list(body.theta)
            self._area[own] += body.left_one @ body.M
            if body.H is not None:
                self._moment[own] += body.left_one @ body.H
        self._area[n_films:] = 0.0
        self._height = self._moment[:n_films] / np.where(self._area[:n_films] > 0, self._area[:n_films], 1.0)

    def __reduce__(self) -> tuple:
        """A copy starts without factors: those of sparse solvers cannot be copied."""
        return CoupledStepper, (self.model, self._keep, self._follow)

    def forget(self) -> None:
        """Drop all factors: what follows depends on its own input only, to the last bit."""
        for cache in self._cache:
            cache.clear()

    def surfaces(self, x: list[np.ndarray]) -> np.ndarray:
        """Mean temperatures (n_films,) [degC] of the films' surfaces."""
        n = len(self.model.load_model.films)
        total = np.zeros(len(self._area))
        for body, rows, xb in zip(self.model.bodies, self._film_rows, x, strict=True):
            total[list(body.theta)] += rows @ xb
        return self.model.reference_temperature + total[:n] / np.where(self._area[:n] > 0, self._area[:n], 1.0)

    def loads(self, drive: Drive, step: int, x: list[np.ndarray]) -> Loads:
        """The loads of a step that starts at x."""
        model, n = self.model, len(self.model.load_model.films)
        environment, T_ref = drive.environment[step], model.reference_temperature
        theta, rise, lift = drive.theta[step].copy(), np.zeros(len(self._area)), np.zeros(len(self._area))
        surface = self.surfaces(x)
        if drive.films.index:
            own = list(drive.films.index)
            air = self._plan.air(environment, self._height)[own]
            theta[own] = read_table(np, drive.films.value[step], difference_place(np, surface[own] - air))
        films = film_state(np, self._plan, theta[:n], surface, environment, float(drive.radiation))
        theta[:n], rise[:n], lift[:n] = films.total, films.outer - T_ref, films.lift
        power = drive.power[step].copy()
        if drive.losses.index:
            temperature = np.full(len(power), T_ref)
            for body, xb in zip(model.bodies, x, strict=True):
                temperature[list(body.sources)] += body.source_rows @ xb
            own = list(drive.losses.index)
            power[own] = read_table(np, drive.losses.value[step], temperature_place(np, temperature[own]))
        return Loads(theta, rise, lift, power, drive.contact_heat[step].sum(axis=0), surface, films.radiated)

    def forcing(self, loads: Loads) -> list[np.ndarray]:
        """Per body M theta (T_out - T_ref) + H lift + B q + P q_port [W]."""
        result = []
        for body in self.model.bodies:
            own = list(body.theta)
            f = body.M @ (loads.theta[own] * loads.rise[own])
            if body.H is not None:
                f = f + body.H @ loads.lift[own]
            result.append(f + body.B @ loads.power[list(body.sources)] + body.P @ loads.port_heat[list(body.ports)])
        return result

    def factors(self, theta: np.ndarray, rate: float, follow: float | None = None) -> list[_Factored]:
        """Per body a factor whose coefficients are within `follow` of theta (n_theta,), made where there is none."""
        allowed = self._follow if follow is None else follow
        return [self._factor(b, theta, rate, allowed) for b in range(len(self.model.bodies))]

    def _factor(self, b: int, theta: np.ndarray, rate: float, follow: float) -> _Factored:
        body, cache = self.model.bodies[b], self._cache[b]
        own = theta[list(body.theta)]

        def distance(factored: _Factored) -> float:
            if abs(factored.rate - rate) > 1e-9 * rate:  # rounding of clock times
                return np.inf
            return float((np.abs(own - factored.theta) / np.maximum(factored.theta, 1e-30)).max(initial=0.0))

        if cache:
            nearest = min(cache, key=distance)
            if distance(nearest) <= follow:
                cache.remove(nearest)
                cache.append(nearest)
                return nearest
        while len(cache) >= self._keep:  # free first: two factors of a large body need not fit beside a third
            cache.pop(0)
        solve: Callable[[np.ndarray], np.ndarray]
        dense = self._dense[b]
        if dense is None:
            solve = factorize(system_matrix(body, theta, rate).tocsr(), rhs_hint=1000).solve
        elif body.symmetric:
            S = dense.system(own, rate).T  # its own transpose, in the order that LAPACK overwrites
            factor = scipy.linalg.cho_factor(S, lower=True, overwrite_a=True, check_finite=False)
            solve = partial(scipy.linalg.cho_solve, factor, check_finite=False)
        else:
            S = dense.system(own, rate)
            solve = partial(scipy.linalg.lu_solve, scipy.linalg.lu_factor(S, check_finite=False), check_finite=False)

        X = solve(np.ascontiguousarray(body.P)) if body.P.shape[1] else np.zeros_like(body.P)
        cache.append(_Factored(rate, own, solve, X, body.port_rows @ X))
        return cache[-1]

    def _rest(self, b: int, theta: np.ndarray, held: np.ndarray) -> Callable[[np.ndarray], np.ndarray] | None:
        """x -> sum_k (theta_k - held_k) A_k x: what the factor leaves to the right side, None if nothing."""
        body, dense = self.model.bodies[b], self._dense[b]
        more = theta[list(body.theta)] - held
        if not more.any():
            return None
        if dense is not None and not more[dense.n_films :].any():
            D = dense.film_terms(more[: dense.n_films])
            return lambda x: D @ x
        return lambda x: np.sum([d * (a @ x) for d, a in zip(more, body.A, strict=True) if d != 0.0], axis=0)

    def solve(self, rhs: list[np.ndarray], factors: list[_Factored], gamma: np.ndarray) -> list[np.ndarray]:
        """Solve (rate E + A + P Gamma P^T) x = rhs for all bodies, with rate and A of the factors."""
        bodies = self.model.bodies
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
    ) -> Iterator[tuple[int, list[np.ndarray], Heat]]:
        """Yield (step, state after it, heat of the step) for steps first, first + 1, ... of `drive`.

        States per body (n_b,) K.
        """
        x = list(start)
        for step in range(first, drive.n_steps):
            loads = self.loads(drive, step, x)
            factors = self.factors(loads.theta, substeps / (drive.time[step + 1] - drive.time[step]))
            gamma = contact_matrix(self.model, drive, step)
            f = self.forcing(loads)
            rest = [self._rest(b, loads.theta, factor.theta) for b, factor in enumerate(factors)]
            passes = 1 if all(r is None for r in rest) else 2
            before, old, new = x, [np.zeros_like(xb) for xb in x], [np.zeros_like(xb) for xb in x]
            for _ in range(substeps):
                known = [
                    factor.rate * self._stored(b, xb) + fb
                    for b, (xb, fb, factor) in enumerate(zip(x, f, factors, strict=True))
                ]
                for _ in range(passes):
                    seen = x
                    rhs = [k if r is None else k - r(s) for k, r, s in zip(known, rest, seen, strict=True)]
                    x = self.solve(rhs, factors, gamma)
                old = [m + s / substeps for m, s in zip(old, seen, strict=True)]
                new = [m + xb / substeps for m, xb in zip(new, x, strict=True)]
            yield step, x, self._heat(loads, factors, drive.time[step + 1] - drive.time[step], before, x, old, new)

    def _stored(self, b: int, x: np.ndarray) -> np.ndarray:
        """E x of a body."""
        dense = self._dense[b]
        return x if dense is not None and dense.unit else self.model.bodies[b].E @ x

    def _heat(
        self,
        loads: Loads,
        factors: list[_Factored],
        dt: float,
        before: list[np.ndarray],
        after: list[np.ndarray],
        old: list[np.ndarray],
        new: list[np.ndarray],
    ) -> Heat:
        """Heat of a step from its loads and its states: at its ends, and the means that the rest and the factor saw."""
        flow = loads.theta * self._area * loads.rise + self._moment * loads.lift
        stored = 0.0
        for body, rows, f, x0, x1, xo, xn in zip(
            self.model.bodies, self._film_rows, factors, before, after, old, new, strict=True
        ):
            own = list(body.theta)
            flow[own] -= f.theta * (rows @ xn) + (loads.theta[own] - f.theta) * (rows @ xo)
            stored += float(body.energy @ (x1 - x0)) / dt
        n = len(self.model.load_model.films)
        return Heat(loads.power, flow[:n], stored, self._area[:n] * loads.radiated)

    def steady_state(self, drive: Drive, step: int, tolerance: float = 1e-5, most: int = 200) -> list[np.ndarray]:
        """The state that the loads of one step would reach if held for ever; laws that follow the state included.

        A fixed point of loads and state, to `tolerance` [K] (root mean square over the heat capacity), by Anderson
        acceleration (Walker, Ni, SIAM J. Numer. Anal. 49, 2011): plain iteration diverges where a loss falls or
        radiation rises steeply with temperature. Raises ModelError where none is found.
        """
        gamma = contact_matrix(self.model, drive, step)
        borders = np.cumsum([b.n for b in self.model.bodies])[:-1]
        capacity = sum(float(b.one @ b.energy) for b in self.model.bodies)

        def turn(flat: np.ndarray) -> np.ndarray:
            x = np.split(flat, borders)
            loads = self.loads(drive, step, x)
            factors = self.factors(loads.theta, 0.0, min(self._follow, FOLLOW))
            rest = [self._rest(b, loads.theta, factor.theta) for b, factor in enumerate(factors)]
            f = self.forcing(loads)
            rhs = [fb if r is None else fb - r(xb) for fb, r, xb in zip(f, rest, x, strict=True)]
            return np.concatenate(self.solve(rhs, factors, gamma))

        def size(flat: np.ndarray) -> float:
            stored = [abs(float(p @ self._stored(b, p))) for b, p in enumerate(np.split(flat, borders))]
            return float(np.sqrt(sum(stored) / capacity))

        start = float(drive.environment[step, 0]) if drive.environment.shape[1] else self.model.reference_temperature
        return np.split(fixed_point(turn, np.concatenate(self.uniform(start)), size, tolerance, most), borders)

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
