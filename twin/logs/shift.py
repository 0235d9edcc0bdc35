"""Channels shifted against each other by a row: within the loads, and loads against temperatures.

A file joined from two sources, or an input read one interval late, is the commonest silent fault of a log. It shows by
correlation: of changes between channels of one drive; of temperatures with what heats.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import qr
from scipy.signal import lfilter

from twin.errors import Problem
from twin.logs.channels import DRIVES, MOVES, pairs
from twin.logs.found import held, warning
from twin.logs.refuse import usual_step
from twin.logs.run import Run, Table

_REACH = 3  # rows looked to either side
_LEAST = 40  # changes, or intervals
_PAST = 8  # intervals back, to tell a period from a shift
_LONGEST = 4_000  # intervals looked at
_SLOW = 30.0  # intervals
_FORESEES = 1.4  # by which the unexplained must fall for a temperature to be called early
_SHARP = 2.5  # the same from one lag to the next, for a sensor quick enough to tell a delay from a shift
_CONSTANTS, _HEATS = 6, 6  # time constants, and combinations of loads, that temperatures are explained with


def drive_shifts(loads: Table, where: str) -> list[Problem]:
    """Warnings about speeds, currents, torques and powers of one drive whose changes coincide some rows apart only."""
    problems = []
    for a, b in pairs(loads, MOVES, ("1/s", *DRIVES)):
        if loads.units[a] == "1/s" and loads.units[b] == "1/s":
            continue
        x, y = (np.diff(np.abs(held(loads.columns[c]))) for c in (a, b))
        if min(np.count_nonzero(x), np.count_nonzero(y)) < _LEAST:
            continue
        found = {lag: _coincidence(x, y, lag) for lag in range(-_REACH, _REACH + 1)}
        best = max(found, key=lambda lag: found[lag])
        rigid = loads.units[a] != loads.units[b] == "1/s"  # an axis and its motor: what they leave open is rounding
        apart = found[0] < 0.6 * found[best] or (rigid and 1.0 - found[0] > max(1e-3, 4.0 * (1.0 - found[best])))
        if best != 0 and found[best] > 0.7 and apart:
            late = f"{abs(best)} row(s) {'after' if best > 0 else 'before'}"
            what = f"'{b}' changes {late} '{a}' (correlation of changes {found[best]:.2f}, in one row {found[0]:.2f})"
            problems.append(warning(what, where, "were columns of two sources joined? shift one back"))
    return problems


def _coincidence(x: np.ndarray, y: np.ndarray, lag: int) -> float:
    n = len(x) - abs(lag)
    a, b = (x[:n], y[lag:]) if lag >= 0 else (x[-lag:], y[:n])
    aa, bb, ab = (float(np.einsum("i,i->", *pair)) for pair in ((a, a), (b, b), (a, b)))
    return ab / np.sqrt(aa * bb) if 0.0 < aa * bb < np.inf else 0.0


def table_shifts(run: Run) -> list[Problem]:
    """Warnings about temperatures.csv standing some intervals early or late against loads.csv."""
    if run.temperatures is None:
        return []
    where = str(run.folder / "temperatures.csv")
    # computed temperatures of the air are those of the step that ends with their time
    held_back = -1 if "temperatures" in run.synthetic else 0
    return _twice_logged(run.loads, run.temperatures, held_back, where) or _answers(run.loads, run.temperatures, where)


def _twice_logged(loads: Table, temperatures: Table, latest: int, where: str) -> list[Problem]:
    """A temperature in both tables shows the shift directly. latest: intervals that it may plausibly be late, as -1."""
    step = max(usual_step(loads), usual_step(temperatures))
    problems = []
    for name in loads.columns.keys() & temperatures.columns.keys():
        if loads.units[name] != "degC" or step == 0.0:
            continue
        inside = temperatures.time[
            (temperatures.time - _REACH * step >= loads.time[0]) & (temperatures.time + _REACH * step <= loads.time[-1])
        ]
        theirs = np.diff(np.interp(inside, temperatures.time, held(temperatures.columns[name])))
        if np.count_nonzero(theirs) < _LEAST:
            continue
        ours = held(loads.columns[name])
        apart = {
            lag: float(np.sum((np.diff(np.interp(inside + lag * step, loads.time, ours)) - theirs) ** 2))
            for lag in range(-_REACH, _REACH + 1)
        }
        best = min(apart, key=lambda lag: apart[lag])
        if not latest <= best <= 0 and apart[best] < 0.3 * min(apart[lag] for lag in range(latest, 1)):
            late = f"{abs(best)} interval(s) of {step:g} s {'late' if best < 0 else 'early'}"
            what = f"'{name}' is {late} against the same channel in loads.csv"
            problems.append(warning(what, where, "shift one table; do both count from the same start?"))
    return problems


def _answers(loads: Table, temperatures: Table, where: str) -> list[Problem]:
    """Temperatures explained by what heats, at lags from -_PAST intervals (they answer late) to _REACH (they foresee).

    Per lag, least squares of each temperature on the heat-like loads sent through first-order lags of several time
    constants, from below an interval up, all of it without what is slower than _SLOW intervals. To foresee a load is
    impossible; to answer in whole intervals late, and sharply then, is not what conduction looks like.
    """
    step = max(usual_step(loads), usual_step(temperatures))
    names = [
        n for n, v in temperatures.columns.items()
        if n not in loads.columns and np.isfinite(v).any() and np.ptp(held(v)) > 0.0
    ]  # fmt: skip
    if step == 0.0 or not names:
        return []
    first, last = max(loads.time[0], temperatures.time[0]), min(loads.time[-1], temperatures.time[-1])
    time = first + step * np.arange(min(int((last - first) / step * (1.0 + 1e-9)) + 1, _LONGEST))
    heats = _heat_like(loads, time)
    if len(time) < 4 * _LEAST or not heats.size:
        return []
    T = np.column_stack([np.interp(time, temperatures.time, held(temperatures.columns[n])) for n in names])
    constants = np.geomspace(0.7, len(time) / 3.0, _CONSTANTS)  # in intervals
    start = np.exp(-np.arange(len(time))[:, None] / constants)  # what is left of the state at the start
    X = np.hstack([_lagged(heats, constants), start])
    inner = slice(_PAST, len(time) - _REACH)
    y = _fast(T)[inner]
    fast = _fast(X)
    left = {}
    for lag in range(-_PAST, _REACH + 1):
        rows = slice(_PAST + lag, len(time) - _REACH + lag)
        left[lag] = _residual(fast[rows], y)
    return _verdict(left, np.sum((y - y.mean(axis=0)) ** 2, axis=0), names, step, where)


def _lagged(heats: np.ndarray, constants: np.ndarray) -> np.ndarray:
    """heats (n, k), means over the intervals that end with each time, through 1/(1 + tau s) for each of the constants
    [intervals]: (n, k n_constants)."""
    keep = np.exp(-1.0 / constants)
    return np.hstack([lfilter([1.0 - a], [1.0, -a], heats, axis=0) for a in keep])


def _fast(values: np.ndarray) -> np.ndarray:
    """values (n, k) without what changes slower than _SLOW intervals."""
    a = np.exp(-1.0 / _SLOW)
    return np.asarray(lfilter([0.5 * (1.0 + a), -0.5 * (1.0 + a)], [1.0, -a], values - values[:1], axis=0))


def _verdict(
    left: dict[int, np.ndarray], total: np.ndarray, names: list[str], step: float, where: str
) -> list[Problem]:
    """left: sums of squares (n_sensors,) unexplained, by lag; total: of the temperatures themselves."""
    early: list[tuple[float, int, int]] = []
    sharp: list[tuple[float, int, int]] = []
    for s in range(len(names)):
        by_lag = {lag: float(sums[s]) for lag, sums in left.items()}
        best = min(by_lag, key=lambda lag: by_lag[lag])
        if by_lag[best] > 0.5 * total[s]:
            continue
        if best > 0:
            early.append((min(v for lag, v in by_lag.items() if lag <= 0) / by_lag[best], s, best))
        if best < _REACH:
            sharp.append((by_lag[best + 1] / by_lag[best], s, best))
    gain, s, lag = max(early, default=(0.0, 0, 0))
    if gain > _FORESEES:
        what = f"'{names[s]}' answers the loads {lag} interval(s) of {step:g} s before they act"
        what += f" ({gain:.3g} times less of it is unexplained then)"
        return [warning(what, where, "temperatures stand early or loads late: shift one table")]
    sharp = [entry for entry in sharp if entry[0] > _SHARP]
    if not sharp or max(lag for _, _, lag in sharp) >= 0:
        return []
    gain, s, lag = max(sharp, key=lambda entry: (entry[2], entry[0]))
    what = (
        f"'{names[s]}', the quickest of the temperatures that tell, answers the loads {-lag} interval(s) of {step:g} s"
    )
    what += f" late, and sharply then ({gain:.3g} times less of it is unexplained than one interval sooner)"
    return [
        warning(what, where, "loads stand early or temperatures late: shift one table, if a sensor is near a source")
    ]


def _residual(X: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Sums of squares (n_sensors,) left of y (n, n_sensors) after X (n, k) and a constant."""
    X = np.hstack([X, np.ones((len(X), 1))])
    size = np.sqrt(np.sum(X * X, axis=0))
    Q, R, _ = qr(X / np.where(size > 0.0, size, 1.0), mode="economic", pivoting=True, check_finite=False)
    Q = Q[:, np.abs(np.diag(R)) > 1e-7]  # loads that change together leave columns without a direction of their own
    return np.asarray(np.maximum(np.sum((y - Q @ (Q.T @ y)) ** 2, axis=0), 1e-300))


def _heat_like(loads: Table, time: np.ndarray) -> np.ndarray:
    """What heats, as means over the intervals that end with each time, (n, k): squares of currents and torques, powers,
    magnitudes of speeds, air temperatures. Of many, the few combinations that vary most."""
    heats = []
    for name, unit in loads.units.items():
        values = held(loads.columns[name])
        if unit in ("A", "N*m"):
            q = values**2
        elif unit in ("W", *MOVES):
            q = np.abs(values)
        elif unit == "degC":
            q = values - values[0]
        else:
            continue
        largest = float(np.max(np.abs(q), initial=0.0))
        if not np.isfinite(largest) or largest == 0.0 or np.ptp(q) == 0.0:
            continue
        grown = np.concatenate([[0.0], np.cumsum(q[:-1] / largest * np.diff(loads.time))])
        mean = np.diff(np.interp(time, loads.time, grown)) / np.diff(time)
        heats.append(np.concatenate([mean[:1], mean]))
    if len(heats) <= _HEATS:
        return np.column_stack(heats) if heats else np.zeros((len(time), 0))
    U, s, _ = np.linalg.svd(np.column_stack(heats) - np.mean(heats, axis=1), full_matrices=False)
    return U[:, :_HEATS] * s[:_HEATS]
