"""What no verb may read: clocks and rates with which results would be wrong, and nobody would see it."""

from __future__ import annotations

import numpy as np

from twin.errors import Problem
from twin.logs.found import at, times
from twin.logs.run import Run, Table
from twin.units import LARGEST

_LEAST = 10  # rows before their distance is compared with the stated sampling
_CLOCK_SLIPS = (60.0, 1000.0, 3600.0, 6e4, 1e6)  # minutes, milliseconds, hours, ms for min, microseconds
_COUNTERS = {  # s after which a clock of 32 bit starts again
    2.0**32 / 1e3: "milliseconds", 2.0**31 / 1e3: "milliseconds", 2.0**32 / 1e6: "microseconds",
    2.0**31 / 1e6: "microseconds", 2.0**16 / 1e3: "milliseconds",
}  # fmt: skip


def refusals(run: Run) -> list[Problem]:
    """Errors, each with file and line: times that do not increase, tables of other times, rates 60 or 1000 off, values
    beyond all reason.

    What can be refused without the numbers is refused on reading already: times without a zone or in the hour of a
    clock change, mixed decimal marks, rows cut short.
    """
    problems = []
    for name, table in tables_of(run).items():
        where = str(run.folder / f"{name}.csv")
        problems += _order(table, where, run.tcp.axes if run.tcp is not None and name == "tcp" else ())
        problems += _beyond(table, where)
        if name != "loads":
            problems += _overlap(table, run.loads, where)
    problems += rate_problems(run)
    return problems


def tables_of(run: Run) -> dict[str, Table]:
    """The tables of a run by the names of their files; tcp.csv with positions and deviations as columns [m]."""
    tables = {"loads": run.loads}
    if run.temperatures is not None:
        tables["temperatures"] = run.temperatures
    if run.tcp is not None:
        columns = {**{a: run.tcp.position[:, k] for k, a in enumerate(run.tcp.axes)},
                   **{d: run.tcp.displacement[:, k] for k, d in enumerate(("dx", "dy", "dz"))
                      if np.isfinite(run.tcp.displacement[:, k]).any()}}  # fmt: skip
        if run.tcp.sigma is not None:
            columns["sigma"] = run.tcp.sigma
        tables["tcp"] = Table(run.tcp.time, columns, dict.fromkeys(columns, "m"), run.tcp.naive)
    return tables


def usual_step(table: Table) -> float:
    """The median distance of rows [s], of those whose time increases; 0 where there are none."""
    step = np.diff(table.time)
    forward = step[step > 0.0]
    return float(np.median(forward)) if len(forward) else 0.0


def _order(table: Table, where: str, axes: tuple[str, ...]) -> list[Problem]:
    step = np.diff(table.time)
    back, same = np.flatnonzero(step < 0.0) + 1, np.flatnonzero(step == 0.0) + 1
    problems = []
    if len(back):
        restart = _restart(table, int(back[0])) if len(back) <= 3 else ""
        remedy = "split the log where its clock was set" if restart else "sort the rows, or log times that increase"
        problems.append(Problem(f"time runs backwards, {times(len(back))}{restart}", at(where, back), remedy))
    if len(same) and axes:  # one moment, several places: measured by several probes, or computed
        places = np.column_stack([table.columns[a] for a in axes])
        same = same[(places[same] == places[same - 1]).all(axis=1)]
    if len(same):
        values = np.column_stack([np.nan_to_num(v) for v in table.columns.values()] or [table.time])
        alike = int(np.count_nonzero((values[same] == values[same - 1]).all(axis=1)))
        rows = "with equal values" if alike == len(same) else f"{len(same) - alike} with other values"
        what = f"the same time twice, {times(len(same))}, {rows}"
        problems.append(Problem(what, at(where, same), "remove duplicated rows; log times fine enough to differ"))
    return problems


def _beyond(table: Table, where: str) -> list[Problem]:
    """Values that no quantity has: the square of one is no number any more."""
    problems = []
    for name, values in table.columns.items():
        rows = np.flatnonzero(np.abs(values) > LARGEST)  # NaN, a missing value, is not
        if len(rows):
            what = f"'{name}' is {values[rows[0]]:g} {table.units.get(name, '')}, {times(len(rows))}".replace(" ,", ",")
            problems.append(
                Problem(f"{what}: beyond all reason", at(where, rows), "correct the cell, or leave it empty")
            )
    return problems


def _restart(table: Table, row: int) -> str:
    """How the clock of a log started anew at `row`, where that is what it looks like."""
    before, after = float(table.time[row - 1]), float(table.time[row])
    for period, unit in _COUNTERS.items():
        if abs(before - after - period) < 0.01 * period:
            return f": from {before:g} to {after:g} s, as a 32-bit or 16-bit counter of {unit} does"
    if before - after > 0.5 * (before - float(table.time[0])) and row >= 3:
        return f": the clock starts again, from {before:g} to {after:g} s"
    if abs(before - after - 3600.0) < 60.0:
        return f": by an hour, from {before:g} to {after:g} s, as at a clock change"
    return ""


def _overlap(table: Table, loads: Table, where: str) -> list[Problem]:
    if len(loads.time) < 2 or (table.time.min() <= loads.time.max() and table.time.max() >= loads.time.min()):
        return []
    return [
        Problem(
            f"times {table.time[0]:g} .. {table.time[-1]:g} s lie outside the loads'"
            f" {loads.time[0]:g} .. {loads.time[-1]:g} s",
            where,
            "check start and zone in run.toml: all tables count from there",
        )
    ]


def rate_problems(run: Run) -> list[Problem]:
    """Rows a factor 60, 1000 or 3600 nearer or farther than run.toml says: one of the two has the wrong unit."""
    usual = usual_step(run.loads)
    if not run.sampling or usual == 0.0 or len(run.loads.time) < _LEAST:
        return []
    ratio = max(usual / run.sampling, run.sampling / usual)
    if not any(abs(ratio / factor - 1.0) < 0.02 for factor in _CLOCK_SLIPS):
        return []
    return [
        Problem(
            f"rows are {usual:g} s apart, run.toml says {run.sampling:g} s: a factor {ratio:.4g}",
            str(run.folder / "loads.csv"),
            "a factor 1000 is milliseconds, 60 is minutes: fix the unit of 'time', or sampling in run.toml",
        )
    ]
