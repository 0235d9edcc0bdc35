"""Slips of units between channels that must agree: path and speed, axis and motor, power and torque, temperatures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from twin.errors import Problem
from twin.logs.channels import DRIVES, MOVES, PLACES, owner, pairs
from twin.logs.found import held, slip, warning
from twin.logs.motion import explained
from twin.logs.run import Run, Table
from twin.logs.signals import SignalLike, as_meant

_LEAST = 30  # rows
_LEAD = (1.5e-3, 0.1)  # m per revolution of ball screws and pinions
_START = (-10.0, 45.0)  # degC of a shop
_FEW = 1.0 / 60.0  # of the certified range: a channel that stays below while others of its drive do not


def slip_problems(run: Run, signals: Sequence[SignalLike], where: str) -> list[Problem]:
    """Warnings about load channels whose units contradict each other."""
    loads = run.loads
    return [
        *_paths(loads, where),
        *_leads(loads, where),
        *_powers(loads, where),
        *_little_used(loads, signals, where),
    ]


def _paths(loads: Table, where: str) -> list[Problem]:
    """A path longer than the speed allows. Holds at any sampling: between two rows an axis may go farther than logged
    (to and fro), never less far."""
    problems = []
    step = np.diff(loads.time)
    for speed, position in pairs(loads, ("m/s", "rad/s"), ("m", "rad")):
        if (loads.units[position] == "m") != (loads.units[speed] == "m/s") or explained(loads, speed):
            continue
        v = np.abs(held(loads.columns[speed]))
        moved = np.abs(np.diff(held(loads.columns[position])))
        allowed = float(np.sum(np.maximum(v[:-1], v[1:]) * step))
        gone = float(np.sum(moved))
        if np.count_nonzero(moved) < _LEAST or allowed <= 0.0:
            continue
        if gone > 1.5 * allowed:
            what = f"'{position}' goes {gone:.4g} {loads.units[position]}, but '{speed}' allows {allowed:.4g}"
            remedy = "check both units in the headers: a factor 60 is m/min, 1000 is mm"
            problems.append(warning(what, where, remedy))
    return problems


def _leads(loads: Table, where: str) -> list[Problem]:
    """Speed of an axis over the speed of its motor: the way of one revolution."""
    problems = []
    for axis, motor in pairs(loads, ("m/s",), ("1/s",)):
        v, n = np.abs(held(loads.columns[axis])), np.abs(held(loads.columns[motor]))
        vv, nn, vn = float(v @ v), float(n @ n), float(v @ n)
        if np.count_nonzero(v) < _LEAST or nn == 0.0 or vv == 0.0 or vn < 0.98 * np.sqrt(vv) * np.sqrt(nn):
            continue
        lead = vn / nn
        if not _LEAD[0] < lead < _LEAD[1]:
            what = f"'{axis}' is {1e3 * lead:.4g} mm for each revolution of '{motor}'"
            remedy = "a screw's lead is 5 to 50 mm: check both units, a factor 60 is 1/min or m/min"
            problems.append(warning(what, where, remedy))
    return problems


def _powers(loads: Table, where: str) -> list[Problem]:
    """Power against 2 pi n M, where speed, torque and power of one drive are logged."""
    problems = []
    for power, torque in pairs(loads, ("W",), ("N*m",)):
        for turning in (n for n, unit in loads.units.items() if unit == "1/s" and owner(n) == owner(power)):
            P, M, n = (np.abs(held(loads.columns[c])) for c in (power, torque, turning))
            shaft = 2.0 * np.pi * n * M
            if np.count_nonzero(shaft) < _LEAST:
                continue
            ratio = float(np.sum(P[shaft > 0.0]) / np.sum(shaft))
            if not 0.25 < ratio < 4.0:
                looks_like = slip(ratio, 0.5)
                what = f"'{power}' is {ratio:.4g} times 2 pi '{turning}' '{torque}'"
                what += f", near a factor {looks_like}" if looks_like else ""
                problems.append(warning(what, where, "check the three units in the headers"))
    return problems


def _little_used(loads: Table, signals: Sequence[SignalLike], where: str) -> list[Problem]:
    """A channel that stays far below its certified range while others of its drive use theirs."""
    used: dict[str, float] = {}
    for s in signals:
        size = max(abs(s.low), abs(s.high))
        if loads.units.get(s.column) != s.unit or s.unit in ("degC", "1") or not 0.0 < size < 1e9:
            continue
        values = s.factor * held(loads.columns[s.column])
        largest = float(np.max(np.abs(values))) if s.unit not in PLACES else 0.5 * float(np.ptp(values))
        if np.count_nonzero(values) >= _LEAST and largest > 0.0:
            used[s.column] = largest / size
    problems = _idle_drives(used, where)
    for column, use in used.items():
        busy = max((c for c in used if c != column and _implies(loads, c, column)), key=lambda c: used[c], default=None)
        if busy is None or use >= _FEW or used[busy] < max(0.1, 12.0 * use):
            continue
        what = f"'{column}' reaches {100.0 * use:.2g} % of its certified range, '{busy}' {100.0 * used[busy]:.3g} %"
        remedy = "check the unit in the header: a factor 60 is minutes, 1000 is milli or kilo"
        problems.append(warning(what, where, remedy))
    return problems


def _idle_drives(used: Mapping[str, float], where: str) -> list[Problem]:
    """Drives of which every channel stays far below its range: slips of two channels would hide each other."""
    drives: dict[str, list[str]] = {}
    for column in used:
        drives.setdefault(owner(column), []).append(column)
    problems = []
    for columns in drives.values():
        most = max(used[c] for c in columns)
        if len(columns) > 1 and most < _FEW:
            listed = ", ".join(f"'{c}'" for c in columns)
            what = f"{listed} reach no more than {100.0 * most:.2g} % of their certified ranges"
            problems.append(warning(what, where, "hardly used, or are their units wrong? see the headers"))
    return problems


def _implies(loads: Table, busy: str, other: str) -> bool:
    """Does `busy` in full use mean that `other` is used as well? Both of one drive; a drive may hold a load at rest, so
    that a current or torque means motion only where no position is logged: at spindles."""
    if owner(busy) != owner(other):
        return False
    unit = loads.units[busy]
    if loads.units[other] in PLACES:
        return unit in MOVES
    if loads.units[other] in MOVES:
        axis = any(u in PLACES and owner(c) == owner(busy) for c, u in loads.units.items())
        return unit in (*MOVES, "W") or (unit in DRIVES and not axis)
    return unit in (*MOVES, *DRIVES)


def temperature_slips(run: Run) -> list[Problem]:
    """Warnings about temperatures that begin where a shop does not, or where the others would be in degF or degC.

    Machines warm up from one level: their sensors and the air begin within some kelvin of each other.
    """
    tables = {"loads": run.loads} | ({"temperatures": run.temperatures} if run.temperatures else {})
    begin: dict[tuple[str, str], float] = {}
    for name, table in tables.items():
        for column, unit in table.units.items():
            good = table.columns[column][:20][np.isfinite(table.columns[column][:20])]
            if unit == "degC" and len(good):
                begin[name, column] = float(np.median(good))
    known = list(begin.values()) + ([run.initial_temperature] if run.initial_temperature is not None else [])
    if not known:
        return []
    usual = float(np.median(known))
    problems = []
    for (name, column), first in begin.items():
        where = str(run.folder / f"{name}.csv")
        others = usual if len(known) > 1 else 20.0
        if near := other_scale(first, others):
            what = f"'{column}' begins at {first:.1f} degC, the others at {others:.1f}: it may be in {near}"
            problems.append(warning(what, where, "fix the unit in the header"))
        elif not _START[0] < usual < _START[1] and first == usual:
            what = f"'{column}' begins at {first:.1f} degC, and half of the temperatures are no lower"
            problems.append(warning(what, where, "check the unit: degC, degF or K?"))
    return problems


def other_scale(first: float, others: float) -> str:
    """The scale that a temperature [degC] far from others [degC] may be in: "degF, not degC"; "" where none fits."""
    fahrenheit = {"degF, not degC": (first - 32.0) / 1.8, "degC, not degF": first * 1.8 + 32.0}
    near = [text for text, value in fahrenheit.items() if abs(value - others) < 6.0]
    return near[0] if abs(first - others) > 20.0 and near else ""


def range_problems(run: Run, signals: Sequence[SignalLike]) -> list[Problem]:
    """Warnings about signals outside of what the machine was certified for, with the slip that it looks like."""
    problems = []
    for s in signals:
        if run.loads.units.get(s.column) != s.unit:
            continue
        values = as_meant(s, run.loads.columns[s.column])
        margin = 1e-9 * max(abs(s.low), abs(s.high))
        with np.errstate(invalid="ignore"):
            rows = np.flatnonzero((values < s.low - margin) | (values > s.high + margin))
        if not len(rows):
            continue
        lines = (
            f"{run.folder / 'loads.csv'} (line {rows[0] + 2}{f' and {len(rows) - 1} more' if len(rows) > 1 else ''})"
        )
        problems.append(
            warning(
                f"'{s.column}' spans {np.nanmin(values):g} .. {np.nanmax(values):g} {s.unit},"
                f" {len(rows)} rows outside {s.low:g} .. {s.high:g}" + _shrunk(values, s),
                lines,
                "results there are flagged: check the unit, or widen the signal's range and build again",
            )
        )
    return problems


def _shrunk(values: np.ndarray, s: SignalLike) -> str:
    """The factor of a usual slip that brings a whole channel into its range and fills a tenth of it."""
    size, largest = max(abs(s.low), abs(s.high)), float(np.nanmax(np.abs(values)))
    for factor, unit in ((60.0, "minutes for seconds"), (1000.0, "milli"), (2.0 * np.pi, "radians for revolutions")):
        if 0.1 * size < largest / factor <= size * (1.0 + 1e-9) and s.unit not in ("degC", "rad"):
            return f": {factor:.4g} times too large ({unit})?"
    return ""


def stroke_problems(run: Run, strokes: Mapping[str, tuple[float, float]]) -> list[Problem]:
    """Warnings about positions in tcp.csv beyond the strokes [m] of their axes."""
    if run.tcp is None:
        return []
    problems = []
    for k, axis in enumerate(run.tcp.axes):
        low, high = strokes.get(axis, (-np.inf, np.inf))
        values = run.tcp.position[:, k]
        margin = 0.02 * (high - low) if np.isfinite(high - low) else 0.0
        with np.errstate(invalid="ignore"):
            rows = np.flatnonzero((values < low - margin) | (values > high + margin))
        if len(rows):
            what = f"'{axis}' is at {values[rows[0]]:g} m, beyond its stroke {low:g} .. {high:g} m"
            where = f"{run.folder / 'tcp.csv'} (line {rows[0] + 2})"
            problems.append(warning(what, where, "check the unit in the header: a factor 1000 is mm"))
    return problems
