"""Do speed channels agree with the position channels? Finds channels shifted by samples and off by a factor."""

from __future__ import annotations

import numpy as np

from twin.errors import Problem
from twin.logs.run import Table

_LAGS = range(-5, 7)  # samples by which the speed may come late
_HONEST = (0, 1)  # the speed of the interval that starts, or of the one that ended, with the sample
_LEAST = 30  # moving samples


def motion_problems(loads: Table, where: str) -> list[Problem]:
    """Warnings about speed columns [m/s] against the position column [m] that fits them best.

    loads.time must increase. Sampling must resolve the motion: where no position explains the speed with a correlation
    above 0.98 at any lag nothing is said.
    """
    positions = [name for name, unit in loads.units.items() if unit == "m"]
    speeds = [name for name, unit in loads.units.items() if unit == "m/s"]
    problems = []
    for speed in speeds:
        fits = [(*_best_lag(loads, position, speed), position) for position in positions]
        correlation, lag, factor, position = max(fits, default=(0.0, 0, 1.0, ""))
        if correlation < 0.98:
            continue
        if lag not in _HONEST:
            late = f"{lag - 1} sample(s) late" if lag > 0 else f"{-lag} sample(s) early"
            problems.append(
                Problem(
                    f"'{speed}' is {late} against '{position}'",
                    where,
                    "shift the column back in the logger",
                    warning=True,
                )
            )
        if not 0.8 < factor < 1.25:
            problems.append(
                Problem(
                    f"'{speed}' is {factor:.4g} times the speed of '{position}'",
                    where,
                    "check both units in the headers: a factor 60 is m/min, 1000 is mm",
                    warning=True,
                )
            )
    return problems


def _best_lag(loads: Table, position: str, speed: str) -> tuple[float, int, float]:
    """Correlation, lag and slope of the speed against the derivative of the position; (0, 0, 1) without motion."""
    moved = np.diff(loads.columns[position]) / np.diff(loads.time)
    logged = loads.columns[speed][:-1]
    if not np.nanmin(logged, initial=0.0) < 0.0:
        moved = np.abs(moved)  # an unsigned speed
    best = (0.0, 0, 1.0)
    for lag in sorted(_LAGS, key=lambda k: (k not in _HONEST, abs(k))):
        n = len(moved) - abs(lag)
        if n < _LEAST:
            break
        a, b = (moved[:n], logged[lag : lag + n]) if lag >= 0 else (moved[-lag:], logged[:n])
        use = np.isfinite(a) & np.isfinite(b)
        a, b = a[use], b[use]
        size = np.sqrt(np.sum(a**2) * np.sum(b**2))
        if np.count_nonzero(a) < _LEAST or size == 0.0:
            continue
        correlation = float(np.sum(a * b) / size)
        if correlation > best[0] + 0.01:  # a later lag must be clearly better
            best = (correlation, lag, float(np.sum(a * b) / np.sum(a**2)))
    return best
