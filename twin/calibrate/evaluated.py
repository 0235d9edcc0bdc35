"""Residuals of a problem, what they are weighed with, and their whitened Jacobian."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from twin.calibrate.noise import Channels, Noise
from twin.calibrate.problem import FitRun, Problem

Pairs = list[tuple[np.ndarray, np.ndarray]]  # per run: of temperatures (b, s, ...), of TCP (k, 3, ...)


class Evaluated:
    """A problem that remembers its last outputs and Jacobian: solver, noise and covariance ask at the same place."""

    def __init__(self, problem: Problem):
        self.problem = problem
        self._last: dict[str, tuple[bytes, Pairs]] = {}

    def outputs(self, x: np.ndarray) -> Pairs:
        """As `Problem.outputs`."""
        return self._ask("outputs", self.problem.outputs, x)

    def jacobian(self, x: np.ndarray) -> Pairs:
        """As `Problem.jacobian`."""
        return self._ask("jacobian", self.problem.jacobian, x)

    def residuals(self, x: np.ndarray) -> Pairs:
        """Per run measured minus simulated: (b, s) K and (k, 3) m; NaN where nothing was measured."""
        return [
            (run.measured.temperature - T, run.measured.tcp - w)
            for run, (T, w) in zip(self.problem.runs, self.outputs(x), strict=True)
        ]

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
    told = options.tcp_sigma if m.tcp_sigma is None or not len(m.tcp_sigma) else float(np.median(m.tcp_sigma))
    return sensor, np.full(3, max(told, 1e-9))


def noise_at(
    evaluated: Evaluated, channels: Sequence[tuple[Channels, Channels]], x: np.ndarray
) -> tuple[tuple[Noise, Noise], ...]:
    """Channels with the errors of form that the sensitivities at x give."""
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
        result.append((Noise(own[0], rise), Noise(own[1], grown)))
    return tuple(result)


def whitened_jacobian(evaluated: Evaluated, noise: tuple[tuple[Noise, Noise], ...], x: np.ndarray) -> np.ndarray:
    """d(whitened outputs)/dx (m, n) of all runs; rows of missing measurements are zero."""
    rows = []
    for (T, w), (sensors, tcp), run in zip(evaluated.jacobian(x), noise, evaluated.problem.runs, strict=True):
        T = np.where(np.isfinite(run.measured.temperature)[:, :, None], T, np.nan)
        rows += [part.reshape(-1, len(x)) for part in (sensors.whiten(T), tcp.whiten(w))]
    return np.vstack(rows)


def information(evaluated: Evaluated, noise: tuple[tuple[Noise, Noise], ...], x: np.ndarray) -> np.ndarray:
    """J^T J (n, n) of the data at x, in prior standard deviations."""
    J = whitened_jacobian(evaluated, noise, x)
    return np.asarray(J.T @ J)
