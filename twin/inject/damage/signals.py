"""Faults of what loads.csv and run.toml say: factors, means, clocks, the temperature at the start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.errors import LogError
from twin.inject.damage.channels import Damage, acts, expect_whole, load_of, marked, with_load
from twin.logs.run import Run


def factor(run: Run, d: Damage) -> Run:
    """Logged too large by a factor."""
    name = load_of(run, d.place)
    values = run.loads.columns[name]
    return with_load(run, name, np.where(acts(run.loads.time, d), d.size * values, values))


def averaged(run: Run, d: Damage) -> Run:
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


def clock(run: Run, d: Damage) -> Run:
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


def initial_state(run: Run, d: Damage) -> Run:
    """The stated temperature at the start is off: of the whole machine, a log states no other."""
    expect_whole(run, d)
    if run.initial_temperature is None:
        remedy = 'write initial_temperature = "20 degC" there'
        raise LogError("states no initial temperature", str(run.folder / "run.toml"), remedy)
    return replace(run, initial_temperature=run.initial_temperature + d.size)
