"""How well a proposed network predicts runs that it was not fitted to, beside ridge regression and beside nothing.

Of the training runs each is predicted by a fit to the others, by the network and by the regression alike; sealed runs
are predicted by the fit to all. The regression has the same temperatures as rises over their first readings, its
strength by cross-validation over the runs (`twin.calibrate.score.regression`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.calibrate.members.driver import drivers_of
from twin.calibrate.members.evidence import Sums, explain, total
from twin.calibrate.members.find import Found, thinned
from twin.calibrate.members.responses import Candidate, responses
from twin.calibrate.score.bootstrap import Difference, rms_difference
from twin.calibrate.score.regression import fit_ridge
from twin.errors import LogError
from twin.logs.run import Run

AXES = ("dx", "dy", "dz")


@dataclass(frozen=True)
class Predicted:
    """One run, one axis; k rows."""

    run: str
    part: str  # "left out" or "sealed"
    axis: str
    time: np.ndarray  # (k,) s
    measured: np.ndarray  # (k,) m
    network: np.ndarray  # (k,) m
    ridge: np.ndarray  # (k,) m


@dataclass(frozen=True)
class Figure:
    """rms over all rows of a part [m], and how sure the network's advantage over the regression is."""

    part: str
    axis: str
    zero: float
    ridge: float
    network: float
    difference: Difference  # network less ridge


@dataclass(frozen=True)
class Follows:
    """What a temperature follows best, of everything else that was logged."""

    column: str
    by: Candidate
    share: float  # of its mean square that this explains


def predictions(found: Found, runs: Sequence[Run], sealed: Sequence[Run]) -> tuple[Predicted, ...]:
    """Every run by a fit that did not see it. Raises LogError for sealed runs that lack a column."""
    tried = tuple(m.candidate for m in found.members)
    e = found.selected.explained
    every = tuple(range(len(tried)))
    fitted = [_rows(run, tried, found.axes) for run in runs]
    sums = [Sums.of(y, np.zeros((*y.shape, 0)), F) for y, F, _ in (_thin(r) for r in fitted)]
    names = [d.column for d in drivers_of(runs) if d.is_temperature]
    rises = [_rises(run, names, r[2]) for run, r in zip(runs, fitted, strict=True)]
    made: list[Predicted] = []
    for k, run in enumerate(runs):
        if len(runs) < 2:
            break
        others = [i for i in range(len(runs)) if i != k]
        a = explain(total([sums[i] for i in others]), every, e.scale, e.noise).a
        ridge = _ridge([fitted[i] for i in others], [rises[i] for i in others], rises[k])
        made += _predicted(run, "left out", found.axes, fitted[k], a, ridge)
    for run in sealed:
        missing = [d.column for d in dict.fromkeys(c.driver for c in tried) if not _has(run, d.column)]
        if missing:
            raise LogError(
                f"no column {', '.join(missing)}", str(run.folder), "the network follows it: give a log that has it"
            )
        rows = _rows(run, tried, found.axes)
        made += _predicted(run, "sealed", found.axes, rows, e.a, _ridge(fitted, rises, _rises(run, names, rows[2])))
    return tuple(made)


def figures(made: Sequence[Predicted]) -> tuple[Figure, ...]:
    """Pooled over the runs of a part, per axis."""
    result = []
    for part, axis in dict.fromkeys((p.part, p.axis) for p in made):
        own = [p for p in made if (p.part, p.axis) == (part, axis)]
        lengths = [[np.abs(p.measured - getattr(p, name)) for p in own] for name in ("network", "ridge")]
        zero, ridge, network = (
            float(np.sqrt(np.mean(np.concatenate(values) ** 2)))
            for values in ([p.measured for p in own], lengths[1], lengths[0])
        )
        result.append(Figure(part, axis, zero, ridge, network, rms_difference(lengths[0], lengths[1])))
    return tuple(result)


def follows(runs: Sequence[Run], tried: Sequence[Candidate]) -> tuple[Follows, ...]:
    """For every temperature the one body of one lag, of all that do not follow itself, whose rise resembles it most."""
    times = [
        run.loads.time[:: max(1, round(600.0 / max(float(np.median(np.diff(run.loads.time))), 1e-9)))] for run in runs
    ]
    F = np.vstack([responses(run, tried, t) for run, t in zip(runs, times, strict=True)])
    result = []
    for name in [d.column for d in drivers_of(runs) if d.is_temperature]:
        y = np.concatenate([_rises(run, [name], t)[:, 0] for run, t in zip(runs, times, strict=True)])
        other = [k for k, c in enumerate(tried) if c.driver.column != name]
        if not other:
            continue
        share = (F[:, other].T @ y) ** 2 / np.maximum((F[:, other] ** 2).sum(axis=0) * (y @ y), 1e-30)
        best = int(np.argmax(share))
        result.append(Follows(name, tried[other[best]], float(share[best])))
    return tuple(result)


_Fitted = tuple[np.ndarray, np.ndarray, np.ndarray]  # y (k, m) m, F (k, c) K, time (k,) s


def _rows(run: Run, tried: Sequence[Candidate], axes: Sequence[int]) -> _Fitted:
    if run.tcp is None:
        raise LogError("no displacements", str(run.folder), "nothing can be judged: give a log with displacements")
    y = run.tcp.displacement[:, list(axes)]
    good = np.isfinite(y).all(axis=1)
    if not good.any():
        raise LogError("no displacements", str(run.folder), "nothing can be judged: give a log with displacements")
    time = run.tcp.time[good]
    return y[good] - y[good][0], responses(run, tried, time), time


def _thin(rows: _Fitted) -> _Fitted:
    y, F, time = rows
    kept = thinned(time)
    return y[kept], F[kept], time[kept]


def _has(run: Run, column: str) -> bool:
    return column in run.loads.columns or (run.temperatures is not None and column in run.temperatures.columns)


def _rises(run: Run, names: Sequence[str], time: np.ndarray) -> np.ndarray:
    """(k, f) K over the first reading."""
    found = np.zeros((len(time), len(names)))
    for k, name in enumerate(names):
        table = run.temperatures if run.temperatures is not None and name in run.temperatures.columns else run.loads
        values = table.columns[name]
        good = np.isfinite(values)
        at = np.interp(time, table.time[good], values[good])
        found[:, k] = at - values[good][0]
    return found


def _ridge(fitted: Sequence[_Fitted], rises: Sequence[np.ndarray], wanted: np.ndarray) -> np.ndarray:
    """(k, m) m at rises (k, f): every axis with a strength of its own."""
    kept = [thinned(r[2]) for r in fitted]
    x = np.concatenate([rise[k] for rise, k in zip(rises, kept, strict=True)])
    y = np.concatenate([r[0][k] for r, k in zip(fitted, kept, strict=True)])
    groups = np.repeat(np.arange(len(fitted)), [len(k) for k in kept])
    return np.column_stack([fit_ridge(x, y[:, a], groups)(wanted)[:, 0] for a in range(y.shape[1])])


def _predicted(
    run: Run, part: str, axes: Sequence[int], rows: _Fitted, a: np.ndarray, ridge: np.ndarray
) -> list[Predicted]:
    y, F, time = rows
    return [
        Predicted(run.folder.name, part, AXES[axis], time, y[:, k], F @ a[k], ridge[:, k])
        for k, axis in enumerate(axes)
    ]
