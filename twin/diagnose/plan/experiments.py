"""The experiments that a plan compares: one more run each, as long as the longest one, within the declared ranges.

What a machine can be told to do: every axis to and fro, every spindle in steps, all of it and then a long rest, a warm
start at rest; and the longest run once more, with or without another sensor. Equal length and the same instruments make
them comparable: a longer run would win for being long.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from twin.diagnose.plan.actuators import Actuator
from twin.diagnose.result.numbers import quantity
from twin.logs.run import Run, Table
from twin.rom.load_model import LoadModel, Signal

SENSOR = "plan:"  # before the place of a sensor that is not there yet; no name of a description holds a colon
AGAIN = "again"  # name of the experiment that changes nothing
SAMPLING = 10.0  # s, of the loads of an experiment: six rows in each step of 60 s
SPEED = (
    0.5  # of its top, at which an axis goes to and fro for hours; at its top a ball screw's threshold was nine times
)
MOVING = 2.0 / 3.0  # of the run that an axis moves; then it rests, so that films show without the motor's heat
STEPS = (0.25, 0.0, 0.5, 0.0, 1.0, 0.0)  # of the top level, a sixth of the run each
LOADED = 1.0 / 3.0  # of the run under full load, before the long rest
WARM = 5.0  # K above the air of a warm start: what a machine keeps overnight in a hall that cools
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0  # its multiples fill a stroke evenly, whatever the period of the motion


@dataclass(frozen=True)
class Experiment:
    """One more run."""

    name: str
    words: str  # what to do
    run: Run  # its numbers measured are none: a plan of what would be
    places: tuple[str, ...] = ()  # each with a sensor of its own, SENSOR + place, of which one is added at a time


def longest_of(runs: Sequence[Run]) -> int:
    """The number of the longest run, the first of equals."""
    return int(np.argmax([run.loads.time[-1] - run.loads.time[0] for run in runs]))


def experiments_of(
    load: LoadModel, run: Run, sensors: Sequence[str], actuators: Sequence[Actuator], places: Sequence[str]
) -> tuple[Experiment, ...]:
    """All experiments beside a run (the longest one); sensors: those that it reads; places: that could have one."""
    end = float(run.loads.time[-1] - run.loads.time[0])
    hours = end / 3600.0
    time = np.arange(0.0, end + 0.5 * SAMPLING, SAMPLING)
    share = time / end
    level = {a.name: np.zeros(len(time)) for a in actuators}
    loaded = partial(_loaded, load, run, sensors, actuators, time)
    made = [Experiment(AGAIN, "the longest run again", _planned(run, sensors, (), AGAIN))]
    for a in actuators:
        if a.axis is not None:
            alone = {**level, a.name: np.where(share < MOVING, SPEED * a.top, 0.0)}
            name, speed = f"{a.name} to and fro", _told(load, a, SPEED)
            words = f"{name} over its stroke for {MOVING * hours:.1f} h at {speed}, then rest"
        else:
            block = np.minimum((share * len(STEPS)).astype(int), len(STEPS) - 1)
            alone = {**level, a.name: a.top * np.array(STEPS)[block]}
            top, each = _told(load, a, 1.0), hours / len(STEPS)
            words = f"{a.name} at 25, 50 and 100 % of {top}, {each:.1f} h each, with rests as long after them"
            name = f"{a.name} in steps"
        made.append(Experiment(name, words, loaded(alone, name)))
    if actuators:
        full = {a.name: np.where(share < LOADED, SPEED * a.top, 0.0) for a in actuators}
        first, rested = LOADED * hours, (1.0 - LOADED) * hours
        words = f"everything at {100 * SPEED:.0f} % of its top for {first:.1f} h, then {rested:.1f} h of rest"
        made.append(Experiment("long rest", words, loaded(full, "long rest")))
    rest = replace(loaded(level, "warm start"), initial_temperature=_air(load, run) + WARM)
    words = f"the machine evenly {WARM:g} K warmer than the air at the start, then {hours:.1f} h of rest"
    made.append(Experiment("warm start", words, rest))
    if places:
        run_with = _planned(run, sensors, [SENSOR + p for p in places], "again_with_sensors")
        made.append(Experiment("sensor", "the longest run again", run_with, tuple(places)))
    return tuple(made)


def _told(load: LoadModel, a: Actuator, share: float) -> str:
    return quantity(share * a.top, next(s.unit for s in load.signals if s.name == a.leader))


def _air(load: LoadModel, run: Run) -> float:
    """degC: the air that surrounds the machine at the start of a run."""
    environment = load.environments[load.surroundings]
    if not environment.signal:
        return environment.temperature
    signal = next(s for s in load.signals if s.name == environment.signal)
    if signal.column not in run.loads.columns:
        return float(signal.default if signal.default is not None else environment.temperature)
    values = np.asarray(run.loads.columns[signal.column])
    return float(signal.factor * values[np.isfinite(values)][0])


def _planned(run: Run, sensors: Sequence[str], more: Sequence[str], name: str) -> Run:
    """A run with the instruments of another one, and more sensors; what they read is left at 20 degC and zero."""
    given, loads = run.temperatures, run.loads
    time = np.arange(loads.time[0], loads.time[-1], 6.0 * SAMPLING) if given is None else given.time
    columns = {s: np.full(len(time), 20.0) for s in (more if given is None else (*sensors, *more))}
    none = given is None and not more
    temperatures = None if none else Table(time, columns, dict.fromkeys(columns, "degC"))
    tcp = None if run.tcp is None else replace(run.tcp, displacement=np.zeros_like(run.tcp.displacement))
    return replace(run, temperatures=temperatures, tcp=tcp, folder=Path(name), segments=())


def _loaded(
    load: LoadModel, run: Run, sensors: Sequence[str], actuators: Sequence[Actuator], time: np.ndarray,
    level: Mapping[str, np.ndarray], name: str,
) -> Run:  # fmt: skip
    """The instruments of a run over other loads: actuators at levels (n,) [SI], all else as it was."""
    told = {s.name: s for s in load.signals}
    start = float(run.loads.time[0])
    logged = run.loads.columns
    columns = [s.column for s in load.signals if s.column in logged]
    values = {column: _held(run.loads.time - start, np.asarray(logged[column]), time) for column in columns}
    for a in actuators:
        for signal, commanded in a.at(level[a.name]).items():
            values[told[signal].column] = _as_logged(told[signal], commanded)
        if a.axis is not None:
            axis = load.axes[a.axis]
            position = told[axis.position]
            own = logged.get(position.column)  # none where it has a default
            where = (axis.low + axis.high) / 2 if own is None else float(np.nanmedian(own)) * position.factor
            swept = axis.low + (axis.high - axis.low) * ((GOLDEN * np.arange(len(time))) % 1.0)
            values[position.column] = _as_logged(position, np.where(level[a.name] > 0.0, swept, where))
    units = {**run.loads.units, **{s.column: s.unit for s in load.signals}}
    loads = Table(start + time, values, {name: units[name] for name in values})
    return replace(_planned(run, sensors, (), name.replace(" ", "_")), loads=loads, sampling=SAMPLING)


def _as_logged(signal: Signal, values: np.ndarray) -> np.ndarray:
    """SI values as the log has them: `twin.logs.signals.as_meant` backwards."""
    return np.asarray(values * (math.sqrt(2.0) if signal.kind == "peak" else 1.0) / signal.factor)


def _held(time: np.ndarray, column: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Values (n,) at times (n,) [s], each held until the next; of a column without one NaN."""
    good = np.isfinite(column)
    if not good.any():
        return np.full(len(at), np.nan)
    last = np.clip(np.searchsorted(time[good], at, side="right") - 1, 0, int(good.sum()) - 1)
    return np.asarray(column[good][last])
