"""Units at the border: strings like "120 mm" become SI numbers, with the dimension checked.

Temperatures are points on the scale in degC; their differences are in K. Speeds of rotation are in revolutions per
second, written 1/s, and never in rad/s: a silent factor 2 pi is the usual mistake with them.

Reading a log must not cost the import of pint (0.3 s on an edge computer): what logs usually hold is in a table here,
and pint is asked for the rest.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pint

# No quantity of a machine comes near in SI: stiffnesses reach 1e10 N/m, Young's moduli 1e12 Pa. Beyond it a product
# of a few overflows, and sums lose what they are added to.
LARGEST = 1e15
# degC of a machine and what surrounds it: 293.15 is 20 degC in kelvin, and below absolute zero there is nothing.
COLDEST, HOTTEST = -60.0, 200.0
FURNACE = 1500.0  # degC, of surroundings that radiate
_ABSOLUTE_ZERO = -273.15  # degC

_ANGLES = {
    "radian",
    "degree",
    "revolution",
    "turn",
    "revolutions_per_minute",
    "revolutions_per_second",
    "arcminute",
    "arcsecond",
}


@dataclass(frozen=True)
class Unit:
    """A unit and its way to SI: value_si = factor * value + offset."""

    name: str  # as written
    si: str  # "m", "m/s", "A", "degC" (points on the scale), "K" (differences), "1/s", "1", "W/(m^2*K)"
    factor: float
    offset: float = 0.0


# The SI unit of each row comes first. Written forms are normalised before they are looked up: see _normalise.
_TABLE: dict[str, dict[str, float]] = {
    "1": {"1": 1.0, "": 1.0, "-": 1.0, "%": 0.01, "permille": 1e-3},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0, "d": 86400.0},
    "m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254, "inch": 0.0254},
    "m/s": {"m/s": 1.0, "mm/s": 1e-3, "um/s": 1e-6, "m/min": 1 / 60, "mm/min": 1e-3 / 60, "in/min": 0.0254 / 60},
    "m/s^2": {"m/s^2": 1.0, "mm/s^2": 1e-3},
    "1/s": {
        "1/s": 1.0,
        "Hz": 1.0,
        "rps": 1.0,
        "rev/s": 1.0,
        "1/min": 1 / 60,
        "rpm": 1 / 60,
        "rev/min": 1 / 60,
        "1/h": 1 / 3600,
    },
    "rad": {"rad": 1.0, "deg": math.pi / 180, "mrad": 1e-3, "urad": 1e-6, "arcsec": math.pi / 648000},
    "rad/s": {"rad/s": 1.0, "deg/s": math.pi / 180, "rad/min": 1 / 60, "deg/min": math.pi / 10800},
    "A": {"A": 1.0, "mA": 1e-3},
    "V": {"V": 1.0, "mV": 1e-3},
    "ohm": {"ohm": 1.0, "mohm": 1e-3},
    "W": {"W": 1.0, "mW": 1e-3, "kW": 1e3},
    "N": {"N": 1.0, "kN": 1e3},
    "N*m": {"N*m": 1.0, "Nm": 1.0, "J": 1.0, "kJ": 1e3},
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "bar": 1e5, "mbar": 100.0, "hPa": 100.0, "N/mm^2": 1e6},
    "N/m": {"N/m": 1.0, "N/mm": 1e3, "N/um": 1e6},
    "kg": {"kg": 1.0, "g": 1e-3, "t": 1e3},
    "kg/m^3": {"kg/m^3": 1.0, "g/cm^3": 1e3, "t/mm^3": 1e12},
    "m^3/s": {"m^3/s": 1.0, "l/min": 1e-3 / 60, "L/min": 1e-3 / 60, "l/h": 1e-3 / 3600, "m^3/h": 1 / 3600},
    "m^2/s": {"m^2/s": 1.0, "mm^2/s": 1e-6, "cSt": 1e-6},
    "W/(m*K)": {"W/(m*K)": 1.0, "W/m/K": 1.0, "W/mK": 1.0, "W/(mm*K)": 1e3},
    "W/(m^2*K)": {"W/(m^2*K)": 1.0, "W/m^2/K": 1.0, "W/m^2K": 1.0},
    "J/(kg*K)": {"J/(kg*K)": 1.0, "J/kg/K": 1.0, "J/kgK": 1.0, "kJ/(kg*K)": 1e3},
    "W/m^2": {"W/m^2": 1.0, "kW/m^2": 1e3},
    "W/K": {"W/K": 1.0},
    "1/K": {"1/K": 1.0, "um/(m*K)": 1e-6, "um/m/K": 1e-6, "ppm/K": 1e-6},
    "K": {"delta_degC": 1.0, "mK": 1e-3, "delta_degF": 5 / 9},
}
_KNOWN = {text: Unit(text, si, factor) for si, row in _TABLE.items() for text, factor in row.items()} | {
    "degC": Unit("degC", "degC", 1.0),
    "C": Unit("C", "degC", 1.0),  # what log files mean by it; nobody logs coulombs
    "K": Unit("K", "degC", 1.0, -273.15),  # a point on the scale; `to_si` knows where a difference is wanted
    "degF": Unit("degF", "degC", 5 / 9, -160 / 9),
}
_SPELLING = {
    "°C": "degC", "°F": "degF", "℃": "degC", "°/": "deg/", "°": "deg", "µ": "u", "μ": "u", "Ω": "ohm",
    "·": "*", "⋅": "*", "×": "*", "²": "^2", "³": "^3", "⁻¹": "^-1", "**": "^", "‰": "permille", " ": "",
    "U/min": "1/min", "min-1": "1/min", "min^-1": "1/min", "s-1": "1/s",
}  # fmt: skip


def _normalise(text: str) -> str:
    """One spelling per unit: "°C" is degC, "µm" um, "m²" m^2, "U/min" 1/min."""
    text = text.strip()
    for written, ours in _SPELLING.items():
        text = text.replace(written, ours)
    return "1/s" if text == "s^-1" else text


@cache
def _registry() -> pint.UnitRegistry:
    import pint

    return pint.UnitRegistry()


@cache
def parse_unit(text: str) -> Unit:
    """The unit written as `text` ("mm", "m/min", "°C", "W/(m^2*K)", "" for numbers without a unit).

    K is taken as a point on the temperature scale. Raises ValueError where the unit is unknown, or mixes angles into
    another unit.
    """
    text = _normalise(text)
    return _KNOWN[text] if text in _KNOWN else _ask_pint(text)


# Products, quotients and small powers of names only: pint evaluates numbers too, and 9^9^9^9 would never come back.
_FACTOR = r"(?:[A-Za-z_]+(?:\^\(?-?\d\)?)?|1)"
_EXPRESSION = re.compile(rf"\(*{_FACTOR}(?:\)*[*/]\(*{_FACTOR})*\)*")


def _ask_pint(text: str) -> Unit:
    import tokenize

    import pint

    if len(text) > 60 or not _EXPRESSION.fullmatch(text):
        raise ValueError(f"unknown unit '{text[:60]}'")
    try:
        unit = _registry().parse_units(text)
        one = _registry().Quantity(1.0, unit).to_base_units()
    except (pint.errors.PintError, AttributeError, TypeError, ValueError, ArithmeticError, AssertionError, KeyError,
            RecursionError, tokenize.TokenError, SyntaxError) as e:  # pint's parser raises all of these  # fmt: skip
        raise ValueError(f"unknown unit '{text}'") from e
    if _ANGLES & set(unit._units):
        raise ValueError(f"unit '{text}' mixes an angle with another unit: write rad/s, deg/s or 1/min")
    return Unit(text, _si_name(one), float(one.magnitude))


def _si_name(one: Any) -> str:
    """The table's name of the dimension of a pint quantity, else its base units."""
    return _dimensions().get(one.dimensionality) or f"{one.units:~C}" or "1"


