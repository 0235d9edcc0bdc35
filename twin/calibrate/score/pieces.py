"""A run as scores and baselines see it: TCP measurements in rows, temperatures at those rows and on a grid of times.

A run of several segments may be one test in phases, or several tests in one log without the cooling between them. The
latter are pieces with states of their own (erratum E-003-7).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.calibrate.score.compare import TCP, Channel
from twin.errors import LogError
from twin.logs.run import Run, Segment, Table, Tcp
from twin.nearest import did_you_mean

MOST_GRID_POINTS = 20_000


@dataclass(frozen=True)
class Rows:
    """n measurements of the TCP in the order of time; NaN: that component was not measured."""

    time: np.ndarray  # (n,) s
    position: np.ndarray  # (n, n_axes) m
    measured: np.ndarray  # (n, 3) m
    simulated: np.ndarray  # (n, 3) m
    sigma: np.ndarray  # (n,) m

    def __len__(self) -> int:
        return len(self.time)

    def part(self, rows: np.ndarray) -> Rows:
        """Some of the rows, by mask or index."""
        return Rows(self.time[rows], self.position[rows], self.measured[rows], self.simulated[rows], self.sigma[rows])


@dataclass(frozen=True)
class Piece:
    """One test: a run, or one of several in a log."""

    run: Run
    name: str
    rows: Rows
    reference: float | None  # s, the time that deviations count from; None: absolute

    def temperatures(self, names: Sequence[str], time: np.ndarray) -> np.ndarray:
        """(n, len(names)) of temperatures.csv, else of loads.csv: the last value measured by each time, the first one
        before it. No value from later than `time` is used after that."""
        return np.column_stack([_held(*_column(self.run, name), time) for name in names])


def split(run: Run, restart: bool) -> tuple[tuple[Run, tuple[Segment, ...]], ...]:
    """The tests of a run with the segments in which each is scored; the whole of it where there are none.

    restart: every segment is a test of its own, a run with only its own rows.
    """
    if not run.segments:
        return ((run, (Segment("all", -np.inf, np.inf),)),)
    if not restart:
        return ((run, run.segments),)
    return tuple((_cut(run, s), (s,)) for s in run.segments)


def members(segments: Sequence[Segment], time: np.ndarray) -> list[np.ndarray]:
    """Which rows (n,) bool lie in each segment; where one ends and another starts, in the later one alone."""
    starts = [s.start for s in segments]
    return [(time >= s.start) & ((time < s.end) | ((time == s.end) & (s.end not in starts))) for s in segments]


def rows_of(found: Sequence[Channel], uncertainty: float) -> Rows:
    """The TCP channels of one run beside each other; sigma is `uncertainty` [m] where the log has none."""
    tcp = [c for c in found if c.kind == "tcp"]
    index = np.unique(np.concatenate([c.row for c in tcp])) if tcp else np.zeros(0, dtype=int)
    n, axes = len(index), (tcp[0].position.shape[1] if tcp else 0)
    rows = Rows(np.zeros(n), np.zeros((n, axes)), np.full((n, 3), np.nan), np.full((n, 3), np.nan), np.zeros(n))
    for c in tcp:
        at, axis = np.searchsorted(index, c.row), TCP.index(c.name)
        rows.time[at], rows.position[at] = c.time, c.position
        rows.measured[at, axis], rows.simulated[at, axis] = c.measured, c.simulated
        known = np.full(len(at), np.nan) if c.sigma is None else c.sigma
        rows.sigma[at] = np.where(np.isfinite(known) & (known > 0.0), known, uncertainty)
    return rows.part(np.argsort(rows.time, kind="stable"))


def on_grid(piece: Piece, names: Sequence[str], dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Inputs (g, m) and deviations (g, 3) [m] every dt [s] from the first measurement on, both relative to it, and the
    grid point (n,) of every row; NaN where nothing was measured, means where more than one was."""
    time = piece.rows.time
    first = time[0] if piece.reference is None else piece.reference
    at = np.round((time - first) / dt).astype(int)
    u = piece.temperatures(names, first + dt * np.arange(at.max() + 1))
    known = np.isfinite(piece.rows.measured)
    total, count = np.zeros((len(u), 3)), np.zeros((len(u), 3))
    np.add.at(total, at, np.where(known, piece.rows.measured, 0.0))
    np.add.at(count, at, known)
    with np.errstate(invalid="ignore"):
        y = total / np.where(count > 0, count, np.nan)
    return u - u[0], y - (offset(piece) if piece.reference is None else 0.0), at


def offset(piece: Piece) -> np.ndarray:
    """(3,) m: the first measurement of each component; zero where it was never measured."""
    known = np.isfinite(piece.rows.measured)
    first = piece.rows.measured[np.argmax(known, axis=0), np.arange(3)]
    return np.where(known.any(axis=0), first, 0.0)


def spacing(rows: Rows) -> float:
    """Median time between measurements [s]; NaN for fewer than two times."""
    times = np.unique(rows.time)
    return float(np.median(np.diff(times))) if len(times) > 1 else float("nan")


def input_names(runs: Sequence[Run], wanted: Sequence[str] = ()) -> tuple[str, ...]:
    """Columns that have a value in every run: of `wanted` those, else all temperatures.

    Raises LogError for a wanted one that a run lacks.
    """
    tables = [run.temperatures.columns if run.temperatures else {} for run in runs]
    if not wanted:
        shared = [name for name in (tables[0] if tables else ()) if all(name in t for t in tables)]
        return tuple(name for name in shared if all(np.isfinite(t[name]).any() for t in tables))
    for run, table in zip(runs, tables, strict=True):
        for name in wanted:
            known = [*table, *run.loads.columns]
            if name not in known or not np.isfinite(_column(run, name)[1]).any():
                raise LogError(f"no values of '{name}'", str(run.folder), did_you_mean(name, known, "columns"))
    return tuple(wanted)


def _column(run: Run, name: str) -> tuple[np.ndarray, np.ndarray]:
    table = run.temperatures if run.temperatures is not None and name in run.temperatures.columns else run.loads
    return table.time, table.columns[name]


def _held(at: np.ndarray, values: np.ndarray, time: np.ndarray) -> np.ndarray:
    known = np.isfinite(values) & np.isfinite(at)
    return values[known][np.clip(np.searchsorted(at[known], time, side="right") - 1, 0, None)]


def _cut(run: Run, segment: Segment) -> Run:
    def inside(time: np.ndarray) -> np.ndarray:
        return members(run.segments, time)[run.segments.index(segment)]

    tcp, temperatures = run.tcp, run.temperatures
    if tcp is not None:
        rows = inside(tcp.time)
        sigma = None if tcp.sigma is None else tcp.sigma[rows]
        tcp = Tcp(tcp.time[rows], tcp.axes, tcp.position[rows], tcp.displacement[rows], sigma, tcp.naive)
    if temperatures is not None:
        temperatures = _rows(temperatures, inside(temperatures.time))
    # loads up to the end, and from the row on that still holds at the start
    loads = (run.loads.time >= segment.start) & (run.loads.time <= segment.end)
    first = int(np.argmax(loads))
    if loads.any() and first > 0 and run.loads.time[first] > segment.start:
        loads[first - 1] = True
    return replace(run, loads=_rows(run.loads, loads), temperatures=temperatures, tcp=tcp, segments=(segment,))


def _rows(table: Table, rows: np.ndarray) -> Table:
    return Table(table.time[rows], {k: v[rows] for k, v in table.columns.items()}, table.units, table.naive)
