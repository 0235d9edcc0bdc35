"""The laws that the films of models/five_axis really have: others than described, so that no gain makes up for them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class OtherFilm:
    """The law that a film really has, near the described one in mid-range."""

    law: str
    parameters: Mapping[str, str | float]
    signal: str = ""  # that its speed reads
    emissivity: float = 0.84  # paint that has aged
    gain: float = 1.0  # on top of the described one


def _vertical(height: float, gain: float, emissivity: float) -> OtherFilm:
    return OtherFilm("free_vertical_plate_laminar", {"height": f"{height} m"}, "", emissivity, gain)


def _forced(natural: float, forced: float, exponent: float, signal: str, emissivity: float = 0.84) -> OtherFilm:
    values: dict[str, str | float] = {
        "natural": f"{natural} W/(m^2*K)",
        "forced": f"{forced} W/(m^2*K)",
        "exponent": exponent,
    }
    return OtherFilm("forced_film", values, signal, emissivity)


FILMS: dict[str, OtherFilm] = {
    "bed": _forced(2.3, 5.5, 0.75, "draught"),
    "bed_inside": OtherFilm("constant_film", {"natural": "1.7 W/(m^2*K)"}, "", 0.0),
    "column": _vertical(1.5, 1.5, 0.15),  # the wind of X is a constant part
    "column_inside": OtherFilm("constant_film", {"natural": "0.6 W/(m^2*K)"}, "", 0.0),
    "axis_motors": _forced(3.0, 9.5, 0.8, "draught"),
    "y_motor": _forced(4.0, 6.5, 0.7, "x_speed"),  # some 15 K above the air
    "headstock": _forced(2.4, 4.5, 0.7, "x_speed"),
    "headstock_ends": _vertical(0.5, 1.3, 0.84),
    "carriage": _forced(2.3, 4.5, 0.65, "z_speed"),
    "x_screw": _forced(3.6, 72.0, 0.65, "x_speed", 0.2),
    "y_screw": _forced(3.6, 72.0, 0.65, "y_speed", 0.2),
    "z_screw": _forced(3.6, 72.0, 0.65, "z_speed", 0.2),
}