@cache
def _dimensions() -> dict[Any, str]:
    parse = _registry().parse_units
    return {parse(si).dimensionality: si for si in _TABLE if not si.startswith(("rad", "1"))} | {
        parse("1/s").dimensionality: "1/s", parse("1/K").dimensionality: "1/K",
        parse("").dimensionality: "1",
    }  # fmt: skip


_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(.*)", re.DOTALL)


def to_si(value: float | int | str, unit: str) -> float:
    """`value` as a number in `unit` ("m", "W/(m^2*K)"; "degC" for points on the scale, "K" for differences).

    A bare number is taken to be in `unit` already, a string must say its unit.

    Raises ValueError naming the unit wanted.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(f"expected a number or a string with a unit of {unit or '1'}")
    if isinstance(value, int) and abs(value) > LARGEST:
        raise ValueError(f"a whole number of {value.bit_length()} bits is beyond all reason")
    if not isinstance(value, str):
        number = float(value)
    elif match := _QUANTITY.fullmatch(value):
        number = _convert(float(match[1]), match[2], unit, value)
    else:
        raise ValueError(f"'{value}' is not a quantity in {unit or '1'}")
    if not math.isfinite(number):
        raise ValueError(f"'{value}' is not a finite number")
    if abs(number) > LARGEST:
        raise ValueError(f"{number:g} {unit} is beyond all reason")
    return number


def surroundings_temperature(value: float) -> float:
    """The value [degC], where surroundings can have it: a furnace may stand beside a machine.

    Raises ValueError as `machine_temperature` does.
    """
    return value if HOTTEST - _ABSOLUTE_ZERO < value <= FURNACE else machine_temperature(value)


def machine_temperature(value: float) -> float:
    """The value [degC], where a machine or its surroundings can have it.

    Raises ValueError with what was probably meant.
    """
    if COLDEST <= value <= HOTTEST:
        return value
    celsius = value + _ABSOLUTE_ZERO
    if value > HOTTEST and COLDEST <= celsius <= HOTTEST:
        raise ValueError(f"{value:g} degC is no temperature of a machine: in kelvin? write '{value:g} K'")
    below = ": it is below absolute zero" if value < _ABSOLUTE_ZERO else ""
    raise ValueError(f"{value:g} degC is no temperature of a machine, {COLDEST:g} .. {HOTTEST:g} degC{below}")


def _convert(number: float, written: str, unit: str, whole: str) -> float:
    if not written.strip():
        if unit in ("", "1"):
            return number
        # 0.2 is 0.2 m by agreement, "0.2" is somebody's slip: was it mm?
        raise ValueError(f"'{whole}' has no unit: write '{whole.strip()} {unit}', or the number without quotes")
    difference = unit in ("K", "delta_degC", "mK")
    target = _KNOWN["delta_degC"] if unit == "K" else parse_unit(unit)
    try:
        source = parse_unit(written)
    except ValueError as e:
        raise ValueError(f"'{whole}' is not a quantity in {unit or '1'}: {e}") from e
    if difference and _normalise(written) == "K":
        source = _KNOWN["delta_degC"]
    if source.si != target.si:
        hint = "; a difference is written in K" if difference and source.si == "degC" else ""
        raise ValueError(f"'{whole}' is not a quantity in {unit or '1'}{hint}")
    return (number * source.factor + source.offset - target.offset) / target.factor
