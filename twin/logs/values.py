"""Values that are missing, never change, leap, or that no machine has."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from twin.errors import Problem
from twin.logs.channels import DRIVES, owner
from twin.logs.found import at, held, times, warning
from twin.logs.run import Table

# Largest magnitudes that a machine's log may show, and the smallest that a channel's largest value should reach.
_LARGEST = {"m": 100.0, "m/s": 20.0, "1/s": 3000.0, "A": 1500.0, "W": 5e5, "N*m": 5e4, "N": 5e6, "m^3/s": 0.1}
_SMALLEST = {"A": 0.02, "W": 1.0, "m/s": 1e-5, "m": 1e-5, "1/s": 1e-3, "N*m": 1e-3, "m^3/s": 1e-7}
_PLAUSIBLE = (-40.0, 200.0)  # degC in a workshop
_LARGEST_TCP, _SMALLEST_TCP = 2e-3, 2e-8  # m
_SPREADS = 3.0  # of the middle 99 %, beyond which a single value is an outlier
_LEAP = 2.0  # K from one row to the next, in a channel that usually changes by a twentieth of that
_LEAST = 20


def value_problems(
    table: Table, where: str, name: str, wanted: Collection[str] = (), told: Collection[str] = ()
) -> list[Problem]:
    """Warnings about the values of one table: "loads", "temperatures" or "tcp".

    wanted: columns that a machine reads; without any value they are errors, as they are on running. told: columns
    whose large values other findings tell already.
    """
    problems = []
    constant: list[str] = []
    for column, values in table.columns.items():
        unit = table.units[column]
        finite = np.isfinite(values)
        good = values[finite]
        if not len(good):
            what, remedy = f"column '{column}' has no value at all", "check the channel, or remove the column"
            problems.append(Problem(what, where, remedy, warning=column not in wanted))
            continue
        if not finite.all():
            lacks = np.flatnonzero(~finite)
            what = f"column '{column}' lacks {len(lacks)} of {len(values)} values, first in line {lacks[0] + 2}"
            problems.append(warning(what, where, "the last value is held and the result flagged"))
        low, high = float(good.min()), float(good.max())
        if len(values) >= 10 and low == high and name != "tcp":
            if low == 0.0:
                constant.append(column)
            elif len(values) >= 100 and (name == "temperatures" or _siblings_change(table, column)):
                what = f"column '{column}' never changes ({low:g} {unit})"
                problems.append(warning(what, where, "a stuck or detached sensor? leave it out if so"))
        if column in told:
            continue
        problems += _plausible(column, low, high, unit, where, name)
        if low < high:
            problems += _outliers(column, held(values), unit, where, leaps=name == "loads")
    if constant:
        listed = ", ".join(f"'{c}'" for c in constant)
        what = f"{'column' if len(constant) == 1 else 'columns'} {listed} {'is' if len(constant) == 1 else 'are'}"
        remedy = "right for what stands still or is off; else: is the channel connected and the header right?"
        problems.append(warning(f"{what} zero throughout", where, remedy))
    return problems


def _siblings_change(table: Table, column: str) -> bool:
    """Is this a current, torque, power or force, and does another channel of its drive change?"""
    return table.units[column] in DRIVES and any(
        np.ptp(held(values)) > 0.0 for c, values in table.columns.items() if c != column and owner(c) == owner(column)
    )


def _plausible(column: str, low: float, high: float, unit: str, where: str, name: str) -> list[Problem]:
    if unit == "degC":
        if low < _PLAUSIBLE[0] or high > _PLAUSIBLE[1]:
            what = f"column '{column}' spans {low:g} .. {high:g} degC"
            return [warning(what, where, "check the unit: degC, degF or K?")]
        return []
    size = max(abs(low), abs(high))
    deviation = name == "tcp" and column in ("dx", "dy", "dz", "sigma")
    largest = _LARGEST_TCP if deviation else _LARGEST.get(unit, 1e12)
    smallest = _SMALLEST_TCP if deviation else _SMALLEST.get(unit, 0.0)
    if size > largest or 0.0 < size < smallest:
        what = f"column '{column}' reaches {size:.4g} {unit}, which is {'much' if size > largest else 'little'}"
        return [warning(what, where, "check the unit in the header: a factor 60 is minutes, 1000 is milli or kilo")]
    return []


def _outliers(column: str, values: np.ndarray, unit: str, where: str, leaps: bool) -> list[Problem]:
    """Single values far from all others; and leaps of temperatures, which `twin.logs.faults` finds where measured."""
    if len(values) < _LEAST:
        return []
    low, high = np.quantile(values, (0.005, 0.995)) if len(values) >= 400 else np.sort(values)[[1, -2]]
    spread = high - low
    far = np.flatnonzero((values < low - _SPREADS * spread) | (values > high + _SPREADS * spread))
    if spread > 0.0 and 0 < len(far) <= 0.005 * len(values) + 1:
        shown = ", ".join(f"{values[i]:g}" for i in far[:3])
        what = f"'{column}' is {shown} {unit} {times(len(far))}, otherwise {low:g} .. {high:g}"
        return [warning(what, at(where, far), "a single wrong value? leave the cell empty if so")]
    if unit != "degC":
        return []
    change = np.abs(np.diff(values))
    there = np.diff(values)
    back = np.where(there[:-1] * there[1:] < 0.0, np.minimum(change[:-1], change[1:]), 0.0)  # of rows 1 .. n - 2
    spikes = np.flatnonzero(back > max(_LEAP, 8.0 * float(np.quantile(back, 0.98)))) + 1
    stay = np.flatnonzero(change > max(_LEAP, 20.0 * float(np.quantile(change, 0.98)))) + 1
    if len(spikes):
        what = f"'{column}' leaps by {back[spikes[0] - 1]:.3g} K and back, {times(len(spikes))}"
        return [warning(what, at(where, spikes), "a single wrong value? leave the cell empty if so")]
    if not leaps or not len(stay):
        return []
    what = f"'{column}' leaps by {change[stay[0] - 1]:.3g} K, {times(len(stay))}"
    return [warning(what, at(where, stay), "a wrong value, rows of another time, or a loose sensor? look at the plot")]
