"""Units at the border: strings like "120 mm" become SI numbers, with the dimension checked."""

from __future__ import annotations

from functools import cache

import pint


@cache
def _registry() -> pint.UnitRegistry:
    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def to_si(value: float | int | str, unit: str) -> float:
    """`value` as a number in the SI unit `unit` ("m", "W/(m^2*K)"; "degC" for points on the temperature scale).

    A bare number is taken to be in `unit` already. Raises ValueError naming the expected unit.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(f"expected a number or a string with a unit of {unit}")
    if not isinstance(value, str):
        return float(value)
    try:
        quantity = _registry().Quantity(value)
        return float(quantity.to(unit).magnitude)
    except (pint.errors.PintError, AttributeError, TypeError, ValueError, AssertionError) as e:
        raise ValueError(f"'{value}' is not a quantity in {unit}") from e
