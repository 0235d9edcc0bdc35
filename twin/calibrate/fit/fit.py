"""Parameters fitted to runs: bounded least squares with priors, stopped by minimum, iterations or time.

Minimise  sum (W (y_measured - y(x)))^2 + sum x^2  within bounds, x in prior standard deviations, by the trust-region
reflective method (Branch, Coleman, Li, SIAM J. Sci. Comput. 21, 1999; scipy.optimize.least_squares) with Jacobians
through the window model. Paper 000, Fig. 5: compare at the sensors, change parameters inside physical bounds, stop at
the minimum or at the maximum of iterations, so that the run time is bounded.

Afterwards residuals are whitened with what they were seen to be (`twin.calibrate.fit.noise`), hours that fit far worse
than the others of their channel lose weight (`twin.calibrate.fit.weights`), and the fit is repeated until parameters
settle: of a model that misses by far more than the noise, values after a fixed number of fits hang on each reading.
Covariance, pulls and intervals belong to the last fit.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import least_squares

from twin.calibrate.fit.evaluated import Evaluated, floors, information, noise_at, whitened_jacobian
from twin.calibrate.fit.noise import Noise, estimated, white
from twin.calibrate.fit.problem import Problem
from twin.calibrate.fit.weights import stretch_weights

WHITENINGS = 2  # fits with estimated noise after the first one, at least; and
MOST = 6  # at most, while
SETTLED = 0.3  # of its standard deviation a parameter moves from one fit to the next
TOLERANCE = 1e-5  # relative change of the cost, and of the parameters


@dataclass(frozen=True)
class Stop:
    """When a fit ends, besides at its minimum."""

    iterations: int = 100  # of all passes together
    seconds: float = np.inf


@dataclass(frozen=True)
class Iteration:
    """A state on the way: every one can be used as it is."""

    number: int
    cost: float  # half the sum of squares, prior included
    x: np.ndarray  # (n,)
    seconds: float


@dataclass(frozen=True)
class Fit:
    """n parameters, those of initial states included; x in prior standard deviations."""

    problem: Problem
    x: np.ndarray  # (n,)
    covariance: np.ndarray  # (n, n) of x, prior included
    information: np.ndarray  # (n, n) of the data alone: J^T J
    noise: tuple[tuple[Noise, Noise], ...]  # per run: of the sensors (s), of dx, dy, dz
    history: tuple[Iteration, ...]
    stopped: str  # "minimum", "iterations", "time", "interrupted"
    residual: tuple[tuple[np.ndarray, np.ndarray], ...] = field(repr=False, default=())  # per run (b, s) K, (k, 3) m

    @property
    def sigma(self) -> np.ndarray:
        """(n,) posterior standard deviations of x."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def at_bound(self) -> np.ndarray:
        """(n,) bool"""
        low, high = self.problem.bounds
        return (self.x < low + 1e-3) | (self.x > high - 1e-3)


class _Over(Exception):
    """The time or the iterations are used up."""


def fit(
    problem: Problem,
    stop: Stop = Stop(),
    start: np.ndarray | None = None,
    report: Callable[[Iteration], None] = lambda _: None,
    known: tuple[tuple[Noise, Noise], ...] | None = None,
) -> Fit:
    """The parameters that explain the runs best within bounds and priors. Ctrl-C ends it with the best state so far.

    known: the noise per run, where an earlier fit of the same runs has estimated it already.

    Raises nothing: a fit that ends early says so in `stopped`, and its covariance holds for where it is.
    """
    began = time.perf_counter()
    low, high = problem.bounds
    x = np.clip(np.zeros(len(problem.scale)) if start is None else start, low + 1e-9, high - 1e-9)
    limits = [floors(problem, run) for run in problem.runs]
    last = MOST if known is None else 0
    history: list[Iteration] = []
    stopped = "minimum"

    def count(cost: float, x: np.ndarray) -> None:
        history.append(Iteration(len(history), cost, x.copy(), time.perf_counter() - began))
        report(history[-1])
        if len(history) >= stop.iterations:
            raise _Over("iterations")
        if time.perf_counter() - began > stop.seconds:
            raise _Over("time")

    best = x
    evaluated = Evaluated(problem)
    noise = known if known is not None else noise_at(evaluated, [(white(s), white(w)) for s, w in limits], x)
    k = 0
    try:
        for k in range(last + 1):
            before, best = best, _minimise(evaluated, noise, best, (low, high), count, loose=k < min(last, WHITENINGS))
            if k == last or (k >= WHITENINGS and _moved(evaluated, noise, before, best) <= SETTLED):
                break
            noise = _seen(evaluated, noise, limits, best)
    except _Over as over:
        stopped, best = str(over), history[-1].x
    except KeyboardInterrupt:
        stopped, best = "interrupted", (history[-1].x if history else x)
    if stopped != "minimum" and known is None and k < WHITENINGS:  # intervals need the noise that is there
        noise = _seen(evaluated, noise, limits, best)
    seen_by_data = information(evaluated, noise, best)
    return Fit(
        problem, best, _covariance(seen_by_data), seen_by_data, noise, tuple(history), stopped,
        tuple(evaluated.plain_residuals(best)),
    )  # fmt: skip


