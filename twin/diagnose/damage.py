"""Logs with a fault that was not there: what channels, clocks and measurements get wrong, one pure function per kind.

A fault acts from `start` to `end` [s]. Amplitudes are SI; all else in a run stays as it is. A damaged table counts as
computed (`Run.synthetic`): nobody is to take it for a measurement.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.damage_access import (
    Damage,
    acts,
    column_at,
    component,
    component_and_axis,
    expect_whole,
    grown,
    load_of,
    marked,
    sensor_of,
    set_of,
    tcp_time,
    with_load,
    with_sensors,
    with_tcp,
)  # fmt: skip
from twin.errors import LogError
from twin.logs.run import Run
from twin.nearest import did_you_mean


@dataclass(frozen=True)
class Kind:
    """A row of the table of damages."""

    damaged: Callable[[Run, Damage], Run]
    unit: str  # of the size; "" where it is a name
    meaning: str
    follows: bool = False  # a column: --signal


def damaged(run: Run, damage: Damage) -> Run:
    """The run with one fault. Raises LogError for kinds, channels and tables that are not there."""
    return kind_of(damage.family, damage.history).damaged(run, damage)


def kind_of(family: str, history: str) -> Kind:
    """The kind of a fault. Raises LogError for an unknown one."""
    kinds = DAMAGES.get(family)
    if kinds is None:
        raise LogError(f"'{family}' is no fault of a log", "", did_you_mean(family, DAMAGES, "faults of a log"))
    if history and history not in kinds:
        what = f"a fault of family '{family}' has no history '{history}'"
        raise LogError(what, "--history", did_you_mean(history, kinds, "histories"))
    return kinds[history or next(iter(kinds))]


def _offset(run: Run, d: Damage) -> Run:
    """Reads too much by a constant."""
    table, name = sensor_of(run, d.place)
    return with_sensors(run, {name: table.columns[name] + d.size * acts(table.time, d)})


def _drift(run: Run, d: Damage) -> Run:
    """Drifts in a straight line, by the size from the start of the fault to its end, and stays there."""
    table, name = sensor_of(run, d.place)
    return with_sensors(run, {name: table.columns[name] + d.size * grown(table.time, d)})


def _lag(run: Run, d: Damage) -> Run:
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


def _detached(run: Run, d: Damage) -> Run:
    """Shows its surroundings, a column of either table, by a share: it has come off."""
    table, name = sensor_of(run, d.place)
    if not 0.0 < d.size <= 1.0:
        raise LogError(f"a share of {d.size:g}", d.place, "give the share of the surroundings in what it shows: 0.5")
    share = d.size * acts(table.time, d)
    return with_sensors(run, {name: (1.0 - share) * table.columns[name] + share * column_at(run, d.signal, table.time)})


def _stuck(run: Run, d: Damage) -> Run:
    """Keeps the value that it has at the start of the fault, for the size [s]."""
    table, name = sensor_of(run, d.place)
    values = np.array(table.columns[name], dtype=float)
    first = table.time[0] if d.start == -math.inf else d.start
    kept = (table.time >= first) & (table.time < min(first + d.size, d.end))
    if kept.any():
        values[kept] = values[np.flatnonzero(kept)[0]]
    return with_sensors(run, {name: values})


def _swapped(run: Run, d: Damage) -> Run:
    """Two sensors with each other's names."""
    table, name = sensor_of(run, d.place)
    _, other = sensor_of(run, d.other)
    if other == name:
        raise LogError("a sensor is swapped with itself", d.place, "name another sensor")
    during = acts(table.time, d)
    a, b = table.columns[name], table.columns[other]
    return with_sensors(run, {name: np.where(during, b, a), other: np.where(during, a, b)})


def _factor(run: Run, d: Damage) -> Run:
    """Logged too large by a factor."""
    name = load_of(run, d.place)
    values = run.loads.columns[name]
    return with_load(run, name, np.where(acts(run.loads.time, d), d.size * values, values))


def _averaged(run: Run, d: Damage) -> Run:
    """Logged as means over the size [s], weighted by the time until the next row: squares of it become too small.

    Not searched: `twin diagnose` knows factors of signals and clocks of runs.
    """
    name = load_of(run, d.place)
    time, values = run.loads.time, np.array(run.loads.columns[name], dtype=float)
    weight = np.append(np.diff(time), 0.0)
    weight[-1] = weight[-2] if len(weight) > 1 else 1.0
    group = np.floor((time - time[0]) / d.size).astype(int)
    during = acts(time, d) & np.isfinite(values)
    total = np.bincount(group[during], (weight * values)[during], minlength=group.max() + 1)
    span = np.bincount(group[during], weight[during], minlength=group.max() + 1)
    values[during] = total[group[during]] / span[group[during]]
    return with_load(run, name, values)


def _clock(run: Run, d: Damage) -> Run:
    """Stamped too late by the size [s]: all that was measured in a run, or one column of its loads.

    A diagnosis searches the clock of a run: rows of temperatures and TCP keep their values and get later times. A
    column alone is not searched; its values are held before the first row.
    """
    if not d.place.startswith("signals."):
        expect_whole(run, d)
        return _measured_late(run, d.size)
    name = load_of(run, d.place)
    time, values = run.loads.time, run.loads.columns[name]
    late = values[np.clip(np.searchsorted(time, time - d.size, side="right") - 1, 0, len(time) - 1)]
    return with_load(run, name, np.where(acts(time, d), late, values))


