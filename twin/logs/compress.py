"""Load data compression for slow links: means over intervals that keep the heat (paper 001, module 1.02).

A mean current says little of the heat: 20 % duty at 10 A has a mean square of 20 A^2, while its mean squared is 4 A^2
(erratum E-001-4). So currents, forces and torques are compressed to rms, speeds to the mean of their magnitude, and
products such as torque times speed are taken before the mean. Losses ~ I^2 and ~ |v| of the compressed log are those
of the samples to the last digits; laws that bend otherwise see means, and positions within an interval are lost, of
which `dwell_shares` keeps what heat needs to know. Loads hold until the next sample and positions run linearly to it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from twin.errors import LogError
from twin.logs.run import Table

_RMS = {"A", "N", "N*m"}
_MAGNITUDE = {"m/s", "rad/s", "1/s"}
_WAY = {"m", "rad"}  # positions: where the interval starts
_POWER = {  # factors to W
    frozenset(("N", "m/s")): 1.0,
    frozenset(("N*m", "rad/s")): 1.0,
    frozenset(("N*m", "1/s")): 2.0 * np.pi,
    frozenset(("V", "A")): 1.0,
}


@dataclass(frozen=True)
class _Pieces:
    """The time axis cut at samples and at the edges of intervals."""

    sample: np.ndarray  # (p,) the sample that holds
    duration: np.ndarray  # (p,) s
    first: np.ndarray  # (k,) first piece of each interval

    def mean(self, values: np.ndarray) -> np.ndarray:
        """(k,) of held samples, without the missing ones; NaN where all are missing."""
        held = values[self.sample]
        there = np.isfinite(held)
        weight = np.where(there, self.duration, 0.0)
        total = np.add.reduceat(weight, self.first)
        with np.errstate(invalid="ignore"):
            return np.add.reduceat(np.where(there, held, 0.0) * weight, self.first) / total


def compress_loads(
    loads: Table,
    interval: float,
    products: Mapping[str, tuple[str, str]] | None = None,
    end: float | None = None,
) -> Table:
    """A log over complete intervals of `interval` [s] from its first sample on; times are their starts.

    products: new columns [W] as means of the product of two columns: {"x_power": ("x_torque", "x_speed")}.
    end [s]: when the last sample ceases to hold, one median spacing after it by default. Missing values (NaN) are left
    out of means.

    Raises LogError: times that do not increase, no complete interval, products of unknown columns or that are no power.
    """
    time = np.asarray(loads.time, dtype=float)
    if len(time) < 2 or not np.all(np.diff(time) > 0):
        raise LogError("times do not increase strictly", "loads", "run `twin check` on the run folder")
    end = float(time[-1] + np.median(np.diff(time))) if end is None else end
    count = int(np.floor((end - time[0]) / interval * (1.0 + 1e-12)))
    if count < 1:
        raise LogError(f"no interval of {interval:g} s is complete", "loads", "log longer, or average over less")
    return _over(loads, time[0] + interval * np.arange(count + 1), products or {})


def _over(loads: Table, edges: np.ndarray, products: Mapping[str, tuple[str, str]]) -> Table:
    """The log over the intervals between `edges` (k + 1,) [s], the first of them not before the log."""
    time = np.asarray(loads.time, dtype=float)
    pieces = _cut(time, edges)
    columns = {n: _compressed(pieces, time, edges, v, loads.units[n]) for n, v in loads.columns.items()}
    units = dict(loads.units)
    for name, (a, b) in products.items():
        unknown = [c for c in (a, b) if c not in loads.columns]
        if unknown:
            raise LogError(f"no column '{unknown[0]}'", "loads", f"columns are: {', '.join(loads.columns)}")
        factor = _POWER.get(frozenset((loads.units[a], loads.units[b])))
        if factor is None:
            what = f"'{a}' [{loads.units[a]}] times '{b}' [{loads.units[b]}] is no power"
            raise LogError(
                what, "loads", "multiply force and speed, torque and speed of rotation, or voltage and current"
            )
        columns[name], units[name] = factor * pieces.mean(loads.columns[a] * loads.columns[b]), "W"
    return Table(edges[:-1], columns, units, loads.naive)


def compress_stream(tables: Iterable[Table], interval: float, hold: Callable[[], float]) -> Iterator[Table]:
    """A whole log that comes in pieces, in bounded memory: means over every `interval` [s] from its first sample on.

    Unlike `compress_loads` nothing is dropped: the last interval ends with the log, complete or not, and a closing
    row there tells how long it is. That row has the values of the last sample (magnitudes of what is compressed to
    those), which hold after it as after the log itself. hold(): how long the last sample holds [s], asked at the end.
    Nothing comes of a log shorter than `interval`. Raises LogError as `compress_loads` does.
    """
    rest: Table | None = None
    complete = False
    for table in tables:
        whole = table if rest is None else _joined(rest, table)
        last = float(whole.time[-1])
        if last - whole.time[0] < interval:
            rest = whole
            continue
        done = compress_loads(whole, interval, end=last)
        yield done
        complete = True
        rest = _from(whole, float(done.time[-1] + interval))
    if rest is None:
        return
    start, held = float(rest.time[0]), hold()
    end = float(rest.time[-1]) + held
    sliver = 1e-3 * held  # POSIX stamps are rounded to 0.2 us: what that leaves is no interval
    count = int(np.floor((end - start + sliver) / interval))
    if not (complete or count):
        return
    edges = start + interval * np.arange(count + 1)
    if end - edges[-1] > sliver:
        edges = np.append(edges, end)
    if len(edges) > 1:
        edges[-1] = end
        yield _over(rest, edges, {})
    yield _closing(rest, float(edges[-1]))


def dwell_shares(time: np.ndarray, position: np.ndarray, edges: np.ndarray, borders: np.ndarray) -> np.ndarray:
    """Share of each interval that an axis spends between borders of its way, (k, n): exact for linear motion.

    time (m,) [s] increasing; position (m,); edges (k + 1,) [s] within the log or after it (the last position holds);
    borders (n + 1,) increasing. A rest on a border counts above it, on the last one below it. Rows sum to 1 less the
    time beyond the outer borders.
    """
    knots = np.union1d(time[(time > edges[0]) & (time < edges[-1])], edges)
    way = np.interp(knots, time, position)
    low, high = np.minimum(way[:-1], way[1:]), np.maximum(way[:-1], way[1:])
    length = high - low
    below = np.empty((len(low), len(borders)))  # share of each piece spent below each border
    for j, border in enumerate(borders):
        crossing = (border - low) / np.where(length > 0, length, 1.0)
        rests_below = border >= low if j == len(borders) - 1 else border > low
        below[:, j] = np.where(length > 0, np.clip(crossing, 0.0, 1.0), rests_below)
    duration = np.diff(knots)
    first = np.searchsorted(knots[:-1], edges[:-1])
    return np.add.reduceat(np.diff(below, axis=1) * duration[:, None], first, axis=0) / np.diff(edges)[:, None]


def _cut(time: np.ndarray, edges: np.ndarray) -> _Pieces:
    knots = np.union1d(time[(time > edges[0]) & (time < edges[-1])], edges)
    sample = np.searchsorted(time, knots[:-1], side="right") - 1
    return _Pieces(sample, np.diff(knots), np.searchsorted(knots[:-1], edges[:-1]))


def _compressed(pieces: _Pieces, time: np.ndarray, edges: np.ndarray, values: np.ndarray, unit: str) -> np.ndarray:
    if unit in _RMS:
        return np.sqrt(pieces.mean(values**2))
    if unit in _WAY:
        return np.interp(edges[:-1], time, values)
    return pieces.mean(np.abs(values) if unit in _MAGNITUDE else values)


def _closing(table: Table, end: float) -> Table:
    """One row at `end` [s] with the last sample, as it would be compressed over no time at all."""
    bare = _RMS | _MAGNITUDE
    last = {n: np.abs(v[-1:]) if table.units[n] in bare else v[-1:] for n, v in table.columns.items()}
    return Table(np.array([end]), last, table.units, table.naive)


def _joined(first: Table, then: Table) -> Table:
    if first.units != then.units:
        raise LogError("columns change within the log", "loads", "start a new log where the channels change")
    columns = {n: np.concatenate([v, then.columns[n]]) for n, v in first.columns.items()}
    return Table(np.concatenate([first.time, then.time]), columns, first.units, first.naive)


def _from(table: Table, start: float) -> Table:
    """The log from `start` on, which gets a row of its own: loads held, positions on their way."""
    holds = int(np.searchsorted(table.time, start, side="right")) - 1
    later = slice(holds + 1, None)
    columns = {}
    for name, values in table.columns.items():
        way = table.units[name] in _WAY
        columns[name] = np.append(np.interp(start, table.time, values) if way else values[holds], values[later])
    return Table(np.append(start, table.time[later]), columns, table.units, table.naive)
