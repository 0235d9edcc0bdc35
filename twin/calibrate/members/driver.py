"""What a missing member may follow: a logged temperature, or a heat that a logged load makes.

A body of one time constant in an air of temperature T_a, heated by P, is at T with

    tau dT/dt = T_a - T + P / (h A),

so what it follows is a column of the log: the temperature itself, or a power of a load, in kelvin of rise in the long
run. Loads are scaled to a rise of 10 K at the largest value that was logged: what a heat does to the tool is then a
number of the same size as an expansion per kelvin, and one prior serves both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.logs.run import Run

RISE = 10.0  # K at the largest logged load: the unit of a heat, without influence on what is computed
# Shapes of a loss by the load that is logged: friction at constant force, a bearing's lubricant (paper 002, 4-6),
# viscous or eddy losses; 0.5 lies between a constant loss and one with the speed. Powers heat by a share of themselves.
# A current is none: without a resistance no law makes heat of it, and its square goes with the torque's anyway.
EXPONENTS = {"1/s": (0.5, 1.0, 5.0 / 3.0, 2.0), "m/s": (0.5, 1.0, 2.0), "W": (1.0,)}
LAWS = {"1/s": "turning_heat", "m/s": "speed_heat", "W": "power_share"}
LEAST_POWER = 10.0  # W that a logged power reaches at least: a share of it has to make RISE in 1 W/K


@dataclass(frozen=True)
class Driver:
    """A column of the log, as a member follows it."""

    column: str
    unit: str  # SI
    exponent: float = 1.0  # of a load
    largest: float = 1.0  # of a load, SI: where its heat makes RISE

    @property
    def is_temperature(self) -> bool:
        return self.unit == "degC"

    @property
    def words(self) -> str:
        """ "t4", "heat by spindle_speed^1.67"."""
        return self.column if self.is_temperature else f"heat by {self.column}^{self.exponent:.3g}"

    def values(self, run: Run) -> tuple[np.ndarray, np.ndarray]:
        """Times [s] and what a member of no lag would show there [K]: rises over the first reading, or by heat."""
        table = run.loads
        if self.column not in table.columns:
            assert run.temperatures is not None
            table = run.temperatures
        logged = table.columns[self.column]
        good = np.isfinite(logged)
        time, logged = table.time[good], logged[good]
        if self.is_temperature:
            return time, logged - logged[0]
        return time, RISE * (np.abs(logged) / self.largest) ** self.exponent


def drivers_of(runs: Sequence[Run], loads: Sequence[str] | None = None) -> tuple[Driver, ...]:
    """Every temperature that all runs logged, and every load that heats; loads: columns of loads.csv, all by default.

    A column that never changes drives nothing.
    """
    first = runs[0]
    tables = [t for t in (first.loads, first.temperatures) if t is not None]
    units = {name: table.units[name] for table in tables for name in table.columns}
    heating = [n for n in first.loads.columns if units[n] in EXPONENTS and (loads is None or n in loads)]
    found: list[Driver] = []
    for name, unit in units.items():
        values = _logged(runs, name) if unit == "degC" or name in heating else np.zeros(0)
        if not len(values) or np.ptp(values) == 0.0:
            continue
        if unit == "degC":
            found.append(Driver(name, unit))
        elif unit != "W" or np.abs(values).max() >= LEAST_POWER:
            found += [Driver(name, unit, p, float(np.abs(values).max())) for p in EXPONENTS[unit]]
    return tuple(found)


def _logged(runs: Sequence[Run], name: str) -> np.ndarray:
    """All readings of a column (n,); none where a run lacks it."""
    columns = [_column(run, name) for run in runs]
    readings = [c[np.isfinite(c)] for c in columns if c is not None]
    return np.concatenate(readings) if len(readings) == len(runs) and all(map(len, readings)) else np.zeros(0)


def _column(run: Run, name: str) -> np.ndarray | None:
    for table in (run.loads, run.temperatures):
        if table is not None and name in table.columns:
            return table.columns[name]
    return None
