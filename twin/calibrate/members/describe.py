"""Members written into a description: a node of every lag, with what they follow.

A body that follows a logged temperature stands in an environment of that signal; one that a load heats stands in air of
constant temperature. Only the lag, capacity over area times coefficient, is ever seen, so these are round numbers.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.calibrate.members.driver import LAWS, RISE, Driver
from twin.calibrate.members.responses import Candidate, short
from twin.logs.run import Run

AREA, COEFFICIENT = 0.01, 100.0  # m^2 and W/(m^2 K) of a member: 1 W/K in all
WIDE = 10.0  # K beyond the logged temperatures that a new signal may reach
_UNITS = {"1/s": (60.0, "1/min"), "m/s": (60.0, "m/min"), "W": (1.0, "W"), "A": (1.0, "A")}

Table = tuple[str, Mapping[str, object]]


@dataclass(frozen=True)
class Member:
    """A body beside the machine's own; expansion (3,) m/K, NaN along axes that were not measured."""

    candidate: Candidate
    expansion: np.ndarray


def with_members(text: str, members: Sequence[Member], scale: float, runs: Sequence[Run], mark: str = "found") -> str:
    """The text of a machine.toml with a node per member, a film and an environment per driver, and rows in
    [tcp.expansion] whose prior standard deviation is `scale` [m/K].

    A logged temperature that no signal of the machine reads becomes one. Where runs state one temperature at the start,
    the environment counts from there: what a sensor reads first is taken for that temperature.

    In a machine of parts they are nodes beside the parts.
    Raises DescriptionError for a load that no law turns into heat.
    """
    from twin.machine.extend import appended, changed  # the edge has no pydantic, and writes no descriptions

    data = tomllib.loads(text)
    signals = {s.get("column", name): name for name, s in data.get("signals", {}).items()}
    names_of = {section: set(data.get(section, {})) for section in ("signals", "nodes")}
    rows: dict[str, list[str]] = {}
    groups: dict[Driver, list[Member]] = {}
    for m in members:
        groups.setdefault(m.candidate.driver, []).append(m)
    tables: list[Table] = []
    for driver, own in groups.items():
        signal = signals.get(driver.column)
        if signal is None:
            signal = signals[driver.column] = _free(names_of["signals"], _bare(driver.column))
            tables.append((f"signals.{signal}", {"column": driver.column, **_signal(driver, runs)}))
        shape = "" if driver.is_temperature else f"_power_{driver.exponent:.3g}".replace(".", "_")
        base = _free(names_of["nodes"], f"follows_{_bare(driver.column)}{shape}")
        names = [f"{base}_{short(m.candidate.lag)}" for m in own]
        tables += _bodies(base, driver, names, [m.candidate.lag for m in own], signal, runs, data)
        rows |= {
            name: [f"{1e6 * v:.6g} um/K" for v in np.nan_to_num(m.expansion)]
            for name, m in zip(names, own, strict=True)
        }
    measured = np.isfinite(np.array([m.expansion for m in members])).any(axis=0)
    known = {"fixed": False, "tolerance": f"{1e6 * scale:.4g} um/K"}
    tables.append(("parameters", {"path": "*.follows_*", "fixed": True}))
    if "parts" not in data:  # beside parts these rows are no parameters
        tables += [
            ("parameters", {"path": f"tcp.expansion.follows_*.{'xyz'[a]}", **known}) for a in np.flatnonzero(measured)
        ]
    if data.get("tcp", {}).get("expansion"):
        text = changed(text, {f"tcp.expansion.{name}": row for name, row in rows.items()}, mark)
    else:
        tables.append(("tcp.expansion", rows))
    return appended(
        text, tables, f"missing members: bodies that follow {', '.join(dict.fromkeys(g.column for g in groups))}", mark
    )


