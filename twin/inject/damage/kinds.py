"""Logs with a fault that was not there: what channels, clocks and measurements get wrong, one pure function per kind.

A fault acts from `start` to `end` [s]. Amplitudes are SI; all else in a run stays as it is. A damaged table counts as
computed (`Run.synthetic`): nobody is to take it for a measurement.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from twin.errors import LogError
from twin.inject.damage import rows, sensors, signals, tcp
from twin.inject.damage.channels import Damage
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


DAMAGES: dict[str, dict[str, Kind]] = {
    "sensor": {
        "offset": Kind(sensors.offset, "K", "reads too much by a constant"),
        "drift": Kind(sensors.drift, "K", "drifts linearly, in all by this"),
        "lag": Kind(sensors.lag, "s", "follows with this time constant"),
        "detached": Kind(sensors.detached, "1", "shows its surroundings (--signal) by this share", True),
        "stuck": Kind(sensors.stuck, "s", "keeps its value for this time"),
        "noise": Kind(sensors.noise, "K", "reads too much by twice this, with noise of this"),
        "rail": Kind(sensors.rail, "degC", "shows this, whatever it measures"),
        "elsewhere": Kind(sensors.elsewhere, "", "is mounted where this sensor is, on another part"),
        "swapped": Kind(sensors.swapped, "", "has the name of this sensor, which has its name"),
    },
    "signal": {
        "factor": Kind(signals.factor, "1", "is logged too large by this factor"),
        "averaged": Kind(signals.averaged, "s", "is logged as means over this time"),
        "clock": Kind(signals.clock, "s", "is stamped too late by this"),
        "splice": Kind(rows.splice, "s", "holds rows of a time later by this from its start on"),
    },
    "slip": {"play": Kind(tcp.slip, "m", "a support has this play")},
    "initial_state": {"offset": Kind(signals.initial_state, "K", "the stated temperature is too high by this")},
    "measurement": {
        "drift": Kind(tcp.drift, "m", "the device drifts linearly, in all by this"),
        "frame": Kind(tcp.frame, "1", "reads more in proportion to the axis position, by this per metre"),
        "stuck": Kind(tcp.stuck, "s", "keeps its value for this time"),
        "rezero": Kind(tcp.rezero, "m", "is set to this at its start"),
        "heating": Kind(tcp.heating, "m", "grows by this from the first to the last row of every measurement"),
    },
    "not_thermal": {
        "step": Kind(tcp.step, "m", "something moves"),
        "load": Kind(tcp.load, "m", "something bends with a load (--signal), at its largest by this", True),
    },
}
