"""What a channel would have read where its readings are set aside: what all others say, for those who need a value.

A model that is driven by a temperature of the air needs one at every time. A fit of a poor model moves when readings
are lost as far as by wrong ones: it fits the others then.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twin.calibrate.channels.prediction import expected, predictors
from twin.calibrate.channels.readings import Readings, readings
from twin.logs.run import Run, Table

SAME, ALIKE = 0.05, 0.95  # K, a digit of a thermometer, by which this share of one reading in two tables may differ
NORMAL = 1.96  # standard deviations, half of a 95 % interval


def driven(logged: Sequence[Run], sound: Sequence[Run]) -> list[Run]:
    """The sound runs; loads that are logged as the temperature of their name are as that is now, filled."""
    changed = [_changed(before, after) for before, after in zip(logged, sound, strict=True)]
    table = readings(sound) if any(changed) else None
    return [
        replace(run, loads=_driving(run, k, names, table)) if names else run
        for k, (run, names) in enumerate(zip(sound, changed, strict=True))
    ]


def filled(logged: Sequence[Run], sound: Sequence[Run], known: float) -> list[Run]:
    """The sound runs with temperatures in place of those that were set aside, where half of the 95 % interval of what
    all others say is `known` [K] or less."""
    table = readings(sound)
    if table is None:
        return list(sound)
    return [_filled(before, run, k, table, known) for k, (before, run) in enumerate(zip(logged, sound, strict=True))]


def _filled(logged: Run, run: Run, number: int, table: Readings, known: float) -> Run:
    if logged.temperatures is None or run.temperatures is None:
        return run
    time, columns = run.temperatures.time, dict(run.temperatures.columns)
    rows = table.run == number
    for name, values in run.temperatures.columns.items():
        lost = np.isfinite(logged.temperatures.columns[name]) & ~np.isfinite(values)
        if not lost.any() or not rows.any() or not _predicted(table, name):
            continue
        mean, sigma = (np.interp(time, table.time[rows], v[rows]) for v in expected(table, table.names.index(name)))
        columns[name] = np.where(lost & (NORMAL * sigma <= known), mean, values)
    return replace(run, temperatures=replace(run.temperatures, columns=columns))


def _predicted(table: Readings, name: str) -> bool:
    return name in table.names and bool(predictors(table, table.names.index(name)))


def _changed(logged: Run, sound: Run) -> list[str]:
    """The columns of the loads that are logged as the temperature of their name is, where that is no longer used."""
    if logged.temperatures is None or sound.temperatures is None:
        return []
    loads, table = logged.loads, logged.temperatures
    return [
        name for name, values in loads.columns.items()
        if name in table.columns and loads.units[name] == table.units[name]
        and not np.array_equal(table.columns[name], sound.temperatures.columns[name], equal_nan=True)
        and _alike(values, np.interp(loads.time, table.time, table.columns[name]))
    ]  # fmt: skip


def _alike(a: np.ndarray, b: np.ndarray) -> bool:
    both = np.isfinite(a) & np.isfinite(b)
    return bool(both.any() and np.quantile(np.abs(a - b)[both], ALIKE) <= SAME)


def _driving(run: Run, number: int, names: Sequence[str], table: Readings | None) -> Table:
    """The loads of a run with its sound temperatures, where these are missing with what all others say."""
    assert run.temperatures is not None
    columns = dict(run.loads.columns)
    for name in names:
        values = run.temperatures.columns[name]
        known = np.isfinite(values)
        time, values = run.temperatures.time[known], values[known]
        if table is not None and _predicted(table, name):
            c = table.names.index(name)
            rows = np.flatnonzero((table.run == number) & ~np.isfinite(table.values[:, c]))
            time = np.concatenate([time, table.time[rows]])
            values = np.concatenate([values, expected(table, c)[0][rows]])
            order = np.argsort(time, kind="stable")
            time, values = time[order], values[order]
        if len(time):
            columns[name] = np.interp(run.loads.time, time, values)
    return replace(run.loads, columns=columns)
