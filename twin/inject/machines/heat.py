"""Losses of drawn machines: laws with parameters of catalogues, each scaled to a drawn power at its usual signals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.inject.machines.draws import between, one_of, rounded, with_unit
from twin.physics.laws import LAWS
from twin.units import to_si

# Signals of a machine by what stands behind the axis' name: unit, and top of the certified range. Logs use 80 % of it.
SIGNALS: dict[str, tuple[str, float]] = {
    "speed": ("m/min", 30.0), "current": ("A", 12.0), "screw_speed": ("1/min", 3000.0),
    "spindle_speed": ("1/min", 6000.0), "pump": ("1", 1.0),
}  # fmt: skip
USUAL = 0.6  # of a signal's top: where a law gives the power that is drawn; logs go up to 80 %
WARM = 30.0  # degC, of laws that follow a temperature there
POWER = (8.0, 50.0)  # W, of one source at its usual signals: drives, bearings and pumps of small machines
INTO_SMALL, INTO_LARGE = (5.0, 25.0), (25.0, 100.0)  # W, into blocks and nuts of a kilogram, and into beds and heads

# Of each law: signals it reads, and parameters as (low, high, unit, whether the power is proportional to it)
_Range = tuple[float, float, str, bool]
_LAWS: dict[str, tuple[dict[str, str], dict[str, _Range]]] = {
    "motor_copper": ({"current": "current"}, {"resistance": (0.3, 1.0, "ohm", True)}),
    "motor_winding": ({"current": "current"}, {"resistance": (0.3, 1.0, "ohm", True)}),
    "axis_motor": (
        {"current": "current", "speed": "speed"},
        {"resistance": (0.3, 1.0, "ohm", True), "lead": (10, 20, "mm", False), "hysteresis": (0.2, 0.5, "W*s", True),
         "friction_torque": (0.05, 0.2, "N*m", True)},
    ),
    "screw_friction": (
        {"speed": "speed"},
        {"force": (300, 900, "N", True), "preload": (1000, 3000, "N", True), "diameter": (20, 32, "mm", False),
         "lead": (10, 20, "mm", False)},
    ),
    "guide_friction": (
        {"speed": "speed"}, {"load": (2, 8, "kN", True), "seal_drag": (30, 120, "N", True)},
    ),
    "guide_preload": (
        {"speed": "speed"},
        {"dynamic_rating": (20, 50, "kN", True), "seal_drag": (10, 30, "N", True), "carriages": (4, 4, "", False)},
    ),
    "bearing_friction": (
        {"speed": "screw_speed"},
        {"f0": (1, 4, "", True), "viscosity": (20, 68, "mm^2/s", False), "diameter": (35, 60, "mm", False),
         "f1": (2.5e-4, 5e-4, "", True), "load": (0.5, 2, "kN", False)},
    ),
    "bearing_friction_warm": (
        {"speed": "screw_speed"},
        {"f0": (1, 4, "", True), "viscosity_40": (46, 68, "mm^2/s", False), "viscosity_100": (7, 9, "mm^2/s", False),
         "diameter": (35, 60, "mm", False), "f1": (2.5e-4, 5e-4, "", True), "load": (0.5, 2, "kN", False)},
    ),
    "turning_heat": (
        {"speed": "spindle_speed"},
        {"power": (50, 200, "W", True), "reference": (3000, 5000, "1/min", False), "exponent": (1.2, 1.7, "", False)},
    ),
    "speed_heat": (
        {"speed": "speed"},
        {"power": (50, 200, "W", True), "reference": (10, 20, "m/min", False), "exponent": (1.0, 1.3, "", False)},
    ),
    "constant_heat": ({}, {"power": (20, 100, "W", True)}),
    "switched_heat": ({"switch": "pump"}, {"power": (20, 100, "W", True)}),
}  # fmt: skip


@dataclass(frozen=True)
class Heat:
    """A source: where its heat goes, its law, signals by their whole names, parameters as (number, unit, scaled)."""

    name: str
    place: Mapping[str, Any]  # surface, or contact and rail_share
    law: str
    signals: Mapping[str, str]
    parameters: Mapping[str, tuple[float, str, bool]]

    def table(self, factor: float) -> dict[str, Any]:
        """Its table in machine.toml with its power times a factor."""
        values = {k: rounded(v * factor) if scaled else v for k, (v, _, scaled) in self.parameters.items()}
        shown = {k: with_unit(v, self.parameters[k][1]) if self.parameters[k][1] else v for k, v in values.items()}
        found: dict[str, Any] = {"law": self.law, **self.place, "parameters": shown}
        return {**found, "signals": dict(self.signals)} if self.signals else found


def heat(
    rng: np.random.Generator,
    name: str,
    law: str,
    place: Mapping[str, Any],
    axis: str = "",
    power: tuple[float, float] = POWER,
) -> Heat:
    """A source by a law; place: as in its table; axis: whose signals it reads (those of the spindle and pump are one).

    Its power at USUAL of its signals is drawn out of `power` [W], and the law's parameters are scaled to it.
    """
    read, ranges = _LAWS[law]
    signals = {k: f"{axis}_{of}" if of not in ("spindle_speed", "pump") and axis else of for k, of in read.items()}
    if not axis:  # bearings of a spindle
        signals = {k: "spindle_speed" if of == "screw_speed" else of for k, of in signals.items()}
    drawn = {k: (between(rng, low, high) if low < high else low, unit) for k, (low, high, unit, _) in ranges.items()}
    factor = between(rng, *power) / _usual_power(law, signals, drawn)
    scaled = {k: rounded(v * factor) if ranges[k][3] else v for k, (v, _) in drawn.items()}
    return Heat(name, place, law, signals, {k: (scaled[k], unit, ranges[k][3]) for k, (_, unit) in drawn.items()})


def kind_of(signal: str) -> str:
    """ "speed" of "x_speed"; the key of SIGNALS."""
    return signal if signal in SIGNALS else signal.split("_", 1)[1]


def signal_table(signal: str) -> dict[str, Any]:
    """The table of a signal."""
    unit, top = SIGNALS[kind_of(signal)]
    low = -top if kind_of(signal) in ("speed", "screw_speed") else 0.0
    return {"unit": unit, **({"kind": "rms"} if unit == "A" else {}), "range": [low, top]}


def drive_law(rng: np.random.Generator) -> str:
    return one_of(rng, ("motor_copper", "motor_winding", "axis_motor"))


def _usual_power(law: str, signals: Mapping[str, str], drawn: Mapping[str, tuple[float, str]]) -> float:
    """W at the usual signals."""
    found = LAWS[law]
    values = {k: to_si(with_unit(v, u), found.parameters[k].unit) if u else v for k, (v, u) in drawn.items()}
    for k, name in signals.items():
        unit, top = SIGNALS[kind_of(name)]
        values[k] = to_si(with_unit(USUAL * top, unit), found.signals[k].unit) if unit != "1" else USUAL * top
    given = {k: a.default for k, a in found.parameters.items() if a.default is not None}
    return float(found.function(**{**given, **values, **dict.fromkeys(found.states, WARM)}))
