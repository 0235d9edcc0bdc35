"""Faults of a temperature sensor: what its column of temperatures.csv shows then."""

from __future__ import annotations

import math
import zlib

import numpy as np

from twin.errors import LogError
from twin.inject.damage.channels import Damage, acts, column_at, grown, sensor_of, with_sensors
from twin.logs.run import Run, Table


def offset(run: Run, d: Damage) -> Run:
    """Reads too much by a constant."""
    table, name = sensor_of(run, d.place)
    return with_sensors(run, {name: table.columns[name] + d.size * acts(table.time, d)})


def drift(run: Run, d: Damage) -> Run:
    """Drifts linearly, by the size from the start of the fault to its end, and stays there."""
    table, name = sensor_of(run, d.place)
    return with_sensors(run, {name: table.columns[name] + d.size * grown(table.time, d)})


def lag(run: Run, d: Damage) -> Run:
    """Follows with a time constant of the size [s]: a sensor in a thick well."""
    table, name = sensor_of(run, d.place)
    values = np.array(table.columns[name], dtype=float)
    last = -1
    for i in np.flatnonzero(acts(table.time, d) & np.isfinite(values)).tolist():
        if last >= 0:
            keep = math.exp(-(table.time[i] - table.time[last]) / d.size)
            values[i] = keep * values[last] + (1.0 - keep) * values[i]
        last = i
    return with_sensors(run, {name: values})


def detached(run: Run, d: Damage) -> Run:
    """Shows its surroundings, a column of either table, by a share: it has come off."""
    table, name = sensor_of(run, d.place)
    if not 0.0 < d.size <= 1.0:
        raise LogError(f"a share of {d.size:g}", d.place, "give the share of the surroundings in what it shows: 0.5")
    share = d.size * acts(table.time, d)
    return with_sensors(run, {name: (1.0 - share) * table.columns[name] + share * column_at(run, d.signal, table.time)})


def stuck(run: Run, d: Damage) -> Run:
    """Keeps the value that it has at the start of the fault, for the size [s]."""
    table, name = sensor_of(run, d.place)
    values = np.array(table.columns[name], dtype=float)
    first = table.time[0] if d.start == -math.inf else d.start
    kept = (table.time >= first) & (table.time < min(first + d.size, d.end))
    if kept.any():
        values[kept] = values[np.flatnonzero(kept)[0]]
    return with_sensors(run, {name: values})


def noise(run: Run, d: Damage) -> Run:
    """Its wire breaks: reads too much by twice the size, with noise of the size as its standard deviation.

    The noise is that of the sensor's name: the same in every copy.
    """
    table, name = sensor_of(run, d.place)
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    wrong = d.size * (2.0 + rng.standard_normal(len(table.time)))
    return with_sensors(run, {name: table.columns[name] + wrong * acts(table.time, d)})


def rail(run: Run, d: Damage) -> Run:
    """Shows the size [degC], whatever it measures: an open or a short circuit."""
    table, name = sensor_of(run, d.place)
    values = table.columns[name]
    return with_sensors(run, {name: np.where(acts(table.time, d) & np.isfinite(values), d.size, values)})


def elsewhere(run: Run, d: Damage) -> Run:
    """Is mounted beside another sensor, and shows what that does."""
    table, name, other = _two(run, d, "mounted where it is")
    return with_sensors(run, {name: np.where(acts(table.time, d), table.columns[other], table.columns[name])})


def swapped(run: Run, d: Damage) -> Run:
    """Two sensors with each other's names."""
    table, name, other = _two(run, d, "swapped with itself")
    during = acts(table.time, d)
    a, b = table.columns[name], table.columns[other]
    return with_sensors(run, {name: np.where(during, b, a), other: np.where(during, a, b)})


def _two(run: Run, d: Damage, wrong: str) -> tuple[Table, str, str]:
    """The temperatures and two columns of theirs. Raises LogError where one is not there or both are one."""
    table, name = sensor_of(run, d.place)
    _, other = sensor_of(run, d.other)
    if other == name:
        raise LogError(f"a sensor is {wrong}", d.place, "name another sensor")
    return table, name, other