def _bodies(
    base: str, driver: Driver, names: Sequence[str], lags: Sequence[float], signal: str, runs: Sequence[Run],
    data: Mapping[str, Any],
) -> list[Table]:  # fmt: skip
    nodes = [
        (f"nodes.{name}", {"capacity": f"{lag * AREA * COEFFICIENT:.9g} J/K", "area": f"{AREA} m^2"})
        for name, lag in zip(names, lags, strict=True)
    ]
    film = {
        "law": "constant_film", "surfaces": list(names), "environment": base, "emissivity": 0.0,
        "parameters": {"natural": f"{COEFFICIENT:g} W/(m^2*K)"},
    }  # fmt: skip
    around: dict[str, object] = {"signal": signal}
    if driver.is_temperature:
        if offset := _offset(driver.column, runs):
            around["offset"] = f"{offset:.4g} K"
        return [*nodes, (f"environment.{base}", around), (f"films.{base}", film)]
    around = {"temperature": f"{_start(runs, data):.6g} degC"}
    heat = [(f"sources.{name}", {"law": LAWS[driver.unit], "surface": name, **_heat(driver, signal)}) for name in names]
    return [*nodes, *heat, (f"environment.{base}", around), (f"films.{base}", film)]


def _heat(driver: Driver, signal: str) -> dict[str, object]:
    power = RISE * AREA * COEFFICIENT  # W at the largest logged load
    if driver.unit == "W":
        return {"parameters": {"share": power / driver.largest}, "signals": {"power": signal}}
    factor, unit = _UNITS[driver.unit]
    parameters = {
        "power": f"{power:g} W",
        "reference": f"{factor * driver.largest:.9g} {unit}",
        "exponent": driver.exponent,
    }
    return {"parameters": parameters, "signals": {"speed": signal}}


def _signal(driver: Driver, runs: Sequence[Run]) -> Mapping[str, object]:
    logged = np.concatenate([_logged(run, driver.column) for run in runs])
    if driver.is_temperature:
        low, high = float(np.nanmin(logged)) - WIDE, float(np.nanmax(logged)) + WIDE
        return {"unit": "degC", "range": [float(np.floor(low)), float(np.ceil(high))]}
    factor, unit = _UNITS[driver.unit]
    top = float(f"{1.2 * factor * float(np.nanmax(np.abs(logged))):.3g}")
    return {"unit": unit, "range": [0.0 if np.nanmin(logged) >= 0.0 else -top, top]}


def _offset(column: str, runs: Sequence[Run]) -> float:
    """K from the first reading to the stated start of the machine, in the mean over runs that state one."""
    found = [
        run.initial_temperature - float(logged[np.isfinite(logged)][0])
        for run in runs
        if run.initial_temperature is not None and np.isfinite(logged := _logged(run, column)).any()
    ]
    return float(np.mean(found)) if found else 0.0


def _start(runs: Sequence[Run], data: Mapping[str, Any]) -> float:
    stated = [run.initial_temperature for run in runs if run.initial_temperature is not None]
    if stated:
        return float(np.mean(stated))
    first = next((column for column, unit in runs[0].loads.units.items() if unit == "degC"), None)
    return 20.0 if first is None else float(np.nanmean(runs[0].loads.columns[first][:1]))


def _logged(run: Run, column: str) -> np.ndarray:
    if column in run.loads.columns:
        return run.loads.columns[column]
    return run.temperatures.columns[column] if run.temperatures is not None else np.zeros(0)


def _bare(name: str) -> str:
    """A column as a name of a description: "Spindle Motor" is "spindle_motor"."""
    return re.sub(r"\W+", "_", name).strip("_").lower() or "column"


def _free(taken: set[str], name: str) -> str:
    """The name, with a number where something begins with it already; it is taken from now on."""
    tried = (name, *(f"{name}_{k}" for k in range(2, len(taken) + 3)))
    free = next(t for t in tried if not any(other.startswith(t) for other in taken))
    taken.add(free)
    return free
