"""The table of physical laws. A new law is one function, one row here, one test."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from twin.physics import films, losses


@dataclass(frozen=True)
class Argument:
    """A parameter or a signal of a law."""

    unit: str  # SI
    meaning: str
    default: float | None = None  # None: must be given
    low: float = 0.0  # physical bounds
    high: float = float("inf")


@dataclass(frozen=True)
class Law:
    """A cited function f(**signals, **parameters) -> W (loss) or W/(m^2 K) (film)."""

    function: Callable
    kind: str  # "loss" or "film"
    source: str  # citation with equation number
    signals: Mapping[str, Argument] = field(default_factory=dict)
    parameters: Mapping[str, Argument] = field(default_factory=dict)


LAWS: dict[str, Law] = {
    "motor_copper": Law(
        losses.motor_copper, "loss", "paper 000 eq (8) with erratum E-000-4",
        {"current": Argument("A", "phase current, rms")},
        {"resistance": Argument("ohm", "phase resistance")},
    ),
    "motor_holding": Law(
        losses.motor_holding, "loss", "paper 000 eq (8) with erratum E-000-4; standstill losses: paper 000, 4",
        {"current": Argument("A", "phase current, rms"), "speed": Argument("m/s", "axis speed", low=-float("inf"))},
        {
            "resistance": Argument("ohm", "phase resistance"),
            "drag": Argument("N", "speed-proportional iron and bearing loss, per unit axis speed", 0.0),
        },
    ),
    "guide_friction": Law(
        losses.guide_friction, "loss", "paper 004 eq (6)",
        {"speed": Argument("m/s", "axis speed", low=-float("inf"))},
        {
            "friction": Argument("1", "friction coefficient", 0.0015),
            "load": Argument("N", "normal load of all carriages"),
            "seal_drag": Argument("N", "drag of the seals", 0.0),
        },
    ),
    "screw_friction": Law(
        losses.screw_friction, "loss", "paper 002 eqs (7)-(10) with errata E-002-2 and E-002-7",
        {"speed": Argument("m/s", "axis speed", low=-float("inf"))},
        {
            "force": Argument("N", "mean axial force"),
            "preload": Argument("N", "preload of the nut", 0.0),
            "diameter": Argument("m", "pitch circle diameter"),
            "lead": Argument("m", "lead"),
            "friction": Argument("1", "friction coefficient of the ball contact", 0.005),
        },
    ),
    "bearing_friction": Law(
        losses.bearing_friction, "loss", "paper 002 eqs (4)-(6), ISO 15312, with errata E-002-1 and E-002-4",
        {"speed": Argument("1/s", "rotational speed", low=-float("inf"))},
        {
            "f0": Argument("1", "lubrication factor f0r", 2.0),
            "viscosity": Argument("m^2/s", "kinematic viscosity of the lubricant", 12e-6),
            "diameter": Argument("m", "mean bearing diameter d_m"),
            "f1": Argument("1", "load factor f1r", 2.5e-4),
            "load": Argument("N", "load P1", 0.0),
        },
    ),
    "constant_film": Law(
        films.constant_film, "film", "literature value, paper 000 eq (7)",
        {}, {"natural": Argument("W/(m^2*K)", "film coefficient of natural convection")},
    ),
    "forced_film": Law(
        films.forced_film, "film", "paper 000 eq (7): natural part plus forced part of moving components",
        {"speed": Argument("m/s", "speed of the surface through the air", low=-float("inf"))},
        {
            "natural": Argument("W/(m^2*K)", "film coefficient at rest"),
            "forced": Argument("W/(m^2*K)", "additional film coefficient at 1 m/s"),
            "exponent": Argument("1", "exponent of the speed", 0.8, 0.1, 1.0),
        },
    ),
}  # fmt: skip
