"""Residuals of a problem, what they are weighed with, and their whitened Jacobian."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from twin.calibrate.fit.noise import Channels, Noise
from twin.calibrate.fit.problem import FitRun, Problem

Pairs = list[tuple[np.ndarray, np.ndarray]]  # per run: of temperatures (b, s, ...), of TCP (k, 3, ...)


class Evaluated:
    """A problem that remembers its last outputs and Jacobian: solver, noise and covariance ask at the same place.

    TCP rows are weighted: in units of the run's median sigma, so that a good row counts by its own.
    """

    def __init__(self, problem: Problem):
        self.problem = problem
        self._weights = [run.measured.row_weight(floors(problem, run)[1][0])[:, None] for run in problem.runs]
        self._last: dict[str, tuple[bytes, Pairs]] = {}

    def outputs(self, x: np.ndarray) -> Pairs:
        """As `Problem.outputs`, TCP rows weighted."""
        pairs = self._ask("outputs", self.problem.outputs, x)
        return [(T, weight * w) for (T, w), weight in zip(pairs, self._weights, strict=True)]

    def jacobian(self, x: np.ndarray) -> Pairs:
        """As `Problem.jacobian`, TCP rows weighted."""
        pairs = self._ask("jacobian", self.problem.jacobian, x)
        return [(T, weight[:, :, None] * w) for (T, w), weight in zip(pairs, self._weights, strict=True)]

    def residuals(self, x: np.ndarray) -> Pairs:
        """Per run measured minus simulated: (b, s) K and weighted (k, 3) m; NaN where nothing was measured."""
        return [
            (run.measured.temperature - T, weight * run.measured.tcp - w)
            for run, weight, (T, w) in zip(self.problem.runs, self._weights, self.outputs(x), strict=True)
        ]

    def plain_residuals(self, x: np.ndarray) -> Pairs:
        """The same without weights."""
        return [(T, w / weight) for (T, w), weight in zip(self.residuals(x), self._weights, strict=True)]

    def _ask(self, name: str, of: Callable[[np.ndarray], Pairs], x: np.ndarray) -> Pairs:
        key = x.tobytes()
        if name not in self._last or self._last[name][0] != key:
            self._last[name] = (key, of(x))
        return self._last[name][1]


def floors(problem: Problem, run: FitRun) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations that the instruments alone give: of bin means (s,) [K], of TCP components (3,) [m]."""
    m, options = run.measured, problem.options
    samples = np.median(np.where(m.count > 0, m.count, np.nan), axis=0) if len(m.count) else np.ones(len(m.sensors))
    sensor = options.temperature_sigma / np.sqrt(np.nan_to_num(samples, nan=1.0).clip(1.0))
    rows = np.zeros(0) if m.tcp_sigma is None else m.tcp_sigma[np.isfinite(m.tcp_sigma) & (m.tcp_sigma > 0.0)]
    told = float(np.median(rows)) if len(rows) else options.tcp_sigma
    return sensor, np.full(3, max(told, 1e-9))


def noise_at(
    evaluated: Evaluated, channels: Sequence[tuple[Channels, Channels]], x: np.ndarray
) -> tuple[tuple[Noise, Noise], ...]:
    """Channels with the model discrepancy that the sensitivities at x give."""
    tau = evaluated.problem.options.form_tolerance
    relative = [k for k, p in enumerate(evaluated.problem.parameters) if p.scale == "log"]
    per_unit = tau / evaluated.problem.scale[relative]
    result = []
    for run, own, (T, w), (dT, dw) in zip(
        evaluated.problem.runs, channels, evaluated.outputs(x), evaluated.jacobian(x), strict=True
    ):
        rise = np.concatenate([dT[:, :, relative] * per_unit, tau * (T - run.start)[:, :, None]], axis=2)
        rise = np.where(np.isfinite(run.measured.temperature)[:, :, None], rise, np.nan)
        grown = np.concatenate([dw[:, :, relative] * per_unit, tau * w[:, :, None]], axis=2)
        grown = np.where(np.isfinite(run.measured.tcp)[:, :, None], grown, np.nan)
        result.append((Noise(own[0], rise), Noise(own[1], grown)))
    return tuple(result)


def whitened_jacobian(evaluated: Evaluated, noise: tuple[tuple[Noise, Noise], ...], x: np.ndarray) -> np.ndarray:
    """d(whitened outputs)/dx (m, n) of all runs; rows of missing measurements are zero."""
    rows = []
    for (T, w), (sensors, tcp), run in zip(evaluated.jacobian(x), noise, evaluated.problem.runs, strict=True):
        T = np.where(np.isfinite(run.measured.temperature)[:, :, None], T, np.nan)
        w = np.where(np.isfinite(run.measured.tcp)[:, :, None], w, np.nan)
        rows += [part.reshape(-1, len(x)) for part in (sensors.whiten(T), tcp.whiten(w))]
    return np.vstack(rows)


def information(evaluated: Evaluated, noise: tuple[tuple[Noise, Noise], ...], x: np.ndarray) -> np.ndarray:
    """J^T J (n, n) of the data at x, in prior standard deviations."""
    J = whitened_jacobian(evaluated, noise, x)
    return np.asarray(J.T @ J)