def _measured_late(run: Run, seconds: float) -> Run:
    temperatures, tcp = run.temperatures, run.tcp
    if temperatures is not None:
        run = marked(replace(run, temperatures=replace(temperatures, time=temperatures.time + seconds)), "temperatures")
    if tcp is not None:
        run = marked(replace(run, tcp=replace(tcp, time=tcp.time + seconds)), "tcp")
    if temperatures is None and tcp is None:
        raise LogError("nothing is measured", str(run.folder), "take a run with temperatures.csv or tcp.csv")
    return run


def _step(run: Run, d: Damage) -> Run:
    """A displacement that comes at the start of the fault and goes at its end."""
    time = tcp_time(run)
    return with_tcp(run, d, acts(time, d).astype(float))


def _slip(run: Run, d: Damage) -> Run:
    """A support with play: the tool stays behind until the displacement has moved on by the size.

    The play is that of the mean of every measurement: its rows differ by their positions, not by what the machine did.
    """
    time, c = tcp_time(run), component(d.place)
    assert run.tcp is not None
    group = set_of(time)
    level = np.bincount(group, run.tcp.displacement[:, c]) / np.bincount(group)
    half, behind = abs(d.size) / 2, np.zeros(len(level))
    held = level[np.isfinite(level)][0] if np.isfinite(level).any() else 0.0
    for i, value in enumerate(level):
        if np.isfinite(value):
            held = min(max(held, value - half), value + half)
            behind[i] = held - value
    return with_tcp(run, replace(d, size=1.0), behind[group] * acts(time, d))


def _measured_drift(run: Run, d: Damage) -> Run:
    """The measuring device drifts in a straight line."""
    return with_tcp(run, d, grown(tcp_time(run), d))


def _heating(run: Run, d: Damage) -> Run:
    """Measuring heats the machine: the size more from the first to the last row of every measurement."""
    time = tcp_time(run)
    group = set_of(time)
    row, rows = np.arange(len(time)) - np.searchsorted(group, group), np.bincount(group)[group]
    if rows.max() == 1:
        remedy = "take a run that measures several places one after the other, less than 10 min apart"
        raise LogError("every measurement is one row", str(run.folder / "tcp.csv"), remedy)
    return with_tcp(run, d, row / np.maximum(rows - 1, 1) * acts(time, d))


def _frame(run: Run, d: Damage) -> Run:
    """The measuring frame stands askew by the size [m/m]: a component reads more in proportion to an axis position."""
    time = tcp_time(run)
    place, position = component_and_axis(run, d.place)
    if np.ptp(position) < 1e-6:
        remedy = "take a run that measures the TCP at several positions, or name another axis"
        raise LogError(f"the axis of '{d.place}' stands still", str(run.folder / "tcp.csv"), remedy)
    return with_tcp(run, replace(d, place=place), position * acts(time, d))


def _load(run: Run, d: Damage) -> Run:
    """A displacement by force or weight: the size where a column of the loads is largest, and in proportion below."""
    time = tcp_time(run)
    values = np.abs(column_at(run, d.signal, time))
    top = float(np.nanmax(np.abs(run.loads.columns[d.signal]))) if d.signal in run.loads.columns else 0.0
    if not top > 0.0:
        raise LogError(f"column '{d.signal}' of loads.csv is zero or missing", "--signal", "name one that varies")
    return with_tcp(run, d, np.nan_to_num(values / top) * acts(time, d))


def _initial_state(run: Run, d: Damage) -> Run:
    """The stated temperature at the start is off: of the whole machine, a log states no other."""
    expect_whole(run, d)
    if run.initial_temperature is None:
        remedy = 'write initial_temperature = "20 degC" there'
        raise LogError("states no initial temperature", str(run.folder / "run.toml"), remedy)
    return replace(run, initial_temperature=run.initial_temperature + d.size)


DAMAGES: dict[str, dict[str, Kind]] = {
    "sensor": {
        "offset": Kind(_offset, "K", "reads too much by a constant"),
        "drift": Kind(_drift, "K", "drifts in a straight line, in all by this"),
        "lag": Kind(_lag, "s", "follows with this time constant"),
        "detached": Kind(_detached, "1", "shows its surroundings (--signal) by this share", True),
        "stuck": Kind(_stuck, "s", "keeps its value for this time"),
        "swapped": Kind(_swapped, "", "has the name of this sensor, which has its name"),
    },
    "signal": {
        "factor": Kind(_factor, "1", "is logged too large by this factor"),
        "averaged": Kind(_averaged, "s", "is logged as means over this time"),
        "clock": Kind(_clock, "s", "is stamped too late by this"),
    },
    "slip": {"play": Kind(_slip, "m", "a support has this play")},
    "initial_state": {"offset": Kind(_initial_state, "K", "the stated temperature is too high by this")},
    "measurement": {
        "drift": Kind(_measured_drift, "m", "the device drifts in a straight line, in all by this"),
        "frame": Kind(_frame, "1", "reads more in proportion to the axis position, by this per metre"),
        "heating": Kind(_heating, "m", "grows by this from the first to the last row of every measurement"),
    },
    "not_thermal": {
        "step": Kind(_step, "m", "something moves"),
        "load": Kind(_load, "m", "something bends with a load (--signal), at its largest by this", True),
    },
}
