"""The temperatures of several runs as one table of means over bins, and what cannot be a reading left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from twin.logs.faults.fault import Fault, Kind
from twin.logs.faults.find import faults_of
from twin.logs.faults.usable import BRIEF
from twin.logs.run import Run, Table

BINS = (600.0, 900.0, 1800.0, 3600.0)  # s: the first that leaves
MOST = 200  # rows or less: a judgement takes some seconds then
FEWEST = 12  # rows with this many bins: less than an hour says nothing about how channels belong together
EMPTIED: tuple[Kind, ...] = ("noise", "rail", "stuck")  # readings that are none, found in the run itself
STUCK = 1800.0  # s that a channel must stand still to be called stuck
_QUIET = 0.03  # K: no mean over a bin is better known
_NORMAL = 1.4826  # from a median of magnitudes to a standard deviation


@dataclass(frozen=True)
class Readings:
    """n bins of c channels, run after run."""

    names: tuple[str, ...]  # (c,)
    runs: int
    run: np.ndarray  # (n,) int, number of the run
    time: np.ndarray  # (n,) s since the run's start
    values: np.ndarray  # (n, c) degC, NaN where nothing was read
    noise: np.ndarray  # (c,) K, of a mean
    length: float  # s, of a bin

    def without(self, names: Sequence[str]) -> Readings:
        """The same with the readings of some channels emptied."""
        values = self.values.copy()
        values[:, [self.names.index(n) for n in names]] = np.nan
        return replace(self, values=values)


def emptied(run: Run) -> tuple[Run, tuple[Fault, ...]]:
    """The run without readings that are noise, rest at a limit, stand still or are repeated by a logger, and without
    all rows after a splice; and all faults of its temperatures, leaps too. Files and other tables are left as they are.
    """
    table = run.temperatures
    if table is None:
        return run, ()
    found = tuple(f for f in faults_of(run) if f.table == "temperatures" and _lasts(f))
    columns = {name: np.array(values, dtype=float) for name, values in table.columns.items()}
    for f in found:
        names = columns if f.kind == "splice" else f.channels if f.kind in (*EMPTIED, *BRIEF) else ()
        for name in names:
            columns[name][f.first_row : f.last_row + 1] = np.nan
    return replace(run, temperatures=replace(table, columns=columns)), found


def _lasts(f: Fault) -> bool:
    return f.kind != "stuck" or f.last_time - f.first_time >= STUCK


def readings(runs: Sequence[Run]) -> Readings | None:
    """Means over bins of every temperature that any of the runs has; None where there is too little to judge by.

    A bin counts where it has half of its rows; a row of the table where half of the channels are known.
    """
    tables = [(k, run.temperatures) for k, run in enumerate(runs) if run.temperatures is not None]
    names = tuple(dict.fromkeys(n for _, t in tables for n in t.columns if t.units[n] == "degC"))
    span = sum(float(np.ptp(t.time)) for _, t in tables if len(t.time))
    length = next((b for b in BINS if span / b <= MOST), BINS[-1])
    parts = [(k, *_binned(t, names, length)) for k, t in tables]
    if not parts or not names:
        return None
    run = np.concatenate([np.full(len(time), k) for k, time, _ in parts])
    time = np.concatenate([time for _, time, _ in parts])
    values = np.concatenate([v for *_, v in parts])
    known = np.isfinite(values).sum(axis=1) * 2 >= max(1, int(np.isfinite(values).any(axis=0).sum()))
    run, time, values = run[known], time[known], values[known]
    if len(time) < FEWEST:
        return None
    digits = np.array([_digit([t for _, t in tables], n) for n in names])
    noise = np.array([_noise(run, values[:, c]) for c in range(len(names))])
    return Readings(names, len(runs), run, time, values, np.maximum(np.hypot(noise, digits / 12**0.5), _QUIET), length)


def _binned(table: Table, names: Sequence[str], length: float) -> tuple[np.ndarray, np.ndarray]:
    """Middle times (b,) and the lower medians (b, c): a mean would hold readings from before and after a leap."""
    index = np.floor((table.time - table.time[0]) / length).astype(int)
    values = np.column_stack([table.columns.get(n, np.full(len(index), np.nan)) for n in names])
    edges = np.searchsorted(index, np.arange(int(index.max()) + 2))
    usual = float(np.median(np.diff(edges)))
    result = np.full((len(edges) - 1, len(names)), np.nan)
    for b, (first, last) in enumerate(pairwise(edges)):
        ordered = np.sort(values[first:last], axis=0)  # NaN last
        known = np.isfinite(ordered).sum(axis=0)
        enough = (2 * known >= last - first) & (2 * (last - first) >= usual) & (known > 0)
        middle = ordered[np.maximum(known - 1, 0) // 2, np.arange(len(names))] if last > first else np.nan
        result[b] = np.where(enough, middle, np.nan)
    return table.time[0] + (np.arange(len(result)) + 0.5) * length, result


def _digit(tables: Sequence[Table], name: str) -> float:
    """The smallest change that a channel ever shows."""
    columns = [t.columns[name] for t in tables if name in t.columns]
    change = np.abs(np.concatenate([np.diff(c[np.isfinite(c)]) for c in columns]))
    change = change[change > 1e-9]
    return float(change.min()) if len(change) else 0.0


def _noise(run: np.ndarray, values: np.ndarray) -> float:
    """By how much values typically depart from those before and after."""
    second = values[2:] - 2.0 * values[1:-1] + values[:-2]
    second = second[(run[2:] == run[:-2]) & np.isfinite(second)]
    return float(_NORMAL * np.median(np.abs(second)) / 6**0.5) if len(second) else 0.0
