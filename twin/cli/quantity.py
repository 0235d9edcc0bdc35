"""Quantities on the command line: '60 s', '1 um'."""

from __future__ import annotations

import math

from twin.errors import TwinError
from twin.units import to_si


def option(name: str, text: str, unit: str) -> float:
    """The value in SI. Raises TwinError naming the option."""
    try:
        try:
            return to_si(float(text), unit)
        except ValueError:
            return to_si(text, unit)
    except ValueError as e:
        raise TwinError(str(e), name, f"write a number with a unit of {unit}, for example {name} '1 {unit}'") from e


def positive(name: str, text: str, unit: str, zero: bool = False) -> float:
    """The same above zero, or from zero on."""
    value = option(name, text, unit)
    if not math.isfinite(value) or value < 0.0 or (value == 0.0 and not zero):
        wanted = "zero or a positive value" if zero else "a positive value"
        raise TwinError(f"{text} is out of range", name, f"give {wanted}, for example {name} '1 {unit}'")
    return value
