"""The rhythm of a log: gaps, rows off the beat, rows only where something changed, clocks that count from elsewhere."""

from __future__ import annotations

import numpy as np

from twin.errors import Problem
from twin.logs.found import at, span, times, warning
from twin.logs.refuse import rate_problems, usual_step
from twin.logs.run import Run, Table

_GAP = 5.0  # usual steps; the runtime flags the same
_LOST = 1.5  # usual steps, where rows come by a regular beat
_LEAST = 30  # rows before a beat is looked for
_DAY = 86400.0  # s


def clock_problems(run: Run, name: str, table: Table, where: str) -> list[Problem]:
    """Warnings about the times of one table of a run, whose order is checked elsewhere (`refusals`)."""
    problems = []
    if table.naive:
        remedy = "they are read in the zone of run.toml; log the offset, for clocks change twice a year"
        problems.append(warning("times without a zone", where, remedy))
    problems += _begin(run, name, table, where)
    step = np.diff(table.time)
    usual = usual_step(table)
    if usual == 0.0 or not (step > 0.0).all():
        return problems
    if name == "loads" and run.sampling and not (0.9 < usual / run.sampling < 1.1 or rate_problems(run)):
        what = f"rows are {usual:g} s apart, run.toml says {run.sampling:g} s"
        problems.append(warning(what, where, "fix sampling in run.toml, or the unit of 'time'"))
    if name == "tcp":
        return problems  # measurements come when they come
    if changes_only(table):
        longest = int(np.argmax(step))
        what = (
            f"rows stand only where something changes: {usual:g} s apart as a rule, up to {step[longest]:g} s,"
            " and no row repeats the one before"
        )
        remedy = (
            "between two rows 'unchanged' and 'lost' look alike, loads are held and positions run straight from row to"
            " row: log at a fixed rate, or write a heartbeat row at least every minute and before each change"
        )
        return [*problems, warning(what, span(where, longest, longest + 1), remedy)]
    return [*problems, *_gaps(step, usual, name, where)]


def changes_only(table: Table) -> bool:
    """Is this the log of a subscription that reports changes? (OPC UA, analysers that store edges.)

    Rows at irregular times, each differing from the one before, most of them in a few channels only.
    """
    step = np.diff(table.time)
    n = len(table.columns)
    if len(step) < _LEAST or n == 0:
        return False
    if np.mean(np.abs(step - np.median(step)) > 0.1 * np.median(step)) < 0.3:
        return False
    values = np.column_stack(list(table.columns.values()))
    changed = (values[1:] != values[:-1]) & np.isfinite(values[1:])
    each = changed.sum(axis=1)
    return bool(np.mean(each > 0) > 0.98 and (n == 1 or np.median(each) <= max(1.0, n / 2)))


def gaps_of(table: Table) -> list[tuple[float, float]]:
    """Begin and end [s] of the stretches without a row, one usual step after the last row before; none where rows stand
    only where something changes: what is not told there did not."""
    step, usual = np.diff(table.time), usual_step(table)
    if usual == 0.0 or changes_only(table):
        return []
    return [(float(table.time[k] + usual), float(table.time[k + 1])) for k in _lost(step, usual)]


def _begin(run: Run, name: str, table: Table, where: str) -> list[Problem]:
    first = float(table.time[0])
    if abs(first) > 366.0 * _DAY:
        remedy = "times in seconds count from the start of the run, not from 1970 or 1900: subtract the first"
        return [warning(f"times begin {first:.10g} s from the start of the run", f"{where} (line 2)", remedy)]
    if name == "loads" and run.start is not None and first < -2.0 * usual_step(table):
        what = f"times begin {-first:g} s before the start in run.toml"
        hour = " (a whole hour: is a zone wrong?)" if abs(first / 3600.0 - round(first / 3600.0)) < 1e-3 else ""
        return [warning(what + hour, f"{where} (line 2)", "fix start or zone in run.toml: all tables count from there")]
    if name == "loads" and run.start is not None and first > max(60.0, 5.0 * usual_step(table)):
        what = f"times begin {first:g} s after the start in run.toml"
        hour = " (a whole hour: is a zone wrong?)" if abs(first / 3600.0 - round(first / 3600.0)) < 1e-3 else ""
        return [warning(what + hour, f"{where} (line 2)", "fix start or zone in run.toml, if the log is whole")]
    return []


def _jitter(step: np.ndarray, usual: float) -> tuple[float, bool]:
    """What 95 % of the steps [s] do not depart by from the usual one, and whether that is a regular beat."""
    jitter = float(np.quantile(np.abs(step - usual), 0.95))
    return jitter, len(step) >= _LEAST and jitter < 0.1 * usual


def _lost(step: np.ndarray, usual: float) -> np.ndarray:
    """Which steps are gaps."""
    _, regular = _jitter(step, usual)
    return np.flatnonzero(step > (_LOST if regular else _GAP) * usual)


def _gaps(step: np.ndarray, usual: float, name: str, where: str) -> list[Problem]:
    jitter, regular = _jitter(step, usual)
    gaps = _lost(step, usual)
    problems = []
    if len(gaps):
        gaps = gaps[np.argsort(-step[gaps], kind="stable")]
        longest = step[gaps[0]]
        lost = round(float(np.sum(step[gaps] / usual - 1.0)))
        what = f"{times(len(gaps))} a gap, the longest {longest:g} s where {usual:g} s are usual"
        what += f", {lost} rows missing" if regular else ""
        what += ": an hour, as at a clock change" if abs(longest - 3600.0 - usual) < 1.5 * usual else ""
        held = "loads are held over a gap and the result is flagged; fill it if you can"
        remedy = held if name == "loads" else "nothing is compared in a gap; did the logger stop?"
        problems.append(warning(what, at(where, gaps + 1), remedy))
    if regular:
        tolerance = max(0.02 * usual, 6.0 * jitter)
        off = np.flatnonzero((np.abs(step - usual) > tolerance) & (step <= _LOST * usual))
        off = off[(off < len(step) - 1) | (step[off] > usual)]  # `twin unpack --mean` closes with a shorter interval
        if len(off):
            what = f"rows {usual:g} s apart as a rule stand {step[off].min():g} .. {step[off].max():g} s apart, "
            remedy = "loads are held from row to row: is a time wrong, or are there rows from elsewhere?"
            problems.append(warning(what + times(len(off)), at(where, off + 1), remedy))
    return problems
