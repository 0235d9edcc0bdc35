"""The channels of a run that a fault acts on, and the run with others in their place."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from twin.errors import LogError
from twin.logs.run import Run, Table
from twin.nearest import did_you_mean

COMPONENTS = ("dx", "dy", "dz")
SET_GAP = 600.0  # s: TCP rows closer than that belong to one measurement


@dataclass(frozen=True)
class Damage:
    """One fault of a log."""

    family: str
    place: str  # "sensors.x_nut", "signals.x_current" (a column of loads.csv), "tcp.dx", "tcp.dx:z" (an axis), "run"
    size: float  # SI
    history: str = ""  # the kind; "" for the family's first
    signal: str = ""  # a column that it follows
    other: str = ""  # swapped, elsewhere: the other sensor, "sensors.y_nut"
    start: float = -math.inf  # s
    end: float = math.inf


def acts(time: np.ndarray, d: Damage) -> np.ndarray:
    """(n,) whether a fault acts."""
    return (time >= d.start) & (time < d.end)


def grown(time: np.ndarray, d: Damage) -> np.ndarray:
    """(n,) from 0 at the start of a fault to 1 at its end; by default over all of the table."""
    first, last = max(d.start, float(time[0])), min(d.end, float(time[-1]))
    return np.clip((time - first) / max(last - first, 1e-9), 0.0, 1.0)


def expect_whole(run: Run, d: Damage) -> None:
    """Raise LogError unless a fault is one of a run as a whole, from its start to its end: "run", "runs.FOLDER"."""
    known = ["run", f"runs.{run.folder.resolve().name}"]
    if d.place not in known:
        raise LogError(f"no such place: '{d.place}'", d.place, did_you_mean(d.place, known, "places"))
    if (d.start, d.end) != (-math.inf, math.inf):
        raise LogError("is a fault of a whole run", "--from, --to", "leave them out")


def sensor_of(run: Run, place: str) -> tuple[Table, str]:
    """The temperatures and the column of "sensors.NAME". Raises LogError where there is none."""
    section, _, name = place.partition(".")
    columns: Mapping[str, np.ndarray] = run.temperatures.columns if run.temperatures is not None else {}
    if section != "sensors" or name not in columns or run.temperatures is None:
        remedy = did_you_mean(place, [f"sensors.{n}" for n in columns], "sensors of this run")
        raise LogError(f"no sensor '{place}'", str(run.folder / "temperatures.csv"), remedy)
    return run.temperatures, name


def load_of(run: Run, place: str) -> str:
    """The column of "signals.NAME". Raises LogError where there is none."""
    section, _, name = place.partition(".")
    if section != "signals" or name not in run.loads.columns:
        remedy = did_you_mean(place, [f"signals.{n}" for n in run.loads.columns], "columns of this run")
        raise LogError(f"no column '{place}'", str(run.folder / "loads.csv"), remedy)
    return name


def column_at(run: Run, name: str, time: np.ndarray) -> np.ndarray:
    """A column of the loads, held until its next row, or of the temperatures, at other times."""
    if name in run.loads.columns:
        at = np.searchsorted(run.loads.time, time, side="right") - 1
        return run.loads.columns[name][np.clip(at, 0, None)]
    temperatures = run.temperatures
    if temperatures is not None and name in temperatures.columns:
        return np.interp(time, temperatures.time, temperatures.columns[name])
    known = [*run.loads.columns, *(temperatures.columns if temperatures is not None else ())]
    what = f"no column '{name}'" if name else "needs a column that it follows"
    raise LogError(what, "--signal", did_you_mean(name, known, "columns of this run"))


def tcp_time(run: Run) -> np.ndarray:
    """(m,) s of the TCP rows. Raises LogError where there are none."""
    if run.tcp is None or not len(run.tcp.time):
        raise LogError("has no tcp.csv", str(run.folder), "take a run with TCP measurements, or simulate one")
    return run.tcp.time


def component(place: str) -> int:
    """Which of COMPONENTS a place like "tcp.dx" is. Raises LogError for others."""
    known = [f"tcp.{c}" for c in COMPONENTS]
    if place not in known:
        raise LogError(f"no such place: '{place}'", place, did_you_mean(place, known, "places"))
    return known.index(place)


def component_and_axis(run: Run, place: str) -> tuple[str, np.ndarray]:
    """Of a place like "tcp.dx:z": "tcp.dx" and the positions (m,) [m] of axis z. Raises LogError for others."""
    known = [f"tcp.{c}:{a}" for c in COMPONENTS for a in (run.tcp.axes if run.tcp is not None else ())]
    if place not in known or run.tcp is None:
        raise LogError(f"no such place: '{place}'", place, did_you_mean(place, known, "places"))
    name, _, axis = place.partition(":")
    return name, np.nan_to_num(run.tcp.position[:, run.tcp.axes.index(axis)])


def set_of(time: np.ndarray) -> np.ndarray:
    """(m,) the number of the measurement that each TCP row belongs to: rows that follow within `SET_GAP` are one."""
    return np.concatenate([[0], np.cumsum(np.diff(time) > SET_GAP)])


def with_sensors(run: Run, columns: Mapping[str, np.ndarray]) -> Run:
    """The run with other columns of temperatures."""
    assert run.temperatures is not None
    table = replace(run.temperatures, columns={**run.temperatures.columns, **columns})
    return marked(replace(run, temperatures=table), "temperatures")


def with_load(run: Run, name: str, values: np.ndarray) -> Run:
    """The run with another column of loads."""
    table = replace(run.loads, columns={**run.loads.columns, name: values})
    return marked(replace(run, loads=table), "loads")


def with_tcp(run: Run, d: Damage, shape: np.ndarray) -> Run:
    """size times shape (n,) added to a component; from its first row on where tcp.csv counts from that."""
    assert run.tcp is not None
    displacement = np.array(run.tcp.displacement, dtype=float)
    from_first = shape - shape[0] if run.tcp_reference == "first" else shape
    displacement[:, component(d.place)] += d.size * from_first
    return marked(replace(run, tcp=replace(run.tcp, displacement=displacement)), "tcp")


def marked(run: Run, table: str) -> Run:
    """The run with a table that was computed."""
    return replace(run, synthetic=tuple(dict.fromkeys([*run.synthetic, table])))
