"""The temperature that a run begins at where it does not say so: what its sensors read first.

A machine that ran the day before is kelvins warmer than the air, and not everywhere alike. What the sensors read in the
first minutes tells both: their median where the machine begins as a whole, and how far they are from it by how much
parts may differ. Without such readings it begins at the temperature of its surroundings. After a rest, of which a run
may say so, a part is where the model has it but for as much as its sensors differ from the air: that moved, too.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from twin.logs.run import Run
from twin.rom.drive import Drive, measured_air
from twin.rom.load_model import LoadModel

FIRST = 120.0  # s from the start, two steps: light parts have not warmed up yet


@dataclass(frozen=True)
class Beginning:
    """Of a run, every part alike but for what is not known."""

    temperature: float  # degC
    stated: bool = False  # the run says so
    rested: bool = False  # in equilibrium with its surroundings, of which those of the machine have this temperature
    apart: float = 0.0  # K rms, by which sensors read something else


def beginning_of(load: LoadModel, sensors: Collection[str], run: Run, drive: Drive) -> Beginning:
    """Where a run begins; sensors: of the structure."""
    if run.initial_temperature is not None:
        return Beginning(run.initial_temperature, stated=True)
    air = float(measured_air(load, drive)[0, load.surroundings])
    read = _first(sensors, run, drive.time[0] + FIRST)
    middle = air if run.steady_start or not len(read) else float(np.median(read))
    apart = float(np.sqrt(np.mean((read - middle) ** 2))) if len(read) else 0.0
    return Beginning(middle, stated=run.steady_start, rested=run.steady_start, apart=apart)


def _first(sensors: Collection[str], run: Run, until: float) -> np.ndarray:
    """(k,) degC: means of what the sensors that have readings by then show."""
    table = run.temperatures
    if table is None:
        return np.zeros(0)
    first = table.time <= until
    read = [values[first & np.isfinite(values)] for name, values in table.columns.items() if name in sensors]
    return np.array([own.mean() for own in read if len(own)])