def _covariance(seen_by_data: np.ndarray) -> np.ndarray:
    found = np.linalg.inv(seen_by_data + np.eye(len(seen_by_data)))
    return np.asarray((found + found.T) / 2)


def _moved(evaluated: Evaluated, noise: tuple[tuple[Noise, Noise], ...], before: np.ndarray, now: np.ndarray) -> float:
    """Standard deviations by which the parameter moved that moved farthest."""
    sigma = np.sqrt(np.diag(_covariance(information(evaluated, noise, now))))
    return float(np.max(np.abs(now - before) / sigma, initial=0.0))


def _seen(
    evaluated: Evaluated,
    noise: tuple[tuple[Noise, Noise], ...],
    limits: list[tuple[np.ndarray, np.ndarray]],
    x: np.ndarray,
) -> tuple[tuple[Noise, Noise], ...]:
    """The noise that the residuals at x show, at least that of the instruments, with model discrepancy at x."""
    channels = [
        (estimated(sensors.without_form(T), floor[0]), estimated(tcp.without_form(w), floor[1]))
        for (T, w), (sensors, tcp), floor in zip(evaluated.residuals(x), noise, limits, strict=True)
    ]
    noise = noise_at(evaluated, channels, x)
    return _weighted(evaluated, noise, limits, x) if evaluated.problem.options.weights else noise


def _weighted(
    evaluated: Evaluated,
    noise: tuple[tuple[Noise, Noise], ...],
    limits: list[tuple[np.ndarray, np.ndarray]],
    x: np.ndarray,
) -> tuple[tuple[Noise, Noise], ...]:
    """The noise with weights of the hours of every channel, judged over all runs that have it."""
    runs = [run.measured for run in evaluated.problem.runs]
    residuals = evaluated.residuals(x)
    white = [(s.whiten(T), tcp.whiten(w)) for (T, w), (s, tcp) in zip(residuals, noise, strict=True)]
    weight = [(np.ones_like(T), np.ones_like(w)) for T, w in white]
    for name in dict.fromkeys([*(n for m in runs for n in m.sensors), 0, 1, 2]):
        own = [(k, 0, m.sensors.index(name), m.bin_time) for k, m in enumerate(runs) if name in m.sensors]
        if isinstance(name, int):
            own = [(k, 1, name, m.tcp_time) for k, m in enumerate(runs) if len(m.tcp)]
        found = stretch_weights([white[k][kind][:, c] for k, kind, c, _ in own], [time for *_, time in own])
        for (k, kind, c, _), one in zip(own, found, strict=True):
            most = (noise[k][kind].channels.sigma[c] / limits[k][kind][c]) ** 2  # no better than the instrument
            weight[k][kind][:, c] = np.minimum(one, most)
    return tuple(
        (replace(s, weight=of_s), replace(tcp, weight=of_tcp))
        for (s, tcp), (of_s, of_tcp) in zip(noise, weight, strict=True)
    )


def _minimise(
    evaluated: Evaluated,
    noise: tuple[tuple[Noise, Noise], ...],
    x: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
    count: Callable[[float, np.ndarray], None],
    loose: bool,
) -> np.ndarray:
    def residual(x: np.ndarray) -> np.ndarray:
        parts = [
            part.ravel()
            for (T, w), (sensors, tcp) in zip(evaluated.residuals(x), noise, strict=True)
            for part in (sensors.whiten(T), tcp.whiten(w))
        ]
        return np.concatenate([*parts, x])

    def jacobian(x: np.ndarray) -> np.ndarray:
        return np.vstack([-whitened_jacobian(evaluated, noise, x), np.eye(len(x))])

    # one Gauss-Newton step less in passes whose noise is not yet final
    tolerance = 100 * TOLERANCE if loose else TOLERANCE

    def callback(intermediate_result: object) -> None:
        count(float(getattr(intermediate_result, "cost")), np.asarray(getattr(intermediate_result, "x")))  # noqa: B009

    found = least_squares(
        residual, x, jacobian, bounds=bounds, method="trf", ftol=tolerance, xtol=tolerance, gtol=None,
        callback=callback,
    )  # fmt: skip
    return np.asarray(found.x)
