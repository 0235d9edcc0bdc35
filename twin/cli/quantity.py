"""Quantities on the command line: '60 s', '1 um'."""

from __future__ import annotations

import click


class Quantity(click.ParamType):
    """An option with a unit; its value is a number in SI."""

    name = "text"

    def __init__(self, unit: str, zero: bool = False, negative: bool = False):
        self.unit, self.zero, self.negative = unit, zero, negative

    def convert(self, value: str | float, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The value in SI. Raises TwinError naming the option."""
        from twin.face.inputs import positive, quantity

        if isinstance(value, float):  # click may ask twice
            return value
        name = param.opts[0] if param is not None else ""
        if self.negative:
            return quantity(name, value, self.unit)
        return positive(name, value, self.unit, self.zero)
