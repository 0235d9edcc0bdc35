"""The temperature that a run begins at where it does not say so: what its sensors read first.

A machine that ran the day before is kelvins warmer than the air, and not everywhere alike. What the sensors read in the
first minutes tells both: their median where the machine begins as a whole, and how far they are from it by how much
parts may differ. Of one that ran just before, every part begins where its sensors say, or those of its neighbours
(`twin.diagnose.model.first_field`). Without such readings a machine begins at the temperature of its surroundings.
After a rest, of which a run may say so, a part is where the model has it but for as much as its sensors differ from the
air: that moved, too.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from twin.diagnose.model.first_field import FirstField, first_field
from twin.logs.run import Run
from twin.rom.apply import member_field
from twin.rom.drive import Drive, measured_air
from twin.rom.model import MachineModel

WARM = 1.0  # K rms of the first readings about their median, from which the machine is no more as warm everywhere
FIRST = 120.0  # s from the start, two steps: light parts have not warmed up yet


@dataclass(frozen=True)
class Beginning:
    """Of a run; without a field every part is alike, but for what is not known."""

    temperature: float  # degC
    stated: bool = False  # the run says so
    rested: bool = False  # in equilibrium with its surroundings, of which those of the machine have this temperature
    apart: float = 0.0  # K, by which a part may be somewhere else: a standard deviation
    field: FirstField | None = None  # K beside the temperature

    def spread(self, member: str) -> float:
        """K by which a member may begin elsewhere: a standard deviation."""
        if self.field is None or member not in self.field.members:
            return self.apart
        return self.field.spread[self.field.members.index(member)]

    def of(self, model: MachineModel) -> np.ndarray:
        """(N,) K beside the temperature, in the coordinates of a model of the machine."""
        if self.field is None:
            return np.zeros(model.n)
        known = dict(zip(self.field.members, self.field.offset, strict=True))
        fields = [b.one * 0.0 for b in model.bodies]
        for z, body in zip(fields, model.bodies, strict=True):
            for i, member in enumerate(body.members):
                z += known.get(member, 0.0) * member_field(body, i)
        return np.concatenate(fields)


def beginning_of(model: MachineModel, run: Run, drive: Drive) -> Beginning:
    """Where a run of a model begins, of which the sensors are those of its structure."""
    if run.initial_temperature is not None:
        return Beginning(run.initial_temperature, stated=True)
    air = float(measured_air(model.load_model, drive)[0, model.load_model.surroundings])
    read = _first(model.sensors, run, drive.time[0] + FIRST)
    values = np.array([own.mean() for own in read.values()])
    middle = air if run.steady_start or not read else float(np.median(values))
    apart = float(np.sqrt(np.mean((values - middle) ** 2))) if read else 0.0
    if run.steady_start or apart <= WARM or not all(body.members for body in model.bodies):
        return Beginning(middle, stated=run.steady_start, rested=run.steady_start, apart=apart)
    field = first_field(model, drive, {name: float(own[0]) for name, own in read.items()}, middle)
    return Beginning(middle, apart=max(field.spread), field=field)


def _first(sensors: Collection[str], run: Run, until: float) -> dict[str, np.ndarray]:
    """degC by sensor: what those that have readings by then show."""
    table = run.temperatures
    if table is None:
        return {}
    first = table.time <= until
    read = {name: values[first & np.isfinite(values)] for name, values in table.columns.items() if name in sensors}
    return {name: own for name, own in read.items() if len(own)}
