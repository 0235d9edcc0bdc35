"""Do speed channels agree with the position channels? Finds channels shifted by samples and off by a factor."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from twin.errors import Problem
from twin.logs.channels import owner
from twin.logs.found import held, slip, warning
from twin.logs.run import Table

# Samples by which the speed comes late against the mean speed of the interval that starts with the sample. Whole ones
# compare with the mean over one interval, halves with that over two: what a speed at the sample itself is like.
_LAGS = tuple(k / 2 for k in range(-10, 13))
_PLAUSIBLE = (0.0, 0.5, 1.0)  # mean of the interval that starts, speed at the sample, mean of the interval that ended
_LEAST = 30  # moving samples
_SURE = 0.98  # correlation
_PATHS = {"m/s": ("m", 1.0), "rad/s": ("rad", 1.0), "1/s": ("rad", 0.5 / math.pi)}  # a speed's position, and scale


@dataclass(frozen=True)
class Fit:
    """A speed explained by a position."""

    position: str
    correlation: float
    lag: float  # samples by which the speed is late; see _LAGS
    factor: float  # logged speed over derivative of the position
    sharp: bool  # is the lag one sample off clearly worse?


def motion_problems(loads: Table, where: str) -> list[Problem]:
    """Warnings about speed columns [m/s, 1/s, rad/s] against the position column that fits them best.

    loads.time must increase. Sampling must resolve the motion: where no position explains the speed with a correlation
    above 0.98 at any lag nothing is said; `path_problems` of twin.logs.slips then still finds speeds that are too low.
    """
    fits = {speed: fit for speed in loads.columns if (fit := explained(loads, speed))}
    problems = []
    for speed, fit in fits.items():
        if fit.lag not in _PLAUSIBLE:
            shift = fit.lag - (0.5 if fit.lag % 1.0 else 1.0 if fit.lag > 0.0 else 0.0)
            late = f"{abs(shift):g} sample(s) {'late' if shift > 0.0 else 'early'}"
            problems.append(
                warning(f"'{speed}' is {late} against '{fit.position}'", where, "shift the column back in the logger")
            )
        if not 0.8 < fit.factor < 1.25:
            looks_like = slip(fit.factor)
            problems.append(
                warning(
                    f"'{speed}' is {fit.factor:.4g} times the speed of '{fit.position}'"
                    + (f", a factor {looks_like}" if looks_like else ""),
                    where,
                    "check both units in the headers: a factor 60 is m/min, 1000 is mm",
                )
            )
    return problems + _disagreement(fits, where)


def explained(loads: Table, speed: str) -> Fit | None:
    """The position that explains a speed best; None where none does, or where the column is no speed."""
    if loads.units[speed] not in _PATHS:
        return None
    unit, scale = _PATHS[loads.units[speed]]
    positions = [name for name, u in loads.units.items() if u == unit]
    own = [name for name in positions if owner(name) == owner(speed)]
    if loads.units[speed] == "1/s" and not own:
        return None  # a motor's speed: its angle is seldom logged
    fits = [fit for p in own or positions if (fit := _fit(loads, p, speed, scale))]
    best = max(fits, key=lambda f: f.correlation, default=None)
    return best if best is not None and best.correlation > _SURE else None


def _disagreement(fits: dict[str, Fit], where: str) -> list[Problem]:
    """Plausible lags that differ from axis to axis: one of the columns has slipped by a row."""
    sharp = {name: fit for name, fit in fits.items() if fit.sharp and fit.lag in _PLAUSIBLE}
    lags = sorted(fit.lag for fit in sharp.values())
    if len(lags) < 2 or lags[-1] - lags[0] < 1.0:
        return []
    usual = lags[len(lags) // 2]
    odd = [name for name, fit in sharp.items() if abs(fit.lag - usual) >= 1.0]
    what = f"speeds of some axes come one sample later than those of others ({', '.join(odd)})"
    return [warning(what, where, "were columns of several sources joined? shift them to one moment")]


def _fit(loads: Table, position: str, speed: str, scale: float) -> Fit | None:
    """The best lag of the speed against the derivative of the position; None without motion."""
    moved = scale * np.diff(loads.columns[position]) / np.diff(loads.time)
    logged = loads.columns[speed][:-1]
    if np.count_nonzero(moved) < _LEAST or np.count_nonzero(logged) < _LEAST:
        return None
    signed = bool(np.nanmin(logged, initial=0.0) < 0.0)
    if not signed:
        moved = np.abs(moved)  # an unsigned speed
    moved, logged = held(moved), held(logged)
    if not signed and max(_agreement(moved, logged, lag)[0] for lag in _LAGS[::2]) <= _SURE:
        return None  # the mean of two magnitudes is nearly constant where sampling does not resolve the motion
    found = {lag: _agreement(moved, logged, lag) for lag in _LAGS}
    plausible = max(_PLAUSIBLE, key=lambda lag: found[lag][0])
    best = max(_LAGS, key=lambda lag: found[lag][0])
    apart = 1.0 - found[plausible][0]  # any other lag must be clearly better than the best plausible one
    if best not in _PLAUSIBLE and (apart < 1e-3 or 1.0 - found[best][0] > 0.25 * apart):
        best = plausible
    others = [1.0 - found[lag][0] for lag in (best - 1.0, best + 1.0) if lag in found]
    sharp = min(others) > max(1e-3, 4.0 * (1.0 - found[best][0]))
    return Fit(position, found[best][0], best, found[best][1], sharp)


def _agreement(moved: np.ndarray, logged: np.ndarray, lag: float) -> tuple[float, float]:
    """Correlation and slope of the logged speed against the derivative of the position, `lag` samples earlier."""
    if lag % 1.0:
        moved = np.concatenate([moved[:1], 0.5 * (moved[1:] + moved[:-1])])
    k = math.floor(lag)
    n = len(moved) - abs(k)
    if n < _LEAST:
        return 0.0, 1.0
    a, b = (moved[:n], logged[k : k + n]) if k >= 0 else (moved[-k:], logged[:n])
    aa, bb, ab = (float(np.einsum("i,i->", *pair)) for pair in ((a, a), (b, b), (a, b)))
    if aa == 0.0 or bb == 0.0 or not math.isfinite(aa * bb):
        return 0.0, 1.0
    return ab / math.sqrt(aa * bb), ab / aa
