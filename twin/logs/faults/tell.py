"""Faults in plain words, with their lines, times and remedies."""

from __future__ import annotations

from collections.abc import Sequence

from twin.errors import Problem
from twin.logs.faults.fault import Fault
from twin.logs.found import at, span, times, warning
from twin.logs.refuse import tables_of
from twin.logs.run import Run

_LISTED = 4  # names in one line
_EMPTY = "leave its cells empty from there on, or remove the column"


def fault_problems(run: Run, faults: Sequence[Fault]) -> list[Problem]:
    """One warning for each fault; all leaps of one channel share theirs, and all its spikes."""
    groups: dict[tuple[str, ...], list[Fault]] = {}
    for f in faults:
        own = () if f.kind in ("leap", "spike") else (str(f.first_row),)
        groups.setdefault((f.kind, f.table, *f.channels, *own), []).append(f)
    return [_problem(run, same) for same in groups.values()]


def shown(size: float, unit: str) -> str:
    """A size in the unit of the field: um for m."""
    return f"{1e6 * size:.3g} um" if unit == "m" else f"{size:.4g} {unit}"


def _problem(run: Run, same: Sequence[Fault]) -> Problem:
    f = same[0]
    path = str(run.folder / f"{f.table}.csv")
    if f.kind == "splice":
        n, when = len(f.channels), _hours(f.first_time)
        what = f"rows of another time from line {f.first_row + 2} on: at {when} {n} temperatures leap, by {_size(f)}"
        return warning(
            what, at(path, [f.first_row]), "split the log there into two runs, or name its segments in run.toml"
        )
    if f.kind in ("offset", "offset_or_warm"):
        return _apart(f, path)
    if f.kind == "leap":
        return _leaps(run, same, path)
    if f.kind == "spike":
        when = f"first at {_hours(f.first_time)}" if len(same) > 1 else f"at {_hours(f.first_time)}"
        most = max(same, key=lambda own: abs(own.size))
        what = f"{_do(f, 'leap')} and comes back within three rows, {times(len(same))}, {when}, by up to {_size(most)}"
        return warning(what, at(path, [own.first_row for own in same]), "a loose plug? leave these cells empty")
    if f.kind == "rezero":
        what = f"{_do(f, 'leap')} by {_size(f)} to zero at {_hours(f.first_time)}"
        return warning(
            what, at(path, [f.first_row]), "was the probe set to zero? add what was lost, or split the run there"
        )
    during = f"from {_hours(f.first_time)} to {_hours(f.last_time)}"
    lines = span(path, f.first_row, f.last_row)
    if f.kind == "stuck":
        what = f"{_do(f, 'stand')} still at {_size(f)} while others go on, {during}"
        remedy = (
            "a frozen channel" if f.table == "temperatures" else "a frozen probe, or one that is read in motion only"
        )
        return warning(what, lines, f"{remedy}? leave its cells empty if so")
    if f.kind == "held":
        what = f"{_do(f, 'repeat')} {_size(f)}, {during}"
        return warning(what, lines, "a logger that had no new reading? leave its cells empty if so")
    if f.kind == "rail":
        what = f"{_do(f, 'leap')} to {_size(f)} and {'stay' if len(f.channels) > 1 else 'stays'} there, {during}"
        return warning(what, lines, f"an open or short circuit? {_EMPTY}")
    what = f"{_do(f, 'leap')} to and fro by {_size(f)} from row to row, {during}"
    return warning(what, lines, f"a broken wire or a loose plug? {_EMPTY}")


def _leaps(run: Run, same: Sequence[Fault], path: str) -> Problem:
    f = same[0]
    what = f"{_do(f, 'leap')} by {_size(f)}"
    if len(same) > 1:
        what += f", {times(len(same))}, first at {_hours(f.first_time)}"
    else:
        ends = f.last_row < len(tables_of(run)[f.table].time) - 1
        what += f" at {_hours(f.first_time)}" + (f" and back after {_hours(f.last_time)}" if ends else "")
    remedy = (
        "a loose sensor, or a probe that was moved? leave its cells empty where it is wrong, or split the run there"
    )
    if len(f.channels) > 2:
        remedy = "rows of another time, or a module that they share? look at the plot, and split the run there if so"
    return warning(what, at(path, [s.first_row for s in same]), remedy)


def _apart(f: Fault, path: str) -> Problem:
    above = f"{shown(abs(f.size), 'K')} {'above' if f.size > 0.0 else 'below'} the other temperatures"
    if f.kind == "offset":
        what = f"'{f.channels[0]}' begins {above}, and the machine was cold"
        remedy = "an offset of the sensor? correct it, unless something beside it is always so warm or cold"
    else:
        what = f"'{f.channels[0]}' begins {above}: an offset, if the machine was cold, which this run does not show"
        remedy = "if it was, state initial_temperature in run.toml; else log half an hour at rest first"
    return warning(what, at(path, [f.first_row]), remedy)


def _do(f: Fault, verb: str) -> str:
    """ "'a' leaps", "'a', 'b' leap"."""
    listed = ", ".join(f"'{c}'" for c in f.channels[:_LISTED])
    more = len(f.channels) - _LISTED
    return f"{listed}{f' and {more} more' if more > 0 else ''} {verb}{'' if len(f.channels) > 1 else 's'}"


def _size(f: Fault) -> str:
    several = len(f.channels) > 1 and f.kind not in ("rail", "stuck", "held")
    return f"{'up to ' if several else ''}{shown(f.size, f.unit)}"


def _hours(seconds: float) -> str:
    return f"{seconds / 3600.0:.2f} h"
