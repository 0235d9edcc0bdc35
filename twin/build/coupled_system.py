"""The matrix of a machine in a time step, of coupled bodies: one factor per body, kept, and a small system of contacts.

    (r E + A(theta) + P Gamma P^T) X = right

The axis position changes Gamma only, so a moving axis costs no factorisation: with S = r E + A(theta) per body,
Y = S^-1 P and Q = P^T Y, the port temperatures solve (1 + Q Gamma) t = P^T S^-1 b, and X = S^-1 b - Y Gamma t.
Assembling and factorising the coupled matrix at every position was rejected: 720 steps would be 720 factorisations.

Coefficients that follow surface temperature and speed change in every step. A factor is kept while they stay within
`follow` of those it was made with; the rest, (theta - held) A_k x, goes to the right side with the state before, and
once more with the state so found where it is more than half of what is allowed: what is left is of second order in the
deviation, and it is stable as |theta - held| < held.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import count, pairwise

import numpy as np
import scipy.sparse

from twin.build.body_matrix import DenseTerms, solver_of
from twin.rom.model import MachineModel

# States of all bodies up to which one product with the inverse of the whole machine takes less time than a solve per
# body and what joins them: a step of 22 states spends its time in Python, not in arithmetic.
SMALL = 100


@dataclass(eq=False)
class Factored:
    """The matrix of one body, factorised."""

    rate: float
    theta: np.ndarray  # (len(body.theta),) the values it was made with
    solve: Callable[[np.ndarray], np.ndarray]
    X: np.ndarray  # (n, n_ports_b) S^-1 P
    Q: np.ndarray  # (n_ports_b, n_ports_b)
    number: int = field(default_factory=count().__next__)  # no two have the same

    @cached_property
    def inverse(self) -> np.ndarray:
        """S^-1 (n, n) of a dense body."""
        return self.solve(np.eye(len(self.X)))


class CoupledSystem:
    """The matrices of a MachineModel, sparse (full) or dense (rich); it keeps the last factors of each body."""

    def __init__(self, model: MachineModel, keep: int, follow: float) -> None:
        self.model = model
        self._cache: tuple[list[Factored], ...] = tuple([] for _ in model.bodies)  # latest last
        self._keep, self._follow = keep, follow
        ends = np.cumsum([0, *(b.n for b in model.bodies)]).tolist()
        self._rows = [slice(a, b) for a, b in pairwise(ends)]
        self._ports = [np.array(body.ports, dtype=int) for body in model.bodies]
        n_films = len(model.load_model.films)
        self._dense = tuple(None if scipy.sparse.issparse(b.E) else DenseTerms(b, n_films) for b in model.bodies)
        self._all_dense = None not in self._dense
        self._small = self._all_dense and ends[-1] <= SMALL
        self._unit = all(d is not None and d.unit for d in self._dense)  # E = 1
        self._joins: tuple[tuple[int, ...], np.ndarray] | None = None
        self._crossed: tuple[tuple[int, ...], np.ndarray, np.ndarray] | None = None

    def forget(self) -> None:
        """Drop all factors: what follows depends on its own input only, to the last bit."""
        for cache in self._cache:
            cache.clear()

    def factors(self, theta: np.ndarray, rate: float, follow: float | None = None) -> list[Factored]:
        """Per body a factor whose coefficients are within `follow` of theta (n_theta,), made where there is none."""
        allowed = self._follow if follow is None else follow
        return [self._factor(b, theta, rate, allowed) for b in range(len(self.model.bodies))]

    def _factor(self, b: int, theta: np.ndarray, rate: float, follow: float) -> Factored:
        body, cache = self.model.bodies[b], self._cache[b]
        own = theta[list(body.theta)]

        def distance(factored: Factored) -> float:
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
        solve = solver_of(body, self._dense[b], theta, rate)
        X = solve(np.ascontiguousarray(body.P)) if body.P.shape[1] else np.zeros_like(body.P)
        cache.append(Factored(rate, own, solve, X, body.port_rows @ X))
        return cache[-1]

    def _system(
        self, theta: np.ndarray, gamma: np.ndarray, rate: float
    ) -> tuple[list[Factored], Callable[..., tuple[np.ndarray, np.ndarray]], Callable[[np.ndarray], np.ndarray]]:
        """Factors of a step, its solution and what it stores, as `stages` takes them."""
        factors = self.factors(theta, rate)
        rest = [self._rest(b, theta, factor.theta) for b, factor in enumerate(factors)]
        passes = 2 if self._far(theta, factors) else 1
        solve = partial(self._solve, self._whole(factors, self.across(factors, gamma)), rest, passes)
        return factors, solve, partial(self._capacity, factors)

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

    def across(self, factors: list[Factored], gamma: np.ndarray) -> np.ndarray:
        """Gamma (1 + Q Gamma)^-1 (n_ports, n_ports) W/K: heat that leaves the ports of bodies in contact, by the port
        temperatures that they would have without. Inverted once, as all stages of a step share it, and kept while no
        axis moves.
        """
        numbers = tuple(f.number for f in factors)
        if self._crossed is None or self._crossed[0] != numbers or not np.array_equal(self._crossed[1], gamma):
            Q = np.zeros(gamma.shape)
            for ports, f in zip(self._ports, factors, strict=True):
                Q[np.ix_(ports, ports)] = f.Q
            self._crossed = numbers, gamma, gamma @ np.linalg.inv(np.eye(len(gamma)) + Q @ gamma)
        return self._crossed[2]

    def solve(self, rhs: list[np.ndarray], factors: list[Factored], across: np.ndarray) -> list[np.ndarray]:
        """Solve (rate E + A + P Gamma P^T) x = rhs for all bodies, with rate and A of the factors; across: of both."""
        return self.joined([f.solve(r) for f, r in zip(factors, rhs, strict=True)], factors, across)

    def joined(self, y: list[np.ndarray], factors: list[Factored], across: np.ndarray) -> list[np.ndarray]:
        """The solutions with contacts, from those without, y: per body (n_b,)."""
        if not len(across):
            return y
        t = np.zeros(len(across))
        for body, ports, yb in zip(self.model.bodies, self._ports, y, strict=True):
            t[ports] = body.port_rows @ yb
        q = across @ t
        return [yb - f.X @ q[ports] for ports, f, yb in zip(self._ports, factors, y, strict=True)]

    def _parts(self, x: np.ndarray) -> list[np.ndarray]:
        """The bodies' states (n_b,) of all states one after the other (N,)."""
        return [x[part] for part in self._rows]

    def _capacity(self, factors: list[Factored], x: np.ndarray) -> np.ndarray:
        """rate E x of all bodies, one after the other (N,)."""
        if self._unit and len({factor.rate for factor in factors}) == 1:
            return factors[0].rate * x
        parts = zip(factors, self._parts(x), strict=True)
        return np.concatenate([factor.rate * self._stored(b, xb) for b, (factor, xb) in enumerate(parts)])

    def _whole(self, factors: list[Factored], across: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """The solution (N,) of all bodies in contact for a right-hand side (N,)."""
        if not self._all_dense:
            return lambda right: np.concatenate(self.solve(self._parts(right), factors, across))
        if not self._small:
            X, rows, P = self._joining(factors), self._rows, self._port_rows

            def by_body(right: np.ndarray) -> np.ndarray:
                y = np.concatenate([f.solve(right[own]) for f, own in zip(factors, rows, strict=True)])
                return y - X @ (across @ (P @ y)) if len(across) else y

            return by_body
        N = self._rows[-1].stop
        inverse, Y = np.zeros((N, N)), np.zeros((len(across), N))
        for body, f, own, ports in zip(self.model.bodies, factors, self._rows, self._ports, strict=True):
            inverse[own, own] = f.inverse
            Y[ports, own] = body.port_rows @ f.inverse
        inverse -= self._joining(factors) @ (across @ Y)
        return lambda right: inverse @ right

    def _joining(self, factors: list[Factored]) -> np.ndarray:
        """S^-1 P of all bodies (N, n_ports); kept, as factors are."""
        numbers = tuple(f.number for f in factors)
        if self._joins is None or self._joins[0] != numbers:
            X = np.zeros((self._rows[-1].stop, len(self.model.load_model.ports)))
            for f, own, ports in zip(factors, self._rows, self._ports, strict=True):
                X[own, ports] = f.X
            self._joins = numbers, X
        return self._joins[1]

    @cached_property
    def _port_rows(self) -> np.ndarray:
        """P^T of all bodies (n_ports, N)."""
        rows = np.zeros((len(self.model.load_model.ports), self._rows[-1].stop))
        for body, own, ports in zip(self.model.bodies, self._rows, self._ports, strict=True):
            rows[ports, own] = body.port_rows
        return rows

    def _far(self, theta: np.ndarray, factors: list[Factored]) -> bool:
        """Whether coefficients are so far from those of the factors that one pass would be worse than the step itself;
        as `twin.run.stepping` judges it."""
        pairs = ((theta[list(body.theta)], f.theta) for body, f in zip(self.model.bodies, factors, strict=True))
        return any(bool(np.any(np.abs(own - held) > self._follow / 2 * held)) for own, held in pairs)

    def _solve(
        self,
        whole: Callable[[np.ndarray], np.ndarray],
        rest: Sequence[Callable[[np.ndarray], np.ndarray] | None],
        passes: int,
        right: np.ndarray,
        near: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """The solution (N,), and the state at which it took what the factors leave out: `near`, then, in a second pass,
        what that gave."""
        if all(r is None for r in rest):
            return whole(right), near
        seen = near
        for _ in range(passes):
            seen = near
            parts = zip(rest, self._parts(seen), strict=True)
            near = whole(right - np.concatenate([np.zeros_like(s) if r is None else r(s) for r, s in parts]))
        return near, seen

    def _stored(self, b: int, x: np.ndarray) -> np.ndarray:
        """E x of a body."""
        dense = self._dense[b]
        return x if dense is not None and dense.unit else self.model.bodies[b].E @ x
